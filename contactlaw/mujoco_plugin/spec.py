"""Contacts in a model that is still a specification (`mujoco.MjSpec`): the law's are added, native ones turned off.

`add_contact`, and entries of `load_model` that name geoms: all pairs of two sets of geoms. Each of a few pairs gets an
explicit `<pair>` with a margin so negative that the engine never makes the contact; many are separated by bits.

`replace_all`, for entries with "*" or a table of materials: those pairs that the model makes natively; what the law
cannot serve keeps the engine's own contact. Both are separated by bits. The engine's parent-child filter and
`<exclude>` hold for both. The plugin's configuration keeps the original bits.

By bits: a geom whose contacts are all the law's gets none, which also spares the engine's broad phase. Among the
others, flexes included, geoms of one kind (shape, bits, entries) share a contype bit of their own, and conaffinity has
the bits of the kinds that they go on touching.
"""

import warnings
from collections import Counter
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from dataclasses import replace
from inspect import getfullargspec
from itertools import combinations_with_replacement, count
from typing import Any

import mujoco
import numpy as np

from contactlaw import checks
from contactlaw.losses import OverSpeed
from contactlaw.material import Material, material_of
from contactlaw.mujoco_plugin import config
from contactlaw.mujoco_plugin.config import Contact
from contactlaw.mujoco_plugin.geoms import (
    Bits,
    Selector,
    check_served,
    first_of,
    geoms_of,
    give_names,
    native_margin,
    shape_of,
    touch,
    why_not_served,
)
from contactlaw.mujoco_plugin.instances import may_meet
from contactlaw.mujoco_plugin.layout import view_of
from contactlaw.pair import ContactPair, ContactWarning
from contactlaw.world.near.sets import Sets, groups

Geoms = Selector | Sequence[Selector]
Contacts = (
    Sequence[tuple[Geoms, Geoms, ContactPair] | tuple[Geoms, Geoms, ContactPair, Mapping[str, Any]]]
    | Mapping[str, Material | str]
)
Value = float | OverSpeed | Callable[[Material, Material], float | OverSpeed]
EVERY = "*"
MAX_EXPLICIT_PAIRS = 256  # sets with more pairs are separated by contype and conaffinity first
MAX_KINDS = 30  # bits of contype, which is a C int, without those of its sign and of `NO_CONTYPE`
NAMED = 4  # kinds of contacts that a warning names
NO_CONTYPE = 1 << 30  # bit of conaffinity that no contype has: it keeps a geom from counting as visual
TACTILE = getattr(mujoco.mjtSensor, "mjSENS_TACTILE", None)  # a sensor that is refused on a visual geom


def add_contact(
    spec: mujoco.MjSpec, geom1: Geoms, geom2: Geoms, pair: ContactPair, *, others: bool = True,
    substeps: int = config.SUBSTEPS, crowd_substeps: int = config.CROWD_SUBSTEPS, rounding: float | None = None,
    overlaps: str = "relax",
) -> str:  # fmt: skip
    """Let geoms touch by the law; then call `spec.compile()` and plain `mj_step`, at any time step.

    All shapes may touch each other, see docs/shapes.md, except planes and height fields among themselves, and signed
    distance fields (sdf), which are refused. Contacts that share bodies are integrated together, whichever call added
    them. What the plugin notices while a model runs is reported as a `ContactWarning`, once for each compiled model. A
    model that it cannot serve fails when its `MjData` is made, with the reason on stderr.

    Args:
        spec: The model, before it is compiled.
        geom1, geom2: Names, patterns, bodies or geoms, see `geoms_of`, or sequences of them: each of the first may
            touch each of the second, but no geom itself or one of its own body. A geom may be in both. A geom without a
            name is given one.
        pair: The contact; its radius, where None, is that of the shapes.
        others: Whether these geoms may touch any other geom natively. False removes them from the engine's collision
            detection, which is cheaper than excluding pairs; they may still be added to further contacts of the law.
            Not with a compiler that discards visual geoms, as it would discard these.
        substeps: Least number of the law's substeps in an impact that slides; its error falls with their square. The
            largest number that any contact asks for holds for all. These settings in detail: docs/steps.md.
        crowd_substeps: The same for damped impacts where more than four contacts of an island are closed.
        rounding: Radius [m] of the edges of boxes and cylinders; None: a tenth of the smallest half length of each.
        overlaps: "relax": shapes found deep in each other count as just touching until they overlap less. "keep": they
            are pressed together, and the stored elastic energy pushes them apart. How deep: docs/models.md.

    Returns:
        The name of the plugin instance, for `contacts_of` and `ledger_of`.

    Raises:
        ValueError: An argument outside what is allowed; the message names it, and the spec is unchanged.
    """
    if not isinstance(spec, mujoco.MjSpec):
        raise ValueError(f"spec = {spec!r}: must be a mujoco.MjSpec; contacts are added before the model is compiled")
    checks.instance("pair", pair, ContactPair)
    ones, twos = (geoms_of(spec, one, argument=name) for name, one in (("geom1", geom1), ("geom2", geom2)))
    contact = Contact(ones, twos, pair, substeps, crowd_substeps, rounding, overlaps=overlaps, others=others)
    return replace_native_contacts(spec, contact)


