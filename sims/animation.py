"""Animation of a scene: a GIF of few colours, in which only moving parts are redrawn, or a video."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from contactlaw.files import whole
from sims.panel import FLOOR, GROUND, TABLE, TONES, Panel, bodies, figure_for, marks, note, path, write

if TYPE_CHECKING:
    from PIL.Image import Image

FRAME = 0.04  # time that a frame is seen [s]; a GIF counts in hundredths
GREYS = 10
LAST = 1.5  # how long the last frame stands [s]


def draw_animation(
    panels: Sequence[Panel], file: Path, *, until: float | None = None, slow: float = 1.0, dpi: int = 84
) -> Path:
    """Draw panels with the same axes, synchronised in time.

    Args:
        panels: One or more.
        file: The picture, .gif, or the video, .mp4.
        until: Last time shown [s]; None: end of the shortest recording.
        slow: Slow-motion factor.
        dpi: Dots an inch.

    Returns:
        The file.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from PIL import Image

    end = min(float(panel.recording.times[-1]) for panel in panels)
    end = end if until is None else min(until, end)
    figure, axes = figure_for(panels, end)
    for one, panel in zip(axes, panels, strict=True):
        if not panel.marks_move:
            marks(one, panel)
    speed = (
        "as fast as life"
        if slow == 1.0
        else f"{max(slow, 1.0 / slow):g} times {'slow' if slow > 1.0 else 'fast'}er than life"
    )
    note(axes[-1], f"{speed}; half of each body is dark")
    figure.set_dpi(dpi)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    background: Any = canvas.copy_from_bbox(figure.bbox)
    frames: list[Image] = []
    for instant in np.arange(0.0, end + 1e-9, FRAME / slow):
        canvas.restore_region(background)
        for one, panel in zip(axes, panels, strict=True):
            entry = int(np.argmin(np.abs(panel.recording.times - instant)))
            drawn = path(one, panel, float(panel.recording.times[entry])) + bodies(one, panel, entry)
            drawn += [write(one, panel, mark) for mark in panel.marks_at(entry) if panel.marks_move]
            for artist in sorted(drawn, key=lambda each: each.get_zorder()):
                one.draw_artist(artist)
                artist.remove()
        frames.append(Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3].copy()))
    file.parent.mkdir(parents=True, exist_ok=True)
    with whole(file) as part:
        (_video if file.suffix == ".mp4" else _gif)(frames, part, {panel.kind for panel in panels})
    return file


def _gif(frames: Sequence[Image], file: Path, kinds: set[str]) -> None:
    """Write frames as a GIF of few colours."""
    from PIL import Image

    palette = Image.new("P", (1, 1))
    palette.putpalette(_colours(kinds))
    plain = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    lasting = [round(1000 * FRAME)] * (len(plain) - 1) + [round(1000 * LAST)]
    plain[0].save(file, save_all=True, append_images=plain[1:], duration=lasting, loop=0, optimize=True)


def _video(frames: Sequence[Image], file: Path, _: set[str]) -> None:
    """Write frames as a video, the last one as long as in a GIF."""
    ffmpeg = import_module("imageio_ffmpeg")
    width, height = (2 * (side // 2) for side in frames[0].size)
    writer = ffmpeg.write_frames(str(file), (width, height), fps=1.0 / FRAME, macro_block_size=2)
    writer.send(None)
    for frame in [*frames, *[frames[-1]] * round(LAST / FRAME)]:
        writer.send(frame.crop((0, 0, width, height)).tobytes())
    writer.close()


def _colours(kinds: set[str]) -> list[int]:
    """Common palette of all frames: greys, the bodies' colours, and mixtures."""
    from matplotlib.colors import to_rgb

    colours = [np.full(3, level) for level in (*np.linspace(0.0, 1.0, GREYS), *map(_level, (GROUND, TABLE, FLOOR)))]
    for kind in sorted(kinds):
        tones = [np.array(to_rgb(tone)) for tone in TONES[kind].values()]
        pairs = [(one, two) for number, one in enumerate(tones) for two in (*tones[:number], np.ones(3))]
        colours += tones + [0.5 * (one + two) for one, two in pairs]
    return np.round(255.0 * np.array(colours)).astype(int).ravel().tolist()


def _level(colour: str) -> float:
    from matplotlib.colors import to_rgb

    return to_rgb(colour)[0]
