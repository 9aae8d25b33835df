"""Bodies with joints: a kinematic tree of the world for each, read from PyBullet and written back.

As for free bodies (`rows`), Bullet's velocity belongs to half a step before its position: v + dt/2 a is read, and
written back likewise, except where a contact is closed. With M(q) a + c(q, v) = f, the force on the joints besides
gravity and contacts is f = M (a - a0), where a0 is the acceleration of the model alone and a that of Bullet: of the
step that Bullet has taken, or, before it steps, of the last one. If contacts change the velocities by u dt, they are
applied as the generalised force M u: on joints by torque control, which adds to that of the user, and on a free base by
a force and a couple.

A motor of PyBullet is a constraint: it keeps the speed of its joint with up to its greatest force. In a contact within
a step such a joint is given an armature that is heavy against what it carries. (A constant force instead would come a
step late and shake a robot off its feet.) Which joints are held is read from their response to the push in Bullet's own
step. A joint that its motor's torque hardly moves is held too, pushed or not, so that a foot that is just lifted is as
heavy when it lands. A motor at its limit gives a constant force and holds nothing. PyBullet does not tell the limit: a
motor has reached it if its torque is the same in two steps while it accelerates its joint. The armature of a joint that
moves is at most such that its momentum is what the motor can give in a step with the greatest torque that it has had:
else a finger would press what it meets with many times the force of its motor.
"""

from math import inf, isfinite
from typing import Any

import numpy as np
import pybullet as p

from contactlaw.jit import jit_module
from contactlaw.laws.record import record
from contactlaw.memory import element
from contactlaw.pybullet_callback.rows import row_at
from contactlaw.pybullet_callback.shapes import BASE, KINDS, Key, joints_of, pose_of, turned
from contactlaw.world import World
from contactlaw.world.bodies.motion import settle
from contactlaw.world.data.access import axis_at, body_at, joint_at, link_at, tree_at, world_at
from contactlaw.world.data.call import call_with_body
from contactlaw.world.data.frames import CONJUGATE, IDENTITY, UNTURNED, Pose
from contactlaw.world.data.quaternion import conjugate, load4, turn_by
from contactlaw.world.data.records import BALL, Array, Arrays
from contactlaw.world.data.vec import load, store
from contactlaw.world.near.passing import overlaps
from contactlaw.world.trees.description import Joint, Part, records_of
from contactlaw.world.trees.kinematics import is_free, vector
from contactlaw.world.trees.mobility import clear, copy
from contactlaw.world.trees.motion import LARGEST_TURN, MOST

MOST_TURN = LARGEST_TURN * MOST  # [rad] or [m] in a step that the flight of a tree of the world can follow
LEAST_INERTIA = 1e-12  # [m^2], of moments of inertia over mass
UP = (0.0, 0.0, 1.0)
EXACT = 1e-9  # relative difference of a coordinate that counts as rounding
CARRIES = 0.01  # a motor holds its joint if less than this share of its torque accelerates the inertia that it carries
HELD = 1e3  # armature of a joint that a motor holds, over the inertia that it carries

# lengths are numbers of coordinates (q), of velocities (v), and of those that motors can drive (m)
KEPT = {"left": "q", "force": "v", "push": "v", "last_torque": "m", "limit": "m", "strongest": "m"}
"""What lasts from a step to the next: coordinates as the last step left them."""
NUMBERS = KEPT | {
    "start_q": "q", "start_v": "v", "after_q": "q", "after_v": "v", "torque": "m",  # as read before and after the step
    "free_acceleration": "v", "matrix": "vv",  # by the forces known at the start of the step; mass matrix there
    "new_q": "q", "new_v": "v", "gained": "v",  # to be written; acceleration that Bullet's velocities show
}  # fmt: skip
"""Arrays of a tree besides those of the world, by name, and their shapes."""

OWN = record(tree="u8", rows="u8", **dict.fromkeys(NUMBERS, "u8"))
"""Addresses of a tree's record in the world, of the `rows` of its bodies, and of its arrays."""