SETTINGS = (*getfullargspec(add_contact).kwonlyargs, "as_native")


def replace_native_contacts(spec: mujoco.MjSpec, contact: Contact) -> str:
    """Disable the native contacts of two sets of geoms and add the law's; return the name of the plugin instance."""
    parents = {geom: geom.parent for geom in (*contact.ones, *contact.twos)}
    sets = Sets(contact.ones, contact.twos, parents.__getitem__)
    ones, twos = sets.ones, sets.twos
    if len(ones) == len(twos) == 1 and ones == twos:
        raise ValueError(f"geom2 = {twos[0].name!r}: must be another geom than geom1")
    if sets.example(ones, twos) is None:
        raise ValueError("geom1, geom2: hold no two geoms of different bodies")
    check_served(sets, {geom: shape_of(geom) for geom in sets.geoms})
    taken = {plugin.name for plugin in spec.plugins}
    names = [tuple(geom.name for geom in geoms) for geoms in (contact.ones, contact.twos)]
    if taken & {config.instance_name(*names), config.instance_name(*names[::-1])}:
        raise ValueError(f"geom1 = {names[0]}, geom2 = {names[1]}: these have been added before")

    give_names(spec, sets.geoms)
    if contact.others:
        disable_native(spec, sets)
    else:
        for geom in sets.geoms:
            geom.contype = geom.conaffinity = 0
    return add_instance(spec, contact)


def add_instance(spec: mujoco.MjSpec, contact: Contact) -> str:
    """Add the plugin instance of a contact between geoms that all have names; return the name of the instance."""
    names = ([geom.name for geom in geoms] for geoms in (contact.ones, contact.twos))
    name, taken = config.instance_name(*names), {plugin.name for plugin in spec.plugins}
    name = next(free for free in (f"{name}#{i}" if i else name for i in count()) if free not in taken)
    spec.activate_plugin(config.PLUGIN_NAME)
    instance = spec.add_plugin(name=name, plugin_name=config.PLUGIN_NAME, active=True)
    instance.config = config.write(replace(contact, name=name))
    for body in _bearers(spec, contact):
        body.plugin.active, body.plugin.plugin_name, body.plugin.name = True, config.PLUGIN_NAME, name
    return name


def _bearers(spec: mujoco.MjSpec, contact: Contact) -> list[Any]:
    """Return bodies that are to refer to a new instance, each to one: two of its own, of which one may be deleted, or
    others, or one that another instance can spare. MuJoCo drops an instance to which none refers in copies of a spec.
    """
    own = dict.fromkeys(geom.parent for geom in (*contact.ones, *contact.twos))
    free = [body for body in own if body != spec.worldbody and not body.plugin.active]
    # all bodies only if needed: the time to list them grows as the square
    if free := free or [body for body in spec.bodies if not body.plugin.active]:
        return free[:2]
    ours = [body for body in spec.bodies if body.plugin.plugin_name == config.PLUGIN_NAME]
    number = Counter(body.plugin.name for body in ours)
    return [body for body in ours if number[body.plugin.name] > 1][:1]


