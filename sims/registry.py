"""What scenes and cases of validation share: limits that must be kept, and kinds that register themselves by name."""

import importlib
import math
import pkgutil
from dataclasses import dataclass
from typing import ClassVar, Generic, Protocol, TypeVar


@dataclass(frozen=True)
class Limit:
    """A figure that is asked for.

    Attributes:
        name: What was measured, in words.
        asked: The limit.
        reached: The measured value.
        unit: Of both; "" for a plain number.
        at_least: Whether the measured value must not be below the limit, instead of not above.
    """

    name: str
    asked: float
    reached: float
    unit: str = ""
    at_least: bool = False

    @property
    def passed(self) -> bool:
        """Whether the limit is kept; a value that is not finite keeps none."""
        if not math.isfinite(self.reached):
            return False
        return self.reached >= self.asked if self.at_least else self.reached <= self.asked


class Named(Protocol):
    """Something with a name of its own."""

    name: ClassVar[str]


Kind = TypeVar("Kind", bound=Named)
Some = TypeVar("Some", bound=type)


class Registry(Generic[Kind]):
    """One of each kind in the modules of a package, by its name; a new file is found by itself.

    Args:
        package: Whose modules register their kinds, as they are imported.
        word: What the kinds are called.
    """

    def __init__(self, package: str, word: str) -> None:
        self.package, self.word = package, word
        self.known: dict[str, Kind] = {}

    def register(self, kind: Some) -> Some:
        """Class decorator: make one known under its name."""
        other = self.known.get(kind.name)
        if other is not None and type(other).__module__ != kind.__module__:
            raise ValueError(f"name = {kind.name!r}: {type(other).__module__} has a {self.word} of this name already")
        self.known[kind.name] = kind()
        return kind

    def find(self) -> dict[str, Kind]:
        """Import every module and return what they registered, by name."""
        for module in pkgutil.iter_modules(importlib.import_module(self.package).__path__):
            importlib.import_module(f"{self.package}.{module.name}")
        return dict(sorted(self.known.items()))
