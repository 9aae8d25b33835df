"""Verification of the grid solver: kernel, closed forms of sliding and torsion, rings, annuli, refinement."""

import math

import numpy as np
import pytest
from scipy.integrate import dblquad

from tests.reference import sliding_spin, torsion
from tests.reference.mindlin_loop import first_loading
from validation.reference import annulus, grid, rings
from validation.reference.cerruti import displacement, square_influence
from validation.reference.closed_forms import dundurs
from validation.reference.grid_step import Step, cell_pressure, sizes
from validation.reference.refinement import extrapolated
from validation.reference.turning_paths import path

pytestmark = pytest.mark.heavy

P = 4.0 / 3.0  # normal force at overlap 1
BALL = 1.465


def along(x=0.0, y=0.0, angle=0.0, samples=2):
    """A straight path from nothing, at overlap 1."""
    return np.ones(samples), np.linspace([0.0, 0.0, 0.0], [x, y, angle], samples)


# --- kernel -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("offset", [(1, 0), (2, 1), (-1, 2)])
def test_influence_of_a_square_is_cerrutis_integral(offset):
    nu = 0.3
    even, odd = 2.0 * (1.0 - nu) / (2.0 - nu), 2.0 * nu / (2.0 - nu)

    def integral(part):
        i, j = offset
        return dblquad(lambda y, x: part(x, y, math.hypot(x, y)), i - 0.5, i + 0.5, j - 0.5, j + 0.5, epsabs=1e-10)[0]

    found = [kernel[offset[0] + 2, offset[1] + 2] for kernel in square_influence(3, nu)]
    expected = [
        integral(lambda x, y, r: even / r + odd * x * x / r**3) / math.pi,
        integral(lambda x, y, r: even / r + odd * y * y / r**3) / math.pi,
        integral(lambda x, y, r: odd * x * y / r**3) / math.pi,
    ]
    assert found == pytest.approx(expected, abs=1e-9)


def test_own_influence_of_a_square():
    # Potential in the middle of a unit square: 4 asinh(1); half of it from x^2/r^3.
    xx, yy, xy = (kernel[0, 0] for kernel in square_influence(1, 0.3))
    assert xx == yy == pytest.approx(4.0 * math.asinh(1.0) / math.pi * (1.4 + 0.3) / 1.7)
    assert xy == pytest.approx(0.0, abs=1e-15)


def test_convolution_is_the_sum_over_all_cells():
    nu, cells = 0.4, 6
    traction = np.random.default_rng(1).normal(size=(2, cells, cells))
    xx, yy, xy = square_influence(cells, nu)
    expected = np.zeros_like(traction)
    for i, j in np.ndindex(cells, cells):
        near = (slice(cells - 1 - i, 2 * cells - 1 - i), slice(cells - 1 - j, 2 * cells - 1 - j))
        expected[0] += xx[near] * traction[0, i, j] + xy[near] * traction[1, i, j]
        expected[1] += xy[near] * traction[0, i, j] + yy[near] * traction[1, i, j]
    np.testing.assert_allclose(displacement(traction, nu), expected, atol=1e-12)


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.5])
def test_hertz_traction_moves_the_middle_as_the_mean_kernel_says(nu):
    # (2/pi) sqrt(a^2 - r^2) along x: u_x = a^2 - r^2/2 and a term in cos 2 theta that vanishes in the middle.
    cells = 64
    h = 2.0 / cells
    traction = np.stack([cell_pressure(1.0, h, cells), np.zeros((cells, cells))])
    middle = h * displacement(traction, nu)[:, 31:33, 31:33].mean(axis=(1, 2))
    assert middle == pytest.approx([1.0, 0.0], abs=1e-3)


@pytest.mark.parametrize("a", [0.05, 0.63, 1.0])
def test_pressure_sums_to_the_normal_force(a):
    pressure = cell_pressure(a, 2.0 / 32, 32)
    assert (2.0 / 32) ** 2 * pressure.sum() == pytest.approx(P * a**3, rel=1e-12)
    assert (pressure == pressure.T).all()


@pytest.mark.parametrize(("cell", "within"), [((8, 8), 1e-4), ((11, 10), 1e-4), ((15, 9), 2e-3), ((13, 13), 2e-3)])
def test_pressure_of_a_cell_is_its_mean(cell, within):
    # Two cells inside and two across the edge of the contact.
    h = 2.0 / 16
    x, y = (h * (i - 8.0) for i in cell)
    force = dblquad(lambda v, u: math.sqrt(max(1.0 - u * u - v * v, 0.0)), x, x + h, y, y + h, epsabs=1e-9)[0]
    assert cell_pressure(1.0, h, 16)[cell] == pytest.approx(2.0 / math.pi * force / h**2, abs=within)


