"""Put the law into a model that is still a specification."""

# The wheel describes little of what it exports.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from contactlaw import checks
from contactlaw.mujoco_plugin import config
from contactlaw.mujoco_plugin.instance import contact_of, native_margin
from contactlaw.mujoco_plugin.shapes import Shape, meeting
from contactlaw.pair import ContactPair


def add_contact(
    spec: mujoco.MjSpec,
    geom1: str | mujoco.MjsGeom,
    geom2: str | mujoco.MjsGeom,
    pair: ContactPair,
    *,
    plane: ArrayLike | None = None,
    others: bool = True,
) -> str:
    """Let two geoms touch by the law; then `spec.compile()` and plain `mj_step`.

    Their native contact is turned off, that of each with every other geom stays unless told otherwise. Balls and the
    ends of capsules may touch planes, the faces of boxes and each other; any other shapes need `pair.radius`.

    What the plugin notices while a model runs (a step too long, an overlap too deep, an edge) is said once for each
    `MjData` as a `ContactWarning`. A model that it cannot serve fails when its `MjData` is made, the reason on stderr.

    Args:
        spec: The model, before it is compiled.
        geom1, geom2: Names, or geoms of the spec (one without a name is given one).
        pair: The contact; its radius, where None, is read from the geoms.
        plane: Normal of the plane of all motion, a unit vector, where the scene is planar: the traction then has one
            component instead of two.
        others: Whether these geoms may touch any other natively. False takes both out of the engine's collision
            detection, which costs less than to detect a pair only to leave it out; such a geom may still be added to
            further contacts of the law. Not with a compiler that discards visual geoms: it would discard these.

    Returns:
        The name of the plugin instance, for `contact_history`.

    Raises:
        ValueError: A value outside what is allowed; the message names it and the spec is unchanged.
    """
    if not isinstance(spec, mujoco.MjSpec):
        raise ValueError(f"spec = {spec!r}: must be a mujoco.MjSpec; contacts are added before the model is compiled")
    if not isinstance(pair, ContactPair):
        raise ValueError(f"pair = {pair!r}: must be a contactlaw.ContactPair")
    one, two = _geom(spec, "geom1", geom1), _geom(spec, "geom2", geom2)
    if one is two or (one.name and one.name == two.name):
        raise ValueError(f"geom2 = {two.name!r}: must be another geom than geom1")
    normal = None if plane is None else checks.unit_vector("plane", plane)
    shapes = [Shape(geom.name, int(geom.type), np.array(geom.size)) for geom in (one, two)]
    if all(shape.size.any() for shape in shapes):  # sizes fitted to a mesh are not known before the model is compiled
        meeting(shapes[0], shapes[1], pair.radius)
    taken = {plugin.name for plugin in spec.plugins}
    orders = {config.instance_name(one.name, two.name), config.instance_name(two.name, one.name)}
    if one.name and two.name and taken & orders:
        raise ValueError(f"geom1 = {one.name!r}, geom2 = {two.name!r}: this pair has been added before")

    for geom in (one, two):
        geom.name = geom.name or _free_name(spec)
    name = config.instance_name(one.name, two.name)
    for native in spec.pairs:
        if {native.geomname1, native.geomname2} == {one.name, two.name}:
            spec.delete(native)
    if others:
        spec.add_pair(geomname1=one.name, geomname2=two.name, margin=-native_margin(shapes[0], shapes[1]), gap=0.0)
    else:
        for geom in (one, two):
            geom.contype = geom.conaffinity = 0
    contact = config.Contact(one.name, two.name, pair, None if normal is None else tuple(normal.tolist()))
    spec.activate_plugin(config.PLUGIN_NAME)
    instance = spec.add_plugin(name=name, plugin_name=config.PLUGIN_NAME, active=True)
    instance.config = config.write(contact)
    _hold(spec, name, (one, two))
    return name


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


def _hold(spec: mujoco.MjSpec, name: str, geoms: tuple[mujoco.MjsGeom, mujoco.MjsGeom]) -> None:
    """Let a body of the pair refer to the instance, or MuJoCo drops it when the spec is copied or attached."""
    for geom in geoms:
        body = geom.parent
        if body.id != spec.worldbody.id and not body.plugin.active:
            body.plugin.active, body.plugin.plugin_name, body.plugin.name = True, config.PLUGIN_NAME, name
            return


def _free_name(spec: mujoco.MjSpec) -> str:
    taken = {geom.name for geom in spec.geoms}
    return next(name for name in (f"contactlaw_geom{i}" for i in range(len(taken) + 1)) if name not in taken)


def contact_history(model: mujoco.MjModel, data: mujoco.MjData, name: str) -> NDArray[np.float64]:
    """The committed history of a contact, a view into `data.plugin_state`.

    Args:
        model, data: The compiled model and its state.
        name: Of the plugin instance, as `add_contact` returned it or the XML has it.

    Returns:
        Shape (slots, entries), as `contactlaw.kernels.contact` lays it out (`OVERLAP`, `NORMAL`, `TANGENTIAL`, ...);
        one slot; for a capsule on a plane two, one for each end, on a box a third for its side.

    Raises:
        ValueError: The model has no such contact.
    """
    number = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_PLUGIN, name)
    if number < 0:
        raise ValueError(f"name = {name!r}: must be the name of a plugin instance of the model")
    start, size = model.plugin_stateadr[number], model.plugin_statenum[number]
    entries = contact_of(model._address, number).history_size
    return data.plugin_state[start : start + size].reshape(-1, entries)
