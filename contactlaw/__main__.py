"""`python -m contactlaw`: impacts, contact pairs and calibration from the command line."""

from __future__ import annotations

import argparse
import json
import sys
import warnings
from collections.abc import Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import numpy as np

import contactlaw
from contactlaw import MATERIALS, ContactPair, ContactWarning, Material, rebound
from contactlaw.calibration.reading import SPINS, VELOCITIES, calibrate_columns, read_table
from contactlaw.ending import run
from contactlaw.laws import choices, ranked

TABLE = f"""CSV file in SI units, one impact a row. Its first row names the columns: {", ".join(VELOCITIES)} (speeds of
approach and of separation, and velocities of the contact point along the surface, both positive in the same direction).
With the columns {", ".join(SPINS)} the tangential velocities are those of the centre of mass; the spin of a ball that
rolls along positive velocity is positive."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command of the arguments (None: of the command line) and return the exit code."""
    parser = _parser()
    given = parser.parse_args(arguments)
    with warnings.catch_warnings():
        warnings.showwarning = lambda message, *_: print(f"note: {message}", file=sys.stderr)
        warnings.simplefilter("always", ContactWarning)
        try:
            given.run(given)
        except (ValueError, ImportError, OSError) as error:
            print(f"{parser.prog} {given.command}: {error}", file=sys.stderr)
            return 2
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m contactlaw", description="Oblique elastic impact with stick and slip inside the contact."
    )
    parser.add_argument("--version", action="version", version=contactlaw.__version__)
    commands = parser.add_subparsers(dest="command", required=True)

    def command(name: str, run: Any, text: str) -> argparse.ArgumentParser:
        one = commands.add_parser(name, help=text, description=text)
        one.set_defaults(run=run)
        return one

    one = command("rebound", _rebound, "psi_2 after whole impacts, psi = (kappa/mu) V_x/V_z1")
    one.add_argument("psi_1", type=float, nargs="+", help="before the impact")
    one.add_argument("--chi", type=float, default=1.256, help="(kappa/2) m_N/m_T; default: the paper's steel puck")
    one.add_argument("--law", default="microslip", help=choices())
    one.add_argument("--restitution", type=float, default=1.0, help="in [1e-6, 1]")
    one.add_argument("--json", action="store_true", help="one JSON object")

    one = command(
        "pair", _pair, "effective moduli and kappa of two materials; duration, overlap and force of an impact"
    )
    one.add_argument("a", help=" | ".join(MATERIALS) + ", or 'E nu' in Pa")
    one.add_argument("b", help="the same")
    for name, default, text in (
        ("friction", 0.3, "mu"), ("restitution", 1.0, "e"), ("radius", 0.01, "effective radius [m]"),
        ("mass", 0.1, "effective mass [kg]"), ("speed", 1.0, "approach [m/s]"),
    ):  # fmt: skip
        one.add_argument(f"--{name}", type=float, default=default, help=f"{text}; default {default}")

    one = command("calibrate", _calibrate, "friction, restitution and stiffness ratio from a table of measured impacts")
    one.add_argument("table", type=Path, help=TABLE)
    one.add_argument("--inertia-ratio", type=float, default=0.4, help="K^2 = I/(M L^2): ball 0.4, disk 0.5, shell 2/3")
    for name, text in (
        ("radius", "L, centre of mass to contact [m]; needed with columns of spin"),
        ("kappa", "stiffness ratio to start from, 2(1 - nu)/(2 - nu)"),
        ("normal-error", "standard deviation of normal velocities [m/s]"),
        ("tangential-error", "standard deviation of tangential velocities of the contact point [m/s]"),
        ("restitution", "e, where there is no column normal_after"),
    ):
        one.add_argument(f"--{name}", type=float, help=text)
    one.add_argument("--hold-kappa", action="store_true", help="take that kappa as known")
    one.add_argument("--png", type=Path, help="picture of the impacts over the fitted curve")

    command("materials", _materials, "the named materials, each with its source")
    command("laws", _laws, "the laws")
    return parser


def _rebound(given: argparse.Namespace) -> None:
    after = np.atleast_1d(rebound(given.psi_1, given.chi, given.law, given.restitution)).tolist()
    if given.json:
        print(json.dumps({"chi": given.chi, "psi_1": given.psi_1, "psi_2": after}))
        return
    print("   psi_1     psi_2")
    for before, one in zip(given.psi_1, after, strict=True):
        print(f"{before:8.4f}  {one:8.4f}")


def _material(text: str) -> Material | str:
    try:
        youngs_modulus, poissons_ratio = map(float, text.split())
    except ValueError:
        return text
    return Material(youngs_modulus, poissons_ratio, name=text)


def _pair(given: argparse.Namespace) -> None:
    pair = ContactPair(_material(given.a), _material(given.b), given.friction, given.restitution, given.radius)
    rows = {
        "E* [Pa]": pair.effective_modulus, "G* [Pa]": pair.effective_shear_modulus, "kappa = G*/E*": pair.kappa,
        "contact [s]": pair.contact_duration(given.mass, given.speed),
        "greatest overlap [m]": pair.greatest_overlap(given.mass, given.speed),
        "greatest force [N]": pair.greatest_force(given.mass, given.speed),
    }  # fmt: skip
    for name, value in rows.items():
        print(f"{name:22}{value:.4g}")


def _calibrate(given: argparse.Namespace) -> None:
    with _bar() as bar:
        columns = read_table(given.table, lambda line: bar and bar(f"{given.table.name}: {line} lines"))
        if bar:
            bar(f"fit of {columns['tangential_before'].size} impacts")
        result = calibrate_columns(
            columns, given.radius, inertia_ratio=given.inertia_ratio, normal_error=given.normal_error,
            tangential_error=given.tangential_error, stiffness_ratio=given.kappa,
            hold_stiffness_ratio=given.hold_kappa, restitution=given.restitution,
        )  # fmt: skip
    print(result.summary())
    if given.png is not None:
        from contactlaw.calibration.figure import save_calibration

        print(f"picture: {save_calibration(result, given.png)}")


def _bar() -> Any:
    """Return a context that yields a function which shows a text and the elapsed time, or None.

    It yields None if stderr is no terminal or rich is not installed.
    """
    if not sys.stderr.isatty():
        return nullcontext()
    try:
        from rich.console import Console
        from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn
    except ModuleNotFoundError:
        return nullcontext()

    class Bar(Progress):
        def __enter__(self) -> Any:
            super().__enter__()
            task = self.add_task("")
            return lambda text: self.update(task, description=text)

    return Bar(SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn(),
               console=Console(stderr=True), transient=True)  # fmt: skip


def _materials(_: argparse.Namespace) -> None:
    for name, one in MATERIALS.items():
        density = "" if one.density is None else f", {one.density:g} kg/m^3"
        print(f"{name}: E {one.youngs_modulus:.4g} Pa, nu {one.poissons_ratio:g}{density}\n    {one.source}")


def _laws(_: argparse.Namespace) -> None:
    for name, kind in ranked():
        print(f"{name}: {(kind.__doc__ or '').splitlines()[0]}")


if __name__ == "__main__":
    run(lambda: sys.exit(main()))
