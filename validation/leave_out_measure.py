"""For each scene and ingredient: what the result changes by without it, and the time saved."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import partial
from time import perf_counter
from typing import Any

import numpy as np

from contactlaw import LAWS
from sims.puck import ENGINES, Puck
from validation.case import Data
from validation.leave_out_scenes import FULL, RESOLVED, Build, Subject, Trims, difference, held, run, shipped, subjects
from validation.measure import interleaved, spread

INGREDIENTS: dict[str, dict[str, Any]] = {
    "tangential history": {"law": "coulomb"},
    "microslip nodes": {"law": "mindlin"},
    "damping": {"elastic": True},
    "gravity": {"gravity": False},
    "half the substeps": {"substeps": 50},
    "ledger": {"ledger": False},
    "native contact": {"others": False},
    "fixed bodies move": {"fixed_bodies_move": False},
    "pushes from outside": {"left_alone": True},
    "other couples": {"couples": "neighbours"},
}
"""What can be left out, by its name in the table, and the fields of `Build` without it."""
LADDER = list(LAWS)  # from the simplest law on
SUB_CYCLING = "sub-cycling"
ENGINE_OF = {"fixed bodies move": "pybullet", "pushes from outside": "pybullet"}
"""Ingredients that one engine alone has."""
LAW_ERROR = 4e-4
"""Largest error in psi_2 of an impact by the law, chi 0.5 to 2 (`law_accuracy`), rounded up."""
ALLOWED = 0.25 * LAW_ERROR
"""Change of psi_2, or of a velocity over a typical one, up to which an ingredient is one that a scene has no use for.

What is left out changes the law's error e to e + c at most, and to sqrt(e^2 + c^2) where both have nothing to do with
each other. With c = e/4 that is 3 % more, a quarter at worst: no figure of the scene means anything else than before.
What changes more, fewer substeps say, is accuracy given away.
"""
WORTH = 0.02
"""Part of the time from which a saving counts, where two runs of the same build do not differ by more themselves."""
FEWEST, MOST = 8, 30  # rounds
LONGEST = {"mujoco": 600_000, "pybullet": 200_000}
"""Steps of a resolved run that is made; a longer one is not."""
OUT, NEEDED, NOTHING, NOT_THERE = "can be left out", "needed", "saves nothing", "not there"


def ingredients_of(subject: Subject, engine: str) -> list[str]:
    """Those that there are in a scene; the puck's gravity comes with its table and is measured apart."""
    out = []
    for what in INGREDIENTS:
        if ENGINE_OF.get(what, engine) != engine:
            continue
        if what == "gravity" and subject.weightless:
            continue
        if what == "other couples" and not subject.row:
            continue
        out.append(what)
    return out


def verdict(change: float | None, saved: dict[str, float], noise: float = 0.0) -> str:
    """What to do with an ingredient.

    Args:
        change: Of the scene's result; None: another motion.
        saved: As `saving` has it.
        noise: The largest part by which two runs of the same build seem to differ.
    """
    if change is None or change > ALLOWED:
        return NEEDED
    return OUT if saved["part"] >= max(WORTH, 2.0 * noise) and saved["low"] > 0.0 else NOTHING


def saving(lean: np.ndarray, usual: np.ndarray) -> dict[str, float]:
    """Part of the time saved, from the quiet rounds: what disturbs a run on a shared machine only ever adds to it.

    Args:
        lean: Seconds of the rounds without an ingredient.
        usual: With it.

    Returns:
        part: From the lower quartiles of both; low, high: the least and the most of even rounds and odd ones alone.
    """
    part, *halves = (
        float(1.0 - np.percentile(lean[rounds], 25) / np.percentile(usual[rounds], 25))
        for rounds in (slice(None), slice(0, None, 2), slice(1, None, 2))
    )
    return {"part": part, "low": min(part, *halves), "high": max(part, *halves)}


def without(whats: Iterable[str]) -> Build:
    """A build that leaves out several; of two laws the one that comes first in `INGREDIENTS`."""
    changes: dict[str, Any] = {}
    for what in whats:
        changes = {**INGREDIENTS[what], **changes}
    return replace(FULL, **changes)


def left_out_by(build: Build, whats: Iterable[str]) -> list[str]:
    """Which of these ingredients a build has not; a law without history has no nodes either."""

    def has_not(key: str, value: Any) -> bool:
        own = getattr(build, key)
        if key == "law":
            return max(LADDER.index(law) for law in own.split(" and ")) <= LADDER.index(value)
        return own == value

    return [what for what in whats if all(has_not(key, value) for key, value in INGREDIENTS[what].items())]


