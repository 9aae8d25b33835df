"""Bodies with joints, and those that constraints join, as trees of a world; `tree_hooks` has what a step does there."""

import warnings
from collections.abc import Iterable, Iterator, Sequence
from math import isfinite
from typing import Any, NamedTuple

import numpy as np
import pybullet as p

from contactlaw.pair import ContactWarning
from contactlaw.pybullet_callback import tree_hooks
from contactlaw.pybullet_callback.shapes import BASE, KINDS, MULTIBODY, Key, can_move, joints_of, pose_of, turned
from contactlaw.world import World
from contactlaw.world.data.frames import CONJUGATE, IDENTITY, UNTURNED, Pose
from contactlaw.world.data.records import Array, Arrays
from contactlaw.world.data.tree import BALL
from contactlaw.world.trees.description import Joint, Part, records_of
from contactlaw.world.trees.motion import LARGEST_TURN, MOST

MOST_TURN = LARGEST_TURN * MOST  # [rad] or [m] in a step that the flight of a tree of the world can follow
LEAST_INERTIA = 1e-12  # [m^2], of moments of inertia over mass
UP = (0.0, 0.0, 1.0)
TOWED = 3  # steps in a row in which the user has moved a fixed base
TOWED_TEXT = (
    "body {} has joints and a fixed base that is moved in each step: contacts do not know its velocity, and throw what "
    "it strikes; give it a free base, and hold that by createConstraint"
)


class Member(NamedTuple):
    """A body of PyBullet in a tree.

    free: kind, and first index among coordinates and velocities of the tree, of the four joints of a free base; empty
    if it is fixed. links, joints: those that move, and their joints.
    """

    body: int
    free: list[tuple[int, int, int]]
    links: list[int]
    joints: list[tuple[int, int, int]]


class Tie(NamedTuple):
    """A constraint as PyBullet has it: id, kind, two links, a slide's axis, a place on each, ratio of a gear."""

    number: int
    kind: int
    links: tuple[Key, Key]
    axis: tuple[float, ...]
    places: tuple[Any, Any]
    ratio: float

    def force_left(self, client: int) -> float:
        """Return its greatest force [N] less that of the last step; 0 if it gave all."""
        most = p.getConstraintInfo(self.number, client)[10]
        left = most - max(map(abs, p.getConstraintState(self.number, client)))
        return left if left > tree_hooks.EXACT * most else 0.0


