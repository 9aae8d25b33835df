"""Torsion against Lubkin's solution, sliding with spin against its closed form, and no history that makes energy."""

from __future__ import annotations

from math import atan2, cos, hypot, pi, sin, sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contactlaw import MATERIALS, ContactPair
from contactlaw.laws.record import PAIR_SIZE, pair_of
from contactlaw.laws.step import ask, press, reset
from contactlaw.laws.torsion import FULL, TORSION, advance, limit_point, nearest, stored
from tests.reference import torsion
from tests.reference.sliding_spin import force_and_moment
from validation import ledger

PAIR = ContactPair(MATERIALS["steel"], MATERIALS["steel"], friction=0.3, radius=0.01)
DEEP = 1e-5  # [m]
STICK = np.array([0.95, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1])  # stick radii over a


class Contact:
    """One contact whose motion is given; its law is that of the pair."""

    def __init__(self, pair: ContactPair = PAIR) -> None:
        self.numbers = pair.parameters()
        self.values, self.memory = pair.law.with_nodes(None).new_contact()
        self.pair, self.touch = pair_of(self.numbers), self.values[0]
        self.torsion = np.zeros(1, np.dtype((np.record, TORSION)))[0]
        reset(self.touch, self.pair, self.pair.radius)
        self.touch.mass = self.touch.tangential_mass = 1.0
        self.touch.closing = sqrt(0.8 * self.touch.stiffness * DEEP**2.5)  # such that it comes so deep

    def move(self, overlap: float, slide: float = 0.0, angle: float = 0.0, spun: bool = True) -> None:
        """By one step; as the world does it."""
        t, law = self.touch, self.numbers[PAIR_SIZE:]
        t.before, t.overlap = t.overlap, overlap
        press(t, self.pair, 0.0)
        if spun:
            advance(self.torsion, t, self.pair, law, self.memory, (slide, 0.0, angle), (angle, t.before), 0.0)
        else:
            ask(t, self.pair, law, self.memory, slide, 0.0, 0.0)

    def press(self, overlap: float = DEEP, steps: int = 50) -> None:
        """To an overlap, straight."""
        for depth in np.linspace(self.touch.overlap, overlap, steps + 1)[1:]:
            self.move(float(depth))

    @property
    def radius(self) -> float:
        return sqrt(self.pair.radius * self.touch.overlap)

    @property
    def full(self) -> float:
        """mu P [N]."""
        return self.pair.friction * self.touch.force

    @property
    def unit(self) -> float:
        """mu P/(G_t a^2) [rad]."""
        return self.full / (self.pair.g_t * self.radius**2)


def pressed_then(way: str, moved: np.ndarray) -> np.ndarray:
    """Force over mu P and moment over mu P a after each step, shape (n, 3), of a contact that is pressed first.

    way: as for `ledger.dissipated`. moved: displacements and angles times a so far, over the displacement of full slip,
    shape (n, 3).
    """
    overlap = np.concatenate([[0.0], np.linspace(0.02, 1.0, 50), np.ones(len(moved))])
    return ledger.dissipated(way, overlap, np.concatenate([np.zeros((51, 3)), moved]))[1][51:]


@pytest.mark.parametrize(
    ("way", "steps", "within"), [("microslip", 1, 1e-4), ("microslip", 30, 1e-4), ("sectors", 1, 0.01)]
)
def test_torsion_alone_follows_lubkin(way: str, steps: int, within: float) -> None:
    """Whatever the steps. Sectors from where a whole ring slips; before that M/M_s is 0.012 off."""
    stick, pair = STICK[1:] if way == "sectors" else STICK, ledger.pair_of_law("microslip")
    beta = torsion.angle(stick) * 4.0 / 3.0 * pair.effective_shear_modulus / pair.torsion_modulus
    angle = np.interp(np.arange(1, steps * stick.size + 1) / steps, np.arange(stick.size + 1), np.append(0.0, beta))
    found = pressed_then(way, np.column_stack([0.0 * angle, 0.0 * angle, angle]))
    assert found[steps - 1 :: steps, 2] == pytest.approx(torsion.moment(stick), abs=within * FULL)


