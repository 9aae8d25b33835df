"""All springs at once on a line: exact along straight paths, memory, bounds, and the impacts and paths that use it."""

from __future__ import annotations

from math import sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contactlaw import MATERIALS, Body, ContactPair, collide, force_along_path
from contactlaw.laws import microslip_line as line
from contactlaw.laws.microslip import Microslip
from validation.front_ways import thrown
from validation.reference import superposition

STEEL, MU, DEEP = MATERIALS["steel"], 0.3, 1e-6
PAIR = ContactPair(STEEL, STEEL, MU, radius=1.0)
SLIP = MU / PAIR.kappa * DEEP  # [m] that makes the whole contact slide
FULL = MU * 4.0 / 3.0 * DEEP**1.5  # mu P/E* at the overlap DEEP, R = 1 m
OVERLAP = st.one_of(st.floats(-0.3, 0.0), st.floats(1e-6, 1.0))
ZIGZAG = st.lists(st.tuples(OVERLAP, st.floats(-2.0, 2.0)), min_size=2, max_size=14)


def pulls(path: np.ndarray, law: object = "microslip") -> np.ndarray:
    """F/(mu P) with P at the overlap DEEP; path: overlap and displacement in DEEP and SLIP, shape (n, 2)."""
    pair = ContactPair(STEEL, STEEL, MU, radius=1.0, law=law)  # type: ignore[arg-type]
    force = force_along_path(pair, DEEP * path[:, 0], SLIP * path[:, 1])[1]
    return force / pair.effective_modulus / FULL


def followed(path: np.ndarray, more: int = 0) -> tuple[np.ndarray, int, float]:
    """Stack, its top and s after a path of the operator itself, overlaps > 0; more: pieces to come."""
    stack = line.new_stack(len(path) + more)
    top, s, place = 0, 0.0, 0.0
    for overlap, displacement in path:
        top, s = line.advance(stack, top, s + displacement - place, overlap, sqrt(overlap))
        place = displacement
    return stack, top, s


def feet(path: np.ndarray, y: np.ndarray, parts: int) -> np.ndarray:
    """Deflections s - v of springs that enter at y: the window moved in small steps, spring by spring."""
    v, before, s = np.zeros(y.size), 0.0, 0.0
    for overlap, target in path:
        for part in np.arange(1, parts + 1) / parts:
            now, place = before + (overlap - before) * part, s + (target - s) * part
            v = np.where(y < now, np.clip(v, place - now + y, place + now - y), place)
        before, s = overlap, target
    return np.where(y < before, s - v, 0.0)


@given(ZIGZAG)
@settings(max_examples=300)
def test_zigzags_match_the_superposition_method(points: list[tuple[float, float]]) -> None:
    """Two exact routes; through leaving and touching again, and from a first point in contact."""
    path = np.array(points)
    found = superposition.force_along_path(
        DEEP * path[:, 0], SLIP * path[:, 1], kappa=PAIR.kappa, friction=PAIR.friction
    )
    np.testing.assert_allclose(pulls(path), found / FULL, atol=1e-13)


@pytest.mark.heavy
@pytest.mark.parametrize("seed", range(4))
def test_force_and_energy_are_those_of_springs_one_by_one(seed: int) -> None:
    """4000 springs and small steps: error 1/parts of the entering springs, 1/springs of the sums."""
    rng = np.random.default_rng(seed)
    path = np.column_stack([rng.uniform(0.2, 1.0, 6), np.cumsum(rng.normal(scale=0.5, size=6))])
    path[0, 1] = 0.0
    stack, top, s = followed(path)
    w = sqrt(path[-1, 0]) * (np.arange(4000) + 0.5) / 4000
    deflection = feet(path, w * w, 2000)
    width = sqrt(path[-1, 0]) / 4000
    assert line.spring_sum(stack, top, s) == pytest.approx(width * deflection.sum(), abs=1e-3)
    assert line.stored(stack, top, s) == pytest.approx(width * (deflection**2).sum(), abs=1e-3)


