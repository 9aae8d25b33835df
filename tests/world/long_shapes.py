"""Scenes of capsules and boxes for tests."""

from __future__ import annotations

import numpy as np

from contactlaw import ContactPair
from contactlaw.world import World
from tests.world.world_scenes import box_of_planes, mass_of

RADIUS, HALF, MASS = 0.01, 0.02, 0.05
BOX = np.array([0.03, 0.02, 0.025])


def capsule(world: World, rng: np.random.Generator, place, velocity) -> tuple[int, int, int]:
    """A capsule that tumbles; its shapes."""
    across = MASS * (HALF * HALF / 3.0 * 1.3 + 0.4 * RADIUS * RADIUS)
    inertia = (across, across, 0.4 * MASS * RADIUS * RADIUS)
    body = world.add_body(MASS, inertia, place, velocity, rng.normal(size=4), 20.0 * rng.normal(size=3))
    return world.add_capsule(body, RADIUS, HALF)


def sphere(world: World, place, velocity, spin=(0.0, 0.0, 0.0)) -> int:
    """A ball of steel."""
    m = mass_of(RADIUS)
    return world.add_sphere(world.add_body(m, 0.4 * m * RADIUS**2, place, velocity, spin=spin), RADIUS)


def free_box(world: World, rng: np.random.Generator, velocity, spin) -> tuple[int, list[int]]:
    """A box that tumbles; its shape, and small balls on its corners, for walls."""
    mass = 0.3
    body = world.add_body(mass, mass / 3.0 * (BOX @ BOX - BOX * BOX), (0, 0, 0), velocity, rng.normal(size=4), spin)
    corners = [world.add_sphere(body, 0.004, BOX * (i, j, k)) for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)]
    return world.add_box(body, BOX), corners


def scene(kind: str, seed: int, timestep: float, pair: ContactPair) -> World:
    """What bounces without gravity between walls, by name."""
    rng = np.random.default_rng(seed)
    world = World(gravity=0.0, timestep=timestep)
    half = 0.06 if kind == "planes" else 0.12
    walls = [world.add_plane(None, *wall) for wall in box_of_planes(half)[4 if kind == "planes" else 0 :]]
    block = ((0.03, 0.04, 0.05), (0.0, 0.0, 0.0), rng.normal(size=4))
    if kind == "planes":
        velocity = np.append(rng.normal(size=2), rng.choice([-1.0, 1.0]))
        world.add_contact(capsule(world, rng, (0, 0, 0), velocity), walls, pair)
    elif kind == "capsule on edges":
        shapes = capsule(world, rng, (0.088, 0, 0), rng.normal(size=3) - (1, 0, 0))
        world.add_contact(shapes, [*walls, world.add_box(None, *block)], pair)
    elif kind == "sphere on edges":
        ball = sphere(world, (0.085, 0, 0), rng.normal(size=3) - (1, 0, 0))
        world.add_contact(ball, [*walls, world.add_box(None, *block)], pair)
    elif kind == "crossing capsules":
        shapes = []
        for x in (-0.065, 0.0, 0.065):
            shapes += capsule(world, rng, (x, 0, 0), rng.normal(size=3))
        world.add_contact(shapes, [*walls, *shapes], pair)
    else:
        box, corners = free_box(world, rng, 0.3 * rng.normal(size=3), 10.0 * rng.normal(size=3))
        balls = [sphere(world, (0.09 * np.cos(a), 0.09 * np.sin(a), 0.01 * a), rng.normal(size=3)) for a in range(6)]
        world.add_contact(corners, walls, pair)
        world.add_contact(balls, [*walls, box, *balls], pair)
    return world
