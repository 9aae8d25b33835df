"""What Figs. 3 and 5 of the paper share: sizes of pucks, and friction factors."""

from __future__ import annotations

import numpy as np
import pytest

from contactlaw import rebound
from sims.puck import Puck
from validation.rebound_figure import friction_factor, recorded, sized, thrown

PSI = np.linspace(0.0, 9.0, 361)
CURVE = np.asarray(rebound(PSI, 1.256))


@pytest.mark.parametrize("factor", [0.9, 1.0, 1.2])
def test_the_factor_of_a_curve_recorded_with_wrong_friction_is_found_again(factor):
    found, left = friction_factor(PSI, recorded(PSI, CURVE, factor), CURVE, 4.0)
    assert found == pytest.approx(factor, abs=1e-3)
    assert left < 1e-3  # of straight lines between points twice over


def test_too_little_friction_moves_a_point_away_from_the_origin():
    # The point (2, f(2)), recorded with 1/1.2 of the friction, is at (2.4, 1.2 f(2)).
    assert np.interp(2.4, PSI, recorded(PSI, CURVE, 1.2)) == pytest.approx(1.2 * float(rebound(2.0, 1.256)), abs=1e-3)
    # In gross slip that lowers psi_2 by 0.2 of 4 chi.
    assert CURVE[-1] - recorded(PSI, CURVE, 1.2)[-1] == pytest.approx(0.2 * 4.0 * 1.256)


def test_a_puck_of_another_size_keeps_what_else_was_asked():
    puck = sized(Puck(material="steel", psi_1=3.0, speed=0.4, launch="spin"), 0.0762)
    assert puck.radius == pytest.approx(0.0381) and Puck.radius == 0.0508
    assert (puck.psi_1, puck.speed, puck.launch) == (3.0, 0.4, "spin")
    assert puck.mass == pytest.approx(Puck(material="steel").mass * 0.75**2)
    assert puck.chi == pytest.approx(Puck(material="steel").chi)


def test_a_throw_without_an_engine_keeps_incidence_and_restitution():
    puck = Puck(material="rubber", psi_1=1.2)
    impact = thrown(puck)
    assert impact.psi_1 == pytest.approx(1.2)
    assert impact.velocity_a @ puck.normal == pytest.approx(0.86 * puck.speed)
