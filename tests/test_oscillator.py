"""The closed form of the damped Hertz impact against its own equation of motion, integrated independently."""

from __future__ import annotations

from math import sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad, solve_ivp

from contactlaw import ContactPair
from contactlaw.laws import oscillator
from contactlaw.laws.normal_motion import time_of_phases

DAMPING = [0.0, 0.02, 0.1, 0.3, 0.7, 0.999, 1.001, 1.5, 4.0]


def integrate_impact(mass: float, stiffness: float, speed: float, zeta: float) -> tuple[float, float, float]:
    """Restitution, duration, overlap of m x'' = -max(k x^1.5 + sqrt5 zeta sqrt(m k) x^.25 x', 0) in SI units."""
    damping = sqrt(5.0 * mass * stiffness) * zeta
    length = (1.25 * mass * speed**2 / stiffness) ** 0.4
    time = length / speed

    def motion(_: float, state: np.ndarray) -> list[float]:
        overlap = max(state[0], 0.0) * length
        force = stiffness * overlap**1.5 + damping * overlap**0.25 * state[1] * speed
        return [state[1], -max(force, 0.0) * time / (mass * speed)]

    def force_vanishes(_: float, state: np.ndarray) -> float:
        if state[0] < 0.0:
            return state[0]
        overlap = state[0] * length
        return (stiffness * overlap**1.25 + damping * state[1] * speed) / (stiffness * length**1.25)

    def deepest(_: float, state: np.ndarray) -> float:
        return state[1]

    force_vanishes.terminal, force_vanishes.direction, deepest.direction = True, -1, -1  # type: ignore[attr-defined]
    run = solve_ivp(
        motion, (0.0, 100.0), [0.0, 1.0], method="DOP853", rtol=1e-11, atol=1e-13, events=[force_vanishes, deepest]
    )
    end = run.y_events[0][0]
    return -end[1], run.t_events[0][0] * time, run.y_events[1][0][0] * length


@pytest.mark.parametrize("zeta", DAMPING)
def test_restitution_matches_integrated_motion(zeta: float) -> None:
    """Closed form, under- and overdamped, against a solver with relative tolerance 1e-11."""
    e, _, _ = integrate_impact(1.0, 1.0, 1.0, zeta)
    assert oscillator.restitution(zeta) == pytest.approx(e, rel=1e-7)


@pytest.mark.parametrize("e", [1.0, 0.93, 0.5, 0.2, 0.05])
@pytest.mark.parametrize(("mass", "speed"), [(1e-9, 1e-3), (0.5, 1.0), (40.0, 30.0)])
def test_duration_and_overlap_match_integrated_motion_at_any_mass_and_speed(
    e: float, mass: float, speed: float
) -> None:
    """The pair's figures come from a table of 2000 phases: time to 1e-5, the peak to (pi/2000)^2/8."""
    pair = ContactPair("steel", "steel", 0.1, restitution=e, radius=0.01)
    stiffness = 4.0 / 3.0 * pair.effective_modulus * sqrt(0.01)
    restitution, duration, overlap = integrate_impact(mass, stiffness, speed, pair.damping_ratio)
    assert restitution == pytest.approx(e, rel=1e-7)
    assert pair.contact_duration(mass, speed) == pytest.approx(duration, rel=1e-5)
    assert pair.greatest_overlap(mass, speed) == pytest.approx(overlap, rel=2e-6)


@given(st.floats(-6.0, 0.0))
def test_damping_ratio_inverts_restitution(exponent: float) -> None:
    """Rounding alone; near critical damping acos(zeta)/sqrt(1 - zeta^2) loses half of the digits."""
    e = 10.0**exponent
    assert oscillator.restitution(oscillator.damping_ratio(e)) == pytest.approx(e, rel=1e-9)