@pytest.mark.heavy
def test_nodes_converge_to_all_springs() -> None:
    """The nodes' error falls with the square of their number, along the paths of a smooth load."""
    part = np.linspace(0.0, 1.0, 2001)
    path = np.column_stack([np.sin(np.pi * part[:-1]) ** 0.8, 0.8 * np.sin(7.0 * part[:-1])])
    exact, counts = pulls(path), np.array([8, 16, 32, 64])
    errors = [np.abs(pulls(path, Microslip(int(n))) - exact).max() for n in counts]
    assert -np.polyfit(np.log(counts), np.log(errors), 1)[0] > 1.7
    assert errors[-1] < 1e-3


@given(ZIGZAG, st.integers(2, 9))
def test_more_points_on_the_same_path_change_nothing(points: list[tuple[float, float]], parts: int) -> None:
    path = np.array(points)
    index = np.arange(len(path))
    fine = np.interp(np.arange((len(path) - 1) * parts + 1) / parts, index, path[:, 0])
    dense = np.column_stack([fine, np.interp(np.arange(fine.size) / parts, index, path[:, 1])])
    np.testing.assert_allclose(pulls(dense)[::parts], pulls(path), atol=1e-12)


@given(ZIGZAG)
def test_mirrored_paths_have_mirrored_forces(points: list[tuple[float, float]]) -> None:
    path = np.array(points)
    np.testing.assert_array_equal(pulls(path * [1.0, -1.0]), -pulls(path))


@given(st.lists(st.floats(-0.79, 0.79), min_size=1, max_size=8), st.floats(0.8, 3.0))
def test_a_larger_swing_wipes_out_the_smaller(inner: list[float], reach: float) -> None:
    """Return-point memory: swings inside -0.8 to 0.8 leave no trace once the path is back beyond them."""
    ends = [(1.0, 0.0), (1.0, 0.8), (1.0, -0.8)]
    swings = [(1.0, place) for place in inner]
    with_swings = pulls(np.array([*ends, *swings, (1.0, reach)]))
    assert with_swings[-1] == pytest.approx(pulls(np.array([*ends, (1.0, reach)]))[-1], abs=1e-13)


def test_entries_never_outgrow_the_pieces_of_the_path() -> None:
    """Swings that shrink are all remembered: the longest memory there is, one entry a piece."""
    pieces = 3000
    stack, top, s, place = line.new_stack(pieces), 0, 0.0, 0.0
    assert stack.shape[0] == pieces + 1
    for j in range(pieces):
        target = 0.9 * (-1.0) ** j * (1.0 - j / pieces)
        top, s = line.advance(stack, top, s + target - place, 1.0, 1.0)
        place = target
        assert top <= j + 1
    assert top > 0.99 * pieces
    assert (np.diff(stack[: top + 1]["end"]) > 0.0).all()


@pytest.mark.heavy
@pytest.mark.parametrize("overlap_too", [False, True])
def test_long_random_paths_stay_exact_and_bounded(overlap_too: bool) -> None:
    """1e5 turns: the same force as from the superposition method at the end, and never beyond mu P."""
    rng = np.random.default_rng(5)
    path = np.column_stack([np.ones(100_000), rng.uniform(-1.0, 1.0, 100_000)])
    if overlap_too:
        path[:, 0] = rng.uniform(-0.01, 1.0, 100_000)
    found = pulls(path)
    assert (np.abs(found) <= np.maximum(path[:, 0], 0.0) ** 1.5 * (1.0 + 1e-12)).all()
    known = superposition.force_along_path(DEEP * path[:, 0], SLIP * path[:, 1], kappa=PAIR.kappa, friction=MU)
    np.testing.assert_allclose(found, known / FULL, atol=1e-11)


