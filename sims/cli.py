"""The command line of the scenes."""

from __future__ import annotations

import difflib
import json
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from contactlaw.laws import choices
from sims import compare, puck, show
from sims.commands import GIF, PLOT, VIEW, add_scene, settings_of
from sims.scene import NATIVES, check_step, find_scenes
from sims.show import console, show_all

SCENES = find_scenes()


class Scenes(TyperGroup):
    """Answers a command that there is not with the nearest one."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """The command that the arguments name."""
        if args and self.get_command(ctx, args[0]) is None and not args[0].startswith("-"):
            near = difflib.get_close_matches(args[0], self.commands, n=1, cutoff=0.4)
            hint = f"did you mean {near[0]!r}? " if near else ""
            raise typer.BadParameter(f"{args[0]!r}: {hint}There are {', '.join(self.commands)}", param_hint="scene")
        return super().resolve_command(ctx, args)


app = typer.Typer(
    cls=Scenes, add_completion=False, no_args_is_help=False, help="Scenes that show the contact law in an engine."
)


@app.callback(invoke_without_command=True)
def main(
    context: typer.Context,
    out: Annotated[Path, typer.Option(help="Folder for the pictures.")] = compare.FIGURES,
) -> None:
    """Without a command: the main job, the puck in both engines by every law against the reference, and superball."""
    if context.invoked_subcommand is None:
        failed = compare.main_job(console, out)
        failed |= show_all([SCENES["superball"]], out)
        raise typer.Exit(failed)


@app.command("list")
def list_scenes() -> None:
    """A line for each scene."""
    for name, scene in SCENES.items():
        console.print(f"[bold]{name}[/]  {scene.title}", highlight=False, soft_wrap=True)


@app.command("all")
def run_all(
    out: Annotated[Path, typer.Option(help="Folder for the pictures.")] = compare.FIGURES,
) -> None:
    """Run and check every scene, and make the picture and the GIF of each."""
    raise typer.Exit(show_all(list(SCENES.values()), out))


@app.command("puck", help=f"{SCENES['puck'].title}.")
def run_puck(
    engine: Annotated[str, typer.Option(help="|".join(puck.ENGINES))] = "mujoco",
    material: Annotated[str, typer.Option(help="|".join(puck.SURFACES))] = "steel",
    psi1: Annotated[float, typer.Option(help="(kappa/mu) V_x/V_z1 before the impact.")] = 1.2,
    law: Annotated[str, typer.Option(help=f"{choices()}|{'|'.join(NATIVES)}")] = "microslip",
    timestep: Annotated[float | None, typer.Option(help="Engine step in s; default: a 200th of the contact.")] = None,
    launch: Annotated[str, typer.Option(help="|".join(puck.LAUNCHES))] = "oblique",
    heading: Annotated[float, typer.Option(help="Direction of the block's normal in the plane, in rad.")] = 0.0,
    table: Annotated[bool, typer.Option(help="Simulate gravity and a frictionless table too.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
    plot: Annotated[Path | None, typer.Option(help=PLOT)] = None,
    gif: Annotated[Path | None, typer.Option(help=GIF)] = None,
    view: Annotated[bool, typer.Option("--view", help=VIEW)] = False,
) -> None:
    """Throw the puck once; to be seen, again, from further away and at the engine's own step."""
    try:
        check_step(timestep)
        throw = puck.Puck(material, psi1, law, launch, timestep, heading=heading, table=table)  # type: ignore[arg-type]
        result = puck.run(throw, engine)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from None
    values = puck.as_json(result)
    if as_json:
        print(json.dumps(values))
    else:
        show.figures(values)
    if plot or gif or view:
        watched = SCENES["puck"]
        own = {"psi1": psi1, "spin": float(launch == "spin")}
        settings = settings_of(watched, engine, law, material, timestep, own, view)
        show.pictures(watched, settings, show.run(watched, settings), plot, gif)


for _scene in SCENES.values():
    if _scene.name != "puck":  # has more to be asked, and a step that resolves the contact
        add_scene(app, _scene)
