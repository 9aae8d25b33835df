"""Spin about the normal in a world: what pivots slows down and stops, and keeps nobody awake."""

from __future__ import annotations

from dataclasses import replace
from math import exp, pi, sqrt

import numpy as np
import pytest

from contactlaw import MATERIALS, Body, ContactPair, Material, collide
from contactlaw.world import World
from sims.contact_point import static_overlap
from tests.world.chains import Chain, Link
from tests.world.world_scenes import goes_on_alike

RADIUS, GRAVITY, DENSITY = 0.01, 9.81, 7833.0
MASS = DENSITY * 4.0 / 3.0 * pi * RADIUS**3
INERTIA = 0.4 * MASS * RADIUS**2


def steel(friction: float = 0.3, restitution: float = 0.5) -> ContactPair:
    return ContactPair("steel", "steel", friction=friction, restitution=restitution)


def overlap_at_rest() -> float:
    return static_overlap(steel(), MASS * GRAVITY, RADIUS)


def slowing() -> float:
    """Of a ball that pivots [rad/s^2]: 3 pi/16 mu P a/I."""
    return 3.0 * pi / 16.0 * 0.3 * MASS * GRAVITY * sqrt(RADIUS * overlap_at_rest()) / INERTIA


def pivoting(spin: float, tree: bool = False, friction: float = 0.3) -> World:
    """A ball at rest on a floor, but for its spin about the normal."""
    world = World(timestep=1e-3)
    place = (0.0, 0.0, RADIUS - overlap_at_rest())
    if tree:
        chain = Chain([Link(MASS, INERTIA)], free=True)
        _, (body,) = world.add_tree(chain, [*place, 1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0, 0.0, spin])
    else:
        body = world.add_body(MASS, INERTIA, place, spin=(0.0, 0.0, spin))
    floor = world.add_plane(None, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    world.add_contact(world.add_sphere(body, RADIUS), floor, steel(friction))
    return world


@pytest.mark.parametrize("tree", [False, True])
def test_a_pivoting_ball_slows_stops_and_sleeps(tree: bool) -> None:
    world = pivoting(0.4, tree)
    energy = world.energy.total
    world.step(200)
    assert (0.4 - world.spin[0, 2]) / 0.2 == pytest.approx(slowing(), rel=0.01)
    row = world.contacts[0]
    assert row["moment"][2] == pytest.approx(-INERTIA * slowing(), rel=0.01)
    assert row["friction_work"] == pytest.approx(0.5 * INERTIA * (world.spin[0, 2] ** 2 - 0.4**2), rel=0.01)
    for _ in range(40):
        world.step(50)
        assert world.energy.total < energy + 1e-15
        energy = world.energy.total
    assert world.asleep[0] and not world.spin.any() and not world.velocity.any()


def test_a_crowd_that_pivots_slows_as_one_contact_does() -> None:
    """A column of balls, too many for an implicit step, slips on its floor alone: its angular momentum goes as P a."""
    count, stiffness = 22, 4.0 / 3.0 * steel().effective_modulus
    world = World(timestep=2e-3)
    shapes, height = [], 0.0
    for number in range(count):
        pressed = (count - number) * MASS * GRAVITY
        overlap = (pressed / (stiffness * sqrt(RADIUS if number == 0 else 0.5 * RADIUS))) ** (2.0 / 3.0)
        height += (RADIUS if number == 0 else 2.0 * RADIUS) - overlap
        shapes.append(world.add_sphere(world.add_body(MASS, INERTIA, (0.0, 0.0, height), spin=(0.0, 0.0, 0.4)), RADIUS))
    floor = world.add_plane(None, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    world.add_contact(shapes, floor, steel(0.1))
    world.add_contact(shapes, shapes, steel(0.9))
    world.step(25)
    before = world.spin[:, 2].sum()
    world.step(100)
    expected = slowing() / 3.0 * count ** (4.0 / 3.0)
    assert (before - world.spin[:, 2].sum()) / 0.2 == pytest.approx(expected, rel=5e-3)
    assert world.spin[:, 2].min() > 0.0


@pytest.mark.parametrize("crowd", [0, 4])
@pytest.mark.parametrize(("load", "drift"), [(0.034, 0.02887), (0.8, 0.8138)])
def test_what_pivots_drifts_under_a_load_as_a_hertz_contact_slipping_everywhere(
    load: float, drift: float, crowd: int
) -> None:
    """Among many contacts too, which follow spin in every eighth substep; load: over mu P, drift: over omega a.

    By the sum of Coulomb's tractions mu p(r) against v + omega r over the contact; little load: 8/(3 pi) load.
    """
    rate, pair = 5.0, steel(0.1)
    world = World(timestep=2e-4, gravity=(load * 0.1 * GRAVITY, 0.0, -GRAVITY), crowd=crowd)
    floor = world.add_plane(None, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    foot = world.add_body(1.0, (1e6, 1e6, 1.0), (0.0, 0.0, RADIUS), spin=(0.0, 0.0, rate))  # does not roll
    world.add_contact(world.add_sphere(foot, RADIUS), floor, pair)
    world.step(500)
    start = world.position[foot, 0]
    world.step(500)
    width = sqrt(RADIUS * static_overlap(pair, GRAVITY, RADIUS))
    assert (world.position[foot, 0] - start) / 0.1 == pytest.approx(drift * rate * width, rel=2e-3)


def test_without_friction_a_ball_pivots_for_ever() -> None:
    world = pivoting(0.4, friction=0.0)
    world.step(200)
    assert world.spin[0, 2] == 0.4 and not world.contacts["moment"].any()


def test_a_ball_that_rolls_straight_has_no_torsion() -> None:
    world = pivoting(0.0)
    world.arrays.bodies["velocity"][1, 0] = 0.1
    world.arrays.bodies["spin"][1, 1] = 0.1 / RADIUS
    world.step(100)
    assert (world.arrays.contacts["torsion"]["span"][world.arrays.contacts["phase"] == 1] == 0.0).all()


def test_what_pivots_goes_on_from_a_copy_to_the_bit() -> None:
    world = pivoting(0.3)
    world.step(50)
    goes_on_alike(world, 100)


@pytest.mark.parametrize(("resistance", "restitution", "spins"), [
    (0.0, 1.0, [(900.0, 20.0, 5.0), (-700.0, 0.0, -40.0)]),
    (0.5, 0.9, [(90.0, 200.0, 5.0), (-70.0, 0.0, -400.0)]),
], ids=["pivoting", "rolling"])  # fmt: skip
def test_two_spinning_balls_keep_their_momenta(resistance: float, restitution: float, spins: list) -> None:
    """Head on, spinning against each other about the line of centres and across it, with resistance to rolling too."""
    world = World(gravity=0.0, timestep=1e-4)
    bodies = [
        world.add_body(MASS, INERTIA, (-0.0101, 0.0, 0.0), (1.0, 0.0, 0.0), spin=spins[0]),
        world.add_body(MASS, INERTIA, (0.0101, 0.001, 0.0), (-1.0, 0.3, 0.0), spin=spins[1]),
    ]
    first, second = (world.add_sphere(body, RADIUS) for body in bodies)
    pair = replace(steel(restitution=restitution), rolling_resistance=resistance)
    world.add_contact(first, second, pair)
    (linear, angular), energy, spin = world.momentum, world.energy.total, world.spin.copy()
    world.step(10)
    assert not world.contacts["closed"].any()
    assert np.abs(world.momentum[0] - linear).max() < 1e-14 * MASS * 2.0
    assert np.abs(world.momentum[1] - angular).max() < 1e-13 * INERTIA * np.abs(spins).max()
    assert world.energy.total < energy
    # Fast enough, torsion slows both along the line of centres, beside what friction across does to both.
    change = world.spin - spin
    assert resistance > 0.0 or change[0, 0] - change[1, 0] < 0.0


def test_a_heap_of_balls_comes_to_rest() -> None:
    """Eight steel balls fall into a box: all sleep in the end, but those that roll freely on the floor."""
    rng = np.random.default_rng(0)
    world = World(timestep=2e-3)
    half = 2.4 * RADIUS
    walls = [world.add_plane(None, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))]
    for sign in (-1.0, 1.0):
        walls.append(world.add_plane(None, (sign * half, 0.0, 0.0), (-sign, 0.0, 0.0)))
        walls.append(world.add_plane(None, (0.0, sign * half, 0.0), (0.0, -sign, 0.0)))
    balls = []
    for i in range(8):
        place = np.array([(i % 2 - 0.5) * 2.1, (i // 2 % 2 - 0.5) * 2.1, 1.5 + 2.2 * (i // 4)]) * RADIUS
        body = world.add_body(MASS, INERTIA, place + rng.uniform(-1e-3, 1e-3, 3) * [1, 1, 0])
        balls.append(world.add_sphere(body, RADIUS))
    world.add_contact(balls, [*balls, *walls], steel())
    highest = world.energy.total
    for _ in range(40):
        world.step(50)
        assert world.energy.total < highest * (1.0 + 1e-12)
    closed = world.contacts[world.contacts["closed"]]
    touching = np.bincount(closed["bodies"][closed["bodies"] >= 0].ravel(), minlength=8)
    free = (touching == 1) & ~world.asleep
    assert (world.asleep | free).all() and free.sum() <= 2
    assert np.abs(world.spin[:, 2]).max() < 1e-9


@pytest.mark.parametrize(("timestep", "error"), [(0.1, 0.02), (0.5, 0.02), (1.42, 0.02), (5.0, 0.12)])
def test_a_ball_that_rolls_and_pivots_slows_as_it_creeps_in_any_step(timestep: float, error: float) -> None:
    """Its spin falls by a factor of 1.5 in five seconds."""
    soft = Material(3.4e6, 0.09, 7800.0)
    world = World(gravity=0.08, timestep=timestep)
    floor = world.add_plane(None, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    body = world.add_body(MASS, INERTIA, (0.0, 0.0, RADIUS - 5e-6))
    pair = ContactPair(soft, soft, 4.6, 0.05)
    world.add_contact(world.add_sphere(body, RADIUS), floor, pair)
    world.step(round(20.0 / timestep))
    world.place(0, velocity=(0.07, 0.0, 0.0), spin=(0.0, 0.07 / RADIUS, 0.8))
    before = world.energy.total
    for _ in range(round(20.0 / timestep)):
        world.step()
        assert world.energy.total < before + 1e-9 * world.energy.kinetic
        before = world.energy.total
    width = sqrt(RADIUS * static_overlap(pair, 0.08 * MASS, RADIUS))
    # over the spin: Kalker's of a contact without a force, at this Poisson's ratio
    moment = (1.204 + 1.378**2 / 3.49) * soft.shear_modulus * width**4 / 0.07
    assert world.spin[0, 2] == pytest.approx(0.8 * exp(-20.0 * moment / INERTIA), rel=error)
    assert world.spin[0, 1] == pytest.approx(0.07 / RADIUS, rel=1e-3)


def slowed_by(pair: ContactPair, mass: float) -> float:
    """Loss of spin in an impact at 1 m/s [rad/s]: Lubkin's limit 3 pi/16 mu P a over force and overlap of `collide`."""
    impact = collide(pair, Body(2.0 * mass, RADIUS, velocity=(0, 0, -1)), Body(2.0 * mass, RADIUS))
    moment = 3.0 * pi / 16.0 * pair.friction * impact.normal_force * np.sqrt(0.5 * RADIUS * impact.overlap.clip(0.0))
    return float(np.trapezoid(moment, impact.time)) / INERTIA


@pytest.mark.parametrize("law", ["microslip", "coulomb"])
@pytest.mark.parametrize("restitution", [1.0, 0.8, 0.3])
def test_in_an_impact_spin_slips_under_the_whole_normal_force(restitution: float, law: str) -> None:
    """Two balls, head on."""
    pair = replace(steel(0.01, restitution), law=law)
    world = World(gravity=0.0, timestep=1e-3)
    for way in (1.0, -1.0):
        ball = world.add_body(MASS, INERTIA, (0, 0, way * 1.02 * RADIUS), (0, 0, -way * 0.5), spin=(0, 0, way * 1e3))
        world.add_sphere(ball, RADIUS)
    world.add_contact(0, 1, pair)
    world.step(2)
    assert 1e3 - world.spin[0, 2] == pytest.approx(slowed_by(pair, 0.5 * MASS), rel=5e-3)


@pytest.mark.parametrize("law", ["microslip", "coulomb"])
def test_in_a_crowd_it_does_so_too(law: str) -> None:
    """Six balls on six that lie on a heavy plate, one after the other: each impact has few substeps."""
    pair, world = replace(steel(0.01, 0.8), law=law), World(gravity=0.0, timestep=1e-3)
    plate = world.add_body(1e6, 1e6)
    fixed = [world.add_sphere(plate, RADIUS, (3.0 * k * RADIUS, 0.0, 0.0)) for k in range(6)]
    for k in range(6):
        place = (3.0 * k * RADIUS, 0.0, 2.02 * RADIUS + 2e-6 * k)
        world.add_sphere(world.add_body(MASS, INERTIA, place, (0, 0, -1), spin=(0, 0, 1e3)), RADIUS)
    world.add_contact(range(6, 12), fixed, pair)
    world.step(2)
    assert 1e3 - world.spin[1:, 2] == pytest.approx(slowed_by(pair, MASS), rel=3e-2)


def test_friction_of_what_slides_and_spins_begins_with_the_impact() -> None:
    """However little of a substep is left then: a contact that is smaller than its innermost ring has friction too."""
    resin, radius, mass, substep = Material(5.84e9, 0.34), 0.026, 0.14, 3.5e-6

    def after(share: float) -> np.ndarray:
        world = World(gravity=0.0, timestep=substep)
        place, turn = (0.0, 0.0, radius + 1.7 * substep * (1.0 - share)), (0.0, 66.0, -38.0)
        ball = world.add_body(mass, 0.4 * mass * radius**2, place, (0.0, 1.0, -1.7), spin=turn)
        pair = ContactPair(resin, resin, friction=0.14, restitution=0.5)
        world.add_contact(world.add_sphere(ball, radius), world.add_plane(None, (0, 0, 0), (0, 0, 1)), pair)
        world.step(130)
        return world.velocity[ball]

    assert after(0.02) == pytest.approx(after(0.5), abs=1e-5)


SOFT, STEEL = Material(3e9, 0.25), MATERIALS["steel"]


def outward(load: float, radius: float, spin: float, force: float, speed: float, material: Material) -> float:
    """Creep [m/s] of a contact of two bodies of a material that spins and rolls, under a force across its way.

    That of Kalker's linear theory, F/(G a^2) = (3.67 v - 1.47 a spin)/speed for nu = 1/4.
    """
    square = radius * static_overlap(ContactPair(material, material, friction=1.0), load, radius)
    stiff = 7.0 / 4.0 / (2.0 - material.poissons_ratio)  # over that of nu = 1/4
    return (force * speed / (stiff * material.shear_modulus * square) + 1.47 * sqrt(square) * spin) / 3.67


@pytest.mark.parametrize(
    ("timestep", "material"),
    [(5e-4, SOFT), (1e-3, SOFT), (2e-3, SOFT), (1e-2, SOFT), (1e-3, STEEL), (1.5e-3, STEEL), (2e-3, STEEL)],
)
def test_balls_of_a_thrust_bearing_creep_outwards_as_they_roll(timestep: float, material: Material) -> None:
    """Three balls run round between a floor and a disc that turns; in long steps one by one, in substeps.

    A ball moves outwards by the mean of its creep over both. Over both it spins, the mean by half the disc's rate, and
    both together carry its centripetal force: half of it each, as creep is linear in force and spin.
    """
    rate, ring, load, pair = 20.0, 0.05, 10.0, ContactPair(material, material, friction=1.5, restitution=0.5)
    world = World(timestep=timestep)
    floor = world.add_plane(None, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    depth = static_overlap(pair, load / 3.0, RADIUS)
    heavy = load / GRAVITY * 0.06**2
    high = 2.0 * (RADIUS - depth) + 0.01
    disc = world.add_body(load / GRAVITY, (heavy / 4.0, heavy / 4.0, heavy / 2.0), (0, 0, high), spin=(0, 0, rate))
    balls = []
    for angle in 2.0 * pi / 3.0 * np.arange(3):
        out, way = np.array([np.cos(angle), np.sin(angle), 0.0]), np.array([-np.sin(angle), np.cos(angle), 0.0])
        velocity, spin = 0.5 * rate * ring * way, -0.5 * rate * ring / (RADIUS - depth) * out
        body = world.add_body(MASS, INERTIA, ring * out + [0, 0, RADIUS - depth], velocity, spin=spin)
        balls.append(world.add_sphere(body, RADIUS))
    world.add_contact(balls, [floor, world.add_cylinder(disc, 0.07, 0.01)], pair)
    world.step(round(0.1 / timestep))
    start = np.hypot(*world.position[1:, :2].T)
    world.step(round(0.2 / timestep))
    turning = 0.5 * world.spin[disc, 2]
    inward = 0.5 * MASS * turning**2 * start.mean()
    expected = outward(load / 3.0, RADIUS, turning, inward, turning * start.mean(), material)
    assert (np.hypot(*world.position[1:, :2].T) - start) / 0.2 == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("timestep", [5e-4, 1e-3, 2e-3])
def test_a_ball_on_a_turntable_creeps_outwards_as_it_rolls(timestep: float) -> None:
    """It runs round a circle at 2/7 of the table's rate, F = 2/7 m Omega v."""
    rate, speed, pair = 10.0, 0.3, ContactPair(SOFT, SOFT, friction=1.5, restitution=0.5)
    world, circle = World(timestep=timestep), 3.5 * speed / rate
    table = world.add_plane(world.add_body(np.inf, 1.0, spin=(0.0, 0.0, rate)), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    depth = static_overlap(pair, MASS * GRAVITY, RADIUS)
    spin = (0.1 * rate - speed) / (RADIUS - depth)
    ball = world.add_body(MASS, INERTIA, (0.1, 0.0, RADIUS - depth), (0.0, speed, 0.0), spin=(spin, 0.0, 0.0))
    world.add_contact(world.add_sphere(ball, RADIUS), table, pair)
    world.step(round(0.3 / timestep))
    for _ in range(4):
        world.step()
        place, up = world.position[ball], np.array([0.0, 0.0, 1.0])
        slip = world.velocity[ball] - np.cross(world.spin[ball], RADIUS * up) - np.cross(rate * up, place)
        out = (place - [0.1 - circle, 0.0, 0.0]) * [1.0, 1.0, 0.0]
        rolled = RADIUS * np.hypot(*world.spin[ball, :2])
        turning, force = rate - world.spin[ball, 2], 2.0 / 7.0 * MASS * rate * speed
        expected = outward(MASS * GRAVITY, RADIUS, turning, force, rolled, SOFT)
        assert slip @ out / np.hypot(*out[:2]) == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("timestep", [2e-3, 5e-3, 1e-2])
@pytest.mark.parametrize("slide", [0.0, 0.5])
def test_a_ball_that_rolls_or_slides_and_spins_takes_implicit_steps(timestep: float, slide: float) -> None:
    """Spin leaves hardly any friction for the slip of what rolls, and none begins to stick or to slide by it."""
    ends = []
    for step in (timestep, 1e-4):
        world = World(timestep=step)
        floor = world.add_plane(None, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
        start = (0.0, 0.0, RADIUS - overlap_at_rest())
        spin = (0.0, (1.0 - slide) / RADIUS, 60.0)
        ball = world.add_body(MASS, INERTIA, start, (1.0, 0.0, 0.0), spin=spin)
        world.add_contact(world.add_sphere(ball, RADIUS), floor, steel(0.2))
        world.step(round(0.5 / step))
        ends.append(np.concatenate([world.position[ball], world.velocity[ball], RADIUS * world.spin[ball]]))
        taken = world.arrays.world[0]["implicit"]
        assert taken >= 0.9 * round(0.5 / step) or step < timestep
    np.testing.assert_allclose(ends[0], ends[1], atol=2e-5)
