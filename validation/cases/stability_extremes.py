"""One thing at a time taken to its ends: Poisson's ratio, friction, inertia, incidence, masses, speed, rest."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from validation.case import Case, Data, Limit, Outcome, Progress, Table, register
from validation.stability import crosses, gains, on_all_cores, scale_of_gains, short, tally, without_names
from validation.stability_draws import EXTREMES, extreme
from validation.stability_worlds import ENGINES, SUB_CYCLED, TITLES, WAYS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TRIALS, FEW_TRIALS = 12, 4  # of a level; half of them elastic, their steps spread from contact to contact
DEFAULT = "microslip"


@register
class StabilityExtremes(Case):
    """Levels of every extreme, for every law, both engines and their own contact."""

    name = "stability_extremes"
    place = 48
    title = "Extreme cases"
    claim = (
        "Incompressible or not, without friction or with all of it, rings and compact cores, psi_1 from 1e-6 to 1000, "
        "masses a million times apart, speeds from 1 um/s to 100 m/s, grazing incidence, a start inside each other, "
        "rest on a floor or wedged into a groove, and hundreds of impacts in a step: by the default law nothing gains "
        "0.1 % of energy, and what is to come to rest does."
    )
    caption = (
        "Largest gain of energy of a way (rows) at a level of an extreme (columns); crosses: a run gains more than "
        "0.1 %, is not finite, goes through by more than a radius, or does not come to rest where it should, within 20 "
        "periods of the law's contact and 200 steps. Engine steps from a 300th of a contact to a thousand contacts, "
        "all else at random. Where a ball starts inside the floor it has the energy of the law's contact."
    )
    needs = ("mujoco", "pybullet")

    def run(self, quick: bool, progress: Progress) -> Outcome:
        """Every level of every extreme of every way."""
        count = FEW_TRIALS if quick else TRIALS
        levels = [(name, level) for name, one in EXTREMES.items() for level in range(len(one.levels))]
        if quick:
            levels = [(name, level) for name, level in levels if level in (0, len(EXTREMES[name].levels) - 1)]
        tasks = [(engine, way, *level, count) for engine, way, level in product(ENGINES, WAYS, levels)]
        cells = iter(on_all_cores(level_of, tasks, progress))
        data: Data = {"levels": levels, "engines": {}}
        for engine, way in product(ENGINES, WAYS):
            found = [next(cells) for _ in levels]
            data["engines"].setdefault(engine, {})[way] = found if way == DEFAULT else [*map(without_names, found)]
        limits = []
        for engine, ways in data["engines"].items():
            infinite = sum(cell["infinite"] for way in SUB_CYCLED for cell in ways[way])
            limits += [
                Limit(f"levels that fail, {DEFAULT}, {TITLES[engine]}", 0.0,
                      float(sum(cell["failed"] > 0 for cell in ways[DEFAULT]))),
                Limit(f"runs that are not finite, all sub-cycled laws, {TITLES[engine]}", 0.0, float(infinite)),
            ]  # fmt: skip
        return Outcome(limits, data)

    def table(self, data: Data) -> Table:
        """A row for each way with all that fails, then every failure of the default."""
        table = Table(
            ["way", "runs", "levels", "fail", "not finite", "largest gain", "elastic balls keep", "levels that fail"]
        )
        for engine, way in product(ENGINES, WAYS):
            cells = data["engines"][engine][way]
            failing = {}
            for (name, level), cell in zip(data["levels"], cells, strict=True):
                if cell["failed"]:
                    failing.setdefault(EXTREMES[name].plain, []).append(EXTREMES[name].words[level])
            table.rows.append([
                f"{way}, {TITLES[engine]}", str(sum(cell["runs"] for cell in cells)), str(len(cells)),
                str(sum(cell["failed"] > 0 for cell in cells)), str(sum(cell["infinite"] for cell in cells)),
                short(max(cell["gain"] for cell in cells)), _kept(cells),
                "; ".join(f"{name}: {', '.join(words)}" for name, words in failing.items()) or "none",
            ])  # fmt: skip
        for engine in ENGINES:
            for cell in data["engines"][engine][DEFAULT]:
                for failure in cell["failures"]:
                    table.rows.append([f"FAILS: {DEFAULT}, {TITLES[engine]}", *[""] * 4, short(failure["gain"]), "",
                                       f"{failure['problem']}: {failure['trial']}"])  # fmt: skip
        refused = sum(cell["refused"] for ways in data["engines"].values() for one in ways.values() for cell in one)
        table.rows.append(["beyond the accelerations that MuJoCo takes, not counted", str(refused), *[""] * 6])
        return table

    def draw(self, data: Data) -> Figure:
        """Gains; the table says what is left."""
        from matplotlib.figure import Figure

        figure = Figure(figsize=(13.2, 4.6), layout="constrained")
        axes = figure.subplots()
        ways = list(product(ENGINES, WAYS))[::-1]
        cells = [data["engines"][engine][way] for engine, way in ways]
        x, y = np.arange(len(data["levels"]) + 1), np.arange(len(ways) + 1)
        mesh = gains(axes, x, y, [[cell["gain"] for cell in row] for row in cells])
        crosses(axes, [(c + 0.5, r + 0.5) for r, row in enumerate(cells) for c, cell in enumerate(row)
                       if cell["failed"]], 4.0)  # fmt: skip
        scale_of_gains(figure, mesh, axes)
        axes.set_yticks(y[:-1] + 0.5, [f"{way}, {TITLES[engine]}" for engine, way in ways], fontsize=8)
        axes.set_xticks(x[:-1] + 0.5, [EXTREMES[name].words[level] for name, level in data["levels"]], rotation=90,
                        fontsize=8)  # fmt: skip
        axes.tick_params(length=0)
        axes.axhline(len(WAYS), color="black", linewidth=1.2)
        names = [name for name, _ in data["levels"]]
        for name in dict.fromkeys(names):
            axes.axvline(names.index(name), color="black", linewidth=1.2)
            axes.annotate(EXTREMES[name].name, (names.index(name) + 0.5 * names.count(name), 1.0), ha="center",
                          xycoords=("data", "axes fraction"), xytext=(0, 4), textcoords="offset points",
                          fontsize=8)  # fmt: skip
        return figure


def level_of(task: tuple[str, str, str, int, int]) -> Data:
    """One level of one way."""
    engine, way, name, level, count = task
    return tally(engine, way, [extreme(name, level, number, count) for number in range(count)])


def _kept(cells: list[Data]) -> str:
    """Median over the levels of the median energy that elastic balls keep; friction may take some."""
    return f"{np.median([cell['kept'] for cell in cells if cell['kept'] is not None]):.3g}"
