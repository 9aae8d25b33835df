"""Configuration of a plugin instance: written by `add_contact` or by hand in XML, read back into a `Contact`."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from itertools import groupby
from typing import Any

from contactlaw import checks, losses
from contactlaw.material import Material, material_of
from contactlaw.pair import ContactPair
from contactlaw.world.building import CROWD_SUBSTEPS, LEAST_SUBSTEPS, SUBSTEPS

PLUGIN_NAME = "contactlaw.contact"
BLIND = "contactlaw.blind"
"""Name of the same plugin without the sensor capability. With it MuJoCo would evaluate sensors in every step, so models
without force or acceleration sensors are given this one.
"""

GEOMS = "geoms"  # in place of a friction coefficient
OVERLAPS = ("relax", "keep")


def instance_name(geoms1: Sequence[str], geoms2: Sequence[str]) -> str:
    """Return the name that `add_contact` gives to the plugin instance of these geoms."""
    sides = (own[0] if len(own) == 1 else f"{own[0]}..{own[-1]}({len(own)})" for own in (geoms1, geoms2))
    return ":".join(("contactlaw", *sides))


@dataclass(frozen=True)
class Contact:
    """The contact of two sets of geoms, each of the first with each of the second.

    Attributes as in `KEYS` and in `spec.add_contact`, and
        ones, twos: The geoms: of a specification, or, when read from a configuration, one text with their names.
        pair: A `ContactPair`; None: the engine keeps its own contact of these geoms.
        geom_friction: Whether the friction coefficient is that of the geoms, not of `pair`.
        as_native: Whether only those pairs are meant that the model tests natively ("*" in `load_model`).
        number: Index in the list given to `load_model`, for messages.
    """

    ones: Sequence[Any]
    twos: Sequence[Any]
    pair: Any
    substeps: int = SUBSTEPS
    crowd_substeps: int = CROWD_SUBSTEPS
    rounding: float | None = None
    geom_friction: bool = False
    overlaps: str = "relax"
    native: tuple[tuple[int, int], ...] = ()
    name: str = ""
    as_native: bool = False
    others: bool = True
    number: int = 0

    def __post_init__(self) -> None:
        """Raises ValueError where a setting is not allowed."""
        if self.pair is not None and not hasattr(self.pair.law, "name"):
            raise ValueError(f"pair: its law {self.pair.law!r} must have a name, by which the model can tell of it")
        least, choice = partial(checks.count, least=LEAST_SUBSTEPS), partial(checks.one_of, allowed=OVERLAPS)
        checks.set_fields(self, substeps=least, crowd_substeps=least, rounding=checks.positive, overlaps=choice)
        checks.set_fields(self, others=checks.truth, as_native=checks.truth)


def write(contact: Contact) -> dict[str, str]:
    """Return the configuration of an instance, from which `read` recovers this contact exactly."""
    pair = contact.pair
    runs = ((f"{bits[0]}/{bits[1]}", len(list(run))) for bits, run in groupby(contact.native))
    given: dict[str, str | float | None] = {
        "name": contact.name, "geom1": _joined(contact.ones), "geom2": _joined(contact.twos),
        "material1": f"{pair.a.youngs_modulus!r} {pair.a.poissons_ratio!r}",
        "material2": f"{pair.b.youngs_modulus!r} {pair.b.poissons_ratio!r}",
        "friction": GEOMS if contact.geom_friction else checks.text_of(pair.friction),
        "restitution": checks.text_of(pair.restitution), "radius": pair.radius, "law": checks.text_of(pair.law),
        "stiffness_ratio": pair.stiffness_ratio, "rolling_resistance": pair.rolling_resistance or None,
        "substeps": str(contact.substeps), "crowd_substeps": str(contact.crowd_substeps), "rounding": contact.rounding,
        "native": " ".join(f"{bits}x{count}" for bits, count in runs) or None, "overlaps": contact.overlaps,
    }  # fmt: skip
    return {key: one if isinstance(one, str) else repr(float(one)) for key, one in given.items() if one is not None}


def _joined(geoms: Sequence[Any]) -> str:
    return ("|" if any(" " in geom.name for geom in geoms) else " ").join(geom.name for geom in geoms)


def split(text: str) -> list[str]:
    """Return the names of geoms in a text of the configuration."""
    return text.split("|") if "|" in text else text.split()


def _text(key: str, text: str) -> str:
    return text


def _count(key: str, text: str) -> int | str:
    return int(text) if text.strip().isdecimal() else text


def _friction(key: str, text: str) -> Any:
    """Return the friction of a pair; None: that of the geoms, whatever number older versions wrote behind."""
    return None if text.split(" ")[0] == GEOMS else losses.read(key, text)


def _bits(key: str, text: str) -> tuple[tuple[int, int], ...]:
    runs = [re.fullmatch(r"(\d+)/(\d+)(?:x(\d+))?", run) for run in text.split()]
    if None in runs:
        raise ValueError(f"{key} = {text!r}: must be 'CONTYPE/CONAFFINITY' or 'CONTYPE/CONAFFINITYxCOUNT', or several")
    return tuple((int(run[1]), int(run[2])) for run in runs if run for _ in range(int(run[3] or 1)))


def _material(key: str, text: str) -> Material:
    words = text.split()
    if len(words) != 2 or not all(checks.NUMBER.fullmatch(word) for word in words):
        return material_of(key, text, "'E nu' in SI units")
    try:
        return Material(float(words[0]), float(words[1]))
    except ValueError as error:
        raise ValueError(f"{key} = {text!r}: {error}") from None


SIDES = {"geom1": _text, "geom2": _text}
REQUIRED = {"material1": _material, "material2": _material, "friction": _friction}
OF_PAIR = {"restitution": losses.read, "radius": checks.number_in, "law": _text, "stiffness_ratio": checks.number_in,
           "rolling_resistance": checks.number_in}  # fmt: skip
OF_CONTACT = {"substeps": _count, "crowd_substeps": _count, "rounding": checks.number_in, "native": _bits,
              "overlaps": _text, "name": _text}  # fmt: skip
KEYS: dict[str, Callable[[str, str], Any]] = SIDES | REQUIRED | OF_PAIR | OF_CONTACT
"""Configuration keys of the plugin; geom1, geom2, material1, material2 and friction are required.