def disable_native(spec: mujoco.MjSpec, sets: Sets) -> None:
    """Disable the native contacts between two sets of geoms, which have names."""
    known = {geom.name: geom for geom in sets.geoms}
    for native in list(spec.pairs):
        ends = known.get(native.geomname1), known.get(native.geomname2)
        if None not in ends and sets.hold(*ends):
            spec.delete(native)
    ones, twos = set(sets.ones), set(sets.twos)

    def stay(one: Any, two: Any) -> bool:
        return touch(_bits(one), _bits(two)) and not ((one in ones and two in twos) or (two in ones and one in twos))

    def kind_of(item: Any) -> Hashable:
        return _bits(item), item in ones, item in twos

    few = len(ones) * len(twos) <= MAX_EXPLICIT_PAIRS
    if few or not _separate(spec, groups((*colliding(spec), *spec.flexes), kind_of), stay):
        for one, two in sets.every():
            margin, gap = native_margin(shape_of(one), shape_of(two))
            spec.add_pair(geomname1=one.name, geomname2=two.name, margin=margin, gap=gap)


def _bits(geom: Any) -> Bits:
    return geom.contype, geom.conaffinity


def parse_contacts(
    spec: mujoco.MjSpec, contacts: Any, settings: Mapping[str, Any], friction: Value | None, restitution: Value | None
) -> list[Contact]:
    """Return all entries as contacts, sorted by the number of "*" in them, most first."""
    if isinstance(contacts, str | bytes) or not isinstance(contacts, Sequence | Mapping) or not contacts:
        raise ValueError(
            f"contacts = {contacts!r}: must be a sequence of (geoms1, geoms2, pair), or a table of materials, not empty"
        )
    for name in settings:
        checks.one_of("setting", name, SETTINGS)
    if isinstance(contacts, Mapping):
        own = {**settings, "as_native": True, "geom_friction": friction is None}
        given = (0.0 if friction is None else friction, 1.0 if restitution is None else restitution)
        return [Contact(*entry, **own) for entry in _of_materials(spec, contacts, given)]
    for name, value in (("friction", friction), ("restitution", restitution)):
        if value is not None:
            raise ValueError(f"{name} = {value!r}: is of a table of materials; contacts of a list have their pair's")
    found = [_entry(spec, number, entry, settings) for number, entry in enumerate(contacts)]
    return sorted(found, key=lambda entry: sum(map(is_every, contacts[entry.number][:2])), reverse=True)


def parse_skip(spec: mujoco.MjSpec, skip: Any) -> list[Contact]:
    """Return the contacts that keep the engine's own response: geoms, or pairs of selections of geoms."""
    if isinstance(skip, str) or not isinstance(skip, Sequence):
        raise ValueError(
            f"skip = {skip!r}: must be a sequence, such as ['shin*', ('ball', 'floor')], of choices of geoms, or of "
            "pairs (geoms1, geoms2) of them"
        )
    both = (what if isinstance(what, tuple) and len(what) == 2 else (what, EVERY) for what in skip)
    return [Contact(_geoms(spec, ones, "skip"), _geoms(spec, twos, "skip"), None) for ones, twos in both]


def _geoms(spec: mujoco.MjSpec, what: Any, argument: str) -> list[Any]:
    return colliding(spec) if is_every(what) else geoms_of(spec, what, argument=argument)


def _entry(spec: mujoco.MjSpec, number: int, entry: Any, settings: Mapping[str, Any]) -> Contact:
    some = list(entry) if isinstance(entry, Sequence) else []
    if len(some) not in (3, 4) or not (
        isinstance(some[2], ContactPair) and isinstance(some[-1], ContactPair | Mapping)
    ):
        raise ValueError(
            f"contacts[{number}] = {entry!r}: must be (geoms1, geoms2, pair), pair a contactlaw.ContactPair, and "
            "maybe a dict of settings"
        )
    ones, twos = (_geoms(spec, entry[i], f"contacts[{number}], geoms{i + 1}") for i in range(2))
    own = entry[3] if len(entry) == 4 else {}
    for name in own:
        checks.one_of(f"contacts[{number}], setting", name, SETTINGS)
    native: dict[str, Any] = {"as_native": is_every(entry[0]) or is_every(entry[1])}
    try:
        return Contact(ones, twos, entry[2], number=number, **native | {**settings, **own})
    except ValueError as error:
        raise ValueError(f"contacts[{number}]: {error}") from None


