"""Verification of the annulus solver along prescribed paths, of its influence functions and of its normal motion."""

import math

import numba
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import ellipk

from tests.reference import mindlin_loop
from validation.reference import annulus
from validation.reference.annulus_kernel import hertz_displacement, hertz_force, stored_energy
from validation.reference.normal_motion import damping, impact_motion, restitution_of

compiled_only = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="fine annuli take minutes uncompiled")  # type: ignore[attr-defined]


def hertz_pressure(b, r):
    return 2.0 / math.pi * math.sqrt(max(b * b - r * r, 0.0))


# --- influence functions ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("r", [0.0, 0.3, 0.9, 1.1, 3.0])
def test_displacement_is_the_potential_of_the_pressure(r):
    b = 1.0

    def ring(s):
        return hertz_pressure(b, s) * 4.0 * s / (s + r) * ellipk(4.0 * s * r / (s + r) ** 2) / math.pi

    potential = quad(ring, 0.0, b, points=[r] if 0.0 < r < b else None, limit=400)[0]
    assert hertz_displacement(b, r) == pytest.approx(potential, rel=1e-6)


def test_force_is_the_integral_of_the_pressure():
    assert hertz_force(0.7) == pytest.approx(quad(lambda r: 2.0 * math.pi * r * hertz_pressure(0.7, r), 0.0, 0.7)[0])


def test_energy_is_half_the_work_of_traction_on_displacement():
    shares, radii = np.array([0.5, -1.2, 0.8]), np.array([0.3, 0.7, 1.0])

    def work(r):
        traction = sum(c * hertz_pressure(b, r) for c, b in zip(shares, radii, strict=True))
        return math.pi * r * traction * sum(c * hertz_displacement(b, r) for c, b in zip(shares, radii, strict=True))

    pieces = sum(quad(work, low, high)[0] for low, high in [(0.0, 0.3), (0.3, 0.7), (0.7, 1.0)])
    assert stored_energy(shares, radii) == pytest.approx(pieces, rel=1e-7)


def test_surface_velocity_in_gross_slip_is_uniform():
    # Maw, Barber & Fawcett (1981), appendix: V_x = mu (2 - nu)/(R (1 - nu)) b db/dt, the same at every radius.
    nu, mu, b, db = 0.28, 0.12, 0.8, 1e-5
    kappa = 2.0 * (1.0 - nu) / (2.0 - nu)
    for r in (0.0, 0.3, 0.79):
        change = mu / kappa * (hertz_displacement(b + db, r) - hertz_displacement(b - db, r)) / 2.0
        assert change == pytest.approx(mu * (2.0 - nu) / (1.0 - nu) * b * db, rel=1e-9)


# --- prescribed paths -------------------------------------------------------------------------------------------------


@pytest.mark.slow
@compiled_only
def test_cattaneo_mindlin_loading_is_met_to_second_order():
    displacement = np.linspace(0.0, 1.3, 14) + 0.0137  # not on the values where stick retreats by a whole annulus
    displacement[0] = 0.0
    exact = 4.0 / 3.0 * mindlin_loop.first_loading(displacement)
    counts = np.array([8, 16, 32])
    errors = []
    for n in counts:
        force = annulus.force_along_path(np.ones(14), displacement, annuli=int(n))
        errors.append(np.abs(force - exact).max())
    assert errors[-1] < 5e-4
    assert np.polyfit(np.log(counts), np.log(errors), 1)[0] < -1.6


def test_mindlin_deresiewicz_unloading_and_reloading():
    kappa, friction, annuli = 0.8, 0.3, 16
    loop = mindlin_loop.cycle(float(mindlin_loop.first_loading(0.6)), 13)
    force = annulus.force_along_path(
        np.ones(loop.force.size), loop.displacement * friction / kappa, kappa=kappa, friction=friction, annuli=annuli
    )
    np.testing.assert_allclose(force, friction * 4.0 / 3.0 * loop.force, rtol=0.0, atol=0.5 * friction / annuli**2)


@pytest.mark.parametrize("slope", [0.5, 1.0, 2.0])
def test_proportional_loading_and_unloading_is_reversible_up_to_the_limit(slope):
    # Mindlin & Deresiewicz (1953): dF/dP below mu sticks everywhere, above it slips everywhere.
    approach = np.concatenate([np.linspace(0.0, 1.0, 9), np.linspace(1.0, 0.0, 9)[1:]])
    force = annulus.force_along_path(approach, slope * approach, annuli=8)
    normal = 4.0 / 3.0 * approach**1.5
    rising = slice(0, 9) if slope > 1.0 else slice(None)
    np.testing.assert_allclose(force[rising], min(slope, 1.0) * normal[rising], rtol=0.0, atol=1e-9)


@compiled_only
def test_growing_contact_with_fixed_rate_of_stick_is_met_to_second_order():
    # All stuck: dF = 2 a ds. With s = 0.4 d^2 this is F = 0.64 d^2.5.
    approach = np.linspace(0.0, 1.0, 401)
    counts = np.array([8, 16, 32])
    errors = [abs(annulus.force_along_path(approach, 0.4 * approach**2, annuli=int(n))[-1] - 0.64) for n in counts]
    assert np.polyfit(np.log(counts), np.log(errors), 1)[0] < -1.7


def test_reopened_contact_starts_without_traction():
    approach = np.array([0.0, 1.0, 1.0, -0.5, -0.5, 1.0, 1.0])
    displacement = np.array([0.0, 0.0, 0.4, 0.4, 3.0, 3.0, 3.4])
    force = annulus.force_along_path(approach, displacement, annuli=12)
    assert force[3] == force[4] == 0.0
    assert abs(force[5]) < 1e-12
    assert force[6] == pytest.approx(force[2], abs=1e-9)


@pytest.mark.parametrize("restitution", [1.0, 0.9, 0.5])
def test_free_motion_along_a_sampled_impact_agrees_with_impact(restitution):
    motion = impact_motion(restitution, 8, 2000)
    history = annulus.along_motion(motion.time, motion.overlap, motion.force, 1.2, 1.256, 8)
    assert history.psi.shape == motion.time.shape
    # Force is sampled and summed by the trapezoidal rule; damped, it starts as time^(1/4).
    expected = annulus.impact(1.2, 1.256, 8, restitution=restitution, steps=2000).psi_2
    assert history.psi[-1] == pytest.approx(expected, abs=2e-4)


# --- normal motion ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("restitution", [0.99, 0.9, 0.5, math.exp(-2.0), 0.05, 0.01])
def test_integrated_impact_has_the_restitution_asked_for(restitution):
    motion = impact_motion(restitution, 4, 10)
    assert motion.impulse.sum() == pytest.approx(1.0 + restitution, abs=1e-8)
    assert motion.force[-1] == 0.0
    assert motion.overlap[-1] > 0.0


def test_damping_and_restitution_are_inverse():
    for restitution in (1.0, 0.9, 0.3, 0.1, 1e-4):
        assert restitution_of(damping(restitution) / math.sqrt(5.0)) == pytest.approx(restitution, rel=1e-9)


def test_elastic_impact_has_hertz_duration_and_depth():
    motion = impact_motion(1.0, 4, 10)
    assert motion.overlap[0] == motion.overlap[-1] == 0.0
    depth = (15.0 / 16.0) ** 0.4  # 1/2 = 8/15 d^(5/2)
    assert motion.overlap.max() == pytest.approx(depth, rel=1e-10)
    assert motion.time[-1] == pytest.approx(2.943275 * depth, rel=1e-6)  # Johnson (1985), eq. 11.24: 2.94 d_max/V
