"""What `load_model` is asked for: a list of contacts, or a table of materials, as geoms of a specification."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import combinations_with_replacement
from typing import Any

import mujoco

from contactlaw.material import Material, material_of
from contactlaw.mujoco_plugin import config
from contactlaw.mujoco_plugin.config import Contact
from contactlaw.mujoco_plugin.selection import Selector, geoms_of
from contactlaw.mujoco_plugin.whole import is_every, solid
from contactlaw.pair import ContactPair
from contactlaw.world.sets import groups

Which = Selector | Sequence[Selector]
Contacts = (
    Sequence[tuple[Which, Which, ContactPair] | tuple[Which, Which, ContactPair, Mapping[str, Any]]]
    | Mapping[str, Material | str]
)
Value = float | Callable[[Material, Material], float]


def chosen(
    spec: mujoco.MjSpec, contacts: Any, settings: Mapping[str, Any], friction: Value | None, restitution: Value
) -> list[Contact]:
    """All entries, those for every contact of a geom before those for two sets.

    Raises:
        ValueError: An entry is none, or means no geoms.
    """
    if isinstance(contacts, Mapping) and contacts:
        listed: list[Any] = list(_of_materials(spec, contacts, friction, restitution))
    elif isinstance(contacts, str | bytes) or not isinstance(contacts, Sequence) or not contacts:
        raise ValueError(
            f"contacts = {contacts!r}: must be a sequence of (geoms1, geoms2, pair), or a table of materials, not empty"
        )
    else:
        listed = list(contacts)
    found = [_entry(spec, number, entry, settings) for number, entry in enumerate(listed)]

    def stars(number: int) -> int:
        return 0 if isinstance(contacts, Mapping) else sum(is_every(what) for what in listed[number][:2])

    return sorted(found, key=lambda entry: stars(entry.number), reverse=True)


def skipped(spec: mujoco.MjSpec, skip: Any) -> list[Contact]:
    """What is to keep the engine's own contact: geoms, or pairs of choices of geoms."""
    if isinstance(skip, str) or not isinstance(skip, Sequence):
        raise ValueError(
            f"skip = {skip!r}: must be a sequence of choices of geoms, or of pairs (geoms1, geoms2) of them"
        )
    out = []
    for what in skip:
        ones, twos = what if isinstance(what, tuple) and len(what) == 2 else (what, "*")
        out.append(Contact(_geoms(spec, ones, "skip"), _geoms(spec, twos, "skip"), None))
    return out


def _geoms(spec: mujoco.MjSpec, what: Any, argument: str) -> list[Any]:
    return solid(spec) if is_every(what) else geoms_of(spec, what, argument=argument)


def _entry(spec: mujoco.MjSpec, number: int, entry: Any, settings: Mapping[str, Any]) -> Contact:
    some = list(entry) if isinstance(entry, Sequence) else []
    if (
        len(some) not in (3, 4)
        or not isinstance(some[2], ContactPair)
        or not isinstance(some[-1], ContactPair | Mapping)
    ):
        raise ValueError(
            f"contacts[{number}] = {entry!r}: must be (geoms1, geoms2, pair), pair a contactlaw.ContactPair, and "
            "maybe a dict of settings"
        )
    ones, twos = (_geoms(spec, entry[i], f"contacts[{number}], geoms{i + 1}") for i in range(2))
    own = {**settings, **(entry[3] if len(entry) == 4 else {})}
    unknown = set(own) - {"as_native", "others", "substeps", "rounding", "frictions", "overlaps"}
    if unknown:
        raise TypeError(f"contacts[{number}]: there is no setting {sorted(unknown)[0]!r}")
    own.setdefault("as_native", is_every(entry[0]) or is_every(entry[1]))
    try:
        return Contact(ones, twos, entry[2], number=number, **own)
    except ValueError as error:
        raise ValueError(f"contacts[{number}]: {error}") from None


def _of_materials(
    spec: mujoco.MjSpec, table: Mapping[Any, Any], friction: Value | None, restitution: Value
) -> Iterator[tuple[Any, ...]]:
    """Entries for geoms of each two materials."""
    owner: dict[Any, Material] = {}
    for what, material in table.items():
        own = material_of(f"contacts[{what!r}]", material)
        owner |= dict.fromkeys(_geoms(spec, what, f"contacts[{what!r}]"), own)
    alike = groups(owner, owner.__getitem__)
    room = config.FRICTIONS + len({(float(geom.friction[0]), geom.priority) for geom in owner})
    for one, two in combinations_with_replacement(alike, 2):
        mu = friction(one, two) if callable(friction) else friction or 0.0
        e = restitution(one, two) if callable(restitution) else restitution
        own = {"as_native": True, "frictions": room if friction is None else 0}
        yield alike[one], alike[two], ContactPair(one, two, mu, e), own