def test_solution_of_a_step_meets_every_condition():
    cells, h = 20, 0.1
    caps = cell_pressure(1.0, h, cells)
    middles = h * (np.arange(cells) - 9.5)
    arms = np.stack(np.broadcast_arrays(-middles, middles[:, None]))
    slipped = 0.02 * np.random.default_rng(2).normal(size=(2, cells, cells))
    step = Step(h, 0.3, 1.0, caps, arms, np.array([0.4, 0.2, 0.3]), np.array([0.02, 0.05, 0.01]), slipped)
    traction = step.solve(np.zeros((2, cells, cells)))
    slip, size = step.slip(traction), np.hypot(*traction)
    slides = size >= caps * (1.0 - 1e-9)
    assert 0.1 < slides[caps > 0.0].mean() < 0.9
    assert (size <= caps * (1.0 + 1e-12)).all()
    scale = np.abs(slip).max()
    assert np.hypot(*slip)[~slides].max() < 1e-3 * scale
    inside = slides & (caps > 0.0)
    across = slip[0] * traction[1] - slip[1] * traction[0]
    assert np.abs(across / np.where(inside, size, 1.0))[inside].max() < 1e-3 * scale
    assert (slip * traction).sum(0)[inside].min() > -1e-3 * scale


# --- prescribed motion ------------------------------------------------------------------------------------------------


def test_cattaneo_mindlin_for_no_poisson_effect():
    approach, slide = along(x=0.78, y=1.04, samples=14)
    exact = first_loading(np.linspace(0.0, 1.3, 14))
    errors = []
    for n in (16, 32, 64):
        force = grid.force_along_path(approach, slide, cells=n) / P
        assert np.abs(force[:, 2]).max() < 1e-9
        errors.append(np.abs(force[:, :2] - exact[:, None] * [0.6, 0.8]).max())
    assert errors[-1] < 5e-4
    assert np.polyfit(np.log([16, 32, 64]), np.log(errors), 1)[0] < -1.3


def test_cattaneo_mindlin_is_nearly_met_for_rubber():
    # With nu > 0 the closed form lets slip stray from the traction by a few degrees; the force hardly knows.
    approach, slide = along(x=1.3, samples=14)
    force = grid.force_along_path(approach, slide, nu=0.5, cells=32)[:, 0] / P
    difference = np.abs(force - first_loading(slide[:, 0]))
    assert 1e-4 < difference.max() < 5e-3


@pytest.mark.parametrize("nu", [0.0, 0.3])
def test_torsion_is_lubkins(nu):
    stick = np.array([0.95, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1])
    angle = torsion.angle(stick) * P / (0.25 * (2.0 - nu))
    turned = np.zeros((11, 3))
    turned[1:, 2] = angle
    exact = torsion.moment(stick) / torsion.FULL_SLIP
    errors = []
    for n in (16, 32, 64):
        force = grid.force_along_path(np.ones(11), turned, nu=nu, cells=n)
        assert np.abs(force[:, :2]).max() < 1e-9
        errors.append(np.abs(force[1:, 2] / (torsion.FULL_SLIP * P) - exact).max())
    assert errors[-1] < 1e-3
    assert np.polyfit(np.log([16, 32, 64]), np.log(errors), 1)[0] < -1.5


@pytest.mark.parametrize("nu", [0.0, 0.3])
def test_full_slip_has_the_moment_of_the_pressure(nu):
    force = grid.force_along_path(*along(angle=40.0, samples=3), nu=nu, cells=32)[-1]
    assert force[2] == pytest.approx(3.0 * math.pi / 16.0 * P, rel=1e-3)


@pytest.mark.parametrize("k", [0.3, 1.0, 2.5])
def test_sliding_and_spinning_together(k):
    # A way so long that the traction settles on the direction of slip everywhere.
    force = grid.force_along_path(*along(x=60.0, angle=60.0 * k, samples=61), cells=32)[-1] / P
    exact = sliding_spin.force_and_moment(1.0, k)
    assert force[0] == pytest.approx(float(exact[0]), abs=3e-3)
    assert force[2] == pytest.approx(float(exact[1]), abs=3e-3)


@pytest.mark.slow
def test_rings_and_grid_agree_on_a_circle():
    """Along a turn and a half of partial slip, both with the same steps."""
    approach, slide = path("circle", 0.6, 2)
    expected = rings.force_along_path(approach, slide, rings=128) / P
    moved = np.column_stack([slide, np.zeros(len(slide))])
    errors = []
    for n in (16, 32, 64):
        force = grid.force_along_path(approach, moved, cells=n) / P
        errors.append(np.abs(force[:, :2] - expected).max())
    assert errors[-1] < 1e-3
    assert np.polyfit(np.log([16, 32, 64]), np.log(errors), 1)[0] < -1.2


def test_nothing_depends_on_the_axes_and_the_sense_of_spin():
    rng = np.random.default_rng(3)
    moved = np.cumsum(0.3 * rng.normal(size=(8, 3)), axis=0)
    moved[0] = 0.0
    approach = 1.0 - 0.3 * rng.random(8)
    force = grid.force_along_path(approach, moved, nu=0.3, cells=16)
    quarter = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    mirror = np.diag([1.0, -1.0, -1.0])
    for change in (quarter, mirror):
        turned = grid.force_along_path(approach, moved @ change, nu=0.3, cells=16)
        np.testing.assert_allclose(turned, force @ change, atol=1e-5)


