"""Contact pairs: effective moduli, Hertz figures, scaled parameters, warnings and refused values."""

from __future__ import annotations

import warnings
from math import inf, nan, sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from contactlaw import MATERIALS, RIGID, Body, ContactPair, ContactWarning, Material, collide
from contactlaw.laws.record import pair_of
from validation.prediction import quiet_pair

STEEL, RUBBER = MATERIALS["steel"], MATERIALS["rubber"]
MATERIAL = st.builds(Material, st.floats(1e5, 1e12), st.floats(-0.9, 0.5))


@given(MATERIAL)
def test_same_material_has_the_closed_form_kappa(material: Material) -> None:
    nu = material.poissons_ratio
    pair = ContactPair(material, material, 0.3)
    assert pair.kappa == pytest.approx(2 * (1 - nu) / (2 - nu), rel=1e-13)
    assert pair.effective_modulus == pytest.approx(material.youngs_modulus / (2 * (1 - nu**2)), rel=1e-13)
    assert pair.effective_shear_modulus == pytest.approx(2 * material.shear_modulus / (2 - nu), rel=1e-13)
    assert pair.coupling == 0.0


@given(MATERIAL)
def test_rigid_partner_keeps_kappa_and_doubles_both_moduli(material: Material) -> None:
    """Rigid in the normal modulus alone would halve kappa."""
    alone, on_rigid = ContactPair(material, material, 0.3), quiet_pair(material, RIGID, 0.3)
    assert on_rigid.kappa == pytest.approx(alone.kappa, rel=1e-13)
    assert on_rigid.effective_modulus == pytest.approx(2 * alone.effective_modulus, rel=1e-13)
    assert on_rigid.effective_shear_modulus == pytest.approx(2 * alone.effective_shear_modulus, rel=1e-13)


@given(MATERIAL, MATERIAL)
def test_compliances_of_dissimilar_materials_add(a: Material, b: Material) -> None:
    pair, swapped = quiet_pair(a, b, 0.3), quiet_pair(b, a, 0.3)
    normal = (1 - a.poissons_ratio**2) / a.youngs_modulus + (1 - b.poissons_ratio**2) / b.youngs_modulus
    shear = (2 - a.poissons_ratio) / (4 * a.shear_modulus) + (2 - b.poissons_ratio) / (4 * b.shear_modulus)
    assert pair.effective_modulus == pytest.approx(1 / normal, rel=1e-13)
    assert pair.effective_shear_modulus == pytest.approx(1 / shear, rel=1e-13)
    assert swapped.kappa == pytest.approx(pair.kappa, rel=1e-13)
    assert swapped.coupling == pytest.approx(-pair.coupling, abs=1e-13)


@pytest.mark.parametrize(("a", "b", "coupling"), [
    (MATERIALS["alumina"], MATERIALS["glass"], -0.45),
    (Material(1e9, 0.3), RIGID, 0.57),
])  # fmt: skip
def test_dissimilar_materials_warn_with_their_coupling(a: Material, b: Material, coupling: float) -> None:
    with pytest.warns(ContactWarning, match=f"{coupling:.2f}") as caught:
        pair = ContactPair(a, b, 0.3)
    assert pair.coupling == pytest.approx(coupling, abs=0.005)
    assert caught[0].filename == __file__


@pytest.mark.parametrize(("a", "b"), [(STEEL, STEEL), (RUBBER, RIGID), (RIGID, RUBBER), (STEEL, RUBBER)])
def test_uncoupled_or_weakly_coupled_pairs_do_not_warn(a: Material, b: Material) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        pair = ContactPair(a, b, 0.3)
    assert pair.coupling == pytest.approx(0.0, abs=1e-4)


def test_stiffness_ratio_overrides_kappa_and_leaves_the_normal_modulus() -> None:
    pair = ContactPair(RUBBER, RIGID, 0.5, stiffness_ratio=0.6)
    assert pair.kappa == pytest.approx(0.6, rel=1e-14)
    assert pair.effective_modulus == ContactPair(RUBBER, RIGID, 0.5).effective_modulus


@pytest.mark.parametrize(("mass", "speed", "radius"), [(0.5, 1.0, 0.02), (1e-9, 1e-3, 1e-5), (100.0, 20.0, 0.5)])
def test_elastic_impact_figures_are_those_of_hertz(mass: float, speed: float, radius: float) -> None:
    """Closed forms; the pair's table has 2000 phases, times to 1e-5."""
    pair = ContactPair(STEEL, STEEL, 0.1, radius=radius)
    stiffness = 4 / 3 * pair.effective_modulus * sqrt(radius)
    overlap = (1.25 * mass * speed**2 / stiffness) ** 0.4
    assert pair.greatest_overlap(mass, speed) == pytest.approx(overlap, rel=1e-9)
    assert pair.greatest_force(mass, speed) == pytest.approx(stiffness * overlap**1.5, rel=1e-9)
    assert pair.contact_duration(mass, speed) == pytest.approx(2.943275184324214 * overlap / speed, rel=1e-5)


@given(st.floats(0.05, 1.0))
def test_restitution_below_one_shortens_overlap(e: float) -> None:
    elastic, damped = ContactPair(STEEL, STEEL, 0.1, radius=0.01), ContactPair(STEEL, STEEL, 0.1, e, radius=0.01)
    assert damped.greatest_overlap(1.0, 1.0) <= elastic.greatest_overlap(1.0, 1.0)
    assert damped.damping_ratio >= 0.0


