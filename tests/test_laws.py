"""The ladder as a registry."""

from __future__ import annotations

import pytest

from contactlaw import LAWS, MATERIALS, ContactPair, Law, rebound
from contactlaw.kernels import contact
from contactlaw.laws import law_of
from contactlaw.laws.microslip import Microslip


def test_registry_holds_the_ladder_in_order() -> None:
    assert list(LAWS) == ["coulomb", "linear_spring", "mindlin", "mindlin_rescaled", "microslip"]
    assert [law.code for law in LAWS.values()] == list(range(len(LAWS)))
    assert all(law.name == name for name, law in LAWS.items())
    assert [cls() for cls in Law.__subclasses__()] == list(LAWS.values())


@pytest.mark.parametrize("name", LAWS)
def test_every_law_names_its_source_and_has_room_for_its_memory(name: str) -> None:
    law = LAWS[name]
    assert len(law.source) > 20
    steel = MATERIALS["steel"]
    pair = ContactPair(steel, steel, 0.1, radius=0.01, law=name)
    assert pair.law is law
    assert pair.parameters().size == contact.PARAMETERS + 2 * law.nodes
    assert pair.history(planar=True).size == contact.HEADER + law.nodes
    assert pair.history().size == contact.HEADER + 2 * law.nodes
    assert not pair.history().any()
    with_static = ContactPair(steel, steel, 0.1, radius=0.01, law=name, static_friction=0.2)
    assert with_static.history().size == contact.HEADER + 3 * law.nodes


@pytest.mark.parametrize("name", LAWS)
def test_a_law_and_its_name_mean_the_same(name: str) -> None:
    assert law_of(name) is law_of(LAWS[name])
    assert rebound(0.7, 1.2, law=name) == rebound(0.7, 1.2, law=LAWS[name])


@pytest.mark.parametrize(("wrong", "meant"), [("microslp", "microslip"), ("Mindlin", "mindlin"), ("colomb", "coulomb")])
def test_unknown_law_offers_the_nearest_name(wrong: str, meant: str) -> None:
    with pytest.raises(ValueError, match=f"law = {wrong!r}.*did you mean {meant!r}"):
        law_of(wrong)


@pytest.mark.parametrize("wrong", [None, 4, Microslip, ["microslip"]])
def test_things_that_are_no_law_are_refused(wrong: object) -> None:
    with pytest.raises(ValueError, match=r"law = .*must be one of coulomb"):
        law_of(wrong)  # type: ignore[arg-type]


@pytest.mark.parametrize("count", [1, 0, -3, 513, 8.0, "8"])
def test_bad_node_counts_are_refused(count: object) -> None:
    with pytest.raises(ValueError, match=r"node_count = .*from 2 to 512"):
        Microslip(count)  # type: ignore[arg-type]


def test_node_count_reaches_the_kernels() -> None:
    steel = MATERIALS["steel"]
    p = ContactPair(steel, steel, 0.1, radius=0.01, law=Microslip(5)).parameters()
    assert p[contact.NODES] == 5
    nodes, weights = p[contact.PARAMETERS : contact.PARAMETERS + 5], p[contact.PARAMETERS + 5 :]
    assert weights.sum() == pytest.approx(1.0, rel=1e-14)
    for power in range(10):  # Gauss-Legendre: exact to degree 2n - 1
        assert (weights * nodes**power).sum() == pytest.approx(1.0 / (power + 1), rel=1e-13)
