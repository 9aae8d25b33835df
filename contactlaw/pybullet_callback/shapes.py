"""Bodies and shapes read from PyBullet: ids are checked, and shapes become shapes of the world."""

from __future__ import annotations

import operator
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pybullet as p
from numpy.typing import NDArray

from contactlaw import checks
from contactlaw.pair import ContactPair
from contactlaw.world import World
from contactlaw.world.data.frames import quaternion_of, turn_to
from contactlaw.world.data.records import BALL, HINGE, SLIDE

Array = NDArray[np.float64]
Key = tuple[int, int]

BASE = -1
MULTIBODY = 2  # body type in the result of getDynamicsInfo
OTHER_BODY_TYPES = {
    0: "without a body type",
    1: "made with useMaximalCoordinates, whose mass cannot be read",
    3: "a soft body",
}

KINDS = {p.JOINT_REVOLUTE: HINGE, p.JOINT_PRISMATIC: SLIDE, p.JOINT_SPHERICAL: BALL}
SHAPE_NAMES = {
    p.GEOM_SPHERE: "sphere",
    p.GEOM_BOX: "box",
    p.GEOM_CYLINDER: "cylinder",
    p.GEOM_MESH: "mesh",
    p.GEOM_PLANE: "plane",
    p.GEOM_CAPSULE: "capsule",
    p.GEOM_HEIGHTFIELD: "heightfield",
}
WITH_RADIUS = "sphere, capsule, plane, box, cylinder"
PIECES = "compound of such"
CLOSED_FORM = *WITH_RADIUS.split(", "), "mesh", PIECES


@dataclass(frozen=True, eq=False)
class Side:
    """One of the two bodies of a contact: a base (link -1) or a link, and its shape.

    Attributes:
        body, link: PyBullet's ids.
        shape: "sphere", "box", ...; "compound" if the link has several shapes and some have no closed form.
        size: Radius [m] of a sphere; radius and half length of a capsule or a cylinder; half lengths of a box.
        position, rotation: Of the shape in the body's inertial frame: [m], shape (3,); matrix, shape (3, 3); a plane's
            normal is its third axis.
        reach: Greatest distance [m] of a measured shape from the centre of mass.
        points: Vertices [m], shape (n, 3), of a mesh, which stands for its convex hull, in the body's inertial frame.
        pieces: A side for each shape of a compound whose shapes all have a closed form.
    """

    body: int
    link: int
    shape: str
    size: tuple[float, ...]
    position: Array
    rotation: Array
    reach: float = 0.0
    points: Array | None = None
    pieces: tuple[Side, ...] = ()

    @property
    def measured(self) -> bool:
        """Whether PyBullet must find its nearest point."""
        return self.shape not in CLOSED_FORM

    def add_to(self, world: World, body: int, offset: Array, turn: Array, rounding: float | None) -> list[int]:
        """Add the shape to a body of the world; return the numbers of the shapes that it makes.

        Args:
            world: The world.
            body: Of the world.
            offset, turn: Position [m] and rotation matrix of PyBullet's inertial frame in that body.
            rounding: Radius [m] of edges, None: the default.
        """
        if self.pieces:
            return [shape for piece in self.pieces for shape in piece.add_to(world, body, offset, turn, rounding)]
        at, own = (offset + turn @ self.position, turn @ self.rotation) if self.points is None else (offset, turn)
        return world.add_shape(self.shape, body, np.array(self.size), at, quaternion_of(own), rounding, self.points)

    @property
    def key(self) -> Key:
        """Body and link."""
        return self.body, self.link

    def __str__(self) -> str:
        return name_of(self.key)


def name_of(key: Key) -> str:
    """Return the name of a body or link in messages."""
    return f"body {key[0]}" if key[1] == BASE else f"body {key[0]} link {key[1]}"


def engine_parameters(client: int) -> dict[str, Any]:
    """Return PyBullet's parameters of the next step.

    Raises:
        ValueError: The step has substeps.
    """
    parameters = p.getPhysicsEngineParameters(client)
    if parameters["numSubSteps"] > 1:
        raise ValueError(
            f"numSubSteps = {parameters['numSubSteps']}: must be 0 or 1, as a force stays the same over the substeps; "
            "shorten the step with setTimeStep instead"
        )
    return parameters


