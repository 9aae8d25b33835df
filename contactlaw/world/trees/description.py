"""Trees of bodies, described body by body."""

from collections.abc import Sequence
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
from numpy.typing import ArrayLike

from contactlaw import checks
from contactlaw.world.data.frames import UNTURNED, principal, unit_quaternion
from contactlaw.world.data.records import Array
from contactlaw.world.data.tree import BALL, FREE_JOINT, HINGE, SLIDE
from contactlaw.world.trees.tree_records import V_SIZE, TreeRecords, firsts

KINDS = {"free": FREE_JOINT, "ball": BALL, "slide": SLIDE, "hinge": HINGE}
ZERO = {FREE_JOINT: [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], BALL: [1.0, 0.0, 0.0, 0.0], SLIDE: [0.0], HINGE: [0.0]}
"""Coordinates of a joint that does nothing."""


@dataclass(frozen=True)
class Joint:
    """A joint between a body and its parent.

    Attributes:
        kind: "hinge", "slide", "ball" or "free".
        at: Its place, from the body's centre of mass along its axes [m]; of a hinge or ball.
        axis: A unit vector along the same axes; of a hinge or slide.
        armature: Inertia of the joint itself [kg] or [kg m^2].
        damping: [N s/m] or [N m s].
    """

    kind: str = "hinge"
    at: ArrayLike = (0.0, 0.0, 0.0)
    axis: ArrayLike = (0.0, 1.0, 0.0)
    armature: float = 0.0
    damping: float = 0.0


@dataclass(frozen=True)
class Part:
    """A body of a tree.

    Attributes:
        mass: [kg].
        inertia: About the centre of mass, along its axes, which are principal ones [kg m^2]: one number or three.
        joints: Between its parent and it, in sequence, the parent's first.
        parent: Number of the body that carries it, counted in the tree; -1: the world.
        position: Of its centre of mass at zero coordinates, from its parent's, along the parent's axes [m].
        quaternion: Of its axes in its parent's at zero coordinates, scalar first.
    """

    mass: float
    inertia: ArrayLike
    joints: Sequence[Joint]
    parent: int = -1
    position: ArrayLike = (0.0, 0.0, 0.0)
    quaternion: ArrayLike = (1.0, 0.0, 0.0, 0.0)


class Tree:
    """Bodies joined by joints, branching at will.

    Its coordinates and velocities are those of its joints in their order, body by body. Hinge and slide: angle [rad] or
    distance [m], and its rate. Ball: a quaternion, scalar first, and the spin along the body's axes [rad/s]. Free:
    position of the centre of mass [m] and quaternion, velocity [m/s] and the spin along the body's axes [rad/s].

    Args:
        parts: The bodies, parents before children.

    Attributes:
        q_size, v_size: Number of coordinates and of velocities.
        start: Zero coordinates, with unit quaternions.

    Raises:
        ValueError: A value outside its range; the message names it.
    """

    def __init__(self, parts: Sequence[Part]) -> None:
        if not isinstance(parts, Sequence) or not parts:
            raise ValueError(f"parts = {parts!r}: must be a sequence of Part, not empty")
        self.parts = list(parts)
        for number, part in enumerate(parts):
            joints = checks.instance(f"parts[{number}]", part, Part).joints
            if not (isinstance(joints, Sequence) and joints and all(isinstance(one, Joint) for one in joints)):
                raise ValueError(f"joints = {joints!r} of part {number}: must be a sequence of Joint, not empty")
            if checks.count("parent", part.parent, -1) >= number:
                raise ValueError(f"parent = {part.parent} of part {number}: must be -1, for none, or an earlier part")
        self.rows = records_of([_checked(part) for part in parts])
        self.start = self.rows.start
        self.q_size, self.v_size = self.start.size, self.rows.axes.size


def records_of(parts: Sequence[Part]) -> TreeRecords:
    """Return the records of a tree; parts without joints become one body with what they are fixed to."""
    joints, count = [joint for part in parts for joint in part.joints], [len(part.joints) for part in parts]
    kinds = [KINDS[joint.kind] for joint in joints]
    start, v = [ZERO[kind] for kind in kinds], [V_SIZE[kind] for kind in kinds]
    arrays = {
        "body_parentid": [part.parent for part in parts], "body_jntnum": count, "body_jntadr": firsts(count),
        "body_pos": [part.position for part in parts], "body_quat": [part.quaternion for part in parts],
        "body_ipos": np.zeros((len(parts), 3)), "body_iquat": np.tile(UNTURNED, (len(parts), 1)),
        "body_mass": [part.mass for part in parts], "body_inertia": [part.inertia for part in parts],
        "jnt_type": kinds, "jnt_pos": [joint.at for joint in joints], "jnt_axis": [joint.axis for joint in joints],
        "jnt_qposadr": firsts([len(zero) for zero in start]), "jnt_dofadr": firsts(v), "qpos0": np.concatenate(start),
        "dof_armature": np.repeat([joint.armature for joint in joints], v),
        "dof_damping": np.repeat([joint.damping for joint in joints], v),
    }  # fmt: skip
    return TreeRecords(SimpleNamespace(**arrays), range(len(parts)))


def _checked(part: Part) -> Part:
    joints = [
        Joint(
            checks.one_of("kind", one.kind, KINDS), checks.vector("at", one.at), checks.unit_vector("axis", one.axis),
            checks.not_negative("armature", one.armature), checks.not_negative("damping", one.damping),
        ) for one in part.joints
    ]  # fmt: skip
    return Part(
        checks.positive("mass", part.mass), _moments(part.inertia), joints, part.parent,
        checks.vector("position", part.position), unit_quaternion("quaternion", part.quaternion),
    )  # fmt: skip


def _moments(inertia: ArrayLike) -> Array:
    """Return three principal moments [kg m^2] from one number or three, checked."""
    given = checks.finite_array("inertia", inertia)
    if given.shape not in ((), (3,)):
        raise ValueError(f"inertia: shape {given.shape}; must be one number or (3,), about principal axes")
    return principal(given)[0]
