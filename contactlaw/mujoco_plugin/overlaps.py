"""Initial overlaps: which geoms lie in each other."""

import warnings
from collections.abc import Iterator

import mujoco
import numpy as np

from contactlaw.mujoco_plugin import layout
from contactlaw.mujoco_plugin.instances import contact_instances
from contactlaw.mujoco_plugin.notices import reported_of
from contactlaw.mujoco_plugin.readout import View, view_of
from contactlaw.mujoco_plugin.selection import first_of
from contactlaw.pair import ContactWarning
from contactlaw.world.readout import PUT_IN

NAMED = 5  # pairs in a message
INSIDE = 0.1  # depth over the radius of the smaller bounding sphere: deeper than any contact
Overlap = tuple[int, int, float]


def overlaps_of(model: mujoco.MjModel, data: mujoco.MjData) -> list[Overlap]:
    """Return the geoms of the law that overlap in `data`: (id, id, depth [m]), deepest first.

    An environment that draws initial positions until `data.ncon` is zero does not see these contacts. After `data.qpos`
    has been set, call mj_kinematics (or mj_forward) first.
    """
    if not contact_instances(layout.view_of(model, data)):
        return []
    pairs = _near_pairs(model, data, view_of(model, data))
    depths = [(one, two, -mujoco.mj_geomDistance(model, data, one, two, 0.0, None)) for one, two in pairs]
    return sorted((entry for entry in depths if entry[2] > 0.0), key=lambda entry: (-entry[2], entry[:2]))


def report_initial_overlaps(model: mujoco.MjModel, refuse: bool) -> None:
    """Warn of geoms of the law that lie in each other too deep in the model's initial position; steps do not again.

    Raises:
        ValueError: There are some, and refuse is True.
    """
    found = _deep_overlaps(model)
    if not found:
        return
    text = f"geoms overlap in the initial position of the model: {first_of([*found.values()], NAMED, 'pairs')}"
    if refuse:
        raise ValueError(f"overlaps = 'raise': {text}")
    warnings.warn(f"{text}; they count as just touching", ContactWarning, stacklevel=4)
    world = view_of(model, mujoco.MjData(model))
    group = dict(zip(world.geoms.tolist(), world.shapes["group"].tolist(), strict=True))
    told = reported_of(layout.view_of(model), world.pairs.size)
    for one, two in found:
        told[world.groups[group[one], group[two]]] |= PUT_IN


def exclude_held(spec: mujoco.MjSpec, model: mujoco.MjModel, refuse: bool) -> bool:
    """Exclude contacts between the two bodies of a connect or weld constraint that are built into each other.

    The constraint holds them so, and there is no sensible normal along which they could push. Returns whether there are
    any such bodies.

    Raises:
        ValueError: There are some, and refuse is True.
    """
    weld, ends, said = model.body_weldid, list[set[int]](), dict[tuple[int, int], str]()
    fields = model.eq_type, model.eq_objtype, model.eq_obj1id, model.eq_obj2id
    for kind, of, *both in np.array(fields).T.tolist():
        if kind in (mujoco.mjtEq.mjEQ_CONNECT, mujoco.mjtEq.mjEQ_WELD):
            bodies = model.site_bodyid[both] if of == mujoco.mjtObj.mjOBJ_SITE else both
            ends.append({int(weld[body]) for body in bodies})
    for geoms, text in (_deep_overlaps(model) if ends else {}).items():
        bodies = (int(model.geom_bodyid[geoms[0]]), int(model.geom_bodyid[geoms[1]]))
        if {int(weld[body]) for body in bodies} in ends:
            said.setdefault(bodies, text)
    built = f"parts are built into each other: {first_of([*said.values()], NAMED, 'pairs')}"
    if said and refuse:
        raise ValueError(f"overlaps = 'keep': {built}; a weld or connect holds them so, leave them out by an <exclude>")
    every = list(spec.bodies) if said else []
    for bodies in said:
        names = []
        for body in (next(body for body in every if body.id == number) for number in bodies):
            body.name = body.name or f"body{body.id}"
            names.append(body.name)
        spec.add_exclude(bodyname1=names[0], bodyname2=names[1])
    if said:
        warnings.warn(f"{built}; their bodies do not touch", ContactWarning, stacklevel=4)
    return bool(said)


def _deep_overlaps(model: mujoco.MjModel) -> dict[tuple[int, int], str]:
    """Return geoms of the law that lie in each other too deep in the initial position, and the text for a message."""
    data, view = mujoco.MjData(model), layout.view_of(model)
    mujoco.mj_kinematics(model, data)
    return {
        (one, two): f"{view.label('geom', one)} and {view.label('geom', two)} by {1e3 * depth:.3g} mm"
        for one, two, depth in overlaps_of(model, data)
        if depth > INSIDE * min(reach for reach in model.geom_rbound[[one, two]] if reach > 0.0)
    }


def _near_pairs(model: mujoco.MjModel, data: mujoco.MjData, world: View) -> Iterator[tuple[int, int]]:
    """Yield the pairs that the law lets touch and whose bounding spheres overlap; planes have an infinite one."""
    geoms, first = np.unique(world.geoms, return_index=True)
    shapes = world.shapes[first]
    reach = np.where(model.geom_rbound > 0.0, model.geom_rbound, np.inf)[geoms]
    places = data.geom_xpos[geoms]
    for i, geom in enumerate(geoms.tolist()):
        near = np.linalg.norm(places - places[i], axis=1) < reach + reach[i]
        near &= (world.groups[shapes["group"][i], shapes["group"]] >= 0) & (shapes["body"] != shapes["body"][i])
        near[:i] = False
        yield from ((geom, two) for two in geoms[near].tolist())
