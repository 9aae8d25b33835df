"""The list or table of contacts given to `load_model`, and "*": every contact that the model makes natively.

`parse_contacts` and `parse_skip` turn the user's entries into `config.Contact`. `replace_all` gives the law those
native contacts that entries with "*" or a table of materials mean; what the law cannot serve keeps the engine's own
contact. Both are separated by bits: a geom whose contacts are all the law's gets contype = conaffinity = 0, which also
spares the engine's broad phase. Among the others, geoms of one kind (shape, bits, entries) share a contype bit of their
own, and their conaffinity has the bits of the kinds that they go on touching. Flexes are never served and get bits in
the same way. The engine's parent-child filter and `<exclude>` hold for both. An explicit `<pair>` that the law takes
gets a margin so negative that the engine never makes the contact. The plugin's configuration keeps the original bits.
"""

import warnings
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import combinations_with_replacement
from typing import Any

import mujoco

from contactlaw.material import Material, material_of
from contactlaw.mujoco_plugin.config import Contact
from contactlaw.mujoco_plugin.selection import first_of, geoms_of
from contactlaw.mujoco_plugin.shapes import native_margin, shape_of, touch, why_not_served
from contactlaw.mujoco_plugin.spec import Geoms, add_instance
from contactlaw.pair import ContactPair, ContactWarning
from contactlaw.world.near.sets import groups

Contacts = (
    Sequence[tuple[Geoms, Geoms, ContactPair] | tuple[Geoms, Geoms, ContactPair, Mapping[str, Any]]]
    | Mapping[str, Material | str]
)
Value = float | Callable[[Material, Material], float]
EVERY = "*"
MAX_KINDS = 30  # bits of contype, which is a C int, without those of its sign and of `NO_CONTYPE`
NAMED = 4  # kinds of contacts that a warning names
NO_CONTYPE = 1 << 30  # bit of conaffinity that no contype has: it keeps a geom from counting as visual
TACTILE = getattr(mujoco.mjtSensor, "mjSENS_TACTILE", None)  # a sensor that is refused on a visual geom


def parse_contacts(
    spec: mujoco.MjSpec, contacts: Any, settings: Mapping[str, Any], friction: Value | None, restitution: Value
) -> list[Contact]:
    """Return all entries as contacts, sorted by the number of "*" in them, most first.

    Raises:
        ValueError: An entry has the wrong form, or means no geoms.
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


def parse_skip(spec: mujoco.MjSpec, skip: Any) -> list[Contact]:
    """Return the contacts that keep the engine's own response: geoms, or pairs of selections of geoms."""
    if isinstance(skip, str) or not isinstance(skip, Sequence):
        raise ValueError(
            f"skip = {skip!r}: must be a sequence, such as ['shin*', ('ball', 'floor')], of choices of geoms, or of "
            "pairs (geoms1, geoms2) of them"
        )
    out = []
    for what in skip:
        ones, twos = what if isinstance(what, tuple) and len(what) == 2 else (what, "*")
        out.append(Contact(_geoms(spec, ones, "skip"), _geoms(spec, twos, "skip"), None))
    return out


def _geoms(spec: mujoco.MjSpec, what: Any, argument: str) -> list[Any]:
    return colliding(spec) if is_every(what) else geoms_of(spec, what, argument=argument)


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
    unknown = set(own) - {"as_native", "others", "substeps", "crowd_substeps", "rounding", "geom_friction", "overlaps"}
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
    """Yield an entry (geoms, geoms, pair, settings) for each pair of materials in a table {geoms: material}."""
    owner: dict[Any, Material] = {}
    for what, material in table.items():
        own = material_of(f"contacts[{what!r}]", material)
        owner |= dict.fromkeys(_geoms(spec, what, f"contacts[{what!r}]"), own)
    alike = groups(owner, owner.__getitem__)
    for one, two in combinations_with_replacement(alike, 2):
        mu = friction(one, two) if callable(friction) else 0.0 if friction is None else friction
        e = restitution(one, two) if callable(restitution) else restitution
        own = {"as_native": True, "geom_friction": friction is None}
        yield alike[one], alike[two], ContactPair(one, two, mu, e), own


def is_every(what: Any) -> bool:
    """Return whether a selection of geoms is "*" alone."""
    if isinstance(what, list | tuple) and len(what) == 1:
        what = what[0]
    return isinstance(what, str) and what == EVERY


def colliding(spec: mujoco.MjSpec) -> list[Any]:
    """Return the geoms of a model that touch something natively."""
    named = {name for pair in spec.pairs for name in (pair.geomname1, pair.geomname2)}
    return [geom for geom in spec.geoms if geom.contype or geom.conaffinity or (geom.name and geom.name in named)]


