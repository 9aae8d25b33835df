"""Calibration: tables of known truth, made by the annulus reference, come back within their uncertainties."""

from __future__ import annotations

from math import inf

import numba
import numpy as np
import pytest
from calibration_samples import ALL, DISK, KAPPA, MU, NOISE, RATIO, E, errors, off, table
from hypothesis import given, settings
from hypothesis import strategies as st

from contactlaw import MATERIALS, Body, calibrate, collide, contact_velocities
from contactlaw.calibration.result import SLIDES, SLIDES_FIRST, STICKS_FIRST, Estimate
from contactlaw.pair import ContactPair

pytestmark = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="fits take minutes uncompiled")  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("uncertainty", "text"),
    [
        (0.0, "0.25 (to a millionth or better)"),
        (1e-13, "0.25 (to a millionth or better)"),
        (0.002, "0.2500 +- 0.0020 (0.8 %)"),
    ],
)
def test_an_estimate_tells_its_uncertainty(uncertainty, text):
    """Without scatter it told +- 0.00000000."""
    assert str(Estimate("measured", 0.25, uncertainty)) == text


@pytest.mark.parametrize("known", [True, False])
@pytest.mark.parametrize(
    ("mu", "kappa", "e", "inertia"), [(MU, KAPPA, E, DISK), (2.4, 2 / 3, 0.86, DISK), (0.092, 0.86, 0.98, 0.4)]
)
def test_true_values_come_back(mu, kappa, e, inertia, known):
    """Velocities scale with mu, so the errors do, down to where V_z spoils them: half a percent of V_z or V_x."""
    noise = NOISE * max(mu, 0.5)
    ratio = 1.0 + 1.0 / inertia
    before, after = table(noise=noise, mu=mu, kappa=kappa, e=e, ratio=ratio)
    result = calibrate(before, after, inertia, **(errors(noise) if known else {}))
    assert result.outliers == ()
    assert off(result.friction, mu) < 3.0
    assert off(result.stiffness_ratio, kappa) < 3.0
    assert off(result.restitution, e) < 3.0
    assert off(result.sliding_friction, mu) < 3.0
    assert result.stiffness_ratio.uncertainty < 0.1 * kappa
    assert result.friction.lower < result.friction.value < result.friction.upper


@pytest.mark.slow
@pytest.mark.parametrize(("known", "tables"), [(True, 60), (False, 40)])
def test_uncertainties_are_those_of_repeated_tables(known, tables):
    """The law generates, so that nothing but noise is left; 60 tables tell a standard deviation to 9 %, 40 to 11 %.

    Where the errors are not known, each impact's own misfit speaks for it, so that ranges hold where errors are not
    alike; ten impacts that are alike then tell a third too much (MacKinnon & White, J. Econom. 29 (1985) 305).
    """
    psi_1 = (0.4, 0.9, 1.6, 2.4, 3.2, 3.8, 5.0, 6.0, 7.0, 8.0)
    pulls = []
    for seed in range(tables):
        before, after = table(psi_1, seed=seed, law=True)
        result = calibrate(before, after, DISK, stiffness_ratio=0.84, **(errors() if known else {}))
        pairs = ((result.friction, MU), (result.stiffness_ratio, KAPPA), (result.restitution, E))
        pulls.append([(one.value - truth) / one.uncertainty for one, truth in pairs])
    spread = np.std(pulls, axis=0)
    assert ((spread > (0.8 if known else 0.6)) & (spread < 1.25)).all(), spread
    assert (np.abs(np.mean(pulls, axis=0)) < 4.0 / np.sqrt(tables)).all()


def test_without_errors_the_truth_is_met_as_well_as_law_and_reference_agree():
    """Both are good to 1e-3 in psi, of some 4 that the curve spans."""
    before, after = table(noise=0.0)
    result = calibrate(before, after, DISK)
    assert result.friction.value == pytest.approx(MU, rel=1e-3)
    assert result.stiffness_ratio.value == pytest.approx(KAPPA, rel=2e-3)
    assert result.restitution.value == pytest.approx(E, rel=1e-12)


def test_regimes_are_those_of_the_theory():
    before, after = table(noise=1e-4)
    result = calibrate(before, after, DISK)
    slides = KAPPA * RATIO * (1.0 + E) - E
    expected = [STICKS_FIRST if psi <= 1.0 else SLIDES if psi >= slides else SLIDES_FIRST for psi in ALL]
    assert list(result.regimes) == expected