# --- impacts ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("psi_1", "nu"), [(1.2, 0.0), (0.5, 0.3), (1.2, 0.3)])  # (0.5, 0.0): beside what spins
def test_straight_impacts_extrapolate_to_the_annuli(psi_1, nu):
    found, error = extrapolated(
        lambda m: grid.rebound([psi_1, 0.0, 0.0], [BALL, BALL, 0.0], nu=nu, cells=m, steps=8 * m)[:2], 8
    )
    expected = annulus.rebound_extrapolated(psi_1, BALL)[0]
    assert found == pytest.approx([expected, 0.0], abs=3e-3)
    assert error < 1e-2


@pytest.mark.slow
def test_spin_changes_the_rebound_by_its_square_and_as_an_earlier_grid_said():
    def run(m):
        spins, chi = (0.0, 0.05, 0.1, 0.18), [BALL, BALL, 0.0]
        return np.array([grid.rebound([0.5, 0.0, spin], chi, cells=m, steps=8 * m)[:2] for spin in spins])

    found, error = extrapolated(run, 8)
    still = found[0]
    assert still == pytest.approx([annulus.rebound_extrapolated(0.5, BALL)[0], 0.0], abs=1e-3)
    assert error < 1e-2
    assert found[1:3, 0] - still[0] == pytest.approx([-0.010, -0.037], abs=3e-3)
    assert found[3, 0] - still[0] == pytest.approx(-0.10, abs=1e-2)  # another program's, two digits


def test_spin_of_a_light_ball_is_braked_and_no_energy_appears():
    chi = np.array([BALL, BALL, 0.3])
    start = np.array([0.8, 0.0, 0.5])
    end = grid.rebound(start, chi, cells=16, steps=128)
    assert abs(end[2]) < start[2]
    assert (end**2 / chi).sum() < (start**2 / chi).sum()


def test_spin_that_slips_throughout_takes_the_moment_of_full_slip():
    # d sigma = -2 chi_s integral M/(mu a_max) dt, M = 3 pi/16 mu P a: with the Hertz impact's a/a_max = x^(1/2) of the
    # overlap, mean of x^(1/2) over the impulse: integral x^2 dx/sqrt(1 - x^(5/2)) over the same with x^(3/2).
    from scipy.integrate import quad

    def share(power):  # u^2 = 1 - x takes the singular end away
        return quad(lambda u: 2.0 * u * (1.0 - u * u) ** power / math.sqrt(1.0 - (1.0 - u * u) ** 2.5), 0.0, 1.0)[0]

    lost = 2.0 * 0.1 * torsion.FULL_SLIP * 2.0 * share(2.0) / share(1.5)
    end = grid.rebound([0.0, 0.0, 50.0], [BALL, BALL, 0.1], cells=24, steps=200)
    assert 50.0 - end[2] == pytest.approx(lost, rel=3e-3)
    assert np.abs(end[:2]).max() < 1e-9


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: grid.force_along_path([1.0, 1.0], np.zeros((2, 3)), cells=15), "cells is 15"),
    ],
)
def test_bad_arguments_are_named(call, message):
    with pytest.raises(ValueError, match=message):
        call()


# --- unlike materials -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("ratio", [0.6, 0.95, 1.3])
def test_pressing_unlike_materials_sticks_within_the_closed_forms_radius(ratio):
    """To half the width of a cell, while the contact grows from nothing."""
    cells, nu, none = 40, 0.3, np.zeros(3)
    h, coupling = 2.0 / cells, 2.0 * (1.0 - nu) / (2.0 - nu) * ratio
    middles = (2.0 * np.arange(cells) + 1.0 - cells) / cells
    arms = np.stack(np.broadcast_arrays(-middles, middles[:, None]))
    traction, slipped = np.zeros((2, 2, cells, cells))
    for a in np.linspace(0.0, 1.0, 2 * cells + 1)[1:]:
        caps, parted = cell_pressure(a, h, cells), coupling * grid.drawn(arms, a)
        step = Step(h, nu, a, caps, arms, none, none, slipped - parted)
        traction = step.solve(traction)
        slipped = step.slipped_after(traction) + parted
    stuck = (sizes(traction) < caps * (1.0 - 1e-9)).sum()
    assert h * math.sqrt(stuck / math.pi) == pytest.approx(dundurs.stick_radius(ratio * 0.2, 0.2), abs=0.5 * h)


def test_the_sign_of_the_coupling_does_not_matter_to_an_impact():
    one, other = (grid.rebound([0.9, 0.0, 0.0], [BALL, BALL, 0.0], cells=12, steps=48, coupling=c) for c in (0.5, -0.5))
    np.testing.assert_allclose(one, other, atol=1e-4)
    assert abs(one[0] - grid.rebound([0.9, 0.0, 0.0], [BALL, BALL, 0.0], cells=12, steps=48)[0]) > 0.02
