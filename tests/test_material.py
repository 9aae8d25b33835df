"""Materials: moduli, compliances and refused values."""

from __future__ import annotations

from decimal import Decimal
from fractions import Fraction
from math import inf, nan
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from contactlaw import MATERIALS, RIGID, Material, checks

MODULI = st.floats(1e3, 1e13)
RATIOS = st.floats(-0.99, 0.5)


@given(MODULI, RATIOS)
def test_shear_modulus_round_trip(shear: float, ratio: float) -> None:
    material = Material.from_shear_modulus(shear, ratio)
    assert material.shear_modulus == pytest.approx(shear, rel=1e-14)
    assert material.youngs_modulus == pytest.approx(2.0 * (1.0 + ratio) * shear, rel=1e-14)


@given(MODULI, RATIOS)
def test_compliances_are_those_of_hertz_and_mindlin(modulus: float, ratio: float) -> None:
    material = Material(modulus, ratio)
    assert material.normal_compliance == pytest.approx((1 - ratio**2) / modulus, rel=1e-14)
    assert material.tangential_compliance == pytest.approx((2 - ratio) * (1 + ratio) / (2 * modulus), rel=1e-14)


def test_rigid_material_deforms_in_no_direction() -> None:
    """Leaving the tangential compliance finite halves kappa: a known published error."""
    assert RIGID.is_rigid
    assert RIGID.normal_compliance == 0.0
    assert RIGID.tangential_compliance == 0.0
    assert Material.from_shear_modulus(inf, 0.3).is_rigid


def test_named_materials_say_where_their_numbers_come_from() -> None:
    for name, material in MATERIALS.items():
        assert material.name == name
        assert len(material.source) > 10, name
    assert MATERIALS["steel"].poissons_ratio == 0.28
    assert MATERIALS["rubber"].poissons_ratio == 0.5


@pytest.mark.parametrize(
    ("argument", "value", "allowed"),
    [
        ("youngs_modulus", nan, "> 0"),
        ("youngs_modulus", 0.0, "> 0"),
        ("youngs_modulus", -2e11, "> 0"),
        ("youngs_modulus", None, "must be a number"),
        ("youngs_modulus", "stiff", "must be a number"),
        ("youngs_modulus", 1j, "must be a number"),
        ("youngs_modulus", 10**400, "> 0"),
        ("poissons_ratio", nan, "(-1, 0.5]"),
        ("poissons_ratio", -1.0, "(-1, 0.5]"),
        ("poissons_ratio", 0.5000001, "(-1, 0.5]"),
        ("poissons_ratio", inf, "(-1, 0.5]"),
        ("density", 0.0, "> 0"),
        ("density", -1.0, "> 0"),
        ("density", nan, "> 0"),
        ("density", inf, "finite"),
    ],
)  # fmt: skip
def test_bad_values_are_named_and_refused(argument: str, value: object, allowed: str) -> None:
    values = {"youngs_modulus": 2e11, "poissons_ratio": 0.3, "density": 7800.0} | {argument: value}
    with pytest.raises(ValueError) as caught:
        Material(**values)  # type: ignore[arg-type]
    message = str(caught.value)
    assert argument in message
    assert repr(value) in message
    assert allowed in message


@pytest.mark.parametrize(("shear", "ratio", "argument"), [
    (0.0, 0.3, "shear_modulus"), (-1.0, 0.3, "shear_modulus"), (nan, 0.3, "shear_modulus"),
    (1e9, 0.6, "poissons_ratio"), (1e9, -1.0, "poissons_ratio"), (1e9, nan, "poissons_ratio"),
])  # fmt: skip
def test_bad_shear_moduli_are_refused(shear: float, ratio: float, argument: str) -> None:
    with pytest.raises(ValueError, match=argument):
        Material.from_shear_modulus(shear, ratio)


def test_materials_cannot_be_changed() -> None:
    with pytest.raises(AttributeError):
        MATERIALS["steel"].youngs_modulus = 1.0  # type: ignore[misc]


@pytest.mark.parametrize(("name", "near"), [("Steel", "steel"), ("PMA", "PMMA"), ("RUBBER", "rubber")])
def test_an_unknown_name_is_answered_with_the_nearest(name: str, near: str) -> None:
    with pytest.raises(KeyError) as caught:
        MATERIALS[name]
    assert str(caught.value).endswith(f"(did you mean {near!r}?)")
    assert name not in MATERIALS


def test_ice_is_the_mean_over_directions_of_its_crystal() -> None:
    """Hill's mean of the bounds of Voigt and Reuss, from the constants that the source names [GPa]."""
    c11, c12, c13, c33, c44 = 13.929, 7.082, 5.765, 15.010, 3.014
    c = np.diag([c11, c11, c33, c44, c44, 0.5 * (c11 - c12)])
    c[0, 1] = c[1, 0] = c12
    c[:2, 2] = c[2, :2] = c13
    means = []
    for m, inverse in ((c, False), (np.linalg.inv(c), True)):
        diagonal, aside, shear = np.trace(m[:3, :3]), m[0, 1] + m[0, 2] + m[1, 2], np.trace(m[3:, 3:])
        bulk, rigidity = (diagonal + 2 * aside) / 9, (diagonal - aside + 3 * shear) / 15
        if inverse:
            bulk, rigidity = 1 / (9 * bulk), 15 / (4 * diagonal - 4 * aside + 3 * shear)
        means.append((bulk, rigidity))
    k, g = np.mean(means, axis=0)
    assert 9 * k * g / (3 * k + g) == pytest.approx(MATERIALS["ice"].youngs_modulus / 1e9, abs=0.05)
    assert (3 * k - 2 * g) / (6 * k + 2 * g) == pytest.approx(MATERIALS["ice"].poissons_ratio, abs=5e-4)


def test_concrete_and_acrylic_follow_from_what_their_sources_say() -> None:
    assert pytest.approx(MATERIALS["concrete"].youngs_modulus, rel=0.01) == 22e9 * 3.8**0.3
    p, s = 2670.0**2, 1120.0**2
    assert (p - 2 * s) / (2 * (p - s)) == pytest.approx(MATERIALS["PMMA"].poissons_ratio, abs=5e-3)


@pytest.mark.parametrize(
    "bad",
    [
        np.ma.array([1.0, 2.0], mask=[0, 1]), [1j], ["1"], "1", b"1", True, [True], np.True_, [None], [10**400],
        np.array(["2020"], "datetime64"), np.datetime64("2020"), np.zeros(2, [("a", float)]), [[1], [1, 2]],
        np.longdouble("1e4000"),
    ],
)  # fmt: skip
def test_only_real_numbers_are_taken_for_numbers(bad: object) -> None:
    with pytest.raises(ValueError, match="it"):
        checks.finite_array("it", bad)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="it"):
        checks.positive("it", bad)


@pytest.mark.parametrize("good", [1, 1.5, np.float32(1.5), np.int8(3), Decimal("1.5"), Fraction(3, 2), np.array(1.5)])
def test_any_kind_of_real_number_is_taken(good: Any) -> None:
    assert checks.positive("it", good) == float(good)
    assert checks.finite_array("it", [good, good]).tolist() == [float(good)] * 2
