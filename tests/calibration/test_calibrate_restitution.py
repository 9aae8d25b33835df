"""Calibration of restitution: given, constant, or over speed by a law that is told from the others."""

from __future__ import annotations

import numba
import numpy as np
import pytest
from calibration_samples import DISK, KAPPA, MU, E, off, table

from contactlaw import MATERIALS, calibrate
from contactlaw.calibration.assessment import over_speed
from contactlaw.losses import Plastic, Viscoelastic

pytestmark = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="fits take minutes uncompiled")  # type: ignore[attr-defined]


def test_restitution_may_be_given_where_it_was_not_measured():
    before, after = table()
    result = calibrate(before, (None, after[1]), DISK, restitution=E)
    assert result.restitution.status == "given"
    assert off(result.friction, MU) < 3.0 and off(result.stiffness_ratio, KAPPA) < 3.0


def table_over_speed(law, count, scatter, seed=0):
    """(before, after) of impacts at 0.05 to 5 m/s whose V_z2 has a relative scatter."""
    generator = np.random.default_rng(seed)
    speed = np.geomspace(0.05, 5.0, count)
    (_, x1), (_, x2) = table(tuple(np.linspace(0.5, 7.0, count)), 1e-9, law=True)
    z2 = law(speed) * speed * (1.0 + scatter * generator.standard_normal(count))
    return (speed, x1 * speed), (z2, x2 * speed)


@pytest.mark.parametrize("law", [Viscoelastic(0.9, 0.5), Plastic(0.02)])
def test_a_restitution_over_speed_is_found_and_told_from_the_others(law):
    result = calibrate(*table_over_speed(law, 24, 0.01), DISK)
    found = result.restitution_law
    assert type(found.law) is type(law) and not found.note
    true = law(found.law.speed) if isinstance(law, Viscoelastic) else law.yield_speed
    assert found.number.lower < true < found.number.upper
    assert found.number.upper / found.number.lower < 1.2
    assert result.pair(MATERIALS["steel"], MATERIALS["steel"]).restitution == found.law
    assert law.name in result.summary()


def test_ranges_of_a_restitution_over_speed_hold_the_truth():
    """Of the law that is asked for, 95 % of 100 tables, up to chance (8 of 60 would be that, one in 200 times)."""
    law, missed = Plastic(0.02), 0
    for seed in range(60):
        (z1, _), (z2, _) = table_over_speed(law, 6, 0.03, seed)
        found = over_speed(z1, z2 / z1, np.ones(6), False, "plastic").number
        missed += not found.lower <= 0.02 <= found.upper
    assert missed <= 8


@pytest.mark.parametrize("law", [Viscoelastic(0.8, 1.0), Plastic(0.2)])
@pytest.mark.parametrize("speeds", [(2.0,), (2.0, 2.0), (1.0, 2.0, 3.0)])
def test_the_law_that_is_asked_for_needs_no_range_of_speeds(law, speeds):
    speed = np.array(speeds)
    before, after = (speed, 3.0 * speed), (law(speed) * speed, 2.0 * speed)
    found = calibrate(before, after, DISK, restitution_law=law.name).restitution_law
    assert found.law(0.5) == pytest.approx(law(0.5), rel=1e-6)
    with pytest.raises(ValueError, match=f"restitution_law = '{law.name}': needs V_z2"):
        calibrate(before, (None, after[1]), DISK, restitution=0.8, restitution_law=law.name)


def test_a_constant_restitution_speaks_for_no_law():
    chosen = 0
    for seed in range(20):
        (z1, _), (z2, _) = table_over_speed(lambda speed: 0.8 + 0.0 * speed, 8, 0.03, seed)
        chosen += over_speed(z1, z2 / z1, np.ones(8), False, None) is not None
    assert chosen <= 1
    result = calibrate(*table_over_speed(Plastic(0.02), 24, 0.01), DISK, restitution_law="constant")
    assert result.restitution_law is None
    with pytest.raises(ValueError, match="restitution_law"):
        calibrate(*table_over_speed(Plastic(0.02), 24, 0.01), DISK, restitution_law="elastic")
