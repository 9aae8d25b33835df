"""What scenes can leave out: builds reach the engines, verdicts follow the figures, kernels hold only their terms."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numba
import numpy as np
import pytest

from contactlaw import rebound
from validation.cases.leave_out import _largest, _limits, _number
from validation.leave_out_measure import (
    ALLOWED,
    INGREDIENTS,
    LAW_ERROR,
    NEEDED,
    NOTHING,
    OUT,
    ingredients_of,
    left_out_by,
    saving,
    verdict,
    without,
)
from validation.leave_out_scenes import FULL, Build, difference, held, run, shipped, subjects

pytestmark = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="the MuJoCo plugin needs compiled callbacks")


def part(value: float, low: float) -> dict[str, float]:
    return {"part": value, "low": low, "high": 2.0 * value - low}


@pytest.mark.parametrize(
    ("change", "saved", "noise", "expected"),
    [
        (ALLOWED, part(0.1, 0.05), 0.0, OUT),
        (1.01 * ALLOWED, part(0.9, 0.8), 0.0, NEEDED),
        (None, part(0.9, 0.8), 0.0, NEEDED),
        (0.0, part(0.01, 0.005), 0.0, NOTHING),
        (0.0, part(0.1, -0.01), 0.0, NOTHING),
        (0.0, part(0.1, 0.05), 0.06, NOTHING),
        (0.0, part(-0.1, -0.2), 0.0, NOTHING),
    ],
)
def test_verdict_follows_change_and_saving(change, saved, noise, expected) -> None:
    assert verdict(change, saved, noise) == expected


def test_saving_is_read_from_the_quiet_rounds() -> None:
    usual, lean = np.full(9, 2.0), np.full(9, 1.0)
    lean[2:5] = 50.0
    assert saving(lean, usual) == {"part": 0.5, "low": 0.5, "high": 0.5}
    lean[[0, 6]] = 1.8  # four of five even rounds are slow
    assert saving(lean, usual)["low"] == pytest.approx(0.1)


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
    build = without(["tangential history", "microslip nodes", "ledger"])
    assert build == replace(FULL, law="coulomb", ledger=False)
    assert left_out_by(build, INGREDIENTS) == ["tangential history", "microslip nodes", "ledger"]
    assert left_out_by(replace(FULL, law="mindlin"), INGREDIENTS) == ["microslip nodes"]
    assert left_out_by(FULL, INGREDIENTS) == []


def test_a_limit_is_missed_where_shipped_scenes_leave_out_too_much() -> None:
    """The limits are not true by their making."""
    scene = {"cells": {}, "together": {"change": 2e-3}, "shipped": {"change": None}}
    data = {"engines": {"pybullet": {"one": scene}}, "grouping": {"mujoco": 1e-9}}
    assert [limit.passed for limit in _limits(data)] == [True, *[False] * 3]


def test_what_may_change_is_below_the_error_of_the_law() -> None:
    """The bound follows the error of the default law as it is, here of a steel puck and at the largest chi."""
    from validation.reference.annulus import rebound_extrapolated

    psi_1, worst = np.linspace(0.2, 4.6, 12), 0.0
    for chi in (1.256, 2.0):
        exact = [rebound_extrapolated(float(psi), chi)[0] for psi in psi_1]
        worst = max(worst, float(np.abs(rebound(psi_1, chi) - exact).max()))
    assert 0.5 * LAW_ERROR <= worst <= LAW_ERROR
    assert ALLOWED == LAW_ERROR / 4


def test_build_reaches_mujoco() -> None:
    pytest.importorskip("mujoco")
    superball = subjects()["superball"]
    full = held(superball, "mujoco", FULL)
    spec: Any = full.spec  # type: ignore[attr-defined]
    assert spec.plugins[0].config["ledger"] == "true"
    assert len(spec.pairs) == 1, "a pair that the engine is to leave out is one that it detects"
    lean = held(superball, "mujoco", Build(substeps=50, ledger=False, others=False))
    spec = lean.spec  # type: ignore[attr-defined]
    assert spec.plugins[0].config["substeps"] == "50" and "ledger" not in spec.plugins[0].config
    assert not spec.pairs


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


def test_shipped_scenes_are_read_not_assumed() -> None:
    pytest.importorskip("mujoco")
    pytest.importorskip("pybullet")
    puck, cradle = subjects()["puck"], subjects()["cradle"]
    found = shipped(puck, "mujoco")
    assert not found.gravity and not found.others and not found.ledger and not found.elastic
    in_line = shipped(cradle, "pybullet")
    assert in_line.elastic and in_line.law == "coulomb" and in_line.couples == "neighbours"
    assert in_line.left_alone and not in_line.others
    superball = shipped(subjects()["superball"], "pybullet")
    assert superball.law == "microslip" and not superball.elastic and superball.gravity
    golf = shipped(subjects()["golf"], "pybullet")
    assert golf.fixed_bodies_move and not golf.left_alone, "its heads move"


def test_ingredients_are_those_of_the_scene_and_the_engine() -> None:
    scenes = subjects()
    in_mujoco, in_pybullet = (ingredients_of(scenes["puck"], one) for one in ("mujoco", "pybullet"))
    assert "native contact" in in_mujoco and "pushes from outside" not in in_mujoco and "gravity" not in in_mujoco
    assert "native contact" in in_pybullet and "pushes from outside" in in_pybullet
    assert "other couples" not in in_mujoco
    assert "other couples" in ingredients_of(scenes["cradle"], "mujoco")
