"""A scene's kernel runs only its terms: what is entered with the compiler off, and what the terms read and hold."""

from __future__ import annotations

import math

import numba
import numpy as np
import pytest

from contactlaw import MATERIALS, ContactPair
from contactlaw.kernels import contact
from validation.leave_out_branches import ALONE, BRANCHING, TIMED, contact_for, kernels_of
from validation.leave_out_entered import FAR, Entered, entered, far, seen

STEEL = MATERIALS["steel"]
UP = (0.0, 0.0, 1.0)
NODES = {"microslip.microslip_on_line", "microslip.microslip_in_plane", "microslip.spread", "microslip.regrid"}
TANGENTIAL = NODES | {"contact.microslip", "contact.single_spring", "contact.slides_on", "contact.respan"}


@pytest.fixture(scope="module")
def scenes() -> dict[str, Entered]:
    pytest.importorskip("pybullet")
    return seen([FAR, "puck", "superball", "golf", "cradle", "rolling, incline", "billiards"])


@pytest.mark.parametrize("name", ["cradle", "rolling, incline"])
def test_rigid_friction_enters_neither_nodes_nor_springs_and_remembers_nothing(scenes, name) -> None:
    assert scenes[name]["steps"]["coulomb"] == scenes[name]["calls"]["contact.step"] > 100
    assert not TANGENTIAL & set(scenes[name]["calls"])
    assert scenes[name]["histories"] == {"coulomb": 0}


def test_scenes_with_history_do_enter_them(scenes) -> None:
    """What the others are without is seen where it is."""
    assert scenes["puck"]["calls"]["microslip.microslip_on_line"] > 50
    assert scenes["billiards"]["calls"]["microslip.microslip_in_plane"] > 50
    assert scenes["billiards"]["calls"]["contact.single_spring"] > 1000


def test_elastic_contact_never_evaluates_the_damper(scenes) -> None:
    cradle, puck = scenes["cradle"], scenes["puck"]
    assert cradle["damper"] == 0 and cradle["calls"]["contact.normal_force"] > 100
    assert puck["damper"] == puck["calls"]["contact.normal_force"] > 50


@pytest.mark.parametrize("name", ["puck", "superball", "golf"])
def test_motion_in_a_plane_has_half_the_tractions(scenes, name) -> None:
    assert "microslip.microslip_in_plane" not in scenes[name]["calls"]
    assert scenes[name]["histories"] == {"microslip": 16}
    assert scenes["billiards"]["histories"]["microslip"] == 2 * 16


def test_no_pair_near_enters_neither_contact_nor_march(scenes) -> None:
    calls = scenes[FAR]["calls"]
    assert calls["meeting.near_pairs"] > 0, "it is looked at"
    assert {name.split(".")[0] for name in calls}.isdisjoint({"contact", "microslip", "intervals", "cutting", "rest"})
    assert not {"meeting.meet", "scene.describe", "coupling.couple", "subcycle.substep"} & set(calls)
    assert scenes["puck"]["calls"]["coupling.couple"] > 0
    assert scenes["puck"]["calls"]["coupling.couple"] < scenes["puck"]["calls"]["meeting.near_pairs"] / 10


def test_what_is_compiled_is_not_said_to_be_seen() -> None:
    if numba.config.DISABLE_JIT:
        pytest.importorskip("pybullet")
        assert entered(lambda: contact.hertz_stiffness(np.ones(contact.PARAMETERS)))["calls"] == {}, "no world steps"
        assert entered(far)["calls"]["meeting.near_pairs"] > 0
    else:
        with pytest.raises(RuntimeError, match="NUMBA_DISABLE_JIT"):
            entered(lambda: None)


def force(pair: ContactPair, closing: float = 0.1, dv: float = 0.0, planar: bool = True) -> tuple[float, ...]:
    """Of a contact that has just closed and is 1 um deep."""
    p, history = pair.parameters(plane=UP if planar else None), pair.history(planar=planar)
    contact.touch(p, history, -1e-7, 0.1, 1.0, 0.3)
    history[contact.PHASE] = contact.SPRUNG
    ratio = contact.normal_force(p, history, 1e-6, closing, closing, 1e-7)
    return (*ratio, *contact.friction(p, history, 1e-6, 9e-7, 1e-8, dv, 1.0, 1.0, 1.0))


def pair_with(restitution: float = 1.0, static: float | None = None, law: str = "microslip") -> ContactPair:
    return ContactPair(STEEL, STEEL, 0.115, restitution, radius=0.0254, law=law, static_friction=static)


def test_elastic_contact_does_not_read_the_closing_speed() -> None:
    """NaN as speed and acceleration reaches the damped force, and no other."""
    assert force(pair_with(1.0), math.nan) == force(pair_with(1.0))
    assert force(pair_with(1.0))[0] > 0.0
    assert math.isnan(force(pair_with(0.93), math.nan)[0])


@pytest.mark.parametrize("law", ["coulomb", "mindlin", "microslip"])
def test_planar_contact_does_not_read_the_second_displacement(law: str) -> None:
    pair = pair_with(law=law)
    assert force(pair, dv=math.nan) == force(pair)
    assert force(pair)[2] > 0.0
    assert force(pair, planar=False, dv=1e-8)[3] > 0.0


def test_flags_are_held_for_static_friction_alone() -> None:
    for law, nodes in (("coulomb", 0), ("mindlin", 1), ("microslip", 16)):
        plain, equal, sticky = (pair_with(static=static, law=law).history(planar=True).size - contact.HEADER
                                for static in (None, 0.115, 0.2))  # fmt: skip
        assert (plain, equal, sticky) == (nodes, nodes, 2 * nodes)


@pytest.mark.parametrize("name", TIMED)
def test_kernel_compiled_for_one_law_gives_the_same_forces(name: str) -> None:
    forces = {kind: call().copy() for kind, call in kernels_of(*TIMED[name], impacts=1).items()}
    np.testing.assert_array_equal(forces[ALONE], forces[BRANCHING])
    assert np.ptp(forces[ALONE][:, 1]) > 1.0, "it swings back"


def test_kernel_for_one_law_holds_its_constants() -> None:
    """With another law's code as constant it is that law, whatever its parameters say."""
    spring = contact_for({"LAW": f"{contact.MINDLIN:.1f}"})
    pair = pair_with()
    p, history = pair.parameters(plane=UP), pair.history(planar=True)
    contact.touch(p, history, 0.0, 0.1, 1.0, 0.3)
    pull, _ = spring.friction(p, history, 1e-6, 0.0, 1e-8, 0.0, 1.0, 1.0, 1.0)
    stiffness = 4.0 / 3.0 * pair.effective_shear_modulus * math.sqrt(0.0254 * 1e-6)  # 2 G* a averaged from 0
    assert pull == pytest.approx(stiffness * 1e-8)
    with pytest.raises(ValueError, match="name = 'LAWS'"):
        contact_for({"LAWS": "0.0"})
