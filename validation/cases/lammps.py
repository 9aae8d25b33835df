"""A discrete-element code on the same impacts: LAMMPS's granular wall beside the ladder."""

from __future__ import annotations

from time import perf_counter
from typing import Any

import numpy as np

from contactlaw import rebound
from validation.case import Case, Data, Limit, Outcome, Progress, Table, register
from validation.impacts import judge, sticking
from validation.lammps_wall import VARIANTS, contact, impacts
from validation.measure import spread
from validation.prediction import SPHERE, rms

STEPS = [40, 160, 640, 2560]
DEFAULT = 160  # steps of `rebound` at this chi: cost is compared at as many
TWINS = {"mindlin/force": "mindlin", "mindlin_rescale/force": "mindlin_rescaled"}
"""LAMMPS's model and the rung with the same equations."""
MANY = 1000  # impacts in one run, for the cost of each


@register
class Lammps(Case):
    """Error and cost of LAMMPS's Mindlin contacts, and of the rungs, at one chi."""

    name = "lammps"
    place = 16
    title = "A discrete-element code"
    claim = (
        "LAMMPS, on the same impacts of a steel sphere on a wall, is as far from the reference as the single-spring "
        "rungs: `mindlin` is its mindlin/force and `mindlin_rescaled` its mindlin_rescale/force, the same equations "
        "and the same rebound. Kept as displacement, not as force (mindlin, mindlin_rescale), the spring errs most "
        "where impacts start stuck. `microslip` is hundreds of times closer than all four."
    )
    needs = ("lammps",)

    def run(self, quick: bool, progress: Progress) -> Outcome:
        """Four variants at several steps; cost at the steps that `rebound` takes."""
        pair = contact()
        chi = SPHERE * pair.kappa / 2.0
        psi_1 = np.array(sticking(chi, 8 if quick else 32))
        truth = judge([(psi, chi, 1.0) for psi in psi_1.tolist()], progress=lambda part: progress(0.5 * part))
        steps = STEPS[:3] if quick else STEPS
        runs = {variant: [impacts(psi_1, variant, count) for count in steps] for variant in VARIANTS}
        progress(0.8)
        laws = {law: np.asarray(rebound(psi_1, chi, law)) for law in ("mindlin", "mindlin_rescaled", "microslip")}
        twins = {
            variant: float(np.abs(runs[variant][-1].psi_2 - rebound(psi_1, chi, law, steps=4096)).max())
            for variant, law in TWINS.items()
        }
        problems = [
            f"{variant}: normal restitution {restitution:.6f} instead of 1"
            for variant, found in runs.items()
            for restitution in [float(found[-1].restitution[np.abs(found[-1].restitution - 1.0).argmax()])]
            if abs(restitution - 1.0) > 1e-3
        ]
        data = {
            "version": runs["mindlin"][0].version, "chi": chi, "psi_1": psi_1, "psi_2": truth.psi_2,
            "reference_uncertainty": float(truth.uncertainty.max()), "steps": steps,
            "variants": {
                variant: {
                    "psi_2": found[-1].psi_2,
                    "largest": [float(np.abs(one.psi_2 - truth.psi_2).max()) for one in found],
                    "rms": [rms(one.psi_2 - truth.psi_2) for one in found],
                    "microseconds": self._cost(chi, lambda psi, v=variant: impacts(psi, v, DEFAULT).seconds, quick),
                }
                for variant, found in runs.items()
            },
            "laws": {
                law: {
                    "psi_2": psi_2,
                    "largest": float(np.abs(psi_2 - truth.psi_2).max()),
                    "rms": rms(psi_2 - truth.psi_2),
                    "microseconds": self._cost(chi, lambda psi, law=law: timed(psi, chi, law), quick),
                }
                for law, psi_2 in laws.items()
            },
            "differs_from_twin": twins,
        }  # fmt: skip
        best = min(found["largest"][-1] for found in data["variants"].values())
        limits = [
            *(Limit(f"largest difference of LAMMPS's {variant} from {TWINS[variant]}", 2e-3, difference)
              for variant, difference in twins.items()),
            Limit("largest error of LAMMPS's best over that of microslip", 60.0,
                  best / data["laws"]["microslip"]["largest"], at_least=True),
        ]  # fmt: skip
        return Outcome(limits, data, problems)

    def _cost(self, chi: float, seconds: Any, quick: bool) -> dict[str, float]:
        """Microseconds an impact, of one among a thousand."""
        many = np.linspace(0.05, 4.0 * chi - 1.0, MANY)
        return spread(np.array([1e6 / MANY * seconds(many) for _ in range(4 if quick else 8)])[1:])

    def table(self, data: Data) -> Table:
        """Variants of LAMMPS, then the rungs."""
        counts = data["steps"]
        table = Table(["law", *(f"largest error, {count} steps" for count in counts),
                       "rms, finest",
                       "differs from the rung of its equations by",
                       f"one impact of {MANY}, {DEFAULT} steps [us]"])  # fmt: skip
        for variant, found in data["variants"].items():
            twin = data["differs_from_twin"].get(variant)
            table.rows.append(
                [f"LAMMPS {variant}: {VARIANTS[variant]}", *(f"{error:.3f}" for error in found["largest"]),
                 f"{found['rms'][-1]:.3f}",
                 f"{twin:.1e} ({TWINS[variant]})" if twin is not None else "",
                 f"{found['microseconds']['median']:.3g}"]
            )  # fmt: skip
        for law, found in data["laws"].items():
            errors = ["" if count != DEFAULT else f"{found['largest']:.2g}" for count in counts]
            table.rows.append(
                [f"contactlaw {law}", *errors, f"{found['rms']:.2g}", "",
                 f"{found['microseconds']['median']:.3g}"]
            )  # fmt: skip
        table.rows.append([f"(LAMMPS {data['version']}, chi = {data['chi']:.3f}, psi_1 to {data['psi_1'][-1]:.2f})",
                           *[""] * (len(counts) + 3)])  # fmt: skip
        return table


def timed(psi_1: np.ndarray, chi: float, law: str) -> float:
    """Seconds that a rung takes for these impacts."""
    start = perf_counter()
    rebound(psi_1, chi, law)
    return perf_counter() - start
