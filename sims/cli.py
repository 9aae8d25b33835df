"""The command line of the scenes."""

from __future__ import annotations

import difflib
import json
from collections.abc import Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from sims import compare, puck, show
from sims.commands import add_scene, settings_of
from sims.scene import Scene, find_scenes
from sims.show import console, show_all

SCENES = find_scenes()


class Scenes(TyperGroup):
    """Commands that offer the nearest name for an unknown one."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """The command that the arguments name."""
        if args and self.get_command(ctx, args[0]) is None and not args[0].startswith("-"):
            near = difflib.get_close_matches(args[0], self.commands, n=1, cutoff=0.4)
            hint = f"did you mean {near[0]!r}? " if near else ""
            raise typer.BadParameter(f"{args[0]!r}: {hint}There are {', '.join(self.commands)}", param_hint="scene")
        return super().resolve_command(ctx, args)


app = typer.Typer(
    cls=Scenes,
    add_completion=False,
    no_args_is_help=False,
    help="Scenes that show the contact law in an engine. Without a command: puck and superball in both engines.",
)


@app.callback(invoke_without_command=True)
def main(
    context: typer.Context,
    out: Annotated[Path, typer.Option(help="Folder for the pictures.")] = compare.FIGURES,
) -> None:
    """Without a command: the puck by every law in both engines, against the reference; then the superball."""
    if context.invoked_subcommand is None:
        failed = compare.main_job(console, out)
        failed |= show_all([SCENES["superball"]], out)
        raise typer.Exit(failed)


@app.command("list")
def list_scenes() -> None:
    """List the scenes, one line each."""
    width = max(map(len, SCENES))
    for name, scene in SCENES.items():
        console.print(f"[bold]{name:{width}}[/]  {scene.title}", highlight=False, soft_wrap=True)


@app.command("all")
def run_all(
    out: Annotated[Path, typer.Option(help="Folder for the pictures.")] = compare.FIGURES,
) -> None:
    """Run and check every scene, and make its picture and GIF."""
    raise typer.Exit(show_all(list(SCENES.values()), out))


def run_puck(scene: Scene, values: Mapping[str, Any]) -> None:
    """Throw the puck once; for pictures again, from further away and at the engine's own step."""
    values = {**values, "spin": int(values["launch"] == "spin")}
    settings = settings_of(scene, values)
    told = SimpleNamespace(**scene.demand(settings))
    throw = puck.Puck(
        told.material, told.psi1, settings.law or "microslip", values["launch"], settings.timestep,
        heading=values["heading"], table=values["table"], **puck.changes(told),
    )  # fmt: skip
    result = puck.as_json(puck.run(throw, settings.engine))
    if values["as_json"]:
        print(json.dumps(result))
    else:
        show.figures(result)
    if values["plot"] or values["gif"] or values["mp4"] or values["view"]:
        recording = show.run(scene, settings)
        show.pictures(scene, settings, recording, values["plot"], values["gif"], mp4=values["mp4"])


for _scene in SCENES.values():
    if _scene.name != "puck":
        add_scene(app, _scene)
add_scene(  # with more options, and a step that resolves the contact
    app, SCENES["puck"], run_puck, spin=(int, 0, typer.Option(hidden=True)),
    launch=(str, "oblique", typer.Option(help="|".join(puck.LAUNCHES))),
    heading=(float, 0.0, typer.Option(help="direction of the block's normal in the plane, in rad")),
    table=(bool, False, typer.Option("--table", help="also simulate gravity and a frictionless table")),
    timestep=(float | None, None, typer.Option(help="Engine step in s; default: a 200th of the contact.")),
)  # fmt: skip
