"""What lasts: implicit steps go where explicit ones go, keep momentum, gain no energy, and are undone if they fail."""

from __future__ import annotations

from math import cos, radians, sin
from typing import Any

import numpy as np
import pytest

from contactlaw import MATERIALS, ContactPair, Material
from contactlaw.laws.kalker import compliances
from contactlaw.world import World
from contactlaw.world.data.quaternion import rotate, rotation_vector
from contactlaw.world.data.vec import scale
from contactlaw.world.implicit.equations import room_for
from contactlaw.world.trees.description import Joint, Part, Tree
from sims.contact_point import static_overlap
from tests.world.chains import Chain, Link
from tests.world.jointed_scenes import TIP, arm_over_floor, rod
from tests.world.lasting_scenes import FRICTION, INERTIA, LENGTH, MASS, RADIUS, STEEL, ball, pair, sweeping_arm
from tests.world.world_scenes import mass_of

HALF, FOOT, BOX = 0.05, 0.005, 1.0
SHORT = 5e-5  # [s], a step that resolves no more than an impact: none is implicit
BEGIN = 0.01  # [s] in short steps, in which loads set in with a swing that longer ones damp


def box(timestep: float, friction: float, tilt: float = 20.0) -> World:
    """A box on eight ball feet on a slope, the x axis down along it, with the overlap that it rests with."""
    a = radians(tilt)
    world = World(gravity=(9.81 * sin(a), 0.0, -9.81 * cos(a)), timestep=timestep)
    floor = world.add_plane(None, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    sunk = static_overlap(pair(), 0.25 * BOX * 9.81 * cos(a), FOOT)
    body = world.add_body(BOX, BOX / 6.0 * (2.0 * HALF) ** 2, (0.0, 0.0, HALF + FOOT - sunk))
    corners = [(x * HALF, y * HALF, z * HALF) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    world.add_contact([world.add_sphere(body, FOOT, corner) for corner in corners], floor, pair(friction))
    return world


def count(world: World, what: str) -> int:
    """How many steps of an island were implicit; how often equations were solved."""
    return int(world.arrays.world[what][0])


SCENES: dict[str, tuple[Any, float]] = {
    "rolls": (lambda dt: ball(dt, 1.0, 1.0 / RADIUS), 0.2),
    "slides": (lambda dt: ball(dt, 6.0), 0.2),
    "slides, then rolls": (lambda dt: ball(dt, 1.0), 0.2),
    "box that slides": (lambda dt: box(dt, 0.2), 0.2),
}
"""By name: what makes it, and how long it goes on [s]."""


@pytest.mark.parametrize("spin", [20.0, 60.0])
def test_an_uneven_ball_that_rolls_keeps_its_angular_momentum(spin: float) -> None:
    """About its contact point, across the normal (Chaplygin's ball). Gyroscopic moments of the step's start: 9e-3."""
    inertia, turning = INERTIA * np.array([0.8, 1.0, 1.2]), spin * np.array([0.6, 0.8, 0.3])
    world = World(timestep=1e-3)
    floor = world.add_plane(None, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    height = (0.0, 0.0, RADIUS)
    body = world.add_body(MASS, inertia, height, np.cross(turning, height), spin=turning)
    world.add_contact(world.add_sphere(body, RADIUS), floor, pair())
    kept = []
    for steps in (100, 1000):
        world.step(steps)
        turn = rotation_vector(tuple(world.quaternion[body]))
        own = rotate(turn, tuple(inertia * rotate(scale(-1.0, turn), tuple(world.spin[body]))))
        kept.append((own + MASS * np.cross(height, world.velocity[body]))[:2])
    assert count(world, "implicit") > 1050
    assert np.abs(kept[1] - kept[0]).max() < 5e-6 * np.linalg.norm(kept[0])


@pytest.mark.parametrize("timestep", [1e-3, 2e-3, 5e-3])
@pytest.mark.parametrize("name", SCENES)
def test_implicit_steps_go_where_explicit_ones_go(name: str, timestep: float) -> None:
    make, time = SCENES[name]
    made, fine = make(SHORT), make(SHORT)
    start = made.position[0]
    for world in (made, fine):
        world.step(round(BEGIN / SHORT))
    made.timestep = timestep
    for world in (made, fine):
        world.step(round(time / world.timestep))
    assert count(fine, "implicit") == 0 and count(fine, "kicks") > 0
    assert count(made, "implicit") > 0
    path = max(float(np.linalg.norm(fine.position[0] - start)), 0.01 * RADIUS)
    assert np.abs(made.position - fine.position).max() < 1e-7 * path
    assert np.abs(made.velocity - fine.velocity).max() < 1e-6 * max(path / time, 1e-3)


@pytest.mark.parametrize("timestep", [1e-3, 2e-3, 5e-3])
def test_newtons_method_gives_up_where_a_slide_reverses_at_each_iteration(timestep: float) -> None:
    make, time = SCENES["slides, then rolls"]
    world, steps = make(timestep), round(time / timestep)
    solved = [0]
    for _ in range(steps):
        world.step()
        solved.append(count(world, "solved"))
    assert count(world, "implicit") < steps  # as the ball begins to roll
    assert np.diff(solved).max() <= 4


@pytest.mark.parametrize("timestep", [1e-3, 2e-3, 5e-3])
@pytest.mark.parametrize("speed", [1e-7, 1e-5, 1e-4])
def test_a_ball_that_hardly_moves_comes_to_rest_where_it_belongs(speed: float, timestep: float) -> None:
    sunk = static_overlap(pair(), MASS * 9.81, RADIUS)
    made, fine = ball(timestep, down=speed), ball(SHORT, down=speed)
    for world in (made, fine):
        world.step(round(0.1 / world.timestep))
        assert world.asleep[0] and not world.velocity.any()
        assert RADIUS - world.position[0, 2] == pytest.approx(sunk, rel=1e-6)
    assert count(fine, "implicit") == 0
    assert np.abs(made.position - fine.position).max() < 1e-7 * sunk
    assert count(made, "implicit") > 0 or speed < 1e-6


@pytest.mark.parametrize("name", SCENES)
def test_no_step_gains_energy(name: str) -> None:
    make, time = SCENES[name]
    world = make(2e-3)
    world.step()  # which finds the overlaps of the start
    last = world.energy.total
    scale = abs(world.energy.kinetic) + abs(world.energy.potential)
    for _ in range(round(time / 2e-3)):
        world.step()
        assert world.energy.total < last + 1e-14 * scale
        last = world.energy.total


def test_friction_takes_mu_times_the_normal_impulse_while_a_slide_vibrates() -> None:
    """Newton's method then ends at a share of the vibrations, see `implicit.step.solve`."""
    plastic, dt = Material(3e9, 0.35, 1200.0), 2e-3
    world, half = World(timestep=dt), np.array([0.03, 0.02, 0.02])
    body = world.add_body(1.0, (half @ half - half * half) / 3.0, (0.0, 0.0, 0.02))
    floor = world.add_plane(None, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    world.add_contact(world.add_box(body, half), floor, ContactPair(plastic, plastic, FRICTION, 0.6))
    world.step(300)
    world.place(0, velocity=(0.5, 0.0, 0.0))
    world.step()
    before = count(world, "implicit")
    start, up = world.velocity[0], []
    for i in range(1, 60):
        world.step()
        v = world.velocity[0]
        up.append(abs(v[2]))
        assert start[0] - v[0] == pytest.approx(FRICTION * (9.81 * dt * i + v[2] - start[2]), abs=1e-12)
    assert count(world, "implicit") == before + 59
    assert max(up) > 1e-5 and up[-1] < 1e-9


def test_a_ball_that_lands_sliding_and_spinning_does_not_hop_on() -> None:
    """One iteration for a stage is enough for steady slides alone; a ball that moves up and down would for ever."""
    resin, radius, mass = Material(5.84e9, 0.34), 0.02625, 0.1406
    table = ContactPair(resin, resin, 0.212, 0.5, law="mindlin")
    world = World(timestep=2e-3)
    floor = world.add_plane(None, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    spin = np.array([-1.0, -0.515, -1.0]) / radius
    body = world.add_body(mass, 0.4 * mass * radius**2, (0.0, 0.0, radius + 2e-3), (-1.45, 1.02, 0.0), spin=spin)
    world.add_contact(world.add_sphere(body, radius), floor, table)
    world.step(45)
    for _ in range(15):
        world.step()
        assert abs(world.velocity[body, 2]) < 1e-5
        assert count(world, "implicit") > 0


def test_a_box_on_a_slope_falls_asleep_and_does_not_creep() -> None:
    world = box(2e-3, 0.5)
    first = world.position[0]
    for _ in range(200):
        before = world.position[0]
        world.step()
        if world.asleep[0]:
            break
        assert np.abs(world.position[0] - first).max() < 1e-6
    assert world.asleep[0]
    assert np.abs(world.position[0] - before).max() < 1e-12
    lying = world.position[0]
    world.step(5000)
    np.testing.assert_array_equal(world.position[0], lying)
    assert world.contacts["force"].sum(0) == pytest.approx(-BOX * world.gravity, rel=1e-6)


def test_a_soft_contact_beside_stiff_ones_lasts_with_them() -> None:
    """A foot of rubber that carries next to nothing would by itself swing over fifty steps."""
    world = box(2e-3, 0.5)
    soft = ContactPair(MATERIALS["rubber"], STEEL, 0.5, 0.5)
    world.add_contact(world.add_sphere(0, FOOT, (0.0, 0.0, -HALF)), 0, soft)
    world.step(10)
    before = count(world, "kicks")
    world.step(20)
    assert count(world, "kicks") == before and len(world.contacts) == 5
    assert np.abs(world.velocity).max() < 1e-12


@pytest.mark.parametrize("kind", ["sphere", "box"])
def test_a_plate_on_many_feet_comes_to_rest(kind: str) -> None:
    """A hundred corners side by side, or balls, are a spring that is ten times as fast as each of them."""
    world = World(timestep=2e-3)
    floor = world.add_plane(None, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    plate = world.add_body(1.0, 2e-3, (0.0, 0.0, FOOT))
    sides = np.linspace(-0.1, 0.1, 10 if kind == "sphere" else 5)
    add, size = (world.add_sphere, FOOT) if kind == "sphere" else (world.add_box, (FOOT, FOOT, FOOT))
    feet = [add(plate, size, (x, y, 0.0)) for x in sides for y in sides]
    world.add_contact(feet, floor, ContactPair(MATERIALS["rubber"], STEEL, 0.5, 0.5))
    world.step(200)
    assert len(world.contacts) == 100 and world.asleep[0]
    assert world.contacts["force"].sum(0) == pytest.approx(-world.gravity, rel=1e-6)


def pressed(timestep: float, push: float, velocities: Any, spins: Any) -> World:
    """Two balls in flight that equal and opposite forces [N] press on each other."""
    world = World(gravity=0.0, timestep=timestep)
    half = RADIUS - 0.5 * static_overlap(pair(), push, 0.5 * RADIUS)
    shapes = []
    for side, velocity, spin in zip((-1.0, 1.0), velocities, spins, strict=True):
        body = world.add_body(MASS, INERTIA, (side * half, 0.0, 0.0), velocity, spin=spin)
        shapes.append(world.add_sphere(body, RADIUS))
    world.add_contact(shapes[0], shapes[1], pair())
    world.arrays.bodies["acceleration"][1:, 0] = [push / MASS, -push / MASS]
    return world


@pytest.mark.parametrize(
    ("velocities", "spins"),
    [
        ([(0.3, 0.1, -0.2)] * 2, [(20.0, 0.0, 0.0), (-5.0, 0.0, 0.0)]),
        ([(0.3, 0.1, -0.2)] * 2, [(20.0, 50.0, 0.0), (-5.0, 50.0, 0.0)]),
    ],
)
def test_an_implicit_step_keeps_momentum(velocities: Any, spins: Any) -> None:
    world = pressed(1e-3, 1.0, velocities, spins)
    linear, angular = world.momentum
    spin = world.spin
    world.step(3)
    assert count(world, "implicit") > 0 and np.abs(world.spin - spin).max() > 1e-3
    assert np.abs(world.momentum[0] - linear).max() < 1e-14 * MASS
    if spins[0][1] == 0.0:  # or friction moves them, and the forces turn the two
        assert np.abs(world.momentum[1] - angular).max() < 1e-14 * (MASS * 0.3 * RADIUS + INERTIA * 20.0)


def without_implicit_steps(world: World) -> World:
    """The same world, in which there is no room for the equations of any island."""
    world._arrays = world.arrays._replace(equations=np.zeros(room_for(0)))
    return world


def check_failures(make: Any, steps: int) -> int:
    """Find implicit steps that are tried and fail; each must leave what a world has that does not try."""
    made, twin, found = make(), without_implicit_steps(make()), 0
    for _ in range(steps):
        saved = made.save()
        before = count(made, "implicit"), count(made, "solved")
        made.step()
        if count(made, "implicit") == before[0] and count(made, "solved") > before[1]:
            found += 1
            twin.restore(saved._replace(equations=np.zeros(room_for(0))))
            twin.step()
            assert count(twin, "solved") == before[1]
            for what in ("position", "velocity", "spin", "quaternion"):
                np.testing.assert_array_equal(getattr(made, what), getattr(twin, what))
            for what in ("force", "overlap", "impulse", "friction_work", "moment"):
                np.testing.assert_array_equal(made.contacts[what], twin.contacts[what])
            assert made.energy == twin.energy
    return found


def test_an_implicit_step_that_fails_leaves_the_state_to_the_bit() -> None:
    assert check_failures(lambda: ball(5e-3, 1.0), 60) > 0


def test_an_arm_comes_to_lie_as_it_does_in_short_steps() -> None:
    arms = [arm_over_floor(1e-3, 0.5, timestep=dt) for dt in (2e-3, 5e-3, SHORT)]
    for arm in arms:
        first = last = arm.energy.total
        for _ in range(round(0.4 / arm.timestep)):
            arm.step()
            assert arm.energy.total < last + 1e-6 * first
            last = arm.energy.total
        assert (count(arm, "implicit") > 0) == (arm.timestep > SHORT)
    q = [arm.tree(0)[0][0] for arm in arms]
    assert np.ptp(q) < 1e-9
    assert all(arm.asleep.all() for arm in arms[:2])


@pytest.mark.parametrize("timestep", [1e-3, 2e-3])
def test_a_wheel_rolls_as_far_as_it_turns(timestep: float) -> None:
    """On a carriage of two slides, under a push, but for its creep; it turns by up to 0.1 rad a step."""
    world = World(gravity=(1.0, 0.0, -9.81), timestep=timestep)
    slides = [Joint("slide", axis=axis) for axis in ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0))]
    _, (wheel,) = world.add_tree(Tree([Part(MASS, INERTIA, [*slides, Joint()], position=(0.0, 0.0, RADIUS))]))
    floor = world.add_plane(None, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    world.add_contact(world.add_sphere(wheel, RADIUS), floor, pair())
    area = RADIUS * static_overlap(pair(), 9.81 * MASS, RADIUS)
    held = INERTIA / (INERTIA + MASS * RADIUS**2) * MASS  # of the push
    creep = held / (STEEL.shear_modulus * area) * compliances(0.0, STEEL.poissons_ratio)[0]
    for _ in range(4):
        world.step(round(0.1 * RADIUS / timestep / timestep / 4))
        (x, _, angle), (v, _, spin) = world.tree(0)
        assert v == pytest.approx(RADIUS * spin * (1.0 + creep), rel=1e-7)
        assert x == pytest.approx(RADIUS * angle, rel=1e-4)
    assert count(world, "implicit") > 100


def swinging(timestep: float) -> tuple[World, float]:
    """A heavy rod on a hinge, whose tip lies on the floor, with a pendulum; the height [m] of that over its hinge."""
    world, height = World(timestep=timestep), 0.1
    mass, far, inertia = rod(0.005, LENGTH, 10.0 * mass_of(TIP))
    links = [Link(mass, (1e-6, inertia, inertia), (-far, 0.0, 0.0)),
             Link(0.05 * mass, 1e-9, (0.0, 0.0, height), anchor=(0.9 * LENGTH - far, 0.0, 0.0))]  # fmt: skip
    _, bodies = world.add_tree(Chain(links), [0.0, 0.3])
    floor = world.add_plane(None, (0.0, 0.0, -TIP), (0.0, 0.0, 1.0))
    world.add_contact(world.add_sphere(bodies[0], TIP, (LENGTH - far, 0.0, 0.0)), floor, pair())
    return world, height


@pytest.mark.parametrize("timestep", [1e-3, 2e-3, 5e-3])
def test_what_swings_on_a_rod_that_lies_swings_no_higher(timestep: float) -> None:
    world, height = swinging(timestep)
    steps = round(1.0 / timestep)
    world.step(steps)
    heights = []
    for _ in range(2 * steps):
        world.step()
        (rod_angle, angle), (rod_rate, rate) = (values[:2] for values in world.tree(0)[:2])
        heights.append((height * (rod_rate + rate)) ** 2 / 19.62 + height * (1.0 - cos(rod_angle + angle)))
    assert count(world, "implicit") >= 2 * steps
    assert max(heights[steps:]) == pytest.approx(max(heights[:steps]), rel=1e-4)
    assert max(heights) == pytest.approx(height * (1.0 - cos(0.3)), rel=10.0 * timestep)


def test_an_implicit_step_of_an_arm_that_fails_leaves_the_state_to_the_bit() -> None:
    assert check_failures(lambda: sweeping_arm(2e-3, 1.0), 100) > 0


def test_a_block_that_rocks_on_two_edges_takes_implicit_steps():
    """A tilt moves the contacts along crowned edges by metres a radian: Newton's method has to know."""
    world = World(timestep=2e-3)
    beam = world.add_box(None, (0.1, 0.015, 0.01), at=(0.0, 0.0, -0.01))
    block = world.add_box(world.add_body(1.0, 4e-4, (0.0, 0.003, 0.025)), (0.025, 0.025, 0.025))
    world.add_contact(block, beam, pair(0.8))
    world.step(500)
    found, solved = int(world.arrays.world["implicit"][0]), int(world.arrays.world["solved"][0])
    world.arrays.bodies["spin"][1] = 0.0, 2e-3, 0.0
    world.step(20)
    assert world.arrays.world["implicit"][0] - found == 20
    assert world.arrays.world["solved"][0] - solved <= 30
    assert len(world.contacts) == 2


@pytest.mark.parametrize("timestep", [2e-3, 5e-3, 1e-2])
def test_a_box_on_a_belt_that_starts_neither_hops_nor_gains_speed(timestep):
    """The start makes its corners vibrate; steps that only nearly followed them made that grow until the box hopped."""
    world = World(timestep=timestep)
    belt, body = world.add_body(np.inf, 1.0), world.add_body(0.05, 2e-5, (0.0, 0.0, 0.03))
    crate = world.add_box(body, (0.03, 0.03, 0.03), rounding=5e-4)
    floor = world.add_plane(belt, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    world.add_contact(crate, floor, ContactPair(STEEL, STEEL, friction=0.6, restitution=0.2))
    world.step(round(0.05 / timestep))
    height = world.position[body, 2]
    world.place(belt, velocity=(5.0, 0.0, 0.0))
    for k in range(round(0.2 / timestep)):
        world.step()
        assert world.velocity[body, 0] == pytest.approx(0.6 * 9.81 * (k + 1) * timestep, abs=2e-4)
        assert world.position[body, 2] == pytest.approx(height, abs=1e-6)


@pytest.mark.parametrize("flat", [False, True])
@pytest.mark.parametrize("timestep", [2e-3, 1e-2])
def test_what_lies_on_a_heavy_body_that_settles_does_not_hop(flat, timestep):
    """Its contact is a hundred times as fast as that of the heavy body; 1 g on 1000 t had been thrown up by metres."""
    world = World(timestep=timestep)
    below = world.add_body(1e6, 6e6, (0.0, 0.0, 3.0))
    above = world.add_body(1e-3, 2.7e-7, (0.0, 0.0, 6.02))
    shapes = [world.add_box(b, (h, h, h)) if flat else world.add_sphere(b, h) for b, h in ((below, 3.0), (above, 0.02))]
    floor = world.add_plane(None, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    world.add_contact(shapes, [floor, *shapes], ContactPair(STEEL, STEEL, friction=0.3, restitution=0.5))
    for _ in range(round(0.3 / timestep)):
        world.step()
        assert world.position[above, 2] - world.position[below, 2] == pytest.approx(3.02, abs=1e-6)


def test_a_ball_that_settles_on_a_lift_does_not_hop_again():
    """A first stage whose last iteration had no contact had counted as solved: the ball left at 8 mm/s."""
    for fall in np.linspace(2e-5, 2e-4, 12):
        world = World(timestep=1e-3)
        lift = world.add_body(np.inf, 1.0, velocity=(0.0, 0.0, 0.05))
        body = world.add_body(1e-3, 1e-8, (0.0, 0.0, 5e-3 + fall), (0.0, 0.0, 0.05))
        floor = world.add_plane(lift, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
        world.add_contact(world.add_sphere(body, 5e-3), floor, pair(0.3))
        world.step(16 + round(fall / 4e-5))
        for _ in range(20):
            world.step()
            assert abs(world.velocity[body, 2] - 0.05) < 1e-3