def test_long_slides_cost_no_digits() -> None:
    """s is counted afresh when the whole contact slides: the state is the same, to the bit, after any length."""
    states = []
    for length in (3.0, 1e12):
        stack, top, s = followed(np.array([(1.0, 0.0), (1.0, length)]), more=3)
        for step in (-0.3, 0.1, -0.05):
            top, s = line.advance(stack, top, s + step, 0.9, sqrt(0.9))
        states.append((top, s, line.spring_sum(stack, top, s)))
    assert states[0] == states[1]


@given(st.lists(st.tuples(st.floats(0.01, 1.0), st.floats(-2.0, 2.0)), min_size=1, max_size=8))
@settings(max_examples=60)
def test_state_keeps_to_its_bounds(points: list[tuple[float, float]]) -> None:
    """Slopes within +-1, v at the rim is s, energy not negative, force within the cone: at each piece."""
    for count in range(1, len(points) + 1):
        stack, top, s = followed(np.array(points[:count]))
        overlap = points[count - 1][0]
        assert stack[top]["end"] == overlap and stack[top]["place"] == pytest.approx(s, abs=1e-14)
        assert (np.abs(stack[1 : top + 1]["slope"]) <= 1.0).all() and abs(s) <= overlap * (1.0 + 1e-14)
        assert line.stored(stack, top, s) >= 0.0
        assert abs(line.spring_sum(stack, top, s)) <= 2.0 / 3.0 * overlap**1.5 * (1.0 + 1e-12)


@pytest.mark.heavy
@given(st.integers(0, 2**32 - 1))
@settings(max_examples=40)
def test_what_is_put_in_is_stored_or_lost(seed: int) -> None:
    """Work less stored energy never falls, but for the quadrature of the work: 1e-5 of mu P s in 400 steps a piece."""
    rng = np.random.default_rng(seed)
    corners = np.column_stack([rng.uniform(0.05, 1.0, 6), rng.uniform(-1.0, 1.0, 6)])
    corners[0, 1] = 0.0
    at = np.arange(401 * 5 - 4) / 400
    path = np.column_stack([np.interp(at, np.arange(6), column) for column in corners.T])
    stack, (top, s) = line.new_stack(len(path)), (0, 0.0)
    lost, last, place = [], 0.0, 0.0
    work = 0.0
    for overlap, displacement in path:
        top, s = line.advance(stack, top, s + displacement - place, overlap, sqrt(overlap))
        force = line.spring_sum(stack, top, s)
        work += 0.5 * (force + last) * (displacement - place)
        lost.append(work - 0.5 * line.stored(stack, top, s))
        last, place = force, displacement
    assert np.diff(lost).min() > -1e-5 * 2.0 / 3.0


@pytest.mark.heavy
def test_motion_in_the_plane_on_a_line_is_motion_on_a_line() -> None:
    rng = np.random.default_rng(2)
    overlap, place = rng.uniform(-0.1, 1.0, 30), rng.normal(size=30)
    x, y = np.cos(0.7), np.sin(0.7)
    _, along = force_along_path(PAIR, DEEP * overlap, SLIP * place)
    plane = SLIP * (np.outer(place, (x, y)) + (5.0, -2.0))
    _, found = force_along_path(PAIR, DEEP * overlap, plane)
    np.testing.assert_allclose(found, np.outer(along, (x, y)), atol=1e-12 * np.abs(along).max())
    plane[7] += SLIP * 1e-3 * np.array([-y, x])  # off the line: nodes, with the error that they have
    _, nodes = force_along_path(PAIR, DEEP * overlap, plane)
    difference = np.abs(nodes - found).max() / np.abs(along).max()
    assert 1e-6 < difference < 1e-2


def test_explicit_nodes_go_by_nodes() -> None:
    path = np.array([(0.0, 0.0), (1.0, 0.3), (1.0, 0.7), (0.8, -0.5)])
    assert np.abs(pulls(path, Microslip(16)) - pulls(path)).max() > 1e-7


