"""Bodies with joints: a tree of the world for each, read from PyBullet and handed back to it.

As for free bodies (`exchange`): the velocity that Bullet tells is that of half a step before, v + dt/2 a is read, and
handed back likewise, but where a contact is closed. With M(q) a + c(q, v) = f, what moves the joints besides gravity
and contacts is f = M (a - a0), a0 the model's own acceleration: of the step that Bullet has taken, or, where it has yet
to take it, of the one before. What contacts change the velocities by, u dt, is the generalised force M u: that of a
joint is a couple, or a pair of forces, on both bodies that it holds together, that of a free base a force and a couple.

A motor of PyBullet is a constraint: with all the force that it may use it keeps its joint's speed. A contact that is
met within a step meets it so: as an armature that is heavy against what the joint carries. (As a constant force over
the step, which comes a step late, it would shake a robot off the feet that it stands on.) Which joints are held, their
answer to the push in Bullet's own step shows: one whose motor is at its limit gains as much speed as a free one. One
whose motor's torque hardly moves it is held too, pushed or not: a foot that is just lifted is as heavy when it lands.
"""

from __future__ import annotations

import numpy as np
import pybullet as p

from contactlaw.pybullet_callback.joints import Joints
from contactlaw.pybullet_callback.shapes import Key
from contactlaw.world import World
from contactlaw.world.coordinates import carriers, matrix_of_factor, numbers, settle
from contactlaw.world.records import AXIS, FREE_JOINT, SLIDE, Array, Arrays

EXACT = 1e-9  # of a coordinate, a difference that is rounding
STRAIGHT = {FREE_JOINT: np.arange(3), SLIDE: np.arange(1)}  # the axes of a joint that do not turn
CARRIES = 0.01  # of a motor's torque, what moves its joint where it carries loads, in contact or not
HELD = 1e3  # times what it carries: the armature of a joint that a motor holds


