"""Contacts that coast: from when on they may, what they leave in the ledgers; torsion that is held meanwhile."""

import numpy as np
import pytest

from contactlaw import MATERIALS, ContactPair
from contactlaw.jit import jit
from contactlaw.world import World
from contactlaw.world.contacts.coasting import has_model
from contactlaw.world.data.access import near_at
from contactlaw.world.data.records import FREE
from contactlaw.world.readout import mean_impulses
from sims.heap import poured
from sims.scene import NONE, Settings
from tests.reference.sliding_spin import force_and_moment


@jit
def able_to_coast(world):
    """How many closed contacts may coast."""
    w, count = world[0], 0
    for k in range(w.nears):
        p = near_at(w.near, k)
        if p.closed != 0 and has_model(w, p):
            count += 1
    return count


def test_a_contact_coasts_only_from_what_its_law_knows() -> None:
    """What it moved while it coasted before is first given to its law: a start in between would lose that."""
    heap = poured(Settings(NONE, timestep=2e-3), 64)
    heap.start()
    heap.step(100)
    arrays = heap.world.arrays
    world = arrays.bound().world
    assert able_to_coast(world) > 50
    arrays.contacts["coasted_from"] = 1e-9
    assert able_to_coast(world) == 0


def accounted(world: World) -> float:
    """Kinetic and potential energy, and what contacts have taken by their ledgers [J]."""
    energy, taken = world.energy, world.ledger(0)
    return energy.kinetic + energy.potential + taken.normal_work + taken.tangential_work


