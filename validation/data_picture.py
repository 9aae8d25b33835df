"""Laws as lines and measured points over them: told apart in grey, the points never hidden."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from validation.picture import LAW_STYLES
from validation.prediction import REFERENCE

if TYPE_CHECKING:
    from matplotlib.axes import Axes

POINTS: dict[str, Any] = {
    "color": "black", "marker": "o", "markerfacecolor": "white", "markersize": 6.0, "markeredgewidth": 1.2,
    "linestyle": "none", "elinewidth": 0.9, "capsize": 2.0, "zorder": 5,
}  # fmt: skip
BROAD: dict[str, Any] = {"color": "#cccccc", "linewidth": 5.0, "linestyle": "-", "solid_capstyle": "butt", "zorder": 1}
MARKERS_A_LINE = 7


def curves(axes: Axes, x: Sequence[float], by_law: Mapping[str, Sequence[float]]) -> None:
    """Each law as a line with few markers, at different places; the reference as a broad pale line beneath."""
    spacing = max(1, len(x) // MARKERS_A_LINE)
    for number, (name, y) in enumerate(by_law.items()):
        if name == REFERENCE:
            axes.plot(x, y, **BROAD, label="reference")
        else:
            offset = number * spacing // len(by_law)
            axes.plot(x, y, **LAW_STYLES[name], markevery=(offset, spacing), markersize=4.0, label=name)


def points(axes: Axes, x: Sequence[float], y: Sequence[float], error: Any, label: str) -> None:
    """What was measured, with its error in y: a number, one for each, or None."""
    axes.errorbar(x, y, yerr=error, **POINTS, label=label)
