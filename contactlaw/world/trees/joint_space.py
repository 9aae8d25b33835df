"""Displacements in the coordinates of a tree, in which rotations are quaternions."""

from __future__ import annotations

import numpy as np

from contactlaw.world.data.frames import CONJUGATE, product
from contactlaw.world.data.records import FREE_JOINT, HINGE, SLIDE, Array


class JointSpace:
    """The coordinates of a tree and displacements in them, shape (v_size,), rotations along the bodies' axes [rad].

    Attributes:
        scalar_q, scalar_v: Where the coordinates and the displacements of hinges and slides are.
    """

    def __init__(self, joints: Array) -> None:
        own = joints[["kind", "first_q", "first_axis"]].tolist()
        scalars = [joint for joint in own if joint[0] in (HINGE, SLIDE)]
        self.scalar_q, self.scalar_v = ([joint[i] for joint in scalars] for i in (1, 2))
        self._turns: list[tuple[int, int]] = []  # where quaternions and rotations begin
        self._places: list[tuple[int, int]] = []  # where positions and their displacements begin
        for kind, q, v in own:
            if kind == FREE_JOINT:
                self._places.append((q, v))
            if kind not in (HINGE, SLIDE):
                self._turns.append((q + 3, v + 3) if kind == FREE_JOINT else (q, v))

    def moved(self, q: Array, x: Array) -> Array:
        """Return coordinates q displaced by x."""
        out = q.copy()
        out[self.scalar_q] += x[self.scalar_v]
        for i, j in self._places:
            out[i : i + 3] += x[j : j + 3]
        for i, j in self._turns:
            turn = product(out[i : i + 4], _turned_by(x[j : j + 3]))
            out[i : i + 4] = turn / np.linalg.norm(turn)
        return out

    def between(self, q: Array, other: Array) -> Array:
        """Return the displacement from coordinates q to others."""
        out = np.zeros(len(self.scalar_v) + 3 * (len(self._places) + len(self._turns)))
        out[self.scalar_v] = other[self.scalar_q] - q[self.scalar_q]
        for i, j in self._places:
            out[j : j + 3] = other[i : i + 3] - q[i : i + 3]
        for i, j in self._turns:
            turn = product(q[i : i + 4] * CONJUGATE, other[i : i + 4])
            turn = turn if turn[0] >= 0.0 else -turn
            sine = float(np.linalg.norm(turn[1:]))
            out[j : j + 3] = 2.0 * (np.arctan2(sine, turn[0]) / sine if sine > 0.0 else 1.0) * turn[1:]
        return out


def _turned_by(turn: Array) -> Array:
    """Return the quaternion of a rotation vector [rad]."""
    angle = float(np.linalg.norm(turn))
    return np.array([np.cos(0.5 * angle), *(0.5 * np.sinc(0.5 * angle / np.pi) * turn)])
