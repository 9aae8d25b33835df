"""What PyBullet knows of two bodies in contact: shapes and their curvature, poses, motion, and how easily they move."""

from __future__ import annotations

import operator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import pybullet as p
from numpy.typing import ArrayLike, NDArray

from contactlaw.pair import ContactPair

Array = NDArray[np.float64]
Vector = tuple[float, float, float]

BASE = -1
SOFT_BODY = 3  # body type in getDynamicsInfo
FACE = 1.0 - 1e-8  # cosine between the normal and an axis of a box from which the contact is on a face

SHAPE_NAMES = {
    p.GEOM_SPHERE: "sphere",
    p.GEOM_BOX: "box",
    p.GEOM_CYLINDER: "cylinder",
    p.GEOM_MESH: "mesh",
    p.GEOM_PLANE: "plane",
    p.GEOM_CAPSULE: "capsule",
    p.GEOM_HEIGHTFIELD: "heightfield",
}
FLAT = ("plane", "box")
ROUND = ("sphere", "capsule")


@dataclass(frozen=True)
class Side:
    """One of the two bodies of a contact: a base (link -1) or a link, and the shape it touches with.

    Attributes:
        body, link: PyBullet's ids.
        shape: "sphere", "box", ...; "compound" where the link has several shapes.
        size: As in getCollisionShapeData [m]: sphere (R, R, R); box: full widths; capsule (length, R, 0).
        position, rotation: Of the shape in the body's inertial frame: [m], shape (3,); shape (3, 3).
    """

    body: int
    link: int
    shape: str
    size: Vector
    position: Array
    rotation: Array

    @property
    def curvature(self) -> float | None:
        """1/radius where the shape has one radius of its own [1/m], 0 for flat ones; None: the pair must give it."""
        if self.shape in FLAT:
            return 0.0
        if self.shape == "sphere":
            return 1.0 / self.size[0]
        return 1.0 / self.size[1] if self.shape == "capsule" else None

    @property
    def key(self) -> tuple[int, int]:
        """Body and link."""
        return self.body, self.link

    def __str__(self) -> str:
        return f"body {self.body}" if self.link == BASE else f"body {self.body} link {self.link}"


class Motion(NamedTuple):
    """Centre of mass [m], orientation (quaternion), velocity of the centre of mass [m/s], angular velocity [rad/s]."""

    position: Vector
    orientation: tuple[float, float, float, float]
    velocity: Vector
    spin: Vector


def bodies(client: int) -> list[int]:
    """Ids of all bodies there are now."""
    return [p.getBodyUniqueId(i, client) for i in range(p.getNumBodies(client))]


def engine_parameters(client: int) -> dict[str, Any]:
    """PyBullet's parameters of the next step; substeps are refused."""
    parameters = p.getPhysicsEngineParameters(client)
    if parameters["numSubSteps"] > 1:
        raise ValueError(
            f"numSubSteps = {parameters['numSubSteps']}: must be 0 or 1, as a force stays the same over the substeps; "
            "shorten the step with setTimeStep instead"
        )
    return parameters


def read_side(client: int, which: str, body: Any, link: Any) -> Side:
    """Check the ids of one side ("a" or "b") and read its shape.

    Raises:
        ValueError: No such body or link, no collision shape, a soft body, or a planar joint in the body.
    """
    # PyBullet checks no link id itself: getDynamicsInfo of a link that is not there ends the process.
    body = _identity(f"body_{which}", body, bodies(client), "the bodies of this client")
    joints = p.getNumJoints(body, client)
    link = _identity(f"link_{which}", link, range(BASE, joints), f"-1 (the base) and the links of body {body}")
    if p.getDynamicsInfo(body, BASE, client)[10] == SOFT_BODY:
        raise ValueError(f"body_{which} = {body}: a soft body; must be a rigid body or a multibody")
    if any(p.getJointInfo(body, joint, client)[2] == p.JOINT_PLANAR for joint in range(joints)):
        raise ValueError(f"body_{which} = {body}: has a planar joint, whose inertia cannot be read; others are allowed")
    shapes = p.getCollisionShapeData(body, link, client)
    if not shapes:
        raise ValueError(f"body_{which} = {body}, link_{which} = {link}: has no collision shape to touch with")
    kind, size, _, position, orientation = shapes[0][2:7]
    name = SHAPE_NAMES.get(kind, f"shape of type {kind}") if len(shapes) == 1 else "compound"
    return Side(body, link, name, size, np.array(position), rotation(orientation))


