"""Error against run time of the law alone: every law, the annuli and the superposition method, in four uses."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from contactlaw import Body, ContactPair, collide, rebound
from contactlaw.laws import Law
from validation import front, million
from validation.case import Array, Case, Data, Limit, Outcome, Progress, Table, register
from validation.front import Rung
from validation.front_ways import (
    ALL_SPRINGS_STEPS,
    ANNULI,
    COLLIDE_STEPS,
    DEFAULT,
    FEW_ANNULI,
    SINGLE,
    SUPERPOSITION,
    along_paths,
    histories,
    laws,
    rungs,
    sample,
    thrown,
)
from validation.impacts import judge, sticking
from validation.reference import annulus, superposition
from validation.substeps import substep_times

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CHIS = [0.5, 1.0, 1.441, 2.0]
NODES = [4, 8, 16, 24, 32]
STEPS = [16, 24, 32, 48, 64, 96, 128, 192, 256, 384, 512]
FINE = 16000  # steps of the superposition method; with half as many extrapolated to the truth
CLOSER, FASTER = 30.0, 100.0
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


@register
class FrontLaw(Case):
    """Time per impact beside error, without an engine."""

    name = "front_law"
    place = 42
    title = "Error and time without an engine"
    claim = (
        "A user decides by error against run time. The default law with default settings is asked to be on the front, "
        "where no other law, setting or method is both closer and faster; to be 30 times closer than the single-spring "
        "laws at equal run time, and 100 times faster than the annulus reference at equal error; an impact in a batch "
        "to cost at most 12 us for an error of 0.001, and 2 us for 0.007; and a million impacts to run at 0.8 million "
        "a second on two cores, within 0.007. A substep, which the engines take, is timed by itself."
    )
    caption = (
        "Error over time, one core. Impacts: largest error in psi_2, chi from 0.5 to 2, elastic, those that slip "
        "throughout left out. Forces: largest error of F over mu P_max at any instant. Line: the front, what nothing "
        "beats in both. Numbers: nodes/steps of microslip; all: all springs at once, as the forces are taken by "
        "default. Errors below 1e-7 are drawn there: along a path the superposition method is exact, and, by another "
        "route, the default."
    )

    def run(self, quick: bool, progress: Progress) -> Outcome:
        """Four uses, each timed side by side; then a million impacts."""
        impacts = [(psi_1, chi) for chi in CHIS for psi_1 in sticking(chi, 5 if quick else 20)]
        psi_1, chi = np.array(impacts).T.copy()
        fine, finer = (_superposed(impacts, steps) for steps in (FINE // 2, FINE))
        truth = finer + (finer - fine) / 3.0
        progress(0.05)
        spot = judge([(*one, 1.0) for one in impacts[:: 10 if quick else 5]])
        apart = float(np.abs(spot.psi_2 - truth[:: 10 if quick else 5]).max())
        progress(0.15)
        uses: dict[str, Data] = {}
        repeats = 3 if quick else 15
        uses["batch"] = front.weighed(_batch(psi_1, chi, truth, 7 if quick else 25, quick))
        progress(0.3)
        uses["call"] = front.weighed(_calls(psi_1, chi, truth, repeats, quick))
        progress(0.5)
        uses["history"] = front.weighed(histories([impacts[i] for i in sample(len(impacts))], repeats, quick))
        progress(0.6)
        uses["path"] = front.weighed(along_paths(repeats, quick))
        progress(0.7)
        rates = million.rates(2 if quick else 3, million.MILLION // 10 if quick else million.MILLION)
        data = {"impacts": len(impacts), "chi": CHIS, "reference_apart": apart, "uses": uses, "rates": rates,
                "substeps": substep_times(15 if quick else 100)}  # fmt: skip
        data["closer"] = {use: front.closer(one, DEFAULT, SINGLE) for use, one in uses.items()}
        data["faster"] = {use: front.faster(one, DEFAULT, ["annuli"]) for use, one in uses.items()}
        return Outcome(_limits(data), data, _problems(uses))

    def table(self, data: Data) -> Table:
        """The front of each use, then the comparisons, then the million."""
        table = Table(["use", *front.HEADS])
        for use, one in data["uses"].items():
            table.rows.extend([use, *row] for row in front.rows(one, DEFAULT))
            for name, words in front.COMPARED.items():
                exact = name == "closer" and one["rungs"][DEFAULT]["largest"] < EXACT
                times = "exact" if exact else f"{front.short(data[name][use])} times"
                table.rows.append([use, words, *[""] * 5, times])
        for name, one in data["rates"].items():
            rate = one["rate"]
            table.rows.append(
                ["1e6 impacts", name, f"{one['largest']:.1e}", f"{one['rms']:.1e}", front.short(1.0 / rate["median"]),
                 f"{1.0 / rate['high']:.3g} to {1.0 / rate['low']:.3g}", "", f"{rate['median']:.2f} million a second"]
            )  # fmt: skip
        for name, one in data["substeps"].items():
            table.rows.append(["a substep", name, "", "", f"{1e-3 * one['median']:.3f}",
                               f"{1e-3 * one['low']:.3f} to {1e-3 * one['high']:.3f}", "", ""])  # fmt: skip
        return table

    def draw(self, data: Data) -> Figure:
        """A panel a use."""
        from matplotlib.figure import Figure

        figure = Figure(figsize=(9.6, 7.8), layout="constrained")
        all_axes = list(figure.subplots(2, 2).flat)
        for axes, (use, one) in zip(all_axes, data["uses"].items(), strict=True):
            front.plot(axes, one, DEFAULT, floor=EXACT)
            what = r"$F/\mu P_{max}$" if use in ("history", "path") else r"$\psi_2$"
            axes.set(xlabel=f"time {'a path' if use == 'path' else 'an impact'} [us]", title=USES[use],
                     ylabel=f"largest error in {what} [-]")  # fmt: skip
        figure.legend(*all_axes[1].get_legend_handles_labels(), loc="outside lower center", ncols=5)
        return figure


def _superposed(impacts: list[tuple[float, float]], steps: int) -> Array:
    return np.array([superposition.impact(*one, steps).psi_2 for one in impacts])


def _not_sane(psi_1: Array, chi: Array, psi_2: Array) -> str:
    """What is wrong with an answer: friction's impulse beyond mu times the normal one, or motion gained."""
    if not np.isfinite(psi_2).all():
        return "not finite"
    if (np.abs(psi_1 - psi_2) > 4.0 * chi * (1.0 + 1e-9)).any():
        return "outside the friction cone"
    if (np.abs(psi_2) > psi_1 + 1e-3).any():
        return "tangential energy grown"
    return ""


