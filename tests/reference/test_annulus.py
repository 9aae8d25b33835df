"""Verification of the annulus solver: closed forms, published figures, order of convergence, passivity."""

import numba
import numpy as np
import pytest

from validation.reference import annulus
from validation.reference.normal_motion import hertz_force, impact_motion

DISK = 1.256  # chi of a solid steel disk, Maw, Barber & Fawcett (1981)
INCIDENCE = np.array([0.25, 0.5, 1.0, 1.2, 2.0, 3.0, 4.0, 5.0])
# Rebound at chi = 1.256 to which two independent methods converge, to the digits printed.
CONVERGED = np.array([-0.0161, -0.0755, -0.3052, -0.4608, -1.0935, -1.4256, -1.0235, -0.0240])
PRINTED = 1e-4
RESTITUTIONS = [1.0, 0.9, 0.5]

compiled_only = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="fine annuli take minutes uncompiled")  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("annuli", "bound"),
    [(10, 8e-3), pytest.param(20, 3e-3, marks=compiled_only), pytest.param(40, 1e-3, marks=compiled_only)],
)
def test_converged_values_within_the_promised_error(annuli, bound):
    np.testing.assert_allclose(annulus.rebound(INCIDENCE, DISK, annuli), CONVERGED, rtol=0.0, atol=bound)


@compiled_only
@pytest.mark.parametrize("restitution", RESTITUTIONS)
def test_second_order_in_the_number_of_annuli(restitution):
    incidence = np.array([0.25, 0.5, 1.0, 1.2, 2.0])
    limit = np.array([annulus.rebound_extrapolated(psi, DISK, restitution)[0] for psi in incidence])
    counts = np.array([8, 11, 16, 23, 32])
    # The boundary of stick jumps from annulus to annulus, so single errors scatter: regress their mean.
    errors = [
        np.mean(np.abs(annulus.rebound(incidence, DISK, int(n), restitution=restitution) - limit)) for n in counts
    ]
    slope = np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert -2.5 < slope < -1.7


@compiled_only
@pytest.mark.parametrize("restitution", RESTITUTIONS)
def test_second_order_in_the_time_step(restitution):
    # The closed form of test_stick_that_follows_the_overlap_..., for which any N is exact.
    counts = np.array([100, 200, 400, 800])
    errors = [
        abs(annulus.impact(0.9, 0.5, 3, restitution=restitution, steps=int(n)).psi_2 + 0.9 * restitution)
        for n in counts
    ]
    assert np.polyfit(np.log(counts), np.log(errors), 1)[0] < -1.7


@compiled_only
@pytest.mark.parametrize("psi_1", [0.5, 1.2, 3.0])
def test_extrapolation_agrees_with_converged_values_and_states_its_error(psi_1):
    psi_2, error = annulus.rebound_extrapolated(psi_1, DISK)
    expected = CONVERGED[psi_1 == INCIDENCE][0]
    assert error < 1e-4
    assert abs(psi_2 - expected) < error + PRINTED


@pytest.mark.parametrize("restitution", [1.0, 0.99, 0.9, 0.5, 0.2])
@pytest.mark.parametrize("chi", [0.3, 1.0, DISK, 4.5])
@pytest.mark.parametrize("excess", [0.001, 0.5, 10.0])
def test_gross_slip_throughout_gives_the_rigid_impulse(chi, excess, restitution):
    # Sliding lasts if psi is above the closing velocity to the end, where the latter is -e.
    psi_1 = max(1.0, 2.0 * chi * (1.0 + restitution) - restitution) + excess
    expected = psi_1 - 2.0 * chi * (1.0 + restitution)
    assert annulus.rebound(psi_1, chi, 6, restitution=restitution) == pytest.approx(expected, abs=1e-8)