def judge(subject: Subject, engine: str, budget: float) -> Data:
    """One scene in one engine: a cell for each ingredient, all that can be left out together, and the scene as shipped.

    What the scene as shipped could still leave out is timed against it as it is, since savings do not add up.

    Args:
        subject: The scene.
        engine: "mujoco" or "pybullet".
        budget: Time to spend on interleaved rounds [s].
    """
    whats = ingredients_of(subject, engine)
    full = subject.results(run(subject, engine, FULL))
    changes = {what: difference(full, subject.results(run(subject, engine, without([what])))) for what in whats}
    spared = [what for what in whats if (change := changes[what]) is not None and change <= ALLOWED]
    as_shipped = shipped(subject, engine)
    builds = {"full": FULL} | {what: without([what]) for what in whats}
    builds |= {"together": without(spared), "shipped": as_shipped, "full again": FULL}
    lean = left_out_by(as_shipped, [*whats, "gravity"] if subject.weightless else whats)
    still = [what for what in spared if what not in lean]
    builds |= {f"shipped, without {what}": replace(as_shipped, **INGREDIENTS[what]) for what in still}
    seconds = timed(subject, engine, builds, budget)
    usual = np.concatenate([seconds["full"], seconds["full again"]])
    null = saving(seconds["full again"], seconds["full"])
    noise = max(abs(null["low"]), abs(null["high"]))
    saved = {what: saving(seconds[what], usual) for what in builds}
    cells = {
        what: {"change": changes[what], "saved": saved[what], "verdict": verdict(changes[what], saved[what], noise)}
        for what in whats
    }
    leaner = {what: saving(seconds[f"shipped, without {what}"], seconds["shipped"]) for what in still}
    return {
        "result": full,
        "microseconds": spread(1e6 * usual),
        "noise": noise,
        "rounds": seconds["full"].size,
        "cells": cells,
        "together": {
            "whats": spared, "saved": saved["together"],
            "change": difference(full, subject.results(run(subject, engine, builds["together"]))),
        },
        "shipped": {
            "left_out": lean, "saved": saved["shipped"],
            "change": difference(full, subject.results(run(subject, engine, as_shipped))),
            "still_in": {
                what: one for what, one in leaner.items() if verdict(changes[what], one, noise) == OUT
            },
        },
    }  # fmt: skip


def timed(subject: Subject, engine: str, builds: dict[str, Build], budget: float) -> dict[str, np.ndarray]:
    """Seconds of all steps of a scene with each build, side by side; every run starts from a world newly built.

    As many rounds as a time [s] allows, within `FEWEST` and `MOST`.
    """
    worlds: dict[str, Trims] = {}

    def prepare(what: str) -> None:
        if what in worlds:
            worlds.pop(what).close()
        worlds[what] = held(subject, engine, builds[what])

    runs: dict[str, Callable[[], object]] = {what: partial(_go, worlds, what) for what in builds}
    before = {what: partial(prepare, what) for what in builds}
    begin = perf_counter()
    for what in builds:
        before[what]()
        runs[what]()
    repeats = int(np.clip(budget / (perf_counter() - begin), FEWEST, MOST))
    try:
        return interleaved(runs, repeats, before)
    finally:
        for world in worlds.values():
            world.close()


def _go(worlds: dict[str, Trims], what: str) -> None:
    worlds[what].go()


def sub_cycling(subject: Subject, engine: str) -> Data | None:
    """The scene with steps of a 200th of its contact; None where that would be too many.

    Returns:
        change, and times: how many times longer the run takes.
    """
    world = held(subject, engine, FULL)
    world.close()
    step = world.contact_time / RESOLVED
    if world.steps * world.timestep / step > LONGEST[engine]:
        return None
    coarse = [run(subject, engine, FULL) for _ in range(5)]
    fine = run(subject, engine, FULL, timestep=step)
    usual = float(np.median([one.facts["wall_time"] for one in coarse]))
    return {"change": difference(subject.results(coarse[0]), subject.results(fine)),
            "times": fine.facts["wall_time"] / usual, "verdict": NEEDED}  # fmt: skip


def table_of_puck(engine: str, repeats: int) -> Data:
    """`sims.puck` with gravity and its air table against without, at steps of a 200th of the contact."""
    simulate = importlib.import_module(ENGINES[engine]).simulate
    pucks = [Puck(table=True), Puck(table=False)]
    results, times = [], np.empty((repeats, 2))
    for number in range(-2, repeats):
        order = (0, 1) if number % 2 else (1, 0)
        outcomes = {which: simulate(pucks[which]) for which in order}
        times[max(number, 0)] = [outcomes[0].wall_time, outcomes[1].wall_time]
        results = [[puck.psi(outcomes[i].velocity, outcomes[i].spin), float(outcomes[i].velocity @ puck.normal)]
                   for i, puck in enumerate(pucks)]  # fmt: skip
    saved = saving(times[:, 1], times[:, 0])
    change = difference(*results)
    return {"change": change, "saved": saved, "verdict": verdict(change, saved)}


def grouping(engine: str) -> float | None:
    """Change of the cradle's velocities where every couple is added by a call of its own."""
    cradle = subjects()["cradle"]
    one, two = (run(cradle, engine, replace(FULL, couples=how)) for how in ("all", "all, a call each"))
    return difference(cradle.results(one), cradle.results(two))
