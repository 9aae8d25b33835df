"""Error against run time of whole impacts."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from contactlaw import rebound
from contactlaw.laws import LAWS, Law
from contactlaw.laws.microslip import Microslip
from validation.case import Case, Data, Limit, Outcome, Progress, Table, register
from validation.impacts import judge, sticking
from validation.measure import interleaved, spread
from validation.picture import LAW_STYLES, panels

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CHIS = [0.5, 1.0, 1.441, 2.0]
GRID = [
    (4, 16), (4, 24), (4, 48), (6, 24), (6, 32), (6, 40), (8, 32), (8, 40), (8, 48), (8, 64),
    (12, 48), (12, 64), (12, 96), (16, 64), (16, 96), (16, 128), (16, 192),
    (24, 128), (24, 256), (32, 256), (32, 512),
]  # fmt: skip
SINGLE = [(name, steps) for name in ("linear_spring", "mindlin", "mindlin_rescaled") for steps in (32, 128)]
DEFAULT, BESIDE = "microslip, default", "mindlin, 128 steps"
BATCH = 100_000


@register
class ReboundCost(Case):
    """Time per impact of `contactlaw.rebound` beside its error."""

    name = "rebound_cost"
    place = 40
    title = "Error against run time"
    claim = (
        "At the same run time `microslip` is far closer than the single-spring laws. An impact by "
        "`contactlaw.rebound` is asked to cost at most 12 us on one core for an error of 0.001, and 2 us for 0.007."
    )
    caption = (
        "Largest error in psi_2 over time per impact. Line: the settings of microslip that nothing beats in both. "
        "Impacts that slip throughout are left out: they cost no steps and have no error."
    )

    def run(self, quick: bool, progress: Progress) -> Outcome:
        """All settings on the same impacts, interleaved."""
        impacts = [(psi_1, chi, 1.0) for chi in CHIS for psi_1 in sticking(chi, 8 if quick else 20)]
        truth = judge(impacts, progress=lambda part: progress(0.5 * part))
        settings: dict[str, tuple[Law, int | None]] = {DEFAULT: (LAWS["microslip"], None)}
        settings |= {f"microslip, {n} nodes, {s} steps": (Microslip(node_count=n), s) for n, s in GRID}
        settings |= {f"{name}, {s} steps": (LAWS[name], s) for name, s in SINGLE}
        errors, problems = {}, []
        for name, (law, steps) in settings.items():
            psi_2 = np.atleast_1d(rebound(truth.psi_1, truth.chi, law, steps=steps))
            errors[name] = float(np.abs(psi_2 - truth.psi_2).max())
            if not np.isfinite(psi_2).all():
                problems.append(f"{name}: psi_2 not finite")
            if law.name == "microslip" and (np.abs(psi_2) > truth.psi_1 + 1e-3).any():
                problems.append(f"{name}: tangential energy grown")

        copies = (1000 if quick else 4000) // len(impacts)
        psi_1, chi = np.tile(truth.psi_1, copies), np.tile(truth.chi, copies)
        runs = {name: partial(rebound, psi_1, chi, law, steps=steps) for name, (law, steps) in settings.items()}
        seconds = interleaved(runs, 9 if quick else 40, progress=lambda part: progress(0.5 + 0.4 * part))
        times = {name: spread(1e6 * s / psi_1.size) for name, s in seconds.items()}
        beside = {name: spread(s / seconds[BESIDE]) for name, s in seconds.items()}
        throughput = self._throughput(3 if quick else 9)
        single = spread(1e6 * interleaved({"one": partial(rebound, 1.2, 1.441)}, 50)["one"])
        fastest = {
            asked: min(
                (times[k]["median"] for k in times if "microslip" in k and errors[k] <= asked), default=float("inf")
            )
            for asked in (1e-3, 7e-3)
        }
        data = {
            "impacts": len(impacts), "chi": CHIS, "error": errors, "microseconds": times, "over_mindlin": beside,
            "front": _front(errors, times), "throughput": throughput, "one_call_microseconds": single,
        }  # fmt: skip
        limits = [
            Limit("fastest microslip with an error <= 1e-3", 12.0, fastest[1e-3], "us"),
            Limit("fastest microslip with an error <= 7e-3", 2.0, fastest[7e-3], "us"),
            Limit("default settings, error", 1e-3, errors[DEFAULT]),
            Limit("default settings, time", 12.0, times[DEFAULT]["median"], "us"),
        ]
        return Outcome(limits, data, problems)

    def _throughput(self, repeats: int) -> dict[str, dict[str, float]]:
        """Impacts a second on one core, in one call: random ones, those that slip throughout among them."""
        random = np.random.default_rng(1)
        chi = random.uniform(0.5, 2.0, BATCH)
        psi_1 = random.uniform(0.0, 1.0, BATCH) * (4.0 * chi + 1.5)
        coarse = Microslip(node_count=8)
        runs = {
            "default": partial(rebound, psi_1, chi),
            "8 nodes, 48 steps": partial(rebound, psi_1, chi, coarse, steps=48),
        }
        return {name: spread(BATCH / seconds) for name, seconds in interleaved(runs, repeats).items()}

    def table(self, data: Data) -> Table:
        """A row a setting, by time."""
        table = Table(
            ["setting", "largest error", "time [us]", "quartiles [us]", "time over mindlin's", "on the front"]
        )
        for name, time in sorted(data["microseconds"].items(), key=lambda item: item[1]["median"]):
            table.rows.append(
                [name, f"{data['error'][name]:.1e}", f"{time['median']:.2f}",
                 f"{time['low']:.2f} to {time['high']:.2f}",
                 f"{data['over_mindlin'][name]['median']:.2f}", "yes" if name in data["front"] else ""]
            )  # fmt: skip
        for name, rate in data["throughput"].items():
            table.rows.append([f"1e5 random impacts in one call, {name}", "", f"{1e6 / rate['median']:.2f}", "",
                               f"{rate['median'] / 1e6:.2f} million a second", ""])  # fmt: skip
        one = data["one_call_microseconds"]
        table.rows.append(["one impact, one call from Python, default", "", f"{one['median']:.1f}",
                           f"{one['low']:.1f} to {one['high']:.1f}", "", ""])  # fmt: skip
        return table

    def draw(self, data: Data) -> Figure:
        """Error over time."""
        figure, (axes,) = panels(1, width=6.4, height=4.2)
        for law in ("microslip", *dict(SINGLE)):
            style = LAW_STYLES[law]
            names = [name for name in data["error"] if name.startswith(f"{law},") and name != DEFAULT]
            points = [(data["microseconds"][name]["median"], data["error"][name]) for name in names]
            axes.loglog(*zip(*points, strict=True), **{**style, "linestyle": "none"}, label=law)
        front = [(data["microseconds"][name]["median"], data["error"][name], name) for name in data["front"]]
        axes.loglog([x for x, _, _ in front], [y for _, y, _ in front], color="black", linewidth=0.8)
        labelled = float("inf")
        for x, y, name in front:
            if name != DEFAULT and y < 0.6 * labelled:
                labelled = y
                nodes, steps = (word.split()[0] for word in name.split(", ")[1:])
                axes.annotate(
                    f"{nodes}/{steps}",
                    (x, y),
                    xytext=(-5, -5),
                    textcoords="offset points",
                    fontsize=7,
                    ha="right",
                    va="top",
                )
        axes.loglog(data["microseconds"][DEFAULT]["median"], data["error"][DEFAULT], "*", color="#c44e00",
                    markersize=13, markeredgecolor="black", label="default")  # fmt: skip
        for time, error in ((12.0, 1e-3), (2.0, 7e-3)):
            axes.plot([axes.get_xlim()[0], time, time], [error, error, axes.get_ylim()[0]], color="black",
                      linewidth=0.7, linestyle=(0, (8, 4)))  # fmt: skip
            axes.annotate(
                f"asked: {error:g} in {time:g} us", (time, error), xytext=(3, 3), textcoords="offset points", fontsize=7
            )
        axes.set(xlabel="time per impact, one core [us]", ylabel=r"largest error in $\psi_2$ [-]",
                 title=r"$\chi$ from 0.5 to 2, e = 1; numbers: nodes/steps")  # fmt: skip
        axes.legend(loc="upper right")
        return figure


def _front(errors: dict[str, float], times: dict[str, dict[str, float]]) -> list[str]:
    """Settings of microslip that no other beats in both error and time, by time; the default is one of the grid's."""
    best, front = float("inf"), []
    for name in sorted(times, key=lambda key: times[key]["median"]):
        if name.startswith("microslip") and errors[name] < best:
            best = errors[name]
            front.append(name)
    return front
