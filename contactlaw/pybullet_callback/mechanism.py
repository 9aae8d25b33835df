"""Bodies with links: how they stand and move, and how easily their links give way."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pybullet as p
from numpy.typing import NDArray

from contactlaw.pybullet_callback.shapes import BASE, rotation

Array = NDArray[np.float64]
Vector = tuple[float, float, float]


class Motion(NamedTuple):
    """Centre of mass [m], orientation (quaternion), velocity of the centre of mass [m/s], angular velocity [rad/s]."""

    position: Vector
    orientation: tuple[float, float, float, float]
    velocity: Vector
    spin: Vector


def read_motion(client: int, body: int, link: int) -> Motion:
    """Where the body is and how it moves, now."""
    if link == BASE:
        return Motion(*p.getBasePositionAndOrientation(body, client), *p.getBaseVelocity(body, client))
    state = p.getLinkState(body, link, 1, 1, client)
    return Motion(state[0], state[1], state[6], state[7])


class Mechanism:
    """A body with its links as it stands: mass matrix and Jacobians, world frame; coordinates: base, then joints.

    PyBullet's own calculateMassMatrix keeps the masses of its first call, changeDynamics or not, and it and
    calculateJacobian are in the frame of the base: hence this one, from the poses and masses of the moment.

    Attributes:
        mass_matrix: shape (n, n), n = 6 for a free body, 0 for a fixed one, and the degrees of freedom of its joints.
        weight: Generalized force of a unit acceleration of gravity, shape (n, 3).
    """

    def __init__(self, client: int, body: int) -> None:
        self._axes: list[Array] = []
        self._origins: list[Array] = []
        self._turning: list[bool] = []
        self._columns: dict[int, list[int]] = {}  # of each link: the coordinates that move it
        links = [BASE, *range(p.getNumJoints(body, client))]
        dynamics = {link: p.getDynamicsInfo(body, link, client) for link in links}
        poses = {link: _pose(client, body, link) for link in links}
        for link in links:
            self._add_joint(client, body, link, poses[link], dynamics[link])
        n = len(self._axes)
        self.mass_matrix, self.weight = np.zeros((n, n)), np.zeros((n, 3))
        for link in links:
            centre, turn = poses[link]
            mass, inertia = dynamics[link][0], dynamics[link][2]
            linear, angular = self.jacobian(link, centre), self.turning(link)
            local = turn.T @ angular
            self.weight += mass * linear.T
            self.mass_matrix += mass * linear.T @ linear + local.T @ (np.array(inertia)[:, None] * local)

    def _add_joint(self, client: int, body: int, link: int, pose: tuple[Array, Array], dynamics: tuple) -> None:
        """Note the coordinates of the joint that leads to a link; the base of a free body has six."""
        centre, turn = pose
        if link == BASE:
            self._columns[BASE] = []
            if dynamics[0] > 0.0:
                self._add(BASE, np.eye(3), centre, turning=False)
                self._add(BASE, np.eye(3), centre, turning=True)
            return
        info = p.getJointInfo(body, link, client)
        self._columns[link] = list(self._columns[info[16]])
        # dynamics[3], [4]: the inertial frame, in which the pose is given, as seen from the joint's frame; the joint's
        # own frame comes from getLinkState in single precision only.
        origin = centre - turn @ rotation(dynamics[4]).T @ np.array(dynamics[3])
        if info[2] == p.JOINT_SPHERICAL:
            self._add(link, np.eye(3), origin, turning=True)
        elif info[2] in (p.JOINT_REVOLUTE, p.JOINT_PRISMATIC):
            self._add(link, (turn @ np.array(info[13]))[None], origin, turning=info[2] == p.JOINT_REVOLUTE)

    def _add(self, link: int, axes: Array, origin: Array, *, turning: bool) -> None:
        for axis in axes:
            self._columns[link].append(len(self._axes))
            self._axes.append(axis)
            self._origins.append(origin)
            self._turning.append(turning)

    def jacobian(self, link: int, point: Array) -> Array:
        """Velocity of the link's material point here [m], per coordinate; shape (3, n)."""
        out = np.zeros((3, len(self._axes)))
        for i in self._columns[link]:
            axis = self._axes[i]
            out[:, i] = np.cross(axis, point - self._origins[i]) if self._turning[i] else axis
        return out

    def jacobian_of(self, link: int, centre: Array) -> Array:
        """Velocity of a link at its centre [m], then its angular velocity, per coordinate; shape (6, n)."""
        return np.vstack([self.jacobian(link, centre), self.turning(link)])

    def turning(self, link: int) -> Array:
        """Angular velocity of the link, per coordinate; shape (3, n)."""
        out = np.zeros((3, len(self._axes)))
        for i in self._columns[link]:
            if self._turning[i]:
                out[:, i] = self._axes[i]
        return out

    def answer(self, forces: Array) -> Array:
        """M^-1 of generalized forces, shape (n, k); a coordinate without inertia is locked, as in Bullet."""
        free = np.diag(self.mass_matrix) > 0.0
        out = np.zeros_like(forces)
        if free.any():
            out[free] = np.linalg.solve(self.mass_matrix[np.ix_(free, free)], forces[free])
        return out

    def mobility(self, jacobian: Array) -> Array:
        """J M^-1 J^T [1/kg], shape (3, 3)."""
        return jacobian @ self.answer(jacobian.T)


def coordinates(client: int, body: int) -> int:
    """How many coordinates a body with its links has."""
    count = 6 if p.getDynamicsInfo(body, BASE, client)[0] > 0.0 else 0
    sizes = {p.JOINT_SPHERICAL: 3, p.JOINT_REVOLUTE: 1, p.JOINT_PRISMATIC: 1}
    return count + sum(
        sizes.get(p.getJointInfo(body, joint, client)[2], 0) for joint in range(p.getNumJoints(body, client))
    )


def _pose(client: int, body: int, link: int) -> tuple[Array, Array]:
    """Centre of mass [m] and rotation of the inertial frame."""
    motion = read_motion(client, body, link)
    return np.array(motion.position), rotation(motion.orientation)
