"""Contacts of any stiffness, a thousand times shorter or longer than the engine's step: which ways hold."""

from __future__ import annotations

from itertools import pairwise, product
from math import pi, sqrt
from typing import TYPE_CHECKING

import numpy as np

from contactlaw.laws.hertz import HERTZ_DURATION
from validation.case import Case, Data, Limit, Outcome, Progress, Table, register
from validation.stability import crosses, gains, on_all_cores, scale_of_gains, short, tally, without_names
from validation.stability_draws import bounces
from validation.stability_trials import Trial
from validation.stability_worlds import ENGINES, ONCE, STIFF, SUB_CYCLED, TITLES, WAYS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DURATIONS = [0.5 * n for n in range(-6, 7)]  # edges, log10 of contact duration over engine step
MODULI = [float(n) for n in range(3, 13)]  # edges, log10 of E/Pa
MASS_RATIOS = (-6.0, 6.0)  # log10
SEEDS, SEEDS_OF_DEFAULT = 1, 5  # of a ball, and as many of a ball on a ball
WIDER = range(100, 120)  # numbers of the trials of a cell that are drawn besides for the default, half of them stacks
DEFAULT = "microslip"
CONSERVED = 1e-3

SWING = HERTZ_DURATION * sqrt(1.875)  # omega T of small motions at the greatest overlap, omega^2 = k_N/m
STIFFEST_ACROSS = sqrt(3.5)  # omega across over along, sqrt(2 chi), a solid ball with nu = 0


