"""Published data: the files of validation/data, read with their units and notes."""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from validation.case import Array

FOLDER = Path(__file__).parent / "data"
KINDS = ("experiment", "finite elements")
TEXT = "text"  # the unit of a column that holds words


@dataclass(frozen=True)
class Measured:
    """One published table.

    Attributes:
        name: File name without .csv.
        kind: One of `KINDS`.
        source: Where the numbers were read, and the paper behind.
        notes: The other comment lines by their first word: conditions, materials, columns, error and so on.
        units: Unit of each column, "-" for plain numbers, "text" for words; in the order of the columns.
        numbers: The columns with numbers, shape (n,) each, in their unit.
        words: The columns with words, n of them each.
    """

    name: str
    kind: str
    source: str
    notes: dict[str, str]
    units: dict[str, str]
    numbers: dict[str, Array]
    words: dict[str, tuple[str, ...]]

    def __getitem__(self, column: str) -> Array:
        """A column with numbers, shape (n,), in the unit that `units` names.

        Raises:
            KeyError: No such column; the message names those there are.
        """
        if column not in self.numbers:
            raise KeyError(f"column = {column!r}: {self.name} has the numbers {', '.join(self.numbers)}")
        return self.numbers[column]

    def __len__(self) -> int:
        """How many rows."""
        return len(next(iter({**self.numbers, **self.words}.values())))


def names() -> list[str]:
    """Every table there is."""
    return sorted(path.stem for path in FOLDER.glob("*.csv"))


def load(name: str, folder: Path = FOLDER) -> Measured:
    """Read a table.

    Args:
        name: File name without .csv.
        folder: Where it is.

    Raises:
        ValueError: No such file, or one that is not as validation/data/README.md says; the message names what is wrong.
    """
    path = folder / f"{name}.csv"
    if not path.exists():
        raise ValueError(
            f"name = {name!r}: no such table; there are {', '.join(sorted(p.stem for p in folder.glob('*.csv')))}"
        )
    lines = path.read_text(encoding="utf-8").splitlines()
    notes = _notes(path, [line[1:].strip() for line in lines if line.startswith("#")])
    rows = list(csv.reader(line for line in lines if line and not line.startswith("#")))
    if len(rows) < 2:
        raise ValueError(f"{path.name}: holds no rows below a header")
    header, body = rows[0], rows[1:]
    units = dict(re.findall(r"(\w+) \[([^\]]+)\]", notes.pop("units")))
    if list(units) != header:
        raise ValueError(f"{path.name}: units are given for {', '.join(units)}, the header has {', '.join(header)}")
    ragged = [number for number, row in enumerate(body, 1) if len(row) != len(header)]
    if ragged:
        raise ValueError(f"{path.name}: row {ragged[0]} has not as many cells as the header, {len(header)}")
    columns = dict(zip(header, zip(*body, strict=True), strict=True))
    numbers = {}
    for column in (column for column in header if units[column] != TEXT):
        try:
            numbers[column] = np.array(columns[column], dtype=np.float64)
        except ValueError as error:
            raise ValueError(f"{path.name}: column {column} must hold numbers ({error})") from None
        if not np.isfinite(numbers[column]).all():
            raise ValueError(f"{path.name}: column {column} holds a value that is not finite")
    kind, source = notes.pop("kind"), notes.pop("source")
    if kind not in KINDS:
        raise ValueError(f"{path.name}: kind {kind!r}; must be one of {', '.join(KINDS)}")
    words = {column: columns[column] for column in header if units[column] == TEXT}
    return Measured(name, kind, source, notes, units, numbers, words)


def _notes(path: Path, comments: list[str]) -> dict[str, str]:
    """The comment lines by their first word."""
    notes = {}
    for comment in comments:
        word, colon, text = comment.partition(": ")
        if not colon:
            raise ValueError(f"{path.name}: comment {comment!r} must begin with a word and a colon")
        if word in notes:
            raise ValueError(f"{path.name}: has {word!r} twice")
        notes[word] = text
    missing = [word for word in ("source", "kind", "units") if word not in notes]
    if missing:
        raise ValueError(f"{path.name}: says nothing of {', '.join(missing)}")
    return notes
