"""The configuration of a contact in a model: what XML says and `add_contact` writes, read back into a pair."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache

from contactlaw import checks
from contactlaw.laws import law_of, text_of
from contactlaw.material import MATERIALS, Material
from contactlaw.pair import ContactPair

PLUGIN_NAME = "contactlaw.contact"
KEYS = (
    "geom1", "geom2", "material1", "material2", "friction", "restitution", "radius", "law", "stiffness_ratio",
    "substeps",
)  # fmt: skip
"""Configuration keys of the plugin; geom1, geom2, material1, material2 and friction are required.

geom1 and geom2 are names of geoms, or several with spaces between: then each of the first with each of the second. A
material is a name in `MATERIALS` or "E nu" in SI units. law: as for `laws.law_of`, "microslip node_count=32" say.
substeps: the least number of the law's own steps in a contact; the most that any contact of a model asks holds for all.
"""

SUBSTEPS = 100
"""Least number of substeps in a contact, unless told otherwise: the error of an impact is then some 3e-4 in psi_2."""


LEAST_SUBSTEPS = 10
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|[+-]?(inf|nan)", re.IGNORECASE)  # as XML writes one


def instance_name(geoms1: tuple[str, ...], geoms2: tuple[str, ...]) -> str:
    """Name of the plugin instance that `add_contact` makes."""
    return "contactlaw:" + ":".join(
        names[0] if len(names) == 1 else f"{names[0]}..{names[-1]}({len(names)})" for names in (geoms1, geoms2)
    )


@dataclass(frozen=True)
class Contact:
    """A contact as configured: names of geoms, each of the first with each of the second; the pair; how to treat it.

    Attributes:
        geoms1, geoms2: As the configuration has them; `resolve` splits what is no name by itself.
        pair: The contact.
        substeps: Least number of the law's steps in a contact.
    """

    geoms1: tuple[str, ...]
    geoms2: tuple[str, ...]
    pair: ContactPair
    substeps: int = SUBSTEPS


def write(contact: Contact) -> dict[str, str]:
    """The configuration that `read` turns back into this contact, digit for digit."""
    pair = contact.pair
    config = {
        "geom1": " ".join(contact.geoms1),
        "geom2": " ".join(contact.geoms2),
        "material1": f"{pair.a.youngs_modulus!r} {pair.a.poissons_ratio!r}",
        "material2": f"{pair.b.youngs_modulus!r} {pair.b.poissons_ratio!r}",
        "friction": repr(pair.friction),
        "restitution": repr(pair.restitution),
        "law": text_of(pair.rule),
    }
    for key in ("radius", "stiffness_ratio"):
        if getattr(pair, key) is not None:
            config[key] = repr(getattr(pair, key))
    if contact.substeps != SUBSTEPS:
        config["substeps"] = str(contact.substeps)
    return config


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

    def optional(key: str) -> float | None:
        return _float(key, config[key]) if key in config else None

    pair = ContactPair(
        _material("material1", config["material1"]),
        _material("material2", config["material2"]),
        _float("friction", config["friction"]),
        restitution=1.0 if "restitution" not in config else _float("restitution", config["restitution"]),
        radius=optional("radius"),
        law=law_of(config.get("law", "microslip")),
        stiffness_ratio=optional("stiffness_ratio"),
    )
    return Contact(
        (config["geom1"],), (config["geom2"],), pair,
        _count("substeps", config.get("substeps", str(SUBSTEPS)), LEAST_SUBSTEPS),
    )  # fmt: skip


def _material(key: str, text: str) -> Material:
    if text in MATERIALS:
        return MATERIALS[text]
    words = text.split()
    if len(words) != 2 or not all(NUMBER.fullmatch(word) for word in words):
        names = f"{', '.join(MATERIALS)}{checks.hint(text, MATERIALS)}"
        raise ValueError(f"{key} = {text!r}: must be 'E nu' in SI units or one of {names}")
    try:
        return Material(float(words[0]), float(words[1]))
    except ValueError as error:
        raise ValueError(f"{key} = {text!r}: {error}") from None


def _float(key: str, text: str) -> float:
    if not NUMBER.fullmatch(text.strip()):
        raise ValueError(f"{key} = {text!r}: must be a number")
    return float(text)


def _count(key: str, text: str, least: int) -> int:
    return checks.count(key, int(text) if text.strip().isdecimal() else text, least)
