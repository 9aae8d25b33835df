"""Verification of the superposition method: closed forms, conditions of contact, order, the annulus solver."""

import math

import numba
import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from tests.reference import mindlin_loop
from validation.reference import annulus, superposition
from validation.reference.annulus_kernel import hertz_displacement
from validation.reference.superposition import _normal_motion
from validation.reference.superposition_kernel import advance, hertz_force, resultant, traction

compiled_only = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="minutes uncompiled")  # type: ignore[attr-defined]

DISK = 1.256  # chi of a solid steel disk, Maw, Barber & Fawcett (1981)
ROUNDING = 1e-12


def random_path(seed, points=60):
    """Overlap, in contact throughout after the touch, and scaled displacement of a few slip lengths at most."""
    rng = np.random.default_rng(seed)
    overlap = np.concatenate([[0.0], rng.uniform(0.05, 1.0, points)])
    displacement = np.concatenate([[0.0], np.cumsum(rng.normal(0.0, 0.3, points))])
    return overlap, displacement


# --- impacts ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("chi", [0.5, DISK, 4.5])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_gross_slip_is_exact(chi, sign):
    psi_1 = sign * (max(1.0, 4.0 * chi - 1.0) + np.array([0.1, 2.0]))
    np.testing.assert_allclose(superposition.rebound(psi_1, chi, 20), psi_1 - sign * 4.0 * chi, rtol=0.0, atol=ROUNDING)


def test_stick_that_follows_the_overlap_is_exact():
    # chi = 1/2: s = psi_1 d and F = psi_1 P solve the motion, s'' = -F, without slip at any time.
    for psi_1 in (0.3, 0.9, -0.9):
        assert superposition.rebound(psi_1, 0.5, 30) == pytest.approx(-psi_1, abs=ROUNDING)


@pytest.mark.parametrize("psi_1", [0.4, 1.2, 3.0])
def test_mirrored_impact(psi_1):
    one, other = superposition.impact(psi_1, DISK, 100), superposition.impact(-psi_1, DISK, 100)
    np.testing.assert_array_equal(other.psi, -one.psi)
    np.testing.assert_array_equal(other.tangential_force, -one.tangential_force)
    np.testing.assert_array_equal(other.components, one.components)


@pytest.mark.parametrize("psi_1", [0.4, 1.2, 3.0])
def test_history_is_that_of_one_impact(psi_1):
    history = superposition.impact(psi_1, DISK, 200)
    assert history.psi[0] == psi_1 and history.psi[-1] == history.psi_2 == superposition.rebound(psi_1, DISK, 200)
    assert history.time[0] == 0.0 and history.time[-1] == 1.0 and (np.diff(history.time) > 0.0).all()
    assert history.normal_force.max() == pytest.approx(1.0, abs=ROUNDING)
    assert history.normal_force[-1] == history.tangential_force[-1] == 0.0
    assert (np.abs(history.tangential_force) <= history.normal_force + ROUNDING).all()


def test_normal_motion_solves_hertz_impact():
    time, overlap, speed = _normal_motion(40)
    path = solve_ivp(lambda _, y: [y[1], -4.0 / 3.0 * max(y[0], 0.0) ** 1.5], (0.0, time[-1]), [0.0, 1.0],
                     t_eval=time, method="DOP853", rtol=1e-11, atol=1e-13)  # fmt: skip
    np.testing.assert_allclose(overlap, path.y[0], rtol=0.0, atol=1e-8)
    np.testing.assert_allclose(speed, path.y[1], rtol=0.0, atol=1e-8)


@compiled_only
@pytest.mark.parametrize("chi", [1.0, DISK, 2.0])
def test_second_order_in_the_time_step(chi):
    incidence = np.array([0.25, 0.5, 0.9, 1.2, 1.6, 2.0, 2.6])
    limit = superposition.rebound(incidence, chi, 16000)
    counts = np.array([50, 100, 200, 400, 800, 1600])
    # The steps at which slip sets in and ends fall differently each time, so that single errors scatter.
    errors = [np.sqrt(np.mean((superposition.rebound(incidence, chi, int(n)) - limit) ** 2)) for n in counts]
    assert -2.3 < np.polyfit(np.log(counts), np.log(errors), 1)[0] < -1.8


@compiled_only
@pytest.mark.parametrize(("psi_1", "chi"), [(0.25, DISK), (1.2, DISK), (3.0, DISK), (0.8, 2.0), (2.0, 3.0)])
def test_same_rebound_as_the_annuli(psi_1, chi):
    other, uncertainty = annulus.rebound_extrapolated(psi_1, chi)
    step = float(abs(superposition.rebound(psi_1, chi, 1000) - superposition.rebound(psi_1, chi, 500)))
    assert step < 5e-4 and uncertainty < 5e-4  # what a reference that judges has to keep
    # Either one's own estimate of its error: the change from half as many steps, from half as many annuli.
    assert superposition.rebound(psi_1, chi, 1000) == pytest.approx(other, abs=uncertainty + step)