def _batch(psi_1: Array, chi: Array, truth: Array, repeats: int, quick: bool) -> dict[str, Rung]:
    """Impacts by the thousand; the two references, which know no batches, one after the other."""
    copies = 400 // psi_1.size
    many = np.tile(psi_1, copies), np.tile(chi, copies)
    runs: dict[str, Callable[[], object]] = {}
    answers, counts = {}, {}
    for name, (law, steps) in laws(NODES[1::2] if quick else NODES, STEPS[::3] if quick else STEPS).items():
        runs[name] = partial(rebound, *many, law, steps=steps)
        answers[name] = np.asarray(rebound(psi_1, chi, law, steps=steps))
        counts[name] = many[0].size
    _add_methods(psi_1, chi, runs, answers, counts, quick)
    problems = {name: _not_sane(psi_1, chi, answer) for name, answer in answers.items()}
    return rungs(runs, counts, {name: answer - truth for name, answer in answers.items()}, repeats, problems)


def _calls(psi_1: Array, chi: Array, truth: Array, repeats: int, quick: bool) -> dict[str, Rung]:
    """One impact a call from Python, by `rebound` and by `collide`, at its default and in other steps."""
    one_by_one = list(zip(psi_1.tolist(), chi.tolist(), strict=True))

    def call(law: Law, steps: int | None) -> list[float | Array]:
        return [rebound(*one, law, steps=steps) for one in one_by_one]

    def whole(impacts: list[tuple[ContactPair, Body]], steps: int) -> list[float]:
        return [collide(*one, steps=steps).psi_2 for one in impacts]

    runs: dict[str, Callable[[], object]] = {}
    answers, counts = {}, {}
    for name, setting in laws(NODES[1::2] if quick else NODES[1:], STEPS[::3] if quick else STEPS[2:]).items():
        runs[name] = partial(call, *setting)
        answers[name], counts[name] = np.array(runs[name]()), psi_1.size
    chosen = sample(psi_1.size)
    bodies = [thrown("microslip", *one) for one in one_by_one]
    some = ALL_SPRINGS_STEPS[1::2] if quick else ALL_SPRINGS_STEPS
    settings = {"collide": COLLIDE_STEPS} | {f"collide, {steps} steps": steps for steps in some}
    for name, steps in settings.items():
        runs[name] = partial(whole, [bodies[i] for i in chosen], steps)
        answers[name], counts[name] = np.array(whole(bodies, steps)), chosen.size
    _add_methods(psi_1, chi, runs, answers, counts, quick)
    problems = {name: _not_sane(psi_1, chi, answer) for name, answer in answers.items()}
    return rungs(runs, counts, {name: answer - truth for name, answer in answers.items()}, repeats, problems)


