"""The solvers that judge slides that turn, and spin, against what is known exactly and against each other.

Rings with a traction vector each, and square cells with the full kernel of Cerruti, any nu and spin about the normal.
"""

import numpy as np
import pytest

from tests.reference import torsion
from validation.reference import annulus, grid, rings, turning_data
from validation.reference.refinement import extrapolated
from validation.reference.turning_paths import NAMES

pytestmark = [pytest.mark.heavy, pytest.mark.slow]

DISK = 1.256
STICK_RADII = [0.95, 0.8, 0.6, 0.4, 0.2, 0.1]
P = 4.0 / 3.0  # normal force at overlap 1
SAVED = turning_data.load()


@pytest.mark.parametrize("psi", [0.25, 0.5, 1.0, 1.2, 2.0, 3.0, 4.0, 5.0])
def test_rings_on_a_straight_slide_give_the_annulis_rebound(psi):
    found, _ = extrapolated(lambda m: rings.rebound([psi, 0.0], DISK, rings=m, steps=16 * m), 32)
    assert found[0] == pytest.approx(annulus.rebound_extrapolated(psi, DISK)[0], abs=3e-4)


def test_torsion_of_the_grid_has_lubkins_moment():
    nu, turned = 0.3, np.zeros((len(STICK_RADII) + 1, 3))
    turned[1:, 2] = torsion.angle(STICK_RADII) * P / (0.25 * (2.0 - nu))
    moment = grid.force_along_path(np.ones(len(turned)), turned, nu=nu, cells=128)[1:, 2]
    np.testing.assert_allclose(moment / P, torsion.moment(STICK_RADII), atol=3e-4 * torsion.FULL_SLIP)


def test_saved_figures_computed_anew_and_coarser():
    amplitude = turning_data.AMPLITUDES[2]
    for name in NAMES:
        (one,) = [one for one in SAVED["forces"] if one["path"] == name and one["amplitude"] == amplitude]
        np.testing.assert_allclose(turning_data.force(name, amplitude, 16)[0], one["force"], atol=5e-3)
    for chi_1, chi_2, psi, heading, *known, _ in SAVED["uneven"][7::30]:
        assert turning_data.uneven_rebound([chi_1, chi_2], psi, heading, 16)[0] == pytest.approx(known, abs=5e-3)
    for nu, chi_s, psi, sigma, *known, _ in SAVED["spinning"][12::50]:
        assert turning_data.spinning_rebound(nu, chi_s, psi, sigma, 8)[0] == pytest.approx(known, abs=5e-3)
