"""What lasts, which tests share: a ball of steel that lies on a floor, an arm whose tip drags over one."""

from __future__ import annotations

from contactlaw import MATERIALS, ContactPair
from contactlaw.world import World
from sims.contact_point import static_overlap
from tests.world.chains import Chain, Link
from tests.world.jointed_scenes import TIP, rod
from tests.world.world_scenes import mass_of

STEEL = MATERIALS["steel"]
RADIUS = 0.01
LENGTH = 0.2  # [m] of a rod
MASS = mass_of(RADIUS)
INERTIA = 0.4 * MASS * RADIUS**2
FRICTION = 0.3


def pair(friction: float = FRICTION) -> ContactPair:
    return ContactPair(STEEL, STEEL, friction, 0.5)


def ball(timestep: float, speed: float = 0.0, spin: float = 0.0, down: float = 0.0) -> World:
    """A ball on a floor, with the overlap that it rests with."""
    world = World(timestep=timestep)
    floor = world.add_plane(None, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    sunk = static_overlap(pair(), MASS * 9.81, RADIUS)
    body = world.add_body(MASS, INERTIA, (0.0, 0.0, RADIUS - sunk), (speed, 0.0, -down), spin=(0.0, spin, 0.0))
    world.add_contact(world.add_sphere(body, RADIUS), floor, pair())
    return world


def sweeping_arm(timestep: float, rate: float) -> World:
    """A rod on an upright hinge and a level one, whose tip lies on the floor and drags over it."""
    world = World(timestep=timestep)
    mass, far, inertia = rod(0.005, LENGTH, mass_of(TIP))
    links = [Link(1e-3, 1e-6, axis=(0.0, 0.0, 1.0)), Link(mass, (1e-6, inertia, inertia), (-far, 0.0, 0.0))]
    _, bodies = world.add_tree(Chain(links), [0.0, 0.0], [rate, 0.0])
    floor = world.add_plane(None, (0.0, 0.0, -TIP), (0.0, 0.0, 1.0))
    world.add_contact(world.add_sphere(bodies[1], TIP, (LENGTH - far, 0.0, 0.0)), floor, pair())
    return world
