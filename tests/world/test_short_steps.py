"""Steps shorter than an impact, of which one call makes many together; and how long the substeps of a heap are."""

import numpy as np
import pytest

from contactlaw.world import World
from contactlaw.world.step import steps_together
from sims.heap import poured
from sims.scene import NONE, Settings
from tests.world.world_scenes import FLOOR, RADIUS, balls, steel_pair


def rolling() -> World:
    """Six balls that roll over the floor, after 0.03 s; impacts on such contacts last 5e-4 s."""
    places = [[0.1 * i, 0.0, RADIUS] for i in range(6)]
    spins = [[0.0, 1.0 + i, 0.0] for i in range(6)]
    made = balls(steel_pair(restitution=0.5), places, 0.0, spins, planes=[FLOOR], gravity=9.81, timestep=1e-3)
    made.step(30)
    made.timestep = 1e-5
    made.step()
    return made


def together(made: World, left: int = 5000) -> int:
    return steps_together(made.arrays.bound().world[0], made.timestep, left)


def test_steps_shorter_than_an_impact_are_made_together() -> None:
    made = rolling()
    assert 20 < together(made) < 4999  # up to 24 impacts
    assert together(made, 10) == 9  # the last alone: readings tell of it
    made.timestep = 1e-3
    assert together(made) == 1
    made.timestep = 1e-5
    made.arrays.bodies["isotropic"][2] = 0  # it tumbles
    assert together(made) == 1


def test_steps_made_together_move_balls_as_single_ones() -> None:
    ends = []
    for calls in (1, 200):
        made = rolling()
        for _ in range(calls):
            made.step(200 // calls)
        assert made.time == pytest.approx(0.03201)
        assert made.contacts["closed"].sum() == 6 and made.arrays.world["together"][0] == 1
        ends.append(np.concatenate([made.velocity, RADIUS * made.spin]))
    np.testing.assert_allclose(*ends, atol=1e-5)


def test_substeps_of_a_heap_are_as_long_as_its_present_impacts_allow() -> None:
    """Shortened by impacts to come, or kept because they are hardly too short, they were 9.8 us."""
    time, kicks = 0.0, 0.0
    for seed in range(3):
        heap = poured(Settings(NONE, timestep=2e-3), 64, seed=seed)
        heap.start()
        heap.step(50)
        arrays = heap.world.arrays
        time += arrays.pairs["ledger"][:, 3].sum() + arrays.contacts["duration"][arrays.contacts["phase"] > 0].sum()
        kicks += arrays.world["kicks"][0]
    assert time / kicks > 10.4e-6