@pytest.mark.parametrize("timestep", [2e-4, 1e-3])
def test_the_work_of_a_lid_is_what_a_pack_gains_or_loses(timestep: float) -> None:
    """The ledgers of 36 balls that are pressed together close to 1e-3 of it; without coasting to 5e-5."""
    glass, rng, speed = MATERIALS["glass"], np.random.default_rng(0), 0.05
    pair, radius, width = ContactPair(glass, glass, friction=0.3, restitution=0.5), 2e-3, 13.5e-3
    world, shapes = World(timestep=timestep), []
    for i in range(36):
        size, place = radius * rng.uniform(0.9, 1.1), np.array([4.5e-3 * (i % 3) + 2.25e-3, 0.0, 0.0])
        place[1:] = 4.5e-3 * (i // 3 % 3) + 2.25e-3, 1.3 * radius + 2.3 * radius * (i // 9)
        mass = 2500.0 * 4.0 / 3.0 * np.pi * size**3
        body = world.add_body(mass, 0.4 * mass * size**2, place + 0.03 * radius * rng.normal(size=3))
        shapes.append(world.add_sphere(body, size))
    corners = [((0.0, 0.0, 0.0), axis) for axis in np.eye(3)] + [((width, width, 0.0), -axis) for axis in np.eye(3)[:2]]
    lid = world.add_body(np.inf, 1.0, (0.0, 0.0, 1.0))
    walls = [world.add_plane(None, *corner) for corner in corners]
    walls.append(world.add_plane(lid, (0.0, 0.0, 0.0), (0.0, 0.0, -1.0)))
    world.add_contact(shapes, [*shapes, *walls], pair)
    world.step(round(0.1 / timestep))
    top = world.position[:lid, 2].max() + 1.1 * radius
    world.place(lid, position=(0.0, 0.0, top), velocity=(0.0, 0.0, -speed))
    before, work = accounted(world), 0.0
    for _ in range(round(0.6 * radius / speed / timestep)):
        world.step()
        rows = world.arrays.contacts[world.arrays.contacts["phase"] != FREE]
        up = mean_impulses(world.arrays.bodies, rows, timestep)[:, 2]
        work += speed * (up[rows["body_a"] == lid + 1].sum() - up[rows["body_b"] == lid + 1].sum())
    assert work > 1e-4
    assert accounted(world) - before == pytest.approx(work, rel=1e-3)


GRAIN, GRAIN_MASS = 5e-3, 1.3e-3  # radius of a pressed ball [m], and its mass [kg]


def pressed(friction: float, restitution: float, depth: float, sides: tuple[int, int, int], jitter: float) -> World:
    """Glass balls on a lattice in a box without gravity, with random spins, at overlaps of `depth` radii.

    jitter: of their places [radii].
    """
    glass, rng, radius = MATERIALS["glass"], np.random.default_rng(0), GRAIN
    world, mass, pitch = World(timestep=1e-4, gravity=0.0, stillness=0.0), GRAIN_MASS, (2.0 - depth) * radius
    for place in np.argwhere(np.ones(sides)):
        at = pitch * (place + 0.5) + jitter * radius * rng.normal(size=3)
        world.add_body(mass, 0.4 * mass * radius**2, at, spin=rng.normal(size=3))
    balls = [world.add_sphere(body, radius) for body in range(np.prod(sides))]
    # a ball of radius R is pressed by a wall as by another ball at an overlap of 2^(-1/3) times theirs, as k ~ R^0.5
    edge = 0.5 * pitch - radius * (1.0 - depth * 0.5 ** (1.0 / 3.0))
    walls = [world.add_plane(None, edge * axis, axis) for axis in np.eye(3)]
    walls += [world.add_plane(None, (pitch * np.array(sides) - edge) * axis, -axis) for axis in np.eye(3)]
    world.add_contact(balls, [*balls, *walls], ContactPair(glass, glass, friction=friction, restitution=restitution))
    return world


@pytest.mark.parametrize(("depth", "friction", "restitution"), [(0.045, 0.3, 0.9), (0.05, 1.0, 0.95)])
def test_spin_of_balls_that_are_pressed_together_dies_away(depth: float, friction: float, restitution: float) -> None:
    """75 balls in a box, in balance at overlaps of 0.05 R: nothing drives them, and a twist is critically damped.

    Held for eight substeps, and longer where contacts coasted, moments about the normal made it grow to 2e5 times the
    energy. Packs that a lid crushes took a third of its work, as such a hum lets friction slip. Tangential dashpots,
    each as if it were alone, drove spins too, from the second depth on: the elastic energy grew by a tenth.
    """
    world = pressed(friction, restitution, depth, (5, 5, 3), 0.0)
    given, overlap = world.energy.kinetic, depth * GRAIN
    world.step(20)
    glass = MATERIALS["glass"]
    stiffness = glass.youngs_modulus / (2.0 * (1.0 - glass.poissons_ratio**2))
    force = 4.0 / 3.0 * stiffness * np.sqrt(0.5 * GRAIN) * overlap**1.5
    stored = 0.4 * force * overlap * (170.0 + 110.0 * 0.5 ** (1.0 / 3.0))  # of pairs of balls, and with walls
    assert world.energy.kinetic < 1e-3 * given
    assert world.energy.elastic == pytest.approx(stored, rel=1e-6)


@pytest.mark.parametrize(("restitution", "friction"), [(0.01, 0.3), (0.02, 1.0), (0.05, 0.3)])
def test_dampers_that_share_a_mass_let_a_pressed_crowd_come_to_rest(restitution: float, friction: float) -> None:
    """27 balls, nothing drives them: by the loss of an impact, vibrations die away within a millisecond.

    Contacts that coast were not counted among those that press a ball, and each was solved for its damper as if it were
    alone: 2e-3 to 2e-2 of the elastic energy stayed kinetic without end.
    """
    world = pressed(friction, restitution, 0.01, (3, 3, 3), 0.002)
    world.step(300)
    assert world.energy.kinetic < 1e-12 * world.energy.elastic


def test_balls_that_pivot_in_a_crowd_come_to_rest() -> None:
    """64 balls spin and stop: nothing drives them, and twists are critically damped.

    Pressed enough that none is free, as such a ball flies to and fro. Springs of torsion that always coasted at the
    limit that the last slip had left were softer than the law: a share of 1e-9 stayed kinetic.
    """
    world = pressed(1.0, 0.5, 1e-3, (4, 4, 4), 0.01)
    world.step(500)
    assert world.energy.kinetic < 1e-15 * world.energy.elastic


def row(timestep: float) -> tuple[World, float, float]:
    """Six glass balls in a row on a floor, rough, with smooth sides that make them one crowd.

    Returns the world, the radius of a contact with the floor [m], and G_t of the pair [Pa].
    """
    glass, mass = MATERIALS["glass"], GRAIN_MASS
    shear = glass.youngs_modulus / (4.0 * (1.0 + glass.poissons_ratio))
    stiffness = glass.youngs_modulus / (2.0 * (1.0 - glass.poissons_ratio**2))
    overlap = (0.75 * mass * 9.81 / (stiffness * np.sqrt(GRAIN))) ** (2.0 / 3.0)
    world, pitch = World(timestep=timestep, stillness=0.0), (2.0 - 1e-4) * GRAIN
    for i in range(6):
        world.add_body(mass, 0.4 * mass * GRAIN**2, (0.0, i * pitch, GRAIN - overlap))
    balls = [world.add_sphere(body, GRAIN) for body in range(6)]
    ends = [world.add_plane(None, (0.0, -(GRAIN - 5e-7), 0.0), (0.0, 1.0, 0.0)),
            world.add_plane(None, (0.0, 5.0 * pitch + GRAIN - 5e-7, 0.0), (0.0, -1.0, 0.0))]  # fmt: skip
    floor = world.add_plane(None, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    world.add_contact(balls, floor, ContactPair(glass, glass, 0.3, 0.5))
    world.add_contact(balls, [*balls, *ends], ContactPair(glass, glass, 0.0, 0.5))
    world.step(round(0.02 / timestep))
    return world, float(np.sqrt(GRAIN * overlap)), shear


@pytest.mark.parametrize("timestep", [2e-5, 1e-4])
def test_a_twist_of_contacts_that_coast_is_critically_damped(timestep: float) -> None:
    """Spins of 1e-4 rad/s follow (1 - omega t) exp(-omega t), omega^2 = 16/3 G_t a^3/I.

    Held while contacts coasted, the moment came late: off by 0.035 of the first spin at the shorter step. In heaps such
    moments, of several contacts at their limits, kept balls creeping by 10 um/s.
    """
    world, radius, shear = row(timestep)
    omega = np.sqrt(16.0 / 3.0 * shear * radius**3 / (0.4 * GRAIN_MASS * GRAIN**2))
    for body in range(6):
        world.place(body, spin=(0.0, 0.0, 1e-4))
    for time in 5e-3 * np.arange(1, 6):
        world.step(round(5e-3 / timestep))
        assert world.spin[:, 2] / 1e-4 == pytest.approx((1.0 - omega * time) * np.exp(-omega * time), abs=5e-4)


@pytest.mark.parametrize("speed", [10.0, 50.0])
def test_sliding_balls_of_a_crowd_spin_on_with_what_sliding_leaves_of_friction(speed: float) -> None:
    """They slide at 50 mm/s, their rims spin at `speed` mm/s.

    The judge is the moment of slip everywhere by quadrature. Where contacts coasted it rose to that of spin alone: it
    was 9 and 1.8 times as large.
    """
    (world, radius, _), time = row(1e-4), 1e-3
    for body in range(6):
        world.place(body, velocity=(0.05, 0.0, 0.0), spin=(0.0, 0.0, 1e-3 * speed / radius))
    world.step(2)
    before = world.velocity[0, 0] - GRAIN * world.spin[0, 1], world.spin[:, 2]
    world.step(round(time / world.timestep))
    slip = 0.5 * (before[0] + world.velocity[0, 0] - GRAIN * world.spin[0, 1])
    moment = 0.4 * GRAIN * (before[1] - world.spin[:, 2]).mean() * GRAIN / time  # of m
    _, expected = force_and_moment(slip, 1e-3 * speed)
    assert moment == pytest.approx(0.3 * 9.81 * radius * expected, rel=0.03)
