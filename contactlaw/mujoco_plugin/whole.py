"""What `load_model` is asked for, as geoms of a specification, and "*": every contact that a model makes by itself.

What the law cannot serve keeps the engine's own contact. Both are told apart by bits: a geom of which the law has all
contacts gets contype = conaffinity = 0, which also spares the engine's broad phase. Of the others those of one kind
(shape, bits, entries) get a bit of their own as contype, and as conaffinity those of the kinds that they go on
touching. Flexes are never served and get theirs in the same way. The engine's filter of parent and child and
`<exclude>` hold for both; pairs of `<contact>` that the law has get a margin so negative that the engine never makes
them. What the bits were stands in the plugin's configuration.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import combinations_with_replacement
from typing import Any

import mujoco

from contactlaw.material import Material, material_of
from contactlaw.mujoco_plugin import config
from contactlaw.mujoco_plugin.config import Contact
from contactlaw.mujoco_plugin.selection import geoms_of
from contactlaw.mujoco_plugin.shapes import native_margin, shape_of, touch, why_not_served
from contactlaw.mujoco_plugin.spec import Geoms, put
from contactlaw.pair import ContactPair, ContactWarning
from contactlaw.world.near.sets import groups

Contacts = (
    Sequence[tuple[Geoms, Geoms, ContactPair] | tuple[Geoms, Geoms, ContactPair, Mapping[str, Any]]]
    | Mapping[str, Material | str]
)
Value = float | Callable[[Material, Material], float]
EVERY = "*"
MOST_KINDS = 30
NAMED = 4  # kinds of contacts that a warning names
UNTOUCHED = 1 << 30  # a conaffinity that no contype has


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

    return sorted(found, key=lambda entry: sum(map(is_every, listed[entry.number][:2])), reverse=True)


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


def is_every(what: Any) -> bool:
    """Whether a choice of geoms is "*" alone."""
    return what == EVERY or (isinstance(what, list | tuple) and len(what) == 1 and what[0] == EVERY)


def solid(spec: mujoco.MjSpec) -> list[Any]:
    """The geoms of a model that touch something natively."""
    named = {name for pair in spec.pairs for name in (pair.geomname1, pair.geomname2)}
    return [geom for geom in spec.geoms if geom.contype or geom.conaffinity or (geom.name and geom.name in named)]


def put_natives(spec: mujoco.MjSpec, plain: mujoco.MjModel, entries: Sequence[Contact]) -> None:
    """Give the law what entries say; of two that fit a pair of geoms the later one has it. All geoms have names.

    plain: the model as it is, compiled.
    """
    geoms = list(dict.fromkeys(geom for entry in entries for geom in (*entry.ones, *entry.twos)))
    members = [(set(entry.ones), set(entry.twos)) for entry in entries]
    shapes = {geom: shape_of(geom) for geom in geoms}
    belongs = {geom: tuple((geom in ones, geom in twos) for ones, twos in members) for geom in geoms}
    before = {item: (item.contype, item.conaffinity) for item in (*solid(spec), *spec.flexes)}

    def kind_of(item: Any) -> Hashable:
        if item not in belongs:
            return before[item]
        shape = shapes[item]
        return before[item], shape.kind, belongs[item]

    def left(one: Any, two: Any) -> str | None:
        """Why the law does not have a pair; None: it has."""
        if one not in belongs or two not in belongs:
            return ""
        fits = [(a[0] and b[1]) or (b[0] and a[1]) for a, b in zip(belongs[one], belongs[two], strict=True)]
        entry = next((entry for entry, own in zip(entries[::-1], fits[::-1], strict=True) if own), None)
        if entry is None or entry.pair is None:
            return ""
        why = why_not_served(shapes[one], shapes[two])
        return why if entry.others else None

    kinds = groups(before, kind_of)
    kept: dict[Any, list[Any]] = {kind: [] for kind in kinds}
    said: dict[tuple[str, str], str] = {}
    for first, second in combinations_with_replacement(kinds, 2):
        one, two = kinds[first][0], kinds[second][-1]
        if not touch(before[one], before[two]):
            continue
        why = left(one, two)
        if why is not None:
            kept[first].append(second)
            kept[second].append(first)
        if why and _can_meet(plain, kinds[first], kinds[second]):
            types = sorted((shapes[one].type, shapes[two].type))
            said.setdefault((types[0], types[1]), f"{shapes[one].label} on {shapes[two].label}")
    served: set[Any] = set()
    for pair in spec.pairs:
        ends = [next((geom for geom in geoms if geom.name == name), None) for name in (pair.geomname1, pair.geomname2)]
        if None not in ends and left(*ends) is None:
            pair.margin, pair.gap = native_margin(*(shapes[geom] for geom in ends))
            served.update(ends)
    for kind, partners in kept.items():
        if len(set(partners)) < sum(touch(before[kinds[kind][0]], before[kinds[other][0]]) for other in kinds):
            served.update(kinds[kind])
    _write_bits(spec, kinds, kept)
    for entry in entries:
        ones, twos = ([geom for geom in own if geom in served] for own in (entry.ones, entry.twos))
        if entry.pair is not None and ones and twos and len({*ones, *twos}) > 1:
            native = tuple(before[geom] for geom in dict.fromkeys((*ones, *twos)))
            put(spec, replace(entry, ones=ones, twos=twos, native=native))
    if said:
        some = [*said.values()][:NAMED]
        more = f" and {len(said) - NAMED} more kinds" if len(said) > NAMED else ""
        warnings.warn(
            f"the law does not serve {', '.join(some)}{more}: such pairs keep the engine's own contact",
            ContactWarning,
            stacklevel=5,
        )


def _write_bits(spec: mujoco.MjSpec, kinds: dict[Any, list[Any]], kept: dict[Any, list[Any]]) -> None:
    """Let geoms of kinds go on touching those of the kinds that are kept for them, and nothing else."""
    rows = {kind: frozenset(partners) for kind, partners in kept.items()}
    own = {row: 1 << number for number, row in enumerate(dict.fromkeys(row for row in rows.values() if row))}
    if len(own) > MOST_KINDS:
        raise ValueError(f'"*": the engine\'s own contacts that stay are of {len(own)} kinds; at most {MOST_KINDS}')
    for kind, items in kinds.items():
        contype = own.get(rows[kind], 0)
        affinity = 0
        for partner in rows[kind]:
            affinity |= own[rows[partner]]
        for item in items:
            item.contype, item.conaffinity = contype, affinity
            if not contype and spec.compiler.discardvisual:
                item.conaffinity = UNTOUCHED


def _can_meet(model: mujoco.MjModel, ones: Sequence[Any], twos: Sequence[Any]) -> bool:
    """Whether any two of these geoms move against each other and are no neighbours in a chain."""
    weld, parent = model.body_weldid, model.body_parentid
    first, second = (dict.fromkeys(int(weld[model.geom_bodyid[geom.id]]) for geom in own) for own in (ones, twos))
    chained = {(body, int(weld[parent[body]])) for body in {*first, *second} if body and weld[parent[body]]}
    return any(a != b and (a, b) not in chained and (b, a) not in chained for a in first for b in second)
