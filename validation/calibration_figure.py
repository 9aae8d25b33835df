"""The picture of a calibration: measured impacts over the fitted curve, and what is left between them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from contactlaw import Calibration, Estimate
from contactlaw.calibration.result import SLIDES, SLIDES_FIRST, STICKS_FIRST, UNKNOWN
from validation.picture import panels

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Drawn = dict[str, Any]
"""What a picture needs of a calibration: JSON types."""

MARKERS: dict[str, dict[str, Any]] = {
    SLIDES: {"marker": "o", "color": "black"},
    SLIDES_FIRST: {"marker": "s", "color": "#c44e00"},
    STICKS_FIRST: {"marker": "^", "color": "#0072b2"},
    UNKNOWN: {"marker": "D", "color": "#8a8a8a"},
}


def draw_calibration(result: Calibration) -> Figure:
    """Left: V_x2/V_z1 over V_x1/V_z1 with the curve; right: V_x2 less the curve.

    Args:
        result: What `calibrate` gave. Impacts from either side are drawn on one.
    """
    figure, (left, right) = panels(2, width=4.8, height=3.9)
    drawn = as_drawn(result)
    draw_rebound(left, drawn)
    draw_residuals(right, drawn)
    left.legend(fontsize=8)
    figure.suptitle(drawn["text"].replace("\n", "     "), fontsize=10)
    return figure


def as_drawn(result: Calibration) -> Drawn:
    """Points and curve as `draw_rebound` and `draw_residuals` take them: velocities over the speed of approach."""
    side = np.where(result.before[1] < 0.0, -1.0, 1.0) / result.before[0]
    incidence = side * result.before[1]
    along = np.linspace(0.0, 1.05 * max(float(incidence.max()), 1e-9), 161)
    parameters = (("e", result.restitution), (r"$\mu$", result.friction), (r"$\kappa$", result.stiffness_ratio))
    return {
        "incidence": incidence.tolist(),
        "rebound": (side * result.after[1]).tolist(),
        "left_over": (side * result.residuals).tolist(),
        "regimes": list(result.regimes),
        "outliers": list(result.outliers),
        "curve": [] if result.curve_parameters is None else [along.tolist(), result.curve(along).tolist()],
        "determined": result.friction.determined and result.stiffness_ratio.determined,
        "text": "\n".join(f"{symbol} {_plain(one)}" for symbol, one in parameters),
    }


def draw_rebound(axes: Axes, drawn: Drawn) -> None:
    """Measured impacts and the curve."""
    if drawn["curve"]:
        label, line = ("fitted curve", "-") if drawn["determined"] else ("one curve of many that fit", "--")
        axes.plot(*drawn["curve"], color="#555555", linestyle=line, label=label)
    _points(axes, drawn, drawn["rebound"])
    axes.axhline(0.0, color="black", linewidth=0.6)
    axes.set(xlabel=r"before: $V_{x1}/V_{z1}$ [-]", ylabel=r"after: $V_{x2}/V_{z1}$ [-]")


def draw_residuals(axes: Axes, drawn: Drawn) -> None:
    """What the curve leaves."""
    _points(axes, drawn, drawn["left_over"])
    axes.axhline(0.0, color="#555555", linewidth=1.2)
    axes.set(xlabel=r"before: $V_{x1}/V_{z1}$ [-]", ylabel="measured less\n" r"curve, $V_{x2}/V_{z1}$ [-]")


def _points(axes: Axes, drawn: Drawn, heights: list[float]) -> None:
    """Impacts by regime; those left out are crossed."""
    incidence, height = np.array(drawn["incidence"]), np.array(heights)
    for regime, style in MARKERS.items():
        rows = [row for row, name in enumerate(drawn["regimes"]) if name == regime]
        if rows:
            axes.plot(incidence[rows], height[rows], linestyle="", markerfacecolor="none", label=regime, **style)
    if drawn["outliers"]:
        axes.plot(incidence[drawn["outliers"]], height[drawn["outliers"]], linestyle="", marker="x", markersize=10,
                  color="#a00000", label="left out")  # fmt: skip


def _plain(estimate: Estimate) -> str:
    """A value for the picture."""
    return str(estimate) if estimate.value is None else f"= {estimate}".replace("+-", "±")
