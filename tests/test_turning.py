"""Slides that turn, by the default law: against rings, on a line, across the border between both, and for energy."""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contactlaw import Body, collide
from contactlaw.laws.microslip import Microslip, displace, half_line_nodes
from contactlaw.laws.microslip_turning import TURN, displace_on_surface, surface_maps
from contactlaw.turning import MicroslipTurning
from validation import ledger, turning
from validation.reference.turning_data import load

pytestmark = pytest.mark.heavy

SAVED = load()


@pytest.mark.parametrize("count", [2, 5, 16, 128])
def test_maps_keep_force_and_energy(count: int) -> None:
    """Rings carry what the springs do, sum of B by columns = 2 w; no pressure is negative; maps are one another's."""
    x, w = half_line_nodes(count)
    maps = surface_maps(tuple(w))
    b, c = maps["surface"], maps["line"]
    np.testing.assert_allclose(b.sum(axis=0), 2.0 * w, rtol=1e-12)
    np.testing.assert_allclose(b @ c, np.eye(count), atol=1e-9)
    assert (np.tril(b, -1) == 0.0).all()
    for overlap in np.linspace(0.0, 1.0, 51):
        assert (b @ np.maximum(overlap - x**2, 0.0) >= -1e-15).all()
    a = c.T @ np.diag(2.0 * w) @ c
    np.testing.assert_allclose(maps["follow"] + np.eye(count), a / np.diag(a), atol=1e-12)
    np.testing.assert_allclose(maps["slip"] @ c, a / np.diag(a)[:, None], atol=1e-9)


@pytest.mark.parametrize("name", ["circle", "square", "eight", "circle, swinging load", "circle, touch to release"])
@pytest.mark.parametrize("amplitude", [0.4, 1.0])
def test_force_is_that_of_rings(name: str, amplitude: float) -> None:
    (known,) = [one["force"] for one in SAVED["forces"] if one["path"] == name and one["amplitude"] == amplitude]
    force = turning.forces(MicroslipTurning(), name, amplitude)
    assert np.abs(force - known).max() < 0.005
    if "circle" in name and amplitude == 1.0:
        assert np.abs(turning.forces("microslip", name, amplitude) - known).max() > 0.02
    if "release" not in name:
        assert turning.loss(force, name, amplitude) == pytest.approx(
            turning.loss(np.array(known), name, amplitude), 0.03
        )


def test_rebound_is_that_of_rings_where_the_tangential_mass_depends_on_direction() -> None:
    if numba.config.DISABLE_JIT:
        pytest.skip("a world is moved by compiled code alone")
    rows = SAVED["uneven"]
    world, bodies = turning.impacts_world(rows)
    world.step(3)
    assert np.abs(turning.psi_2(world, bodies) - np.array(rows)[:, 4:6]).max() < 5e-3


@pytest.mark.parametrize("seed", range(5))
def test_on_a_line_the_rings_are_the_springs(seed: int) -> None:
    """Both ways of taking a step, at a load that comes and goes."""
    rng, law = np.random.default_rng(seed), np.rec.array(MicroslipTurning(16).numbers())[0]
    springs, rings = np.zeros((2, 16)), np.zeros((2, 16))
    before = 0.0
    for overlap, slide in zip(rng.uniform(0.1, 1.0, 40), 0.5 * rng.normal(size=40), strict=True):
        step = 1.0, overlap, before, 0.6 * slide, 0.8 * slide, 1.0
        known, found = displace(law, springs, *step), displace_on_surface(law, rings, *step)
        np.testing.assert_allclose(found, known, atol=1e-3)
        rings[:], before = springs, overlap


class Springs(Microslip):
    """Microslip, with the springs of the law that turns."""

    name = "springs_of_turning"

    def numbers(self) -> np.ndarray:
        values, other = super().numbers(), MicroslipTurning(self.memory).numbers()
        for name in values.dtype.names or ():
            values[name] = other[name]
        return values


@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_a_straight_slide_is_that_of_the_springs(angle: float) -> None:
    for seed in range(20):
        overlap, place = ledger.random_path(np.random.default_rng(seed), "opening", 16)
        along = np.outer(place[:, 0], [np.cos(angle), np.sin(angle)])
        (_, force), (_, known) = (ledger.dissipated(law, overlap, along) for law in (MicroslipTurning(16), Springs(16)))
        np.testing.assert_allclose(force, known, rtol=0.0, atol=1e-15)


def test_an_impact_in_the_plane_is_straight() -> None:
    """The tangential mass of a ball has no direction: nothing turns, whichever way it is thrown."""
    known = [
        collide(ledger.pair_of_law(law), Body(0.1, 0.02, velocity=(0.12, 0.3, -1.0))).psi_2
        for law in (MicroslipTurning(16), Springs(16))
    ]
    assert known[0] == known[1]


