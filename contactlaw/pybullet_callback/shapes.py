"""Bodies and shapes read from PyBullet: ids are checked, and shapes become shapes of the world."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import pybullet as p

from contactlaw import checks
from contactlaw.pair import ContactPair
from contactlaw.world.data.frames import IDENTITY, ORIGIN, Pose, quaternion_of, turn_to
from contactlaw.world.data.records import Array, Arrays
from contactlaw.world.shapes.hulls import apart

Key = tuple[int, int]

BASE = -1
DEFAULT_MARGIN = 0.04  # [m], CONVEX_DISTANCE_MARGIN of Bullet's btCollisionMargin.h
MULTIBODY = 2  # body type in the result of getDynamicsInfo
OTHER_BODY_TYPES = {
    0: "without a body type", 1: "made with useMaximalCoordinates, whose mass cannot be read", 3: "a soft body",
}  # fmt: skip

KINDS = {p.JOINT_REVOLUTE: "hinge", p.JOINT_PRISMATIC: "slide", p.JOINT_SPHERICAL: "ball"}
SHAPE_NAMES = {
    p.GEOM_SPHERE: "sphere", p.GEOM_BOX: "box", p.GEOM_CYLINDER: "cylinder", p.GEOM_MESH: "mesh",
    p.GEOM_PLANE: "plane", p.GEOM_CAPSULE: "capsule", p.GEOM_HEIGHTFIELD: "heightfield",
}  # fmt: skip


class JointInfo(NamedTuple):
    """A link's joint: its place in the parent's inertial frame [m], and the turn of that frame in the joint's."""

    kind: int
    link: str
    axis: tuple[float, ...]
    place: tuple[float, ...]
    turn: tuple[float, ...]
    parent: int


class Piece(NamedTuple):
    """A shape with a closed form: what `World.add_shape` needs of it, in the inertial frame of its body or link.

    A plane's normal is its third axis. points: vertices [m], shape (n, 3), of a mesh, which stands for its convex hull.
    """

    kind: str
    sizes: tuple[float, ...]
    pose: Pose
    points: Array | None = None


@dataclass(frozen=True, eq=False)
class Side:
    """One of the two bodies of a contact: a base (link -1) or a link, and its shape."""

    body: int
    link: int
    name: str  # of the link; empty for a base
    parent: Key | None  # what carries the link, which Bullet lets overlap with it at their joint; None for a base
    shape: str  # "sphere", "box", ...; "compound" if the link has several shapes and some have no closed form
    pieces: tuple[Piece, ...] = ()  # its shapes if they have a closed form; else PyBullet must find its nearest point
    reach: float = 0.0  # greatest distance [m] of a measured shape from the centre of mass

    @property
    def measured(self) -> bool:
        """Whether PyBullet must find its nearest point."""
        return not self.pieces

    @property
    def key(self) -> Key:
        """Body and link."""
        return self.body, self.link

    def __str__(self) -> str:
        return name_of(self.key) + (f" ({self.name!r})" if self.name else "")


def name_of(key: Key) -> str:
    """Return the name of a body or link in messages."""
    return f"body {key[0]}" if key[1] == BASE else f"body {key[0]} link {key[1]}"


def engine_parameters(client: int) -> dict[str, Any]:
    """Return PyBullet's parameters of the next step; ValueError if it has substeps."""
    parameters = p.getPhysicsEngineParameters(client)
    if parameters["numSubSteps"] > 1:
        raise ValueError(
            f"numSubSteps = {parameters['numSubSteps']}: must be 0 or 1, as a force stays the same over the substeps; "
            "shorten the step with setTimeStep instead"
        )
    return parameters


def read_sides(client: int, which: str, bodies: Any, link: Any) -> list[Side]:
    """Return the sides of one set: a body, or several, as id or (body, link); link: of bodies given as an id."""
    there, sides = bodies_of(client), dict[Key, Side]()
    two = isinstance(bodies, tuple) and len(bodies) == 2 and all(checks.whole(one) in there for one in bodies)
    if two and bodies[1] < p.getNumJoints(bodies[0], client):
        raise ValueError(f"body_{which} = {bodies!r}: two bodies, or a body's link? Write {[*bodies]} or {[bodies]}")
    for entry in bodies if holds(bodies) else [(bodies, link)]:
        members = list(entry) if holds(entry) else [entry, link]
        if len(members) != 2:
            raise ValueError(f"body_{which}: holds {entry!r}; each must be a body or (body, link)")
        side = read_side(client, which, members[0], members[1], there)
        sides[side.key] = side
    if not sides:
        raise ValueError(f"body_{which} = {bodies!r}: holds no bodies; must hold one or more")
    return list(sides.values())


