"""The configuration of a contact in a model: what XML says and `add_contact` writes, read back into a pair."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import groupby
from typing import Any

from contactlaw import checks, losses
from contactlaw.laws import law_of, text_of
from contactlaw.material import MATERIALS, Material
from contactlaw.pair import ContactPair

PLUGIN_NAME = "contactlaw.contact"
BLIND = "contactlaw.blind"
"""The same plugin without sensors, for which MuJoCo would work in every step: models that sense nothing get it."""

KEYS = (
    "geom1", "geom2", "material1", "material2", "friction", "restitution", "radius", "law", "stiffness_ratio",
    "rolling_resistance", "substeps", "rounding", "native", "overlaps", "name",
)  # fmt: skip
"""Configuration keys of the plugin; geom1, geom2, material1, material2 and friction are required.

geom1 and geom2 are names of geoms, or several with spaces, or with bars "|", between: then each of the first with each
of the second. native: of these only those that the engine would make by itself, if each geom had the contype and
conaffinity that are written here: "1/1", or "1/1x20 0/1x3" for runs of them, the geoms of the first set first. A
material is a name in `MATERIALS` or "E nu" in SI units. friction, restitution: a number, or one of `contactlaw.losses`
with its fields, "plastic yield_speed=0.1" say; friction "geoms": that of the geoms as the model has it, by the engine's
rule, "geoms 12": with room for so many different ones, else 8. law: as for `laws.law_of`, "microslip node_count=32".
substeps: the least number of the law's own steps in a contact; the most that any contact of a model asks holds for all.
rounding: radius of the edges of boxes and cylinders [m]; a tenth of their smallest half length, where it is not given.
overlaps: "keep": what is put into each other is thrown apart; else it counts as just touching, see
`world.contacts.touch.begin_contact`.
name: the instance's own. Where its model is attached to another one, all names get a prefix and a suffix: those of the
geoms are what the instance's name has got then.
"""

SUBSTEPS = 100
"""Least number of substeps in a contact, unless told otherwise: the error of an impact is then some 3e-4 in psi_2."""


LEAST_SUBSTEPS, FRICTIONS = 10, 8
OVERLAPS = ("relax", "keep")


def instance_name(geoms1: Sequence[str], geoms2: Sequence[str]) -> str:
    """Name of the plugin instance that `add_contact` makes."""
    return "contactlaw:" + ":".join(
        names[0] if len(names) == 1 else f"{names[0]}..{names[-1]}({len(names)})" for names in (geoms1, geoms2)
    )


@dataclass(frozen=True)
class Contact:
    """A contact as configured: geoms, each of the first with each of the second; the pair; how to treat it.

    Attributes as in `KEYS` and of `spec.add_contact`, besides
        ones, twos: Geoms of a specification; where it has been read, one text each, which has their names.
        pair: A `ContactPair`; None: they go on touching by the engine.
        frictions: How many different coefficients of its geoms there is room for; 0: the pair's own holds.
        as_native: Whether it means contacts that the model makes natively; of a list that is being put into a model.
        number: Its place in the list.
    """

    ones: Sequence[Any]
    twos: Sequence[Any]
    pair: Any
    substeps: int = SUBSTEPS
    rounding: float | None = None
    frictions: int = 0
    overlaps: str = "relax"
    native: tuple[tuple[int, int], ...] = ()
    name: str = ""
    as_native: bool = False
    others: bool = True
    number: int = 0

    def __post_init__(self) -> None:
        """Raises ValueError where a setting is not allowed."""
        checks.count("substeps", self.substeps, LEAST_SUBSTEPS)
        checks.one_of("overlaps", self.overlaps, OVERLAPS)
        checks.truth("others", self.others)
        checks.truth("as_native", self.as_native)
        if self.rounding is not None:
            checks.positive("rounding", self.rounding)


def write(contact: Contact) -> dict[str, str]:
    """The configuration that `read` turns back into this contact, digit for digit."""
    pair = contact.pair
    config = {
        "name": contact.name,
        "geom1": _joined([geom.name for geom in contact.ones]),
        "geom2": _joined([geom.name for geom in contact.twos]),
        "material1": f"{pair.a.youngs_modulus!r} {pair.a.poissons_ratio!r}",
        "material2": f"{pair.b.youngs_modulus!r} {pair.b.poissons_ratio!r}",
        "friction": f"geoms {contact.frictions}" if contact.frictions else losses.text_of(pair.friction),
        "restitution": losses.text_of(pair.restitution),
        "law": text_of(pair.rule),
        "substeps": str(contact.substeps),
        "overlaps": contact.overlaps,
    }
    numbers = {
        "radius": pair.radius, "stiffness_ratio": pair.stiffness_ratio, "rounding": contact.rounding,
        "rolling_resistance": pair.rolling_resistance or None,
    }  # fmt: skip
    config |= {key: repr(float(number)) for key, number in numbers.items() if number is not None}
    if contact.native:
        runs = ((f"{bits[0]}/{bits[1]}", len(list(run))) for bits, run in groupby(contact.native))
        config["native"] = " ".join(f"{bits}x{count}" for bits, count in runs)
    return config


def _joined(names: list[str]) -> str:
    return ("|" if any(" " in name for name in names) else " ").join(names)


def split(text: str) -> list[str]:
    """Names of geoms, as a configuration has several."""
    return text.split("|") if "|" in text else text.split()


@cache  # read for each mjData made; a pair should warn of its coupling once
def read(items: tuple[tuple[str, str], ...]) -> Contact:
    """The contact that a configuration describes.

    Raises:
        ValueError: A key is missing or a value is not allowed; the message names it.
    """
    config = {key: value for key, value in items if value}
    for key in ("geom1", "geom2", "material1", "material2", "friction"):
        if key not in config:
            raise ValueError(f"{key}: missing in the configuration of {PLUGIN_NAME}")

    of_geoms = re.fullmatch(r"geoms(?: (\d+))?", config["friction"])
    substeps: Any = config.get("substeps", str(SUBSTEPS))

    def optional(key: str) -> float | None:
        text = config.get(key)
        if text is not None and not losses.NUMBER.fullmatch(text.strip()):
            raise ValueError(f"{key} = {text!r}: must be a number")
        return None if text is None else float(text)

    pair = ContactPair(
        _material("material1", config["material1"]),
        _material("material2", config["material2"]),
        0.0 if of_geoms else losses.read("friction", config["friction"]),
        restitution=losses.read("restitution", config.get("restitution", "1")),
        radius=optional("radius"),
        law=law_of(config.get("law", "microslip")),
        stiffness_ratio=optional("stiffness_ratio"),
        rolling_resistance=optional("rolling_resistance") or 0.0,
    )
    return Contact(
        (config["geom1"],), (config["geom2"],), pair,
        int(substeps) if substeps.strip().isdecimal() else substeps,
        optional("rounding"),
        int(of_geoms[1] or FRICTIONS) if of_geoms else 0,
        config.get("overlaps", "relax"),
        tuple(bits for run in config.get("native", "").split() for bits in _bits(run)),
        config.get("name", ""),
    )  # fmt: skip


def _bits(run: str) -> list[tuple[int, int]]:
    found = re.fullmatch(r"(\d+)/(\d+)(?:x(\d+))?", run)
    if not found:
        raise ValueError(f"native = {run!r}: must be 'CONTYPE/CONAFFINITY' or 'CONTYPE/CONAFFINITYxCOUNT'")
    return int(found[3] or 1) * [(int(found[1]), int(found[2]))]


def _material(key: str, text: str) -> Material:
    if text in MATERIALS:
        return MATERIALS[text]
    words = text.split()
    if len(words) != 2 or not all(losses.NUMBER.fullmatch(word) for word in words):
        names = f"{', '.join(MATERIALS)}{checks.hint(text, MATERIALS)}"
        raise ValueError(f"{key} = {text!r}: must be 'E nu' in SI units or one of {names}")
    try:
        return Material(float(words[0]), float(words[1]))
    except ValueError as error:
        raise ValueError(f"{key} = {text!r}: {error}") from None
