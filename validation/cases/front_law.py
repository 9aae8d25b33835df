"""Error against run time of the law alone: every law, the annuli and the superposition method, in four uses."""

from functools import partial
from typing import Any

import numpy as np

from contactlaw import rebound
from validation import front, front_ways
from validation.case import Array, Axes, Case, Data, Limit, Outcome, Table
from validation.front import Rung
from validation.impacts import judge, sticking
from validation.picture import legend_below
from validation.reference import superposition
from validation.substeps import substep_times

CHIS = [0.5, 1.0, 1.441, 2.0]
NODES = [4, 8, 16, 24, 32]
STEPS = [16, 24, 32, 48, 64, 96, 128, 192, 256, 384, 512]
FINE = 16000  # steps of the superposition method; with half as many extrapolated to the truth
EXACT = 1e-7  # errors below are drawn there
RATE, RATE_ERROR = 0.8, 7e-3  # million impacts a second on two cores
QUICK_ENOUGH = {1e-3: 12.0, 7e-3: 2.0}
"""Error, and the time [us] of an impact in a batch on one core that is allowed for it."""
USES = {
    "batch": "rebound(), many in one call",
    "call": "one impact a call",
    "history": "forces over an impact",
    "path": "forces along a path",
}


class FrontLaw(Case):
    """A user decides by error against run time. The default law with default settings should be on the front, where no
    other law, setting or method is both closer and faster. It should be 30 times closer than the single-spring laws at
    equal run time, and 100 times faster than the annulus reference at equal error. In a batch an impact should cost at
    most 12 us for an error of 0.001, and 2 us for 0.007, and a million impacts should run at 0.8 million a second on
    two cores, within 0.007. The substep that the engines take is timed separately.
    """

    place = 42
    title = "Error and time without an engine"
    sheet = {"columns": 2, "rows": 2, "width": 4.8, "height": 3.9}
    caption = (
        "Error over processor time, one core. Impacts: largest error in psi_2, chi from 0.5 to 2, elastic, without "
        "those that slide throughout. Forces: largest error of F over mu P_max at any instant. Line: the front, on "
        "which no method is both closer and faster. Numbers: nodes/steps of microslip; all: closed form without "
        "nodes, the default for forces. Errors below 1e-7 are drawn at 1e-7: along a path both the superposition "
        "method and the default are exact."
    )

    def run(self, quick: bool) -> Outcome:
        impacts = np.array([(psi_1, chi) for chi in CHIS for psi_1 in sticking(chi, 5 if quick else 20)]).T.copy()
        fine, finer = (np.asarray(superposition.rebound(impacts[0], impacts[1], steps)) for steps in (FINE // 2, FINE))
        truth = finer + (finer - fine) / 3.0
        spot = slice(None, None, 10 if quick else 5)
        apart = float(np.abs(judge([(*one, 1.0) for one in impacts.T[spot].tolist()]).psi_2 - truth[spot]).max())
        repeats = 3 if quick else 15
        batch, call = _impacts(impacts, truth, quick, repeats)
        history = front_ways.histories(impacts[:, front_ways.SOME].copy(), repeats, quick)
        path = front_ways.along_paths(repeats, quick)
        uses = {use: front.weighed(rungs) for use, rungs in zip(USES, (batch, call, history, path), strict=True)}
        rates = front_ways.rates(2 if quick else 3, front_ways.MILLION // (10 if quick else 1))
        data: Data = {"reference_apart": apart, "uses": uses, "rates": rates,
                      "substeps": substep_times(15 if quick else 100)}  # fmt: skip
        data["closer"] = {use: front.closer(one, front_ways.DEFAULT, front_ways.SINGLE) for use, one in uses.items()}
        data["faster"] = {use: front.faster(one, front_ways.DEFAULT, ["annuli"]) for use, one in uses.items()}
        # The default must be sane; other ways that are not do not count, and the table says so.
        wrong = [f"{USES[use]}, {front_ways.DEFAULT}: {problem}" for use, one in uses.items()
                 if (problem := one["rungs"][front_ways.DEFAULT]["problem"])]  # fmt: skip
        return Outcome(_limits(data), data, wrong)

    def table(self, data: Data) -> Table:
        table = Table(f"use | {front.HEADS}")
        for use, one in data["uses"].items():
            table.rows.extend([use, *row] for row in front.rows(one, front_ways.DEFAULT))
            exact = one["rungs"][front_ways.DEFAULT]["largest"] < EXACT
            times = "exact" if exact else f"{front.short(data['closer'][use])} times"
            table.add(f"{use} | default closer than any single spring as fast | | | | | | {times}")
        for name, one in data["rates"].items():
            low, middle, high = (1.0 / one["rate"][key] for key in ("high", "median", "low"))
            table.add(f"1e6 impacts | {name} | {{largest:.1e}} | {{rms:.1e}} | {front.short(middle)} | "
                      f"{low:.3g} to {high:.3g} | | {{rate[median]:.2f}} million a second", one)  # fmt: skip
        for name, one in data["substeps"].items():
            low, middle, high = (1e-3 * one[key] for key in ("low", "median", "high"))
            table.add(f"a substep | {name} | | | {middle:.3f} | {low:.3f} to {high:.3f}")
        return table

    def draw(self, data: Data, *panels: Axes) -> None:
        for axes, (use, one) in zip(panels, data["uses"].items(), strict=True):
            front.plot(axes, one, front_ways.DEFAULT, floor=EXACT)
            what = r"$F/\mu P_{max}$" if use in ("history", "path") else r"$\psi_2$"
            axes.set(xlabel=f"time {'a path' if use == 'path' else 'an impact'} [us]", title=USES[use],
                     ylabel=f"largest error in {what} [-]")  # fmt: skip
        legend_below(panels[1], 5)


def _impacts(impacts: Array, truth: Array, quick: bool, repeats: int) -> tuple[dict[str, Rung], dict[str, Rung]]:
    """psi_2 by the thousand, and one impact a call from Python, by `rebound` and by `collide`, in many settings.

    The two references, which know no batches, and `collide` are timed on a part of the impacts.
    """
    psi_1, chi = impacts
    many, some = np.tile(impacts, 400 // psi_1.size), impacts[:, front_ways.SOME].copy()
    nodes, steps = (NODES[1::2], STEPS[::3]) if quick else (NODES, STEPS)
    slow: front_ways.Ways = {name: (make, some) for name, make in front_ways.methods(quick).items()}
    batch: front_ways.Ways = {
        name: (lambda given, law=law, steps=steps: partial(rebound, *given, law, steps=steps), many)
        for name, (law, steps) in front_ways.laws(nodes, steps).items()
    }
    call: front_ways.Ways = {
        name: (front_ways.one_by_one(rebound, law=law, steps=steps), impacts)
        for name, (law, steps) in front_ways.laws(nodes if quick else nodes[1:], steps if quick else steps[2:]).items()
    }
    springs = front_ways.ALL_SPRINGS_STEPS[1::2] if quick else front_ways.ALL_SPRINGS_STEPS
    for steps in [front_ways.COLLIDE_STEPS, *springs]:
        name = "collide" if steps == front_ways.COLLIDE_STEPS else f"collide, {steps} steps"
        call[name] = front_ways.by_collide("microslip", steps), some

    def psi_2(answers: Any) -> Array:
        return np.array([getattr(one, "psi_2", one) for one in answers])

    def problem(answers: Any) -> str:
        """Friction's impulse beyond mu times the normal one, or motion gained."""
        after = psi_2(answers)
        if not np.isfinite(after).all():
            return "not finite"
        if (np.abs(psi_1 - after) > 4.0 * chi * (1.0 + 1e-9)).any():
            return "outside the friction cone"
        return "tangential energy grown" if (np.abs(after) > psi_1 + 1e-3).any() else ""

    first, second = (
        front_ways.ladder(ways | slow, impacts, lambda answers: psi_2(answers) - truth, rounds, problem)
        for ways, rounds in ((batch, 7 if quick else 25), (call, repeats))
    )
    return first, second


def _limits(data: Data) -> list[Limit]:
    limits = [Limit(f"methods both closer and faster than the default, {USES[use]}", 0.0,
                    one["rungs"][front_ways.DEFAULT]["beaten"]) for use, one in data["uses"].items()]  # fmt: skip
    limits += [
        Limit(f"times {what}, {USES[use]}", asked, data[key][use], at_least=True)
        for use in ("batch", "call")
        for what, key, asked in (("closer than a single spring at equal time", "closer", front_ways.CLOSER),
                                 ("faster than annuli at equal error", "faster", front_ways.FASTER))
    ]  # fmt: skip
    rates = {name: one for name, one in data["rates"].items() if one["largest"] <= RATE_ERROR}
    for setting in ("default", f"{front_ways.CHEAP[0]} nodes"):
        name = f"a million impacts, error <= {RATE_ERROR:g}, {setting}"
        rate = max((one["rate"]["median"] for name, one in rates.items() if name.startswith(setting)), default=0.0)
        limits.append(Limit(name, RATE, rate, "million a second", at_least=True))
    batch, times = front.of_families(data["uses"]["batch"], ["microslip"])
    limits += [
        Limit(f"fastest microslip with an error <= {1e3 * error:g}e-3", time,
              min((times[name] for name in times if batch[name] <= error), default=float("inf")), "us")
        for error, time in QUICK_ENOUGH.items()
    ]  # fmt: skip
    limits += [Limit("default settings, error", 1e-3, batch[front_ways.DEFAULT]),
               Limit("default settings, time", QUICK_ENOUGH[1e-3], times[front_ways.DEFAULT], "us")]  # fmt: skip
    return [*limits, Limit("difference of the two references", 1e-4, data["reference_apart"])]
