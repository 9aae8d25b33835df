"""A command for each scene: the same options everywhere, and the scene's own."""

import inspect
import json
import os
import sys
from collections.abc import Callable, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Annotated, Any

import typer

from contactlaw import MATERIALS, checks
from contactlaw.laws.base import KNOWN
from sims import show
from sims.scene import ENGINES, NATIVES, OWN_STEP, Scene, Settings, check_step

BOTH = ("both",)
KINDS = ("plot", "gif", "mp4")  # of pictures
PLOT, GIF, MP4, VIEW = (
    "Many exposures in one picture, .png.",
    "Animation, .gif.",
    "The same as a video, .mp4 (needs the extra video).",
    "Show the scene in the engine's own window.",
)
LAW = "native: the engine's own contact; default: the simplest law with the same result"
STEPS = ", ".join(f"{engine} {step:.4g}" for engine, step in OWN_STEP.items())


def law_choices() -> str:
    """Return the names of all known laws with their fields, in the order of their rungs."""
    laws = sorted(KNOWN.values(), key=lambda law: law.rung)
    return "|".join("".join([law.name, *(f" {field.name}=..." for field in fields(law))]) for law in laws)


def add_scene(
    app: typer.Typer, scene: Scene, run: Callable[[Scene, Mapping[str, Any]], None] | None = None, **more: Any
) -> None:
    """Add the command of a scene; run: replaces `run_scene`; more: further options, as typer takes them."""

    def command(**values: Any) -> None:
        try:
            _for_each_engine(run or run_scene, scene, values)
        except typer.Exit:
            raise
        except ValueError as error:
            raise typer.BadParameter(str(error)) from None
        except (ModuleNotFoundError, OSError) as error:
            raise typer.BadParameter(str(error)) from None
        except (ArithmeticError, RuntimeError) as error:
            raise typer.BadParameter(f"the scene cannot be simulated with these values: {error}") from None

    natives = NATIVES[: 1 + scene.beside_damped]
    options: dict[str, tuple[Any, Any, Any]] = {
        "engine": (str, scene.engines[0], typer.Option(help="|".join([*scene.engines, *BOTH * _has_both(scene)]))),
        "law": (str | None, None, typer.Option(help="|".join([law_choices(), *natives]) + f"; {LAW}")),
        "material": (str | None, None, typer.Option(
            help="|".join(MATERIALS) + "; default: the scene's own", hidden=scene.material is None)),
        "timestep": (float | None, None, typer.Option(help=f"Engine step in s; default: the engine's own, {STEPS}.")),
        "as_json": (bool, False, typer.Option("--json", help="Print one JSON object.")),
        "plot": (Path | None, None, typer.Option(help=PLOT)),
        "gif": (Path | None, None, typer.Option(help=GIF)),
        "mp4": (Path | None, None, typer.Option(help=MP4)),
        "view": (bool, False, typer.Option("--view", help=VIEW)),
    } | {
        name: (float | None if one.default is None else type(one.default), one.default,
               typer.Option(f"--{name.replace('_', '-')}", help=one.help))
        for name, one in scene.options.items()
    } | more  # fmt: skip
    parameters = [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=Annotated[kind, option])
        for name, (kind, default, option) in options.items()
    ]
    command.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    command.__annotations__ = {one.name: one.annotation for one in parameters}
    able = "".join(f"\n\nNot in {engine}: {reason}." for engine, reason in scene.unable.items())
    title = f"{scene.title[0].upper()}{scene.title[1:]}."
    app.command(scene.name, help=f"{title}\n\n{inspect.cleandoc(type(scene).__doc__ or '')}{able}")(command)


def _has_both(scene: Scene) -> bool:
    return set(ENGINES) <= set(scene.engines)


def _for_each_engine(run: Callable[[Scene, Mapping[str, Any]], None], scene: Scene, values: Mapping[str, Any]) -> None:
    """Run in the engine asked for, or in both.

    Raises:
        ValueError: The scene cannot be run so.
    """
    if values["engine"] != BOTH[0]:
        checks.one_of("engine", values["engine"], [*scene.engines, *scene.unable, *BOTH * _has_both(scene)])
        run(scene, values)
        return
    if not _has_both(scene):
        missing = next(engine for engine in ENGINES if engine not in scene.engines)
        raise ValueError(
            f"engine = {BOTH[0]!r}: must be one of {', '.join(scene.engines)}; "
            f"{scene.name} is not in {missing}: {scene.unable[missing]}"
        )
    for engine in ENGINES:
        files = {kind: values[kind] and values[kind].with_stem(f"{values[kind].stem}_{engine}")
                 for kind in KINDS}  # fmt: skip
        if not values["as_json"]:
            show.console.rule(engine, align="left")
        run(scene, {**values, **files, "engine": engine})


def run_scene(scene: Scene, values: Mapping[str, Any]) -> None:
    """Run a scene with the values of its command, print its figures and checks, make its pictures."""
    settings = settings_of(scene, values)
    recording = show.run(scene, settings)
    measured = show.measure(scene, recording)
    if values["as_json"]:
        print(json.dumps(measured))
    else:
        show.figures(measured)
        held = show.checks(scene.check(measured))
    show.pictures(scene, settings, recording, values["plot"], values["gif"], mp4=values["mp4"])
    if not values["as_json"] and not held:
        raise typer.Exit(1)


def settings_of(scene: Scene, values: Mapping[str, Any]) -> Settings:
    """Settings of a scene from the values of the command line.

    Raises:
        ValueError: The scene cannot be run so; the message says why.
    """
    if values["view"] and not _has_display():
        raise ValueError("view: there is no display to open a window on; --gif makes a moving picture")
    if values["view"] and not (scene.in_window and values["engine"] in ENGINES):
        where = f"{scene.name} in engine = {values['engine']!r}"
        raise ValueError(f"view: there is no window for {where}; --gif makes a moving picture")
    for kind in KINDS:
        file = values[kind]
        if file and file.suffix != (".png" if kind == "plot" else f".{kind}"):
            raise ValueError(f"{kind} = {str(file)!r}: must end in .{'png' if kind == 'plot' else kind}")
    if values["mp4"]:
        checks.need("imageio_ffmpeg", "a video", "video")
    check_step(values["timestep"])
    engine, law, material, timestep = (values[name] for name in ("engine", "law", "material", "timestep"))
    options = {name: values[name] for name in scene.options}
    settings = Settings(engine, law, material, timestep, options, watch=scene.slow if values["view"] else 0.0)
    scene.demand(settings)
    return settings


def _has_display() -> bool:
    return sys.platform != "linux" or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
