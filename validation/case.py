"""The class `Case` of validation cases, and the registry of all of them."""

import re
from abc import ABC, abstractmethod
from collections import ChainMap
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from importlib import import_module
from pkgutil import iter_modules
from types import MappingProxyType
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sims.registry import Limit

Array = NDArray[np.float64]
Data = dict[str, Any]
"""What a case measured, as it is saved: JSON types only."""
Axes = Any
"""matplotlib's, which is imported only to draw."""


class Outcome(NamedTuple):
    """Outcome of a case: limits, asked and reached; data for table and picture; problems that make a run not sane
    (not finite, outside the friction cone, energy grown), in which case its time does not count."""

    limits: Sequence[Limit]
    data: Data
    problems: Sequence[str] = ()


class Table:
    """Column heads, and rows of text, written as "one | two | three"; `add` makes one from the figures of an entry."""

    def __init__(self, heads: str | Sequence[str], row: str = "", entries: Iterable[Data] = ()) -> None:
        self.heads = _cells(heads) if isinstance(heads, str) else heads
        self.rows: list[Sequence[str]] = []
        for entry in entries:
            self.add(row, entry)

    def add(self, row: str, *figures: Mapping[str, Any], **named: Any) -> None:
        """A row: each cell is a format, "{name}, {error:.1e}", of the figures; those at the end may be left out."""
        told = ChainMap(named, *map(dict, figures))
        cells = [cell.format_map(told) for cell in _cells(row)]
        self.rows.append(cells + [""] * (len(self.heads) - len(cells)))


def _cells(row: str) -> list[str]:
    return [cell.strip() for cell in row.split("|")]


def worst(runs: Iterable[Data], *keys: str, **known: Any) -> float:
    """Largest of some values over the runs that match the known ones."""
    return max(run[key] for run in runs if known.items() <= run.items() for key in keys)


class Case(ABC):
    """One claim, and how it is measured.

    To add a case, put one file with one subclass of this into validation/cases. The name of the file is that of the
    case and its results, and what -f matches; the class's docstring is the claim, in words that a newcomer understands.
    And:
      1. `title`: title of its chapter;
      2. `needs`: modules that the extra `all` does not install, and the package of each; without them the case is
         skipped with a message. Import engines, matplotlib and scipy only inside the methods;
      3. `run`: measure. Everything that table and picture show goes into the data, which is saved as JSON;
      4. `table`, for values that no limit shows, and, where it helps, `draw`: from the saved data alone;
      5. `caption`: of the picture; empty (the default) means no picture; `sheet`: its panels, as `picture.panels` takes
         them;
      6. `place`: order in the report, small numbers first.
    """

    name: ClassVar[str]
    title: ClassVar[str]
    claim: ClassVar[str]
    caption: ClassVar[str] = ""
    sheet: ClassVar[Mapping[str, Any]] = MappingProxyType({})
    needs: ClassVar[Mapping[str, str]] = MappingProxyType({})
    place: ClassVar[int] = 100

    @abstractmethod
    def run(self, quick: bool) -> Outcome:
        """Measure; quick: fewer impacts and repeats, seconds instead of up to a minute."""

    def table(self, data: Data) -> Table | None:  # noqa: B027
        """Values that no limit shows, as text."""

    def draw(self, data: Data, *axes: Axes) -> None:  # noqa: B027
        """Draw the picture on the panels of its sheet."""


@cache
def find_cases() -> dict[str, Case]:
    """The case of every file of validation/cases, by the name of the file, in the order of the report."""
    found: dict[str, Case] = {}
    for file in iter_modules(import_module("validation.cases").__path__):
        module = import_module(f"validation.cases.{file.name}")
        kinds = (one for one in vars(module).values() if isinstance(one, type) and issubclass(one, Case))
        kind = next(one for one in kinds if one.__module__ == module.__name__)
        kind.name, kind.claim = file.name, vars(kind).get("claim", " ".join((kind.__doc__ or "").split()))
        found[file.name] = kind()
    return dict(sorted(found.items(), key=lambda item: (item[1].place, item[0])))


def select(pattern: str) -> list[Case]:
    """Cases whose name a regular expression matches somewhere.

    Raises:
        ValueError: The pattern is no regular expression, or matches none; the message names what there is.
    """
    cases = find_cases()
    try:
        chosen = [case for name, case in cases.items() if re.search(pattern, name)]
    except re.error as error:
        raise ValueError(f"-f {pattern!r}: not a regular expression ({error})") from None
    if not chosen:
        raise ValueError(f"-f {pattern!r}: matches no case; there are {', '.join(cases)}")
    return chosen
