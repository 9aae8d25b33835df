"""Bodies with joints: a tree of the world for each, read from PyBullet and handed back to it.

As for free bodies (`exchange`): the velocity that Bullet tells is that of half a step before, v + dt/2 a is read, and
handed back likewise, but where a contact is closed. With M(q) a + c(q, v) = f, what moves the joints besides gravity
and contacts is f = M (a - a0), a0 the model's own acceleration: of the step that Bullet has taken, or, where it has yet
to take it, of the one before. What contacts change the velocities by, u dt, is pushed by a force and a moment on each
link, those that the accelerations J u give it: sum J^T (m, I) J u = M u.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pybullet as p

from contactlaw.pybullet_callback.shapes import BASE, Key, rotation
from contactlaw.world import World
from contactlaw.world.arrays import with_tree
from contactlaw.world.coordinates import coordinates, jacobian, mass_matrix, numbers, write_coordinates
from contactlaw.world.frames import matrix_of, product, quaternion_of
from contactlaw.world.records import BALL, FREE_JOINT, HINGE, SLIDE, Array, Arrays
from contactlaw.world.tree_rows import TreeRows

KINDS = {p.JOINT_REVOLUTE: HINGE, p.JOINT_PRISMATIC: SLIDE, p.JOINT_SPHERICAL: BALL}
SIZES = {FREE_JOINT: (7, 6), HINGE: (1, 1), SLIDE: (1, 1), BALL: (4, 3)}
ONE = np.array([1.0, 0.0, 0.0, 0.0])
EXACT = 1e-9  # of a coordinate, a difference that is rounding
LEAST_INERTIA = 1e-12  # [m^2] over the mass


def scalar_first(quaternion: Any) -> Array:
    """PyBullet's quaternions have the scalar last."""
    return np.roll(np.asarray(quaternion, float), 1)


def turned_by(turn: Array) -> Array:
    """The quaternion of a rotation vector [rad]."""
    angle = float(np.linalg.norm(turn))
    return np.array([np.cos(0.5 * angle), *(0.5 * np.sinc(0.5 * angle / np.pi) * turn)])


