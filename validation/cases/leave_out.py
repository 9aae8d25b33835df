"""Which ingredients of the law each scene can do without, what that changes and what it saves."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sims.panel import ENGINE_NAMES
from validation.case import Case, Data, Limit, Outcome, Progress, Table, register
from validation.leave_out_scenes import FULL, INGREDIENTS, SHIPPED, Build, Subject, difference, run, subjects
from validation.measure import spread

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

QUICK = {"mujoco": ("puck", "superball", "cradle"), "pybullet": ("table tennis",)}
BUDGET, QUICK_BUDGET = 1.4, 0.1  # for the rounds of a scene [s]
FEWEST, MOST = 8, 30  # rounds
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
OUT, NEEDED, NOTHING = "can be left out", "needed", "saves nothing"
LIGHT, DARK = -7.0, 0.5  # decimal logarithms of the changes that are drawn lightest and darkest


def ingredients_of(subject: Subject, engine: str) -> list[str]:
    """Those that there are in a scene and an engine."""
    absent = {"gravity": bool(subject.weightless), "pushes from outside": engine != "pybullet",
              "other couples": not subject.row}  # fmt: skip
    return [what for what in INGREDIENTS if not absent.get(what)]


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


def saving(lean: Array, usual: Array) -> dict[str, float]:
    """Part of the time saved, from the quiet rounds: what disturbs a run on a shared machine only ever adds to it.

    Args:
        lean, usual: Seconds of the rounds without an ingredient and with it.

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


def judge(subject: Subject, engine: str, budget: float) -> Data:
    """One scene in one engine: a cell for each ingredient, all that can be left out together, and the scene as shipped.

    Args:
        subject: The scene.
        engine: "mujoco" or "pybullet".
        budget: Time to spend on rounds, in which every build runs once [s].
    """
    whats = ingredients_of(subject, engine)
    builds = {"full": FULL, "full again": FULL, "shipped": SHIPPED} | {what: without([what]) for what in whats}
    begin = perf_counter()
    results = {what: subject.results(run(subject, engine, build)) for what, build in builds.items()}
    changes = {what: difference(results["full"], found) for what, found in results.items()}
    spared = [what for what in whats if (change := changes[what]) is not None and change <= ALLOWED]
    builds["together"] = without(spared)
    changes["together"] = difference(results["full"], subject.results(run(subject, engine, builds["together"])))
    rounds = int(np.clip(budget / (perf_counter() - begin), FEWEST, MOST))
    seconds = {what: np.empty(rounds) for what in builds}
    for number in range(rounds):
        for what in list(builds)[:: -1 if number % 2 else 1]:
            seconds[what][number] = run(subject, engine, builds[what]).facts["wall_time"]
    null = saving(seconds["full again"], seconds["full"])
    noise = max(abs(null["low"]), abs(null["high"]))
    cells = {}
    for what in [*whats, "together", "shipped"]:
        saved = saving(seconds[what], np.concatenate([seconds["full"], seconds["full again"]]))
        cells[what] = {"change": changes[what], "saved": saved, "verdict": verdict(changes[what], saved, noise)}
    return {"result": results["full"], "microseconds": spread(1e6 * seconds["full"]), "noise": noise, "cells": cells,
            "whats": spared, "laws": run(subject, engine, SHIPPED).facts["law"]}  # fmt: skip


def grouping(engine: str) -> float | None:
    """Change of the cradle's velocities where every couple is added by a call of its own."""
    cradle = subjects()["cradle"]
    one, two = (run(cradle, engine, replace(FULL, couples=how)) for how in ("all", "all, a call each"))
    return difference(cradle.results(one), cradle.results(two))


