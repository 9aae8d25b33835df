"""One panel of a picture: a scene seen from the side, in metres, with what stands around."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from sims.outlines import DARK, EDGE, LIGHT, polygons_of, scenery_of
from sims.recording import Array, Recording
from sims.scene import NATIVE, Scene

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

AXES = "xyz"
PAPER = np.ones(3)
TONES = {
    "law": {DARK: "#173f80", LIGHT: "#a9c8f2", EDGE: "#0b1f40"},
    "native": {DARK: "#a34a00", LIGHT: "#ffd9a8", EDGE: "#4d2300"},
    "ideal": {DARK: "#555555", LIGHT: "#dddddd", EDGE: "#222222"},
}
"""Colours of bodies by what moves them; dark and light differ in grey too."""
GROUND, TABLE, FLOOR, NOTES = "#8c8c8c", "#cfcfcf", "#ececec", "#444444"
NARROWEST = 2.4  # [in], of a panel
MARGIN = np.array([0.03, 0.1])  # around what is shown, of its width and height
MOST_WIDTH, MOST_HEIGHT = 9.0, 8.0  # of a figure [in]
ENGINE_NAMES = {"mujoco": "MuJoCo", "pybullet": "PyBullet"}


@dataclass(frozen=True)
class Panel:
    """A recording to be drawn.

    Attributes:
        recording: What to draw.
        title: Over the panel, on the left.
        caption: Over the panel, on the right.
        kind: "law", "native" or "ideal": the colours.
        marks: Short texts, each below a point of the picture [m].
    """

    recording: Recording
    title: str
    caption: str = ""
    kind: str = "law"
    marks: Sequence[tuple[float, float, str]] = ()


def panel_of(scene: Scene, recording: Recording) -> Panel:
    """The panel of a scene's recording, titled by engine and law."""
    engine, law = ENGINE_NAMES[recording.facts["engine"]], recording.facts["law"]
    title = f"contactlaw in {engine}" + ("" if "microslip" in law else f", law {law}")
    if law == NATIVE:
        title = f"{engine}'s own contact"
    kind = "native" if law == NATIVE else "law"
    return Panel(recording, title, scene.caption(recording), kind, scene.marks(recording))


def extent(panels: Sequence[Panel], until: float) -> Array:
    """What all panels have to show up to a time: left, right, below, above [m]."""
    bounds = []
    for panel in panels:
        recording = panel.recording
        here = recording.times <= until
        for track in recording.tracks:
            reach = track.size[0] if track.shape in ("ball", "disc") else float(np.linalg.norm(track.size))
            flat = track.positions[here][:, list(recording.view)]
            bounds.append([*(flat.min(axis=0) - reach), *(flat.max(axis=0) + reach)])
    low, high = np.min(bounds, axis=0)[:2], np.max(bounds, axis=0)[2:]
    margin = np.maximum(MARGIN * (high - low), 0.03 * float(np.max(high - low)))
    return np.array([low[0], high[0], low[1], high[1]]) + np.array([-1.0, 1.0, -1.0, 1.0]) * np.repeat(margin, 2)


def figure_for(panels: Sequence[Panel], bounds: Array) -> tuple[Figure, list[Axes]]:
    """A figure with a panel each and the same axes: one above the other where they are wide, else side by side."""
    from matplotlib.figure import Figure

    width, height = bounds[1] - bounds[0], bounds[3] - bounds[2]
    count = len(panels)
    stacked = width > 1.3 * height
    across, down = (1, count) if stacked else (count, 1)
    scale = min((MOST_WIDTH - 0.8) / (across * width), (MOST_HEIGHT - 0.6 - 0.4 * down) / (down * height))
    room = max(NARROWEST / scale - width, 0.0)  # on both sides of what is shown, for a title over it
    bounds, width = bounds + np.array([-0.5, 0.5, 0.0, 0.0]) * room, width + room
    figure = Figure(
        figsize=(across * width * scale + 0.8, down * (height * scale + 0.4) + 0.6), layout="constrained"
    )  # fmt: skip
    figure.get_layout_engine().set(h_pad=0.08, w_pad=0.08)  # type: ignore[union-attr]
    grid = figure.subplots(down, across, squeeze=False, sharex=True, sharey=True)
    axes = list(grid.ravel())
    for number, (one, panel) in enumerate(zip(axes, panels, strict=True)):
        right, up = (AXES[axis] for axis in panel.recording.view)
        one.set_aspect("equal")
        one.set(xlim=bounds[:2], ylim=bounds[2:])
        one.set_title(panel.title, loc="left", fontsize=10, fontweight="bold")
        one.set_title(panel.caption, loc="right", fontsize=9, color=NOTES)
        if not stacked or number == count - 1:
            one.set_xlabel(f"{right} [m]")
        if stacked or number == 0:
            one.set_ylabel(f"{up} [m]")
        one.spines[["top", "right"]].set_visible(False)
        one.tick_params(labelsize=8)
        _surroundings(one, panel, bounds)
    return figure, axes


