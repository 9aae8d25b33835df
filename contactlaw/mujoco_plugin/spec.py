"""Add a contact to a model that is still a specification (`mujoco.MjSpec`).

The native contacts between the two sets of geoms are disabled, all other native contacts stay. For a few pairs, each
gets an explicit `<pair>` with a margin so negative that the engine never makes the contact. For many pairs, contype or
conaffinity of the geoms is cleared where this disables nothing else: a geom without contype is still tested against
every geom with one, and a geom without conaffinity against every geom with one, but two of the same sort are not.
Pairs that remain native get an explicit `<pair>`.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations_with_replacement, count
from typing import Any

import mujoco

from contactlaw import checks
from contactlaw.mujoco_plugin import config
from contactlaw.mujoco_plugin.selection import Selector, geoms_of, give_names
from contactlaw.mujoco_plugin.shapes import Bits, check_served, native_margin, shape_of, touch
from contactlaw.pair import ContactPair
from contactlaw.world.near.sets import Sets, groups

Geoms = Selector | Sequence[Selector]
MAX_EXPLICIT_PAIRS = 256  # sets with more pairs are separated by contype and conaffinity first


def add_contact(
    spec: mujoco.MjSpec, geom1: Geoms, geom2: Geoms, pair: ContactPair, *, others: bool = True,
    substeps: int = config.SUBSTEPS, crowd_substeps: int = config.CROWD_SUBSTEPS, rounding: float | None = None,
    overlaps: str = "relax",
) -> str:  # fmt: skip
    """Let geoms touch by the law; then call `spec.compile()` and plain `mj_step`, at any time step.

    The native contact of these pairs is disabled; that of each geom with all others stays unless `others` is False.
    All shapes may touch each other, see docs/shapes.md (a mesh is its convex hull), except planes and height fields
    among themselves, and signed distance fields (sdf), which are refused. Contacts that share bodies are integrated
    together, whichever call added them.

    What the plugin notices while a model runs (too deep an overlap, an edge) is reported once for each `MjData` as a
    `ContactWarning`. A model that it cannot serve fails when its `MjData` is made, with the reason on stderr.

    Args:
        spec: The model, before it is compiled.
        geom1, geom2: Names, patterns, bodies or geoms, see `geoms_of`, or sequences of them: each of the first may
            touch each of the second, but no geom itself or one of its own body. A geom may be in both. A geom without a
            name is given one.
        pair: The contact; its radius, where None, is that of the shapes.
        others: Whether these geoms may touch any other geom natively. False removes them from the engine's collision
            detection, which is cheaper than excluding pairs; such a geom may still be added to further contacts of the
            law. Not with a compiler that discards visual geoms, as it would discard these.
        substeps: Least number of the law's substeps in an impact that slides, however long the engine's step; its error
            falls with their square. A damped one of two bodies alone that slides slower than mu V has fewer, for the
            same error. The largest number that any contact asks for holds for all.
        crowd_substeps: The same for damped impacts where more than four contacts of an island are closed.
        rounding: Radius [m] of the edges of boxes and cylinders among the geoms, and so of their contacts with flat
            shapes; None: a tenth of the smallest half length of each.
        overlaps: "relax": shapes found overlapping by more than a tenth of R, where a model begins or where the user
            puts bodies, count as just touching until they overlap less. "keep": they are pressed together, and the
            stored elastic energy pushes them apart.

    Returns:
        The name of the plugin instance, for `contacts_of` and `ledger_of`.

    Raises:
        ValueError: An argument outside what is allowed; the message names it, and the spec is unchanged.
    """
    if not isinstance(spec, mujoco.MjSpec):
        raise ValueError(f"spec = {spec!r}: must be a mujoco.MjSpec; contacts are added before the model is compiled")
    checks.instance("pair", pair, ContactPair)
    ones, twos = (geoms_of(spec, one, argument=name) for name, one in (("geom1", geom1), ("geom2", geom2)))
    contact = config.Contact(ones, twos, pair, substeps, crowd_substeps, rounding, overlaps=overlaps, others=others)
    return replace_native_contacts(spec, contact)


def replace_native_contacts(spec: mujoco.MjSpec, contact: config.Contact) -> str:
    """Disable the native contacts of two sets of geoms and add the law's; return the name of the plugin instance."""
    parents = {geom: geom.parent for geom in (*contact.ones, *contact.twos)}
    sets = Sets(contact.ones, contact.twos, parents.__getitem__)
    ones, twos = sets.ones, sets.twos
    if len(ones) == len(twos) == 1 and (ones == twos or (ones[0].name and ones[0].name == twos[0].name)):
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


