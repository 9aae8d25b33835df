"""Bodies and shapes: ids checked, shapes read, their curvature, and how the kernels see them."""

from __future__ import annotations

import operator
from collections.abc import Iterable
from dataclasses import dataclass
from math import sqrt
from typing import Any

import numpy as np
import pybullet as p
from numpy.typing import NDArray

from contactlaw.kernels.touch import BALL, BOX, CAPSULE, OTHER, PLANE
from contactlaw.pair import ContactPair

Array = NDArray[np.float64]
Key = tuple[int, int]

BASE = -1
MULTIBODY = 2  # body type in getDynamicsInfo
WHAT_IT_IS = {
    0: "without a body type",
    1: "made with useMaximalCoordinates, whose mass cannot be read",
    3: "a soft body",
}

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
EVERYWHERE = 1e300  # [m]


@dataclass(frozen=True, eq=False)
class Side:
    """One of the two bodies of a contact: a base (link -1) or a link, and the shape it touches with.

    Attributes:
        body, link: PyBullet's ids.
        shape: "sphere", "box", ...; "compound" where the link has several shapes.
        kind, size: The same as `kernels.touch` reads it: a kind and up to three sizes [m].
        bound: Radius of a sphere around the shape's centre that holds all of it [m].
        position, rotation: Of the shape in the body's inertial frame: [m], shape (3,); shape (3, 3).
    """

    body: int
    link: int
    shape: str
    kind: float
    size: tuple[float, float, float]
    bound: float
    position: Array
    rotation: Array

    @property
    def curvature(self) -> float | None:
        """1/radius where the shape has one radius of its own [1/m], 0 for flat ones; None: the pair must give it."""
        if self.shape in FLAT:
            return 0.0
        return 1.0 / self.size[0] if self.shape in ROUND else None

    @property
    def key(self) -> Key:
        """Body and link."""
        return self.body, self.link

    @property
    def rank(self) -> int:
        """The rounder, the less: the kernels want the rounder of two as A, and a plane as B."""
        return {"sphere": 0, "capsule": 1, "plane": 3}.get(self.shape, 2)

    def __str__(self) -> str:
        return f"body {self.body}" if self.link == BASE else f"body {self.body} link {self.link}"


def engine_parameters(client: int) -> dict[str, Any]:
    """PyBullet's parameters of the next step; substeps are refused."""
    parameters = p.getPhysicsEngineParameters(client)
    if parameters["numSubSteps"] > 1:
        raise ValueError(
            f"numSubSteps = {parameters['numSubSteps']}: must be 0 or 1, as a force stays the same over the substeps; "
            "shorten the step with setTimeStep instead"
        )
    return parameters


def read_sides(client: int, which: str, bodies: Any, link: Any) -> list[Side]:
    """Sides of one set ("a" or "b"): a body, or several, plain or as (body, link); link: of plain ones.

    Raises:
        ValueError: No such body or link, no collision shape, not a multibody, a planar joint, or an empty set.
    """
    if not isinstance(bodies, Iterable) or isinstance(bodies, str | bytes):
        return [read_side(client, which, bodies, link)]
    sides: dict[Key, Side] = {}
    for entry in bodies:
        if isinstance(entry, Iterable) and not isinstance(entry, str | bytes):
            members = list(entry)
            if len(members) != 2:
                raise ValueError(f"body_{which}: holds {entry!r}; each must be a body or (body, link)")
            side = read_side(client, which, *members)
        else:
            side = read_side(client, which, entry, link)
        sides[side.key] = side
    if not sides:
        raise ValueError(f"body_{which} = {bodies!r}: holds no bodies; must hold one or more")
    return list(sides.values())


def read_side(client: int, which: str, body: Any, link: Any) -> Side:
    """Check the ids of one side and read its shape; errors as for `read_sides`."""
    # PyBullet checks no link id itself: getDynamicsInfo of a link that is not there ends the process.
    there = [p.getBodyUniqueId(i, client) for i in range(p.getNumBodies(client))]
    body = _identity(f"body_{which}", body, there, "the bodies of this client")
    joints = p.getNumJoints(body, client)
    link = _identity(f"link_{which}", link, range(BASE, joints), f"-1 (the base) and the links of body {body}")
    kind = p.getDynamicsInfo(body, BASE, client)[10]
    if kind != MULTIBODY:
        what = WHAT_IT_IS.get(kind, f"of type {kind}")
        raise ValueError(f"body_{which} = {body}: {what}; must be a multibody, as createMultiBody and loadURDF give")
    if any(p.getJointInfo(body, joint, client)[2] == p.JOINT_PLANAR for joint in range(joints)):
        raise ValueError(f"body_{which} = {body}: has a planar joint, whose inertia cannot be read; others are allowed")
    shapes = p.getCollisionShapeData(body, link, client)
    if not shapes:
        raise ValueError(f"body_{which} = {body}, link_{which} = {link}: has no collision shape to touch with")
    kind, size, _, position, orientation = shapes[0][2:7]
    name = SHAPE_NAMES.get(kind, f"shape of type {kind}") if len(shapes) == 1 else "compound"
    return _side(client, body, link, name, size, np.array(position), rotation(orientation))


