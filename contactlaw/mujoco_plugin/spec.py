"""Put the law into a model that is still a specification."""

# The wheel describes little of what it exports.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np

from contactlaw import checks
from contactlaw.mujoco_plugin import config
from contactlaw.mujoco_plugin.shapes import Shape, check_measurable, check_served, effective_radius, native_margin
from contactlaw.pair import ContactPair

Geoms = str | mujoco.MjsGeom | Sequence[str | mujoco.MjsGeom]


def add_contact(
    spec: mujoco.MjSpec,
    geom1: Geoms,
    geom2: Geoms,
    pair: ContactPair,
    *,
    others: bool = True,
    substeps: int = config.SUBSTEPS,
) -> str:
    """Let geoms touch by the law; then `spec.compile()` and plain `mj_step`, at any time step.

    The native contact of these pairs is turned off, that of each geom with every other one stays unless told otherwise.
    Balls and the ends of capsules may touch planes, the faces of boxes and each other. With `pair.radius` a ball may
    touch any shape, and so may a capsule if neither has a free joint. Two others, a box on a plane say, are refused:
    they touch in more than one point. Contacts that share bodies are integrated together, whichever call added them.

    What the plugin notices while a model runs (an overlap too deep, an edge) is said once for each `MjData` as a
    `ContactWarning`. A model that it cannot serve fails when its `MjData` is made, the reason on stderr.

    Args:
        spec: The model, before it is compiled.
        geom1, geom2: Names, or geoms of the spec (one without a name is given one), or sequences of them: then each of
            the first may touch each of the second, but none itself or one of its own body. A geom may be in both.
        pair: The contact; its radius, where None, is read from the geoms.
        others: Whether these geoms may touch any other natively. False takes them out of the engine's collision
            detection, which costs less than to detect a pair only to leave it out; such a geom may still be added to
            further contacts of the law. Not with a compiler that discards visual geoms: it would discard these.
        substeps: Least number of the law's own steps in a contact, however long the engine's: the error of an impact
            falls with its square.

    Returns:
        The name of the plugin instance, for `contacts_of` and `ledger_of`.

    Raises:
        ValueError: A value outside what is allowed; the message names it and the spec is unchanged.
    """
    if not isinstance(spec, mujoco.MjSpec):
        raise ValueError(f"spec = {spec!r}: must be a mujoco.MjSpec; contacts are added before the model is compiled")
    if not isinstance(pair, ContactPair):
        raise ValueError(f"pair = {pair!r}: must be a contactlaw.ContactPair")
    substeps = checks.count("substeps", substeps, config.LEAST_SUBSTEPS)
    ones, twos = _geoms(spec, "geom1", geom1), _geoms(spec, "geom2", geom2)
    meetings = _meetings(ones, twos)
    shapes = {id(geom): Shape(geom.name, int(geom.type), np.array(geom.size)) for geom in ones + twos}
    for shape in shapes.values():
        check_measurable(shape)
    for one, two in meetings:
        check_served(shapes[id(one)], shapes[id(two)])
        if shapes[id(one)].size.any() and shapes[id(two)].size.any():  # a mesh has its sizes once compiled
            effective_radius(shapes[id(one)], shapes[id(two)], pair.radius)
    taken = {plugin.name for plugin in spec.plugins}
    names = [tuple(geom.name for geom in geoms) for geoms in (ones, twos)]
    if taken & {config.instance_name(*names), config.instance_name(*names[::-1])}:
        raise ValueError(f"geom1 = {names[0]}, geom2 = {names[1]}: these have been added before")

    for geom in (*ones, *twos):
        geom.name = geom.name or _free_name(spec)
    ids = [tuple(geom.name for geom in geoms) for geoms in (ones, twos)]
    name = config.instance_name(*ids)
    _silence(spec, meetings, shapes, others)
    contact = config.Contact(ids[0], ids[1], pair, substeps)
    spec.activate_plugin(config.PLUGIN_NAME)
    instance = spec.add_plugin(name=name, plugin_name=config.PLUGIN_NAME, active=True)
    instance.config = config.write(contact)
    _hold(spec, name, (*ones, *twos))
    return name


def _meetings(ones: list[Any], twos: list[Any]) -> list[tuple[Any, Any]]:
    """Each geom of the first with each of the second, once, but not with itself or one of its own body."""
    if len(ones) == len(twos) == 1:
        if ones[0] is twos[0] or (ones[0].name and ones[0].name == twos[0].name):
            raise ValueError(f"geom2 = {twos[0].name!r}: must be another geom than geom1")
        return [(ones[0], twos[0])]
    out: dict[frozenset[int], tuple[Any, Any]] = {}
    for one in ones:
        for two in twos:
            if one is not two and one.parent != two.parent:
                out.setdefault(frozenset((id(one), id(two))), (one, two))
    if not out:
        raise ValueError("geom1, geom2: hold no two geoms of different bodies")
    return list(out.values())


def _silence(spec: mujoco.MjSpec, meetings: list[tuple[Any, Any]], shapes: dict[int, Shape], others: bool) -> None:
    """Turn the native contact of these pairs off."""
    ours = {frozenset((one.name, two.name)) for one, two in meetings}
    for native in list(spec.pairs):
        if frozenset((native.geomname1, native.geomname2)) in ours:
            spec.delete(native)
    for one, two in meetings:
        if others:
            margin = native_margin(shapes[id(one)], shapes[id(two)])
            spec.add_pair(geomname1=one.name, geomname2=two.name, margin=-margin, gap=0.0)
        else:
            for geom in (one, two):
                geom.contype = geom.conaffinity = 0


def _geoms(spec: mujoco.MjSpec, argument: str, value: Any) -> list[Any]:
    if isinstance(value, str | mujoco.MjsGeom):
        return [_geom(spec, argument, value)]
    if not isinstance(value, Sequence) or not value:
        raise ValueError(f"{argument} = {value!r}: must be a geom, the name of one, or a sequence of them, not empty")
    geoms: list[Any] = []
    for item in value:
        geom = _geom(spec, argument, item)
        known = next((other for other in geoms if other is geom or (geom.name and other.name == geom.name)), None)
        if known is None:
            geoms.append(geom)
    return geoms


def _geom(spec: mujoco.MjSpec, argument: str, value: Any) -> mujoco.MjsGeom:
    if isinstance(value, mujoco.MjsGeom):
        if not any(value is geom or value == geom for geom in spec.geoms):
            raise ValueError(f"{argument} = geom {value.name!r}: must be a geom of the spec")
        return value
    if isinstance(value, str):
        geom = spec.geom(value)
        if geom is not None:
            return geom
        checks.one_of(argument, value, [geom.name for geom in spec.geoms if geom.name])
    raise ValueError(f"{argument} = {value!r}: must be the name of a geom, or a geom, of the spec")


def _hold(spec: mujoco.MjSpec, name: str, geoms: Sequence[mujoco.MjsGeom]) -> None:
    """Let a body of the pair refer to the instance, or MuJoCo drops it when the spec is copied or attached."""
    for geom in geoms:
        body = geom.parent
        if body.id != spec.worldbody.id and not body.plugin.active:
            body.plugin.active, body.plugin.plugin_name, body.plugin.name = True, config.PLUGIN_NAME, name
            return


def _free_name(spec: mujoco.MjSpec) -> str:
    taken = {geom.name for geom in spec.geoms}
    return next(name for name in (f"contactlaw_geom{i}" for i in range(len(taken) + 1)) if name not in taken)