own_at = element(OWN)


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
        numbers: Its arrays, by the names in `NUMBERS`.
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
        sizes = {"q": self.q_size, "v": self.v_size, "m": self.v_size - 6 * self.free}
        shapes = [(name, "f8", tuple(sizes[one] for one in shape)) for name, shape in NUMBERS.items()]
        self.numbers = own = np.zeros((), shapes)
        self._kept, self._own = own[list(KEPT)], np.zeros(1, OWN)
        for name in NUMBERS:
            self._own[name] = own[name].ctypes.data
        self._block = self._own.ctypes.data
        own["left"], own["limit"] = np.nan, np.inf
        self.start, self.push = (own["start_q"], own["start_v"]), own["push"]  # state at the start of the step
        self.placed = False

    def add_to(self, world: World) -> list[Key]:
        """Add its tree to a world, whose bodies get consecutive numbers; return body and link of each."""
        self.number, bodies = world.add_tree_of(self.rows)
        self.first = bodies[0]
        return [(self.body, link) for link in self.heads]

    def save(self) -> Array:
        """Return a copy of what lasts from a step to the next."""
        return self._kept.copy()

    def restore(self, kept: Array) -> None:
        """Set what `save` returned."""
        self._kept[...] = kept

    def inertias(self) -> list[tuple[Any, ...]]:
        """Return mass, moments of inertia and inertial frame of all links, as PyBullet has them now."""
        dynamics = (p.getDynamicsInfo(self.body, link, self._client) for link in self._all)
        return [(one[0], *one[2:5]) for one in dynamics]

    def place_of(self, link: int) -> tuple[int, Pose]:
        """Return the body of the tree that a link is part of, and the pose of the link's inertial frame in it."""
        i = self.links.index(link)
        return int(self.rows.row[i]), Pose(self.rows.at[i], self.rows.quaternion[i])

    def read(self, out: tuple[Array, Array]) -> tuple[Array, Array]:
        """Read coordinates and velocities from PyBullet, and `torque` of the joints' motors."""
        q, v = list[float](), list[float]()
        if self.free:
            x, turn = p.getBasePositionAndOrientation(self.body, self._client)
            velocity, spin = p.getBaseVelocity(self.body, self._client)
            a, b, c, w = turn
            q, v = [*x, w, a, b, c], [*velocity, *turned((-a, -b, -c, w), spin)]
        if self._joint_links:
            torques = list[float]()
            for place, speed, _, torque in p.getJointStatesMultiDof(self.body, self._joint_links, self._client):
                q += place if len(place) == 1 else (place[3], *place[:3])
                v += speed
                torques += torque
            self.numbers["torque"][:] = torques
        if not isfinite(sum(q) + sum(v)):
            hint = " (setJointMotorControl2 makes those of spherical joints so: use setJointMotorControlMultiDof)"
            spherical = any(kind == BALL for kind, _, _ in self._kinds)
            raise ValueError(f"body {self.body}: positions or velocities are not finite{hint if spherical else ''}")
        out[0][:], out[1][:] = q, v
        return out

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
            p.resetBasePositionAndOrientation(self.body, (x, y, z), (*turn, w), self._client)
            p.resetBaseVelocity(self.body, v[:3].tolist(), turned((*turn, w), v[3:6].tolist()), self._client)

    def bind(self, world: Arrays, rows: Any) -> None:
        """Find its numbers in the arrays of a world, before each step for which they are others, and its rows."""
        self._tree, self._world_block = world.trees[self.number], world.world.ctypes.data
        self._own["tree"] = world.trees.ctypes.data + self.number * world.trees.itemsize
        self._own["rows"] = rows.ctypes.data + self.first * rows.itemsize

    def begin_step(self, gravity: Array, dt: float) -> bool:
        """Take the state at the start of a step; return whether the user has moved it since the last one."""
        self.placed = take_start(self._block)
        self._tree["gravity"] = gravity
        if not self.free:
            self._tree["base"], (x, y, z, w) = p.getBasePositionAndOrientation(self.body, self._client)
            self._tree["base_turn"] = w, x, y, z
        self.set_tree(dt)
        return self.placed

    def set_tree(self, dt: float) -> None:
        """Set the world's tree at the start of the step, with `force` and the velocity at the time of the position."""
        set_at_start(self._block, dt)

    def read_forces(self, dt: float) -> None:
        """After Bullet's step: find the forces on the joints within it."""
        _, v = self.read((self.numbers["after_q"], self.numbers["after_v"]))
        if (turn := dt * np.abs(v).max()) > MOST_TURN:
            raise ValueError(
                f"body {self.body}: PyBullet's step has brought it to {turn:.3g} rad or m a step: shorten the step; "
                "or its joints have more damping than Bullet is stable with (changeDynamics: jointDamping)"
            )
        take_response(self._block, dt)

    def write_back(self, dt: float) -> None:
        """Write the tree to PyBullet after the world's step, if a contact has touched it, or see `near.passing`."""
        if find_end(self._block, self._world_block, dt):
            self.write(self.numbers["new_q"], self.numbers["new_v"])

    def apply_push(self) -> None:
        """Apply the push of the last step's contacts again: on joints, and on a free base."""
        if not self.push.any():
            return
        push = self.push.tolist()
        if self._joint_links:
            p.setJointMotorControlMultiDofArray(
                self.body, self._joint_links, p.TORQUE_CONTROL, physicsClientId=self._client,
                forces=[push[k : k + 3] if kind == BALL else [push[k]] for kind, _, k in self._kinds],
            )  # fmt: skip
        if self.free:
            x, y, z, w, *turn = self.start[0][:7].tolist()
            p.applyExternalForce(self.body, BASE, push[:3], (x, y, z), p.WORLD_FRAME, self._client)
            p.applyExternalTorque(self.body, BASE, turned((*turn, w), push[3:6]), p.WORLD_FRAME, self._client)


