"""Error of the law in nodes and steps, and of the reference in annuli."""

from itertools import repeat
from time import perf_counter

import numpy as np

from contactlaw import rebound
from contactlaw.laws.microslip import Microslip
from validation.case import Case, Data, Limit, Outcome, Progress, Table, register, told
from validation.front import largest, rms
from validation.impacts import sticking
from validation.measure import order_of
from validation.reference import annulus

CHI = 1.441
STEPS = [32, 64, 128, 256, 512, 1024]
NODES = [4, 8, 16, 32, 64]
ANNULI = [10, 20, 40, 80]
ASKED = {10: 8e-3, 20: 3e-3, 40: 1e-3}
FINE_NODES, FINE_STEPS = 256, 16384


@register
class Convergence(Case):
    """Two discretisations that share no code, the nodes of `microslip` and the rings of the annulus solver, converge to
    the same limit, both with at least about second order.
    """

    place = 20
    title = "Finer is closer"

    def run(self, quick: bool, progress: Progress) -> Outcome:
        psi_1 = np.array(sticking(CHI, 8 if quick else 24))

        def law(nodes: int, steps: int) -> np.ndarray:
            return np.atleast_1d(rebound(psi_1, CHI, Microslip(node_count=nodes), steps=steps))

        limit = law(FINE_NODES, FINE_STEPS)
        in_steps = [float(np.abs(law(16, steps) - law(16, FINE_STEPS)).max()) for steps in STEPS]
        in_nodes = [float(np.abs(law(nodes, FINE_STEPS) - limit).max()) for nodes in NODES]
        reference, counts = self._reference(psi_1, limit, progress)
        data = {
            "chi": CHI, "impacts": psi_1.size, "fine": [FINE_NODES, FINE_STEPS], "steps": STEPS,
            "error_in_steps": in_steps, "nodes": NODES, "error_in_nodes": in_nodes,
            "order_in_steps": order_of(np.array(STEPS[1:]), np.array(in_steps[1:])),
            "order_in_nodes": order_of(np.array(NODES), np.array(in_nodes)),
            "annuli": ANNULI, "reference_error": reference,
            "reference_order": order_of(np.array(ANNULI[1:]), np.array(counts["reference_rms"][1:])),
            **counts,
        }  # fmt: skip
        limits = [
            Limit("order of microslip in steps", 1.5, data["order_in_steps"], at_least=True),
            Limit("order of microslip in nodes", 1.5, data["order_in_nodes"], at_least=True),
            Limit("order of the reference in annuli (rms)", 1.8, data["reference_order"], at_least=True),
            *(Limit(f"error of the reference, N = {n}", most, reference[ANNULI.index(n)]) for n, most in ASKED.items()),
            Limit("time of the reference, N = 20", 100.0, counts["milliseconds"][1], "ms"),
        ]
        return Outcome(limits, data)

    def _reference(self, psi_1: np.ndarray, limit: np.ndarray, progress: Progress) -> tuple[list[float], Data]:
        """Errors and times at each N; the normal motion is tabulated before the clock starts."""
        errors, found = [], {"reference_rms": [], "milliseconds": []}
        for n in told(ANNULI, progress):
            annulus.rebound(0.5, CHI, n)
            seconds, off = [], []
            for psi, wanted in zip(psi_1.tolist(), limit, strict=True):
                start = perf_counter()
                off.append(annulus.impact(psi, CHI, n).psi_2 - wanted)
                seconds.append(perf_counter() - start)
            errors.append(largest(np.array(off)))
            found["reference_rms"].append(rms(np.array(off)))
            found["milliseconds"].append(1e3 * float(np.median(seconds)))
        return errors, found

    def table(self, data: Data) -> Table:
        table = Table("refined | to | largest error | order | time [ms]")
        milliseconds = [f"{time:.2g}" for time in data["milliseconds"]]
        for what, counts, errors, order, times in (
            ("microslip, steps (16 nodes)", "steps", "error_in_steps", "order_in_steps", repeat("")),
            ("microslip, nodes", "nodes", "error_in_nodes", "order_in_nodes", repeat("")),
            ("reference, annuli", "annuli", "reference_error", "reference_order", milliseconds),
        ):
            for count, error, time in zip(data[counts], data[errors], times, strict=False):
                table.add(f"{what} | {count} | {error:.1e} | {data[order]:.2f} | {time}")
        return table
