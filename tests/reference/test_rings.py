"""Verification of the ring solver: influence, closed forms, annuli on a straight slide, refinement, invariance."""

import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import ellipe

from tests.reference.mindlin_loop import first_loading
from validation.reference import annulus, rings
from validation.reference.refinement import extrapolated
from validation.reference.turning_paths import LEG, MARKS, path

pytestmark = pytest.mark.heavy

DISK = 1.256
P = 4.0 / 3.0  # normal force at overlap 1
# Rebound at chi = 1.256 to which annuli and superposition converge, to the digits printed.
CONVERGED = {0.25: -0.0161, 0.5: -0.0755, 1.0: -0.3052, 1.2: -0.4608, 2.0: -1.0935, 3.0: -1.4256, 4.0: -1.0235}


def circle(amplitude, steps, turns=1.0):
    angle = np.linspace(0.0, 2.0 * math.pi * turns, int(steps * turns) + 1)
    around = amplitude * np.stack([np.cos(angle), np.sin(angle)], 1)
    return np.concatenate([[[0.0, 0.0]], around])


def test_influence_is_the_mean_displacement_of_evenly_loaded_rings():
    # One disc (N = 1): 16/(3 pi) p b over its area, Johnson (1985), eq. (3.30).
    assert rings.influence(1)[0, 0] == pytest.approx(16.0 / (3.0 * math.pi) / math.pi, rel=1e-12)
    # The displacement of the outer of two rings under load on the inner, a disc of radius b: outside a disc
    # u = (4 r/pi)[E(b/r) - (1 - b^2/r^2) K(b/r)], which by symmetry is what the inner feels of the outer one.
    b = 0.5

    def inside(r, c):
        return 4.0 * c / math.pi * ellipe((r / c) ** 2)

    mean = quad(lambda r: 2.0 * r * (inside(r, 1.0) - inside(r, b)), 0.0, b)[0] / b**2  # traction 1 on the outer ring
    matrix = rings.influence(2)
    assert matrix[0, 1] == pytest.approx(mean / (math.pi * (1.0 - b * b)), rel=1e-9)
    assert matrix[0, 1] == matrix[1, 0]
    assert np.linalg.eigvalsh(rings.influence(40)).min() > 0.0


def test_all_stuck_rings_have_the_stiffness_of_a_punch():
    # F = 2 a G* s; from the influence alone, without friction. Constant rings are softer at the edge, by about 1/N^1.
    errors = [abs(np.linalg.inv(rings.influence(n)).sum() - 2.0) for n in (16, 32, 64)]
    assert errors[-1] < 5e-3
    assert errors[0] > 1.8 * errors[1] > 3.2 * errors[2]


@pytest.mark.parametrize("heading", [0.0, 0.7])
def test_cattaneo_mindlin_along_any_heading(heading):
    along = np.linspace(0.0, 1.3, 14)
    direction = np.array([math.cos(heading), math.sin(heading)])
    errors = []
    for n in (16, 32, 64):
        force = rings.force_along_path(np.ones(14), along[:, None] * direction, rings=n) / P
        errors.append(np.abs(force - first_loading(along)[:, None] * direction).max())
    assert errors[-1] < 2e-4
    assert np.polyfit(np.log([16, 32, 64]), np.log(errors), 1)[0] < -1.5