def test_friction_too_small_to_scale_by_gives_no_nan() -> None:
    scale = 1e-300
    pair = ContactPair(STEEL, STEEL, scale, radius=0.02)
    normal, force = force_along_path(pair, DEEP * np.array([0.0, 1.0, 0.5, 0.7]), np.array([0.0, 1e-6, 1e-6, -1e-6]))
    assert np.isfinite(force).all() and (np.abs(force) <= 2.0 * scale * normal).all()
    impact = collide(pair, Body(0.5, 0.02, velocity=(0.2, 0.0, -1.0)))
    np.testing.assert_allclose(impact.velocity_a, (0.2, 0.0, 1.0), atol=1e-12)


@pytest.mark.heavy
@pytest.mark.parametrize("chi", [1.0, 1.441, 2.0])
def test_error_of_impacts_is_second_order_in_the_steps(chi: float) -> None:
    """Against the superposition method in fine steps; at the default as `collide` says."""
    psi_1 = np.linspace(0.1, 4.0 * chi - 1.2, 9)
    known = [superposition.impact(one, chi, 16000) for one in psi_1]
    steps, errors = np.array([100, 200, 400]), []
    for count in steps:
        made = [collide(*thrown("microslip", one, chi), steps=int(count)) for one in psi_1]
        errors.append(max(abs(one.psi_2 - of.psi_2) for one, of in zip(made, known, strict=True)))
    assert -np.polyfit(np.log(steps), np.log(errors), 1)[0] > 1.8
    assert errors[-1] < 1e-4
    for one, of in zip(made, known, strict=True):
        force = np.abs(one.tangential_force[:, 0]) / (0.115 * one.normal_force.max())
        assert np.abs(force - np.abs(np.interp(one.time / one.time[-1], of.time, of.tangential_force))).max() < 3e-5


@pytest.mark.parametrize("e", [1.0, 0.93, 0.5])
@pytest.mark.parametrize("psi_1", [6.0, 50.0])
def test_gross_slip_is_exact(e: float, psi_1: float) -> None:
    pair = ContactPair(STEEL, STEEL, 0.115, restitution=e)
    body = Body(0.5, 0.025, velocity=(psi_1 * 0.115 / pair.kappa, 0.0, -1.0))
    impact = collide(pair, body)
    assert impact.psi_2 == pytest.approx(psi_1 - 2.0 * impact.chi * (1.0 + e), rel=1e-12)
    np.testing.assert_allclose(-impact.tangential_force[:, 0], 0.115 * impact.normal_force, rtol=1e-12)


@pytest.mark.heavy
@pytest.mark.parametrize("e", [0.93, 0.5])
@pytest.mark.parametrize("psi_1", [0.5, 1.5, 3.0])
def test_damped_impacts_are_what_many_nodes_converge_to(e: float, psi_1: float) -> None:
    body = Body(0.5, 0.025, velocity=(psi_1 * 0.115 / PAIR.kappa, 0.0, -1.0))
    exact, few, many = (
        collide(ContactPair(STEEL, STEEL, 0.115, restitution=e, law=law), body, steps=3200)
        for law in ("microslip", Microslip(16), Microslip(256))
    )
    assert abs(many.psi_2 - exact.psi_2) < 0.1 * abs(few.psi_2 - exact.psi_2) + 1e-6
    np.testing.assert_allclose(
        many.elastic_tangential, exact.elastic_tangential, atol=1e-3 * exact.elastic_tangential.max()
    )


def test_the_whole_is_not_held_by_the_velocities() -> None:
    """Who keeps only velocities of many impacts does not keep their histories."""
    impact = collide(PAIR, Body(0.5, 0.02, velocity=(0.2, 0.0, -1.0)))
    assert impact.velocity_a.base is not None and impact.velocity_a.base.size == 12
