"""Stability of methods for contacts a thousand times shorter or longer than the engine's step, of any stiffness."""

from functools import partial
from itertools import pairwise, product
from math import pi, sqrt

import numpy as np

from contactlaw.laws.hertz import HERTZ_DURATION
from validation.case import Axes, Data, Limit, Outcome
from validation.stability import DEFAULT, StabilityCase, crosses, gains, on_all_cores, scale_of_gains, tally
from validation.stability_draws import bounces
from validation.stability_trials import Trial
from validation.stability_worlds import ENGINES, ONCE, STIFF, TITLES, WAYS

DURATIONS = [0.5 * n for n in range(-6, 7)]  # edges, log10 of contact duration over engine step
MODULI = [float(n) for n in range(3, 13)]  # edges, log10 of E/Pa
MASS_RATIOS = (-6.0, 6.0)  # log10
SEEDS, SEEDS_OF_DEFAULT = 1, 5  # of a ball, and as many of a ball on a ball
WIDER = range(100, 120)  # numbers of the trials of a cell that are drawn besides for the default, half of them stacks
CONSERVED = 1e-3
Bounds = tuple[float, float]

SWING = HERTZ_DURATION * sqrt(1.875)  # omega T of small motions at the greatest overlap, omega^2 = k_N/m
STIFFEST_ACROSS = sqrt(3.5)  # omega across over along, sqrt(2 chi), a solid ball with nu = 0