@register
class StabilityMap(Case):
    """Bounces with random properties in every cell of a map, for every law, both engines and their own contact."""

    name = "stability_map"
    place = 47
    title = "Where it is stable"
    claim = (
        "Contacts a thousand times shorter or longer than the engine's step, moduli from 1 kPa to 1 TPa, friction up "
        "to 10, mass ratios up to a million, 0.1 mm/s to 100 m/s, restitution from 1 to 0.05: with sub-cycling no "
        "cell of the default law holds a bouncing that gains 0.1 % of energy, in either engine. A wider draw of the "
        "same kind finds what is left: a few runs in thousands, a light ball pinched between a heavy one and the "
        "floor in steps of many contacts, past which it goes further than the step's frames of contact can follow. "
        "Evaluated once a step, as discrete-element codes do, the same law holds only where the step resolves the "
        "contact. The engines' own contacts lose the bounce nearly everywhere, and in long steps bodies go through "
        "each other; made as stiff as the law's, MuJoCo's explodes."
    )
    caption = (
        "Shade: largest gain of energy in a cell. Cross: a run in it gains more than 0.1 %, is not finite, or goes "
        "through by more than a radius. Broken lines: omega dt = 2, "
        "along the normal (left) and across (right), at the greatest overlap; dotted: for the linear spring. Each cell "
        "holds a ball on a floor, and a ball on a second one of another mass, with Poisson's ratio, friction, "
        "restitution, speed, spin and heading at random, the same for all ways."
    )
    needs = ("mujoco", "pybullet")

    def run(self, quick: bool, progress: Progress) -> Outcome:
        """Every cell of every way."""
        durations, moduli = (DURATIONS[::3], MODULI[::3]) if quick else (DURATIONS, MODULI)
        columns, rows = list(pairwise(durations)), list(pairwise(moduli))
        cells = list(product(range(len(rows)), range(len(columns))))
        tasks = [
            (engine, way, cell, columns[cell[1]], rows[cell[0]],
             SEEDS_OF_DEFAULT if way == DEFAULT and not quick else SEEDS)
            for engine, way, cell in product(ENGINES, WAYS, cells)
        ]  # fmt: skip
        wider = (
            [] if quick else [(engine, cell, columns[cell[1]], rows[cell[0]]) for engine in ENGINES for cell in cells]
        )
        found = iter(on_all_cores(cell_of, tasks, lambda part: progress(0.7 * part)))
        more = on_all_cores(more_of, wider, lambda part: progress(0.7 + 0.3 * part))
        data: Data = {"durations": durations, "moduli": moduli, "engines": {}, "wider": {}}
        for number, engine in enumerate(ENGINES if wider else ()):
            own = more[number * len(cells) : (number + 1) * len(cells)]
            data["wider"][engine] = {
                "runs": sum(one["runs"] for one in own),
                "failures": [failure for one in own for failure in one["failures"]],
            }
        for engine, way in product(ENGINES, WAYS):
            one = _map([next(found) for _ in cells], len(rows))
            data["engines"].setdefault(engine, {})[way] = one if way == DEFAULT else without_names(one)
        return Outcome(_limits(data), data)

    def table(self, data: Data) -> Table:
        """A row for each way, and below every cell that fails."""
        table = Table(["way", "runs", "cells", "fail", "not finite", "largest gain", "lossless ball keeps, least",
                       "median", "cells that fail: E, and T/dt from"])  # fmt: skip
        for engine, way in product(ENGINES, WAYS):
            one = data["engines"][engine][way]
            kept = [value for row in one["kept"] for value in row if value is not None]
            table.rows.append([
                f"{way}, {TITLES[engine]}", str(one["runs"]), str(np.size(one["fails"])),
                str(int(np.sum(one["fails"]))), str(one["infinite"]), short(float(np.max(one["gain"]))),
                _part(min(kept)), _part(float(np.median(kept))), _named(one["fails"], data),
            ])  # fmt: skip
        for engine, one in data["wider"].items():
            table.rows.append([f"{DEFAULT}, {TITLES[engine]}, wider draw, runs that fail", str(one["runs"]), "",
                               str(len(one["failures"])), *[""] * 5])  # fmt: skip
        for engine in ENGINES:
            wider = data["wider"].get(engine, {"failures": []})["failures"]
            for failure in data["engines"][engine][DEFAULT]["failures"] + wider:
                table.rows.append([f"FAILS: {DEFAULT}, {TITLES[engine]}", *[""] * 4, short(failure["gain"]), "", "",
                                   f"{failure['problem']}: {failure['trial']}"])  # fmt: skip
        refused = sum(one["refused"] for ways in data["engines"].values() for one in ways.values())
        table.rows.append(["beyond the accelerations that MuJoCo takes, not counted", str(refused), *[""] * 7])
        return table

    def draw(self, data: Data) -> Figure:
        """A map for each way."""
        from matplotlib.figure import Figure

        figure = Figure(figsize=(13.2, 4.4))
        figure.subplots_adjust(left=0.06, right=0.94, top=0.87, bottom=0.13, wspace=0.12, hspace=0.12)
        panels = figure.subplots(len(ENGINES), len(WAYS), sharex=True, sharey=True)
        x, y = 10.0 ** np.array(data["durations"]), 10.0 ** np.array(data["moduli"])
        mesh = None
        for (engine, way), axes in zip(product(ENGINES, WAYS), panels.ravel(), strict=True):
            one = data["engines"][engine][way]
            mesh = gains(axes, x, y, one["gain"])
            crosses(axes, [(sqrt(x[c] * x[c + 1]), sqrt(y[r] * y[r + 1])) for r, c in np.argwhere(one["fails"])], 4.0)
            _limit_of_theory(axes, way)
            axes.set(xscale="log", yscale="log", xticks=[1e-2, 1.0, 1e2], yticks=[1e3, 1e6, 1e9, 1e12])
            axes.minorticks_off()
            axes.tick_params(labelsize=8)
            if engine == ENGINES[0]:
                axes.set_title(way.replace(", ", ",\n").replace("_", "\n_"), fontsize=9)
            else:
                axes.set_xlabel("T/dt [-]", fontsize=8)
        for engine, axes in zip(ENGINES, panels[:, 0], strict=True):
            axes.set_ylabel(f"{TITLES[engine]}\nE [Pa]", fontsize=9)
        scale_of_gains(figure, mesh, panels)
        return figure


