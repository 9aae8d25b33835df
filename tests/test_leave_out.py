"""What scenes can leave out: builds reach the engines, verdicts follow the figures, kernels hold only their terms."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numba
import numpy as np
import pytest

from contactlaw import rebound
from sims.scene import find_scenes
from sims.worlds import World
from validation import leave_out_scenes
from validation.cases.leave_out import ALLOWED, LAW_ERROR, _largest, _limits, _number, can_go, ingredients_of, without
from validation.leave_out_scenes import FULL, SHIPPED, Build, difference, run, subjects

pytestmark = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="the MuJoCo plugin needs compiled callbacks")


def test_what_is_not_felt_can_go() -> None:
    assert can_go(0.0) and can_go(ALLOWED)
    assert not can_go(1.01 * ALLOWED) and not can_go(None)


def test_another_motion_is_no_number() -> None:
    assert difference([1.0, 2.0], [1.0, 2.5]) == 0.5
    assert difference([1.0], []) is None
    assert difference([], []) is None
    assert difference([1.0], [math.nan]) is None
    assert (
        _number(None) == "other" and _number(0.0) == "0" and _number(3.2e-6) == "3e-6" and _number(1.13e-3) == "1.1e-3"
    )
    assert _largest([0.1, None]) == math.inf


def test_together_leaves_out_each_and_the_simplest_law() -> None:
    build = without(["tangential history", "microslip nodes", "damping"])
    assert build == replace(FULL, law="coulomb", elastic=True)


def test_a_limit_is_missed_where_shipped_scenes_leave_out_too_much() -> None:
    """The limits are not true by their making."""
    scene = {"cells": {"together": {"change": 2e-3}, "shipped": {"change": None}}}
    data = {"engines": {"pybullet": {"one": scene}}}
    assert [limit.passed for limit in _limits(data)] == [True, False, False]


def test_what_may_change_is_below_the_error_of_the_law() -> None:
    """The bound follows the error of the default law as it is, here of a steel puck and at the largest chi."""
    from validation.reference.annulus import rebound_extrapolated

    psi_1, worst = np.linspace(0.2, 4.6, 12), 0.0
    for chi in (1.256, 2.0):
        exact = [rebound_extrapolated(float(psi), chi)[0] for psi in psi_1]
        worst = max(worst, float(np.abs(rebound(psi_1, chi) - exact).max()))
    assert 0.5 * LAW_ERROR <= worst <= LAW_ERROR
    assert ALLOWED == LAW_ERROR / 4


@pytest.mark.parametrize("engine", ["mujoco", "pybullet"])
def test_a_build_reaches_the_world(engine: str, monkeypatch) -> None:
    pytest.importorskip(engine)
    made: list[World] = []

    def new_world(*told: Any) -> World:
        made.append(real(*told))
        return made[-1]

    real = leave_out_scenes.new_world
    monkeypatch.setattr(leave_out_scenes, "new_world", new_world)
    superball = subjects()["superball"]
    for build in (Build(substeps=50, collide=False, gravity=False), SHIPPED):
        run(superball, engine, build)
    lean, shipped = made
    assert (lean.tuning.substeps, lean.tuning.collide, lean.law) == (50, False, "microslip")
    assert not lean.gravity.any() and shipped.gravity.any() and shipped.tuning.fixed_bodies_move is None


@pytest.mark.parametrize("engine", ["mujoco", "pybullet"])
def test_rigid_friction_and_the_damper_are_noticed(engine: str) -> None:
    """At psi_1 = 1.2 rigid friction stops the puck's contact point, the law reverses it: psi_2 = -0.46 with e = 1."""
    pytest.importorskip(engine)
    puck = subjects()["puck"]
    full, rigid, elastic = (
        puck.results(run(puck, engine, build))
        for build in (FULL, replace(FULL, law="coulomb"), replace(FULL, elastic=True))
    )
    assert rigid[0] == pytest.approx(0.0, abs=1e-9)
    assert full[0] < -0.4
    assert elastic[1] == pytest.approx(1.0, abs=1e-3) and full[1] == pytest.approx(0.93, abs=1e-3)


def test_a_shipped_scene_is_the_scene() -> None:
    pytest.importorskip("pybullet")
    from sims.scene import Settings

    for name in ("cradle", "superball"):
        subject = subjects()[name]
        built, own = run(subject, "pybullet", SHIPPED), find_scenes()[name].run(Settings("pybullet"))
        assert built.facts["law"] == own.facts["law"] == ("coulomb" if name == "cradle" else "microslip")
        assert difference(subject.results(built), subject.results(own)) == pytest.approx(0.0, abs=1e-6)


def test_ingredients_are_those_of_the_scene_and_the_engine() -> None:
    scenes = subjects()
    in_mujoco, in_pybullet = (ingredients_of(scenes["puck"], one) for one in ("mujoco", "pybullet"))
    assert "native contact" in in_mujoco and "pushes from outside" not in in_mujoco and "gravity" not in in_mujoco
    assert "native contact" in in_pybullet and "pushes from outside" in in_pybullet
    assert "other couples" not in in_mujoco
    assert "other couples" in ingredients_of(scenes["cradle"], "mujoco")