def test_sliding_friction_is_the_papers_with_1_plus_e_for_2():
    psi_1 = (5.0, 6.0, 7.0, 8.0)
    before, after = table(psi_1, noise=0.0)
    result = calibrate(before, after, DISK, stiffness_ratio=KAPPA, hold_stiffness_ratio=True)
    assert result.sliding_friction.value == pytest.approx(MU, rel=1e-9)
    paper = np.mean((before[1] - after[1]) / (2.0 * before[0] * RATIO))
    assert paper / MU - 1.0 == pytest.approx(-0.035, abs=1e-9)


def test_a_few_outliers_are_named_and_do_no_harm():
    before, after = table()
    after[1][2] += 0.3
    after[1][11] *= -1.0
    result = calibrate(before, after, DISK)
    assert result.outliers == (2, 11)
    assert "impact 2, 11" in result.verdict
    assert off(result.friction, MU) < 3.0 and off(result.stiffness_ratio, KAPPA) < 3.0


def test_errors_given_too_small_are_widened_to_the_scatter_and_said():
    before, after = table()
    result = calibrate(before, after, DISK, **errors(0.2 * NOISE))
    assert result.chi_squared == pytest.approx(25.0, rel=0.6)
    assert "scatter more than the given errors" in result.verdict
    assert off(result.friction, MU) < 3.0


def test_impacts_that_gain_tangential_velocity_are_refused_a_friction():
    before, after = table()
    result = calibrate(before, (after[0], 1.1 * before[1] + 0.01), DISK)
    assert result.friction.value is None and "same direction" in result.verdict
    with pytest.raises(ValueError, match="curve: there is none"):
        result.curve([1.0])


def test_two_free_bodies():
    """Velocities from `collide` of a ball and a disk in flight; the law itself, so the fit meets it to its steps."""
    pair = ContactPair(MATERIALS["steel"], MATERIALS["steel"], friction=0.2, restitution=0.9)
    a, b = Body(0.5, 0.025), Body(1.5, 0.04, inertia=0.5 * 1.5 * 0.04**2)
    rows = []
    for sliding in np.linspace(0.1, 2.0, 12):
        moving = Body(0.5, 0.025, velocity=(sliding, 0.0, -1.0))
        hit = collide(pair, moving, b)
        relative = hit.velocity_a - hit.velocity_b
        slip = relative[0] - a.radius * hit.spin_a[1] - b.radius * hit.spin_b[1]
        rows.append((1.0, sliding, relative[2], slip))
    z1, x1, z2, x2 = np.array(rows).T
    result = calibrate((z1, x1), (z2, x2), (a, b))
    assert result.friction.value == pytest.approx(0.2, rel=2e-3)
    assert result.stiffness_ratio.value == pytest.approx(pair.kappa, rel=4e-3)
    assert calibrate((z1, x1), (z2, x2), Body(0.5, 0.025)).mass_ratio == pytest.approx(3.5)


def test_contact_velocities_of_rolling_and_backspin():
    z, x = contact_velocities([1.0, 2.0], [3.0, 3.0], [6.0, -6.0], radius=0.5)
    np.testing.assert_allclose(z, [1.0, 2.0])
    np.testing.assert_allclose(x, [0.0, 6.0])