class Linked:
    """A body of PyBullet with joints.

    Attributes:
        joints: Kind and first places, among coordinates and velocities, of each joint; link -1: the free base.
        rows: As the world keeps it.
        links: PyBullet's links that are in the tree, in their order.
    """

    def __init__(self, client: int, body: int) -> None:
        self._client, self.body = client, body
        infos = [p.getJointInfo(body, link, client) for link in range(p.getNumJoints(body, client))]
        dynamics = {link: p.getDynamicsInfo(body, link, client) for link in range(BASE, len(infos))}
        self.free = dynamics[BASE][0] > 0.0
        moves = {BASE: self.free}
        for link, info in enumerate(infos):
            moves[link] = moves[info[16]] or info[2] in KINDS
        self.links = [link for link in moves if moves[link]]
        kinds = {link: KINDS[infos[link][2]] for link in self.links if link != BASE and infos[link][2] in KINDS}
        kinds = ({BASE: FREE_JOINT} if self.free else {}) | kinds
        self.joints: list[tuple[int, int, int, int]] = []
        self.q_size = self.v_size = 0
        for link, kind in kinds.items():
            self.joints.append((link, kind, self.q_size, self.v_size))
            self.q_size, self.v_size = self.q_size + SIZES[kind][0], self.v_size + SIZES[kind][1]
        self._scalars = [link for link, kind in kinds.items() if kind in (HINGE, SLIDE)]
        q, _ = self.read()
        poses = {link: self._pose(link) for link in moves}
        start = np.concatenate([np.zeros(SIZES[k][1]) if k in (HINGE, SLIDE) else [0.0] * 3 * (k == FREE_JOINT) + [*ONE]
                                for k in kinds.values()])  # fmt: skip
        count, places = len(self.links), []
        joint_at, axes = np.zeros((len(self.joints), 3)), np.zeros((len(self.joints), 3))
        for number, (link, kind, _, _) in enumerate(self.joints):
            axes[number] = (0.0, 0.0, 1.0) if kind in (FREE_JOINT, BALL) else infos[link][13]
            # the inertial frame, in which PyBullet tells poses, as seen from the joint's
            joint_at[number] = 0.0 if kind == FREE_JOINT else -rotation(dynamics[link][4]).T @ dynamics[link][3]
        index = {joint[0]: number for number, joint in enumerate(self.joints)}
        for link in self.links:
            x, turn = np.zeros(3), np.eye(3)
            if link != BASE:
                parent = infos[link][16]  # what does not move stands with the base
                (x0, turn0), (x1, turn1) = poses[parent if parent in self.links else BASE], poses[link]
                x, turn = turn0.T @ (x1 - x0), turn0.T @ turn1
                if link in index:
                    x, turn = self._at_zero(index[link], x, turn, q, joint_at, axes)
            places.append((x, quaternion_of(turn)))
        joint_count = [int(link in index) for link in self.links]
        parents = {link: number for number, link in enumerate(self.links)}
        self.rows = TreeRows(
            SimpleNamespace(
                body_parentid=[-1 if link == BASE else parents.get(infos[link][16], -1) for link in self.links],
                body_jntnum=joint_count, body_jntadr=np.cumsum([0, *joint_count])[:-1],
                body_pos=[place[0] for place in places], body_quat=[place[1] for place in places],
                body_ipos=np.zeros((count, 3)), body_iquat=np.tile(ONE, (count, 1)),
                body_mass=[dynamics[link][0] for link in self.links],
                body_inertia=[np.maximum(dynamics[link][2], LEAST_INERTIA * dynamics[link][0]) for link in self.links],
                jnt_type=[joint[1] for joint in self.joints], jnt_pos=joint_at, jnt_axis=axes,
                jnt_qposadr=[joint[2] for joint in self.joints], jnt_dofadr=[joint[3] for joint in self.joints],
                qpos0=start, dof_armature=np.zeros(self.v_size), dof_damping=np.zeros(self.v_size),
            ),
            range(count),
        )  # fmt: skip
        self.heads = [link for link in self.links if link in index]
        self.left, self.ahead = (np.full(self.q_size, np.nan), np.zeros(self.v_size)), 0.0
        self.lacks: Array | None = None
        self.force, self.push = np.zeros(self.v_size), np.zeros(self.v_size)
        self.strange = self.pressed = False

    def _at_zero(self, number: int, x: Array, turn: Array, q: Array, at: Array, axes: Array) -> tuple[Array, Array]:
        """Where a link is in its parent when its joint is at zero, from where it is now."""
        _, kind, first, _ = self.joints[number]
        if kind == SLIDE:
            return x - turn @ axes[number] * q[first], turn
        own = matrix_of(q[first : first + 4] if kind == BALL else turned_by(q[first] * axes[number]))
        turn = turn @ own.T
        return x - turn @ (at[number] - own @ at[number]), turn

    def _pose(self, link: int) -> tuple[Array, Array]:
        if link == BASE:
            x, q = p.getBasePositionAndOrientation(self.body, self._client)
        else:
            x, q = p.getLinkState(self.body, link, 0, 1, self._client)[:2]
        return np.array(x), rotation(q)

    def place_of(self, link: int) -> tuple[int, Array, Array]:
        """Member of the tree that a link is part of, and where its inertial frame is in that one's principal axes."""
        i = self.links.index(link)
        return int(self.rows.row[i]), self.rows.at[i], matrix_of(self.rows.quaternion[i])

    def add_to(self, world: World) -> None:
        """Make its tree; the bodies of the world stand in a row."""
        bodies = [world.add_body(1.0, 1.0) for _ in self.rows.links]
        self.first = bodies[0]
        world._arrays = with_tree(world.arrays, self.rows.fields() | {"first": self.first + 1})
        self.number = world.arrays.trees.size - 1
        self.rows.write(world.arrays, self.number)
        for row, fields in enumerate(self.rows.bodies(), self.first + 1):
            for name, value in fields.items():
                world.arrays.bodies[row][name] = value

    def read(self) -> tuple[Array, Array]:
        """Coordinates and velocities as PyBullet has them."""
        q, v = np.zeros(self.q_size), np.zeros(self.v_size)
        states = dict(
            zip(self._scalars, p.getJointStates(self.body, self._scalars, self._client), strict=True)
            if self._scalars else ()
        )  # fmt: skip
        for link, kind, i, j in self.joints:
            if kind == FREE_JOINT:
                (x, turn), (velocity, spin) = (
                    p.getBasePositionAndOrientation(self.body, self._client), p.getBaseVelocity(self.body, self._client)
                )  # fmt: skip
                q[i : i + 3], q[i + 3 : i + 7] = x, scalar_first(turn)
                v[j : j + 3], v[j + 3 : j + 6] = velocity, rotation(turn).T @ spin
            elif kind == BALL:
                turn, spin = p.getJointStateMultiDof(self.body, link, self._client)[:2]
                q[i : i + 4], v[j : j + 3] = scalar_first(turn), spin
            else:
                q[i], v[j] = states[link][:2]
        return q, v

    def write(self, q: Array, v: Array) -> None:
        """Put it there, moving so."""
        for link, kind, i, j in self.joints:
            if kind == FREE_JOINT:
                turn = np.roll(q[i + 3 : i + 7], -1).tolist()
                p.resetBasePositionAndOrientation(self.body, q[i : i + 3].tolist(), turn, self._client)
                spin = matrix_of(q[i + 3 : i + 7]) @ v[j + 3 : j + 6]
                p.resetBaseVelocity(self.body, v[j : j + 3].tolist(), spin.tolist(), self._client)
            elif kind == BALL:
                turn = np.roll(q[i : i + 4], -1).tolist()
                p.resetJointStateMultiDof(self.body, link, turn, v[j : j + 3].tolist(), self._client)
            else:
                p.resetJointState(self.body, link, float(q[i]), float(v[j]), self._client)

    def moved(self, q: Array, x: Array) -> Array:
        """Coordinates moved by x, shape (v_size,), spins along the bodies' axes."""
        out = q.copy()
        for _, kind, i, j in self.joints:
            if kind in (HINGE, SLIDE):
                out[i] += x[j]
                continue
            if kind == FREE_JOINT:
                out[i : i + 3] += x[j : j + 3]
                i, j = i + 3, j + 3
            turn = product(out[i : i + 4], turned_by(x[j : j + 3]))
            out[i : i + 4] = turn / np.linalg.norm(turn)
        return out

    def between(self, q: Array, other: Array) -> Array:
        """What moves q to other, shape (v_size,)."""
        out = np.zeros(self.v_size)
        for _, kind, i, j in self.joints:
            if kind in (HINGE, SLIDE):
                out[j] = other[i] - q[i]
                continue
            if kind == FREE_JOINT:
                out[j : j + 3] = other[i : i + 3] - q[i : i + 3]
                i, j = i + 3, j + 3
            turn = product(q[i : i + 4] * [1.0, -1.0, -1.0, -1.0], other[i : i + 4])
            turn = turn if turn[0] >= 0.0 else -turn
            sine = float(np.linalg.norm(turn[1:]))
            out[j : j + 3] = 2.0 * (np.arctan2(sine, turn[0]) / sine if sine > 0.0 else 1.0) * turn[1:]
        return out

    def receive(self, world: Arrays, gravity: tuple[float, float, float]) -> None:
        """Take where it is at the start of a step; what its place lacks is put right."""
        q, v = self.read()
        if not np.isfinite(np.concatenate([q, v])).all():
            raise ValueError(f"body {self.body}: its joints' positions or velocities are not finite")
        off = np.abs(self.between(self.moved(self.left[0], self.ahead * v), q)).max(initial=0.0)
        self.strange = not off <= EXACT * (1.0 + np.abs(q).max(initial=0.0))
        if self.strange:
            self.force[:], self.push[:], self.pressed = 0.0, 0.0, False
        elif self.ahead > 0.0:
            self.force += self.matrix @ (v - self.left[1]) / self.ahead
        if self.lacks is not None and not self.strange:
            q, old = self.moved(q, self.lacks), q
            v = self.along(v, old, q)
            self.write(q, v)
        self.lacks = None
        self.start = q, v
        tree = world.trees[self.number]
        tree["gravity"] = gravity
        if not self.free:
            x, turn = p.getBasePositionAndOrientation(self.body, self._client)
            tree["base"], tree["base_turn"] = x, scalar_first(turn)

    def set_out(self, world: Arrays, dt: float) -> None:
        """Place the world's tree at the start of the step, with its true velocity, and `force` on it."""
        q, v = self.start
        numbers(world, self.number, "f")[:] = self.force
        write_coordinates(world, self.number, q, v)
        self.own = numbers(world, self.number, "a").copy()
        self.matrix = mass_matrix(world, self.number)
        if not self.pressed:
            write_coordinates(world, self.number, q, v + 0.5 * dt * self.own)

    def compare(self, world: Arrays, dt: float) -> None:
        """After Bullet's step: what moved the joints in it."""
        self.after = self.read()
        if not np.isfinite(np.concatenate(self.after)).all():
            raise ValueError(f"body {self.body}: its joints' positions or velocities are not finite")
        gained = (self.after[1] - self.start[1]) / dt
        self.force = self.force + self.matrix @ (gained - self.push - self.own)
        self.set_out(world, dt)

    def hand_back(self, world: Arrays, dt: float, stepped: bool, pressed: bool) -> bool:
        """After the world's step; returns whether it must be pushed: PyBullet has yet to step."""
        own = slice(self.first + 1, self.first + 1 + self.rows.links.size)
        held = world.bodies["asleep"][own] + world.bodies["touched"][own]
        touched, self.pressed = bool(held.any()), pressed
        if not touched:
            self.push[:] = 0.0
            ahead = self.start[0], self.start[1] + dt * self.own
            self.left, self.ahead = (self.after, 0.0) if stepped else (ahead, dt)
            return False
        q, v = coordinates(world, self.number)
        if not pressed:
            v -= 0.5 * dt * numbers(world, self.number, "a")
        shown = self.along(v, q, self.start[0])  # Bullet turns a base about its spin, so that this is what will be read
        self.push = (shown - self.start[1]) / dt - self.own
        if stepped:
            self.write(q, v)
            self.left, self.ahead = (q, v), 0.0
            return False
        self.left, self.ahead = (self.start[0], shown), dt
        self.lacks = self.between(self.moved(self.start[0], dt * shown), q)
        write_coordinates(world, self.number, *self.start)  # where it will be pushed; it is read anew in the next step
        return True

    def along(self, v: Array, q: Array, other: Array) -> Array:
        """Velocities where the spin of the base, along its axes at q, is told along those at other coordinates."""
        out = v.copy()
        if self.free:
            out[3:6] = matrix_of(other[3:7]).T @ matrix_of(q[3:7]) @ v[3:6]
        return out

    def pushes(self, world: Arrays) -> list[tuple[int, Array, Array, Array]]:
        """Link, force, moment and place of what pushes its links as the world's tree stands."""
        out = []
        if not self.push.any():
            return out
        for member, (link, row) in enumerate(zip(self.heads, self.rows.links, strict=True)):
            body = world.bodies[self.first + 1 + member]
            gain = jacobian(world, self.number, member) @ self.push
            axes = body["axes"].reshape(3, 3)
            moment = axes @ (row["inertia"] * (axes.T @ gain[3:]))
            out.append((link, row["mass"] * gain[:3], moment, body["position"].copy()))
        return out

    @property
    def keys(self) -> list[Key]:
        """Body and link of each member."""
        return [(self.body, link) for link in self.heads]
