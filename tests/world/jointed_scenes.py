"""Trees of bodies that the tests share: a double pendulum with a ball at its tip, an arm with one."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from contactlaw.world import World
from contactlaw.world.data.records import Arrays
from contactlaw.world.data.tree import AXIS
from contactlaw.world.trees.tree_records import numbers
from tests.world.chains import Chain, Link
from tests.world.world_scenes import mass_of, steel_pair

TIP = 0.01  # [m] radius of the ball at a tip
UPPER, LOWER = 0.3, 0.25  # [m] lengths of the rods of the double pendulum


def rod(mass: float, length: float, ball: float) -> tuple[float, float, float]:
    """Mass [kg], distance [m] of the centre of mass from the hinge, and inertia across, of a rod with a ball."""
    both = mass + ball
    far = (0.5 * mass + ball) * length / both
    own = mass * length**2 / 12.0 + mass * (far - 0.5 * length) ** 2
    return both, far, own + ball * (length - far) ** 2 + 0.4 * ball * TIP**2


def pendulum() -> tuple[Chain, float]:
    """A double pendulum, straight down at rest; and how far its tip is below the lower centre of mass [m]."""
    upper, lower = rod(0.05, UPPER, 0.0), rod(0.05, LOWER, 0.1)
    links = [
        Link(upper[0], (upper[2], upper[2], 1e-5), (0.0, 0.0, upper[1])),
        Link(lower[0], (lower[2], lower[2], 1e-5), (0.0, 0.0, lower[1]), anchor=(0.0, 0.0, upper[1] - UPPER)),
    ]
    return Chain(links), LOWER - lower[1]


def pendulum_between_walls(q: ArrayLike, v: ArrayLike, **more: Any) -> World:
    """Its tip swings between two walls."""
    world = World(**more)
    chain, tip = pendulum()
    _, bodies = world.add_tree(chain, q, v)
    walls = [world.add_plane(None, (-s * 0.16, 0.0, 0.0), (s, 0.0, 0.0)) for s in (1.0, -1.0)]
    world.add_contact(world.add_sphere(bodies[1], TIP, (0.0, 0.0, -tip)), walls, steel_pair(0.0))
    return world


def arm_over_floor(height: float, restitution: float, **more: Any) -> World:
    """A rod of 0.2 m on a hinge, its tip of steel so far [m] above the floor that it lies on in the end."""
    world = World(**more)
    length = 0.2 if height < 0.2 else 0.4
    mass, far, inertia = rod(0.005, length, mass_of(TIP))
    chain = Chain([Link(mass, (1e-6, inertia, inertia), (-far, 0.0, 0.0))])
    _, (body,) = world.add_tree(chain, [-np.arcsin(height / length)])
    floor = world.add_plane(None, (0.0, 0.0, -TIP), (0.0, 0.0, 1.0))
    world.add_contact(world.add_sphere(body, TIP, (length - far, 0.0, 0.0)), floor, steel_pair(0.3, restitution))
    return world


def mass_matrix(world: Arrays, number: int) -> np.ndarray:
    """L^T D L of a tree (`trees.dynamics`) where its accelerations were last found; shape (v_size, v_size)."""
    axes = numbers(world, number, "axes").view(AXIS)
    factor = numbers(world, number, "factor").reshape(axes.size, axes.size)
    lower = np.eye(axes.size)
    for k in range(axes.size):
        i = int(axes["parent"][k])
        while i >= 0:
            lower[k, i] = factor[k, axes["depth"][i]]
            i = int(axes["parent"][i])
    return (lower.T / axes["inverse"]) @ lower
