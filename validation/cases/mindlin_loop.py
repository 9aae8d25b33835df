"""A tangential load cycle at constant normal force, against the closed form of Mindlin and Deresiewicz."""

from itertools import product

import numpy as np

from contactlaw import MATERIALS, ContactPair, force_along_path
from contactlaw.laws import LAWS, Law
from contactlaw.laws.microslip import Microslip
from validation.case import Array, Case, Data, Limit, Outcome, Progress, Table, register, told
from validation.reference import mindlin_loop, superposition

AMPLITUDES = [0.3, 0.6, 0.9, 0.99]
SHOWN = 0.9
NODES = [4, 8, 16, 32, 64, 128, 256]
OVERLAP = 1e-6  # [m]
FRICTION = 0.3
POINTS = 201  # on each branch
ROUNDING = 1e-12


@register
class MindlinLoop(Case):
    """Under constant normal force P the law follows the closed form of first loading, unloading and reloading: to
    rounding with all springs at once, as `force_along_path` takes them by default; within 1 % of mu P with 16 nodes,
    within 0.1 % with 64.
    """

    place = 22
    title = "The loop of a tangential load cycle"

    def run(self, quick: bool, progress: Progress) -> Outcome:
        amplitudes = [SHOWN] if quick else AMPLITUDES
        nodes = [16, 64] if quick else NODES
        laws: dict[str, Law] = {"default": LAWS["microslip"]} | {str(n): Microslip(node_count=n) for n in nodes}
        data: Data = {"nodes": nodes, "error": {name: {} for name in laws}, "lost": {name: {} for name in laws}}
        for (name, law), amplitude in told(product(laws.items(), amplitudes), progress):
            exact, cycle = mindlin_loop.cycle(amplitude, POINTS), slice(POINTS - 1, None)
            force = _along(law, exact.displacement)
            work = float(np.trapezoid(force[cycle], exact.displacement[cycle]))
            data["error"][name][str(amplitude)] = float(np.abs(force - exact.force).max())
            data["lost"][name][str(amplitude)] = work / mindlin_loop.lost_work(amplitude) - 1.0
        reference = max(float(np.abs(_superposed(a) - mindlin_loop.cycle(a, POINTS).force).max()) for a in amplitudes)
        data["reference_error"] = reference
        limits = [
            Limit("largest error of F/(mu P), all springs at once", ROUNDING, max(data["error"]["default"].values())),
            Limit("largest error of F/(mu P), 16 nodes", 1e-2, max(data["error"]["16"].values())),
            Limit("largest error of F/(mu P), 64 nodes", 1e-3, max(data["error"]["64"].values())),
        ]
        return Outcome(limits, data)

    def table(self, data: Data) -> Table:
        table = Table("nodes | force amplitude over mu P | largest error of F/(mu P) | work lost a cycle, error")
        for name, errors in data["error"].items():
            label = "all springs at once" if name == "default" else name
            for amplitude, error in errors.items():
                table.add(f"{label} | {amplitude} | {error:.1e} | {100 * data['lost'][name][amplitude]:+.2f} %")
        table.add("(superposition reference) | all | {reference_error:.1e}", data)
        return table


def _along(law: Law, displacement: Array) -> Array:
    """F/(mu P) of the law over s in full slip's displacement, at constant overlap."""
    steel = MATERIALS["steel"]
    pair = ContactPair(steel, steel, friction=FRICTION, radius=0.01, law=law)
    full_slip = FRICTION * pair.effective_modulus / pair.effective_shear_modulus * OVERLAP  # mu E* delta = G* s
    overlap = np.concatenate([[0.0], np.full(displacement.size, OVERLAP)])
    normal, force = force_along_path(pair, overlap, full_slip * np.concatenate([[0.0], displacement]))
    return force[1:] / (FRICTION * normal[1:])


def _superposed(amplitude: float) -> Array:
    """F/(mu P) of the superposition along the same loop, overlap 1, E* = R = 1."""
    displacement = mindlin_loop.cycle(amplitude, POINTS).displacement
    return superposition.force_along_path(np.ones(displacement.size), displacement) / (4.0 / 3.0)
