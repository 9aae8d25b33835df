"""Quaternions and principal axes of inertia in numpy, for what is computed once."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from contactlaw import checks
from contactlaw.world.data.records import Array

ALIKE = 1e-12  # relative difference of moments of inertia that are equal

ORIGIN, UNTURNED, UNIT = np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]), np.eye(3)
for _constant in (ORIGIN, UNTURNED, UNIT):
    _constant.flags.writeable = False
CONJUGATE = np.array([1.0, -1.0, -1.0, -1.0])
"""Factors of the components of a quaternion that make the one of the inverse rotation."""


def unit_quaternion(name: str, value: ArrayLike) -> Array:
    """Return a checked quaternion, scalar first, normalised."""
    if value is UNTURNED:
        return UNTURNED
    q = checks.finite_array(name, value)
    if q.shape != (4,) or not np.linalg.norm(q) > 0.0:
        raise ValueError(f"{name} = {q.tolist()}: must be four numbers, scalar first, not all zero")
    return q / np.linalg.norm(q)


def product(p: Array, q: Array) -> Array:
    """Return the product p q of two quaternions."""
    (s, x, y, z), (t, u, v, w) = p.tolist(), q.tolist()
    return np.array([
        s * t - (x * u + y * v + z * w), s * u + t * x + (y * w - z * v),
        s * v + t * y + (z * u - x * w), s * w + t * z + (x * v - y * u),
    ])  # fmt: skip


def matrix_of(q: Array) -> Array:
    """Return the rotation matrix (3, 3) of a unit quaternion."""
    w, v = q[0], q[1:]
    if q is UNTURNED or not v.any():
        return UNIT
    skew = np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
    return np.eye(3) + 2.0 * w * skew + 2.0 * skew @ skew


def quaternion_of(m: Array) -> Array:
    """Return the unit quaternion of a rotation matrix (3, 3), computed from its largest component."""
    squares = np.array([
        1.0 + m[0, 0] + m[1, 1] + m[2, 2], 1.0 + m[0, 0] - m[1, 1] - m[2, 2],
        1.0 - m[0, 0] + m[1, 1] - m[2, 2], 1.0 - m[0, 0] - m[1, 1] + m[2, 2],
    ])  # fmt: skip
    a, b, c = m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]
    d, e, f = m[1, 0] + m[0, 1], m[2, 0] + m[0, 2], m[2, 1] + m[1, 2]
    rows = np.array([[squares[0], a, b, c], [a, squares[1], d, e], [b, d, squares[2], f], [c, e, f, squares[3]]])
    row = rows[int(np.argmax(squares))]
    return row / np.linalg.norm(row)


class Pose(NamedTuple):
    """Position [m] and orientation (quaternion) of a frame in another one."""

    place: Array
    turn: Array

    def then(self, other: Pose) -> Pose:
        """Return the pose of a frame that is given relative to this one."""
        if self is IDENTITY or other is IDENTITY:
            return self if other is IDENTITY else other
        return Pose(self.place + matrix_of(self.turn) @ other.place, product(self.turn, other.turn))

    def inverse(self) -> Pose:
        """Return the pose of the outer frame in this one."""
        if self is IDENTITY or [*self.place.tolist(), *self.turn.tolist()] == [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]:
            return IDENTITY
        turn = self.turn * CONJUGATE
        return Pose(-matrix_of(turn) @ self.place, turn)


IDENTITY = Pose(ORIGIN, UNTURNED)


def turn_to(axis: Array) -> Array:
    """Return a rotation matrix (3, 3) whose third column is a given unit vector."""
    x = np.cross([0.0, 1.0, 0.0] if abs(axis[1]) < 0.6 else [0.0, 0.0, 1.0], axis)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(axis, x), axis])


def principal(inertia: ArrayLike) -> tuple[Array, Array]:
    """Return principal moments of inertia [kg m^2], and the quaternion of the principal axes in the body's axes.

    Args:
        inertia: [kg m^2]: one number, three moments about the body's axes, or a matrix (3, 3).

    Raises:
        ValueError: Not the inertia of a body: not positive, not symmetric, or one moment above the sum of the others.
    """
    value = checks.finite_array("inertia", inertia)
    if value.shape not in ((), (3,), (3, 3)):
        raise ValueError(f"inertia: shape {value.shape}; must be one number, (3,) or (3, 3)")
    moments, axes = value if value.ndim == 1 else np.full(3, value if value.ndim == 0 else 0.0), None
    if value.ndim == 2:
        if not np.abs(value - value.T).max() <= 1e-9 * np.abs(value).max():
            raise ValueError(f"inertia = {value.tolist()}: must be symmetric")
        if np.count_nonzero(value - np.diag(np.diag(value))) == 0:
            moments = np.diag(value)
        else:
            moments, axes = np.linalg.eigh(value)
            axes = axes * np.sign(np.linalg.det(axes))
    least, _, greatest = ordered = sorted(moments.tolist())
    if not (least > 0.0 and 2.0 * greatest <= sum(ordered) * (1.0 + 1e-9)):
        raise ValueError(f"inertia: principal moments {ordered}; must be > 0, none above the sum of the others")
    if greatest - least <= ALIKE * greatest:
        moments = np.full(3, sum(ordered) / 3.0)
    return moments.copy(), UNTURNED if axes is None else quaternion_of(axes)