def _surroundings(axes: Axes, panel: Panel, bounds: Array) -> None:
    for outline in panel.recording.scenery:
        flat = scenery_of(outline, panel.recording.view)
        if outline.solid:
            axes.fill(*flat.T, facecolor=TABLE, edgecolor=GROUND, linewidth=1.0, zorder=1)
            continue
        axes.plot(*flat.T, color=GROUND, linewidth=1.2, zorder=1, scalex=False, scaley=False)
        if outline.normal and flat.size and outline.normal[panel.recording.view[1]] > 1.0 - 1e-9:  # the ground
            axes.axhspan(bounds[2], flat[0, 1], color=FLOOR, zorder=0)


def bodies(axes: Axes, panel: Panel, entry: int, strength: float = 1.0, depth: float = 3.0) -> list[Any]:
    """Draw every body at one entry; returns what was drawn.

    Args:
        axes: Where.
        panel: What.
        entry: Which.
        strength: 0: as pale as paper, 1: full colour.
        depth: What is drawn over what; larger numbers over smaller.
    """
    from matplotlib.colors import to_rgb
    from matplotlib.patches import Polygon

    drawn = []
    for track in panel.recording.tracks:
        for layer, (corners, tone) in enumerate(polygons_of(track, entry, panel.recording.view)):
            colour = PAPER + strength * (np.array(to_rgb(TONES[panel.kind][tone])) - PAPER)
            filled = tone != EDGE
            patch = Polygon(
                corners, closed=True, fill=filled, facecolor=colour if filled else "none",
                edgecolor="none" if filled else colour, linewidth=0.9, zorder=depth + 0.01 * layer,
            )  # fmt: skip
            drawn.append(axes.add_patch(patch))
    return drawn


def path(axes: Axes, panel: Panel, until: float) -> list[Any]:
    """The paths of the bodies' centres up to a time; returns what was drawn."""
    right, up = panel.recording.view
    here = panel.recording.times <= until
    style = {"color": TONES[panel.kind][EDGE], "linewidth": 0.8, "alpha": 0.6, "zorder": 2.5}
    return [
        axes.plot(track.positions[here, right], track.positions[here, up], **style)[0]
        for track in panel.recording.tracks
    ]


def marks(axes: Axes, panel: Panel) -> None:
    """The marks inside the panel; those at one place are put in one text."""
    left, right = axes.get_xlim()
    placed: list[tuple[float, float, str]] = []
    for x, y, text in panel.marks:
        for number, (near, level, before) in enumerate(placed):
            if abs(x - near) < 0.025 * (right - left) and y == level:
                placed[number] = (near, level, f"{before}, {text}")
                break
        else:
            placed.append((x, y, text))
    for x, y, text in placed:
        if left < x < right:
            axes.annotate(
                text, (x, y), xytext=(0, -4), textcoords="offset points", ha="center", va="top", fontsize=9,
                fontweight="bold", color=TONES[panel.kind][DARK], zorder=10,
            )  # fmt: skip


def note(axes: Axes, text: str) -> Any:
    """A line below the panel, at its right end."""
    return axes.annotate(
        text, (1.0, 0.0), xycoords="axes fraction", xytext=(0, -37), textcoords="offset points", ha="right", va="top",
        fontsize=8, color=NOTES,
    )  # fmt: skip
