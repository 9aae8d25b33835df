"""Picture of a calibration: measured impacts with the fitted curve, and the residuals."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from contactlaw import checks
from contactlaw.calibration.result import SLIDES, SLIDES_FIRST, STICKS_FIRST, UNKNOWN, Calibration, Estimate
from contactlaw.ending import whole

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MARKERS: dict[str, dict[str, Any]] = {
    SLIDES: {"marker": "o", "color": "black"},
    SLIDES_FIRST: {"marker": "s", "color": "#c44e00"},
    STICKS_FIRST: {"marker": "^", "color": "#0072b2"},
    UNKNOWN: {"marker": "D", "color": "#8a8a8a"},
}


def save_calibration(result: Calibration, path: Path) -> Path:
    """Draw a calibration into a file; the suffix of the path selects the format. Returns the path.

    Raises:
        ValueError: matplotlib does not support the format.
        OSError: The file cannot be written.
    """
    with whole(path) as part:
        draw_calibration(result).savefig(part, dpi=110)
    return path


def draw_calibration(result: Calibration) -> Figure:
    """Left: V_x2/V_z1 over V_x1/V_z1 with the curve. Right: V_x2 less the curve. Signs are such that V_x1 >= 0.

    Raises:
        ImportError: matplotlib is missing.
    """
    checks.need("matplotlib", "a picture", "plot")
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.6, 3.9), layout="constrained")
    left, right = figure.subplots(1, 2)
    for axes in (left, right):
        axes.grid(color="#dddddd", linewidth=0.5)
        axes.spines[["top", "right"]].set_visible(False)
    side = np.where(result.before[1] < 0.0, -1.0, 1.0) / result.before[0]
    incidence = side * result.before[1]
    if result.curve_parameters is not None:
        along = np.linspace(0.0, 1.05 * max(float(incidence.max()), 1e-9), 161)
        known = result.friction.determined and result.stiffness_ratio.determined
        label, line = ("fitted curve", "-") if known else ("one curve of many that fit", "--")
        left.plot(along, result.curve(along), color="#555555", linestyle=line, label=label)
    outliers = list(result.outliers)
    for axes, height in ((left, side * result.after[1]), (right, side * result.residuals)):
        for regime, style in MARKERS.items():
            rows = [row for row, name in enumerate(result.regimes) if name == regime]
            if rows:
                axes.plot(incidence[rows], height[rows], linestyle="", markerfacecolor="none", label=regime, **style)
        if outliers:
            axes.plot(incidence[outliers], height[outliers], linestyle="", marker="x", markersize=10, color="#a00000",
                      label="left out")  # fmt: skip
        axes.axhline(0.0, color="black", linewidth=0.6)
        axes.set(xlabel=r"before: $V_{x1}/V_{z1}$ [-]")
    left.set(ylabel=r"after: $V_{x2}/V_{z1}$ [-]")
    right.set(ylabel="measured less\n" r"curve, $V_{x2}/V_{z1}$ [-]")
    left.legend(fontsize=8)
    parameters = (("e", result.restitution), (r"$\mu$", result.friction), (r"$\kappa$", result.stiffness_ratio))
    figure.suptitle("     ".join(f"{symbol} {_plain(one)}" for symbol, one in parameters), fontsize=10)
    return figure


def _plain(estimate: Estimate) -> str:
    """Text of an estimate for the title."""
    return str(estimate) if estimate.value is None else f"= {estimate}".replace("+-", "±")
