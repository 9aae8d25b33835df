"""Calibration from impacts that tell little: few of them, or all in one regime, or errors that are not alike."""

from __future__ import annotations

import warnings

import numba
import numpy as np
import pytest
from calibration_samples import DISK, KAPPA, MU, NOISE, RATIO, errors, off, table

from contactlaw import MATERIALS, calibrate
from contactlaw.calibration.fit import problem_of
from contactlaw.calibration.result import SLIDES, UNKNOWN
from contactlaw.calibration.table import Impacts

pytestmark = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="fits take minutes uncompiled")  # type: ignore[attr-defined]


@pytest.mark.parametrize("known", [True, False])
def test_only_sliding_impacts_tell_friction_and_not_kappa(known):
    before, after = table((6.0, 6.6, 7.2, 7.8, 8.4, 9.0))
    result = calibrate(before, after, DISK, **(errors() if known else {}))
    assert off(result.friction, MU) < 3.0
    assert result.stiffness_ratio.status == "not determined"
    assert result.stiffness_ratio.value is None and result.stiffness_ratio.uncertainty is None
    assert "every impact slides throughout" in result.verdict
    assert result.count(SLIDES) == 6


@pytest.mark.parametrize("known", [True, False])
def test_three_sliding_impacts_tell_friction(known):
    """One parameter is felt, so two degrees of freedom are left."""
    before, after = table((6.0, 6.6, 7.2))
    result = calibrate(before, after, DISK, **(errors() if known else {}))
    assert result.friction.lower < MU < result.friction.upper < 1.05 * result.friction.lower
    assert result.degrees_of_freedom == 2
    assert result.stiffness_ratio.value is None


def test_two_sliding_impacts_may_not_slide_at_all():
    """A curve of stiff springs and great friction passes within the errors of both."""
    before, after = table((6.0, 7.0))
    result = calibrate(before, after, DISK, **errors())
    assert result.friction.value is None
    assert result.friction.lower < MU < 10.0 * MU < result.friction.upper


def test_a_range_holds_all_places_of_the_map_that_fit():
    """Impacts made with kappa 1 and mu 0.104; a better fit at kappa 1.77 is not the end of what fits."""
    before = ([1.76, 1.06, 1.53, 1.73, 1.95, 0.82, 1.04, 1.13, 0.72, 1.96, 1.83],
              [1.39, 1.09, 1.46, 1.60, -0.04, 0.35, 0.86, -0.04, 0.17, 2.04, 1.99])  # fmt: skip
    after = ([1.57, 0.95, 1.20, 1.48, 1.77, 0.79, 0.91, 0.96, 0.70, 1.73, 1.56],
             [0.22, 0.26, 0.44, 0.34, 0.06, -0.13, 0.16, 0.01, 0.05, 0.65, 0.69])  # fmt: skip
    kappa = calibrate(before, after, 0.4, normal_error=0.05, tangential_error=0.05).stiffness_ratio
    assert kappa.lower is not None and kappa.lower < 1.0


@pytest.mark.slow
@pytest.mark.parametrize("count", [4, 5, 8])
def test_ranges_of_few_impacts_without_errors_hold_the_truth(count):
    """95 % of the ranges, also of those that belong to a value: a scatter that is small by chance must not make one."""
    generator = np.random.default_rng(count)
    told, missed = np.zeros(2), np.zeros(2)
    for seed in range(30):
        psi_1 = tuple(generator.uniform(0.3, 8.0, count))
        noise = (0.005, 0.02)[seed % 2]
        result = calibrate(*table(psi_1, noise, seed=1000 * count + seed, law=True), DISK)
        pairs = ((result.friction, MU), (result.stiffness_ratio, KAPPA))
        told += [one.value is not None for one, _ in pairs]
        missed += [one.value is not None and not one.lower <= truth <= one.upper for one, truth in pairs]
    chance = 0.05 * told + 2.6 * np.sqrt(0.05 * told)
    assert (missed <= chance).all(), (told, missed)


