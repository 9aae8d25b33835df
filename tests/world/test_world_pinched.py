"""Balls drawn at random as for the map of stability, among them light ones pinched by heavy ones."""

from __future__ import annotations

from itertools import pairwise, product
from math import isfinite

import numpy as np
import pytest

from contactlaw.world import World
from validation.cases.stability_map import DURATIONS, MODULI, _drawn
from validation.stability_trials import RADIUS, Trial

COLUMNS, ROWS = list(pairwise(DURATIONS)), list(pairwise(MODULI))


def drawn(row: int, column: int, number: int) -> Trial | None:
    """A trial of a cell of the map."""
    return _drawn((row, column), number, COLUMNS[column], ROWS[row])


def world_of(trial: Trial) -> World:
    """The trial's balls and planes."""
    world = World(gravity=trial.gravity, timestep=trial.step)
    shapes = [world.add_plane(None, point, normal) for point, normal in trial.planes]
    walls = len(shapes)
    for place, velocity, spin, mass, inertia in zip(trial.places, trial.velocities, trial.spins, trial.masses,
                                                    trial.inertias, strict=True):  # fmt: skip
        body = world.add_body(float(mass), float(inertia), place, velocity, spin=spin)
        shapes.append(world.add_sphere(body, RADIUS))
    world.add_contact(shapes[walls:], shapes, trial.pair())
    return world


def largest_gain(trial: Trial) -> float:
    """Of energy, over that of the start, whenever nothing touches."""
    world, worst, first = world_of(trial), -1.0, trial.first_energy()
    steps = max(1, round(trial.duration / trial.step))
    for count in np.diff(np.unique(np.linspace(0, steps, 61).astype(int))):
        world.step(int(count))
        energy = trial.kinetic(world.velocity, world.spin) + trial.potential(world.position)
        assert isfinite(energy)
        gaps = trial.gaps(world.position)
        assert gaps.min() > -RADIUS
        if gaps.min() > 0.0:
            worst = max(worst, energy / first - 1.0)
    return worst


@pytest.mark.parametrize(("row", "column", "number"), [(1, 2, 119), (2, 0, 103), (2, 3, 105)])
def test_a_light_ball_pinched_by_a_heavy_one_gains_nothing(row: int, column: int, number: int) -> None:
    trial = drawn(row, column, number)
    assert trial is not None
    assert largest_gain(trial) < 0.0


def test_no_cell_of_the_map_gains() -> None:
    gains = [largest_gain(trial) for row, column in product(range(len(ROWS)), range(len(COLUMNS)))
             for trial in [drawn(row, column, 100 + (row + column) % 2)] if trial is not None]  # fmt: skip
    assert len(gains) > 90
    assert max(gains) < 3e-4
