"""Bodies with joints: a kinematic tree of the world for each, read from PyBullet and written back.

As for free bodies (`rows`), Bullet's velocity belongs to half a step before its position: v + dt/2 a is read, and
written back likewise, except where a contact is closed. With M(q) a + c(q, v) = f, the force on the joints besides
gravity and contacts is f = M (a - a0), where a0 is the acceleration of the model alone and a that of Bullet: of the
step that Bullet has taken, or, before it steps, of the last one. If contacts change the velocities by u dt, they are
applied as the generalised force M u: for a joint a couple, or a pair of forces, on the two bodies that it connects, for
a free base a force and a couple.

A motor of PyBullet is a constraint: it keeps the speed of its joint with up to its greatest force. In a contact within
a step such a joint is given an armature that is heavy against what it carries. (A constant force instead would come a
step late and shake a robot off its feet.) Which joints are held is read from their response to the push in Bullet's own
step. A joint that its motor's torque hardly moves is held too, pushed or not, so that a foot that is just lifted is as
heavy when it lands. A motor at its limit gives a constant force and holds nothing. PyBullet does not tell the limit: a
motor has reached it if its torque is the same in two steps while it accelerates its joint. The armature of a joint that
moves is at most such that its momentum is what the motor can give in a step with the greatest torque that it has had:
else a finger would press what it meets with many times the force of its motor.
"""

from collections.abc import Sequence
from math import isfinite
from typing import Any

import numpy as np
import pybullet as p

from contactlaw.pybullet_callback.jointed import (
    KEPT,
    NUMBERS,
    OWN,
    find_end,
    set_at_start,
    spread_push,
    take_response,
    take_start,
)
from contactlaw.pybullet_callback.shapes import BASE, KINDS, Key, joints_of, pose_of
from contactlaw.world import World
from contactlaw.world.data.frames import CONJUGATE, IDENTITY, UNTURNED, Pose
from contactlaw.world.data.records import BALL, SLIDE, Array, Arrays
from contactlaw.world.trees.description import Joint, Part, records_of
from contactlaw.world.trees.motion import LARGEST_TURN, MOST
from contactlaw.world.trees.tree_records import numbers

MOST_TURN = LARGEST_TURN * MOST  # [rad] or [m] in a step that the flight of a tree of the world can follow
LEAST_INERTIA = 1e-12  # [m^2], of moments of inertia over mass
UP = (0.0, 0.0, 1.0)


def turned(turn: Sequence[float], a: Sequence[float], inverse: bool = False) -> tuple[float, float, float]:
    """Return a vector rotated by a quaternion, scalar last, or by its inverse."""
    u, v, w = a
    xx, xy, xz, yx, yy, yz, zx, zy, zz = p.getMatrixFromQuaternion(turn)
    if inverse:
        xy, xz, yx, yz, zx, zy = yx, zx, xy, zy, xz, yz
    return xx * u + xy * v + xz * w, yx * u + yy * v + yz * w, zx * u + zy * v + zz * w


def _part(inertias: tuple[Any, ...], *more: Any) -> Part:
    """Return a link from what `Tree.inertias` says of it."""
    mass, moments, *_ = inertias
    return Part(mass, np.maximum(moments, LEAST_INERTIA * mass), *more)


