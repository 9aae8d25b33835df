"""A scene runs its own laws and terms and no others: what is entered with the compiler off, and what terms read."""

from __future__ import annotations

import math

import numba
import numpy as np
import pytest

from contactlaw import LAWS, MATERIALS, ContactPair
from contactlaw.laws import hertz
from contactlaw.laws.record import contact_of, pair_of
from validation.leave_out_entered import FAR, Entered, entered, far, seen
from validation.leave_out_kernels import FRICTION, impacts_of

STEEL = MATERIALS["steel"]


@pytest.fixture(scope="module")
def scenes() -> dict[str, Entered]:
    pytest.importorskip("pybullet")
    return seen([FAR, "puck", "superball", "golf", "cradle", "rolling, incline", "billiards"])


@pytest.mark.parametrize(
    ("name", "laws"),
    [
        ("cradle", {"coulomb"}),
        ("rolling, incline", {"coulomb"}),
        ("puck", {"microslip"}),
        ("superball", {"microslip"}),
        ("golf", {"microslip"}),
        ("billiards", {"mindlin", "microslip"}),
    ],
)
def test_a_scene_enters_its_own_laws_and_no_other(scenes, name, laws) -> None:
    calls = scenes[name]["calls"]
    assert set(scenes[name]["laws"]) == laws
    assert sum(scenes[name]["laws"].values()) == calls["record.ask_force"] > 50
    assert ("microslip.displace" in calls) == ("microslip" in laws)
    assert ("single_spring.spring_force" in calls) == ("mindlin" in laws)


def test_elastic_contact_never_evaluates_the_damper(scenes) -> None:
    cradle, puck = scenes["cradle"], scenes["puck"]
    assert cradle["damper"] == 0 and cradle["calls"]["hertz.normal_force"] > 100
    assert puck["damper"] == puck["calls"]["hertz.normal_force"] > 50


def test_no_pair_near_enters_neither_law_nor_march(scenes) -> None:
    calls = scenes[FAR]["calls"]
    assert calls["meeting.near_pairs"] > 0, "it is looked at"
    assert not scenes[FAR]["laws"]
    assert {name.split(".")[0] for name in calls}.isdisjoint({"contact", "step", "intervals", "cutting", "rest"})
    assert not {"meeting.meet", "scene.describe", "coupling.couple", "subcycle.substep"} & set(calls)
    assert scenes["puck"]["calls"]["coupling.couple"] > 0
    assert scenes["puck"]["calls"]["coupling.couple"] < scenes["puck"]["calls"]["meeting.near_pairs"] / 10


def test_what_is_compiled_is_not_said_to_be_seen() -> None:
    if numba.config.DISABLE_JIT:
        pytest.importorskip("pybullet")
        assert entered(impacts_of("microslip"))["calls"] == {}, "no world steps"
        assert entered(far)["calls"]["meeting.near_pairs"] > 0
    else:
        with pytest.raises(RuntimeError, match="NUMBA_DISABLE_JIT"):
            entered(lambda: None)


def test_elastic_contact_does_not_read_the_closing_speed() -> None:
    """NaN as speed reaches the damped force, and no other."""

    def force(restitution: float, closing: float) -> float:
        pair = ContactPair(STEEL, STEEL, FRICTION, restitution, radius=0.0254)
        contact = contact_of(pair.rule.with_nodes(None).new_contact()[0])
        contact.overlap, contact.mass, contact.stiffness, contact.closing = 1e-6, 1.0, 1e10, closing
        return hertz.normal_force(contact, pair_of(pair.parameters()), 0.0, 1e-7)[0]

    assert force(1.0, math.nan) == force(1.0, 0.1) > 0.0
    assert math.isnan(force(0.93, math.nan)) and force(0.93, 0.1) > force(1.0, 0.1)


@pytest.mark.parametrize("law", LAWS)
def test_the_substeps_that_are_timed_are_those_of_an_impact_that_swings_back(law: str) -> None:
    normal, pull = impacts_of(law, impacts=2)().T
    once = impacts_of(law, impacts=1)()[:, 1]
    np.testing.assert_array_equal(pull, once)
    assert np.abs(pull).max() > 1.0 and pull.min() < 0.0 < pull.max()
    assert (np.abs(pull) <= FRICTION * normal * (1.0 + 1e-12)).all()
