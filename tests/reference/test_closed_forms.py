"""Each closed form against a computation that does not use it: stepped motion, quadrature, limits."""

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from tests.reference import sliding_spin, torsion
from validation.reference import annulus
from validation.reference.closed_forms import dundurs, gross_slip, hertz, oscillator, regimes, rigid, waves

DISK = 1.256
STEEL = {"modulus": 2.034e11, "nu": 0.28, "density": 7833.0}


def stepped(psi_1, chi, steps=20000):
    """The oscillator by leapfrog, the spring force put back onto the cap after each step: second order."""
    step = math.pi / (2 * steps)
    force, psi = 0.0, psi_1
    for k in range(1, 2 * steps + 1):
        psi -= chi * step * force * (2.0 if k > 1 else 1.0)
        cap = math.sin(k * step)
        force = min(max(force + step * psi, -cap), cap)
    return psi - chi * step * force


@pytest.mark.parametrize("chi", [0.3, 0.5, 1.0, DISK, 4.5])
@pytest.mark.parametrize("psi_1", [0.3, 0.99, 1.7, -3.0])
def test_oscillator_agrees_with_stepping(psi_1, chi):
    exact = oscillator.rebound(psi_1, chi)
    # Second order, with a constant that depends on where in a step stick and slip change.
    for steps in (500, 4000):
        assert abs(stepped(psi_1, chi, steps) - exact) < chi * (0.5 * math.pi / steps) ** 2


@pytest.mark.parametrize("psi_1", [0.3, 0.99, 1.7, 3.0])
def test_oscillator_obeys_its_equations_within_the_cap(psi_1):
    found = oscillator.phases(psi_1, DISK)
    assert found[0].psi == psi_1 and found[-1].end == math.pi
    assert [phase.end for phase in found[:-1]] == [phase.start for phase in found[1:]]
    for phase in found:
        within = np.linspace(phase.start, phase.end, 201)

        def rates(t, state, phase=phase):
            pull = phase.side * math.sin(t) if phase.side else state[0]
            return [state[1], -2.0 * DISK * pull]

        path = solve_ivp(rates, within[[0, -1]], [phase.force, phase.psi], t_eval=within, rtol=1e-11, atol=1e-12)
        force, psi = phase.at(within)
        assert np.all(np.abs(force) <= np.sin(within) + 1e-12)
        np.testing.assert_allclose(psi, path.y[1], atol=1e-9)
        if not phase.side:
            np.testing.assert_allclose(force, path.y[0], atol=1e-9)


@pytest.mark.parametrize("chi", [0.7, DISK, 1.44, 3.0])
def test_small_incidence_tends_to_full_stick(chi):
    assert oscillator.frequency_ratio(DISK) == pytest.approx(1.585, abs=5e-4)  # 1.58 in the paper
    errors = [abs(oscillator.rebound(p, chi) / oscillator.full_stick_rebound(p, chi) - 1.0) for p in (1e-2, 1e-4)]
    assert errors[1] < 0.02 * errors[0] + 1e-12 and errors[1] < 1e-3  # what slips at the end is of the order of psi_1


@pytest.mark.parametrize("restitution", [1.0, 0.5])
def test_two_chi_of_one_reverses_the_motion_as_the_normal_one(restitution):
    assert oscillator.rebound(0.8, 0.5) == pytest.approx(-0.8, abs=1e-12)
    assert annulus.rebound(0.8, 0.5, 3, restitution=restitution) == pytest.approx(-0.8 * restitution, abs=1e-4)


@pytest.mark.parametrize("chi", [0.3, 1.0, DISK, 4.5])
def test_sliding_throughout_is_the_rigid_impulse_for_every_model(chi):
    psi = regimes.slides_throughout_from(chi) + np.array([1e-9, 0.5, 7.0])
    expected = psi - 4.0 * chi
    for model in (rigid.gross_slip, oscillator.rebound):
        np.testing.assert_allclose(model(psi, chi), expected, atol=1e-12)
    np.testing.assert_allclose(rigid.rebound(psi, chi), np.maximum(expected, 0.0), atol=1e-12)


@pytest.mark.parametrize(("psi_1", "chi", "restitution"), [(2.0, DISK, 1.0), (1.2, 1.0, 0.8), (4.0, 1.6, 0.5)])
def test_first_stick_is_where_psi_falls_to_the_closing_velocity(psi_1, chi, restitution):
    velocity = regimes.closing_velocity_at_first_stick(psi_1, chi, restitution)
    assert psi_1 - 2.0 * chi * (1.0 - velocity) == pytest.approx(velocity, abs=1e-12)
    history = annulus.impact(psi_1, chi, 10, restitution=restitution)
    sticks = int(np.flatnonzero(history.stuck.any(axis=1))[0])
    step = abs(history.psi[sticks - 1] - history.psi[sticks - 2])  # stick is decided once a step
    assert history.psi[sticks - 1] == pytest.approx(velocity, abs=step)
    if restitution == 1.0:
        assert math.cos(oscillator.phases(psi_1, chi)[0].end) == pytest.approx(velocity, abs=1e-12)