class Tree:
    """A body of PyBullet with joints, or several that constraints make one system, as a tree of a world.

    Args:
        client: Physics client id.
        bodies: Their ids.

    Attributes:
        bodies: The same, as a tuple.
        joints: Kind, and first index among coordinates and velocities of joints; of a free base of four.
        rows: Its `TreeRecords`.
        links: PyBullet's bodies and links that move, in their order.
        ties: Constraints between its bodies, or with what cannot move.
        heads: First link of each body of the tree (links connected by fixed joints are one body).
        numbers: Its arrays, by the names in `NUMBERS`.
        kept: Those of them that last from a step to the next.
    """

    def __init__(self, client: int, bodies: Sequence[int]) -> None:
        self._client, self.bodies = client, tuple(bodies)
        self._infos = {body: joints_of(body, client) for body in bodies}
        self.known = self.inertias()
        self.links, self.heads, parts = list[Key](), list[Key](), list[Part]()
        for body in bodies:
            self._add_parts(body, parts)
        self.rows = rows = records_of(parts)
        self.ties = [one for one in ties_of(client) if any(body in bodies for body, _ in one.links)]
        rows.couple([self._last_axes(one.links) for one in self.ties])
        self.q_size, self.v_size = rows.start.size, rows.axes.size
        self.joints: list[Any] = rows.joints[["kind", "first_q", "first_axis"]].tolist()
        joints = iter(self.joints)
        self._members = [self._member(body, joints) for body in bodies]
        sizes = {"q": self.q_size, "v": self.v_size, "t": len(self.ties)}
        shapes = [(name, "f8", tuple(sizes[one] for one in shape)) for name, shape in tree_hooks.NUMBERS.items()]
        self.numbers = own = np.zeros((), shapes)
        self.kept, self._own = own[list(tree_hooks.KEPT)], np.zeros(1, tree_hooks.OWN)
        for name in tree_hooks.NUMBERS:
            self._own[name] = own[name].ctypes.data
        self._block = self._own.ctypes.data
        own["left"], own["limit"] = np.nan, np.inf
        flat, fields = own.reshape(1).view(float), own.dtype.fields or {}
        start, after, end = (fields[name][1] // 8 for name in ("start_q", "after_q", "free_acceleration"))
        self._start, self._after = flat[start:after], flat[after:end]  # what is read before and after Bullet's step
        self.placed, self._towed, self._stands = False, 0, ()
        self._tie_rows = np.zeros(len(self.ties), tree_hooks.TIE)
        self._own["ties"], self._own["tie_count"] = self._tie_rows.ctypes.data, len(self.ties)
        for row, one in zip(self._tie_rows, self.ties, strict=True):
            self._write_tie(row, one)

    def _add_parts(self, body: int, parts: list[Part]) -> None:
        """Add a body of PyBullet to the parts of the tree, `links` and `heads`."""
        known, whole = self.known[body], len(self.bodies) > 1
        stands: dict[int, Pose] = {}  # pose of links fixed to the base in its inertial frame, or in the world
        if known[0][0] > 0.0:
            parts.append(Part(known[0][0], known[0][1], [Joint("free")]))
            self.links.append((body, BASE))
            self.heads.append((body, BASE))
        elif whole:
            stands = {BASE: pose_of(*p.getBasePositionAndOrientation(body, self._client))}
        for link, info in enumerate(self._infos[body]):
            own, parent, kind = known[link + 1], info.parent, KINDS.get(info.kind)
            at = pose_of(own[2], own[3]).inverse().place
            joint = pose_of(info.place, info.turn)
            joint = stands.get(parent, IDENTITY).then(Pose(joint.place, joint.turn * CONJUGATE))
            place = joint.then(Pose(-at, UNTURNED))
            carrier = self.links.index((body, parent)) if (body, parent) in self.links else -1
            if carrier < 0 and kind is None:
                stands[link] = place
                continue
            joints = [] if kind is None else [Joint(kind, at, UP if kind == "ball" else info.axis)]
            parts.append(Part(own[0], own[1], joints, carrier, *place))
            self.links.append((body, link))
            self.heads += [(body, link)] * len(joints)

    def _last_axes(self, links: Iterable[Key]) -> list[int]:
        """Return the number of the last axis that moves each of some links."""
        moved = [self.rows.links[self.place_of(key)[0]] for key in links if key in self.links]
        return [int(link["first_axis"] + link["axes"]) - 1 for link in moved]

    def _member(self, body: int, joints: Iterator[tuple[int, int, int]]) -> Member:
        free = [next(joints) for _ in range(4 if self.known[body][0][0] > 0.0 else 0)]
        links = [link for one, link in self.heads if one == body and link != BASE]
        return Member(body, free, links, [next(joints) for _ in links])

    def _write_tie(self, row: Any, tie: Tie) -> None:
        """Write a constraint for the tree's step."""
        row["bodies"] = -1
        for i, key in enumerate(tie.links):
            if key in self.links:
                member, pose = self.place_of(key)
                row["bodies"][i] = member
                row["at"][i] = pose.then(Pose(np.array(tie.places[i]), UNTURNED)).place
                row["geared"][i] = self.rows.links["first_axis"][member]
                if i == 0 and tie.kind == p.JOINT_PRISMATIC:
                    row["axis"] = pose.then(Pose(np.array(tie.axis), UNTURNED)).place - pose.place
        row["ratio"] = tie.ratio if tie.kind == p.JOINT_GEAR else 0.0
        row["points"], row["turns"] = tie.kind != p.JOINT_GEAR, tie.kind in (p.JOINT_FIXED, p.JOINT_PRISMATIC)

    def add_to(self, world: World) -> list[Key]:
        """Add its tree to a world, whose bodies get consecutive numbers; return body and link of each."""
        self.number, bodies = world.add_tree_of(self.rows)
        self.first = bodies[0]
        return self.heads

    def inertias(self) -> dict[int, list[tuple[Any, ...]]]:
        """Return mass, moments of inertia and inertial frame of all links, as PyBullet has them now."""
        out = dict[int, list[tuple[Any, ...]]]()
        for body, infos in self._infos.items():
            told = [p.getDynamicsInfo(body, link, self._client) for link in range(BASE, len(infos))]
            out[body] = [(one[0], [max(i, LEAST_INERTIA * one[0]) for i in one[2]], *one[3:5]) for one in told]
        return out

    def place_of(self, key: Key) -> tuple[int, Pose]:
        """Return the body of the tree that a link is part of, and the pose of the link's inertial frame in it."""
        i = self.links.index(key)
        return int(self.rows.row[i]), Pose(self.rows.at[i], self.rows.quaternion[i])

    def read(self) -> tuple[list[float], list[float], list[float]]:
        """Return coordinates and velocities as PyBullet has them, and torques of the joints' motors."""
        q, v, torques = list[float](), list[float](), list[float]()
        for body, free, links, joints in self._members:
            if free:
                x, turn = p.getBasePositionAndOrientation(body, self._client)
                velocity, spin = p.getBaseVelocity(body, self._client)
                a, b, c, w = turn
                q += (*x, w, a, b, c)
                v += (*velocity, *turned((-a, -b, -c, w), spin))
                torques += (0.0,) * 6
            for place, speed, _, torque in p.getJointStatesMultiDof(body, links, self._client) if links else ():
                q += place if len(place) == 1 else (place[3], *place[:3])
                v += speed
                torques += torque
            if not isfinite(sum(q) + sum(v)):
                hint = " (setJointMotorControl2 makes those of spherical joints so: use setJointMotorControlMultiDof)"
                spherical = any(kind == BALL for kind, _, _ in joints)
                raise ValueError(f"body {body}: positions or velocities are not finite{hint if spherical else ''}")
        return q, v, torques

    def write(self, q: Array, v: Array) -> None:
        """Set coordinates and velocities in PyBullet."""
        places, speeds = q.tolist(), v.tolist()
        for body, free, links, joints in self._members:
            if links:
                p.resetJointStatesMultiDof(
                    body, links,
                    [[*places[i + 1 : i + 4], places[i]] if kind == BALL else [places[i]] for kind, i, _ in joints],
                    [speeds[j : j + 3] if kind == BALL else [speeds[j]] for kind, _, j in joints], self._client,
                )  # fmt: skip
            if free:
                _, i, j = free[0]
                x, y, z, w, *turn = places[i : i + 7]
                p.resetBasePositionAndOrientation(body, (x, y, z), (*turn, w), self._client)
                spin = turned((*turn, w), speeds[j + 3 : j + 6])
                p.resetBaseVelocity(body, speeds[j : j + 3], spin, self._client)

    def bind(self, world: Arrays) -> None:
        """Find its numbers in the arrays of a world, before each step for which they are others."""
        self._tree, self._world_block = world.trees[self.number], world.world.ctypes.data
        self._own["tree"] = world.trees.ctypes.data + self.number * world.trees.itemsize

    def begin_step(self) -> bool:
        """Read the state at the start of a step; return whether the user has moved it since the last one."""
        q, v, _ = self.read()
        self._start[:] = q + v
        if not self._members[0].free and len(self._members) == 1:
            stands = p.getBasePositionAndOrientation(self.bodies[0], self._client)
            self._towed = self._towed + 1 if stands != self._stands else 0
            self._tree["base"], (x, y, z, w) = self._stands = stands
            self._tree["base_turn"] = w, x, y, z
            if self._towed == TOWED:
                warnings.warn(TOWED_TEXT.format(self.bodies[0]), ContactWarning, stacklevel=6)
        self.placed = tree_hooks.take_start(self._block)
        return self.placed

    def read_forces(self, dt: float) -> None:
        """After Bullet's step: find the forces on the joints within it."""
        q, v, torques = self.read()
        if (turn := dt * max(map(abs, v))) > MOST_TURN:
            raise ValueError(
                f"body {self.bodies[0]}: PyBullet's step has brought it to {turn:.3g} rad or m a step: shorten the "
                "step; or its joints have more damping than Bullet is stable with (changeDynamics: jointDamping)"
            )
        self._after[:] = q + v + torques
        if self.ties:
            self.numbers["left_over"][:] = [one.force_left(self._client) for one in self.ties]
        tree_hooks.take_response(self._block, dt)

    def write_back(self, dt: float) -> None:
        """Write the tree to PyBullet after the world's step, if a contact has touched it, or see `near.passing`."""
        if tree_hooks.find_end(self._block, self._world_block, dt):
            self.write(self.numbers["new_q"], self.numbers["new_v"])

    def apply_push(self) -> None:
        """Apply the push of the last step's contacts again: on joints, and on a free base."""
        push, q = (self.numbers[name].tolist() for name in ("push", "start_q"))
        for body, free, links, joints in self._members if any(push) else ():
            if links:
                p.setJointMotorControlMultiDofArray(
                    body, links, p.TORQUE_CONTROL, physicsClientId=self._client,
                    forces=[push[k : k + 3] if kind == BALL else [push[k]] for kind, _, k in joints],
                )  # fmt: skip
            if free:
                _, i, k = free[0]
                x, y, z, w, *turn = q[i : i + 7]
                p.applyExternalForce(body, BASE, push[k : k + 3], (x, y, z), p.WORLD_FRAME, self._client)
                couple = turned((*turn, w), push[k + 3 : k + 6])
                p.applyExternalTorque(body, BASE, couple, p.WORLD_FRAME, self._client)


def numbers_of(client: int) -> list[int]:
    """Return the ids of all constraints; those of new ones are new."""
    return [p.getConstraintUniqueId(k, client) for k in range(p.getNumConstraints(client))]


def ties_of(client: int) -> list[Tie]:
    """Return all constraints."""
    infos: list[Any] = [(number, p.getConstraintInfo(number, client)) for number in numbers_of(client)]
    return [Tie(number, one[4], (one[:2], one[2:4]), one[5], one[6:8], one[11]) for number, one in infos]


def tied(client: int) -> Iterator[set[int]]:
    """Yield the bodies that each constraint joins, but for those that cannot move."""
    for one in ties_of(client):
        bodies = {body for body, _ in one.links if body >= 0}
        yield {b for b in bodies if p.getDynamicsInfo(b, BASE, client)[10] == MULTIBODY and can_move(client, b)}