class Tree:
    """A body of PyBullet with joints, as a tree of a world.

    Attributes:
        joints: Kind, and first index among coordinates and velocities of joints; of a free base of four.
        rows: Its `TreeRecords`.
        links: PyBullet's links that move, in their order.
        heads: First link of each body of the tree (links connected by fixed joints are one body).
    """

    def __init__(self, client: int, body: int) -> None:
        self._client, self.body = client, body
        all_joints = joints_of(body, client)
        self._all = range(BASE, len(all_joints))
        self.known = self.inertias()
        self.free = self.known[0][0] > 0.0
        self.links, self.heads = [BASE] * self.free, [BASE] * self.free
        parts = [_part(self.known[0], [Joint("free")])] * self.free
        stands: dict[int, Pose] = {}  # pose in the base's inertial frame of links fixed to it
        for link, info in enumerate(all_joints):
            own, parent, kind = self.known[link + 1], info.parent, KINDS.get(info.kind)
            at = pose_of(own[2], own[3]).inverse().place
            joint = pose_of(info.place, info.turn)
            joint = stands.get(parent, IDENTITY).then(Pose(joint.place, joint.turn * CONJUGATE))
            place = joint.then(Pose(-at, UNTURNED))
            carrier = self.links.index(parent) if parent in self.links else -1
            if carrier < 0 and kind is None:
                stands[link] = place
                continue
            joints = [] if kind is None else [Joint(kind, at, UP if kind == "ball" else info.axis)]
            parts.append(_part(own, joints, carrier, *place))
            self.links.append(link)
            self.heads += [link] * len(joints)
        self.rows = records_of(parts)
        self.q_size, self.v_size = self.rows.start.size, self.rows.axes.size
        self.joints = self.rows.joints[["kind", "first_q", "first_axis"]].tolist()
        self._joint_links, self._kinds = self.heads[self.free :], self.joints[4 * self.free :]
        motors = sum(kind != BALL for kind, _, _ in self._kinds)
        sizes = {"q": self.q_size, "v": self.v_size, "m": motors, "n": self.rows.links.size, "3": 3}
        own = {name: np.zeros([sizes[one] for one in shape]) for name, shape in NUMBERS.items()}
        self._own: Any = np.zeros(1, OWN)
        for name, values in own.items():
            self._own[name] = values.ctypes.data
        self._block = self._own.ctypes.data
        self._kept, self._numbers = {name: own[name] for name in KEPT}, own
        self.left, self.force, self.push, _, limit, _ = self._kept.values()
        self.left[:], limit[:] = np.nan, np.inf
        self.free_acceleration, self.matrix = own["free_acceleration"], own["matrix"]
        self.start = self.left, np.zeros(self.v_size)  # coordinates and velocities at the start of the step
        self.placed = self.pressed = False
        before = self.rows.links["parent"].tolist()
        owners = np.repeat(np.arange(len(before)), self.rows.links["axes"]).tolist()
        self._translations = [(k, owners[k], before[owners[k]]) for kind, _, k in self.joints if kind == SLIDE]

    def add_to(self, world: World) -> list[Key]:
        """Add its tree to a world, whose bodies get consecutive numbers; return body and link of each."""
        self.number, bodies = world.add_tree_of(self.rows)
        self.first, self.members = bodies[0], slice(bodies[0], bodies[0] + len(self.heads))
        return [(self.body, link) for link in self.heads]

    def save(self) -> tuple[dict[str, Array], bool]:
        """Return a copy of what lasts from a step to the next."""
        return {name: values.copy() for name, values in self._kept.items()}, self.pressed

    def restore(self, kept: dict[str, Array], pressed: bool) -> None:
        """Set what `save` returned."""
        for name, values in kept.items():
            self._kept[name][:] = values
        self.pressed = pressed

    def inertias(self) -> list[tuple[Any, ...]]:
        """Return mass, moments of inertia and inertial frame of all links, as PyBullet has them now."""
        dynamics = (p.getDynamicsInfo(self.body, link, self._client) for link in self._all)
        return [(one[0], *one[2:5]) for one in dynamics]

    def place_of(self, link: int) -> tuple[int, Pose]:
        """Return the body of the tree that a link is part of, and the pose of the link's inertial frame in it."""
        i = self.links.index(link)
        return int(self.rows.row[i]), Pose(self.rows.at[i], self.rows.quaternion[i])

    def read(self) -> tuple[Array, Array]:
        """Return coordinates and velocities as PyBullet has them; read `torque` of the motors of hinges and slides."""
        q: list[float] = []
        v: list[float] = []
        if self.free:
            x, turn = p.getBasePositionAndOrientation(self.body, self._client)
            velocity, spin = p.getBaseVelocity(self.body, self._client)
            q, v = [*x, turn[3], *turn[:3]], [*velocity, *turned(turn, spin, inverse=True)]
        if self._joint_links:
            torques = []
            for place, speed, _, torque in p.getJointStatesMultiDof(self.body, self._joint_links, self._client):
                if len(place) == 1:
                    q.append(place[0])
                    torques.append(torque[0])
                else:
                    q += (place[3], *place[:3])
                v += speed
            self._numbers["torque"][:] = torques
        if not isfinite(sum(q) + sum(v)):
            raise ValueError(f"body {self.body}: its joints' positions or velocities are not finite")
        return np.array(q), np.array(v)

    def write(self, q: Array, v: Array) -> None:
        """Set coordinates and velocities in PyBullet."""
        if self._joint_links:
            places, speeds = q.tolist(), v.tolist()
            p.resetJointStatesMultiDof(
                self.body, self._joint_links,
                [[*places[i + 1 : i + 4], places[i]] if kind == BALL else [places[i]] for kind, i, _ in self._kinds],
                [speeds[j : j + 3] if kind == BALL else [speeds[j]] for kind, _, j in self._kinds], self._client,
            )  # fmt: skip
        if self.free:
            x, y, z, w, *turn = q[:7].tolist()
            turn.append(w)
            p.resetBasePositionAndOrientation(self.body, (x, y, z), turn, self._client)
            p.resetBaseVelocity(self.body, v[:3].tolist(), turned(turn, v[3:6].tolist()), self._client)

    def bind(self, world: Arrays) -> None:
        """Find its numbers in the arrays of a world, before each step for which they are others."""
        self._q = numbers(world, self.number, "q")
        self._centres = world.bodies["position"][self.first + 1 :][: self.rows.links.size]
        self._tree, self._world_block = world.trees[self.number], world.world.ctypes.data
        self._own["tree"] = world.trees.ctypes.data + self.number * world.trees.itemsize

    def begin_step(self, gravity: Array) -> None:
        """Take the state at the start of a step, and see whether the user has moved it since the last one."""
        self._numbers["start_q"][:], self._numbers["start_v"][:] = self.start
        self.placed = take_start(self._block)
        self.pressed = self.pressed and not self.placed
        self._tree["gravity"] = gravity
        if not self.free:
            self._tree["base"], (x, y, z, w) = p.getBasePositionAndOrientation(self.body, self._client)
            self._tree["base_turn"] = w, x, y, z

    def set_tree(self, dt: float) -> None:
        """Set the world's tree at the start of the step, with `force` and the velocity at the time of the position."""
        set_at_start(self._block, 0.0 if self.pressed else 0.5 * dt)

    def read_forces(self, dt: float) -> None:
        """After Bullet's step: find the forces on the joints within it."""
        q, v = self.read()
        if (turn := dt * np.abs(v).max()) > MOST_TURN:
            raise ValueError(
                f"body {self.body}: PyBullet's step has brought it to {turn:.3g} rad or m a step; its joints may have "
                "more damping than Bullet is stable with (changeDynamics: jointDamping)"
            )
        self._numbers["after_q"][:], self._numbers["after_v"][:] = q, v
        take_response(self._block, dt, 0.0 if self.pressed else 0.5 * dt)

    def write_back(self, dt: float, pressed: bool) -> None:
        """Write the tree to PyBullet after the world's step, if a contact has touched it, or see `near.following`."""
        self.pressed = pressed
        if find_end(self._block, self._world_block, dt, pressed):
            self.write(self._numbers["new_q"], self._numbers["new_v"])

    def apply_push(self) -> None:
        """Apply the push of the last step's contacts again, if one is closed, at the present pose of the world's tree.

        It consists of forces and torques on links.
        """
        if not self.pressed:
            self.push[:] = 0.0
        if not spread_push(self._block):
            return
        forces, centres = self._numbers["forces"].tolist(), self._centres.tolist()
        for k, owner, parent in self._translations:
            # on a free base at its own frame, about which spin is reckoned; fixed links shift the centre of mass
            place = self._q[:3].tolist() if self.free and owner == 0 else centres[owner]
            for member, sign in ((owner, 1.0), (parent, -1.0)):
                if member >= 0:
                    x, y, z = forces[k]
                    push = sign * x, sign * y, sign * z
                    p.applyExternalForce(self.body, self.heads[member], push, place, p.WORLD_FRAME, self._client)
        for link, moment in zip(self.heads, self._numbers["moments"].tolist(), strict=True):
            p.applyExternalTorque(self.body, link, moment, p.WORLD_FRAME, self._client)
