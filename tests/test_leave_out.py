"""What scenes can leave out: builds reach the engines, verdicts follow the figures, kernels hold only their terms."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numba
import numpy as np
import pytest

from contactlaw import MATERIALS, ContactPair, impact, rebound
from contactlaw.kernels import paths
from validation.cases.leave_out import _branches, _largest, _limits, _number
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

pytestmark = pytest.mark.skipif(
    bool(numba.config.DISABLE_JIT), reason="the MuJoCo plugin needs compiled callbacks, and Python's int takes no NaN"
)
STEEL = MATERIALS["steel"]


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
    scene |= {"microseconds": {"median": 100.0}}
    scene["shipped"] |= {"saved": {"part": 0.5}}
    less = ("planar over in space", "mindlin over microslip", "coulomb over mindlin")
    ratios = {what: {"median": 0.5} for what in (*less, "one friction over static friction too")}
    ratios["a substep, microslip, e = 1: branching over one law alone"] = {"median": 1.2}
    times = {kind: {"median": time} for kind, time in (("branching", 0.09), ("one law alone", 0.08))}
    substeps = {f"substep, coulomb, e = 1, {kind}": one for kind, one in times.items()}
    kernels = {"ratios": ratios, "microseconds": substeps}
    data = {"engines": {"pybullet": {"one": scene}}, "grouping": {"mujoco": 1e-9}, "kernels": kernels,
            "entered": {"one": {"steps": {"coulomb": 1000}}}}  # fmt: skip
    assert _branches(data["entered"]["one"], data, "one") == pytest.approx(1000 * 0.01 / (0.5 * 100.0))
    assert [limit.passed for limit in _limits(data)] == [True, *[False] * 3, *[True] * 4, *[False] * 2]


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
    assert spec.plugins[0].config["ledger"] == "true" and "plane" not in spec.plugins[0].config
    assert len(spec.pairs) == 1, "a pair that the engine is to leave out is one that it detects"
    lean = held(superball, "mujoco", Build(planar=True, substeps=50, ledger=False, others=False))
    spec = lean.spec  # type: ignore[attr-defined]
    assert np.array_equal([float(part) for part in spec.plugins[0].config["plane"].split()], [0.0, 1.0, 0.0])
    assert spec.plugins[0].config["substeps"] == "50" and "ledger" not in spec.plugins[0].config
    assert not spec.pairs


@pytest.mark.parametrize("engine", ["mujoco", "pybullet"])
def test_rigid_friction_is_noticed_and_the_plane_is_not(engine: str) -> None:
    """At psi_1 = 1.2 rigid friction stops the puck's contact point, the law reverses it: psi_2 = -0.46 with e = 1."""
    pytest.importorskip(engine)
    puck = subjects()["puck"]
    full, rigid, planar, elastic = (
        puck.results(run(puck, engine, build))
        for build in (FULL, replace(FULL, law="coulomb"), replace(FULL, planar=True), replace(FULL, elastic=True))
    )
    assert rigid[0] == pytest.approx(0.0, abs=1e-9)
    assert full[0] < -0.4
    assert difference(full, planar) == pytest.approx(0.0, abs=1e-12)
    assert elastic[1] == pytest.approx(1.0, abs=1e-3) and full[1] == pytest.approx(0.93, abs=1e-3)


def test_shipped_scenes_are_read_not_assumed() -> None:
    pytest.importorskip("mujoco")
    pytest.importorskip("pybullet")
    puck, cradle = subjects()["puck"], subjects()["cradle"]
    found = shipped(puck, "mujoco")
    assert found.planar and not found.gravity and not found.others and not found.ledger and not found.elastic
    in_line = shipped(cradle, "pybullet")
    assert in_line.elastic and in_line.planar and in_line.law == "coulomb" and in_line.couples == "neighbours"
    assert in_line.left_alone and not in_line.static and not in_line.others
    superball = shipped(subjects()["superball"], "pybullet")
    assert superball.law == "microslip" and superball.planar and not superball.elastic and superball.gravity
    golf = shipped(subjects()["golf"], "pybullet")
    assert golf.fixed_bodies_move and not golf.left_alone, "its heads move"


def test_ingredients_are_those_of_the_scene_and_the_engine() -> None:
    scenes = subjects()
    in_mujoco, in_pybullet = (ingredients_of(scenes["puck"], one) for one in ("mujoco", "pybullet"))
    assert "native contact" in in_mujoco and "pushes from outside" not in in_mujoco and "gravity" not in in_mujoco
    assert "native contact" in in_pybullet and "pushes from outside" in in_pybullet
    assert "other couples" not in in_mujoco
    assert "other couples" in ingredients_of(scenes["cradle"], "mujoco")


def test_planar_contact_does_not_evaluate_the_second_component() -> None:
    """NaN across the line of motion reaches the force of a contact in space, and no other."""
    pair = ContactPair(STEEL, STEEL, 0.115, radius=0.0254)
    approach = np.linspace(0.0, 1e-5, 20)
    motion = np.column_stack([np.linspace(0.0, 1e-6, 20), np.full(20, np.nan)])

    def pull(planar: bool, path: np.ndarray) -> np.ndarray:
        normal, tangential = np.empty(20), np.empty((20, 2))
        p = pair.parameters(plane=(0.0, 0.0, 1.0) if planar else None)
        paths.force_along_path(p, approach, path, pair.history(planar=planar), normal, tangential)
        return tangential[:, 0]

    clean = pull(True, np.nan_to_num(motion))
    assert clean[-1] != 0.0
    np.testing.assert_array_equal(pull(True, motion), clean)
    assert not np.isfinite(pull(False, motion)).all()


def test_history_holds_only_the_terms_of_its_contact() -> None:
    """One number a node in the plane, two in space, none for rigid friction."""

    def size(law: str, planar: bool) -> int:
        return ContactPair(STEEL, STEEL, 0.115, radius=0.0254, law=law).history(planar=planar).size

    header = size("coulomb", True)
    assert size("coulomb", False) == header
    assert [size(law, planar) - header for law in ("mindlin", "microslip") for planar in (True, False)] == [
        1, 2, 16, 32,
    ]  # fmt: skip


def test_rigid_rebound_calls_no_kernel(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise AssertionError("a kernel was called")

    for name in ("rebound_microslip", "rebound_single_spring"):
        monkeypatch.setattr(impact.kernel, name, refuse)
    assert rebound([0.5, 6.0], 1.2, "coulomb") == pytest.approx([0.0, 1.2])
    with pytest.raises(AssertionError, match="a kernel was called"):
        rebound([0.5, 6.0], 1.2, "mindlin")
