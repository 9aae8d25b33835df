"""`python -m validation.calibrate_table table.csv`: calibrate a contact from a user's own table of impacts."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Annotated

import numpy as np
import typer  # noqa: TID253

from contactlaw import Calibration, calibrate, contact_velocities

VELOCITIES = ("normal_before", "tangential_before", "normal_after", "tangential_after")
SPINS = ("spin_before", "spin_after")

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


@app.command()
def main(
    table: Annotated[Path, typer.Argument(help="CSV file, one impact a row.")],
    inertia_ratio: Annotated[
        float, typer.Option(help="K^2 = I/(M L^2) of the body: solid ball 0.4, disk 0.5, thin shell 0.667.")
    ] = 0.4,
    radius: Annotated[
        float | None, typer.Option(help="L, centre of mass to contact [m]; needed with columns of spin.")
    ] = None,
    kappa: Annotated[float | None, typer.Option(help="Stiffness ratio to start from, 2(1 - nu)/(2 - nu).")] = None,
    hold_kappa: Annotated[bool, typer.Option("--hold-kappa", help="Take that kappa as known.")] = False,
    normal_error: Annotated[float | None, typer.Option(help="Standard deviation of normal velocities [m/s].")] = None,
    tangential_error: Annotated[
        float | None, typer.Option(help="Standard deviation of tangential velocities of the contact point [m/s].")
    ] = None,
    restitution: Annotated[float | None, typer.Option(help="e, where there is no column normal_after.")] = None,
    png: Annotated[Path | None, typer.Option(help="Picture of the impacts over the fitted curve.")] = None,
) -> None:
    """Restitution, friction and stiffness ratio with uncertainties from measured impacts.

    The first row names the columns, in any order; lines that begin with # are skipped:

    normal_before, normal_after: speeds of approach and of leaving [m/s], both positive.

    tangential_before, tangential_after: velocities of the contact point along the surface [m/s], both counted along the
    same direction.

    spin_before, spin_after (optional) [rad/s]: if they are there, the tangential velocities are those of the centre of
    mass. Positive is the spin of rolling along positive tangential velocity; backspin is negative.
    """
    try:
        columns = read_table(table)
        result = calibrate_columns(
            columns,
            radius,
            inertia_ratio=inertia_ratio,
            normal_error=normal_error,
            tangential_error=tangential_error,
            stiffness_ratio=kappa,
            hold_stiffness_ratio=hold_kappa,
            restitution=restitution,
        )
    except ValueError as error:
        typer.echo(str(error), err=True)
        raise typer.Exit(2) from None
    typer.echo(result.summary())
    if png is not None:
        from validation.calibration_figure import draw_calibration
        from validation.picture import styled

        with styled():
            draw_calibration(result).savefig(png)
        typer.echo(f"Picture: {png}")


def read_table(path: Path) -> dict[str, np.ndarray]:
    """The columns of a table of impacts, shape (n,) each.

    Args:
        path: CSV file; see `main` for its columns. Columns of other names are left alone.

    Raises:
        ValueError: No such file, a column that is missing, or a cell that is no number; the message names it.
    """
    if not path.is_file():
        raise ValueError(f"table = {str(path)!r}: no such file")
    lines = [line for line in path.read_text(encoding="utf-8-sig").splitlines() if line.strip()]
    reader = csv.DictReader((line for line in lines if not line.lstrip().startswith("#")), skipinitialspace=True)
    rows, names = list(reader), [name.strip() for name in reader.fieldnames or []]
    columns: dict[str, np.ndarray] = {}
    for place, name in enumerate(names):
        if name not in (*VELOCITIES, *SPINS):
            continue
        cells = [row[(reader.fieldnames or [])[place]] for row in rows]
        for number, cell in enumerate(cells, 1):
            try:
                float(cell)
            except (TypeError, ValueError):
                raise ValueError(f"{path.name}: {name} of impact {number} is {cell!r}; must be a number") from None
        columns[name] = np.array(cells, dtype=np.float64)
    missing = [name for name in VELOCITIES if name not in columns and name != "normal_after"]
    if missing or not rows:
        raise ValueError(
            f"{path.name}: needs the columns {', '.join(VELOCITIES)} and a row below; has {', '.join(names)}"
        )
    if len([name for name in SPINS if name in columns]) == 1:
        raise ValueError(f"{path.name}: has one of {' and '.join(SPINS)}; give both (0 where there is no spin)")
    return columns


def calibrate_columns(columns: dict[str, np.ndarray], radius: float | None, **options: object) -> Calibration:
    """`contactlaw.calibrate`, with its options, of the columns that `read_table` gave.

    Raises:
        ValueError: A value outside its range, or spins without a radius, from centre of mass to contact [m].
    """
    if "normal_after" not in columns and options.get("restitution") is None:
        raise ValueError("restitution = None: must be given where there is no column normal_after")
    sides = []
    for when in ("before", "after"):
        normal, tangential = columns.get(f"normal_{when}"), columns[f"tangential_{when}"]
        if f"spin_{when}" in columns:
            if radius is None:
                raise ValueError("radius = None: must be given [m] where there are columns of spin")
            tangential = contact_velocities(0.0, tangential, columns[f"spin_{when}"], radius)[1]
        sides.append((normal, tangential))
    return calibrate(sides[0], sides[1], **options)  # type: ignore[arg-type]


if __name__ == "__main__":
    app(prog_name="python -m validation.calibrate_table")