@pytest.mark.parametrize("kind", ["steady", "growing", "shrinking"])
def test_force_is_continuous_where_a_slide_begins_to_turn(kind: str) -> None:
    """Half of full slip straight, then on at an angle, and back: the force goes with the angle across the border."""
    way = np.linspace(0.0, 0.9, 201)
    on = np.maximum(way - 0.5, 0.0)
    load = {"steady": np.ones(401), "growing": np.linspace(0.3, 1.0, 401), "shrinking": np.linspace(1.0, 0.5, 401)}[
        kind
    ]
    sideways = []
    for angle in np.array([1e-9, 1e-5, 0.3, 0.9, 1.1, 3.0, 10.0]) * TURN / 1e-9 * np.array([1.0] + 6 * [1e-9]):
        place = np.stack([np.minimum(way, 0.5) + on * np.cos(angle), on * np.sin(angle)], 1)
        _, force = ledger.dissipated(
            MicroslipTurning(), np.append(0.0, load), np.concatenate([place[:1], place, place[-2::-1]])
        )
        sideways.append(force[:, 1] / angle)
    for one in sideways[1:]:
        np.testing.assert_allclose(one, sideways[0], atol=0.2)  # of TURN, over mu P: 2e-4


@given(
    law=st.sampled_from(["microslip", MicroslipTurning()]),
    seed=st.integers(0, 2**32 - 1), kind=st.sampled_from(ledger.KINDS), parts=st.sampled_from([1, 4, 16]),
)  # fmt: skip
@settings(max_examples=600, deadline=None)
def test_no_path_gives_energy(law: Any, seed: int, kind: str, parts: int) -> None:
    """To rounding, load and place changed in turn, in steps of any size."""
    overlap, place = ledger.in_turn(*ledger.random_path(np.random.default_rng(seed), kind, parts))
    lost, force = ledger.dissipated(law, overlap, place)
    assert ledger.fall(lost) < 1e-12
    assert (np.hypot(*force.T[:2]) <= np.maximum(overlap, 0.0) ** 1.5 * (1.0 + 1e-12)).all()


@pytest.mark.parametrize("law", ["microslip", MicroslipTurning()], ids=["springs", "turning"])
@pytest.mark.parametrize(
    ("overlap", "place"),
    [
        ([0.405, 0.042, 0.972, 0.263], [[0.044, 0.003], [-0.048, -0.039], [-0.066, 0.004], [-0.104, -0.025]]),
        ([0.918, 0.641, 0.005, 0.002], [[-0.036, 0.442], [0.077, -0.061], [-0.153, -0.599], [0.085, -0.456]]),
    ],
    ids=["pressed on", "let go"],
)
def test_what_slides_as_a_whole_while_its_load_changes_gives_no_energy(law: Any, overlap: Any, place: Any) -> None:
    """Nodes that span another radius then hold what they did: made anew of the limit they would hold 7e-6 more."""
    path = ledger.in_turn(np.append(0.0, overlap), np.array(place[:1] + place))
    lost, _ = ledger.dissipated(law, *path)
    assert ledger.fall(lost) < 1e-13


def test_what_slides_as_a_whole_and_then_spins_gives_no_energy() -> None:
    """Spin takes friction from the springs and gives it back: they then hold what was left, not all (1e-2 more)."""
    place = [
        [-0.429, 0.563, -1.716], [-1.337, 1.325, -1.615], [0.139, 0.427, -2.923], [1.445, 0.024, -2.259],
        [0.093, 0.782, -1.542], [2.836, -0.815, -0.988],
    ]  # fmt: skip
    lost, _ = ledger.dissipated("microslip", np.append(0.0, np.ones(6)), np.array(place[:1] + place))
    assert ledger.fall(lost) < 1e-13


@given(
    corners=st.lists(st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0)), min_size=2, max_size=6),
    lock=st.floats(0.0, 1.2), size=st.floats(-3.0, 0.3), parts=st.sampled_from([1, 3, 20]),
)  # fmt: skip
@settings(max_examples=200, deadline=None)
def test_no_cycle_about_a_held_force_gives_energy(
    corners: list[tuple[float, float]], lock: float, size: float, parts: int
) -> None:
    """A small closed polygon again and again in a contact that is sheared, at constant load."""
    loop = 10.0**size * np.array([*corners, corners[0]])
    at = np.linspace(0.0, len(corners), parts * len(corners) + 1)
    round_ = np.stack([np.interp(at, np.arange(len(loop)), one) for one in loop.T], 1) - loop[0]
    lead = np.stack([np.linspace(0.0, lock, 25), np.zeros(25)], 1)
    place = np.concatenate([lead[:1], lead, *[lead[-1] + round_[1:]] * 4, [[9.0, 0.0]]])  # never of no length
    lost, _ = ledger.dissipated(MicroslipTurning(), np.append(0.0, np.ones(len(place) - 1)), place)
    assert ledger.fall(lost[:-1]) < 1e-12
