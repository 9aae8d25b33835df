"""One panel of a picture: a scene in projection, in metres, with its surroundings."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from contactlaw.files import whole
from sims.outlines import DARK, EDGE, LIGHT, polygons_of, reach_of, scenery_of
from sims.recording import Array, Recording
from sims.scene import NATIVE, NATIVE_DAMPED, NATIVES, NONE, Mark, Scene

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
NARROWEST, ALONE = 3.0, 5.6  # [in], of a panel beside others, or with the whole width
BELOW = 0.1  # room for a mark, of the height
TITLES = 0.55  # [in], over a panel
MARGIN = np.array([0.03, 0.1])  # around what is shown, of its width and height
LARGER = 0.6  # share of the width that a panel must do with, to be drawn larger
WIDE = 1.3  # width over height from which panels stand above each other
MOST_WIDTH, MOST_HEIGHT = 9.0, 9.0  # of a figure [in]
SETTINGS = {NATIVE: "restitution (solref)", NATIVE_DAMPED: "friction (elliptic cone, solreffriction)"}
"""What MuJoCo's own contact is set for."""
ENGINE_NAMES = {"mujoco": "MuJoCo", "pybullet": "PyBullet", NONE: "its own world"}


@dataclass(frozen=True)
class Panel:
    """A recording to be drawn.

    Attributes:
        recording: What to draw.
        title: Over the panel, on the left.
        caption: Over the panel, on the right.
        kind: "law", "native" or "ideal": the colours.
        marks_at: Short texts, each below a point of the picture [m], at an entry; those of the last one are `marks`.
    """

    recording: Recording
    title: str
    caption: str = ""
    kind: str = "law"
    marks_at: Callable[[int], Sequence[Mark]] = lambda entry: ()

    @cached_property
    def marks(self) -> Sequence[Mark]:
        """At the end."""
        return self.marks_at(-1)

    @cached_property
    def marks_move(self) -> bool:
        """Whether the marks move with the bodies."""
        return list(self.marks_at(0)) != list(self.marks)


def title_of(scene: Scene, recording: Recording) -> str:
    """Title with engine, law and step of a recording, or what the engine's own contact is set for."""
    engine, law = ENGINE_NAMES[recording.facts["engine"]], recording.facts["law"]
    title = f"contactlaw in {engine}" + ("" if "microslip" in law else f", law {law}")
    if law in NATIVES:
        several = scene.beside_damped and engine == "MuJoCo"
        title = f"{engine}'s own, set for {SETTINGS[law]}" if several else f"{engine}'s own contact"
    return f"{title}, {1e3 * recording.facts['timestep']:.3g} ms"


def panel_of(scene: Scene, recording: Recording) -> Panel:
    """The panel of a scene's recording."""
    kind = "native" if recording.facts["law"] in NATIVES else "law"
    title, marks = title_of(scene, recording), partial(scene.marks, recording)
    return Panel(recording, title, scene.caption(recording), kind, marks)


def extent(panels: Sequence[Panel], until: float) -> Array:
    """Bounds of all panels up to a time, with room for marks: left, right, below, above [m]."""
    bounds = []
    for panel in panels:
        recording = panel.recording
        here = recording.times <= until
        for track in recording.tracks:
            view = list(recording.view)
            flat, reach = track.positions[here][:, view], reach_of(track)[here][:, view]
            bounds.append([*(flat - reach).min(axis=0), *(flat + reach).max(axis=0)])
        bounds += [[x, y, x, y] for x, y, _ in panel.marks if not panel.marks_move and np.isfinite([x, y]).all()]
    low, high = np.min(bounds, axis=0)[:2], np.max(bounds, axis=0)[2:]
    lows = [low[1] if panel.marks_move else y for panel in panels for _, y, _ in panel.marks]
    lowest = min(lows, default=np.inf)
    low[1] = min(low[1], lowest - BELOW * (high[1] - low[1]))
    margin = np.maximum(MARGIN * (high - low), 0.03 * float(np.max(high - low)))
    return np.array([low[0], high[0], low[1], high[1]]) + np.array([-1.0, 1.0, -1.0, 1.0]) * np.repeat(margin, 2)