def replace_all(spec: mujoco.MjSpec, plain: mujoco.MjModel, entries: Sequence[Contact]) -> None:
    """Give the law the native contacts that entries mean; of several that fit a pair of geoms, the last has it.

    All geoms of the entries must have names. plain: the model before any change, compiled.
    """
    geoms = list(dict.fromkeys(geom for entry in entries for geom in (*entry.ones, *entry.twos)))
    sides = [(set(entry.ones), set(entry.twos)) for entry in entries]
    shapes = {geom: shape_of(geom) for geom in geoms}
    belongs = {geom: tuple((geom in ones, geom in twos) for ones, twos in sides) for geom in geoms}
    before = {item: (item.contype, item.conaffinity) for item in (*colliding(spec), *spec.flexes)}

    def kind_of(item: Any) -> Hashable:
        return (before[item], shapes[item].type, belongs[item]) if item in belongs else before[item]

    def why_native(one: Any, two: Any) -> str | None:
        """Return why the engine keeps a pair, "" if no entry of the law fits; None if it does not keep it."""
        if one in belongs and two in belongs:
            for entry, a, b in zip(entries[::-1], belongs[one][::-1], belongs[two][::-1], strict=True):
                if (a[0] and b[1]) or (b[0] and a[1]):
                    why = why_not_served(shapes[one], shapes[two])
                    return "" if entry.pair is None else why if entry.others else None
        return ""

    kinds = groups(before, kind_of)
    kept: dict[Any, set[Any]] = {kind: set() for kind in kinds}
    served, unserved = set[Any](), dict[tuple[str, ...], str]()
    for first, second in combinations_with_replacement(kinds, 2):
        one, two = kinds[first][0], kinds[second][-1]
        if not touch(before[one], before[two]):
            continue
        why = why_native(one, two)
        if why is None:
            served.update(kinds[first], kinds[second])
            continue
        kept[first].add(second)
        kept[second].add(first)
        if why and _can_meet(plain, kinds[first], kinds[second]):
            types = tuple(sorted((shapes[one].type, shapes[two].type)))
            unserved.setdefault(types, f"{shapes[one].label} on {shapes[two].label}")
    named = {geom.name: geom for geom in geoms}
    for pair in spec.pairs:
        ends = [named.get(name) for name in (pair.geomname1, pair.geomname2)]
        if None not in ends and why_native(*ends) is None:
            pair.margin, pair.gap = native_margin(*(shapes[geom] for geom in ends))
            served.update(ends)
    _write_bits(spec, kinds, kept)
    for entry in entries:
        ones, twos = ([geom for geom in own if geom in served] for own in (entry.ones, entry.twos))
        if entry.pair is not None and ones and twos and len({*ones, *twos}) > 1:
            native = tuple(before[geom] for geom in dict.fromkeys((*ones, *twos)))
            add_instance(spec, replace(entry, ones=ones, twos=twos, native=native))
    if unserved:
        kinds_left = first_of([*unserved.values()], NAMED, "kinds")
        text = f"the law does not serve {kinds_left}: such pairs keep the engine's own contact"
        warnings.warn(text, ContactWarning, stacklevel=5)


def _write_bits(spec: mujoco.MjSpec, kinds: dict[Any, list[Any]], kept: dict[Any, set[Any]]) -> None:
    """Set contype and conaffinity so that each kind of geoms touches the kinds in kept[kind] and nothing else."""
    rows = {kind: frozenset(partners) for kind, partners in kept.items()}
    own = {row: 1 << number for number, row in enumerate(dict.fromkeys(row for row in rows.values() if row))}
    if len(own) > MAX_KINDS:
        raise ValueError(f'"*": the engine\'s own contacts that stay are of {len(own)} kinds; at most {MAX_KINDS}')
    not_visual = spec.compiler.discardvisual or any(sensor.type == TACTILE for sensor in spec.sensors)
    for kind, items in kinds.items():
        contype = own.get(rows[kind], 0)
        affinity = 0
        for partner in rows[kind]:
            affinity |= own[rows[partner]]
        for item in items:
            item.contype, item.conaffinity = contype, affinity
            if not contype and not_visual:
                item.conaffinity = NO_CONTYPE


def _can_meet(model: mujoco.MjModel, ones: Sequence[Any], twos: Sequence[Any]) -> bool:
    """Return whether any two of these geoms move relative to each other and are not parent and child."""
    weld, parent = model.body_weldid, model.body_parentid
    first, second = (dict.fromkeys(int(weld[model.geom_bodyid[geom.id]]) for geom in own) for own in (ones, twos))
    chained = {(body, int(weld[parent[body]])) for body in {*first, *second} if body and weld[parent[body]]}
    return any(a != b and (a, b) not in chained and (b, a) not in chained for a in first for b in second)
