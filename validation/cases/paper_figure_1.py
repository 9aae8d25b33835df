"""Fig. 1 of Maw, Barber & Fawcett (1981): the tangential force during the impact of a steel puck."""

import numpy as np

from sims.puck import Puck
from validation.case import Axes, Case, Data, Limit, Outcome
from validation.rebound_figure import thrown
from validation.reference.annulus import impact

INCIDENCES = [0.5, 1.0, 1.2, 2.0, 3.0, 4.0, 5.0]
LABELS = {0.5: 0.355, 1.0: 0.355, 1.2: 0.355, 2.0: 0.605, 3.0: 0.73, 4.0: 0.855, 5.0: 0.94}
"""At which tau the picture names a curve, between the marks."""
DASHES = ["-", "--", "-", "-.", (0, (5, 1, 1, 1, 1, 1)), ":", (0, (8, 3))]
MARKS = 24  # of the law, a curve
REFERENCE_STEPS = 2000
LAW_STEPS = 1200


class PaperFigure1(Case):
    """The law gives the tangential force at every instant of a steel puck's impact, not only its rebound. At every
    angle of incidence it starts to stick, reverses and slips back at the same times as the annulus solution.
    """

    place = 2
    title = "Paper, figure 1: tangential force during an impact"
    sheet = {"width": 6.4, "height": 4.8}
    caption = (
        "Tangential force over mu times the greatest normal force, over time in units of the contact's duration; "
        "steel puck, chi = 1.256, e = 1. Lines: annulus solution; open circles: microslip. Grey: the friction limits "
        "+-P/P_max."
    )

    def run(self, quick: bool) -> Outcome:
        annuli = 40 if quick else 100
        curves, problems = [], []
        for psi_1 in INCIDENCES:
            puck = Puck(material="steel", psi_1=psi_1, restitution=1.0)
            reference = impact(psi_1, puck.chi, annuli, steps=REFERENCE_STEPS)
            law = thrown(puck, steps=LAW_STEPS)
            largest = float(law.normal_force.max())
            time = law.time / law.time[-1]
            force = -law.tangential_force @ puck.tangent / (puck.pair.friction * largest)
            if np.any(np.abs(force) > law.normal_force / largest + 1e-9):
                problems.append(f"psi_1 = {psi_1:g}: the law leaves the friction cone")
            difference = np.interp(reference.time, time, force) - reference.tangential_force
            stuck = np.flatnonzero(reference.stuck.any(axis=1))
            shown, at = np.linspace(0.0, 1.0, MARKS + 1), np.linspace(0.0, 1.0, 201)
            curves.append({
                "psi_1": psi_1, "tau": at, "reference": np.interp(at, reference.time, reference.tangential_force),
                "tau_law": shown, "law": np.interp(shown, time, force),
                "difference": float(np.abs(difference).max()),
                "difference_at": float(reference.time[np.abs(difference).argmax()]),
                "stick": float(reference.time[stuck[0]]) if stuck.size else None,
                "slip_again": float(reference.time[stuck[-1]]) if stuck.size else None,
                "least": float(reference.tangential_force.min()),
            })  # fmt: skip
        envelope = np.interp(at, reference.time, reference.normal_force)
        largest_difference = max(curve["difference"] for curve in curves)
        data = {"tau": at, "envelope": envelope, "curves": curves}
        return Outcome([Limit("largest difference in F/(mu P_max)", 5e-3, largest_difference)], data, problems)

    def draw(self, data: Data, axes: Axes) -> None:
        envelope = np.array(data["envelope"])
        for sign in (1.0, -1.0):
            axes.plot(data["tau"], sign * envelope, color="#aaaaaa", linewidth=2.5)
        for dashes, curve in zip(DASHES, data["curves"], strict=True):
            axes.plot(curve["tau"], curve["reference"], color="black", linestyle=dashes)
            axes.plot(curve["tau_law"], curve["law"], "o", color="#c44e00", markersize=4, fillstyle="none")
            at = LABELS[curve["psi_1"]]
            height = float(np.interp(at, curve["tau"], curve["reference"]))
            axes.annotate(
                f"{curve['psi_1']:g}", (at, height), fontsize=8, ha="center", va="center",
                bbox={"boxstyle": "round,pad=0.12", "facecolor": "white", "edgecolor": "none"},
            )  # fmt: skip
        axes.plot([], [], color="#aaaaaa", linewidth=2.5, label=r"envelope $\pm P/P_{max}$")
        axes.plot([], [], color="black", label=r"annuli (numbers: $\psi_1$)")
        axes.plot([], [], "o", color="#c44e00", markersize=4, fillstyle="none", label="microslip law")
        axes.axhline(0.0, color="black", linewidth=0.8)
        axes.set(
            xlabel=r"time over duration of contact, $\tau$ [-]", ylabel=r"$F\,/\,\mu P_{max}$ [-]",
            xlim=(0.0, 1.0), ylim=(-1.05, 1.05), xticks=np.linspace(0.0, 1.0, 11), title=r"steel, $\chi$ = 1.256",
        )  # fmt: skip
        axes.legend(loc="lower left")
