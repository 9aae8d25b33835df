"""Put the law into a model that is still a specification."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import count
from typing import Any

import mujoco

from contactlaw.mujoco_plugin import config
from contactlaw.mujoco_plugin.native import silence
from contactlaw.mujoco_plugin.selection import Selector, geoms_of, give_names
from contactlaw.mujoco_plugin.shapes import check_served, shape_of
from contactlaw.pair import ContactPair
from contactlaw.world.sets import Sets

Geoms = Selector | Sequence[Selector]


def add_contact(
    spec: mujoco.MjSpec,
    geom1: Geoms,
    geom2: Geoms,
    pair: ContactPair,
    *,
    others: bool = True,
    substeps: int = config.SUBSTEPS,
    rounding: float | None = None,
    overlaps: str = "relax",
) -> str:
    """Let geoms touch by the law; then `spec.compile()` and plain `mj_step`, at any time step.

    The native contact of these pairs is turned off, that of each geom with every other one stays unless told otherwise.
    Balls, capsules, boxes, cylinders and planes may touch each other, see docs/shapes.md. With `pair.radius` a ball may
    touch any shape, and so may a capsule if neither has a free joint. Two others, a box on a mesh say, are refused:
    they touch in more than one point. Contacts that share bodies are integrated together, whichever call added them.

    What the plugin notices while a model runs (an overlap too deep, an edge) is said once for each `MjData` as a
    `ContactWarning`. A model that it cannot serve fails when its `MjData` is made, the reason on stderr.

    Args:
        spec: The model, before it is compiled.
        geom1, geom2: Names, patterns, bodies or geoms (one without a name is given one), see `geoms_of`, or sequences
            of them: then each of the first may touch each of the second, but none itself or one of its own body. A geom
            may be in both. Sets of more than 256 pairs are kept apart natively by their `contype` and `conaffinity`.
        pair: The contact; its radius, where None, is read from the geoms.
        others: Whether these geoms may touch any other natively. False takes them out of the engine's collision
            detection, which costs less than to detect a pair only to leave it out; such a geom may still be added to
            further contacts of the law. Not with a compiler that discards visual geoms: it would discard these.
        substeps: Least number of the law's own steps in a contact, however long the engine's: the error of an impact
            falls with its square.
        rounding: Radius of the edges of boxes and cylinders among the geoms [m], and so of their contacts with what is
            flat; None: a tenth of the smallest half length of each.
        overlaps: "relax": shapes that are found in each other by more than a tenth of R, where a model begins or
            somebody puts bodies, count as just touching as deep as they are, until they are less deep. "keep": they are
            pressed together, and what they store throws them apart.

    Returns:
        The name of the plugin instance, for `contacts_of` and `ledger_of`.

    Raises:
        ValueError: A value outside what is allowed; the message names it and the spec is unchanged.
    """
    if not isinstance(spec, mujoco.MjSpec):
        raise ValueError(f"spec = {spec!r}: must be a mujoco.MjSpec; contacts are added before the model is compiled")
    if not isinstance(pair, ContactPair):
        raise ValueError(f"pair = {pair!r}: must be a contactlaw.ContactPair")
    known = list(spec.geoms)  # which takes MuJoCo a time that grows with their square
    ones, twos = (geoms_of(spec, one, argument=name, known=known) for name, one in (("geom1", geom1), ("geom2", geom2)))
    return take(spec, known, config.Contact(ones, twos, pair, substeps, rounding, overlaps=overlaps, others=others))


def take(spec: mujoco.MjSpec, known: list[Any], contact: config.Contact) -> str:
    """Take the native contact of two sets of geoms, put that of the law in its place; known: all geoms there are."""
    parents = {geom: geom.parent for geom in known}
    sets = Sets(contact.ones, contact.twos, parents.__getitem__)
    _check(sets)
    taken = {plugin.name for plugin in spec.plugins}
    names = [tuple(geom.name for geom in geoms) for geoms in (contact.ones, contact.twos)]
    if taken & {config.instance_name(*names), config.instance_name(*names[::-1])}:
        raise ValueError(f"geom1 = {names[0]}, geom2 = {names[1]}: these have been added before")

    give_names(known, sets.geoms)
    if contact.others:
        silence(spec, known, sets)
    else:
        for geom in sets.geoms:
            geom.contype = geom.conaffinity = 0
    return put(spec, contact)


def put(spec: mujoco.MjSpec, contact: config.Contact) -> str:
    """Write the plugin instance of a contact of geoms that have names; returns its own."""
    names = ([geom.name for geom in geoms] for geoms in (contact.ones, contact.twos))
    name, taken = config.instance_name(*names), {plugin.name for plugin in spec.plugins}
    name = next(free for free in (f"{name}#{i}" if i else name for i in count()) if free not in taken)
    spec.activate_plugin(config.PLUGIN_NAME)
    instance = spec.add_plugin(name=name, plugin_name=config.PLUGIN_NAME, active=True)
    instance.config = config.write(replace(contact, name=name))
    for body in (geom.parent for geom in (*contact.ones, *contact.twos)):
        if body.id != spec.worldbody.id and not body.plugin.active:  # one must refer to it, or copies do not have it
            body.plugin.active, body.plugin.plugin_name, body.plugin.name = True, config.PLUGIN_NAME, name
            break
    return name


def _check(sets: Sets) -> None:
    """See that there are geoms that may touch, and that the law can serve them."""
    if len(sets.ones) == len(sets.twos) == 1 and (
        sets.ones == sets.twos or (sets.ones[0].name and sets.ones[0].name == sets.twos[0].name)
    ):
        raise ValueError(f"geom2 = {sets.twos[0].name!r}: must be another geom than geom1")
    if sets.example(sets.ones, sets.twos) is None:
        raise ValueError("geom1, geom2: hold no two geoms of different bodies")
    check_served(sets, {geom: shape_of(geom) for geom in sets.geoms})
