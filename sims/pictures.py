"""The pictures of a scene: the law beside the engines' own contact, as an exposure and as a GIF."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import partial
from pathlib import Path

from sims.animation import draw_animation
from sims.panel import Panel, panel_of
from sims.recording import Recording
from sims.scene import NATIVE, NATIVES, NONE, Scene, Settings
from sims.stroboscope import draw_stroboscope


def panels_of(scene: Scene, settings: Settings, recording: Recording, engines: Iterable[str] = ()) -> list[Panel]:
    """Panels of a recording and of the same scene with the engines' own contact.

    Args:
        scene: The scene.
        settings: With which it was run.
        recording: What came out.
        engines: Whose own contact to show; none given: that of the settings. None where it is that already.
    """
    panels = [panel_of(scene, recording)]
    for title, ideal in scene.ideals(recording):
        panels.append(Panel(ideal, title, scene.caption(ideal), "ideal", partial(scene.marks, ideal)))
    if settings.law in NATIVES or not scene.beside_native:
        return panels
    for engine in engines or [settings.engine]:
        timestep = scene.native_step or (settings.timestep if engine == settings.engine else None)
        if engine in scene.engines and engine != NONE:
            for law in NATIVES if scene.beside_damped and engine == "mujoco" else [NATIVE]:
                other = scene.run(replace(settings, engine=engine, law=law, timestep=timestep))
                panels.append(panel_of(scene, other))
    return panels


def draw_exposures(scene: Scene, panels: list[Panel], file: Path) -> Path:
    """Draw the exposures, up to the time that the scene shows."""
    return draw_stroboscope(panels, file, until=scene.shown, exposure=scene.exposure, apart=scene.apart)


def draw_gif(scene: Scene, panels: list[Panel], file: Path) -> Path:
    """Draw the animation, in the scene's slow motion."""
    return draw_animation(panels, file, until=scene.shown, slow=scene.slow)