@compiled_only
@pytest.mark.parametrize("restitution", RESTITUTIONS)
@pytest.mark.parametrize("psi_1", [0.3, 0.999, 1.001, 2.0])
def test_share_at_the_touch_is_psi_up_to_one(psi_1, restitution):
    history = annulus.impact(psi_1, DISK, 4, restitution=restitution, steps=20000)
    assert history.tangential_force[1] / history.normal_force[1] == pytest.approx(min(psi_1, 1.0), rel=1e-3)
    assert history.stuck[1, 0] == (psi_1 < 1.0)
    assert np.all(np.abs(history.traction[1:4]) <= history.pressure[1:4] * (1.0 + 1e-9))


@pytest.mark.parametrize("restitution", RESTITUTIONS)
@pytest.mark.parametrize("chi", [DISK, 2.0])
@pytest.mark.parametrize("psi_1", [1.2, 2.5])
def test_sliding_ends_everywhere_at_once_at_the_closing_velocity(psi_1, chi, restitution):
    annuli, steps = 12, 400
    history = annulus.impact(psi_1, chi, annuli, restitution=restitution, steps=steps)
    change = int(np.argmax(history.stuck.any(axis=1)))
    covered = history.pressure > 1e-6
    assert change > 2
    # Until then traction is the friction limit everywhere, afterwards every annulus in contact sticks.
    np.testing.assert_allclose(history.traction[:change], history.pressure[:change], atol=1e-7)
    assert np.array_equal(history.stuck[change], covered[change])
    # Surface velocity 2 b db/dt = d(overlap)/dt meets the sliding velocity: psi_1 - 2 chi (1 - v) = v.
    closing = 1.0 - np.cumsum(impact_motion(restitution, annuli, steps).impulse)
    expected = (2.0 * chi - psi_1) / (2.0 * chi - 1.0)
    assert closing[change] <= expected + 1e-9 <= closing[change - 2] + 2e-9
    assert np.all(history.psi[: change - 1] > closing[: change - 1])


@pytest.mark.parametrize("restitution", RESTITUTIONS)
def test_stick_that_follows_the_overlap_keeps_its_share_of_a_damped_force(restitution):
    # chi = 1/2: psi = psi_1 d(overlap)/dt solves psi' = -F/mu with the uniform share psi_1 <= 1, whatever the damper.
    psi_1 = 0.9
    history = annulus.impact(psi_1, 0.5, 6, restitution=restitution)
    assert history.psi_2 == pytest.approx(-restitution * psi_1, abs=2e-5)
    np.testing.assert_allclose(history.tangential_force, psi_1 * history.normal_force, atol=1e-3)
    np.testing.assert_allclose(history.traction[:-1], psi_1 * history.pressure[:-1], atol=1e-3)


@compiled_only
def test_tractions_sum_to_the_share_of_the_elastic_limit_and_force_to_that_of_the_whole():
    annuli, steps, restitution = 200, 60, 0.5
    history = annulus.impact(1.2, DISK, annuli, restitution=restitution, steps=steps)
    rings = np.arange(annuli) + 0.5  # areas, relative
    share = (history.traction @ rings)[1:-1] / (history.pressure @ rings)[1:-1]
    deep = history.overlap[1:-1] > 0.2
    force = history.tangential_force[1:-1] / history.normal_force[1:-1]
    np.testing.assert_allclose(force[deep], share[deep], atol=3e-3)
    assert history.normal_force[-1] == history.tangential_force[-1] == 0.0
    assert history.overlap[-1] > 0.0


@pytest.mark.parametrize("psi_1", [0.5, 1.2, 3.0])
def test_impact_ends_in_reversed_gross_slip(psi_1):
    history = annulus.impact(psi_1, DISK, 10)
    assert history.normal_force[-1] == 0.0
    assert history.tangential_force[-2] == pytest.approx(-history.normal_force[-2], rel=1e-9)