geom1, geom2: name of a geom, or names separated by spaces, or by bars "|": each geom of geom1 may touch each of geom2.
native: contype and conaffinity of each geom before the law took over, geom1's first: "1/1", or runs "1/1x20 0/1x3"; if
given, the instance has only those pairs that the engine would have tested with these bits. material1, material2: a name
in `MATERIALS`, or "E nu" in SI units. friction, restitution: a number, or a function in `contactlaw.losses` with its
fields, such as "plastic yield_speed=0.1"; friction "geoms": the coefficients of the geoms, combined by the engine's
rule. law: as for `laws.law_of`, such as "microslip node_count=32". substeps, crowd_substeps, rounding, overlaps: as for
`add_contact`; the largest numbers of substeps in a model hold for all contacts. name: name of the instance. MuJoCo
prefixes and suffixes all names of a model that is attached to another; those of the geoms are found by comparing the
instance's name with this one.
"""


@lru_cache(maxsize=1024)  # called for each mjData; the pair warns of normal-tangential coupling only once
def read(items: tuple[tuple[str, str], ...]) -> Contact:
    """Return the contact that a configuration describes; a ValueError names the key that is missing or not allowed."""
    texts = {key: text for key, text in items if text}
    for key in SIDES | REQUIRED:
        if key not in texts:
            raise ValueError(f"{key}: missing in the configuration of {PLUGIN_NAME}")
    given = {key: KEYS[key](key, text) for key, text in texts.items()}
    of_pair, of_contact = ({key: given[key] for key in keys if key in given} for keys in (OF_PAIR, OF_CONTACT))
    one, two, friction = (given[key] for key in REQUIRED)
    pair = ContactPair(one, two, 0.0 if friction is None else friction, **of_pair)
    return Contact((given["geom1"],), (given["geom2"],), pair, geom_friction=friction is None, **of_contact)