def take_start(block):
    """Return whether the user has moved the tree since the last step; if so nothing presses or pushes it."""
    own = own_at(block, 0)
    t = tree_at(own.tree, 0)
    left = is_left(own, t)
    for i in range(t.count):
        r = row_at(own.rows, i)
        r.placed, r.pressed = 0 if left else 1, r.pressed if left else 0
    if not left:
        clear(vector(own.force, t.v_size))
        clear(vector(own.push, t.v_size))
    return not left


def is_pressed(own, t):
    """Return whether a contact on the tree was closed when last looked."""
    pressed = 0
    for i in range(t.count):
        pressed |= row_at(own.rows, i).pressed
    return pressed != 0


def is_left(own, t):
    """Return whether the coordinates are those that the last step left; NaN is not."""
    q, left, most = vector(own.start_q, t.q_size), vector(own.left, t.q_size), 0.0
    for k in range(t.q_size):
        most = max(most, abs(q[k]))
    close = 0.5 * EXACT * (1.0 + most)
    for i in range(t.joint_count):
        joint = joint_at(t.joints, i)
        ball, first = joint.kind == BALL, joint.first_q
        for k in range(first, first + 4 if ball else first + 1):
            other = abs(left[k] + q[k]) if ball else inf  # a quaternion and its negative are the same rotation
            if not min(abs(left[k] - q[k]), other) <= close:
                return False
    return True


def set_at_start(block, dt):
    """Set the world's tree at the start of the step of dt [s], and find its matrix."""
    own = own_at(block, 0)
    t = tree_at(own.tree, 0)
    set_start(own, t, dt)
    clear(vector(own.matrix, t.v_size * t.v_size))
    t.weights, t.stride = own.matrix, t.v_size
    call_with_body(t.write_masses, body_at(t.bodies, 0))


def set_start(own, t, dt):
    """Set the world's tree at the start of the step of dt [s], with `force` and the velocity at that time."""
    free, v = vector(own.free_acceleration, t.v_size), vector(own.new_v, t.v_size)
    copy(vector(own.force, t.v_size), vector(t.f, t.v_size))
    copy(vector(own.start_v, t.v_size), v)
    put(t, own.start_q, own.new_v)
    copy(vector(t.a, t.v_size), free)
    if not is_pressed(own, t):
        for k in range(t.v_size):
            v[k] += 0.5 * dt * free[k]
        put(t, own.start_q, own.new_v)


def put(t, q, v):
    """Set coordinates and velocities of the world's tree, at addresses, and what follows; wakes its bodies."""
    copy(vector(q, t.q_size), vector(t.q, t.q_size))
    copy(vector(v, t.v_size), vector(t.v, t.v_size))
    t.stale = 1
    for i in range(t.count):
        body_at(t.bodies, i).asleep = 0
    settle(body_at(t.bodies, 0))


def add_product(m, x, share, out):
    """Add a share of M x to an array."""
    for i in range(x.size):
        for j in range(x.size):
            out[i] += share * m[i, j] * x[j]


