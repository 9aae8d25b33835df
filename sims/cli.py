"""The command line of the scenes."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from contactlaw.laws import LAWS
from sims import compare, puck

app = typer.Typer(add_completion=False, no_args_is_help=False, help="Scenes that show the contact law in an engine.")
console = Console(width=None if sys.stdout.isatty() else 110)

SCENES = {"puck": "a puck strikes a clamped block on an air table (Maw, Barber & Fawcett 1981)"}


def _choices(names: Iterable[str]) -> str:
    return "|".join(names)


@app.callback(invoke_without_command=True)
def main(
    context: typer.Context,
    out: Annotated[Path, typer.Option(help="Folder for the picture.")] = compare.FIGURES,
) -> None:
    """Without a command: the main job, puck on block in both engines and by every law against the reference."""
    if context.invoked_subcommand is None:
        raise typer.Exit(compare.main_job(console, out))


@app.command("list")
def list_scenes() -> None:
    """A line for each scene."""
    for name, what in SCENES.items():
        console.print(f"[bold]{name}[/]  {what}")


@app.command("puck")
def run_puck(
    engine: Annotated[str, typer.Option(help=_choices(puck.ENGINES))] = "mujoco",
    material: Annotated[str, typer.Option(help=_choices(puck.SURFACES))] = "steel",
    psi1: Annotated[float, typer.Option(help="(kappa/mu) V_x/V_z1 before the impact.")] = 1.2,
    law: Annotated[str, typer.Option(help=_choices([*LAWS, "native"]))] = "microslip",
    timestep: Annotated[float | None, typer.Option(help="Engine step in s; default: a 200th of the contact.")] = None,
    launch: Annotated[str, typer.Option(help=_choices(puck.LAUNCHES))] = "oblique",
    heading: Annotated[float, typer.Option(help="Direction of the block's normal in the plane, in rad.")] = 0.0,
    table: Annotated[bool, typer.Option(help="Simulate gravity and a frictionless table too.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Throw the puck once."""
    try:
        throw = puck.Puck(material, psi1, law, launch, timestep, heading=heading, table=table)  # type: ignore[arg-type]
        result = puck.run(throw, engine)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from None
    values = puck.as_json(result)
    if as_json:
        print(json.dumps(values))
        return
    rows = Table("quantity", "value")
    for key, value in values.items():
        rows.add_row(key, f"{value:.6g}" if isinstance(value, float) else str(value))
    console.print(rows)
