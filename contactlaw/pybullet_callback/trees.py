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

from math import isfinite
from typing import Any

import numpy as np
import pybullet as p

from contactlaw.pybullet_callback.shapes import BASE, KINDS, Key, joints_of, pose_of, rotation
from contactlaw.world import World
from contactlaw.world.data.frames import CONJUGATE, IDENTITY, UNTURNED, Pose
from contactlaw.world.data.records import AXIS, BALL, FREE_JOINT, HINGE, SLIDE, Array, Arrays
from contactlaw.world.near.following import overlaps
from contactlaw.world.trees.coordinates import carriers, matrix_of_factor, numbers, settle
from contactlaw.world.trees.description import Joint, Part, records_of

LEAST_INERTIA = 1e-12  # [m^2], of moments of inertia over mass
EXACT = 1e-9  # relative difference of a coordinate that counts as rounding
TRANSLATIONS = {FREE_JOINT: 3, SLIDE: 1}  # number of translational axes of a joint, its first ones
CARRIES = 0.01  # a motor holds its joint if less than this share of its torque accelerates the inertia that it carries
HELD = 1e3  # armature of a joint that a motor holds, over the inertia that it carries
UP = (0.0, 0.0, 1.0)


def axes_of(quaternion: Array) -> Array:
    """Return the rotation matrix (3, 3) of a quaternion, scalar first; faster by PyBullet than `frames.matrix_of`."""
    w, x, y, z = quaternion.tolist()
    return rotation((x, y, z, w))


def _part(inertias: tuple[Any, ...], *more: Any) -> Part:
    """Return a link from what `Tree.inertias` says of it."""
    mass, moments, *_ = inertias
    return Part(mass, np.maximum(moments, LEAST_INERTIA * mass), *more)


