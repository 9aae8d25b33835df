"""Contacts that jump to another place, as of soft edged bodies: they gain no energy that no motion has brought."""

from __future__ import annotations

from math import sqrt

import numpy as np
import pytest

from contactlaw import ContactPair, ContactWarning, Material
from contactlaw.world import World
from tests.world.world_scenes import FLOOR


def throw(seed: int) -> float:
    """Throw a can, a box and a mesh of soft rubber at each other without gravity; the greatest gain of energy."""
    draw = np.random.default_rng(seed)
    rubber = Material(10 ** draw.uniform(6.0, 8.0), 0.45)
    world = World(timestep=1e-3, gravity=(0, 0, 0))
    shapes: list[int] = []
    for i in range(3):
        place = (0.1 * i - 0.1, *draw.uniform(-0.012, 0.012, 2))
        body = world.add_body(
            0.2, draw.uniform(3e-5, 6e-5, 3), place, (-25.0 * place[0], 0, 0), spin=draw.uniform(-15, 15, 3)
        )
        if i == 0:
            shapes.append(world.add_cylinder(body, 0.02, draw.uniform(0.01, 0.03)))
        elif i == 1:
            shapes.append(world.add_box(body, draw.uniform(0.01, 0.03, 3)))
        else:
            shapes.append(world.add_hull(body, 0.025 * draw.standard_normal((12, 3)).clip(-1.0, 1.0)))
    world.add_contact(shapes, shapes, ContactPair(rubber, rubber, friction=0.0))
    first, most = world.energy.total, 0.0
    for _ in range(120):
        world.step()
        most = max(most, world.energy.total / first - 1.0)
    return most


@pytest.mark.parametrize("seed", [141, 168, 265, 368])
def test_what_jumps_to_another_edge_gains_nothing(seed: int) -> None:
    """Of 400 throws twelve gained over 0.7 %, these most: another edge came into contact with its whole overlap."""
    assert throw(seed) < 2e-3


def test_a_nudge_counts_as_it_is_made() -> None:
    """A ball at rest that is pressed deeper by hand leaves with the energy of that, (2/5) k delta^2.5."""
    world, pair, mass = World(timestep=1e-5), ContactPair("steel", "steel", friction=0.0), 0.03
    ball = world.add_sphere(world.add_body(mass, 1.2e-6, (0.0, 0.0, 0.01 - 2e-7)), 0.01)
    world.add_contact(ball, world.add_plane(None, *FLOOR), pair)
    world.step(100)
    world.place(0, (0.0, 0.0, 0.01 - 2e-6), (0.0, 0.0, 0.0))
    world.step(20)
    stored = 0.4 * 4.0 / 3.0 * pair.effective_modulus * sqrt(0.01) * 2e-6**2.5
    assert world.position[0, 2] > 0.01 + 1e-6
    assert world.energy.total == pytest.approx(mass * 9.81 * (0.01 - 2e-6) + stored, abs=1e-3 * stored)


def test_blocks_built_into_each_other_stay_finite() -> None:
    """Corners that lie in a face touch it by rounding and leave it in the next substep, where the damper pulls."""
    world, half = World(timestep=1 / 240), np.array([0.075, 0.025, 0.015])
    floor, rubber = world.add_plane(None, *FLOOR), ContactPair("rubber", "steel", friction=0.5, restitution=0.5)
    inertia = 0.05 / 3.0 * (half @ half - half * half)
    places = [(0, 0.026 * side, 0.0075 + 0.0152 * layer) for layer in (1, 3, 5) for side in (-1, 0, 1)]
    bodies = [world.add_body(0.05, inertia, place) for place in (places[0], *places[3:])]
    bodies.insert(1, world.add_body(0.05, inertia, (0.026, 0, 0.0379), quaternion=(1, 0, 0, 1)))
    blocks = [world.add_box(body, half) for body in bodies]
    world.add_contact(blocks, [*blocks, floor], rubber)
    with pytest.warns(ContactWarning):
        world.step(40)
    assert np.isfinite(world.velocity).all()
