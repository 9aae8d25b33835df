"""Many exposures of a scene in one picture: bodies fade with age, half of each is dark to show how it turns."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from sims.panel import Panel, bodies, extent, figure_for, marks, note, path

EXPOSURES = 16
PALEST = 0.35  # the first exposure, of full colour


def draw_stroboscope(
    panels: Sequence[Panel], file: Path, *, until: float | None = None, exposure: float | None = None, dpi: int = 110
) -> Path:
    """Draw panels with the same axes and the same instants.

    Args:
        panels: One or more.
        file: The picture, .png.
        until: End of what is shown [s]; None: of the shortest recording.
        exposure: Time between two exposures [s]; None: so that there are `EXPOSURES`.
        dpi: Dots an inch.

    Returns:
        The file.
    """
    end = min(float(panel.recording.times[-1]) for panel in panels)
    end = end if until is None else min(until, end)
    between = end / (EXPOSURES - 1) if exposure is None else exposure
    instants = np.arange(0.0, end + 1e-9, between)
    figure, axes = figure_for(panels, extent(panels, end))
    for one, panel in zip(axes, panels, strict=True):
        path(one, panel, end)
        marks(one, panel)
        for number, instant in enumerate(instants):
            entry = int(np.argmin(np.abs(panel.recording.times - instant)))
            age = number / max(instants.size - 1, 1)
            bodies(one, panel, entry, PALEST + (1.0 - PALEST) * age, depth=3.0 + age)
    note(axes[-1], f"an exposure every {1e3 * between:.0f} ms; half of each body is dark")
    file.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(file, dpi=dpi, metadata={"Software": None})
    return file
