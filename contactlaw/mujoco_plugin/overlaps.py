"""Initial overlaps: which geoms lie in each other, and a displacement that separates them."""

from __future__ import annotations

import warnings
from collections.abc import Iterator

import mujoco
import numpy as np
from numpy.typing import NDArray

from contactlaw import checks
from contactlaw.mujoco_plugin import layout
from contactlaw.mujoco_plugin.instances import contact_instances
from contactlaw.mujoco_plugin.readout import View, view_of
from contactlaw.mujoco_plugin.selection import first_of
from contactlaw.pair import ContactWarning

NAMED = 5  # pairs in a message
INSIDE = 0.1  # depth over the radius of the smaller bounding sphere: deeper than any contact
ROUNDS, SWEEPS = 30, 20
Overlap = tuple[int, int, float]


def overlaps_of(model: mujoco.MjModel, data: mujoco.MjData) -> list[Overlap]:
    """Return the geoms of the law that overlap in `data`: (id, id, depth [m]), deepest first.

    An environment that draws initial positions until `data.ncon` is zero does not see these contacts. After `data.qpos`
    has been set, call mj_kinematics (or mj_forward) first.
    """
    if not contact_instances(layout.view_of(model, checks.instance("data", data, mujoco.MjData))):
        return []
    pairs = _near_pairs(model, data, view_of(model, data))
    depths = [(one, two, -mujoco.mj_geomDistance(model, data, one, two, 0.0, None)) for one, two in pairs]
    return sorted((entry for entry in depths if entry[2] > 0.0), key=lambda entry: (-entry[2], entry[:2]))


def relax(model: mujoco.MjModel, data: mujoco.MjData, *, deepest: float = 1e-6) -> float:
    """Separate overlapping geoms so that they just touch; for initial positions drawn at random.

    Otherwise the elastic energy of the overlaps would push the bodies apart. The displacement of the coordinates is the
    smallest in the metric of the mass matrix: dq = M^-1 J^T x, x >= 0 along each normal, by Gauss-Seidel sweeps over
    the overlaps, repeated at the new positions. Velocities, joint limits and contacts of the engine are ignored.

    Args:
        model, data: The compiled model and its state; `data.qpos` and what follows from it are changed.
        deepest: Overlap that may remain [m].

    Returns:
        The deepest remaining overlap [m].
    """
    layout.view_of(model, checks.instance("data", data, mujoco.MjData))
    checks.positive("deepest", deepest)
    for _ in range(ROUNDS):
        mujoco.mj_fwdPosition(model, data)
        left = [overlap for overlap in overlaps_of(model, data) if overlap[2] > deepest]
        if not left:
            break
        mujoco.mj_integratePos(model, data.qpos, _separation(model, data, left), 1.0)
    mujoco.mj_fwdPosition(model, data)
    return max((depth for _, _, depth in overlaps_of(model, data)), default=0.0)


def report_initial_overlaps(model: mujoco.MjModel, refuse: bool) -> None:
    """Warn of geoms of the law that lie in each other too deep in the model's initial position.

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


def exclude_joined(spec: mujoco.MjSpec, model: mujoco.MjModel) -> bool:
    """Exclude contacts between bodies of one mechanism that are built into each other; return whether there are any.

    A finger whose root is in the palm cannot leave it and has no sensible normal there: it would be pressed and rubbed
    without end. A mechanism is a kinematic tree; one without a free joint includes the world. Planes are left out.
    """
    root, weld = model.body_rootid, model.body_weldid
    free = set(model.jnt_bodyid[model.jnt_type == mujoco.mjtJoint.mjJNT_FREE].tolist())
    said: dict[tuple[int, int], str] = {}
    for geoms, text in _deep_overlaps(model).items():
        bodies = (int(model.geom_bodyid[geoms[0]]), int(model.geom_bodyid[geoms[1]]))
        loose = {int(root[body]) for body in bodies} & free
        joined = root[bodies[0]] == root[bodies[1]] or (0 in weld[[*bodies]] and not loose)
        if joined and model.geom_rbound[[*geoms]].min() > 0.0:
            said.setdefault(bodies, text)
    every = list(spec.bodies) if said else []
    for bodies in said:
        ends = [next(body for body in every if body.id == number) for number in bodies]
        for body in ends:
            body.name = body.name or f"body{body.id}"
        spec.add_exclude(bodyname1=ends[0].name, bodyname2=ends[1].name)
    if said:
        text = (
            f"parts are built into each other: {first_of([*said.values()], NAMED, 'pairs')}; their bodies do not touch"
        )
        warnings.warn(text, ContactWarning, stacklevel=4)
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


def _separation(model: mujoco.MjModel, data: mujoco.MjData, overlaps: list[Overlap]) -> NDArray[np.float64]:
    """Return the displacement, shape (nv,), that removes overlaps to first order."""
    rows, answers = np.zeros((2, len(overlaps), model.nv))
    for row, (one, two, _) in zip(rows, overlaps, strict=True):
        ends = np.zeros(6)
        mujoco.mj_geomDistance(model, data, one, two, 0.0, ends)
        normal = (ends[3:] - ends[:3]) / max(np.linalg.norm(ends[3:] - ends[:3]), 1e-300)
        for geom, sign, end in ((one, 1.0, ends[:3]), (two, -1.0, ends[3:])):
            jacobian = np.zeros((3, model.nv))
            mujoco.mj_jac(model, data, jacobian, None, end, int(model.geom_bodyid[geom]))
            row += sign * normal @ jacobian
    mujoco.mj_solveM(model, data, answers, rows)
    push, way = np.zeros(len(overlaps)), np.zeros(model.nv)
    for _ in range(SWEEPS):
        for i, (row, answer) in enumerate(zip(rows, answers, strict=True)):
            mobility = row @ answer
            if mobility > 0.0:
                more = max((overlaps[i][2] - row @ way) / mobility, -push[i])
                push[i] += more
                way += more * answer
    return way