@pytest.mark.parametrize("restitution", [1.0, 0.6])
@pytest.mark.parametrize("psi_1", [0.4, 1.3, 4.0])
def test_mirrored_incidence_gives_mirrored_rebound(psi_1, restitution):
    forward = annulus.impact(psi_1, DISK, 6, restitution=restitution)
    backward = annulus.impact(-psi_1, DISK, 6, restitution=restitution)
    np.testing.assert_allclose(backward.psi, -forward.psi, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(backward.traction, -forward.traction, rtol=0.0, atol=1e-12)


def test_no_tangential_motion_stays_none():
    history = annulus.impact(0.0, DISK, 6)
    assert history.psi_2 == 0.0
    assert not history.traction.any()


@pytest.mark.parametrize("restitution", [1.0, 0.8, 0.3])
@pytest.mark.parametrize("chi", [0.5, DISK, 4.5])
@pytest.mark.parametrize("psi_1", [0.5, 1.2, 3.0])
def test_friction_stays_in_the_cone_and_creates_no_energy(psi_1, chi, restitution):
    annuli, steps = 12, 600
    history = annulus.impact(psi_1, chi, annuli, restitution=restitution, steps=steps)
    motion = impact_motion(restitution, annuli, steps)
    assert np.all(np.abs(history.traction) <= history.pressure * (1.0 + 1e-9) + 1e-12)
    assert np.all(np.abs(history.tangential_force) <= history.normal_force * (1.0 + 1e-9) + 1e-12)
    # The elastic contact stores no more than the work of its tractions, whatever P is. Collocation is passive only to
    # its order: what energy it does create must shrink with it.
    force = history.normal_force
    share = np.divide(history.tangential_force, force, out=np.zeros_like(force), where=force > 0.0)
    pull = share * hertz_force(motion.overlap)
    work = 0.25 * (pull[1:] + pull[:-1]) * (history.psi[1:] + history.psi[:-1]) * np.diff(motion.time)
    kinetic = (history.psi / psi_1) ** 2
    dissipated = 4.0 * chi / psi_1**2 * work - np.diff(history.energy - kinetic)
    assert dissipated[:-1].min() > -0.3 / annuli**2
    assert history.energy.max() < 1.0 + 1.0 / annuli**2
    if restitution == 1.0:
        assert np.diff(history.energy).max() < 0.3 / annuli**2


@compiled_only
@pytest.mark.parametrize("chi", [DISK, 4.5])
def test_energy_created_vanishes_faster_than_second_order(chi):
    counts = np.array([6, 12, 24, 48])
    growth = [max(np.diff(annulus.impact(p, chi, int(n)).energy).max() for p in (0.5, 1.2, 3.0)) for n in counts]
    assert np.polyfit(np.log(counts), np.log(growth), 1)[0] < -2.0


@pytest.mark.parametrize("psi_1", [0.5, 1.2, 3.0])
def test_corrections_are_few(psi_1):
    history = annulus.impact(psi_1, DISK, 16)
    assert history.corrections.max() <= 4
    assert history.corrections[1:].mean() < 0.5


def test_history_shapes_and_ends():
    history = annulus.impact(1.2, DISK, 5, steps=60)
    assert history.traction.shape == history.pressure.shape == history.stuck.shape == (history.steps + 1, 5)
    assert history.time[0] == 0.0 and history.time[-1] == 1.0
    assert history.overlap.max() == pytest.approx(1.0) and history.normal_force.max() == pytest.approx(1.0)
    assert history.psi[0] == 1.2 and history.psi[-1] == history.psi_2
    assert history.steps >= 60


def test_arrays_broadcast_and_scalars_give_floats():
    table = annulus.rebound([[0.5], [2.0]], [1.0, DISK, 2.0], 4)
    assert isinstance(table, np.ndarray) and table.shape == (2, 3)
    single = annulus.rebound(2.0, DISK, 4)
    assert isinstance(single, float) and single == table[1, 1]


def test_extrapolation_wants_annuli_that_can_be_halved():
    with pytest.raises(ValueError, match="annuli is 7"):
        annulus.rebound_extrapolated(1.0, 1.0, annuli=7)
