"""Published data: the files of validation/data, read with their units and notes."""

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
        name, kind, source: File name without .csv, one of `KINDS`, where the numbers were read and the paper behind.
        notes: The other comment lines by their first word: conditions, materials, columns, error and so on.
        units: Unit of each column, "-" for plain numbers, "text" for words; in the order of the columns.
        numbers, words: The columns with numbers, in their unit, and with words, shape (n,) each.
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


def load(name: str, folder: Path = FOLDER) -> Measured:
    """Read a table, by its file name without .csv.

    Raises:
        ValueError: No such file, or one that is not as validation/data/README.md says; the message names what is wrong.
    """
    path = folder / f"{name}.csv"
    if not path.exists():
        known = ", ".join(sorted(p.stem for p in folder.glob("*.csv")))
        raise ValueError(f"name = {name!r}: no such table; there are {known}")
    lines = path.read_text(encoding="utf-8").splitlines()
    notes: dict[str, str] = {}
    for comment in (line[1:].strip() for line in lines if line.startswith("#")):
        word, colon, text = comment.partition(": ")
        _ask(bool(colon), path, f"comment {comment!r} must begin with a word and a colon")
        _ask(word not in notes, path, f"has {word!r} twice")
        notes[word] = text
    missing = [word for word in ("source", "kind", "units") if word not in notes]
    _ask(not missing, path, f"says nothing of {', '.join(missing)}")
    header, *body = csv.reader(line for line in lines if line and not line.startswith("#"))
    _ask(bool(body), path, "holds no rows below a header")
    units = dict(re.findall(r"(\w+) \[([^\]]+)\]", notes.pop("units")))
    _ask(list(units) == header, path, f"units are given for {', '.join(units)}, the header has {', '.join(header)}")
    for number, row in enumerate(body, 1):
        _ask(len(row) == len(header), path, f"row {number} has not as many cells as the header, {len(header)}")
    columns = dict(zip(header, zip(*body, strict=True), strict=True))
    words = {column: columns.pop(column) for column in header if units[column] == TEXT}
    numbers = {}
    for column, cells in columns.items():
        try:
            numbers[column] = np.array(cells, dtype=np.float64)
        except ValueError as error:
            raise ValueError(f"{path.name}: column {column} must hold numbers ({error})") from None
        _ask(bool(np.isfinite(numbers[column]).all()), path, f"column {column} holds a value that is not finite")
    kind, source = notes.pop("kind"), notes.pop("source")
    _ask(kind in KINDS, path, f"kind {kind!r}; must be one of {', '.join(KINDS)}")
    return Measured(name, kind, source, notes, units, numbers, words)


def _ask(kept: bool, path: Path, wrong: str) -> None:
    if not kept:
        raise ValueError(f"{path.name}: {wrong}")
