"""Velocities read from stroboscopic points: exact where the points are, and as uncertain as the fit says."""

from __future__ import annotations

import numpy as np
import pytest

from validation.stroboscope import Motion, fit_motion, pictured, read_impact

TIMES = np.arange(12, dtype=np.float64) / 100.0
RADII = np.array([0.045, 0.045, 0.05])
ANGLES = np.array([0.3, 0.3 + np.pi, 2.0])
NO_ERROR = np.zeros((3, 3))


def points(velocity=(0.4, -1.0), spin=8.0, times=TIMES):
    return pictured(times, (0.1, 0.2), velocity, ANGLES, spin, RADII)


@pytest.mark.parametrize("spin", [0.0, 8.0, -35.0, 250.0])  # 250 rad/s: 2.5 rad a flash, nearly half a turn
def test_exact_points_give_the_exact_motion(spin):
    motion = fit_motion(TIMES, *points(spin=spin), RADII, 1e-4)
    assert motion.velocity == pytest.approx([0.4, -1.0], abs=1e-11)
    assert motion.spin == pytest.approx(spin, abs=1e-9)
    assert motion.residual < 1e-12


def test_covariance_is_the_scatter_of_repeated_readings():
    error, draws = 5e-4, 600
    random = np.random.default_rng(1981)
    found = np.empty((draws, 3))
    squares = 0.0
    for number in range(draws):
        centres, markers = (x + error * random.standard_normal(x.shape) for x in points())
        motion = fit_motion(TIMES, centres, markers, RADII, error)
        found[number] = [*motion.velocity, motion.spin]
        squares += motion.residual**2
    scatter = np.cov(found.T)
    # The variance of 600 draws is known to sqrt(2/600) = 5.8 %; three times that.
    assert np.diag(scatter) == pytest.approx(np.diag(motion.covariance), rel=0.175)
    errors = np.sqrt(np.diag(motion.covariance))
    assert np.abs(found.mean(axis=0) - [0.4, -1.0, 8.0]).max() < 4.0 * (errors / np.sqrt(draws)).max()
    # What is left is the drafting error less the 8 degrees of freedom of the fit, of 2 * 4 * 12 coordinates.
    assert np.sqrt(squares / draws) == pytest.approx(error * np.sqrt(1.0 - 8.0 / 96.0), rel=0.01)


def test_velocity_along_a_line_has_the_textbook_error():
    markers = np.empty((1, TIMES.size, 2))
    centres, markers[0] = (x if x.ndim == 2 else x[0] for x in points(spin=0.0))
    motion = fit_motion(TIMES, centres, markers, RADII[:1], 1e-3)
    # Without spin to know, centre and marker are two readings of one line; the spin takes what they differ by.
    spread = ((TIMES - TIMES.mean()) ** 2).sum()
    along = np.array([np.cos(ANGLES[0]), np.sin(ANGLES[0])])
    assert along @ motion.covariance[:2, :2] @ along == pytest.approx(1e-6 / spread / 2.0, rel=1e-9)
    across = np.array([-along[1], along[0]])
    assert across @ motion.covariance[:2, :2] @ across == pytest.approx(1e-6 / spread, rel=1e-9)


def flights(incidence, reflexion, restitution, radius=0.05, factor=3.0):
    """Motions of a disk before and after, thrown obliquely against a block with the normal (0, -1)."""
    change = reflexion - incidence
    before = Motion(np.array([incidence, 1.0]), 0.0, NO_ERROR, 0.0)
    spin = -change * (factor - 1.0) / factor / radius
    after = Motion(np.array([incidence + change / factor, -restitution]), spin, NO_ERROR, 0.0)
    return before, after


@pytest.mark.parametrize("restitution", [1.0, 0.93, 0.86])
def test_friction_by_equation_6_is_low_by_half_the_lost_restitution(restitution):
    mu = 0.115
    reflexion = 1.0 - mu * 3.0 * (1.0 + restitution)  # gross slip: impulse mu (1 + e) M V_z1
    reading = read_impact(*flights(1.0, reflexion, restitution), normal=(0.0, -1.0), radius=0.05, inertia_factor=3.0)
    assert reading.incidence == pytest.approx(1.0) and reading.reflexion == pytest.approx(reflexion)
    assert reading.restitution == pytest.approx(restitution)
    assert reading.friction == pytest.approx(mu * (1.0 + restitution) / 2.0, rel=1e-12)


def test_covariance_of_a_reading_is_its_derivative():
    random = np.random.default_rng(6)
    root = random.standard_normal((3, 3)) * 1e-3
    covariance = root @ root.T
    plain = flights(1.3, -0.2, 0.9)
    options = {"normal": (0.0, -1.0), "radius": 0.05, "inertia_factor": 3.0}

    def value(number, component, step):
        moved = list(plain)
        motion = np.append(plain[number].velocity, plain[number].spin)
        motion[component] += step
        moved[number] = Motion(motion[:2], motion[2], NO_ERROR, 0.0)
        reading = read_impact(*moved, **options)
        return np.array([reading.incidence, reading.reflexion, reading.restitution, reading.friction])

    derivative = np.array(
        [(value(k, i, 1e-6) - value(k, i, -1e-6)) / 2e-6 for k in range(2) for i in range(3)]
    ).T  # fmt: skip
    full = np.kron(np.eye(2), covariance)
    read = read_impact(*(Motion(m.velocity, m.spin, covariance, 0.0) for m in plain), **options)
    assert read.covariance == pytest.approx(derivative @ full @ derivative.T, rel=1e-6)
    psi, errors = read.psi(0.837, 0.115)
    assert psi == pytest.approx(0.837 / 0.115 * np.array([1.3, -0.2]))
    assert errors == pytest.approx(0.837 / 0.115 * np.sqrt(np.diag(read.covariance)[:2]))


def test_a_puck_that_leaves_has_no_impact():
    before, after = flights(1.0, 0.2, 0.9)
    with pytest.raises(ValueError, match=r"before.*approach"):
        read_impact(after, before, normal=(0.0, -1.0), radius=0.05, inertia_factor=3.0)