def read_sides(client: int, which: str, bodies: Any, link: Any) -> list[Side]:
    """Return the sides of one set: a body, or several, as id or (body, link).

    which: "a" or "b", for messages; link: of bodies given as an id.

    Raises:
        ValueError: No such body or link, no collision shape, not a multibody, a planar joint, or an empty set.
    """
    there = {p.getBodyUniqueId(i, client): None for i in range(p.getNumBodies(client))}
    if not np.iterable(bodies) or isinstance(bodies, str | bytes):
        return [read_side(client, which, bodies, link, there)]
    sides: dict[Key, Side] = {}
    for entry in bodies:
        if isinstance(entry, Iterable) and not isinstance(entry, str | bytes):
            members = list(entry)
            if len(members) != 2:
                raise ValueError(f"body_{which}: holds {entry!r}; each must be a body or (body, link)")
            side = read_side(client, which, members[0], members[1], there)
        else:
            side = read_side(client, which, entry, link, there)
        sides[side.key] = side
    if not sides:
        raise ValueError(f"body_{which} = {bodies!r}: holds no bodies; must hold one or more")
    return list(sides.values())


def read_side(client: int, which: str, body: Any, link: Any, there: dict[int, None]) -> Side:
    """Check the ids of one side and read its shape; there: ids of all bodies; errors as for `read_sides`."""
    # checked first: PyBullet's getDynamicsInfo of a link that does not exist ends the process
    body = identity(f"body_{which}", body, there, "the bodies of this client")
    joints = p.getNumJoints(body, client)
    link = identity(f"link_{which}", link, range(BASE, joints), f"-1 (the base) and the links of body {body}")
    kind = p.getDynamicsInfo(body, BASE, client)[10]
    if kind != MULTIBODY:
        what = OTHER_BODY_TYPES.get(kind, f"of type {kind}")
        raise ValueError(f"body_{which} = {body}: {what}; must be a multibody, as createMultiBody and loadURDF give")
    if any(p.getJointInfo(body, joint, client)[2] == p.JOINT_PLANAR for joint in range(joints)):
        raise ValueError(f"body_{which} = {body}: has a planar joint, whose inertia cannot be read; others are allowed")
    shapes = collision_shapes(client, body, link)
    if not shapes:
        raise ValueError(f"body_{which} = {body}, link_{which} = {link}: has no collision shape to touch with")
    sides = [
        _side(client, body, link, SHAPE_NAMES.get(kind, f"shape of type {kind}"), size, np.array(at), rotation(turn))
        for _, _, kind, size, _, at, turn in shapes
    ]
    if len(sides) == 1:
        return sides[0]
    if all(side.size for side in sides):
        return Side(body, link, PIECES, (), np.zeros(3), np.eye(3), pieces=tuple(sides))
    return _side(client, body, link, "compound", (0.0, 0.0), np.zeros(3), np.eye(3))


def collision_shapes(client: int, body: int, link: int) -> Any:
    """Return the collision shapes of a link as PyBullet's `getCollisionShapeData` does, and height fields too.

    Those are missing there, but the shape to be drawn, which PyBullet makes of each, tells of them.
    """
    found = p.getCollisionShapeData(body, link, client)
    drawn = () if found else p.getVisualShapeData(body, physicsClientId=client)
    fields = [one[5:7] for one in drawn if one[1] == link and one[2] == p.GEOM_HEIGHTFIELD]
    return found or [(body, link, p.GEOM_HEIGHTFIELD, (0.0, 0.0, 0.0), b"", at, turn) for at, turn in fields]