@compiled_only
@pytest.mark.parametrize("psi_1", [0.5, 1.2, 3.0])
def test_same_history_as_the_annuli(psi_1):
    one, other = superposition.impact(psi_1, DISK), annulus.impact(psi_1, DISK, 40)
    # The annuli err by up to 1e-3 in psi at N = 40, in force likewise.
    for name in ("normal_force", "tangential_force", "psi"):
        np.testing.assert_allclose(
            np.interp(other.time, one.time, getattr(one, name)), getattr(other, name), rtol=0.0, atol=1e-3
        )


@compiled_only
def test_impacts_create_no_energy():
    rng = np.random.default_rng(0)
    chi = rng.uniform(0.3, 6.0, 300)
    psi_1 = rng.uniform(0.0, 1.0, 300) * (4.0 * chi + 1.0)
    assert (np.abs(superposition.rebound(psi_1, chi, 2000)) <= psi_1 + 1e-5).all()  # 1e-5: error of the time step


# --- components -------------------------------------------------------------------------------------------------------


def test_components_grow_with_the_steps_and_are_swallowed_again():
    counts = [superposition.impact(0.5, DISK, n).components for n in (50, 100, 200)]
    most = [c.max() for c in counts]
    assert 0.3 * 200 < most[2] < 0.5 * 200  # one more with each step of growth that sticks
    assert most[0] == pytest.approx(most[2] / 4, abs=1) and most[1] == pytest.approx(most[2] / 2, abs=1)
    for c in counts:
        assert (np.diff(c) <= 1).all()
        assert c[0] == c[-1] == 0 and c[-2] == 1  # it leaves in gross slip: one component
    assert superposition.impact(5.0, DISK, 50).components.max() == 1


# --- closed forms at constant normal force ----------------------------------------------------------------------------


def test_cattaneo_mindlin_loading_is_exact():
    displacement = np.linspace(0.0, 1.4, 8)
    force = superposition.force_along_path(np.ones(8), displacement)
    np.testing.assert_allclose(force, 4.0 / 3.0 * mindlin_loop.first_loading(displacement), rtol=0.0, atol=ROUNDING)


@pytest.mark.parametrize("amplitude", [0.2, 0.9, 1.0])
def test_load_cycle_is_exact_and_repeats(amplitude):
    kappa, friction = 0.8, 0.3
    loop = mindlin_loop.cycle(amplitude, 9)
    scaled, force = (np.concatenate([values, values[9:]]) for values in (loop.displacement, loop.force))
    got = superposition.force_along_path(
        np.ones(scaled.size), scaled * friction / kappa, kappa=kappa, friction=friction
    )
    np.testing.assert_allclose(got, friction * 4.0 / 3.0 * force, rtol=0.0, atol=ROUNDING)


def test_inner_cycle_closes_and_the_outer_branch_goes_on():
    turn, low, high = 0.8, 0.1, 0.5
    path = np.array([0.0, turn, low, high, low, -0.2])
    force = superposition.force_along_path(np.ones(6), path) * 0.75
    masing = mindlin_loop.first_loading
    outer = masing(turn) - 2.0 * masing((turn - path) / 2.0)
    np.testing.assert_allclose(force[[2, 4, 5]], outer[[2, 4, 5]], rtol=0.0, atol=ROUNDING)
    assert force[3] == pytest.approx(outer[2] + 2.0 * masing((high - low) / 2.0), abs=ROUNDING)
    _, components = superposition.traction_along_path(np.ones(6), path, [0.0, 1.0])
    np.testing.assert_array_equal(components, [1, 2, 3, 4, 3, 3])


@pytest.mark.parametrize("amplitude", [0.1, 0.5, 0.9, 1.0])
def test_lost_work_is_the_area_of_the_loop(amplitude):
    turn = mindlin_loop.turning_displacement(amplitude)
    area = quad(
        lambda s: 2.0 * (amplitude - 2.0 * mindlin_loop.first_loading(0.5 * (turn - s))), turn, -turn, epsabs=1e-12
    )[0]
    assert mindlin_loop.lost_work(amplitude) == pytest.approx(area, rel=1e-8)
    assert mindlin_loop.first_loading(turn) == pytest.approx(amplitude, abs=1e-14)


# --- any path ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("slope", [0.5, 1.0, 2.0])
def test_proportional_loading_and_unloading(slope):
    # Mindlin & Deresiewicz (1953): dF/dP below mu sticks everywhere, above it slips everywhere.
    approach = np.concatenate([np.linspace(0.0, 1.0, 6), np.linspace(1.0, 0.0, 6)[1:]])
    force = superposition.force_along_path(approach, slope * approach)
    normal = 4.0 / 3.0 * approach**1.5
    rising = slice(0, 6) if slope > 1.0 else slice(None)
    np.testing.assert_allclose(force[rising], min(slope, 1.0) * normal[rising], rtol=0.0, atol=ROUNDING)