@pytest.mark.parametrize(("nu", "gyration2", "chi"), [(0.28, 0.5, 1.256), (0.5, 0.5, 1.0), (0.3, 0.4, 1.441)])
def test_chi_of_disc_and_sphere(nu: float, gyration2: float, chi: float) -> None:
    """chi = (1 - nu)(1 + 1/K^2)/(2 - nu) for a body on a fixed one of the same material; published to 3 decimals."""
    material = Material(1e9, nu)
    value = ContactPair(material, material, 0.3).chi(2.0, 2.0 / (1 + 1 / gyration2))
    assert value == pytest.approx((1 - nu) * (1 + 1 / gyration2) / (2 - nu), rel=1e-13)
    assert value == pytest.approx(chi, abs=6e-4)


def test_psi_scales_velocity_by_kappa_over_friction() -> None:
    pair = ContactPair(STEEL, STEEL, 0.2)
    assert pair.psi(3.0, 1.5) == pytest.approx(pair.kappa / 0.2 * 2.0, rel=1e-14)
    assert pair.psi([3.0, -3.0], 1.5).tolist() == [pair.psi(3.0, 1.5), -pair.psi(3.0, 1.5)]
    assert pair.psi(-3.0, 1.5) == -pair.psi(3.0, 1.5)


@pytest.mark.parametrize(
    ("argument", "value", "allowed"),
    [
        ("a", "steal", "did you mean 'steel'"),
        ("b", None, "Material"),
        ("b", "phenolic", "must be a contactlaw.Material or one of steel"),
        ("friction", -0.1, ">= 0"),
        ("friction", nan, ">= 0"),
        ("friction", inf, "finite"),
        ("friction", "rough", "number"),
        ("restitution", 0.0, "[1e-6, 1]"),
        ("restitution", -0.5, "[1e-6, 1]"),
        ("restitution", 1.0000001, "[1e-6, 1]"),
        ("restitution", nan, "[1e-6, 1]"),
        ("radius", 0.0, "> 0"),
        ("radius", -1.0, "> 0"),
        ("radius", inf, "finite"),
        ("radius", nan, "> 0"),
        ("stiffness_ratio", 0.0, "> 0"),
        ("stiffness_ratio", nan, "> 0"),
        ("stiffness_ratio", -0.6, "> 0"),
        ("law", "microslop", "microslip"),
        ("law", 3, "one of"),
    ],
)
def test_bad_values_are_named_and_refused(argument: str, value: object, allowed: str) -> None:
    values = {"a": STEEL, "b": STEEL, "friction": 0.3} | {argument: value}
    with pytest.raises(ValueError) as caught:
        ContactPair(**values)  # type: ignore[arg-type]
    message = str(caught.value)
    assert f"{argument} = {value!r}" in message
    assert allowed in message


def test_two_rigid_bodies_are_refused() -> None:
    with pytest.raises(ValueError, match="both rigid"):
        ContactPair(RIGID, Material(inf, 0.3), 0.3)


@pytest.mark.parametrize(("figure", "arguments", "named"), [
    ("chi", (0.0, 1.0), "normal_mass"), ("chi", (1.0, nan), "tangential_mass"), ("chi", (-1.0, 1.0), "normal_mass"),
    ("psi", (1.0, 0.0), "normal_velocity"), ("psi", (1.0, nan), "normal_velocity"),
    ("greatest_overlap", (0.0, 1.0), "mass"), ("greatest_overlap", (1.0, -1.0), "speed"),
    ("contact_duration", (nan, 1.0), "mass"), ("contact_duration", (1.0, 0.0), "speed"),
    ("greatest_force", (inf, 1.0), "mass"), ("greatest_force", (1.0, nan), "speed"),
    ("psi", (nan, 1.0), "tangential_velocity"),
    ("parameters", (nan,), "radius"),
])  # fmt: skip
def test_figures_refuse_bad_masses_and_speeds(figure: str, arguments: tuple[float, ...], named: str) -> None:
    radius = None if figure == "parameters" else 0.01
    pair = ContactPair(STEEL, STEEL, 0.3, radius=radius)
    with pytest.raises(ValueError, match=named):
        getattr(pair, figure)(*arguments)


@pytest.mark.parametrize("figure", ["greatest_overlap", "contact_duration", "greatest_force"])
def test_figures_that_need_a_radius_say_so(figure: str) -> None:
    with pytest.raises(ValueError, match="radius = None"):
        getattr(ContactPair(STEEL, STEEL, 0.3), figure)(1.0, 1.0)


def test_psi_without_friction_is_refused() -> None:
    with pytest.raises(ValueError, match=r"friction = 0\.0"):
        ContactPair(STEEL, STEEL, 0.0).psi(1.0, 1.0)


def test_the_pair_s_own_radius_wins_over_that_of_the_geoms() -> None:
    def radius_of(pair: ContactPair) -> float:
        return pair_of(pair.parameters(radius=0.5)).radius

    assert radius_of(ContactPair(STEEL, STEEL, 0.3, radius=0.01)) == 0.01
    assert radius_of(ContactPair(STEEL, STEEL, 0.3)) == 0.5


def test_contacts_too_deep_for_hertz_warn() -> None:
    """A 30 mm rubber ball of 1 kg at 50 m/s: overlap three times its radius."""
    pair = ContactPair(RUBBER, RIGID, 0.5)
    with pytest.warns(ContactWarning):
        impact = collide(pair, Body(1.0, 0.03, velocity=(0.0, 0.0, -50.0)))
    assert np.max(impact.overlap) > 0.1 * 0.03


def test_materials_may_be_given_by_name() -> None:
    assert ContactPair("steel", "steel", friction=0.3) == ContactPair(STEEL, STEEL, friction=0.3)


def test_a_pair_prints_its_numbers_and_not_where_they_come_from() -> None:
    said = repr(ContactPair("steel", "steel", 0.2))
    assert "name='steel'" in said and "friction=0.2" in said and "source" not in said
