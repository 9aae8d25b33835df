"""Worlds without an engine that tests share: balls of steel between planes, tumbling bodies."""

import re
from collections.abc import Callable
from math import pi
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike

from contactlaw import ContactPair, Material
from contactlaw.world import World
from sims.scene import Settings
from sims.worlds import new_world
from validation.ball import DENSITY, FLOOR, FRICTION, NO, STEEL, balls_world

__all__ = ["FLOOR", "FRICTION", "STEEL"]

RADIUS = 0.025  # [m]


def mass_of(radius: float, density: float = DENSITY) -> float:
    """Of a ball [kg]."""
    return 4.0 / 3.0 * pi * radius**3 * density


def steel_pair(friction: float = FRICTION, restitution: float = 1.0, **more: Any) -> ContactPair:
    """Steel on steel."""
    return ContactPair(STEEL, STEEL, friction, restitution, **more)


def balls(
    pair: ContactPair, places: ArrayLike, velocities: ArrayLike, spins: ArrayLike = NO, *, gravity: float = 0.0,
    timestep: float = 1e-3, **more: Any,
) -> World:  # fmt: skip
    """`ball.balls_world` without an engine, which has energy and momentum to ask for; gravity: downward [m/s^2]."""
    thrown = velocities if np.ndim(velocities) else np.broadcast_to(velocities, (3,))
    more = {"radius": RADIUS, "gravity": (0.0, 0.0, -gravity)} | more
    made: Any = balls_world("none", timestep, pair, places, thrown, spins, **more)
    return made.world


def refuses(call: Callable[[World], object], message: str) -> None:
    """Whether a call on a world of one body is an error with this message."""
    world = World()
    world.add_body(1.0, 1.0)
    with pytest.raises(ValueError, match=re.escape(message)):
        call(world)


def goes_on_alike(world: World, steps: int) -> None:
    """Whether a world set back to its state moves as it did, to the bit."""
    saved, ends = world.save(), []
    for _ in range(2):
        world.restore(saved)
        world.step(steps)
        ends.append([world.position, world.velocity, world.spin, world.quaternion, world.save().memory])
    for first, second in zip(*ends, strict=True):
        np.testing.assert_array_equal(first, second)


def box_of_planes(half: float) -> list[tuple[Any, Any]]:
    """Six walls around the origin."""
    return [(-s * half * axis, s * axis) for axis in np.eye(3) for s in (1.0, -1.0)]


def column(count: int, gap: float, timestep: float) -> World:
    """Elastic balls above each other, 0.1 m above a floor."""
    z = 0.1 + RADIUS + np.arange(count) * (2.0 * RADIUS + gap)
    places = np.stack([0.0 * z, 0.0 * z, z], 1)
    return balls(steel_pair(0.1), places, 0.0, planes=[FLOOR], gravity=9.81, timestep=timestep)


def rack(pair: ContactPair, timestep: float, speed: float, radius: float = 0.028575) -> World:
    """A cue ball that is about to hit fifteen others, which touch."""
    rows = [[row * np.sqrt(3.0) * radius, (2 * k - row) * radius, 0.0] for row in range(5) for k in range(row + 1)]
    places = np.array([[-2.0 * radius - 0.011, 0.003, 0.0], *rows])
    velocities = np.zeros((16, 3))
    velocities[0, 0] = speed
    return balls(pair, places, velocities, radius=radius, density=1750.0, timestep=timestep)


PHENOLIC = Material(5.84e9, 0.34, 1750.0)


def tumbler(kind: str, seed: int, timestep: float, pair: ContactPair) -> World:
    """A capsule, a dumbbell or a box on ball feet, thrown between two planes, without gravity."""
    rng = np.random.default_rng(seed)
    r = 0.01
    m = mass_of(r)
    if kind == "capsule":
        mass, inertia, feet = 2.5 * m, (1.1e-5, 1.1e-5, 3e-6), [(0.0, 0.0, 0.02), (0.0, 0.0, -0.02)]
    elif kind == "dumbbell":
        long = 0.8 * m * r * r
        inertia = (long + 2.0 * m * 9e-4, long + 2.0 * m * 9e-4, long)
        mass, feet = 2.0 * m, [(0.0, 0.0, 0.03), (0.0, 0.0, -0.03)]
    else:
        a, b, c = 0.02, 0.03, 0.04
        mass, inertia = 0.3, tuple(0.1 * np.array([b * b + c * c, a * a + c * c, a * a + b * b]))
        feet = [(i * a, j * b, k * c) for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)]
    made: Any = new_world(Settings("none", timestep=timestep), NO)
    world: World = made.world
    walls = [world.add_plane(None, (0.0, 0.0, -s * 0.1), (0.0, 0.0, s)) for s in (1.0, -1.0)]
    velocity = np.append(rng.normal(size=2), rng.choice([-1.0, 1.0]))
    body = world.add_body(mass, inertia, (0.0, 0.0, 0.0), velocity, rng.normal(size=4), 20.0 * rng.normal(size=3))
    world.add_contact([world.add_sphere(body, r, at) for at in feet], walls, pair)
    return world
