"""Slip and spin at once against the grid, closed forms, and no history that makes energy."""

from __future__ import annotations

from math import sqrt

import numpy as np
import pytest

from contactlaw import MATERIALS, ContactPair
from contactlaw.jit import INTERPRETED
from contactlaw.laws import sectors
from contactlaw.laws.hertz import elastic_force
from contactlaw.laws.record import SPUN, contact_of, pair_of
from contactlaw.laws.step import prescribe
from contactlaw.laws.torsion import FULL, TORSION
from contactlaw.world import World
from tests.reference import torsion
from tests.reference.sliding_spin import force_and_moment
from tests.test_torsion import STICK
from validation import ledger, spinning, turning
from validation.reference.turning_data import load

PAIR = ContactPair(MATERIALS["steel"], MATERIALS["steel"], friction=0.3, radius=0.01)
DEEP = 1e-5  # [m]
in_a_world = pytest.mark.skipif(INTERPRETED, reason="worlds and records are for compiled code alone")

ROWS = [row for row in load()["spinning"] if row[3] > 0.0]


class Contact:
    """A contact of sectors whose motion is given, in units of mu P, a and the displacement of full slip."""

    def __init__(self) -> None:
        self.numbers, (self.values, _) = PAIR.parameters(), PAIR.rule.with_nodes(None).new_contact()
        self.pair, self.touch = pair_of(self.numbers), contact_of(self.values)
        self.memory = np.zeros((2, sectors.RINGS, sectors.SECTORS))
        self.open_up()
        self.full = PAIR.friction * 4.0 / 3.0 * PAIR.effective_modulus * sqrt(PAIR.radius or 0.0) * DEEP**1.5
        self.radius, self.unit = sqrt((PAIR.radius or 0.0) * DEEP), PAIR.friction / PAIR.kappa * DEEP

    def open_up(self) -> None:
        self.torsion = np.zeros(1, np.dtype((np.record, TORSION)))[0]
        self.memory[:] = 0.0
        prescribe(self.touch, self.pair, DEEP)
        self.touch.state = SPUN

    def move(self, depth: float, u: float = 0.0, v: float = 0.0, angle: float = 0.0) -> np.ndarray:
        """To a depth over the deepest, by u, v and angle times a, over the unit; forces and moment at the depth 1."""
        t = self.touch
        t.before, t.overlap, t.ratio = t.overlap, depth * DEEP, 1.0
        if depth <= 0.0:
            self.open_up()
            return np.zeros(3)
        t.force = t.elastic = elastic_force(t, False, t.overlap)
        moved = (self.unit * u, self.unit * v, self.unit / self.radius * angle)
        sectors.advance(t, self.torsion, self.memory, self.pair.g_t, moved)
        return np.array([t.f, t.g, self.torsion.moment / self.radius]) / self.full


@in_a_world
@pytest.mark.parametrize("heading", [0.0, 0.7, 2.3])
def test_impacts_with_spin_are_the_grids(heading: float) -> None:
    """For psi_1 from 0.2 to 5 and sigma to 0.3; nu = 0 and 0.28."""
    errors, sigma = np.abs(turning.spun_errors(ROWS, heading)), np.array([row[3] for row in ROWS])
    assert errors.max() < 5e-3
    assert errors[sigma <= 0.1].max() < 3e-3


@pytest.mark.parametrize("heading", [0.0, 0.4])
@pytest.mark.parametrize("k", [0.1, 0.5, 1.0, 3.0])
def test_steady_sliding_with_spin_is_the_closed_form(k: float, heading: float) -> None:
    contact, way = Contact(), np.array([np.cos(heading), np.sin(heading)])
    for depth in np.linspace(0.02, 1.0, 50):
        contact.move(depth)
    found = np.zeros(3)
    for _ in range(2000):
        found = contact.move(1.0, 0.02 * way[0], 0.02 * way[1], 0.02 * k)
    f, m = force_and_moment(1.0, k)
    assert found[:2] == pytest.approx(f * way, abs=1e-3)
    assert found[2] == pytest.approx(m, abs=1e-3)


def test_torsion_alone_follows_lubkin() -> None:
    """From where a whole ring slips; at a stick radius of 0.95 half of the outermost does, and M/M_s is 0.012 off."""
    contact, done = Contact(), 0.0
    for depth in np.linspace(0.02, 1.0, 50):
        contact.move(depth)
    unit = contact.full / (contact.pair.g_t * contact.radius**2) * contact.radius / contact.unit
    for beta, share in zip(torsion.angle(STICK[1:]), torsion.moment(STICK[1:]) / FULL, strict=True):
        found = contact.move(1.0, angle=(beta - done) * unit)
        done = beta
        assert found[2] / FULL == pytest.approx(share, abs=0.01)


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


def spun(restitution: float = 1.0) -> tuple[World, int]:
    """A ball falling on a floor with spin about the normal, sigma 0.15."""
    world, pair = World(timestep=2e-5), ContactPair(PAIR.a, PAIR.b, 0.3, restitution=restitution)
    ball = world.add_body(0.03, 1.2e-6, (0.0, 0.0, 0.01 + 1e-6), (0.1, 0.0, -0.3), spin=(0.0, 0.0, 60.0))
    floor = world.add_plane(None, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    world.add_contact(world.add_sphere(ball, 0.01), floor, pair)
    return world, ball


@in_a_world
def test_an_impact_goes_on_from_a_copy_to_the_bit() -> None:
    world, ball = spun()
    world.step(1)
    assert world.arrays.contacts["touch"]["state"][0] == SPUN
    saved = world.save()
    world.step(3)
    velocity, spin = world.velocity[ball].copy(), world.spin[ball].copy()
    world.restore(saved)
    world.step(3)
    np.testing.assert_array_equal((world.velocity[ball], world.spin[ball]), (velocity, spin))


@in_a_world
def test_sectors_give_way_to_springs_where_a_contact_lasts() -> None:
    """A ball that hardly bounces stays on the floor, rolls or pivots, and loses energy all the way."""
    world, _ = spun(restitution=0.02)
    energy = world.energy.total
    for _ in range(400):
        world.step(5)
        assert world.energy.total < energy + 1e-12
        energy = world.energy.total
    contact = world.arrays.contacts[world.arrays.contacts["phase"] == 1]
    assert contact.size == 1 and contact["touch"]["state"][0] != SPUN