def _add_methods(
    psi_1: Array, chi: Array, runs: dict[str, Callable[[], object]], answers: dict[str, Array],
    counts: dict[str, int], quick: bool,
) -> None:  # fmt: skip
    """The two methods of the reference, timed on a part of the impacts."""
    impacts = list(zip(psi_1.tolist(), chi.tolist(), strict=True))
    chosen = [impacts[i] for i in sample(len(impacts))]

    def march(solve: Callable[..., Any], size: int, given: list[tuple[float, float]]) -> list[float]:
        return [solve(*one, size).psi_2 for one in given]

    methods = [("superposition", n, "steps", superposition.impact) for n in SUPERPOSITION]
    methods += [("annuli", n, "annuli", annulus.impact) for n in (FEW_ANNULI if quick else ANNULI)]
    for family, size, unit, solve in methods:
        name = f"{family}, {size} {unit}" if unit == "steps" else f"{family}, N = {size}"
        runs[name] = partial(march, solve, size, chosen)
        answers[name], counts[name] = np.array(march(solve, size, impacts)), len(chosen)


def _limits(data: Data) -> list[Limit]:
    limits = [
        Limit(f"ways that beat the default in both, {USES[use]}", 0.0, _beats(one)) for use, one in data["uses"].items()
    ]
    for use in ("batch", "call"):
        limits += [
            Limit(f"times closer than a single spring as fast, {USES[use]}", CLOSER, data["closer"][use],
                  at_least=True),
            Limit(f"times faster than annuli as close, {USES[use]}", FASTER, data["faster"][use],
                  at_least=True),
        ]  # fmt: skip
    rates = {name: one for name, one in data["rates"].items() if one["largest"] <= RATE_ERROR}
    for setting in ("default", f"{million.CHEAP[0]} nodes"):
        rate = max((one["rate"]["median"] for name, one in rates.items() if name.startswith(setting)), default=0.0)
        limits.append(
            Limit(f"a million impacts, error <= {RATE_ERROR:g}, {setting}", RATE, rate, "million a second",
                  at_least=True)
        )  # fmt: skip
    batch, times = front.of_families(data["uses"]["batch"], ["microslip"])
    limits += [
        Limit(f"fastest microslip with an error <= {1e3 * error:g}e-3", time,
              min((times[name] for name in times if batch[name] <= error), default=float("inf")), "us")
        for error, time in QUICK_ENOUGH.items()
    ]  # fmt: skip
    limits += [Limit("default settings, error", 1e-3, batch[DEFAULT]),
               Limit("default settings, time", QUICK_ENOUGH[1e-3], times[DEFAULT], "us")]  # fmt: skip
    return [*limits, Limit("the two references apart", 1e-4, data["reference_apart"])]


def _beats(one: Data) -> float:
    """Number of ways that are closer and faster than the default."""
    return float(one["rungs"][DEFAULT]["beaten"])


def _problems(uses: dict[str, Data]) -> list[str]:
    """The default must be sane; other ways that are not do not count, and the table says so."""
    found = [(use, one["rungs"][DEFAULT]["problem"]) for use, one in uses.items()]
    return [f"{USES[use]}, {DEFAULT}: {problem}" for use, problem in found if problem]
