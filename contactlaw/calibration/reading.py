"""Tables of impacts from CSV files; errors name the line."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator
from math import isfinite
from pathlib import Path

import numpy as np

from contactlaw import checks
from contactlaw.calibration.procedure import calibrate, contact_velocities
from contactlaw.calibration.result import Calibration
from contactlaw.calibration.table import Array

VELOCITIES = ("normal_before", "tangential_before", "normal_after", "tangential_after")
SPINS = ("spin_before", "spin_after")
BETWEEN = 10_000  # lines between two reports of progress


def read_table(path: Path, progress: Callable[[int], object] = lambda _: None) -> dict[str, Array]:
    """Return the columns of a table of impacts by name, shape (n,) each.

    Args:
        path: CSV file with commas, semicolons or tabs. Its first row names the columns, in any order. Empty lines and
            lines that begin with # are skipped. Columns other than `VELOCITIES` and `SPINS` are ignored.
        progress: Called with the number of lines read, every `BETWEEN` lines.

    Raises:
        ValueError: The file does not exist or is not text, a column is missing or named twice, or a cell is no number;
            the message names the line.
    """
    if not path.is_file():
        raise ValueError(f"table = {str(path)!r}: no such file")
    lines = _lines(path)
    try:
        number, first = next(lines, (1, ""))
        between = max(",;\t", key=first.count)
        names = [name.strip() for name in next(csv.reader([first], delimiter=between), [])]
        wanted = _wanted(names)
        cells: list[list[float]] = [[] for _ in wanted]
        for number, line in lines:
            (row,) = csv.reader([line], delimiter=between, skipinitialspace=True, strict=True)
            if len(row) != len(names):
                raise ValueError(f"{len(row)} cells where {len(names)} columns are named")
            for (name, place), column in zip(wanted.items(), cells, strict=True):
                column.append(_number(name, row[place]))
            if number % BETWEEN == 0:
                progress(number)
    except UnicodeDecodeError as error:
        raise ValueError(f"{path.name}: is not UTF-8 text ({error.reason}); save it as CSV in UTF-8") from None
    except (csv.Error, ValueError) as error:
        raise ValueError(f"{path.name}, line {number}: {error}") from None
    if not cells[0]:
        raise ValueError(f"{path.name}: has no row below the names of its columns")
    return {name: np.array(column) for name, column in zip(wanted, cells, strict=True)}


def _lines(path: Path) -> Iterator[tuple[int, str]]:
    """Lines with content and their numbers."""
    with path.open("rb") as file:
        begin = file.read(2)
    utf16 = begin in (b"\xff\xfe", b"\xfe\xff")
    with path.open(encoding="utf-16" if utf16 else "utf-8-sig") as text:
        for number, line in enumerate(text, 1):
            if line.strip() and not line.lstrip().startswith("#"):
                yield number, line


def _wanted(names: list[str]) -> dict[str, int]:
    """Indices of the known columns, by name."""
    known = [name for name in names if name in (*VELOCITIES, *SPINS)]
    for name in known:
        if known.count(name) > 1:
            raise ValueError(f"two columns are named {name}")
    missing = [name for name in VELOCITIES if name not in known and name != "normal_after"]
    if missing:
        raise ValueError(
            f"needs the columns {', '.join(VELOCITIES)}; lacks {', '.join(missing)}{checks.hint(missing[0], names)}"
        )
    if len([name for name in SPINS if name in known]) == 1:
        raise ValueError(f"has one of {' and '.join(SPINS)}; give both (0 where there is no spin)")
    return {name: names.index(name) for name in known}


def _number(name: str, cell: str) -> float:
    try:
        value = float(cell)
        if isfinite(value) and "_" not in cell:
            return value
    except ValueError:
        pass
    comma = " (write decimals with a point)" if "," in cell else ""
    raise ValueError(f"{name} is {cell[:40]!r}; must be a finite number{comma}")


def calibrate_columns(columns: dict[str, Array], radius: float | None, **options: object) -> Calibration:
    """Call `contactlaw.calibrate` with its options on the columns of `read_table`.

    radius: distance from the centre of mass to the contact [m], needed with columns of spin.

    Raises:
        ValueError: A value is outside its range, or there are spins and no radius.
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
