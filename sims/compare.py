"""The main job: the puck in both engines and by every law, beside the reference, as a table and a picture."""

import importlib.util
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from contactlaw.laws import LAWS
from sims.puck import ENGINES, SURFACES, Puck, Result, reference, run
from sims.scene import NATIVE_DAMPED, NATIVES
from sims.show import bar

FIGURES = Path("figures")
"""Where pictures go unless told otherwise, in the folder that one is in."""

TABLE_PSI_1 = (0.5, 1.2, 2.0, 3.0, 4.5)
CURVE_PSI_1 = np.linspace(0.1, 6.0, 25)
FINE_PSI_1 = np.linspace(0.0, 6.0, 31)


def main_job(console: Console, out: Path) -> int:
    """Run everything, print the table, draw the picture. Returns an exit code."""
    engines = [engine for engine in ENGINES if importlib.util.find_spec(engine)]
    for engine in sorted(set(ENGINES) - set(engines)):
        console.print(f"[yellow]{engine} is not installed: left out (pip install 'contactlaw[{engine}]')[/]")
    table_throws = [
        (engine, Puck(material, psi_1, law))
        for material in SURFACES
        for engine in engines
        for law in LAWS
        for psi_1 in TABLE_PSI_1
    ]
    curve_throws = [
        (engine, Puck(material, float(psi_1), law))
        for material in SURFACES
        for engine in engines
        for law in ("microslip", *NATIVES)
        if law != NATIVE_DAMPED or engine == "mujoco"
        for psi_1 in CURVE_PSI_1
    ]
    throws = table_throws + curve_throws
    warm_up = [(engine, Puck()) for engine in engines]  # the first one compiles
    with bar() as progress:
        curves = {
            material: np.array(
                [reference(float(psi), Puck(material).chi, Puck(material).pair.restitution) for psi in FINE_PSI_1]
            )
            for material in progress.track(SURFACES, description="reference")
        }
        for engine, puck in progress.track(warm_up, description="warm-up"):
            run(puck, engine)
        results = [run(puck, engine) for engine, puck in progress.track(throws, description="throws")]
    in_table, drawn = results[: len(table_throws)], results[len(table_throws) :]
    for material in SURFACES:
        console.print(_table(material, [result for result in in_table if result.material == material]))
    if importlib.util.find_spec("matplotlib"):
        with bar() as progress:
            progress.add_task("picture", total=None)
            from sims.draw import draw_rebounds

            file = draw_rebounds(drawn, FINE_PSI_1, curves, out / "rebounds.png")
        console.print(f"picture: {file}")
    else:
        console.print("[yellow]matplotlib is not installed: no picture (pip install 'contactlaw\\[plot]')[/]")
    failed = [message for result in results if (message := _failure(result))]
    for message in failed:
        console.print(f"[red]{message}[/]")
    return 1 if failed else 0


def _failure(result: Result) -> str:
    try:
        result.check()
    except AssertionError as error:
        return f"{result.engine} {result.material} {result.law} psi_1 = {result.psi1:g}: {error}"
    return ""


def _table(material: str, results: list[Result]) -> Table:
    one = results[0]
    table = Table(
        title=f"{material} puck: chi = {one.chi:.3f}, mu = {one.mu}, e = {one.restitution}, "
        f"contact {one.contact_duration * 1e6:.0f} us of {one.contact_duration / one.timestep:.0f} steps",
        caption="psi = (kappa/mu) V_x/V_z1 of the contact point before (1) and after (2); reference: "
        "psi_2 of the annulus solver; energy: after over before",
        padding=(0, 0, 0, 1),
    )
    for name in ("engine", "law"):
        table.add_column(name)
    for name in ("psi_1\n[-]", "psi_2\n[-]", "reference\n[-]", "error\n[-]", "energy\n[-]", "time\n[ms]"):
        table.add_column(escape(name), justify="right")
    last = ("", "")
    for r in results:
        if (r.engine, r.law) != last:
            table.add_section()
        last = (r.engine, r.law)
        style = "bold" if r.law == "microslip" else ""
        table.add_row(
            r.engine, r.law, f"{r.psi1:.2f}", f"{r.psi2:+.4f}", f"{r.psi2_reference:+.4f}", f"{r.error:+.4f}",
            f"{r.energy_ratio:.4f}", f"{r.wall_time * 1e3:.2f}", style=style,
        )  # fmt: skip
    return table