@pytest.mark.parametrize("psi_1", [0.3, 1.0, 3.0, 7.0])
def test_what_one_impact_allows_is_all_that_a_fine_map_allows(psi_1):
    before, after = table((psi_1,))
    result = calibrate(before, after, DISK, **errors())
    impacts = Impacts(np.stack([*before, *after]), np.full((4, 1), NOISE), True, RATIO, True)
    problem = problem_of(impacts, result.restitution.value, KAPPA, hold=False)
    mu = np.linspace(problem.grid[0, 0, 0], problem.grid[-1, 0, 0], 1200)
    cost = np.stack(
        [problem.cost(np.stack([mu, np.full(mu.size, k)], axis=-1)) for k in np.linspace(*np.log([0.3, 2]), 240)]
    )
    allowed = mu[(cost - cost.min() <= 1.96**2).any(axis=0)]
    assert result.friction.lower <= np.exp(allowed[0])
    assert result.friction.upper is None or result.friction.upper >= np.exp(allowed[-1])


@pytest.mark.parametrize("known", [True, False])
def test_only_sticking_impacts_bound_friction_from_below(known):
    before, after = table((0.1, 0.2, 0.3, 0.4, 0.5, 0.6))
    result = calibrate(before, after, DISK, **(errors() if known else {}))
    assert result.friction.value is None
    assert 0.0 < result.friction.lower < MU
    assert result.friction.upper is None or result.friction.upper > MU
    assert result.sliding_friction.value is None
    assert "at least" in result.verdict and SLIDES not in result.regimes
    with pytest.raises(ValueError, match="friction = not determined"):
        result.pair(MATERIALS["steel"], MATERIALS["steel"])


@pytest.mark.parametrize("psi_1", [0.3, 1.0, 7.0])
@pytest.mark.parametrize("known", [True, False])
def test_one_impact_tells_no_more_than_the_ratio_of_impulses(psi_1, known):
    before, after = table((psi_1,))
    result = calibrate(before, after, DISK, **(errors() if known else {}))
    assert result.friction.value is None and result.stiffness_ratio.value is None
    seen = float((before[1][0] - after[1][0]) / (RATIO * (before[0][0] + after[0][0])))
    if known:
        assert 0.0 < result.friction.lower <= seen
    else:
        assert result.friction.lower is None and f"at least {seen:.3g}" in result.verdict
    assert (result.restitution.uncertainty is None) is not known
    assert result.regimes == (UNKNOWN,)


def test_kappa_held_makes_one_sliding_impact_tell_friction():
    before, after = table((8.0,))
    result = calibrate(before, after, DISK, stiffness_ratio=KAPPA, hold_stiffness_ratio=True, **errors())
    assert result.stiffness_ratio.status == "given" and result.stiffness_ratio.value == KAPPA
    assert off(result.friction, MU) < 3.0


@pytest.mark.slow
def test_ranges_hold_where_errors_are_not_alike():
    """Ten impacts whose tangential velocities alone have errors: without given errors ranges were missed by a sixth."""
    generator, told, missed = np.random.default_rng(0), np.zeros(2), np.zeros(2)
    for _ in range(30):
        (z1, x1), (z2, x2) = table(tuple(generator.uniform(0.3, 8.0, 10)), 0.0, law=True)
        x1, x2 = (v + 0.006 * generator.standard_normal(10) for v in (x1, x2))
        result = calibrate((z1, x1), (z2, x2), DISK)
        pairs = ((result.friction, MU), (result.stiffness_ratio, KAPPA))
        told += [one.value is not None for one, _ in pairs]
        missed += [one.value is not None and not one.lower <= truth <= one.upper for one, truth in pairs]
    assert (told > 10).all() and (missed <= 0.05 * told + 2.6 * np.sqrt(0.05 * told)).all(), (told, missed)


@pytest.mark.slow
@pytest.mark.parametrize("known", [True, False])
def test_many_impacts_at_one_angle_do_not_exclude_the_truth(known):
    """They slid throughout; a stuck impact with much greater friction would leave alike."""
    missed = 0
    for seed in range(8):
        result = calibrate(*table((4.6,) * 8, seed=seed, law=True), DISK, **(errors() if known else {}))
        for one, truth in ((result.friction, MU), (result.stiffness_ratio, KAPPA)):
            missed += not (one.lower or 0.0) <= truth <= (one.upper or np.inf)
    assert missed <= 2


@pytest.mark.parametrize("known", [True, False])
@pytest.mark.parametrize("count", [2, 8, 20])
def test_impacts_that_are_all_the_same_raise_no_warnings(known, count):
    """One curve of many goes through them exactly, and there the cost has no slope, by which scipy divided."""
    one = np.ones((2, count))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        result = calibrate(one * [[1.0], [0.5]], one * [[0.9], [0.2]], DISK, **(errors() if known else {}))
    assert result.friction.value is None and result.stiffness_ratio.value is None