def test_straight_path_with_changing_overlap_agrees_with_the_annuli():
    part = np.linspace(0.0, 1.0, 61)
    approach, slide = np.sin(math.pi * part), 0.6 * np.sin(3.0 * math.pi * part)
    expected = annulus.force_along_path(approach, slide, annuli=30)

    def run(n):
        fine = np.linspace(0.0, 1.0, 60 * (n // 4) + 1)
        depth, moved = np.interp(fine, part, approach), np.interp(fine, part, slide)
        return rings.force_along_path(depth, np.stack([moved, 0.0 * moved], 1), rings=n)[:: n // 4, 0]

    found, error = extrapolated(run, 12)
    assert np.abs(found - expected).max() < 2e-3 * P
    assert error < 1e-2 * P


def test_nothing_depends_on_the_axes():
    turn = np.array([[math.cos(1.1), math.sin(1.1)], [-math.sin(1.1), math.cos(1.1)]])
    approach, slide = path("eight", 0.8)
    force = rings.force_along_path(approach, slide, rings=12)
    np.testing.assert_allclose(rings.force_along_path(approach, slide @ turn, rings=12), force @ turn, atol=1e-6)


def test_force_on_a_circle_settles_and_turns_with_it():
    # From the second turn on the path and all that it left behind repeat: the force turns rigidly.
    force = rings.force_along_path(np.ones(290), circle(0.7, 96, 3.0), rings=24)[1:] / P
    size, angle = np.hypot(*force.T), np.unwrap(np.arctan2(force[:, 1], force[:, 0]))
    assert np.ptp(size[-96:]) < 1e-4
    np.testing.assert_allclose(np.diff(angle[-96:]), 2.0 * math.pi / 96, atol=1e-4)


@pytest.mark.parametrize("amplitude", [10.0, 40.0])
def test_wide_circle_slides_throughout_and_the_force_lags(amplitude):
    # Traction at radius r lags by the elastic displacement there over A, (1 - r^2/2)/A; its mean under Hertz pressure
    # (mean of r^2: 2/5) is 0.8/A. Next order: 1/A^2.
    def run(steps):
        return rings.force_along_path(np.ones(2 * steps + 2), circle(amplitude, steps, 2.0), rings=12)[-1] / P

    force, _ = extrapolated(run, 400)
    assert force[0] == pytest.approx(0.8 / amplitude, abs=0.5 / amplitude**2)
    assert force[1] == pytest.approx(1.0, abs=1.0 / amplitude**2)


@pytest.mark.parametrize("amplitude", [0.4, 0.9])
def test_first_order_in_the_steps_where_the_slide_turns(amplitude):
    def run(fine):
        return rings.force_along_path(*path("circle", amplitude, fine), rings=16)[::fine] / P

    coarse, middle, fine = (run(4 * factor)[-MARKS:] for factor in (1, 2, 4))
    ratio = np.abs(middle - coarse).max() / np.abs(fine - middle).max()
    assert 1.8 < ratio < 2.2


def test_friction_only_takes_energy_from_a_closed_loop():
    approach, slide = path("square", 0.9, 8)
    force = rings.force_along_path(approach, slide, rings=24)
    work = np.concatenate([[0.0], np.cumsum((0.5 * (force[1:] + force[:-1]) * np.diff(slide, axis=0)).sum(1))])
    assert work[-1] > 0.5 * work.max() > 0.0
    assert np.hypot(*force.T).max() <= P * (1.0 + 1e-9)
    assert work[LEG * 8] == pytest.approx(work[: LEG * 8 + 1].max())


@pytest.mark.parametrize("psi_1", CONVERGED)
def test_straight_impacts_extrapolate_to_the_annuli(psi_1):
    found, error = extrapolated(lambda m: rings.rebound([psi_1, 0.0], DISK, rings=m, steps=16 * m), 16)
    assert error < 2e-3
    assert found[0] == pytest.approx(CONVERGED[psi_1], abs=1e-3)
    assert found[1] == 0.0


def test_impact_along_any_heading_is_the_straight_one_if_the_masses_are_alike():
    straight = rings.rebound([1.2, 0.0], DISK, rings=12, steps=200)
    oblique = rings.rebound([0.72, 0.96], DISK, rings=12, steps=200)
    np.testing.assert_allclose(oblique, straight[0] * np.array([0.6, 0.8]), atol=1e-6)


def test_impact_along_a_principal_direction_stays_on_it():
    one = rings.rebound([0.0, 1.5], [1.5, 0.5], rings=12, steps=200)
    assert one[0] == 0.0
    assert one[1] == pytest.approx(rings.rebound([1.5, 0.0], 0.5, rings=12, steps=200)[0], abs=1e-6)


def test_gross_slip_of_unlike_masses():
    # So fast that friction hardly turns it: psi_2 = psi_1 - 4 chi_i along its direction, first order in 1/psi_1.
    chi = np.array([1.5, 0.5])
    direction = np.array([0.6, 0.8])
    found = rings.rebound(1000.0 * direction, chi, rings=6, steps=100)
    np.testing.assert_allclose(found, 1000.0 * direction - 4.0 * chi * direction, atol=0.02)


def test_an_unknown_path_is_named():
    with pytest.raises(ValueError, match="name is 'spiral'"):
        path("spiral", 1.0)
