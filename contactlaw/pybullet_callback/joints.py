"""A body of PyBullet with joints: its coordinates, and the tree that it makes."""

from __future__ import annotations

from math import isfinite
from types import SimpleNamespace
from typing import Any

import numpy as np
import pybullet as p

from contactlaw.pybullet_callback.shapes import BASE, KINDS, rotation
from contactlaw.world.frames import UNTURNED, matrix_of, product, quaternion_of
from contactlaw.world.records import BALL, FREE_JOINT, HINGE, SLIDE, Array
from contactlaw.world.tree import ZERO
from contactlaw.world.tree_rows import Q_SIZE, V_SIZE, TreeRows

LEAST_INERTIA = 1e-12  # [m^2] over the mass


def turned_by(turn: Array) -> Array:
    """The quaternion of a rotation vector [rad]."""
    angle = float(np.linalg.norm(turn))
    return np.array([np.cos(0.5 * angle), *(0.5 * np.sinc(0.5 * angle / np.pi) * turn)])


def axes_of(quaternion: Array) -> Array:
    """The rotation matrix (3, 3) of a quaternion, scalar first; as `frames.matrix_of`, by PyBullet, faster."""
    w, x, y, z = quaternion.tolist()
    return rotation((x, y, z, w))


class Joints:
    """The joints of a body of PyBullet, and the bodies that they hold.

    Attributes:
        joints: Kind and first places, among coordinates and velocities, of each joint; link -1: the free base.
        rows: As the world keeps it.
        links: PyBullet's links that are in the tree, in their order.
    """

    def __init__(self, client: int, body: int) -> None:
        self._client, self.body = client, body
        infos = [p.getJointInfo(body, link, client) for link in range(p.getNumJoints(body, client))]
        self._all = range(BASE, len(infos))
        self.known = self.inertias()
        dynamics = dict(zip(self._all, self.known, strict=True))
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
            self.q_size, self.v_size = self.q_size + Q_SIZE[kind], self.v_size + V_SIZE[kind]
        scalars = [joint for joint in self.joints if joint[1] in (HINGE, SLIDE)]
        self._heads = [joint[0] for joint in self.joints if joint[1] != FREE_JOINT]
        self._own = [joint[1:] for joint in self.joints if joint[1] != FREE_JOINT]
        self.scalar_q, self.scalar_v = ([joint[i] for joint in scalars] for i in (2, 3))
        self.torque = np.zeros(len(scalars))
        self._others = [joint for joint in self.joints if joint[1] not in (HINGE, SLIDE)]
        index = {joint[0]: number for number, joint in enumerate(self.joints)}
        joint_at, axes = np.zeros((len(index), 3)), np.tile((0.0, 0.0, 1.0), (len(index), 1))
        stands = {BASE: (np.zeros(3), np.eye(3))}  # in the base's inertial frame, what does not move against it
        places, count = [stands[BASE]] * self.free, len(self.links)
        for link, info in enumerate(infos):  # the joint is told in its inertial frame, and turns it back
            at, turn = -rotation(dynamics[link][3]).T @ dynamics[link][2], rotation(info[15]).T
            origin, frame = stands.get(info[16], stands[BASE])
            place = origin + frame @ (info[14] - turn @ at), frame @ turn
            if moves[link]:
                places.append(place)
            else:
                stands[link] = place
            if link in index:
                joint_at[index[link]] = at
                axes[index[link]] = info[13] if kinds[link] in (HINGE, SLIDE) else (0.0, 0.0, 1.0)
        joint_count = [int(link in index) for link in self.links]
        parents = {link: number for number, link in enumerate(self.links)}
        self.rows = TreeRows(
            SimpleNamespace(
                body_parentid=[-1 if link == BASE else parents.get(infos[link][16], -1) for link in self.links],
                body_jntnum=joint_count, body_jntadr=np.cumsum([0, *joint_count])[:-1],
                body_pos=[place[0] for place in places], body_quat=[quaternion_of(place[1]) for place in places],
                body_ipos=np.zeros((count, 3)), body_iquat=np.tile(UNTURNED, (count, 1)),
                body_mass=[dynamics[link][0] for link in self.links],
                body_inertia=[np.maximum(dynamics[link][1], LEAST_INERTIA * dynamics[link][0]) for link in self.links],
                jnt_type=[joint[1] for joint in self.joints], jnt_pos=joint_at, jnt_axis=axes,
                jnt_qposadr=[joint[2] for joint in self.joints], jnt_dofadr=[joint[3] for joint in self.joints],
                qpos0=np.concatenate([ZERO[kind] for kind in kinds.values()]),
                dof_armature=np.zeros(self.v_size), dof_damping=np.zeros(self.v_size),
            ),
            range(count),
        )  # fmt: skip
        self.heads = [link for link in self.links if link in index]

    def inertias(self) -> list[tuple[Any, ...]]:
        """Masses, moments and where they are, of all links, as PyBullet has them now."""
        dynamics = (p.getDynamicsInfo(self.body, link, self._client) for link in self._all)
        return [(one[0], *one[2:5]) for one in dynamics]

    def place_of(self, link: int) -> tuple[int, Array, Array]:
        """Member of the tree that a link is part of, and where its inertial frame is in that one's principal axes."""
        i = self.links.index(link)
        return int(self.rows.row[i]), self.rows.at[i], matrix_of(self.rows.quaternion[i])

    def read(self) -> tuple[Array, Array]:
        """Coordinates and velocities as PyBullet has them; `torque`: of motors, of hinges and slides."""
        q: list[float] = []
        v: list[float] = []
        if self.free:
            x, turn = p.getBasePositionAndOrientation(self.body, self._client)
            velocity, spin = p.getBaseVelocity(self.body, self._client)
            q, v = [*x, turn[3], *turn[:3]], [*velocity, *(rotation(turn).T @ spin).tolist()]
        if self._heads:
            torques = []
            for place, speed, _, torque in p.getJointStatesMultiDof(self.body, self._heads, self._client):
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
        """Put it there, moving so."""
        if self._heads:
            places, speeds = q.tolist(), v.tolist()
            p.resetJointStatesMultiDof(
                self.body, self._heads,
                [[*places[i + 1 : i + 4], places[i]] if kind == BALL else [places[i]] for kind, i, _ in self._own],
                [speeds[j : j + 3] if kind == BALL else [speeds[j]] for kind, _, j in self._own], self._client,
            )  # fmt: skip
        if self.free:
            x, y, z, *turn = q[:7].tolist()
            p.resetBasePositionAndOrientation(self.body, (x, y, z), [*turn[1:], turn[0]], self._client)
            p.resetBaseVelocity(self.body, v[:3].tolist(), (axes_of(q[3:7]) @ v[3:6]).tolist(), self._client)

    def moved(self, q: Array, x: Array) -> Array:
        """Coordinates moved by x, shape (v_size,), spins along the bodies' axes."""
        out = q.copy()
        out[self.scalar_q] += x[self.scalar_v]
        for _, kind, i, j in self._others:
            if kind == FREE_JOINT:
                out[i : i + 3] += x[j : j + 3]
                i, j = i + 3, j + 3
            turn = product(out[i : i + 4], turned_by(x[j : j + 3]))
            out[i : i + 4] = turn / np.linalg.norm(turn)
        return out

    def between(self, q: Array, other: Array) -> Array:
        """What moves q to other, shape (v_size,)."""
        out = np.zeros(self.v_size)
        out[self.scalar_v] = other[self.scalar_q] - q[self.scalar_q]
        for _, kind, i, j in self._others:
            if kind == FREE_JOINT:
                out[j : j + 3] = other[i : i + 3] - q[i : i + 3]
                i, j = i + 3, j + 3
            turn = product(q[i : i + 4] * [1.0, -1.0, -1.0, -1.0], other[i : i + 4])
            turn = turn if turn[0] >= 0.0 else -turn
            sine = float(np.linalg.norm(turn[1:]))
            out[j : j + 3] = 2.0 * (np.arctan2(sine, turn[0]) / sine if sine > 0.0 else 1.0) * turn[1:]
        return out

    def along(self, v: Array, q: Array, other: Array) -> Array:
        """Velocities where the spin of the base, along its axes at q, is told along those at other coordinates."""
        out = v.copy()
        if self.free:
            out[3:6] = axes_of(other[3:7]).T @ (axes_of(q[3:7]) @ v[3:6])
        return out
