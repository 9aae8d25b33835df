"""How close each law comes to the converged solution."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from contactlaw import LAWS, rebound
from validation.case import Case, Data, Limit, Outcome, Progress, Table, register
from validation.impacts import Impact, incidences, judge, together
from validation.picture import LAW_STYLES, panels

if TYPE_CHECKING:
    from matplotlib.figure import Figure

RESTITUTIONS = [1.0, 0.93, 0.86, 0.5]
SHOWN = 1.441  # the chi of the picture over psi_1: a steel ball


@register
class LawAccuracy(Case):
    """Largest error in psi_2 of every law at default settings."""

    name = "law_accuracy"
    place = 10
    title = "How close the laws come"
    claim = (
        "The default law, `microslip`, gives the tangential rebound of an impact to within 0.001 of the converged "
        "solution (chi from 0.5 to 2; 0.005 at chi = 4.5). The single-spring laws of discrete-element codes, and the "
        "rigid friction of the engines, are far off."
    )
    caption = "Left: error in psi_2 over the angle of incidence, a steel ball, elastic. Right: largest error over chi."

    def run(self, quick: bool, progress: Progress) -> Outcome:
        """Every law against the extrapolated annulus solver."""
        chis = [0.5, 1.256, SHOWN, 2.0, 4.5] if quick else [0.5, 0.75, 1.0, 1.256, SHOWN, 1.75, 2.0, 4.5]
        restitutions = [1.0, 0.86] if quick else RESTITUTIONS
        rounds = []
        for chi in chis:
            count = 5 if quick else (9 if chi > 3.0 else 13)
            if chi == SHOWN:
                count = 9 if quick else 25
            damping = restitutions[:1] if quick and chi > 3.0 else restitutions
            rounds.append([(psi_1, chi, e) for e in damping for psi_1 in incidences(chi, count)])
        parts = [judge(impacts, 64 if impacts[0][1] > 3.0 else 40) for impacts in self._told(rounds, progress)]
        truth = together(parts)
        errors = {name: np.abs(rebound(truth.psi_1, truth.chi, name, truth.restitution) - truth.psi_2) for name in LAWS}
        problems = [
            f"{name} gives a value that is not finite" for name, error in errors.items() if not np.isfinite(error).all()
        ]
        common = truth.chi <= 2.0
        data = {
            "impacts": truth.chi.size,
            "restitutions": restitutions,
            "chi": chis,
            "largest_over_chi": {
                name: [float(error[truth.chi == chi].max()) for chi in chis] for name, error in errors.items()
            },
            "largest_over_restitution": {
                name: [float(error[common & (truth.restitution == e)].max()) for e in restitutions]
                for name, error in errors.items()
            },
            "rms": {name: float(np.sqrt(np.mean(error[common] ** 2))) for name, error in errors.items()},
            "reference_uncertainty": [float(truth.uncertainty[truth.chi == chi].max()) for chi in chis],
            "shown": {"chi": SHOWN, "psi_1": truth.psi_1[(truth.chi == SHOWN) & (truth.restitution == 1.0)]},
            "shown_errors": {
                name: error[(truth.chi == SHOWN) & (truth.restitution == 1.0)] for name, error in errors.items()
            },
        }
        default = errors["microslip"]
        limits = [
            Limit("largest error of microslip, chi 0.5 to 2", 1e-3, float(default[common].max())),
            Limit("largest error of microslip, chi 4.5", 5e-3, float(default[~common].max())),
            Limit("largest error of the reference itself", 5e-4, float(truth.uncertainty.max())),
        ]
        return Outcome(limits, data, problems)

    def _told(self, rounds: list[list[Impact]], progress: Progress) -> Iterator[list[Impact]]:
        """The rounds, telling the part done; the last, at the highest chi, takes as long as all others together."""
        for number, impacts in enumerate(rounds):
            progress(0.5 * number / (len(rounds) - 1))
            yield impacts

    def table(self, data: Data) -> Table:
        """A row a law."""
        heads = ["law", *(f"chi = {chi:g}" for chi in data["chi"]), "rms, chi <= 2"]
        rows: list[Sequence[str]] = [
            [name, *(f"{error:.1e}" for error in errors), f"{data['rms'][name]:.1e}"]
            for name, errors in data["largest_over_chi"].items()
        ]
        rows.append(["(the reference itself)", *(f"{error:.1e}" for error in data["reference_uncertainty"]), ""])
        return Table(heads, rows)

    def draw(self, data: Data) -> Figure:
        """Error over psi_1 and largest error over chi."""
        figure, (left, right) = panels(2)
        for name in data["shown_errors"]:
            style = LAW_STYLES[name]
            left.semilogy(data["shown"]["psi_1"], np.maximum(data["shown_errors"][name], 1e-6), **style, label=name)
            right.semilogy(data["chi"], data["largest_over_chi"][name], **style, label=name)
        left.set(xlabel=r"incidence $\psi_1$ [-]", ylabel=r"error in $\psi_2$ [-] (below $10^{-6}$: drawn there)",
                 title=rf"$\chi$ = {data['shown']['chi']}, e = 1")  # fmt: skip
        right.set(
            xlabel=r"$\chi$ [-]", ylabel=r"largest error in $\psi_2$ [-]", title="all incidences and restitutions"
        )
        right.plot([0.5, 2.0, 2.0, 4.5], [1e-3, 1e-3, 5e-3, 5e-3], color="black", linewidth=0.8, linestyle=(0, (8, 4)),
                   label="asked of microslip")  # fmt: skip
        figure.legend(*right.get_legend_handles_labels(), loc="outside lower center", ncols=6)
        return figure
