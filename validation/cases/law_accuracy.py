"""How close each law comes to the converged solution."""

import numpy as np

from contactlaw import LAWS, rebound
from validation.case import Array, Axes, Case, Data, Limit, Outcome, Table
from validation.front import rms
from validation.impacts import Judged, incidences, judge
from validation.picture import LAW_STYLES, legend_below

RESTITUTIONS = [1.0, 0.93, 0.86, 0.5]
SHOWN = 1.441  # the chi of the picture over psi_1: a steel ball


class LawAccuracy(Case):
    """The default law, `microslip`, gives the tangential rebound of an impact to within 0.001 of the converged solution
    (chi from 0.5 to 2; 0.005 at chi = 4.5). The single-spring laws of discrete-element codes, and the rigid friction of
    the engines, are far off.
    """

    place = 10
    title = "How close the laws come"
    sheet = {"columns": 2}
    caption = (
        "Left: error in psi_2 of an elastic steel ball over the angle of incidence. Right: largest error over chi."
    )

    def run(self, quick: bool) -> Outcome:
        chis = [0.5, 1.256, SHOWN, 2.0, 4.5] if quick else [0.5, 0.75, 1.0, 1.256, SHOWN, 1.75, 2.0, 4.5]
        restitutions = [1.0, 0.86] if quick else RESTITUTIONS
        parts: list[Judged] = []
        for chi in chis:
            count = 5 if quick else (9 if chi > 3.0 else 13)
            if chi == SHOWN:
                count = 9 if quick else 25
            damping = restitutions[:1] if quick and chi > 3.0 else restitutions
            impacts = [(psi_1, chi, e) for e in damping for psi_1 in incidences(chi, count)]
            parts.append(judge(impacts, 64 if chi > 3.0 else 40))
        truth = Judged(*map(np.concatenate, zip(*parts, strict=True)))
        errors = {name: np.abs(rebound(truth.psi_1, truth.chi, name, truth.restitution) - truth.psi_2) for name in LAWS}
        common = truth.chi <= 2.0
        shown = (truth.chi == SHOWN) & (truth.restitution == 1.0)

        def largest(of: Array) -> dict[str, list[float]]:
            """Of each law in several sets of impacts."""
            return {name: [float(error[part].max()) for part in of] for name, error in errors.items()}

        data = {
            "chi": chis,
            "largest_over_chi": largest(np.array([truth.chi == chi for chi in chis])),
            "rms": {name: rms(error[common]) for name, error in errors.items()},
            "reference_uncertainty": [float(truth.uncertainty[truth.chi == chi].max()) for chi in chis],
            "shown": {"chi": SHOWN, "psi_1": truth.psi_1[shown]},
            "shown_errors": {name: error[shown] for name, error in errors.items()},
        }  # fmt: skip
        default = errors["microslip"]
        limits = [
            Limit("largest error of microslip, chi 0.5 to 2", 1e-3, float(default[common].max())),
            Limit("largest error of microslip, chi 4.5", 5e-3, float(default[~common].max())),
            Limit("largest error of the reference itself", 5e-4, float(truth.uncertainty.max())),
        ]
        return Outcome(limits, data)

    def table(self, data: Data) -> Table:
        errors = " | ".join(f"{{errors[{n}]:.1e}}" for n in range(len(data["chi"])))
        table = Table(f"law | {' | '.join(f'chi = {chi:g}' for chi in data['chi'])} | rms, chi <= 2")
        for name, found in data["largest_over_chi"].items():
            table.add(f"{name} | {errors} | {data['rms'][name]:.1e}", errors=found)
        table.add(f"(the reference itself) | {errors}", errors=data["reference_uncertainty"])
        return table

    def draw(self, data: Data, left: Axes, right: Axes) -> None:
        for name in data["shown_errors"]:
            style = LAW_STYLES[name]
            left.semilogy(data["shown"]["psi_1"], np.maximum(data["shown_errors"][name], 1e-6), **style, label=name)
            right.semilogy(data["chi"], data["largest_over_chi"][name], **style, label=name)
        left.set(xlabel=r"incidence $\psi_1$ [-]", ylabel=r"error in $\psi_2$ [-] (below $10^{-6}$: drawn there)",
                 title=rf"$\chi$ = {data['shown']['chi']}, e = 1")  # fmt: skip
        right.set(xlabel=r"$\chi$ [-]", ylabel=r"largest error in $\psi_2$ [-]",
                  title="all incidences and restitutions")  # fmt: skip
        right.plot([0.5, 2.0, 2.0, 4.5], [1e-3, 1e-3, 5e-3, 5e-3], color="black", linewidth=0.8, linestyle=(0, (8, 4)),
                   label="asked of microslip")  # fmt: skip
        legend_below(right, 6)
