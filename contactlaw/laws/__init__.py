"""The ladder of tangential laws: a file each, found by being there."""

from __future__ import annotations

from dataclasses import fields
from importlib import import_module
from math import inf
from pkgutil import iter_modules

from contactlaw import checks
from contactlaw.laws.base import KNOWN, Law

__all__ = ["LAWS", "Law", "law_of"]

for _module in iter_modules(__path__, f"{__name__}."):
    import_module(_module.name)


def _ranked() -> list[tuple[str, type[Law]]]:
    return sorted(KNOWN.items(), key=lambda item: item[1].rung)


LAWS: dict[str, Law] = {name: kind() for name, kind in _ranked() if kind.rung < inf}
"""Every law of the package by its name, with its defaults, in the order of the rungs."""


def law_of(value: str | Law) -> Law:
    """The law that this says: its name, with fields after it where they are not the defaults, or the law itself.

    For example "microslip" or "microslip node_count=32". A law of the user's own is known once its file is imported.

    Raises:
        ValueError: No such law or field, or a value that the law refuses.
    """
    if isinstance(value, Law):
        return value
    if isinstance(value, str) and value in LAWS:
        return LAWS[value]
    name, *words = value.split() if isinstance(value, str) and value.strip() else [value]
    kind = KNOWN[checks.one_of("law", name, KNOWN)]
    return kind(**checks.fields_of(f"law = {value!r}", name, words, [field.name for field in fields(kind)]))


def choices() -> str:
    """The names of the laws with their fields, for a line of help."""
    return "|".join("".join([name, *(f" {field.name}=..." for field in fields(law))]) for name, law in _ranked())


def text_of(law: Law) -> str:
    """What `law_of` turns back into this law."""
    told = [f"{field.name}={getattr(law, field.name)!r}" for field in fields(law)
            if getattr(law, field.name) != field.default]  # fmt: skip
    return " ".join([law.name, *told])
