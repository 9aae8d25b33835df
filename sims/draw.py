"""Pictures of the scenes. Curves differ in dash and marker as well as colour, so that they survive grey print."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import matplotlib

matplotlib.use("Agg")  # no screen needed

import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import NDArray

from contactlaw import rebound
from sims.panel import save
from sims.puck import Result

BLUE, ORANGE, GREY = "#1f4e9c", "#d9730d", "#777777"
MARKERS = {
    ("mujoco", "microslip"): ("o", BLUE, "contactlaw in MuJoCo"),
    ("pybullet", "microslip"): ("x", BLUE, "contactlaw in PyBullet"),
    ("mujoco", "native"): ("^", ORANGE, "MuJoCo's own, set for restitution"),
    ("mujoco", "native_damped"): ("v", ORANGE, "MuJoCo's own, set for friction"),
    ("pybullet", "native"): ("+", ORANGE, "PyBullet's own, set for both"),
}


def draw_rebounds(
    results: Sequence[Result], psi_1: NDArray[np.float64], reference: Mapping[str, NDArray[np.float64]], path: Path
) -> Path:
    """psi_2 over psi_1, a panel for each material: reference, law and native contact in the engines, rigid theory."""
    figure, axes = plt.subplots(1, len(reference), figsize=(11.0, 4.6), sharey=True, layout="constrained")
    for axis, (material, curve) in zip(np.atleast_1d(axes), reference.items(), strict=True):
        here = [result for result in results if result.material == material]
        one = here[0]
        rigid = rebound(psi_1, one.chi, "coulomb", one.restitution)
        axis.axhline(0.0, color="#bbbbbb", linewidth=0.6)
        axis.plot(psi_1, rigid, color=GREY, linewidth=2.0, linestyle=(0, (6, 3)), label="rigid theory (Coulomb)")
        axis.plot(psi_1, curve, color="black", linewidth=1.6, label="reference: annulus solver")
        for (engine, law), (marker, colour, name) in MARKERS.items():
            points = [(r.psi1, r.psi2) for r in here if (r.engine, r.law) == (engine, law)]
            if points:
                axis.plot(*np.array(points).T, marker, color=colour, markerfacecolor="none", markersize=6, label=name)
        axis.set_title(f"{material}: $\\chi$ = {one.chi:.3f}, $\\mu$ = {one.mu}, $e$ = {one.restitution}")
        axis.set_xlabel(r"before: $\psi_1 = (\kappa/\mu)\,V_x/V_{z1}$")
        axis.grid(alpha=0.25)
    np.atleast_1d(axes)[0].set_ylabel(r"after: $\psi_2$   (below 0: the contact point reverses)")
    np.atleast_1d(axes)[0].legend(loc="upper left", fontsize=9)
    plt.close(figure)
    return save(figure, path)
