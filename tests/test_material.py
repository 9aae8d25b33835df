"""Materials: moduli, compliances and refused values."""

from __future__ import annotations

from math import inf, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from contactlaw import MATERIALS, RIGID, Material

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