def cell_of(task: tuple[str, str, tuple[int, int], tuple[float, float], tuple[float, float], int]) -> Data:
    """One cell of one way: balls and balls on balls at random, and an elastic one without friction."""
    engine, way, cell, steps, modulus, seeds = task
    trials = [_drawn(cell, number, steps, modulus) for number in range(2 * seeds)]
    lossless = bounces((*cell, 2 * seeds), steps, modulus=modulus, restitution=1.0, friction=0.0)
    found, alone = tally(engine, way, trials), tally(engine, way, [lossless])
    both = {key: found[key] + alone[key] for key in ("runs", "refused", "failed", "infinite", "failures")}
    return both | {"gain": max(found["gain"], alone["gain"]), "kept": alone["kept"]}


def more_of(task: tuple[str, tuple[int, int], tuple[float, float], tuple[float, float]]) -> Data:
    """Trials of a cell from the wider draw, by the default."""
    engine, cell, steps, modulus = task
    return tally(engine, DEFAULT, [_drawn(cell, number, steps, modulus) for number in WIDER])


def _drawn(
    cell: tuple[int, int], number: int, steps: tuple[float, float], modulus: tuple[float, float]
) -> Trial | None:
    """A ball, or for odd numbers a ball on a ball of another mass."""
    ratio = 0.0
    if number % 2:
        ratio = 10.0 ** np.random.default_rng([*cell, number, 1]).uniform(*MASS_RATIOS)
    return bounces((*cell, number), steps, ratio=ratio, modulus=modulus)


def _map(cells: list[Data], rows: int) -> Data:
    """Cells in the order of `product(rows, columns)`, as sums and grids."""

    def grid(key: str) -> list[list[float]]:
        return [[cell[key] for cell in row] for row in np.array(cells, dtype=object).reshape(rows, -1).tolist()]

    return {
        **{key: sum(cell[key] for cell in cells) for key in ("runs", "refused", "failed", "infinite")},
        "gain": grid("gain"),
        "kept": grid("kept"),
        "fails": [[failed > 0 for failed in row] for row in grid("failed")],
        "failures": [failure for cell in cells for failure in cell["failures"]],
    }


def _limits(data: Data) -> list[Limit]:
    limits = []
    for engine, ways in data["engines"].items():
        kept = [value for row in ways[DEFAULT]["kept"] for value in row if value is not None]
        limits += [
            Limit(f"cells that fail, {DEFAULT}, {TITLES[engine]}", 0.0, float(np.sum(ways[DEFAULT]["fails"]))),
            Limit(f"energy that an elastic ball without friction loses, {DEFAULT}, {TITLES[engine]}", CONSERVED,
                  1.0 - min(kept)),
            Limit(f"runs that are not finite, all sub-cycled laws, {TITLES[engine]}", 0.0,
                  float(sum(ways[way]["infinite"] for way in SUB_CYCLED))),
        ]  # fmt: skip
    limits += [
        Limit(f"runs of a wider draw that fail, {DEFAULT}, {TITLES[engine]}", 0.0, float(len(one["failures"])))
        for engine, one in data["wider"].items()
    ]
    return limits


def _named(fails: list[list[bool]], data: Data) -> str:
    """The cells that fail, by their lower edges."""
    rows = []
    for row, modulus in zip(fails, data["moduli"], strict=False):
        steps = [f"{10.0**low:.2g}" for fail, low in zip(row, data["durations"], strict=False) if fail]
        if len(steps) == len(row):
            steps = ["all"]
        if steps:
            rows.append(f"1e{modulus:.0f} Pa: {', '.join(steps)}")
    return "; ".join(rows) or "none"


def _part(kept: float) -> str:
    """Of the energy: none where the ball sank into the floor and stayed."""
    return f"{max(kept, 0.0):.5f}" if kept < 1.001 else f"{kept:.3g}"


def _limit_of_theory(axes: Axes, way: str) -> None:
    turns = {ONCE: (SWING, SWING * STIFFEST_ACROSS), STIFF: (pi,)}.get(way, ())
    for turn in turns:
        axes.axvline(0.5 * turn, color="white", linewidth=2.2)
        axes.axvline(0.5 * turn, color="#c44e00", linewidth=1.4, linestyle="--" if way == ONCE else ":")
