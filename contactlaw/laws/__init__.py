"""Tangential laws, one in a file. All files of this folder are imported, which registers their laws."""

from importlib import import_module
from math import inf
from pkgutil import iter_modules

from contactlaw import checks
from contactlaw.laws.base import KNOWN, Law

__all__ = ["LAWS", "Law", "law_of"]

for _module in iter_modules(__path__, f"{__name__}."):
    import_module(_module.name)


_LADDER = sorted((kind for kind in KNOWN.values() if kind.rung < inf), key=lambda kind: kind.rung)
LAWS: dict[str, Law] = {kind.name: kind() for kind in _LADDER}
"""Laws of the ladder by name, with default fields, in the order of their rungs."""


def law_of(value: str | Law) -> Law:
    """Return a law, given itself or as text: its name, followed by the fields that differ from their defaults.

    For example "microslip" or "microslip node_count=32". A user's own law is known once its file has been imported.
    """
    if isinstance(value, Law):
        return value
    if isinstance(value, str) and value in LAWS:
        return LAWS[value]
    if isinstance(value, type) and issubclass(value, Law):
        name = value.__name__
        raise ValueError(f"law = {name}: must be one of {', '.join(KNOWN)}, or an instance of the class: {name}(...)")
    return checks.named("law", value, KNOWN)
