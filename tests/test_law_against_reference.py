"""The microslip law against the annulus solver: two discretisations of one contact problem, which share no code."""

import numba
import numpy as np
import pytest

from contactlaw import rebound
from contactlaw.laws.microslip import Microslip
from validation.impacts import sticking
from validation.reference.annulus import impact, rebound_extrapolated

pytestmark = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="the reference takes minutes uncompiled")  # type: ignore[attr-defined]

FRACTIONS = np.array([0.05, 0.15, 0.3, 0.45, 0.6, 0.75, 0.9, 1.05])  # of the psi_1 from which on an impact slides


@pytest.mark.parametrize("restitution", [1.0, 0.9, 0.5])
@pytest.mark.parametrize(
    ("chi", "annuli", "bound"), [(0.5, 8, 1e-3), (1.0, 16, 1e-3), (1.256, 16, 1e-3), (2.0, 16, 1e-3), (4.5, 32, 5e-3)]
)
def test_default_settings_keep_the_promised_error(chi, annuli, bound, restitution):
    incidence = FRACTIONS * max(1.0, 2.0 * chi * (1.0 + restitution) - restitution)
    law = rebound(incidence, chi, restitution=restitution)
    for psi_1, psi_2 in zip(incidence, np.atleast_1d(law), strict=True):
        expected, uncertainty = rebound_extrapolated(float(psi_1), chi, restitution, annuli=annuli)
        assert uncertainty < bound
        assert psi_2 == pytest.approx(expected, abs=bound), f"psi_1 = {psi_1}"


@pytest.mark.heavy
def test_nodes_and_annuli_converge_to_the_same_limit():
    """The annuli with about second order in the mean, each N as closely as promised, 20 of them in 0.1 s an impact."""
    psi_1, chi, rms = np.array(sticking(1.441, 24)), 1.441, []
    limit = rebound(psi_1, chi, Microslip(node_count=256), steps=16384)
    for annuli, bound in ((10, 8e-3), (20, 3e-3), (40, 1e-3), (80, 5e-4)):
        errors = np.array([impact(psi, chi, annuli).psi_2 for psi in psi_1.tolist()]) - limit
        assert np.abs(errors).max() < bound
        rms.append(np.sqrt(np.mean(errors**2)))
    assert -np.polyfit(np.log([20, 40, 80]), np.log(rms[1:]), 1)[0] > 1.8


def test_fine_settings_meet_the_converged_values():
    incidence = [0.25, 0.5, 1.0, 1.2, 2.0, 3.0, 4.0, 5.0]
    converged = [-0.0161, -0.0755, -0.3052, -0.4608, -1.0935, -1.4256, -1.0235, -0.0240]
    law = rebound(incidence, 1.256, Microslip(node_count=128), steps=4000)
    np.testing.assert_allclose(law, converged, rtol=0.0, atol=1e-4)
