"""How maps of stability are drawn: gain of energy as a shade, cells that fail crossed, those that lose hatched."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LIGHT, DARK = -6.0, 0.0  # log10 of the gain of energy
EDGE = {"edgecolor": "#bbbbbb", "linewidth": 0.3}


def gains(axes: Axes, x: ArrayLike, y: ArrayLike, gain: ArrayLike) -> Any:
    """Cells between the edges x (m + 1) and y (n + 1) with the shade of their gain (n, m); returns the mesh."""
    shades = np.log10(np.clip(np.asarray(gain, dtype=float), 10.0**LIGHT, 10.0**DARK))
    mesh = axes.pcolormesh(x, y, shades, cmap="Greys", vmin=LIGHT, vmax=DARK, **EDGE)
    axes.grid(visible=False)
    return mesh


def crosses(axes: Axes, places: Iterable[tuple[float, float]], size: float) -> None:
    """A cross in the middle of each cell that fails, black with a white rim."""
    points = list(places)
    for colour, wider in (("white", 2.0), ("black", 0.0)):
        axes.plot(*(zip(*points, strict=True) if points else ([], [])), "x", color=colour, clip_on=False,
                  markersize=size + 0.5 * wider, markeredgewidth=0.8 + wider, linestyle="none")  # fmt: skip


def hatched(axes: Axes, x: NDArray[np.float64], y: NDArray[np.float64], cells: Iterable[tuple[int, int]]) -> None:
    """Cells, by row and column, hatched."""
    from matplotlib.patches import Rectangle

    for row, column in cells:
        corner, far = (x[column], y[row]), (x[column + 1], y[row + 1])
        axes.add_patch(Rectangle(corner, far[0] - corner[0], far[1] - corner[1], fill=False, hatch="//////",
                                 linewidth=0.0, edgecolor="#7a7a7a"))  # fmt: skip


def scale_of_gains(figure: Figure, mesh: Any, axes: Any) -> None:
    """The bar beside the axes."""
    bar = figure.colorbar(mesh, ax=axes, fraction=0.02, pad=0.01)
    bar.set_label("log10 of the largest gain of energy [-]", fontsize=8)
    bar.ax.tick_params(labelsize=8)