def bodies_of(client: int) -> set[int]:
    """Return the ids of all bodies of a client."""
    return {p.getBodyUniqueId(i, client) for i in range(p.getNumBodies(client))}


def holds(value: Any) -> bool:
    """Return whether a value holds several bodies, or numbers of one."""
    return np.iterable(value) and not isinstance(value, str | bytes)


def read_side(client: int, which: str, body: Any, link: Any, there: set[int]) -> Side:
    """Check the ids of one side and read its shape; there: ids of all bodies."""
    if checks.whole(body) not in there:  # of a batch (batchPositions) the client knows the last body alone
        p.syncBodyInfo(client)
        there |= bodies_of(client)
    # checked first: PyBullet's getDynamicsInfo of a link that does not exist ends the process
    body = identity(f"body_{which}", body, there, "the bodies of this client")
    joints = joints_of(body, client)
    link = identity(f"link_{which}", link, range(BASE, len(joints)), f"-1 (the base) and the links of body {body}")
    kind = p.getDynamicsInfo(body, BASE, client)[10]
    if kind != MULTIBODY:
        what = OTHER_BODY_TYPES.get(kind, f"of type {kind}")
        raise ValueError(f"body_{which} = {body}: {what}; must be a multibody, as createMultiBody and loadURDF give")
    if any(joint.kind == p.JOINT_PLANAR for joint in joints):
        raise ValueError(f"body_{which} = {body}: has a planar joint, whose inertia cannot be read; others are allowed")
    if name := massless(client, body):
        raise ValueError(f"body_{which} = {body}: its link {name!r} has a joint and no mass; give it one")
    shapes = collision_shapes(client, body, link)
    if not shapes:
        raise ValueError(f"body_{which} = {body}, link_{which} = {link}: has no collision shape to touch with")
    own = (body, link, "", None) if link == BASE else (body, link, joints[link].link, (body, joints[link].parent))
    kinds = [SHAPE_NAMES.get(kind, f"shape of type {kind}") for _, _, kind, *_ in shapes]
    numbers = range(len(kinds)) if len(kinds) > 1 else [BASE]
    found = [
        _piece((body, link), client, number, kind, *more)
        for number, kind, (_, _, _, *more) in zip(numbers, kinds, shapes, strict=True)
    ]
    pieces = tuple(piece for piece in found if piece and (piece.kind != "plane" or len(kinds) == 1))
    points = sum(len(piece.points) for piece in pieces if piece.points is not None)
    all_points = p.getMeshData(body, link, physicsClientId=client)[0] if points else 0
    # more than those of the pieces where one of several meshes is a compound itself
    if points == all_points and len(pieces) == len(shapes):
        return Side(*own, kinds[0] if len(kinds) == 1 else "compound of such", pieces)
    shape = "compound" if len(kinds) > 1 else "concave or flat mesh" if kinds[0] == "mesh" else kinds[0]
    base = link == BASE
    centre, *_ = p.getBasePositionAndOrientation(body, client) if base else p.getLinkState(body, link, 0, 1, client)
    corners = np.abs(np.subtract(p.getAABB(body, link, client), centre))
    return Side(*own, shape, (), float(np.linalg.norm(corners.max(axis=0))))


def massless(client: int, body: int) -> str:
    """Return the name of the first link that a joint moves without any mass, of its own or fixed to it; or "" """
    joints, carriers = joints_of(body, client), [BASE]  # of each link, the one that it is fixed to or is; base first
    for link, joint in enumerate(joints):
        carriers.append(link if joint.kind in KINDS else carriers[joint.parent + 1])
    heavy = {one for link, one in enumerate(carriers, BASE) if p.getDynamicsInfo(body, link, client)[0] > 0.0}
    return next((joints[one].link for one in carriers if one != BASE and one not in heavy), "")