class StabilityMap(StabilityCase):
    """The map covers contacts a thousand times shorter or longer than the engine's step, moduli from 1 kPa to 1 TPa,
    friction up to 10, mass ratios up to a million, speeds of 0.1 mm/s to 100 m/s, and restitution from 1 to 0.05. With
    substeps, no cell of the default law contains a bounce that gains 0.1 % of energy, in either engine; nor does a
    wider draw of the same kind, with two thousand runs per engine. Evaluated once per step, as in discrete-element
    codes, the same law is stable only where the step resolves the contact. The engines' own contacts lose the bounce
    nearly everywhere, and in long steps bodies pass through each other; made as stiff as the law, MuJoCo's contact
    explodes.
    """

    place = 47
    title = "Stability"
    caption = (
        "E: Young's modulus; T/dt: duration of the contact over the engine's step. Shade: largest gain of energy in a "
        "cell. Cross: a run in it gains more than 0.1 %, is not finite, or passes through the other body by more than "
        "a radius. Broken lines: omega dt = 2, along the normal (left) and across it (right), at the greatest "
        "overlap; dotted: for the linear spring. Each cell has a ball on a floor, and a ball on a second one of "
        "another mass, with Poisson's ratio, friction, restitution, speed, spin and direction at random, the same for "
        "all methods."
    )
    sheet = {"columns": len(WAYS), "rows": len(ENGINES), "width": 13.2 / len(WAYS), "height": 2.2, "layout": None,
             "sharex": True, "sharey": True}  # fmt: skip
    cells = "cells"
    heads = "lossless ball keeps, least | median"

    def run(self, quick: bool) -> Outcome:
        durations, moduli = (DURATIONS[::3], MODULI[::3]) if quick else (DURATIONS, MODULI)
        cells = [[((r, c), steps, modulus) for c, steps in enumerate(pairwise(durations))]
                 for r, modulus in enumerate(pairwise(moduli))]  # fmt: skip
        most = SEEDS if quick else SEEDS_OF_DEFAULT
        data: Data = {"durations": durations, "moduli": moduli, "wider": {}}
        data["engines"] = self.measured(partial(cell_of, most), cells)
        wider = [] if quick else [(engine, *cell) for engine in ENGINES for row in cells for cell in row]
        more = on_all_cores(more_of, wider)
        for number, engine in enumerate(ENGINES if wider else ()):
            own = more[number * len(more) // len(ENGINES) :][: len(more) // len(ENGINES)]
            data["wider"][engine] = {"runs": sum(one["runs"] for one in own),
                                     "failures": [failure for one in own for failure in one["failures"]]}  # fmt: skip
        return Outcome(self.limits(data), data)

    def limits(self, data: Data) -> list[Limit]:
        """Besides, that an elastic ball keeps its energy, and the wider draw."""
        limits = super().limits(data)
        for engine, ways in data["engines"].items():
            kept = min(value for row in ways[DEFAULT]["kept"] for value in row if value is not None)
            name = f"energy that an elastic ball without friction loses, {DEFAULT}, {TITLES[engine]}"
            limits.append(Limit(name, CONSERVED, 1.0 - kept))
        for engine, one in data["wider"].items():
            name = f"runs of a wider draw that fail, {DEFAULT}, {TITLES[engine]}"
            limits.append(Limit(name, 0.0, float(len(one["failures"]))))
        return limits

    def kept(self, values: list[float]) -> str:
        """None where the ball sank into the floor and stayed."""
        parts = min(values), float(np.median(values))
        return " | ".join(f"{max(part, 0.0):.5f}" if part < 1.001 else f"{part:.3g}" for part in parts)

    def draw(self, data: Data, *axes: Axes) -> None:
        x, y = 10.0 ** np.array(data["durations"]), 10.0 ** np.array(data["moduli"])
        axes[0].figure.subplots_adjust(left=0.06, right=0.94, top=0.87, bottom=0.13, wspace=0.12, hspace=0.12)
        mesh = None
        for (engine, way), one in zip(product(ENGINES, WAYS), axes, strict=True):
            found = data["engines"][engine][way]
            mesh = gains(one, x, y, found["gain"])
            crosses(one, [(sqrt(x[c] * x[c + 1]), sqrt(y[r] * y[r + 1])) for r, c in np.argwhere(found["fails"])], 4.0)
            for turn in {ONCE: (SWING, SWING * STIFFEST_ACROSS), STIFF: (pi,)}.get(way, ()):
                one.axvline(0.5 * turn, color="white", linewidth=2.2)
                one.axvline(0.5 * turn, color="#c44e00", linewidth=1.4, linestyle="--" if way == ONCE else ":")
            one.set(xscale="log", yscale="log", xticks=[1e-2, 1.0, 1e2], yticks=[1e3, 1e6, 1e9, 1e12])
            one.minorticks_off()
            one.tick_params(labelsize=8)
            if engine == ENGINES[0]:
                one.set_title(way.replace(", ", ",\n").replace("_", "\n_"), fontsize=9)
            else:
                one.set_xlabel("T/dt [-]", fontsize=8)
        for engine, one in zip(ENGINES, axes[:: len(WAYS)], strict=True):
            one.set_ylabel(f"{TITLES[engine]}\nE [Pa]", fontsize=9)
        scale_of_gains(mesh, axes)


def cell_of(most: int, task: tuple[str, str, tuple[int, int], Bounds, Bounds]) -> Data:
    """Trials of one cell by one method: random balls and balls on balls, most for the default; and a lossless ball."""
    engine, way, cell, steps, modulus = task
    seeds = most if way == DEFAULT else SEEDS
    trials = [_drawn(cell, number, steps, modulus) for number in range(2 * seeds)]
    lossless = bounces((*cell, 2 * seeds), steps, modulus=modulus, restitution=1.0, friction=0.0)
    found, alone = tally(engine, way, trials), tally(engine, way, [lossless])
    both = {key: found[key] + alone[key] for key in ("runs", "refused", "failed", "infinite", "failures")}
    return both | {"gain": max(found["gain"], alone["gain"]), "kept": alone["kept"]}


def more_of(task: tuple[str, tuple[int, int], Bounds, Bounds]) -> Data:
    """Trials of a cell from the wider draw, by the default law."""
    engine, cell, steps, modulus = task
    return tally(engine, DEFAULT, [_drawn(cell, number, steps, modulus) for number in WIDER])


def _drawn(cell: tuple[int, int], number: int, steps: Bounds, modulus: Bounds) -> Trial | None:
    """A ball, or for odd numbers a ball on a ball of another mass."""
    exponent = np.random.default_rng([*cell, number, 1]).uniform(*MASS_RATIOS)
    return bounces((*cell, number), steps, ratio=10.0**exponent if number % 2 else 0.0, modulus=modulus)
