"""Slip and spin at once against the grid, closed forms, and no history that makes energy."""

from __future__ import annotations

import numpy as np
import pytest

from contactlaw import ContactPair
from contactlaw.jit import INTERPRETED
from contactlaw.laws.record import SPUN
from contactlaw.world import World
from tests.world.world_scenes import goes_on_alike
from validation import ledger, spinning, turning
from validation.reference.turning_data import load

PAIR = ContactPair("steel", "steel", friction=0.3, radius=0.01)
in_a_world = pytest.mark.skipif(INTERPRETED, reason="worlds and records are for compiled code alone")

ROWS = [row for row in load()["spinning"] if row[3] > 0.0]


@in_a_world
@pytest.mark.parametrize("heading", [0.0, 0.7, 2.3])
def test_impacts_with_spin_are_the_grids(heading: float) -> None:
    """For psi_1 from 0.2 to 5 and sigma to 0.3; nu = 0 and 0.28."""
    errors, sigma = np.abs(turning.spun_errors(ROWS, heading)), np.array([row[3] for row in ROWS])
    assert errors.max() < 5e-3
    assert errors[sigma <= 0.1].max() < 3e-3


@in_a_world
@pytest.mark.parametrize("way", spinning.WAYS)
@pytest.mark.parametrize("kind", ledger.KINDS)
def test_no_path_makes_energy(way: str, kind: str) -> None:
    """Turning, spinning and opening, load and place in turn, in steps of any size: to rounding. Limits hold too."""
    rng = np.random.default_rng(23)
    for trial in range(600):
        overlap, place = spinning.random_path(rng, kind, (1, 4, 16)[trial % 3])
        lost, over = spinning.dissipated(way, overlap, place, in_turn=kind != "steady")
        assert ledger.fall(lost) < 1e-13
        assert over < 1e-12


@in_a_world
def test_no_cycle_makes_energy() -> None:
    """Cycles that a search makes as generous as it can, load and place in turn or at once."""
    rng = np.random.default_rng(5)
    for corners, parts, in_turn in ((4, 1, True), (6, 1, True), (5, 16, False)):
        assert spinning.worst_cycle("sectors", rng, corners, parts, in_turn, looks=150) < 1e-13


def spun(restitution: float = 1.0) -> World:
    """A ball falling on a floor with spin about the normal, sigma 0.15."""
    world, pair = World(timestep=2e-5), ContactPair(PAIR.a, PAIR.b, 0.3, restitution=restitution)
    ball = world.add_body(0.03, 1.2e-6, (0.0, 0.0, 0.01 + 1e-6), (0.1, 0.0, -0.3), spin=(0.0, 0.0, 60.0))
    floor = world.add_plane(None, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    world.add_contact(world.add_sphere(ball, 0.01), floor, pair)
    return world


@in_a_world
def test_an_impact_goes_on_from_a_copy_to_the_bit() -> None:
    world = spun()
    world.step(1)
    assert world.arrays.contacts["touch"]["state"][0] == SPUN
    goes_on_alike(world, 3)


@in_a_world
def test_sectors_give_way_to_springs_where_a_contact_lasts() -> None:
    """A ball that hardly bounces stays on the floor, rolls or pivots, and loses energy all the way."""
    world = spun(restitution=0.02)
    energy = world.energy.total
    for _ in range(400):
        world.step(5)
        assert world.energy.total < energy + 1e-12
        energy = world.energy.total
    contact = world.arrays.contacts[world.arrays.contacts["phase"] == 1]
    assert contact.size == 1 and contact["touch"]["state"][0] != SPUN
