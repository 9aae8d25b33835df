"""A discrete-element code on the same impacts: LAMMPS's granular wall beside the laws."""

from functools import partial

import numpy as np

from contactlaw import rebound
from validation.case import Array, Case, Data, Limit, Outcome, Table
from validation.front import largest
from validation.impacts import judge, sticking
from validation.lammps_wall import VARIANTS, contact, impacts
from validation.measure import interleaved, spread
from validation.prediction import SPHERE, rms

STEPS = [40, 160, 640, 2560]
DEFAULT = 160  # steps of `rebound` at this chi: cost is compared at as many
TWINS = {"mindlin/force": "mindlin", "mindlin_rescale/force": "mindlin_rescaled"}
"""LAMMPS's model and the rung with the same equations."""
MANY = 1000  # impacts in one run, for the cost of each


class Lammps(Case):
    """On the same impacts of a steel sphere on a wall, LAMMPS is as far from the reference as the single-spring laws:
    `mindlin` is its mindlin/force and `mindlin_rescaled` its mindlin_rescale/force, with the same equations and the
    same rebound. Its variants that keep a displacement instead of a force (mindlin, mindlin_rescale) err most where
    impacts start stuck. `microslip` is hundreds of times closer than all four.
    """

    place = 16
    title = "A discrete-element code"
    needs = {"lammps": "lammps mpich"}

    def run(self, quick: bool) -> Outcome:
        pair = contact()
        chi = SPHERE * pair.kappa / 2.0
        psi_1 = np.array(sticking(chi, 8 if quick else 32))
        truth = judge([(psi, chi, 1.0) for psi in psi_1.tolist()])
        steps = STEPS[:3] if quick else STEPS
        runs = {variant: [impacts(psi_1, variant, count) for count in steps] for variant in VARIANTS}
        laws = {law: np.asarray(rebound(psi_1, chi, law)) for law in ("mindlin", "mindlin_rescaled", "microslip")}
        twins = {variant: float(np.abs(runs[variant][-1].psi_2 - rebound(psi_1, chi, law, steps=4096)).max())
                 for variant, law in TWINS.items()}  # fmt: skip
        off = {variant: float(np.abs(found[-1].restitution - 1.0).max()) for variant, found in runs.items()}
        problems = [f"{name}: normal restitution off 1 by {error:.6f}" for name, error in off.items() if error > 1e-3]

        def errors(psi_2: list[Array]) -> Data:
            return {of.__name__: [of(one - truth.psi_2) for one in psi_2] for of in (largest, rms)}

        data: Data = {
            "version": runs["mindlin"][0].version, "chi": chi, "psi_1": psi_1, "psi_2": truth.psi_2,
            "reference_uncertainty": float(truth.uncertainty.max()), "steps": steps, "variants": {}, "laws": {},
            "differs_from_twin": twins,
        }  # fmt: skip
        many, repeats = np.linspace(0.05, 4.0 * chi - 1.0, MANY), 3 if quick else 7
        seconds = interleaved({law: partial(rebound, many, chi, law) for law in laws}, repeats)
        for name, found in runs.items():
            took = np.array([impacts(many, name, DEFAULT).seconds for _ in range(repeats + 1)])[1:]
            data["variants"][name] = errors([one.psi_2 for one in found]) | {
                "psi_2": found[-1].psi_2, "microseconds": spread(1e6 / MANY * took)}  # fmt: skip
        for law, psi_2 in laws.items():
            cost = spread(1e6 / MANY * seconds[law])
            one = {key: values[0] for key, values in errors([psi_2]).items()}
            data["laws"][law] = one | {"psi_2": psi_2, "microseconds": cost}
        best = min(found["largest"][-1] for found in data["variants"].values())
        limits = [
            *(Limit(f"largest difference of LAMMPS's {variant} from {TWINS[variant]}", 2e-3, difference)
              for variant, difference in twins.items()),
            Limit("largest error of LAMMPS's best over that of microslip", 60.0,
                  best / data["laws"]["microslip"]["largest"], at_least=True),
        ]  # fmt: skip
        return Outcome(limits, data, problems)

    def table(self, data: Data) -> Table:
        counts = data["steps"]
        table = Table([
            "law", *(f"largest error, {count} steps" for count in counts), "rms, finest",
            "difference from the law of the same equations", f"one impact of {MANY}, {DEFAULT} steps [us]",
        ])  # fmt: skip
        for name, found in data["variants"].items():
            errors = " | ".join(f"{error:.3f}" for error in found["largest"])
            twin = f"{data['differs_from_twin'][name]:.1e} ({TWINS[name]})" if name in TWINS else ""
            table.add(f"LAMMPS {name}: {VARIANTS[name]} | {errors} | {{rms[{len(counts) - 1}]:.3f}} | {twin} | "
                      "{microseconds[median]:.3g}", found)  # fmt: skip
        for law, found in data["laws"].items():
            errors = " | ".join("{largest:.2g}" if count == DEFAULT else "" for count in counts)
            table.add(f"contactlaw {law} | {errors} | {{rms:.2g}} | | {{microseconds[median]:.3g}}", found)
        table.add(f"(LAMMPS {{version}}, chi = {{chi:.3f}}, psi_1 to {data['psi_1'][-1]:.2f})", data)
        return table
