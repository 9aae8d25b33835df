"""The paper's first method beside its second: the same results, and the cost of the history in each."""

from functools import partial

import numpy as np

from validation.case import Array, Case, Data, Limit, Outcome, Table
from validation.impacts import judge
from validation.measure import interleaved, spread
from validation.reference import annulus, superposition

DISK = 1.256  # chi of the paper's figures, a steel disk
INCIDENCES = [0.25, 0.5, 1.0, 1.2, 2.0, 3.0]
OTHER_CHIS = [0.5, 1.441, 2.0, 4.5]
STEPS = [50, 100, 200, 400, 800, 1600, 3200, 6400]
FINE = 32000  # with half as many extrapolated to the limit
ANNULI = [20, 40]
TIMED = [1000, 4000, 12000, 36000]
TIMED_PSI = 0.5


class Superposition(Case):
    """Superposing the Hertz-shaped tractions of all load increments, the paper's first method, gives the same rebound
    as its independent second method, the annuli. Its memory and the cost of a step grow with the number of steps; with
    annuli both stay constant. But its steps are simple, and exact in space: the table shows how few suffice, and beyond
    which number they cost more than the annuli.
    """

    place = 21
    title = "The paper's two methods"

    def run(self, quick: bool) -> Outcome:
        chis = [DISK, OTHER_CHIS[0]] if quick else [DISK, *OTHER_CHIS]
        agreement: Data = {}
        for chi in chis:
            impacts = [(psi_1, chi, 1.0) for psi_1 in INCIDENCES]
            truth = judge(impacts, 80 if chi > 3.0 else 40)
            psi_2 = np.atleast_1d(superposition.rebound(INCIDENCES, chi))
            agreement[str(chi)] = {"superposition": psi_2, "annulus": truth.psi_2,
                                   "difference": np.abs(psi_2 - truth.psi_2),
                                   "uncertainty": truth.uncertainty}  # fmt: skip
        errors = _errors(STEPS[:-2] if quick else STEPS)
        cost = _cost(TIMED[:-1] if quick else TIMED, 3 if quick else 5)
        data = {"incidences": INCIDENCES, "agreement": agreement, "errors": errors, "cost": cost}
        largest = {chi: max(one["difference"]) for chi, one in agreement.items()}
        limits = [
            Limit(f"largest difference in psi_2, chi = {DISK}", 3e-3, largest[str(DISK)]),
            Limit(f"the same, chi from {min(chis)} to {max(chis)}", 5e-4, max(largest.values())),
            Limit("order of the superposition in steps (rms)", 1.8, errors["order"], at_least=True),
            Limit("time a step, most steps over fewest: superposition", 2.0, cost["growth"]["superposition"],
                  at_least=True),
            *(Limit(f"the same: annulus, N = {n}", 1.5, cost["growth"][f"annulus, N = {n}"]) for n in ANNULI),
        ]  # fmt: skip
        return Outcome(limits, data)

    def table(self, data: Data) -> Table:
        table = Table("quantity | at | superposition | annuli")
        for chi, one in data["agreement"].items():
            at = int(np.argmax(one["difference"]))
            table.add(f"psi_2, chi = {chi}, where they differ most | psi_1 = {data['incidences'][at]} | "
                      f"{one['superposition'][at]:.6f} | {one['annulus'][at]:.6f} +- "
                      f"{one['uncertainty'][at]:.0e}")  # fmt: skip
        errors, cost = data["errors"], data["cost"]
        for steps, error in zip(errors["steps"], errors["superposition"]["error"], strict=True):
            table.add(f"largest error in psi_2 | {steps} steps | {error:.1e}")
        for name, one in errors["annuli"].items():
            table.add(f"largest error in psi_2 | {name}, {one['steps'][-1]} steps | | {one['error'][-1]:.1e}")
        annuli = ", ".join(map(str, ANNULI))
        for number, steps in enumerate(cost["steps"]):
            own, *others = (f"{times[number]['median']:.2f}" for times in cost["microseconds"].values())
            table.add(f"time a step [us], annulus with N = {annuli} | {steps} steps | {own} | {', '.join(others)}")
            table.add(f"most components, or annuli | {steps} steps | {cost['components'][number]} | {annuli}")
        return table


def _errors(counts: list[int]) -> Data:
    """Error over steps at chi = 1.256 of both methods, against the superposition extrapolated in its steps."""

    def by_steps(steps: int) -> Array:
        return np.atleast_1d(superposition.rebound(INCIDENCES, DISK, steps))

    limit = by_steps(FINE) + (by_steps(FINE) - by_steps(FINE // 2)) / 3.0
    own = np.array([by_steps(steps) - limit for steps in counts])
    order = -np.polyfit(np.log(counts), np.log(np.sqrt(np.mean(own**2, axis=1))), 1)[0]  # of convergence
    data: Data = {"steps": counts, "order": order,
                  "superposition": {"steps": counts, "error": np.abs(own).max(axis=1)}, "annuli": {}}  # fmt: skip
    for n in ANNULI:
        runs = [[annulus.impact(psi_1, DISK, n, steps=steps) for psi_1 in INCIDENCES] for steps in counts]
        error = [float(np.abs(np.array([one.psi_2 for one in row]) - limit).max()) for row in runs]
        data["annuli"][f"annulus, N = {n}"] = {"steps": [row[0].steps for row in runs], "error": error}
    return data


def _cost(counts: list[int], repeats: int) -> Data:
    """Time a step of one impact, interleaved; the normal motion is tabulated in the rounds that do not count."""
    ways: Data = {"superposition": superposition.rebound}
    ways |= {f"annulus, N = {n}": partial(annulus.rebound, annuli=n) for n in ANNULI}
    runs = {f"{name}|{steps}": partial(solve, TIMED_PSI, DISK, steps=steps)
            for steps in counts for name, solve in ways.items()}  # fmt: skip
    taken = {f"superposition|{n}": n for n in counts}
    taken |= {f"annulus, N = {annuli}|{n}": annulus.impact(TIMED_PSI, DISK, annuli, steps=n).steps
              for annuli in ANNULI for n in counts}  # fmt: skip
    seconds = interleaved(runs, repeats)
    steps = {name: [1e6 * seconds[f"{name}|{n}"] / taken[f"{name}|{n}"] for n in counts] for name in ways}
    return {"steps": counts, "microseconds": {name: [*map(spread, one)] for name, one in steps.items()},
            "growth": {name: spread(one[-1] / one[0])["median"] for name, one in steps.items()},
            "components": [int(superposition.impact(TIMED_PSI, DISK, n).components.max()) for n in counts]}  # fmt: skip