def test_hertz_impact_agrees_with_the_integrated_motion():
    mass, radius, modulus, speed = 0.51, 0.025, 1.1e11, 1.7
    impact = hertz.impact(mass, radius, modulus, speed)
    unit, tick = impact.overlap, impact.overlap / speed

    def rates(_, state):
        return [
            state[1],
            -4.0 / 3.0 * modulus * math.sqrt(radius) * unit**0.5 * tick**2 / mass * max(state[0], 0) ** 1.5,
        ]

    def turned(_, state):
        return state[1]

    def released(_, state):
        return state[0] if state[1] < 0.0 else 1.0

    released.terminal = True
    path = solve_ivp(rates, (0, 5), [0, 1], "DOP853", events=(turned, released), rtol=1e-12, atol=1e-14, max_step=0.02)
    assert path.t_events[1][0] * tick == pytest.approx(impact.duration, rel=1e-8)
    assert path.y_events[0][0][0] == pytest.approx(1.0, rel=1e-9)
    assert impact.force == pytest.approx(4.0 / 3.0 * modulus * math.sqrt(radius) * impact.overlap**1.5)
    assert pytest.approx(2.9432752, abs=1e-7) == hertz.DURATION


@pytest.mark.parametrize("nu", [0.0, 0.28, 0.5])
@pytest.mark.parametrize(("r", "theta"), [(0.0, 0.0), (0.4, 0.7), (0.9, 2.0), (1.0, 0.3)])
def test_gross_slip_displacement_is_cerrutis_integral(nu, r, theta):
    # Both bodies, G = R = b = mu = 1. Polar coordinates about the field point take the singularity away:
    # u_x = 1/(2 pi G) int [(1 - nu) + nu cos^2 phi] int q ds dphi, u_y with nu cos phi sin phi.
    x, y = r * math.cos(theta), r * math.sin(theta)
    points, weights = np.polynomial.legendre.leggauss(60)

    def along(phi):
        middle = -(x * math.cos(phi) + y * math.sin(phi))
        reach = math.sqrt(max(middle**2 + 1.0 - r * r, 0.0))
        # s = middle + reach sin(w): the traction 2 sqrt(1 - r^2)/(pi (1 - nu)) is smooth in w.
        low = -math.asin(min(max(middle / reach, -1.0), 1.0)) if reach > 0.0 else 0.5 * math.pi
        w = 0.5 * (0.5 * math.pi - low) * points + 0.5 * (0.5 * math.pi + low)
        chord = np.sum(weights * reach**2 * np.cos(w) ** 2) * 0.5 * (0.5 * math.pi - low)
        return 2.0 * chord / (math.pi * (1.0 - nu))

    def total(weight):
        edges = [theta - math.pi, theta - 0.5 * math.pi, theta, theta + 0.5 * math.pi, theta + math.pi]
        return 2.0 * sum(quad(lambda p: weight(p) * along(p), *edges[i : i + 2])[0] for i in range(4)) / (2.0 * math.pi)

    u_x, u_y = gross_slip.displacement(r, theta, nu)
    assert total(lambda p: 1.0 - nu + nu * math.cos(p) ** 2) == pytest.approx(float(u_x), abs=1e-7)
    assert total(lambda p: nu * math.cos(p) * math.sin(p)) == pytest.approx(float(u_y), abs=1e-7)


def test_while_sliding_all_points_move_with_the_closing_velocity():
    nu, b, growth, dt = 0.3, 0.05, 20.0, 1e-8
    r, theta = np.meshgrid(np.linspace(0.0, 0.99 * b, 5), np.linspace(0.0, 6.0, 7))
    before, after = (np.array(gross_slip.displacement(r, theta, nu, b + way * growth * dt)) for way in (-1.0, 1.0))
    v_x, v_y = (after - before) / (2.0 * dt)
    closing = 2.0 * b * growth  # d(b^2)/dt, R = 1
    np.testing.assert_allclose(v_x, closing * (2.0 - nu) / (2.0 * (1.0 - nu)), rtol=1e-6)
    np.testing.assert_allclose(v_y, 0.0, atol=1e-6 * closing)