def collision_shapes(client: int, body: int, link: int) -> Any:
    """Return the collision shapes of a link as PyBullet's `getCollisionShapeData` does, and height fields too.

    Those are missing there, but the shape to be drawn, which PyBullet makes of each, tells of them.

    Raises:
        ValueError: A capsule that `loadMJCF` has made between two points (`fromto`): `getCollisionShapeData` would end
            the process. Its margin is not its radius, as that of a capsule is, but Bullet's default one, or zero in a
            compound, which only names that `loadMJCF` gives to joints tell from others.
    """
    drawn = [one for one in p.getVisualShapeData(body, physicsClientId=client) if one[1] == link]
    radii = {one[3][1] for one in drawn if one[2] == p.GEOM_CAPSULE and (*one[5], *one[6]) == (0, 0, 0, 0, 0, 0, 1)}
    if radii:
        margin = p.getDynamicsInfo(body, link, client)[11]
        by_mjcf = any(
            p.getJointInfo(body, k, client)[1][:9] == b"jointfix_" for k in range(p.getNumJoints(body, client))
        )
        if margin in (0.0, DEFAULT_MARGIN) and (by_mjcf or 0.0 != margin not in radii):
            raise ValueError(
                f"{name_of((body, link))}: has a capsule that loadMJCF made by fromto, which PyBullet does not tell; "
                "load a URDF instead"
            )
    found = p.getCollisionShapeData(body, link, client)
    fields = [one[5:7] for one in drawn if not found and one[2] == p.GEOM_HEIGHTFIELD]
    return found or [(body, link, p.GEOM_HEIGHTFIELD, (0.0, 0.0, 0.0), b"", at, turn) for at, turn in fields]


def _piece(key: Key, client: int, number: int, kind: str, size: Any, _: Any, position: Any, turn: Any) -> Piece | None:
    """Return a shape as getCollisionShapeData describes it; None: it has no closed form, as a mesh all in a plane.

    number: of a mesh among the shapes of its link; -1: all there is.
    """
    long = size[1], 0.5 * size[0]  # size is (length, radius), without a capsule's caps; full lengths for a box
    sizes = {"sphere": size[:1], "capsule": long, "cylinder": long, "box": tuple(0.5 * np.array(size))}
    if kind in sizes:
        return Piece(kind, sizes[kind], pose_of(position, turn))
    if kind == "plane":  # size is the normal, in the shape's frame
        normal = np.array(size)
        upright = Pose(ORIGIN, quaternion_of(turn_to(normal / np.linalg.norm(normal))))
        return Piece(kind, (), pose_of(position, turn).then(upright))
    count, points = p.getMeshData(*key, number, physicsClientId=client) if kind == "mesh" else (0, ())
    return Piece(kind, (), IDENTITY, np.array(points)) if count > 0 and apart(np.array(points)) else None


def client_of(client: Any) -> int:
    """Return the id of a connected physics client, checked."""
    if not p.isConnected(checks.count("client", client, 0, 2**31 - 1)):  # PyBullet takes a C int
        raise ValueError(f"client = {client!r}: must be the id of a connected physics client")
    return int(client)


def identity(name: str, value: Any, allowed: Any, what: str) -> int:
    """Return one of PyBullet's ids, checked to be an allowed one; what: these are, for the message."""
    number = checks.whole(value)
    if number is None or number not in allowed:
        raise ValueError(f"{name} = {value!r}: must be one of {what}, {sorted(allowed)}")
    return number


SERVED = (
    "the law serves spheres on any shape, and capsules, boxes, cylinders and meshes on planes, spheres and each other, "
    "alone or as pieces of a compound; let these two keep Bullet's own contact, or give them such shapes"
)