@register
class LeaveOut(Case):
    """Scene by ingredient: change, time saved, verdict."""

    name = "leave_out"
    place = 96
    title = "What each scene can leave out"
    claim = (
        "Each scene is built with every ingredient of the law, then with one left out: what its result (psi_2, or a "
        "velocity after over one before, the largest change) changes by, and the part of the time that is saved. What "
        "changes it by at most 1e-4, a quarter of the law's own error, is what the scene has no use for, and can be "
        "left out; that must also hold of all such ingredients together, and of what the scenes as shipped leave out. "
        "Fewer substeps are accuracy given away, and change more. A saving counts from 2 % on, and where it is twice "
        "what two runs of the same build differ by. The paddle, a body with a joint, is built by hand and not varied."
    )
    caption = (
        "Change of a scene's result without an ingredient (above; 'other': another motion altogether) and the time "
        "saved without it (below). Darker: larger change. Framed: can be left out, and saves time. Native contact: the "
        "engine's own between the same bodies, detected to be left out."
    )
    needs = ("mujoco", "pybullet", "scipy")

    def run(self, quick: bool, progress: Progress) -> Outcome:
        """Scene after scene."""
        data: Data = {"engines": {}, "grouping": {}}
        known = subjects()
        names = {engine: QUICK[engine] if quick else tuple(known) for engine in ENGINE_NAMES}
        done, total = 0, sum(len(some) for some in names.values())
        for engine, some in names.items():
            data["engines"][engine] = {}
            for name in some:
                data["engines"][engine][name] = judge(known[name], engine, QUICK_BUDGET if quick else BUDGET)
                done += 1
                progress(done / total)
            data["grouping"][engine] = grouping(engine)
        problems = [
            f"{name} in {engine}: result {found['result']}"
            for engine, scenes in data["engines"].items()
            for name, found in scenes.items()
            if not found["result"] or not np.isfinite(found["result"]).all()
        ]
        return Outcome(_limits(data), data, problems)

    def table(self, data: Data) -> Table:
        """A row for each scene and engine."""
        table = Table(["scene", "with everything [ms]", "can be left out", "saves nothing", "needed",
                       "all that can be, together", "as shipped"])  # fmt: skip
        for engine, scenes in data["engines"].items():
            for name, found in scenes.items():
                cells = found["cells"]
                those = {
                    kind: "; ".join(f"{what} ({_number(cells[what]['change'])})" for what in cells
                                    if what in INGREDIENTS and cells[what]["verdict"] == kind)
                    for kind in (OUT, NOTHING, NEEDED)
                }  # fmt: skip
                ends = [f"changes {_number(cells[what]['change'])}, saves {_percent(cells[what])}"
                        for what in ("together", "shipped")]  # fmt: skip
                table.rows.append([f"{name}, {ENGINE_NAMES[engine]}", f"{1e-3 * found['microseconds']['median']:.2f}",
                                   *those.values(), ends[0], f"{found['laws']}: {ends[1]}"])  # fmt: skip
        for engine, change in data["grouping"].items():
            table.rows.append([f"cradle with a call for each couple, {ENGINE_NAMES[engine]}", "", "", "", "",
                               f"changes {_number(change)}", ""])  # fmt: skip
        return table

    def draw(self, data: Data) -> Figure:
        """A map for each engine."""
        from matplotlib.figure import Figure

        heights = [len(found) for found in data["engines"].values()]
        figure = Figure(figsize=(10.5, 1.6 + 0.46 * sum(heights)), layout="constrained")
        for axes, (engine, found) in zip(figure.subplots(len(heights), 1, height_ratios=heights),
                                         data["engines"].items(), strict=True):  # fmt: skip
            _draw_map(axes, found)
            axes.set_title(f"{ENGINE_NAMES[engine]}: change without it, and time saved", fontsize=10)
        return figure


def _limits(data: Data) -> list[Limit]:
    scenes = [found["cells"] for engine in data["engines"].values() for found in engine.values()]
    single = [cell["change"] for cells in scenes for what, cell in cells.items()
              if what in INGREDIENTS and cell["verdict"] == OUT]  # fmt: skip
    return [
        Limit("change by one ingredient that is said to be left out", ALLOWED, max(single, default=0.0)),
        Limit("change by all of them together", ALLOWED, _largest(cells["together"]["change"] for cells in scenes)),
        Limit("change by what the scenes as shipped leave out", ALLOWED,
              _largest(cells["shipped"]["change"] for cells in scenes)),
        Limit("change by giving the cradle's couples one by one", 0.0, _largest(data["grouping"].values())),
    ]  # fmt: skip


def _largest(changes: Any) -> float:
    """The largest change; infinite where one made another motion of it."""
    return max(float("inf") if change is None else change for change in changes)


def _number(change: float | None) -> str:
    """A change in few characters."""
    if change is None:
        return "other"
    if change == 0.0:
        return "0"
    if 1e-2 <= change < 100.0:
        return f"{change:.2g}"
    digits = 1 if 1e-4 <= change < 1e-2 else 0  # these stand beside what is allowed
    return f"{change:.{digits}e}".replace("e-0", "e-").replace("e+0", "e")


def _percent(cell: Data) -> str:
    return f"{100.0 * cell['saved']['part']:.0f} %".replace("-0 %", "0 %")


def _draw_map(axes: Axes, scenes: Data) -> None:
    """Rows: scenes; columns: ingredients."""
    from matplotlib.patches import Rectangle

    columns = [*INGREDIENTS, "together", "shipped"]
    shades = np.full((len(scenes), len(columns)), np.nan)
    for row, found in enumerate(scenes.values()):
        for column, what in enumerate(columns):
            if what not in found["cells"]:
                axes.text(column, row, "\N{EN DASH}", ha="center", va="center", color="#808080")
                continue
            cell = found["cells"][what]
            change = np.inf if cell["change"] is None else cell["change"]
            shade = float(np.clip((np.log10(max(change, 1e-30)) - LIGHT) / (DARK - LIGHT), 0.0, 1.0))
            shades[row, column] = shade
            axes.text(column, row, f"{_number(cell['change'])}\n{_percent(cell)}", ha="center", va="center", fontsize=8,
                      color="white" if shade > 0.6 else "black")  # fmt: skip
            if cell["verdict"] == OUT and what in INGREDIENTS:
                axes.add_patch(Rectangle((column - 0.47, row - 0.45), 0.94, 0.9, fill=False, linewidth=1.8))
    axes.imshow(0.85 * shades, cmap="Greys", vmin=0.0, vmax=1.0, aspect="auto")
    axes.axvline(len(INGREDIENTS) - 0.5, color="black", linewidth=1.2)
    axes.set_xticks(range(len(columns)), [what.replace(" ", "\n") for what in columns], fontsize=8)
    axes.set_yticks(range(len(scenes)), list(scenes))
    axes.tick_params(length=0, top=False, labeltop=True, labelbottom=False, bottom=False)
    axes.grid(visible=False)