def _of_materials(
    spec: mujoco.MjSpec, table: Mapping[Any, Any], given: tuple[Value, Value]
) -> Iterator[tuple[list[Any], list[Any], ContactPair]]:
    """Yield geoms, others and their pair for each two materials in a table {geoms: material}.

    given: friction and restitution, which may be functions of the materials.
    """
    owner: dict[Any, Material] = {}
    for what, material in table.items():
        own = material_of(f"contacts[{what!r}]", material)
        owner |= dict.fromkeys(_geoms(spec, what, f"contacts[{what!r}]"), own)
    alike = groups(owner, owner.__getitem__)
    for one, two in combinations_with_replacement(alike, 2):
        mu, e = (x(one, two) if callable(x) and not isinstance(x, OverSpeed) else x for x in given)
        yield alike[one], alike[two], ContactPair(one, two, mu, e)


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
    before = {item: _bits(item) for item in (*colliding(spec), *spec.flexes)}

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

    kinds, served, unserved = groups(before, kind_of), set[Any](), dict[tuple[str, ...], str]()
    for first, second in combinations_with_replacement(kinds.values(), 2):
        one, two = first[0], second[-1]
        why = why_native(one, two) if touch(before[one], before[two]) else ""
        if why != "" and _can_meet(plain, first, second):
            if why is None:
                served.update(first, second)
            else:
                types = tuple(sorted((shapes[one].type, shapes[two].type)))
                unserved.setdefault(types, f"{shapes[one].label} on {shapes[two].label}")
    named = {geom.name: geom for geom in geoms}
    for pair in spec.pairs:
        ends = [named.get(name) for name in (pair.geomname1, pair.geomname2)]
        if None not in ends and why_native(*ends) is None:
            pair.margin, pair.gap = native_margin(*(shapes[geom] for geom in ends))
            served.update(ends)
    if not _separate(spec, kinds, lambda *both: touch(*map(before.get, both)) and why_native(*both) is not None):
        raise ValueError(f'"*": the engine\'s own contacts that stay are of more than {MAX_KINDS} kinds')
    for entry in entries:
        ones, twos = ([geom for geom in own if geom in served] for own in (entry.ones, entry.twos))
        if entry.pair is not None and ones and twos and len({*ones, *twos}) > 1:
            native = tuple(before[geom] for geom in dict.fromkeys((*ones, *twos)))
            add_instance(spec, replace(entry, ones=ones, twos=twos, native=native))
    if unserved:
        text = f"the law does not serve {first_of([*unserved.values()], NAMED, 'kinds')}: such pairs keep"
        warnings.warn(f"{text} the engine's own contact", ContactWarning, stacklevel=5)


def _separate(spec: mujoco.MjSpec, kinds: dict[Any, list[Any]], stay: Callable[[Any, Any], bool]) -> bool:
    """Let geoms touch natively where `stay` tells so of two of their kinds; return False if bits do not suffice."""
    rows = {kind: frozenset(two for two in kinds if stay(kinds[kind][0], kinds[two][-1])) for kind in kinds}
    own = {row: 1 << number for number, row in enumerate(dict.fromkeys(row for row in rows.values() if row))}
    if len(own) > MAX_KINDS:
        return False
    not_visual = spec.compiler.discardvisual or any(sensor.type == TACTILE for sensor in spec.sensors)
    for kind, items in kinds.items():
        contype, affinity = own.get(rows[kind], 0), sum({own[rows[partner]] for partner in rows[kind]})
        for item in items:
            item.contype, item.conaffinity = contype, affinity if contype or not not_visual else NO_CONTYPE
    return True


def _can_meet(model: mujoco.MjModel, ones: Sequence[Any], twos: Sequence[Any]) -> bool:
    """Return whether the engine tests any two of these geoms."""
    first, second = (np.unique(model.geom_bodyid[[geom.id for geom in own]]) for own in (ones, twos))
    apart = model.body_weldid[first][:, None] != model.body_weldid[second]
    return bool((apart & may_meet(view_of(model), first[:, None], second)).any())