def _identity(name: str, value: Any, allowed: Any, what: str) -> int:
    try:
        number = operator.index(value)
    except TypeError:
        number = None
    if number is None or isinstance(value, bool) or number not in allowed:
        raise ValueError(f"{name} = {value!r}: must be one of {what}, {list(allowed)}")
    return number


def effective_radius(pair: ContactPair, a: Side, b: Side) -> float:
    """R [m]: the pair's, or from the shapes, 1/R = 1/R_A + 1/R_B.

    Raises:
        ValueError: A shape has no radius of its own, or both are flat, and the pair gives none.
    """
    if pair.radius is not None:
        return pair.radius
    total = 0.0
    for name, side in (("a", a), ("b", b)):
        if side.curvature is None:
            raise ValueError(
                f"radius = None: {side} (body_{name}) is a {side.shape}, without one radius of curvature; "
                f"give the pair an effective radius [m], or use a {', '.join(ROUND + FLAT)}"
            )
        total += side.curvature
    if total == 0.0:
        raise ValueError(
            f"radius = None: {a} ({a.shape}) and {b} ({b.shape}) are both flat; give the pair an effective radius [m]"
        )
    return 1.0 / total


def check_smooth(side: Side, point: Vector, normal: Vector, motion: Motion) -> None:
    """Refuse a contact on the edge of a box or the side of a capsule; point: on that body [m]."""
    if side.shape not in ("box", "capsule"):
        return
    frame = rotation(motion.orientation) @ side.rotation
    if side.shape == "capsule":
        centre = np.array(motion.position) + rotation(motion.orientation) @ side.position
        where, smooth = "side", "ends"
        bad = abs(float(frame[:, 2] @ (point - centre))) <= 0.5 * side.size[0]
    else:  # by the normal: Bullet rounds edges off with its collision margin, so the place does not tell
        where, smooth = "edge", "faces"
        bad = float(np.abs(normal @ frame).max()) < FACE
    if not bad:
        return
    raise ValueError(
        f"radius = None: {side} touches with the {where} of its {side.shape} at {np.round(point, 6).tolist()}; only "
        f"the {smooth} have a radius of their own, elsewhere give the pair an effective radius [m]"
    )


def check_one_end(side: Side, other: Side, gap: float, normal: Vector, motion: Motion) -> None:
    """Refuse a capsule that lies on a flat body with both ends: two contacts, and one history cannot hold both."""
    if side.shape != "capsule" or other.shape not in FLAT:
        return
    axis = rotation(motion.orientation) @ side.rotation[:, 2]
    if gap + side.size[0] * abs(float(axis @ normal)) < 0.0:
        raise ValueError(
            f"radius = None: {side}, a capsule, lies on {other} with both ends, a line contact; give the pair an "
            "effective radius [m] to let its deepest point act alone, or build it from two spheres on links"
        )


def read_motion(client: int, body: int, link: int) -> Motion:
    """Where the body is and how it moves, now."""
    if link == BASE:
        return Motion(*p.getBasePositionAndOrientation(body, client), *p.getBaseVelocity(body, client))
    state = p.getLinkState(body, link, 1, 1, client)
    return Motion(state[0], state[1], state[6], state[7])


def velocity_at(motion: Motion, point: ArrayLike) -> Array:
    """Velocity of the body's material point here [m/s], shape (3,)."""
    return motion.velocity + np.cross(motion.spin, np.subtract(point, motion.position))


def rotation(quaternion: tuple[float, ...]) -> Array:
    """Rotation matrix, shape (3, 3)."""
    return np.array(p.getMatrixFromQuaternion(quaternion)).reshape(3, 3)


def mobility(client: int, a: Side, b: Side, point: Array) -> tuple[Array, float]:
    """How easily a contact gives way, and to what part that is B's doing.

    Joint motors, joint limits, constraints and native contacts of the bodies are not in it.

    Returns:
        W: relative velocity at the point [m] gained by A over B per impulse on A and its opposite on B [1/kg], shape
        (3, 3), world frame; share of B in its trace, 0 where B is fixed.
    """
    first = Mechanism(client, a.body)
    if a.body == b.body:
        return first.mobility(first.jacobian(a.link, point) - first.jacobian(b.link, point)), 0.5
    second = Mechanism(client, b.body)
    w_a, w_b = first.mobility(first.jacobian(a.link, point)), second.mobility(second.jacobian(b.link, point))
    total = float(np.trace(w_a) + np.trace(w_b))
    return w_a + w_b, float(np.trace(w_b)) / total if total > 0.0 else 0.5