@pytest.mark.parametrize("seed", range(5))
def test_straight_paths_need_no_steps(seed):
    overlap, displacement = random_path(seed)
    position, fine = np.arange(overlap.size), np.linspace(0.0, overlap.size - 1.0, 7 * (overlap.size - 1) + 1)
    force = superposition.force_along_path(overlap, displacement)
    dense = superposition.force_along_path(np.interp(fine, position, overlap), np.interp(fine, position, displacement))
    np.testing.assert_allclose(dense[::7], force, rtol=0.0, atol=1e-11)


@pytest.mark.parametrize("seed", range(5))
def test_every_increment_meets_the_conditions_of_contact(seed):
    """Stick moves with the body below the limit; slip is at the limit, its traction along the slip."""
    overlap, displacement = random_path(seed)
    radii, ratios, count = np.empty(80), np.empty(80), 0
    points = np.linspace(0.0, 0.999, 150)
    slipped = stuck = 0
    for depth, increment in zip(overlap[1:], np.diff(displacement), strict=True):
        before_edge = radii[count - 1] if count else 0.0
        before = moved(radii, ratios, count, points)
        count, force = advance(radii, ratios, count, math.sqrt(depth), increment, 0.0)
        assert radii[count - 1] == math.sqrt(depth)
        assert (np.diff(radii[:count], prepend=0.0) > 0.0).all() and (np.abs(ratios[:count]) <= 1.0).all()
        assert force == pytest.approx(resultant(radii, ratios, count), abs=ROUNDING)
        slip = increment - (moved(radii, ratios, count, points) - before)
        for r, distance in zip(points, slip, strict=True):
            if r >= min(before_edge, math.sqrt(depth)):
                continue  # not in contact all the while
            limit = 2.0 / math.pi * math.sqrt(depth - r * r)
            q = traction(radii, ratios, count, r)
            assert abs(q) <= limit + ROUNDING
            if abs(distance) > 1e-10:
                assert q == pytest.approx(math.copysign(limit, distance), abs=ROUNDING)
                slipped += 1
            else:
                stuck += 1
    assert slipped > 1000 and stuck > 1000


def moved(radii, ratios, count, points):
    """Elastic displacement at the points: of every component h_b - h_b_-, by the influence function of h."""
    total = np.zeros(points.size)
    inner = 0.0
    for b, ratio in zip(radii[:count], ratios[:count], strict=True):
        for i, r in enumerate(points):
            total[i] += ratio * hertz_displacement(b, r)
            if inner > 0.0:
                total[i] -= ratio * hertz_displacement(inner, r)
        inner = b
    return total


def test_traction_sums_to_the_force():
    overlap, displacement = random_path(3, 6)
    force = superposition.force_along_path(overlap, displacement)
    radii = np.linspace(0.0, 1.0, 20001)
    q, _ = superposition.traction_along_path(overlap, displacement, radii)
    np.testing.assert_allclose(np.trapezoid(2.0 * math.pi * radii * q, radii, axis=1), force, rtol=0.0, atol=1e-5)


@compiled_only
def test_same_force_as_the_annuli_while_both_loads_cycle():
    phase = np.linspace(0.0, 6.0 * math.pi, 121)
    overlap, displacement = 0.6 - 0.4 * np.cos(phase), 0.5 * np.sin(1.7 * phase)
    exact = superposition.force_along_path(overlap, displacement)
    counts = np.array([8, 16, 32])
    errors = [np.abs(annulus.force_along_path(overlap, displacement, annuli=int(n)) - exact).max() for n in counts]
    assert errors[-1] < 1e-3 * hertz_force(1.0)
    assert np.polyfit(np.log(counts), np.log(errors), 1)[0] < -1.6


def test_mirrored_path():
    overlap, displacement = random_path(7)
    np.testing.assert_array_equal(
        superposition.force_along_path(overlap, -displacement), -superposition.force_along_path(overlap, displacement)
    )


def test_reopened_contact_starts_without_traction_where_it_touches():
    approach = np.array([0.0, 1.0, 1.0, -0.5, -0.5, 1.0, 1.0, -1.0, 1.0])
    displacement = np.array([0.0, 0.0, 0.4, 0.4, 3.0, 3.0, 3.4, 3.4, 4.0])
    force = superposition.force_along_path(approach, displacement)
    assert force[3] == force[4] == force[5] == force[7] == 0.0
    assert force[6] == force[2] == pytest.approx(4.0 / 3.0 * mindlin_loop.first_loading(0.4), abs=ROUNDING)
    # The last leg touches half way, at s = 3.7: 0.3 over an overlap of 1, stick.
    assert force[8] == pytest.approx(0.3 * 4.0 / 3.0, abs=ROUNDING)


# --- errors -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: mindlin_loop.cycle(1.5), "amplitude is 1.5"),
        (lambda: mindlin_loop.lost_work(0.0), "amplitude is 0.0"),
    ],
)
def test_bad_arguments_are_named(call, message):
    with pytest.raises(ValueError, match=message):
        call()


def test_scalars_give_floats_and_arrays_broadcast():
    assert isinstance(superposition.rebound(0.5, 1.0, 10), float)
    assert np.shape(superposition.rebound([[0.5], [1.0]], [1.0, 2.0, 3.0], 10)) == (2, 3)