def figure_for(panels: Sequence[Panel], until: float) -> tuple[Figure, list[Axes]]:
    """Figure with the panels up to a time [s], side by side or, if wide, above each other.

    All have the same scale, except a panel much narrower than the others, which is drawn larger.
    """
    from matplotlib.figure import Figure

    bounds, count = extent(panels, until), len(panels)
    width, height = bounds[1] - bounds[0], bounds[3] - bounds[2]
    stacked = width > WIDE * height
    across, down = (1, count) if stacked else (count, 1)
    scale = min((MOST_WIDTH - 0.8) / (across * width), (MOST_HEIGHT - 0.6 - TITLES * down) / (down * height))
    room = max(
        (ALONE if stacked else NARROWEST) / scale - width, 0.0
    )  # on both sides of what is shown, for a title over it
    bounds, width = bounds + np.array([-0.5, 0.5, 0.0, 0.0]) * room, width + room
    shown = [_enlarged(panel, bounds, until) if stacked else bounds for panel in panels]
    heights = [width * scale * (one[3] - one[2]) / (one[1] - one[0]) for one in shown[:down]]
    figure = Figure(figsize=(across * width * scale + 0.8, sum(heights) + TITLES * down + 0.6), layout="constrained")
    figure.get_layout_engine().set(h_pad=0.08, w_pad=0.08)  # type: ignore[union-attr]
    grid = figure.subplots(down, across, squeeze=False, height_ratios=heights)
    axes = list(grid.ravel())
    for number, (one, panel, here) in enumerate(zip(axes, panels, shown, strict=True)):
        right, up = (AXES[axis] for axis in panel.recording.view)
        one.set_aspect("equal")
        one.set(xlim=here[:2], ylim=here[2:])
        one.set_title(panel.title, loc="left", fontsize=10, fontweight="bold", pad=19 if panel.caption else 6)
        one.annotate(panel.caption, (0.0, 1.0), xycoords="axes fraction", xytext=(0, 5), textcoords="offset points",
                     fontsize=9, color=NOTES, annotation_clip=False)  # fmt: skip
        if not stacked or number == count - 1:
            one.set_xlabel(f"{right} [m]")
        if stacked or number == 0:
            one.set_ylabel(f"{up} [m]")
        one.spines[["top", "right"]].set_visible(False)
        one.tick_params(labelsize=8)
        one.locator_params("x", nbins=max(4, min(9, round(2.0 * width * scale))))
        surroundings(one, panel, here)
    return figure, axes


def _enlarged(panel: Panel, bounds: Array, until: float) -> Array:
    """Bounds of a panel drawn as large as possible, if that is much larger than at the common scale."""
    own = extent([panel], until)
    width, most = bounds[1] - bounds[0], (own[1] - own[0])
    if most > LARGER * width:
        return bounds
    middle, half = 0.5 * (own[0] + own[1]), 0.5 * LARGER * width
    return np.array([middle - half, middle + half, own[2], own[3]])


def surroundings(axes: Axes, panel: Panel, bounds: Array) -> None:
    """Draw the surroundings."""
    for outline in panel.recording.scenery:
        flat = scenery_of(outline, panel.recording.view)
        if outline.solid:
            axes.fill(*flat.T, facecolor=TABLE, edgecolor=GROUND, linewidth=1.0, zorder=1)
            continue
        end_on = "o" if flat.size and np.ptp(flat, axis=0).max() < 1e-9 else None
        axes.plot(*flat.T, color=GROUND, linewidth=1.2, marker=end_on, zorder=1, scalex=False, scaley=False)
        if outline.normal and flat.size and outline.normal[panel.recording.view[1]] > 1.0 - 1e-9:  # the ground
            axes.axhspan(bounds[2], flat[0, 1], color=FLOOR, zorder=0)


def bodies(axes: Axes, panel: Panel, entry: int, strength: float = 1.0, depth: float = 3.0) -> list[Any]:
    """Draw every body at one entry; return what was drawn.

    Args:
        axes: Axes to draw on.
        panel: The panel.
        entry: Index of the entry.
        strength: 0: as pale as paper, 1: full colour.
        depth: Drawing order; larger numbers are drawn over smaller ones.
    """
    from matplotlib.collections import PolyCollection
    from matplotlib.colors import to_rgb

    view, nothing = panel.recording.view, (0.0, 0.0, 0.0, 0.0)
    shown = [one for track in panel.recording.tracks for one in polygons_of(track, entry, view)]
    tones = [PAPER + strength * (np.array(to_rgb(TONES[panel.kind][tone])) - PAPER) for _, tone in shown]
    inside, around = (
        [(*colour, 1.0) if (tone == EDGE) == edge else nothing
         for (_, tone), colour in zip(shown, tones, strict=True)] for edge in (False, True)
    )  # fmt: skip
    corners = [points for points, _ in shown]
    made = PolyCollection(corners, facecolors=inside, edgecolors=around, linewidths=0.9, zorder=depth)
    return [axes.add_collection(made, autolim=False)]