def test_stuck_stiffness_and_the_limit_are_exact_at_any_radius() -> None:
    for overlap in (DEEP, 0.6 * DEEP, 0.3 * DEEP, 0.1 * DEEP):
        contact = Contact()
        contact.press(overlap)
        tiny = 1e-12 * contact.unit  # the rim slips from the beginning
        contact.move(overlap, angle=tiny)
        stuck = 16.0 / 3.0 * contact.pair.g_t * contact.radius**3 * tiny
        assert contact.torsion.moment == pytest.approx(stuck, rel=1e-9)
        contact.move(overlap, angle=20.0 * contact.unit)
        assert contact.torsion.moment == pytest.approx(FULL * contact.full * contact.radius, rel=1e-12)


@pytest.mark.parametrize("steps", [2, 40])
@pytest.mark.parametrize("most", [0.05, 0.1, 0.2, 0.4])
def test_unloading_is_masings_rule(most: float, steps: int) -> None:
    """The curve of the way back is that of the first twist, doubled; limit: twice what 12 chords miss of that."""
    stick = np.linspace(1.0, 0.01, 1000)
    beta, share = torsion.angle(stick), torsion.moment(stick) / FULL
    contact = Contact()
    contact.press()
    contact.move(DEEP, angle=most * contact.unit)
    for step in range(1, steps + 1):
        contact.move(DEEP, angle=-2.0 * most / steps * contact.unit)
        known = np.interp(most, beta, share) - 2.0 * np.interp(most * step / steps, beta, share)
        found = contact.torsion.moment / (FULL * contact.full * contact.radius)
        assert found == pytest.approx(known, abs=8e-3)


def test_a_moment_outlives_a_load_that_swings() -> None:
    """What is held by the middle of a contact does not creep away while its rim comes and goes."""
    contact = Contact()
    contact.press()
    contact.move(DEEP, angle=0.05 * contact.unit)
    held = []
    for _ in range(30):
        contact.press(0.7 * DEEP, 10)
        contact.press(DEEP, 10)
        held.append(contact.torsion.moment)
    assert held[-1] > 0.3 * contact.full * contact.radius * torsion.moment(0.9)
    assert held[-1] == pytest.approx(held[9], rel=0.02)


def test_limit_curve_is_the_closed_form() -> None:
    """Also its normal and its curvature, for the curve between k = 0 and 1 is a polynomial."""
    assert limit_point(1.0, 0.0)[:2] == (1.0, 0.0)
    for k in (*np.linspace(0.03, 1.0, 60), 1.001, 1.5, 2.0, 30.0):
        size, angle, step = sqrt(1.0 + k * k), atan2(k, 1.0), 1e-6
        f, m, bend = limit_point(1.0 / size, k / size)
        force, moment = force_and_moment(1.0, k)
        assert (f, m) == (pytest.approx(float(force), abs=1e-5), pytest.approx(float(moment), abs=1e-5))
        if abs(k - 1.0) > 1e-3:
            one, other = (limit_point(cos(angle + d), sin(angle + d)) for d in (-step, step))
            chord = (other[0] - one[0], other[1] - one[1])
            assert hypot(*chord) / (2.0 * step) == pytest.approx(bend, rel=1e-3)
            assert abs(chord[0] + k * chord[1]) < 1e-5 * hypot(*chord) * size
    both = [limit_point(sqrt(0.5) + d, sqrt(0.5) - d)[:2] for d in (1e-12, -1e-12)]
    assert both[0] == pytest.approx(both[1], abs=1e-7)