def add_instance(spec: mujoco.MjSpec, contact: config.Contact) -> str:
    """Add the plugin instance of a contact between geoms that all have names; return the name of the instance."""
    names = ([geom.name for geom in geoms] for geoms in (contact.ones, contact.twos))
    name, taken = config.instance_name(*names), {plugin.name for plugin in spec.plugins}
    name = next(free for free in (f"{name}#{i}" if i else name for i in count()) if free not in taken)
    spec.activate_plugin(config.PLUGIN_NAME)
    instance = spec.add_plugin(name=name, plugin_name=config.PLUGIN_NAME, active=True)
    instance.config = config.write(replace(contact, name=name))
    for body in (geom.parent for geom in (*contact.ones, *contact.twos)):
        if body.id != spec.worldbody.id and not body.plugin.active:  # copies of a spec keep only referenced instances
            body.plugin.active, body.plugin.plugin_name, body.plugin.name = True, config.PLUGIN_NAME, name
            break
    return name


def disable_native(spec: mujoco.MjSpec, sets: Sets) -> None:
    """Disable the native contacts between two sets of geoms, which have names."""
    known = {geom.name: geom for geom in sets.geoms}
    for native in list(spec.pairs):
        ends = known.get(native.geomname1), known.get(native.geomname2)
        if None not in ends and sets.hold(*ends):
            spec.delete(native)
    if len(sets.ones) * len(sets.twos) > MAX_EXPLICIT_PAIRS:
        _clear_bits(spec, sets)
        if not any(touch(_bits(one), _bits(two)) for one, two in sets.by_kinds(_bits)):
            return
    for one, two in sets.every():
        margin, gap = native_margin(shape_of(one), shape_of(two))
        spec.add_pair(geomname1=one.name, geomname2=two.name, margin=margin, gap=gap)


def _bits(geom: Any) -> Bits:
    return geom.contype, geom.conaffinity


def _clear_bits(spec: mujoco.MjSpec, sets: Sets) -> None:
    """Clear contype or conaffinity of geoms of the sets where this disables no other native contact."""
    ones, twos, world = set(sets.ones), set(sets.twos), spec.worldbody
    alike = groups(spec.geoms, lambda geom: (_bits(geom), geom in ones, geom in twos, geom.parent == world))
    bits = {kind: kind[0] for kind in alike}

    def wanted(one: Any, two: Any) -> bool:
        """Return whether geoms of two kinds touch natively and must go on doing so."""
        ours = (one[1] and two[2]) or (two[1] and one[2])
        alone = one == two and len(alike[one]) == 1
        return not ours and not alone and not (one[3] and two[3]) and touch(one[0], two[0])

    kept = [pair for pair in combinations_with_replacement(alike, 2) if wanted(*pair)]
    for kind, geoms in alike.items():
        (contype, conaffinity), first, second, _ = kind
        for taken in ((0, conaffinity), (contype, 0)):
            tried = bits | {kind: taken}
            if (first or second) and any(taken) and all(touch(tried[one], tried[two]) for one, two in kept):
                bits = tried
                for geom in geoms:
                    geom.contype, geom.conaffinity = taken
                break