def check_served(pair: ContactPair, a: Side, b: Side, free: bool) -> None:
    """Refuse two shapes that touch in more than one point, and a measured shape if the pair gives no radius.

    Boxes and cylinders have round parts for flat shapes. For a measured face or edge only one point is known: the force
    there would turn the body over, as the contacts at its other corners are missing. free: whether a body of the two is
    free to turn in all directions; a free capsule strikes a measured shape with one end after the other, and only one
    of them is found in a step.
    """
    shapes, what = (a.shape, b.shape), f"{a} ({a.shape}) and {b} ({b.shape})"
    if shapes == ("plane", "plane") or ((a.measured or b.measured) and not {"sphere", "capsule"} & set(shapes)):
        raise ValueError(f"{what} touch along a face or edge, not in one point; {SERVED}")
    for name, side in (("a", a), ("b", b)):
        if side.measured and free and "sphere" not in shapes:
            raise ValueError(
                f"{what}, one of them free: a capsule that tumbles touches a {side.shape} in more than one point; "
                f"{SERVED} (a capsule on other shapes if neither is a body of its own without joints)"
            )
        if side.measured and pair.radius is None:
            raise ValueError(
                f"radius = None: {side} (body_{name}) is a {side.shape}, without one radius of curvature; "
                "give the pair an effective radius [m], or use a sphere, capsule, plane, box, cylinder"
            )


def can_move(client: int, body: int) -> bool:
    """Return whether a body has any coordinates: it is free, or has joints that let its links move."""
    return p.getDynamicsInfo(body, BASE, client)[0] > 0.0 or any(one.kind in KINDS for one in joints_of(body, client))


def joints_of(body: int, client: int) -> list[JointInfo]:
    """Return the joints of a body, by link."""
    infos = (p.getJointInfo(body, link, client) for link in range(p.getNumJoints(body, client)))
    return [JointInfo(info[2], info[12].decode(errors="replace"), *info[13:17]) for info in infos]


def pose_of(position: tuple[float, ...], quaternion: tuple[float, ...]) -> Pose:
    """Return a pose from PyBullet's position and quaternion, scalar last."""
    return Pose(np.array(position), np.array([quaternion[3], *quaternion[:3]]))


def turned(turn: Sequence[float], a: Sequence[float]) -> tuple[float, float, float]:
    """Return a vector rotated by a quaternion, scalar last; PyBullet's own `rotateVector` has single precision."""
    u, v, w = a
    xx, xy, xz, yx, yy, yz, zx, zy, zz = p.getMatrixFromQuaternion(turn)
    return xx * u + xy * v + xz * w, yx * u + yy * v + yz * w, zx * u + zy * v + zz * w


FAR = -1e6  # [m], offset along the normal of a plane that nothing touches
STEPS = 3.0  # search distance in steps of the present motion


@dataclass(frozen=True)
class Measured:
    """A sphere or a capsule, and a shape whose distance PyBullet must measure; the rows of their bodies."""

    one: Side
    other: Side
    row_one: int
    row_other: int
    ends: list[int]  # shapes of the world: the sphere, or the ends of the capsule
    planes: list[int]  # shapes of the world: a tangent plane of the measured shape for each of `ends`

    def place(self, client: int, world: Arrays, dt: float) -> None:
        """Place the tangent plane at the nearest point for a step dt [s]; other planes go out of reach."""
        a, b = world.bodies[self.row_one + 1], world.bodies[self.row_other + 1]
        planes = world.shapes[self.planes]
        planes["at"], planes["normal"] = (0.0, 0.0, FAR), (0.0, 0.0, 1.0)
        speed = sum(np.linalg.norm(one["velocity"]) + dt * np.linalg.norm(one["acceleration"]) for one in (a, b))
        turning = np.linalg.norm(b["spin"]) * self.other.reach + np.linalg.norm(a["spin"]) * a["reach"]
        one, other, reach = self.one, self.other, STEPS * dt * float(speed + turning) + 1e-6
        points = p.getClosestPoints(one.body, other.body, reach, one.link, other.link, physicsClientId=client)
        if points:
            # of a point: where it is on both, the normal from the second to the first, and the distance
            on_one, on_other, normal, _ = min((point[5:9] for point in points), key=lambda one: one[3])
            axes = b["axes"].reshape(3, 3)
            ends = a["position"] + world.shapes["at"][self.ends] @ a["axes"].reshape(3, 3).T
            nearest = int(np.argmin(np.linalg.norm(ends - on_one, axis=1)))
            planes["at"][nearest] = (on_other - b["position"]) @ axes
            planes["normal"][nearest] = np.array(normal) @ axes
        world.shapes[self.planes] = planes