def take_response(block, dt):
    """From velocities after Bullet's step: find forces on joints, and which a motor held; then as `set_at_start`."""
    own = own_at(block, 0)
    t = tree_at(own.tree, 0)
    m, force, push = vector(own.matrix, (t.v_size, t.v_size)), vector(own.force, t.v_size), vector(own.push, t.v_size)
    before, after = vector(own.start_v, t.v_size), vector(own.after_v, t.v_size)
    gained = vector(own.gained, t.v_size)
    for k in range(t.v_size):
        gained[k] = (after[k] - before[k]) / dt
        force[k] -= push[k]
    add_product(m, vector(own.free_acceleration, t.v_size), -1.0, force)
    first = 6 if is_free(t, link_at(t.links, 0)) else 0
    for motor in range(t.v_size - first):
        k = first + motor
        axis = axis_at(t.axes, k)
        inertia = m[k, k] - axis.armature
        axis.armature = armature_of(own, motor, inertia, (abs(gained[k]), abs(after[k]), abs(push[k])), dt)
        m[k, k] = inertia + axis.armature
    add_product(m, gained, 1.0, force)
    set_start(own, t, dt)


def armature_of(own, motor, inertia, sizes, dt):
    """Return the armature of a joint's axis by its motor, and note the motor's torque.

    inertia: without armature; sizes: of the axis' acceleration and velocity by Bullet's step, and of the push.
    """
    count, (acceleration, speed, push) = motor + 1, sizes
    torques, last, limits = vector(own.torque, count), vector(own.last_torque, count), vector(own.limit, count)
    strongest, torque, accelerating = vector(own.strongest, count), abs(torques[motor]), acceleration * inertia
    if torque > (1.0 + EXACT) * limits[motor]:
        limits[motor] = inf
    if abs(torque - last[motor]) <= EXACT * torque and accelerating > EXACT * torque:
        limits[motor] = torque
    last[motor] = torque
    strongest[motor] = max(strongest[motor], torque)
    held = accelerating < max(push, CARRIES * torque)
    if not (held and 0.0 < torque < (1.0 - EXACT) * limits[motor]):
        return 0.0
    return min(HELD * inertia, dt * strongest[motor] / speed) if speed > 0.0 else HELD * inertia


def find_end(block, world, dt):
    """After the world's step: find what is to be written, if a contact has touched the tree, or see `near.passing`.

    Returns whether there is. If a contact is closed, finds the push of the contacts too.
    """
    own, w = own_at(block, 0), world_at(world, 0)
    t, touched = tree_at(own.tree, 0), False
    left, v, push = vector(own.left, t.q_size), vector(own.new_v, t.v_size), vector(own.push, t.v_size)
    copy(vector(t.q, t.q_size), vector(own.new_q, t.q_size))
    copy(vector(t.v, t.v_size), v)
    for i in range(t.count):
        b = body_at(t.bodies, i)
        touched = touched or b.asleep != 0 or b.touched != 0
    for k in range(t.v_size):
        touched = touched or push[k] != 0.0  # Bullet's step has it, though the contact may be no more
    clear(push)
    if not touched:
        put(t, own.after_q, own.after_v)
        if not overlaps(w, t.first, t.count):
            copy(vector(own.after_q, t.q_size), left)
            return False
        put(t, own.new_q, own.new_v)
    copy(vector(own.new_q, t.q_size), left)
    if not is_pressed(own, t):
        for k in range(t.v_size):
            v[k] -= 0.5 * dt * vector(t.a, t.v_size)[k]
        return True
    gained = vector(own.gained, t.v_size)
    copy(v, gained)
    # Bullet keeps the spin of a base along the axes before its step
    if is_free(t, link_at(t.links, 0)):
        turn, before = load4(left[3:7]), load4(vector(own.start_q, t.q_size)[3:7])
        store(gained[3:6], turn_by(conjugate(before), turn_by(turn, load(v[3:6]))))
    began, free = vector(own.start_v, t.v_size), vector(own.free_acceleration, t.v_size)
    for k in range(t.v_size):
        gained[k] = (gained[k] - began[k]) / dt - free[k]
    add_product(vector(own.matrix, (t.v_size, t.v_size)), gained, 1.0, push)
    return True


jit_module(__name__)