def _side(client: int, body: int, link: int, name: str, size: Any, position: Array, turn: Array) -> Side:
    long = size[1], 0.5 * size[0]  # size is (length, radius), without a capsule's caps; full lengths for a box
    sizes = {"sphere": size[:1], "capsule": long, "cylinder": long, "box": tuple(0.5 * np.array(size))}
    if name in sizes:
        return Side(body, link, name, sizes[name], position, turn)
    if name == "plane":  # size is the normal, in the shape's frame
        normal = np.array(size)
        return Side(body, link, name, (), position, turn @ turn_to(normal / np.linalg.norm(normal)))
    if name == "mesh":
        count, points = p.getMeshData(body, link, physicsClientId=client)
        if count > 0:
            return Side(body, link, name, (), position, turn, 0.0, np.array(points))
        name = "concave mesh"
    centre = p.getBasePositionAndOrientation(body, client)[0] if link == BASE else p.getLinkState(body, link, 0, 1)[0]
    corners = np.array(p.getAABB(body, link, client))
    reach = float(np.linalg.norm(np.abs(corners - np.array(centre)).max(axis=0)))
    return Side(body, link, name, (), position, turn, reach)


def client_of(client: Any) -> int:
    """Return the id of a connected physics client, checked."""
    if not p.isConnected(checks.count("client", client, 0, 2**31 - 1)):  # PyBullet takes a C int
        raise ValueError(f"client = {client!r}: must be the id of a connected physics client")
    return int(client)


def identity(name: str, value: Any, allowed: Any, what: str) -> int:
    """Return one of PyBullet's ids, checked to be an allowed one; what: these are, for the message."""
    try:
        number = operator.index(value)
    except TypeError:
        number = None
    if number is None or isinstance(value, bool) or number not in allowed:
        raise ValueError(f"{name} = {value!r}: must be one of {what}, {list(allowed)}")
    return number


SERVED = (
    "the law serves spheres on any shape, and capsules, boxes, cylinders and meshes on planes, spheres and each other, "
    "alone or as pieces of a compound; let these two keep Bullet's own contact, or give them such shapes"
)


def check_served(a: Side, b: Side, free: bool) -> None:
    """Refuse two shapes that touch in more than one point, whatever radius they are given.

    Boxes and cylinders have round parts for flat shapes. For a measured face or edge only one point is known: the force
    there would turn the body over, as the contacts at its other corners are missing. free: whether a body of the two is
    free to turn in all directions; a free capsule strikes a measured shape with one end after the other, and only one
    of them is found in a step.

    Raises:
        ValueError: The law cannot serve them.
    """
    shapes = a.shape, b.shape
    if not (a.measured or b.measured) and shapes != ("plane", "plane"):
        return
    if "sphere" in shapes or ("capsule" in shapes and not free):
        return
    what = f"{a} ({a.shape}) and {b} ({b.shape})"
    if "capsule" in shapes:
        other = b if a.shape == "capsule" else a
        raise ValueError(
            f"{what}, one of them free: a capsule that tumbles touches a {other.shape} in more than one point; "
            f"{SERVED} (a capsule on other shapes if neither is a body of its own without joints)"
        )
    raise ValueError(f"{what} touch along a face or edge, not in one point; {SERVED}")


def check_radius(pair: ContactPair, a: Side, b: Side) -> None:
    """Refuse a shape without a radius of curvature where the pair gives no radius.

    Raises:
        ValueError: One of the shapes has none.
    """
    for name, side in (("a", a), ("b", b)):
        if pair.radius is None and side.measured:
            raise ValueError(
                f"radius = None: {side} (body_{name}) is a {side.shape}, without one radius of curvature; "
                f"give the pair an effective radius [m], or use a {WITH_RADIUS}"
            )


def can_move(client: int, body: int) -> bool:
    """Return whether a body has any coordinates: it is free, or has joints that let its links move."""
    joints = (p.getJointInfo(body, joint, client)[2] for joint in range(p.getNumJoints(body, client)))
    return p.getDynamicsInfo(body, BASE, client)[0] > 0.0 or any(kind in KINDS for kind in joints)


def rotation(quaternion: tuple[float, ...]) -> Array:
    """Return the rotation matrix, shape (3, 3), of a quaternion, scalar last."""
    return np.array(p.getMatrixFromQuaternion(quaternion)).reshape(3, 3)
