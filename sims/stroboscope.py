"""Many exposures of a scene in one picture: older ones are paler; half of each body is dark, to show rotation."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from sims.panel import MOST_WIDTH, WIDE, Panel, bodies, extent, figure_for, marks, note, path, save, surroundings, ways
from sims.recording import Array

EXPOSURES = 16
PALEST = 0.35  # the first exposure, of full colour


def draw_stroboscope(
    panels: Sequence[Panel], file: Path, *, until: float | None = None, exposure: float | None = None,
    apart: bool = False, dpi: int = 110,
) -> Path:  # fmt: skip
    """Draw panels with the same axes and the same instants.

    Args:
        panels: One or more.
        file: The picture, .png.
        until: Last time shown [s]; None: end of the shortest recording.
        exposure: Time between two exposures [s]; None: chosen to give `EXPOSURES` exposures.
        apart: Whether each exposure has a place of its own, those of a panel in a row.
        dpi: Dots an inch.

    Returns:
        The file.
    """
    end = min(float(panel.recording.times[-1]) for panel in panels)
    end = end if until is None else min(until, end)
    between = end / (EXPOSURES - 1) if exposure is None else exposure
    instants = np.arange(0.0, end + 1e-9, between)
    if apart:
        return _draw_apart(panels, file, instants, dpi)
    figure, axes = figure_for(panels, end)
    for one, panel in zip(axes, panels, strict=True):
        path(one, panel, end)
        marks(one, panel)
        for number, instant in enumerate(instants):
            entry = int(np.argmin(np.abs(panel.recording.times - instant)))
            age = number / max(instants.size - 1, 1)
            bodies(one, panel, entry, PALEST + (1.0 - PALEST) * age, depth=3.0 + age)
        ways(one, panel, instants[1:-1:3] + 0.5 * between)
    note(axes[-1], f"an exposure every {1e3 * between:.0f} ms; half of each body is dark")
    return save(figure, file, dpi)


def _draw_apart(panels: Sequence[Panel], file: Path, instants: Array, dpi: int) -> Path:
    """Draw a row for each panel with its exposures side by side; if wide, a column."""
    from matplotlib.figure import Figure

    bounds = extent(panels, float(instants[-1]))
    width, height = bounds[1] - bounds[0], bounds[3] - bounds[2]
    wide = width > WIDE * height
    down, across = (instants.size, len(panels)) if wide else (len(panels), instants.size)
    side = MOST_WIDTH / across
    figure = Figure(figsize=(MOST_WIDTH, (side * height / width + 0.25) * down + 0.4 * len(panels)))
    top = 1.0 - 0.4 / figure.get_figheight() if wide else 1.0
    figure.set_layout_engine("constrained", h_pad=0.03, w_pad=0.03, rect=(0.0, 0.0, 1.0, top))
    grid = figure.subplots(down, across, squeeze=False)
    for row, panel in zip(grid.T if wide else grid, panels, strict=True):
        for axes, instant in zip(row, instants, strict=True):
            entry = int(np.argmin(np.abs(panel.recording.times - instant)))
            axes.set_aspect("equal")
            axes.set(xlim=bounds[:2], ylim=bounds[2:], xticks=[], yticks=[])
            axes.set_xlabel(f"{instant:.2f} s", fontsize=8)
            surroundings(axes, panel, bounds)
            bodies(axes, panel, entry)
            marks(axes, panel, entry)
        row[0].set_title(f"{panel.title}\n{panel.caption}", loc="left", fontsize=9).set_in_layout(not wide)
        row[-1].set_xlabel(f"{instants[-1]:.2f} s; {width:.2g} m wide", fontsize=8)
    return save(figure, file, dpi)
