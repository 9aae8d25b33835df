"""What falls onto something that stands: gravity moves the one and not the other, and long steps must see that."""

from __future__ import annotations

import numpy as np
import pytest

from contactlaw import ContactPair
from contactlaw.world import World
from tests.world.world_scenes import mass_of

PAIR = ContactPair("steel", "steel", friction=0.3, restitution=0.5)
RADIUS = 0.01
MASS = mass_of(RADIUS)
HIGH = 3.1 * RADIUS  # [m], of the upper ball when it is let go
ASIDE = 0.1 * RADIUS  # [m], the same over the lower one


def stands(timestep: float, rolling: float) -> tuple[World, int]:
    """A ball on a floor, asleep or rolling with a speed [m/s], and another far away; returns the latter."""
    world = World(timestep=timestep)
    floor = world.add_plane(None, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    lower, upper = (world.add_body(MASS, 0.4 * MASS * RADIUS**2, (0.0, 0.0, z)) for z in (RADIUS, 1e3))
    balls = [world.add_sphere(body, RADIUS) for body in (lower, upper)]
    world.add_contact(balls, [*balls, floor], PAIR)
    world.step(round(2.0 / timestep) + 5)
    assert world.asleep[lower]
    world.place(lower, velocity=(rolling, 0.0, 0.0), spin=(0.0, rolling / RADIUS, 0.0))
    return world, upper


@pytest.mark.parametrize("rolling", [0.0, 1e-3])
@pytest.mark.parametrize("timestep", [1e-3, 1e-2, 0.03, 0.1, 0.5])
def test_a_ball_let_go_above_one_that_stands_lands_on_it(timestep: float, rolling: float) -> None:
    world, upper = stands(timestep, rolling)
    beside = float(world.position[0, 0]) + ASIDE
    world.place(upper, position=(beside, 0.0, HIGH), velocity=np.zeros(3))
    before = world.energy.total
    for _ in range(round(max(0.2, 3.0 * timestep) / timestep)):
        world.step()
        assert world.energy.total < before + 1e-9 * MASS * 9.81 * HIGH
        before = world.energy.total
        between = np.linalg.norm(world.position[1] - world.position[0]) - 2.0 * RADIUS
        assert min(between, *(world.position[:, 2] - RADIUS)) > -2e-3 * RADIUS
    assert world.velocity[0, 0] < -0.01 < 0.01 < world.velocity[1, 0]  # they have pushed each other aside