def _side(client: int, body: int, link: int, name: str, size: Any, position: Array, turn: Array) -> Side:
    if name == "sphere":
        return Side(body, link, name, BALL, (size[0], 0.0, 0.0), size[0], position, turn)
    if name == "capsule":  # (length without the caps, radius)
        half = 0.5 * size[0]
        return Side(body, link, name, CAPSULE, (size[1], half, 0.0), half + size[1], position, turn)
    if name == "plane":  # its normal, in the shape's frame
        return Side(body, link, name, PLANE, (0.0, 0.0, 0.0), EVERYWHERE, position, turn @ turn_to(np.array(size)))
    if name == "box":  # full widths
        x, y, z = 0.5 * size[0], 0.5 * size[1], 0.5 * size[2]
        return Side(body, link, name, BOX, (x, y, z), sqrt(x * x + y * y + z * z), position, turn)
    centre = p.getBasePositionAndOrientation(body, client)[0] if link == BASE else p.getLinkState(body, link, 0, 1)[0]
    corners = np.array(p.getAABB(body, link, client))
    bound = float(np.linalg.norm(np.abs(corners - np.array(centre)).max(axis=0)))
    return Side(body, link, name, OTHER, (0.0, 0.0, 0.0), bound, np.zeros(3), np.eye(3))


def _identity(name: str, value: Any, allowed: Any, what: str) -> int:
    try:
        number = operator.index(value)
    except TypeError:
        number = None
    if number is None or isinstance(value, bool) or number not in allowed:
        raise ValueError(f"{name} = {value!r}: must be one of {what}, {list(allowed)}")
    return number


SERVED = (
    "the law serves spheres on any shape, and capsules on planes, boxes, spheres and each other; let these two keep "
    "Bullet's own contact, or give them spheres or capsules"
)


def check_served(a: Side, b: Side, free: bool) -> None:
    """Refuse two shapes that do not touch as a ball does, in one point each, whatever radius they are given.

    A flat face, a cylinder or an edge would be thrown up by forces at one corner that the others do not know of. free:
    whether one of them is free to turn every way; a capsule then strikes what Bullet measures with one end after the
    other, and within a step only one is seen.

    Raises:
        ValueError: They are such.
    """
    if "sphere" in (a.shape, b.shape) or (a.shape in ROUND and b.shape in ROUND):
        return
    what = f"{a} ({a.shape}) and {b} ({b.shape})"
    if a.shape in ROUND or b.shape in ROUND:
        other = b if a.shape in ROUND else a
        if other.shape in FLAT or not free:
            return
        raise ValueError(
            f"{what}, one of them free: a capsule that tumbles touches a {other.shape} in more than one point; "
            f"{SERVED} (a capsule on other shapes if neither is a body of its own without joints)"
        )
    raise ValueError(f"{what} touch along a face or edge, not in one point; {SERVED}")


def effective_radius(pair: ContactPair, a: Side, b: Side) -> float:
    """R [m]: the pair's, or from the shapes, of which one is round: 1/R = 1/R_A + 1/R_B.

    Raises:
        ValueError: A shape has no radius of its own, and the pair gives none.
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
    return 1.0 / total


def rotation(quaternion: tuple[float, ...]) -> Array:
    """Rotation matrix, shape (3, 3)."""
    return np.array(p.getMatrixFromQuaternion(quaternion)).reshape(3, 3)


def turn_to(normal: Array) -> Array:
    """A rotation matrix whose third column is the direction of a vector (3)."""
    z = normal / np.linalg.norm(normal)
    x = np.cross([0.0, 1.0, 0.0] if abs(z[1]) < 0.6 else [0.0, 0.0, 1.0], z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])