class Linked(Joints):
    """A body of PyBullet with joints, as a tree of a world."""

    def __init__(self, client: int, body: int) -> None:
        super().__init__(client, body)
        self.left = self.start = np.full(self.q_size, np.nan), np.zeros(self.v_size)
        self.ahead, self.matrix = 0.0, np.zeros((self.v_size, self.v_size))
        self.lacks: Array | None = None
        self.force, self.push = np.zeros(self.v_size), np.zeros(self.v_size)
        self.strange = self.pressed = False
        self._joints: Array | None = None
        links, parents = self.rows.links, self.rows.links["parent"].tolist()
        owners = np.repeat(np.arange(links.size), links["axes"]).tolist()
        straight = [axis for _, kind, _, first in self.joints for axis in first + STRAIGHT.get(kind, np.arange(0))]
        self._slides = [(k, owners[k], parents[owners[k]]) for k in straight]
        self._turns = np.zeros((links.size, self.v_size))  # which moments about joints act on which body, and how
        for k in set(range(self.v_size)) - set(straight):
            self._turns[owners[k], k] = 1.0
            if parents[owners[k]] >= 0:
                self._turns[parents[owners[k]], k] = -1.0

    def add_to(self, world: World) -> None:
        """Make its tree; the bodies of the world stand in a row."""
        self.number, bodies = world.add_tree_of(self.rows)
        self.first = bodies[0]

    def _look_at(self, world: Arrays) -> None:
        """Where its numbers are in a world's arrays."""
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

    def look_again(self) -> None:
        """Read it into `now`."""
        self.now = self.read()

    def receive(self, world: Arrays, gravity: Array) -> None:
        """Take where it is at the start of a step; what its place lacks is put right."""
        self._look_at(world)
        q, v = self.now
        left = self.moved(self.left[0], self.ahead * v) if self.ahead > 0.0 else self.left[0]
        near = EXACT * (1.0 + np.abs(q).max(initial=0.0))
        self.strange = (
            not np.abs(left - q).max(initial=0.0) <= 0.5 * near
            and not np.abs(self.between(left, q)).max(initial=0.0) <= near
        )
        if self.strange:
            self.force[:], self.push[:], self.pressed = 0.0, 0.0, False
        elif self.ahead > 0.0:
            self._learn((v - self.start[1]) / self.ahead)
        if self.lacks is not None and not self.strange:
            q, old = self.moved(q, self.lacks), q
            v = self.along(v, old, q)
            self.write(q, v)
        self.lacks = None
        self.start = q, v
        tree = world.trees[self.number]
        tree["gravity"] = gravity
        if not self.free:
            tree["base"], (x, y, z, w) = p.getBasePositionAndOrientation(self.body, self._client)
            tree["base_turn"] = w, x, y, z

    def _learn(self, gained: Array) -> None:
        """What moved the joints, and which of them a motor held against `push`, from the accelerations of a step."""
        known, i = self.matrix @ self.own, self.scalar_v
        armature, inertia = self._axes["armature"][i], self.matrix[i, i]
        torque = np.abs(self.torque)
        held = np.abs(gained[i]) * (inertia - armature) < np.maximum(np.abs(self.push[i]), CARRIES * torque)
        self._axes["armature"][i] = np.where(held & (torque > 0.0), HELD * (inertia - armature), 0.0)
        self.matrix[i, i] += self._axes["armature"][i] - armature
        self.force += self.matrix @ gained - known - self.push

    def set_out(self, world: Arrays, dt: float) -> None:
        """Place the world's tree at the start of the step, with its true velocity, and `force` on it."""
        self._place(world, dt)
        self.matrix = matrix_of_factor(self._axes, self._factor, self._carried)

    def _place(self, world: Arrays, dt: float) -> None:
        self._f[:] = self.force
        self._put(world, *self.start)
        self.own = self._a.copy()
        if not self.pressed:
            self._put(world, self.start[0], self.start[1] + 0.5 * dt * self.own)

    def _put(self, world: Arrays, q: Array, v: Array) -> None:
        self._q[:], self._v[:] = q, v
        settle(world, self.number)

    def compare(self, world: Arrays, dt: float) -> None:
        """After Bullet's step: what moved the joints in it."""
        self.after = self.read()
        self._learn((self.after[1] - self.start[1]) / dt)
        self._place(world, dt)

    def hand_back(self, world: Arrays, dt: float, stepped: bool, pressed: bool) -> bool:
        """After the world's step; returns whether it must be pushed: PyBullet has yet to step."""
        self._look_at(world)
        self.pressed = pressed
        if not (self._asleep.any() or self._touched.any()):
            self.push[:] = 0.0
            ahead = self.start[0], self.start[1] + dt * self.own
            self.left, self.ahead = (self.after, 0.0) if stepped else (ahead, dt)
            return False
        q, v = self._q.copy(), self._v.copy()
        if not pressed:
            v -= 0.5 * dt * self._a
        shown = self.along(v, q, self.start[0])  # Bullet turns a base about its spin, so that this is what will be read
        self.push = self.matrix @ ((shown - self.start[1]) / dt - self.own)
        if stepped:
            self.write(q, v)
            self.left, self.ahead = (q, v), 0.0
            return False
        self.left, self.ahead = (self.start[0], shown), dt
        self.lacks = self.between(self.moved(self.start[0], dt * shown), q)
        self._put(world, *self.start)  # where it will be pushed; it is read anew in the next step
        return True

    def apply_steady_push(self) -> None:
        """Push it with what pressed on it in the last step."""
        if self.pressed:
            self.apply_push()
        else:
            self.push[:] = 0.0

    def apply_push(self) -> None:
        """Push its links by what contacts did, as the world's tree stands."""
        if not self.push.any():
            return
        moments = self._turns @ (self.push[:, None] * self._axes["spin"])
        for k, owner, parent in self._slides:
            push = self.push[k] * self._axes["velocity"][k]
            # of a free base at its frame, which all is turned about; what is fixed to it moves the centre
            place = (self._q[:3] if self.free and owner == 0 else self._centres[owner]).tolist()
            for member, own in ((owner, push), (parent, -push)):
                if member >= 0:
                    link = self.heads[member]
                    p.applyExternalForce(self.body, link, own.tolist(), place, p.WORLD_FRAME, self._client)
        for link, moment in zip(self.heads, moments.tolist(), strict=True):
            p.applyExternalTorque(self.body, link, moment, p.WORLD_FRAME, self._client)

    @property
    def keys(self) -> list[Key]:
        """Body and link of each member."""
        return [(self.body, link) for link in self.heads]