@pytest.mark.parametrize("e", [1.0, 1.0 - 1e-15, 1.0 - 1e-9, 1e-6, 1e-12])
def test_damping_ratio_holds_at_the_ends_of_its_range(e: float) -> None:
    zeta = oscillator.damping_ratio(e)
    assert zeta >= 0.0
    assert oscillator.restitution(zeta) == pytest.approx(e, rel=1e-9)


def test_elastic_impact_needs_no_damping() -> None:
    assert oscillator.damping_ratio(1.0) == 0.0
    assert oscillator.end_phase(0.0) == pytest.approx(np.pi, rel=1e-15)
    assert oscillator.restitution(0.0) == 1.0


@given(st.floats(1e-6, 1.0), st.floats(1.01, 1.5))
def test_more_damping_means_less_rebound(e: float, factor: float) -> None:
    assert oscillator.damping_ratio(e / factor) > oscillator.damping_ratio(e)


@pytest.mark.parametrize("gap", [1e-2, 1e-3, 1e-4, 1e-5, 2e-6, 1e-6, 1e-7])
def test_critical_damping_is_crossed_smoothly(gap: float) -> None:
    """e(zeta) = exp(-zeta theta_end), theta_end = 2 - 2/3 (zeta - 1) + ..., so e(1) = exp(-2) with slope -4/3 e(1)."""
    for side in (-1.0, 1.0):
        expected = np.exp(-2.0) * (1.0 - 4.0 / 3.0 * side * gap)
        assert oscillator.restitution(1.0 + side * gap) == pytest.approx(expected, abs=2.0 * gap**2 + 1e-10)
        for now, at_one in zip(
            oscillator.phase_point(0.7, 1.0 + side * gap), oscillator.phase_point(0.7, 1.0), strict=True
        ):
            assert now == pytest.approx(at_one, abs=gap)


@pytest.mark.parametrize("zeta", DAMPING)
def test_phase_point_obeys_the_linear_oscillator(zeta: float) -> None:
    """dy/dtheta = v, dv/dtheta = -(y + 2 zeta v); central differences err by h^2/6 times a third derivative."""
    h, end = 1e-4, oscillator.end_phase(zeta)
    for theta in np.linspace(h, end - h, 9):
        (y0, v0), (y, v), (y1, v1) = (oscillator.phase_point(theta + d, zeta) for d in (-h, 0.0, h))
        bound = h**2 * (1.0 + 2.0 * zeta) ** 3
        assert (y1 - y0) / (2 * h) == pytest.approx(v, abs=bound)
        assert (v1 - v0) / (2 * h) == pytest.approx(-(y + 2 * zeta * v), abs=bound)


@pytest.mark.parametrize("zeta", DAMPING)
def test_contact_ends_where_the_force_vanishes(zeta: float) -> None:
    y, v = oscillator.phase_point(oscillator.end_phase(zeta), zeta)
    assert y + 2.0 * zeta * v == pytest.approx(0.0, abs=1e-9)
    assert v == pytest.approx(-oscillator.restitution(zeta), rel=1e-9)


@pytest.mark.parametrize("zeta", [0.0, 0.1, 0.5, 2.0])
@pytest.mark.parametrize(
    "ends",
    [
        (0.3, 0.31),
        (1 / 128, 2 / 128),
        (0.0, 1 / 128),
    ],
)
def test_time_between_phases_matches_adaptive_quadrature(zeta: float, ends: tuple[float, float]) -> None:
    """The docstring's 1e-6 of itself (4e-6 in the second step of 128)."""
    start, end = (share * oscillator.end_phase(zeta) for share in ends)
    # dt = C y^(-1/5) dtheta; with theta = u^5 the integrand is smooth where y starts at zero
    exact, _ = quad(
        lambda u: 5.0 * u**4 * oscillator.phase_point(u**5, zeta)[0] ** -0.2 if u > 0.0 else 0.0,
        start**0.2, end**0.2, epsabs=0.0, epsrel=1e-12,
    )  # fmt: skip
    assert time_of_phases(start, end, zeta) == pytest.approx(0.8 * 1.25**0.4 * exact, rel=5e-6)
