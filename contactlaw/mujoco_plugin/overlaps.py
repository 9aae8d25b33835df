"""Geoms that lie in each other where somebody has put them: which they are, and how to move them apart."""

from __future__ import annotations

import warnings
from collections.abc import Iterator

import mujoco
import numpy as np
from numpy.typing import NDArray

from contactlaw.mujoco_plugin import layout
from contactlaw.mujoco_plugin.members import Member, members
from contactlaw.pair import ContactWarning

NAMED = 5  # pairs in a message
INSIDE = 0.1  # of the smaller bounding sphere's radius, a depth that no contact has
ROUNDS, SWEEPS = 30, 20
Overlap = tuple[int, int, float]


def overlaps_of(model: mujoco.MjModel, data: mujoco.MjData) -> list[Overlap]:
    """Geoms of the law that lie in each other where `data` has them: two ids and the depth [m], deepest first.

    An environment that draws starting places until `data.ncon` is zero does not see these contacts. Where `data.qpos`
    has been set, mj_kinematics (or mj_forward) must have been called since.
    """
    view = layout.ModelView(model._address)
    pairs = {tuple(sorted(pair)) for number in members(view) for pair in _close(model, data, Member(view, number))}
    depths = [(one, two, -mujoco.mj_geomDistance(model, data, one, two, 0.0, None)) for one, two in pairs]
    return sorted((entry for entry in depths if entry[2] > 0.0), key=lambda entry: (-entry[2], entry[:2]))


def relax(model: mujoco.MjModel, data: mujoco.MjData, *, deepest: float = 1e-6) -> float:
    """Move what lies in each other apart, so that it just touches; for starting places that are drawn at random.

    Elastic energy that a starting place has in its overlaps would throw bodies apart. The coordinates are changed by as
    little as will do, as the mass matrix measures it: dq = M^-1 J^T x, x >= 0 along each normal, found by sweeps over
    the overlaps (Gauss-Seidel) and repeated where the bodies then are. Velocities, joint limits and what the law does
    not serve are not looked at.

    Args:
        model, data: The compiled model and its state; `data.qpos` is changed, and what follows from it.
        deepest: Overlap that may remain [m].

    Returns:
        The deepest overlap that is left [m].
    """
    for _ in range(ROUNDS):
        mujoco.mj_fwdPosition(model, data)
        left = [overlap for overlap in overlaps_of(model, data) if overlap[2] > deepest]
        if not left:
            break
        mujoco.mj_integratePos(model, data.qpos, _way_out(model, data, left), 1.0)
    mujoco.mj_fwdPosition(model, data)
    return max((depth for _, _, depth in overlaps_of(model, data)), default=0.0)


def warn_of_start(model: mujoco.MjModel, refuse: bool) -> None:
    """Say which geoms of the law lie in each other too deep where the model begins.

    Raises:
        ValueError: Such there are, and `refuse` says so.
    """
    found = _deep(model)
    if not found:
        return
    text = f"geoms lie in each other where the model begins: {_named([*found.values()])}"
    if refuse:
        raise ValueError(f"overlaps = 'raise': {text}")
    warnings.warn(f"{text}; they count as just touching", ContactWarning, stacklevel=4)


def part_joined(spec: mujoco.MjSpec, model: mujoco.MjModel) -> bool:
    """Exclude contacts of bodies of one mechanism that are built into each other; whether there are any.

    A finger whose root is in the palm cannot leave it, and has no normal there: it would be pressed and rubbed for
    good. A mechanism is a tree of bodies, with the world where it stands on this without a free joint. Planes divide.
    """
    root, weld = model.body_rootid, model.body_weldid
    free = set(model.jnt_bodyid[model.jnt_type == mujoco.mjtJoint.mjJNT_FREE].tolist())
    said: dict[tuple[int, int], str] = {}
    for geoms, text in _deep(model).items():
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
        text = f"parts are built into each other: {_named([*said.values()])}; their bodies do not touch"
        warnings.warn(text, ContactWarning, stacklevel=4)
    return bool(said)


def _deep(model: mujoco.MjModel) -> dict[tuple[int, int], str]:
    """Geoms of the law that lie in each other too deep where the model begins, and the words for that."""
    data, view = mujoco.MjData(model), layout.ModelView(model._address)
    mujoco.mj_kinematics(model, data)
    return {
        (one, two): f"{view.label('geom', one)} and {view.label('geom', two)} by {1e3 * depth:.3g} mm"
        for one, two, depth in overlaps_of(model, data)
        if depth > INSIDE * min(reach for reach in model.geom_rbound[[one, two]] if reach > 0.0)
    }


def _named(found: list[str]) -> str:
    """The first few."""
    more = f" and {len(found) - NAMED} more pairs" if len(found) > NAMED else ""
    return ", ".join(found[:NAMED]) + more


def _close(model: mujoco.MjModel, data: mujoco.MjData, member: Member) -> Iterator[tuple[int, int]]:
    """Pairs of an instance whose bounding spheres overlap; what has none is infinite."""
    twos = np.array(member.sets.twos)
    reach = np.where(model.geom_rbound > 0.0, model.geom_rbound, np.inf)
    for one in member.sets.ones:
        near = np.linalg.norm(data.geom_xpos[twos] - data.geom_xpos[one], axis=1) < reach[twos] + reach[one]
        yield from ((one, two) for two in twos[near].tolist() if member.sets.hold(one, two))


def _way_out(model: mujoco.MjModel, data: mujoco.MjData, overlaps: list[Overlap]) -> NDArray[np.float64]:
    """Displacement, shape (nv,), that takes overlaps away to first order."""
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