@pytest.mark.parametrize("nu", [0.0, 0.25, 0.3, 0.5])
def test_power_radiated_into_a_half_space_is_the_imaginary_part_of_lambs_integral(nu):
    # Straight along a path below the real axis, where nothing is singular: from 0 down to -ih, along, and back up.
    h2, depth, far = waves.slowness_ratio(nu) ** 2, 0.5, 3.0

    def integrand(x):
        a, b = np.sqrt(x - math.sqrt(h2)) * np.sqrt(x + math.sqrt(h2)), np.sqrt(x - 1.0) * np.sqrt(x + 1.0)
        return x * a / ((2.0 * x * x - 1.0) ** 2 - 4.0 * x * x * a * b)

    corners = [1e-9 + 0.0j, -1j * depth, far - 1j * depth, far + 0.0j]
    total = 0.0
    for start, end in pairwise(corners):
        total += quad(lambda s, a=start, b=end: ((b - a) * integrand(a + s * (b - a))).imag, 0, 1, epsabs=1e-12)[0]
    assert abs(total) == pytest.approx(sum(waves.admittance_parts(nu)), rel=1e-6)


def test_two_thirds_of_the_waves_are_rayleighs_for_a_poisson_solid():
    parts = waves.admittance_parts(0.25)
    assert parts[2] / sum(parts) == pytest.approx(0.674, abs=5e-4)  # Miller & Pursey (1955): 67 %


def test_energy_radiated_by_a_hertz_impact_agrees_with_the_integrated_force():
    modulus, nu, density = STEEL.values()
    mass, radius, speed, shear = 0.03, 0.01, 1.0, modulus / 2.0 / (1.0 + nu)
    impact = hertz.impact(mass, radius, 0.5 * modulus / (1.0 - nu**2), speed)

    def rate_squared(overlap):  # (dP/dt)^2 dt = (dP/dd)^2 v dd, twice
        v = speed * math.sqrt(max(1.0 - (overlap / impact.overlap) ** 2.5, 0.0))
        return 2.0 * (1.5 * impact.stiffness) ** 2 * overlap * v

    power = sum(waves.admittance_parts(nu)) / (2.0 * math.pi * density * (shear / density) ** 1.5)
    energy = power * quad(rate_squared, 0.0, impact.overlap)[0]
    share = waves.radiated_share(impact, mass, speed, shear=shear, density=density, nu=nu)
    assert share == pytest.approx(energy / (0.5 * mass * speed**2), rel=1e-6)


@pytest.mark.parametrize(("nu", "over_pi"), [(0.25, 0.840), (0.5, 0.848)])
def test_lowest_mode_of_a_sphere_is_lambs(nu, over_pi):
    assert waves.lowest_mode(nu) / math.pi == pytest.approx(over_pi, abs=6e-4)  # Lamb (1882), three digits


def test_dundurs_parameter_has_its_known_values():
    assert dundurs.beta(1.0, 0.3, 1.0, 0.3) == 0.0
    assert dundurs.beta(1.0, 0.5, 0.0, 0.2) == 0.0  # incompressible on rigid
    assert dundurs.beta(2.0, 0.3, 0.0, 0.1) == pytest.approx(0.4 / (2.0 * 0.7))  # (1 - 2 nu)/(2 (1 - nu)) on rigid
    assert dundurs.beta(1.0, 0.2, 3.0, 0.4) == -dundurs.beta(3.0, 0.4, 1.0, 0.2)
    # A punch on which nu = 0 sticks is ln 3 times as stiff as one that slides freely: Johnson (1985), section 5.4.
    assert dundurs.stiffening(0.5) == pytest.approx(math.log(3.0))


@pytest.mark.parametrize("c", [0.2, 0.6, 0.95])
def test_stick_radius_is_where_both_tractions_have_one_transform(c):
    # The steps of the derivation by quadrature: chi of the two radial tractions at c, Abel's integral of the one.
    slip = quad(lambda w: 1.0 / math.sqrt(1.0 - (1.0 - c * c) * math.sin(w) ** 2), 0.0, 0.5 * math.pi)[0]
    ring = quad(lambda w: 1.0 / math.sqrt(c * c + (1.0 - c * c) * w * w) / math.sqrt(1.0 - w * w), 0.0, 1.0)[0]
    assert ring == pytest.approx(slip, rel=1e-7)  # integral_c^1 ds/sqrt((1 - s^2)(s^2 - c^2)) = K'
    undone = quad(lambda w: c * math.sin(w) * math.atanh(c * math.sin(w)), 0.0, 0.5 * math.pi)[0] * 2.0 / math.pi
    assert undone == pytest.approx(1.0 - math.sqrt(1.0 - c * c), rel=1e-8)
    ratio = c * slip / math.atanh(c)
    assert dundurs.stick_radius(-ratio * 0.2, 0.2) == pytest.approx(c, abs=1e-10)