def path(axes: Axes, panel: Panel, until: float) -> list[Any]:
    """Draw the paths of the bodies' centres up to a time; return what was drawn."""
    from matplotlib.collections import LineCollection

    right, up = panel.recording.view
    here = panel.recording.times <= until
    alone = len(panel.recording.tracks) == 1
    lines = [track.positions[here][:, [right, up]] for track in panel.recording.tracks]
    made = LineCollection(
        lines, colors=TONES[panel.kind][EDGE], linewidths=0.8, alpha=0.6, zorder=8.0 if alone else 2.5
    )
    return [axes.add_collection(made, autolim=False)]


def ways(axes: Axes, panel: Panel, instants: Array) -> None:
    """Draw arrows along the path of a single body at some instants [s], to show its direction."""
    if len(panel.recording.tracks) != 1:
        return
    track, times, view = panel.recording.tracks[0], panel.recording.times, list(panel.recording.view)
    for instant in instants:
        entry = min(int(np.searchsorted(times, instant)), times.size - 2)
        here = track.positions[entry, view]
        step = track.positions[entry + 1, view] - here
        length = float(np.linalg.norm(step))
        if length > 0.0:
            style = {"arrowstyle": "-|>", "color": TONES[panel.kind][DARK], "mutation_scale": 13}
            tip = here + step * (0.4 * track.size[0] / length)
            axes.annotate("", (tip[0], tip[1]), (here[0], here[1]), arrowprops=style, zorder=9)


def marks(axes: Axes, panel: Panel, entry: int = -1) -> None:
    """Marks inside the panel; those at one place are merged, and none overlaps another or the edge."""
    left, right = axes.get_xlim()
    placed: list[tuple[float, float, str]] = []
    for x, y, text in panel.marks if entry == -1 else panel.marks_at(entry):
        for number, (near, level, before) in enumerate(placed):
            if abs(x - near) < 0.025 * (right - left) and y == level:
                many = text.isdecimal() and (" to " in before or ", " in before)
                first = before.split(" to ")[0].split(", ")[0]
                placed[number] = (near, level, f"{first} to {text}" if many else f"{before}, {text}")
                break
        else:
            placed.append((x, y, text))
    if figure := axes.get_figure(root=True):
        figure.draw_without_rendering()  # so that it is known how large texts are
    boxes: list[Any] = []
    for mark in placed:
        if left < mark[0] < right:
            made = write(axes, panel, mark)
            box, frame = made.get_window_extent(), axes.get_window_extent()
            inward = max(frame.x0 - box.x0, 0.0) + min(frame.x1 - box.x1, 0.0)
            made.xyann = (72.0 / axes.figure.dpi * inward, made.xyann[1])
            while any(made.get_window_extent().overlaps(box) for box in boxes):
                made.xyann = (made.xyann[0], made.xyann[1] + 3)
            boxes.append(made.get_window_extent())


def write(axes: Axes, panel: Panel, mark: Mark) -> Any:
    """Draw one mark."""
    made = axes.annotate(
        mark[2], mark[:2], xytext=(0, -4), textcoords="offset points", ha="center", va="top", fontsize=9,
        fontweight="bold", color=TONES[panel.kind][DARK], zorder=10,
    )  # fmt: skip
    made.set_in_layout(False)
    return made


def note(axes: Axes, text: str) -> Any:
    """Draw a line of text below the panel, at its right end."""
    return axes.annotate(
        text, (1.0, 0.0), xycoords="axes fraction", xytext=(0, -37), textcoords="offset points", ha="right", va="top",
        fontsize=8, color=NOTES,
    )  # fmt: skip


def save(figure: Figure, file: Path, dpi: int = 130) -> Path:
    """Write a picture without metadata that would make equal pictures differ; return its path."""
    file.parent.mkdir(parents=True, exist_ok=True)
    with whole(file) as part:
        figure.savefig(part, dpi=dpi, metadata={"Software": None}, bbox_inches="tight", pad_inches=0.08)
    return file