class Tree:
    """A body of PyBullet with joints, as a tree of a world.

    Attributes:
        joints: Kind, and first index among coordinates and velocities of each joint, that of a free base included.
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
        self._joint_links, self._kinds = self.heads[self.free :], self.joints[self.free :]
        self._scalars = [first for kind, _, first in self.joints if kind in (HINGE, SLIDE)]
        self._turns = [first + 3 * (kind == FREE_JOINT) for kind, first, _ in self.joints if kind in (FREE_JOINT, BALL)]
        self.left = np.full(self.q_size, np.nan)  # coordinates as the last step left them
        self.start = self.left, np.zeros(self.v_size)  # coordinates and velocities at the start of the step
        self.force, self.push = np.zeros((2, self.v_size))
        self.torque, self.last_torque, self.strongest = np.zeros((3, len(self._scalars)))
        self.limit = np.full_like(self.torque, np.inf)
        self.placed = self.pressed = False
        self._joints: Array | None = None
        links, before = self.rows.links, self.rows.links["parent"].tolist()
        owners = np.repeat(np.arange(links.size), links["axes"]).tolist()
        straight = [k for kind, _, first in self.joints for k in range(first, first + TRANSLATIONS.get(kind, 0))]
        self._translations = [(k, owners[k], before[owners[k]]) for k in straight]
        self._rotations = np.zeros((links.size, self.v_size))  # sign with which the moment about an axis acts on a body
        for k in set(range(self.v_size)) - set(straight):
            self._rotations[owners[k], k] = 1.0
            if before[owners[k]] >= 0:
                self._rotations[before[owners[k]], k] = -1.0

    def add_to(self, world: World) -> list[Key]:
        """Add its tree to a world, whose bodies get consecutive numbers; return body and link of each."""
        self.number, bodies = world.add_tree_of(self.rows)
        self.first, self.members = bodies[0], slice(bodies[0], bodies[0] + len(self.heads))
        return [(self.body, link) for link in self.heads]

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
            q, v = [*x, turn[3], *turn[:3]], [*velocity, *(rotation(turn).T @ spin).tolist()]
        if self._joint_links:
            torques = []
            for place, speed, _, torque in p.getJointStatesMultiDof(self.body, self._joint_links, self._client):
                if len(place) == 1:
                    q.append(place[0])
                    torques.append(torque[0])
                else:
                    q += (place[3], *place[:3])
                v += speed
            self.torque = np.array(torques)
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
            x, y, z, *turn = q[:7].tolist()
            p.resetBasePositionAndOrientation(self.body, (x, y, z), [*turn[1:], turn[0]], self._client)
            p.resetBaseVelocity(self.body, v[:3].tolist(), (axes_of(q[3:7]) @ v[3:6]).tolist(), self._client)

    def _bind(self, world: Arrays) -> None:
        """Find its numbers in the arrays of a world."""
        if self._joints is world.joints:
            return
        self._joints = world.joints
        names = ("q", "v", "a", "f", "factor")
        self._q, self._v, self._a, self._f, self._factor = (numbers(world, self.number, name) for name in names)
        self._axes = numbers(world, self.number, "axes").view(AXIS)
        self._carried = carriers(self._axes)
        own = slice(self.first + 1, self.first + 1 + self.rows.links.size)
        self._asleep, self._touched = (world.bodies[name][own] for name in ("asleep", "touched"))
        self._centres = world.bodies["position"][own]

    def begin_step(self, world: Arrays, gravity: Array) -> None:
        """Take the state at the start of a step, and see whether the user has moved it since the last one."""
        self._bind(world)
        q, off = self.start[0], np.abs(self.left - self.start[0])
        for i in self._turns:  # a quaternion and its negative are the same rotation
            off[i : i + 4] = np.minimum(off[i : i + 4], np.abs(self.left + q)[i : i + 4])
        self.placed = not off.max(initial=0.0) <= 0.5 * EXACT * (1.0 + np.abs(q).max(initial=0.0))
        if self.placed:
            self.force[:], self.push[:], self.pressed = 0.0, 0.0, False
        tree = world.trees[self.number]
        tree["gravity"] = gravity
        if not self.free:
            tree["base"], (x, y, z, w) = p.getBasePositionAndOrientation(self.body, self._client)
            tree["base_turn"] = w, x, y, z

    def _find_forces(self, v: Array, dt: float) -> None:
        """Find the forces on the joints, and which joints a motor held against `push`, from velocities after a step."""
        gained = (v - self.start[1]) / dt
        known, i = self.matrix @ self.free_acceleration, self._scalars
        armature, torque = self._axes["armature"][i], np.abs(self.torque)
        inertia, speed = self.matrix[i, i] - armature, np.abs(v[i])
        accelerating = np.abs(gained[i]) * inertia
        same = np.abs(torque - self.last_torque) <= EXACT * torque
        self.limit[torque > (1.0 + EXACT) * self.limit] = np.inf
        self.limit = np.where(same & (accelerating > EXACT * torque), torque, self.limit)
        self.last_torque = torque
        held = accelerating < np.maximum(np.abs(self.push[i]), CARRIES * torque)
        held &= (torque > 0.0) & (torque < (1.0 - EXACT) * self.limit)
        self.strongest = np.maximum(self.strongest, torque)
        most = np.divide(dt * self.strongest, speed, np.full_like(speed, np.inf), where=speed > 0.0)
        self._axes["armature"][i] = np.where(held, np.minimum(HELD * inertia, most), 0.0)
        self.matrix[i, i] += self._axes["armature"][i] - armature
        self.force += self.matrix @ gained - known - self.push

    def set_tree(self, world: Arrays, dt: float) -> None:
        """Set the world's tree at the start of the step, with `force` and the velocity at the time of the position."""
        self._place(world, dt)
        self.matrix = matrix_of_factor(self._axes, self._factor, self._carried)

    def _place(self, world: Arrays, dt: float) -> None:
        self._f[:] = self.force
        self._put(world, *self.start)
        self.free_acceleration = self._a.copy()
        if not self.pressed:
            self._put(world, self.start[0], self.start[1] + 0.5 * dt * self.free_acceleration)

    def _put(self, world: Arrays, q: Array, v: Array) -> None:
        self._q[:], self._v[:] = q, v
        settle(world, self.number)

    def read_forces(self, world: Arrays, dt: float) -> None:
        """After Bullet's step: find the forces on the joints within it."""
        self.after = self.read()
        self._find_forces(self.after[1], dt)
        self._place(world, dt)

    def write_back(self, world: Arrays, dt: float, pressed: bool) -> None:
        """Write the tree to PyBullet after the world's step, if a contact has touched it, or see `near.following`."""
        self._bind(world)
        self.pressed, self.left = pressed, self.after[0]
        q, v = self._q.copy(), self._v.copy()
        if not (self._asleep.any() or self._touched.any()):
            self._put(world, *self.after)
            if not overlaps(world.world, self.first + 1, len(self.heads)):
                self.push[:] = 0.0
                return
            self._put(world, q, v)
        self.left = q
        if not pressed:
            v -= 0.5 * dt * self._a
        self.write(self.left, v)
        if self.free:  # Bullet keeps the spin of a base along the axes before its step
            v[3:6] = axes_of(self.start[0][3:7]).T @ (axes_of(self.left[3:7]) @ v[3:6])
        self.push = self.matrix @ ((v - self.start[1]) / dt - self.free_acceleration)

    def apply_push(self) -> None:
        """Apply the push of the last step's contacts again, if one is closed, at the present pose of the world's tree.

        It consists of forces and torques on links.
        """
        self.push[:] = self.push if self.pressed else 0.0
        if not self.push.any():
            return
        moments = self._rotations @ (self.push[:, None] * self._axes["spin"])
        for k, owner, parent in self._translations:
            push = self.push[k] * self._axes["velocity"][k]
            # on a free base at its own frame, about which spin is reckoned; fixed links shift the centre of mass
            place = (self._q[:3] if self.free and owner == 0 else self._centres[owner]).tolist()
            for member, own in ((owner, push), (parent, -push)):
                if member >= 0:
                    link = self.heads[member]
                    p.applyExternalForce(self.body, link, own.tolist(), place, p.WORLD_FRAME, self._client)
        for link, moment in zip(self.heads, moments.tolist(), strict=True):
            p.applyExternalTorque(self.body, link, moment, p.WORLD_FRAME, self._client)