def test_stick_radius_tends_to_its_limits():
    assert dundurs.stick_radius(0.0, 0.1) == 1.0
    assert dundurs.stick_radius(1.0, 0.1) == pytest.approx(4.0 * math.exp(-10.0), rel=1e-3)  # K' = ln(4/c)
    assert dundurs.stick_radius(0.0051, 0.1) == pytest.approx(1.0, abs=1e-12)


def test_torsion_has_the_values_tabulated():
    # Computed independently from Lubkin's integrals, to the digits given.
    stick = [0.95, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1]
    angle = [0.018994, 0.038514, 0.079419, 0.123436, 0.171637, 0.225712, 0.288534, 0.365570, 0.469255, 0.639718]
    share = [0.15944, 0.29937, 0.52717, 0.69559, 0.81569, 0.89734, 0.94932, 0.97932, 0.99405, 0.99927]
    np.testing.assert_allclose(torsion.angle(stick), angle, rtol=0.0, atol=1e-6)
    np.testing.assert_allclose(torsion.moment(stick) / torsion.FULL_SLIP, share, rtol=0.0, atol=6e-6)


def test_torsion_has_its_limits():
    assert torsion.moment(1e-6) == pytest.approx(torsion.FULL_SLIP, rel=1e-9)  # all slips
    assert torsion.moment(1.0) == torsion.angle(1.0) == 0.0
    assert torsion.moment(1.0 - 1e-6) / torsion.angle(1.0 - 1e-6) == pytest.approx(torsion.STIFFNESS, rel=1e-5)  # stuck


@pytest.mark.parametrize("k", [0.02, 0.3, 0.7, 0.95, 1.0, 1.05, 2.0, 30.0])
def test_sliding_with_spin_is_the_integral_of_the_pressure(k):
    # Gauss points on chords through the pole (0, s), of half length w and with the middle at distance f from it; each
    # has its own pressure and direction of slip.
    s = 1.0 / k
    nodes, weights = np.polynomial.legendre.leggauss(120)
    widest = math.asin(k) if k < 1.0 else 0.5 * math.pi
    turn, along = np.meshgrid(widest * nodes, 0.5 * math.pi * nodes, indexing="ij")
    w = np.sqrt(np.maximum(1.0 - (s * np.sin(turn)) ** 2, 0.0))
    from_pole = s * np.cos(turn) + w * np.sin(along)
    area = np.outer(widest * weights, 0.5 * math.pi * weights) * np.abs(from_pole) * w * np.cos(along)
    x, y = from_pole * np.sin(turn), s - from_pole * np.cos(turn)
    pressure = 1.5 / math.pi * np.sqrt(np.maximum(1.0 - x * x - y * y, 0.0))
    slip = np.array([s - y, x]) / np.hypot(s - y, x)
    force, moment = sliding_spin.force_and_moment(1.0, k)
    assert float(force) == pytest.approx((area * pressure * slip[0]).sum(), abs=1e-12)
    assert float(moment) == pytest.approx((area * pressure * (x * slip[1] - y * slip[0])).sum(), abs=1e-12)


@pytest.mark.parametrize("s", [1.01, 1.5, 4.0])
def test_outside_the_elementary_form_is_the_series(s):
    q, angle = math.sqrt(s * s - 1.0), math.asin(1.0 / s)
    force, moment = sliding_spin.force_and_moment(s, 1.0)
    assert float(force) == pytest.approx(3.0 / 16.0 * ((4.0 * s - s**3) * angle + (s * s + 2.0) * q / s), abs=1e-12)
    assert float(moment) == pytest.approx(
        3.0 / 64.0 * ((8.0 - 8.0 * s * s + 3.0 * s**4) * angle + (6.0 - 3.0 * s * s) * q), abs=1e-12
    )


def test_sliding_with_spin_has_its_limits_and_signs():
    force, moment = sliding_spin.force_and_moment([1.0, 0.0, 0.0, -1.0], [0.0, 1.0, 0.0, -1e-4])
    assert force == pytest.approx([1.0, 0.0, 0.0, -1.0], abs=1e-8)
    assert moment == pytest.approx([0.0, torsion.FULL_SLIP, 0.0, -2e-5], abs=1e-12)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: regimes.closing_velocity_at_first_stick(0.5, 1.0), "psi_1 is 0.5"),
        (lambda: gross_slip.displacement(2.0, 0.0, 0.3), "r has the value 2.0"),
        (lambda: dundurs.beta(0.0, 0.3, 0.0, 0.3), "both 0"),
        (lambda: dundurs.stiffening(1.0), "beta is 1.0"),
        (lambda: torsion.angle(1.1), "stick_radius is 1.1"),
    ],
)
def test_bad_arguments_are_named(call, message):
    with pytest.raises(ValueError, match=message):
        call()
