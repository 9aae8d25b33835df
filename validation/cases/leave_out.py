"""Ingredients of the law that each scene can do without, with the change of result and the time saved."""

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from sims.panel import ENGINE_NAMES
from validation.case import Case, Data, Limit, Outcome, Table
from validation.leave_out_scenes import FULL, INGREDIENTS, SHIPPED, Build, Subject, difference, run, subjects

QUICK = {"mujoco": ("puck", "superball", "cradle"), "pybullet": ("table tennis",)}
LAW_ERROR = 4e-4
"""Largest error in psi_2 of an impact by the law, chi 0.5 to 2 (`law_accuracy`), rounded up."""
ALLOWED = 0.25 * LAW_ERROR
"""Change of psi_2, or of a velocity over a typical one, up to which an ingredient is one that a scene has no use for.

What is left out changes the law's error e to e + c at most, and to sqrt(e^2 + c^2) where both have nothing to do with
each other. With c = e/4 that is 3 % more, a quarter at worst: no figure of the scene means anything else than before.
What changes more, fewer substeps say, is accuracy given away.
"""


def ingredients_of(subject: Subject, engine: str) -> list[str]:
    """Ingredients present in a scene and an engine."""
    absent = {"gravity": bool(subject.weightless), "pushes from outside": engine != "pybullet",
              "other couples": not subject.row}  # fmt: skip
    return [what for what in INGREDIENTS if not absent.get(what)]


def without(whats: Iterable[str]) -> Build:
    """Build that leaves out several ingredients; of two laws the one that comes first in `INGREDIENTS`."""
    changes: dict[str, Any] = {}
    for what in whats:
        changes = {**INGREDIENTS[what], **changes}
    return replace(FULL, **changes)


def judge(subject: Subject, engine: str, rounds: int) -> Data:
    """Changes of one scene in one engine without each ingredient, without all dispensable ones, and as shipped.

    In each round every build runs once; `saved` is from the quickest runs, since disturbances only add time.
    """
    builds = {"full": FULL, "shipped": SHIPPED} | {what: without([what]) for what in ingredients_of(subject, engine)}
    results = {what: subject.results(run(subject, engine, build)) for what, build in builds.items()}
    changes = {what: difference(results["full"], found) for what, found in results.items()}
    spared = [what for what in builds if what in INGREDIENTS and can_go(changes[what])]
    builds["together"] = without(spared)
    changes["together"] = difference(results["full"], subject.results(run(subject, engine, builds["together"])))
    seconds = dict.fromkeys(builds, np.inf)
    for number in range(rounds):
        for what in list(builds)[:: -1 if number % 2 else 1]:
            seconds[what] = min(seconds[what], run(subject, engine, builds[what]).facts["wall_time"])
    cells = {what: {"change": change, "saved": 1.0 - seconds[what] / seconds["full"]}
             for what, change in changes.items() if what != "full"}  # fmt: skip
    return {"result": results["full"], "milliseconds": 1e3 * seconds["full"], "cells": cells,
            "laws": run(subject, engine, SHIPPED).facts["law"]}  # fmt: skip


def can_go(change: float | None) -> bool:
    """Return whether a change is negligible for a scene; None: the motion is another one altogether."""
    return change is not None and change <= ALLOWED


class LeaveOut(Case):
    """Each scene is run with every ingredient of the law, then with one left out. The table gives the largest change of
    its result (psi_2, or a velocity after over one before) and the share of time saved. An ingredient that changes the
    result by at most 1e-4, a quarter of the law's own error, can be left out; this must also hold for all such
    ingredients together, and for those that the scenes as shipped leave out. Fewer substeps reduce accuracy, and change
    more. The paddle, a body with a joint, is built by hand and not varied.
    """

    place = 96
    title = "What each scene can leave out"

    def run(self, quick: bool) -> Outcome:
        data: Data = {"engines": {engine: {} for engine in QUICK}}
        problems = []
        known = subjects()
        scenes = [(engine, name) for engine, few in QUICK.items() for name in (few if quick else known)]
        for engine, name in scenes:
            found = data["engines"][engine][name] = judge(known[name], engine, 2 if quick else 8)
            if not found["result"]:
                problems.append(f"{name} in {engine}: no result")
        return Outcome(_limits(data), data, problems)

    def table(self, data: Data) -> Table:
        table = Table("scene | with everything [ms] | can be left out (change) | needed (change) | "
                      "all of the former together | as shipped")  # fmt: skip
        for engine, scenes in data["engines"].items():
            for name, found in scenes.items():
                cells = found["cells"]
                known = [what for what in cells if what in INGREDIENTS]
                words = {what: f"{what} ({_number(cells[what]['change'])})" for what in known}
                free = [word for what, word in words.items() if can_go(cells[what]["change"])]
                needed = [word for word in words.values() if word not in free]
                ends = [f"changes {_number(cells[what]['change'])}, saves {100.0 * cells[what]['saved']:.0f} %"
                        for what in ("together", "shipped")]  # fmt: skip
                table.add(f"{name}, {ENGINE_NAMES[engine]} | {{milliseconds:.2f}} | {'; '.join(free)} | "
                          f"{'; '.join(needed)} | {ends[0]} | {{laws}}: {ends[1]}", found)  # fmt: skip
        return table


def _limits(data: Data) -> list[Limit]:
    scenes = [found["cells"] for engine in data["engines"].values() for found in engine.values()]
    single = [cell["change"] for cells in scenes for what, cell in cells.items()
              if what in INGREDIENTS and can_go(cell["change"])]  # fmt: skip
    return [
        Limit("change by one ingredient that is said to be left out", ALLOWED, max(single, default=0.0)),
        *(Limit(f"change by {what}", ALLOWED, _largest(cells[key]["change"] for cells in scenes))
          for what, key in (("all of them together", "together"),
                            ("what the scenes as shipped leave out", "shipped"))),
    ]  # fmt: skip


def _largest(changes: Iterable[float | None]) -> float:
    """The largest change; infinite if one led to another motion altogether."""
    return max(np.inf if change is None else change for change in changes)


def _number(change: float | None) -> str:
    """A change in few characters."""
    if not change:
        return "other" if change is None else "0"
    if 1e-2 <= change < 100.0:
        return f"{change:.2g}"
    digits = 1 if 1e-4 <= change < 1e-2 else 0  # these stand beside what is allowed
    return f"{change:.{digits}e}".replace("e-0", "e-").replace("e+0", "e")
