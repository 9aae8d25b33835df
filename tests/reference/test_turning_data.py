"""The saved figures for slides that turn and for spin: complete, small, within the cone, and what the solvers give."""

import numpy as np
import pytest

from validation.reference import annulus, turning_data
from validation.reference.turning_paths import LEG, NAMES, path

SAVED = turning_data.load()


def test_every_figure_is_there_with_its_error():
    assert turning_data.FILE.stat().st_size < 50_000
    forces = {(one["path"], one["amplitude"]): one for one in SAVED["forces"]}
    assert set(forces) == {(name, amplitude) for name in NAMES for amplitude in turning_data.AMPLITUDES}
    for (name, amplitude), one in forces.items():
        force = np.array(one["force"])
        assert force.shape == path(name, amplitude)[1].shape
        assert np.hypot(*force.T).max() <= 1.0 + one["error"]
        assert 0.0 < one["error"] < 2e-3
    assert len(SAVED["uneven"]) == 60
    assert len(SAVED["spinning"]) == 78
    assert max(row[-1] for row in SAVED["uneven"]) < 1e-3
    assert max(row[-1] for row in SAVED["spinning"]) < 2e-3


def test_the_first_leg_is_cattaneo_mindlins():
    for one in SAVED["forces"]:
        if one["path"] in ("circle", "ellipse", "square"):
            s = np.minimum(one["amplitude"] * np.arange(LEG + 1) / LEG, 1.0)
            force = np.array(one["force"])[: LEG + 1]
            np.testing.assert_allclose(force[:, 0], 1.0 - (1.0 - s) ** 1.5, atol=1e-3)
            assert np.abs(force[:, 1]).max() == 0.0


@pytest.mark.heavy
def test_without_spin_the_annuli_say_the_same():
    for nu, chi_s, psi, sigma, psi_2, sigma_2, error in SAVED["spinning"]:
        if sigma == chi_s == 0.0:
            expected = annulus.rebound(psi, turning_data.BALL_CHI, 40)
            assert sigma_2 == 0.0
            assert abs(psi_2 - expected) < error + 1e-3, (nu, psi)


def test_tangential_energy_is_lost():
    for chi_1, chi_2, psi, heading, psi_x, psi_y, _ in SAVED["uneven"]:
        angle = np.radians(heading)
        before = (psi * np.cos(angle)) ** 2 / chi_1 + (psi * np.sin(angle)) ** 2 / chi_2
        assert psi_x**2 / chi_1 + psi_y**2 / chi_2 < before