def test_nearest_point_of_the_limit_curve() -> None:
    for angle in np.linspace(0.0, pi / 2.0, 40):
        v, w = cos(angle), sin(angle)
        f, m, _ = limit_point(v, w)
        for far in (1e-6, 0.01, 0.1, 1.0):
            assert nearest(f + far * v, m + far * w) == (pytest.approx(f, abs=3e-5), pytest.approx(m, abs=3e-5), True)
        assert not nearest(f - 0.01 * v, m - 0.01 * w)[2]


@pytest.mark.heavy
@pytest.mark.parametrize("heading", [0.0, 0.4])
@pytest.mark.parametrize("way", ["sectors", "microslip", "mindlin", "coulomb"])
@pytest.mark.parametrize("k", [0.1, 0.5, 1.0, 3.0])
def test_steady_sliding_with_spin(way: str, heading: float, k: float) -> None:
    along = np.array([np.cos(heading), np.sin(heading)])
    found = pressed_then(way, 0.02 * np.arange(1, 2001)[:, None] * [*along, k])[-1]
    force, moment = force_and_moment(1.0, k)
    assert found == pytest.approx(np.append(force * along, moment), abs=1e-3)


def test_hardly_any_spin_hardly_changes_a_slide() -> None:
    one, other = Contact(), Contact()
    rng = np.random.default_rng(4)
    slides = np.repeat(rng.uniform(-1.0, 1.0, 12), 25) * 3e-7
    depths = DEEP * np.sin(np.linspace(0.0, pi, slides.size + 2)[1:-1])
    for depth, slide in zip(depths, slides, strict=True):
        one.move(float(depth), float(slide), 1e-9, spun=True)
        other.move(float(depth), float(slide), 0.0, spun=False)
        assert one.touch.f == pytest.approx(other.touch.f, abs=1e-4 * 0.3 * one.touch.force)


MOVES = st.lists(
    st.tuples(st.floats(0.02, 1.0), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.integers(1, 30)),
    min_size=2,
    max_size=12,
)


@pytest.mark.heavy
@settings(max_examples=60, deadline=None)
@given(MOVES)
def test_no_history_makes_energy(moves) -> None:
    """Whatever the loads, slides and twists: the work put into torsion is never less than what it has stored."""
    contact = Contact()
    contact.press()
    slip, turn = 2.0 * contact.full / (contact.pair.g_star * contact.radius), contact.unit
    work, most = 0.0, 1e-12 * contact.full * contact.radius * turn
    for depth, slide, angle, steps in moves:
        start = contact.touch.overlap
        for i in range(steps):
            overlap = start + (depth * DEEP - start) * (i + 1) / steps
            contact.move(overlap, slide * slip / steps, angle * turn / steps)
            work += contact.torsion.moment * angle * turn / steps
            assert work >= stored(contact.torsion, contact.touch, contact.pair.g_t) - most
            assert abs(contact.torsion.moment) <= FULL * contact.full * contact.radius * (1.0 + 1e-9)
            assert abs(contact.touch.f) <= contact.full * (1.0 + 1e-9)


@pytest.mark.heavy
@settings(max_examples=60, deadline=None)
@given(MOVES)
def test_sliding_and_spinning_take_energy(moves) -> None:
    """The same of force and moment together, whose springs come to rest again: at one load."""
    contact = Contact()
    contact.press()
    slip, turn = 2.0 * contact.full / (contact.pair.g_star * contact.radius), contact.unit
    work, force, moment = 0.0, contact.touch.f, contact.torsion.moment
    unit = contact.full * slip
    for _, slide, angle, steps in moves:
        for _ in range(steps):
            contact.move(DEEP, slide * slip / steps, angle * turn / steps)
            work += 0.5 * (force + contact.touch.f) * slide * slip / steps
            work += 0.5 * (moment + contact.torsion.moment) * angle * turn / steps
            force, moment = contact.touch.f, contact.torsion.moment
            assert work >= -1e-9 * unit
