"""The ladder of tangential laws: a file each, found by being there."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import fields
from functools import lru_cache
from importlib import import_module
from pkgutil import iter_modules

from contactlaw import checks
from contactlaw.laws.base import KNOWN, Law

__all__ = ["LAWS", "Law", "law_of"]

for _module in iter_modules(__path__, f"{__name__}."):
    import_module(_module.name)


class _Laws(Mapping[str, Law]):
    """Every law whose file has been imported, with its defaults, by its name; in the order of the rungs."""

    def __getitem__(self, name: str) -> Law:
        return _plain(KNOWN[name])

    def __iter__(self) -> Iterator[str]:
        return iter(sorted(KNOWN, key=lambda name: KNOWN[name].rung))

    def __len__(self) -> int:
        return len(KNOWN)


LAWS: Mapping[str, Law] = _Laws()


@lru_cache(maxsize=64)
def _plain(kind: type[Law]) -> Law:
    return kind()


def law_of(value: str | Law) -> Law:
    """The law that this says: its name, with fields after it where they are not the defaults, or the law itself.

    For example "microslip" or "microslip node_count=32".

    Raises:
        ValueError: No such law or field, or a value that the law refuses.
    """
    if isinstance(value, Law):
        return value
    if isinstance(value, str) and value in KNOWN:
        return LAWS[value]
    name, *words = value.split() if isinstance(value, str) and value.strip() else [value]
    law = LAWS[checks.one_of("law", name, LAWS)]
    given = {}
    for word in words:
        key, _, text = word.partition("=")
        checks.one_of(f"field of {name}", key, [field.name for field in fields(law)])
        given[key] = _number(f"law = {value!r}", text)
    return type(law)(**given)


def choices() -> str:
    """The names of the laws with their fields, for a line of help."""
    return "|".join("".join([name, *(f" {field.name}=..." for field in fields(law))]) for name, law in LAWS.items())


def text_of(law: Law) -> str:
    """What `law_of` turns back into this law."""
    told = [f"{field.name}={getattr(law, field.name)!r}" for field in fields(law)
            if getattr(law, field.name) != field.default]  # fmt: skip
    return " ".join([law.name, *told])


def _number(where: str, text: str) -> float:
    """A whole number where it is written as one."""
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    raise ValueError(f"{where}: {text!r} must be a number")