class Mechanism:
    """A body with its links as it stands: mass matrix and Jacobians, world frame; coordinates: base, then joints.

    PyBullet's own calculateMassMatrix keeps the masses of its first call, changeDynamics or not, and it and
    calculateJacobian are in the frame of the base: hence this one, from the poses and masses of the moment.

    Attributes:
        mass_matrix: shape (n, n), n = 6 for a free body, 0 for a fixed one, and the degrees of freedom of its joints.
    """

    def __init__(self, client: int, body: int) -> None:
        self._axes: list[Array] = []
        self._origins: list[Array] = []
        self._turning: list[bool] = []
        self._columns: dict[int, list[int]] = {}  # of each link: the coordinates that move it
        links = [BASE, *range(p.getNumJoints(body, client))]
        dynamics = {link: p.getDynamicsInfo(body, link, client) for link in links}
        poses = {link: _pose(client, body, link) for link in links}
        for link in links:
            self._add_joint(client, body, link, poses[link], dynamics[link])
        n = len(self._axes)
        self.mass_matrix = np.zeros((n, n))
        for link in links:
            centre, turn = poses[link]
            mass, inertia = dynamics[link][0], dynamics[link][2]
            linear, angular = self.jacobian(link, centre), self._angular(link)
            local = turn.T @ angular
            self.mass_matrix += mass * linear.T @ linear + local.T @ (np.array(inertia)[:, None] * local)

    def _add_joint(self, client: int, body: int, link: int, pose: tuple[Array, Array], dynamics: tuple) -> None:
        """Note the coordinates of the joint that leads to a link; the base of a free body has six."""
        centre, turn = pose
        if link == BASE:
            self._columns[BASE] = []
            if dynamics[0] > 0.0:
                self._add(BASE, np.eye(3), centre, turning=False)
                self._add(BASE, np.eye(3), centre, turning=True)
            return
        info = p.getJointInfo(body, link, client)
        self._columns[link] = list(self._columns[info[16]])
        # dynamics[3], [4]: the inertial frame, in which the pose is given, as seen from the joint's frame; the joint's
        # own frame comes from getLinkState in single precision only.
        origin = centre - turn @ rotation(dynamics[4]).T @ np.array(dynamics[3])
        if info[2] == p.JOINT_SPHERICAL:
            self._add(link, np.eye(3), origin, turning=True)
        elif info[2] in (p.JOINT_REVOLUTE, p.JOINT_PRISMATIC):
            self._add(link, (turn @ np.array(info[13]))[None], origin, turning=info[2] == p.JOINT_REVOLUTE)

    def _add(self, link: int, axes: Array, origin: Array, *, turning: bool) -> None:
        for axis in axes:
            self._columns[link].append(len(self._axes))
            self._axes.append(axis)
            self._origins.append(origin)
            self._turning.append(turning)

    def jacobian(self, link: int, point: Array) -> Array:
        """Velocity of the link's material point here [m], per coordinate; shape (3, n)."""
        out = np.zeros((3, len(self._axes)))
        for i in self._columns[link]:
            axis = self._axes[i]
            out[:, i] = np.cross(axis, point - self._origins[i]) if self._turning[i] else axis
        return out

    def _angular(self, link: int) -> Array:
        out = np.zeros((3, len(self._axes)))
        for i in self._columns[link]:
            if self._turning[i]:
                out[:, i] = self._axes[i]
        return out

    def mobility(self, jacobian: Array) -> Array:
        """J M^-1 J^T [1/kg], shape (3, 3); a coordinate without inertia is locked, as in Bullet."""
        free = np.diag(self.mass_matrix) > 0.0
        j = jacobian[:, free]
        return j @ np.linalg.solve(self.mass_matrix[np.ix_(free, free)], j.T)


def _pose(client: int, body: int, link: int) -> tuple[Array, Array]:
    """Centre of mass [m] and rotation of the inertial frame."""
    motion = read_motion(client, body, link)
    return np.array(motion.position), rotation(motion.orientation)