@pytest.mark.slow
@settings(max_examples=6)
@given(
    scale=st.floats(1e-3, 1e3),
    seed=st.integers(0, 5),
    signs=st.lists(st.sampled_from([-1.0, 1.0]), min_size=10, max_size=10),
)
def test_unit_of_velocity_and_side_change_nothing(scale, seed, signs):
    """With given errors and without."""
    before, after = table((0.4, 0.9, 1.6, 2.4, 3.2, 3.8, 5.0, 6.0, 7.0, 8.0), seed=seed)
    side = scale * np.array(signs)
    for plain_errors, moved_errors in ((errors(), errors(scale * NOISE)), ({}, {})):
        plain = calibrate(before, after, DISK, **plain_errors)
        moved = calibrate(
            (scale * before[0], side * before[1]), (scale * after[0], side * after[1]), DISK, **moved_errors
        )
        for name in ("friction", "stiffness_ratio", "restitution"):
            one, other = getattr(plain, name), getattr(moved, name)
            assert abs(one.value - other.value) < 1e-3 * one.uncertainty
            assert other.uncertainty == pytest.approx(one.uncertainty, rel=1e-3)
        assert moved.regimes == plain.regimes


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"inertia_ratio": 0.0}, "inertia_ratio = 0.0: must be finite and > 0"),
        ({"inertia_ratio": (Body(), Body())}, "every body is held fast"),
        ({"inertia_ratio": (1, 2)}, "must be K"),
        ({"before": ([1.0, -1.0], [0.1, 0.2])}, r"before\[0\] \(V_z1\): is -1 in impact 1"),
        ({"before": ([1.0], [0.1, 0.2])}, "lengths are"),
        ({"before": ([1.0, inf], [0.1, 0.2])}, r"before\[0\]: holds inf"),
        ({"before": [1.0]}, "must be two arrays"),
        ({"before": np.ones((200, 2))}, "^.{1,50}: must be two arrays"),  # columns, and not the table, before the word
        ({"before": (np.ones((2, 2)), [0.1, 0.2])}, r"shape \(2, 2\); must be \(n,\)"),
        ({"after": (None, [0.0, 0.0])}, "with a restitution"),
        ({"after": (None, [0.0, 0.0]), "restitution": 1.5}, r"restitution = 1.5: must be in \[1e-6, 1\]"),
        ({"restitution": 0.9}, "must be None where V_z2 was measured"),
        ({"normal_error": 0.1}, "give both, or neither"),
        ({"normal_error": 0.1, "tangential_error": 0.0}, "tangential_error: holds 0; standard deviations must be > 0"),
        ({"normal_error": 0.1, "tangential_error": [0.1] * 3}, r"must be a number, \(2,\) or \(2, 2\)"),
        ({"stiffness_ratio": 5.0}, "stiffness_ratio = 5.0: must be in"),
        ({"hold_stiffness_ratio": True}, "needs the stiffness_ratio"),
        ({"hold_stiffness_ratio": "no"}, "must be True or False"),
    ],
)
def test_bad_input_is_named(change, message):
    arguments = {"before": ([1.0, 1.0], [0.1, 0.2]), "after": ([0.9, 0.9], [0.0, 0.0]), "inertia_ratio": 0.4} | change
    with pytest.raises(ValueError, match=message):
        calibrate(**arguments)


@pytest.mark.parametrize("scale", [5e-324, 1e-300, 1e-29, 1e29, 1e300])
def test_speeds_at_the_ends_of_the_doubles_are_fitted_or_refused(scale):
    before, after = ([scale * column for column in columns] for columns in table())
    if not 1e-30 < scale < 1e30:
        with pytest.raises(ValueError, match=r"must be at most 1e\+30|must be > 0"):
            calibrate(before, after, DISK)
        return
    result, plain = calibrate(before, after, DISK), calibrate(*table(), DISK)
    for name in ("friction", "stiffness_ratio", "restitution"):
        assert getattr(result, name).value == pytest.approx(getattr(plain, name).value, rel=1e-6)


def test_a_result_makes_a_pair():
    before, after = table()
    result = calibrate(before, after, DISK)
    pair = result.pair(MATERIALS["steel"], MATERIALS["steel"])
    assert (pair.friction, pair.kappa) == pytest.approx((result.friction.value, result.stiffness_ratio.value))
    assert "kappa" in result.summary()


@pytest.mark.slow
def test_a_large_table_tells_the_same():
    """Beside a table of a fortieth of its rows; two of its rows are far off."""
    few, many = (table(np.linspace(0.3, 8.0, n), law=True) for n in (500, 20_000))
    many[1][1][[17, 9999]] += 0.2
    small, large = (calibrate(*one, DISK, **errors()) for one in (few, many))
    assert large.outliers == (17, 9999)
    for name, truth in (("friction", MU), ("stiffness_ratio", KAPPA)):
        one, two = getattr(large, name), getattr(small, name)
        assert off(one, truth) < 3.5
        assert one.uncertainty == pytest.approx(two.uncertainty / 40**0.5, rel=0.3)
    assert [large.count(name) / 40 for name in (SLIDES, STICKS_FIRST)] == pytest.approx(
        [small.count(name) for name in (SLIDES, STICKS_FIRST)], abs=2
    )
