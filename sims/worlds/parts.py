"""Parts of worlds: bodies, their state, settings of an engine, and rotations."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contactlaw.world.building import CROWD_SUBSTEPS, SUBSTEPS

Array = NDArray[np.float64]
Path = Callable[[float], ArrayLike]
"""Where a driven body's centre is [m], shape (3,), at a time [s]."""


@dataclass(frozen=True)
class Body:
    """A body of a world: the data of a `Track` at the start, and its path if it is driven."""

    name: str
    shape: str
    size: tuple[float, ...]
    mass: float
    inertia: tuple[float, float, float]
    position: Array
    velocity: Array
    spin: Array
    rotation: Array
    path: Path | None = None


class State(NamedTuple):
    """State of all bodies, in the order in which they were added; velocities are those at the time of the positions.

    position [m], velocity [m/s], spin (world frame) [rad/s]: shape (n, 3); rotation: to the world, shape (n, 3, 3).
    """

    position: Array
    rotation: Array
    velocity: Array
    spin: Array


@dataclass(frozen=True)
class Tuning:
    """Settings of an engine and its adapter beyond a scene's settings.

    Attributes:
        integrator: MuJoCo's.
        substeps: Number of the law's own steps in an impact, see `World`.
        collide: Whether bodies without the law touch by the engine's own contact.
        fixed_bodies_move: PyBullet: as `ContactCallback` has it; None: where a body is driven.
        crowd_substeps: Least number of substeps of a damped impact where many touch.
    """

    integrator: str = "Euler"
    substeps: int = SUBSTEPS
    collide: bool = False
    fixed_bodies_move: bool | None = None
    crowd_substeps: int = CROWD_SUBSTEPS


def matrix_to_quaternion(matrix: Array) -> Array:
    """Unit quaternion (w, x, y, z) of a rotation matrix."""
    # The four candidates of Shepperd; the largest one is the best conditioned.
    m = matrix
    trace = np.trace(m)
    squares = np.array([trace, m[0, 0], m[1, 1], m[2, 2]])
    largest = int(np.argmax(squares))
    if largest == 0:
        q = np.array([1.0 + trace, m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]])
    else:
        i, j, k = ((0, 1, 2), (1, 2, 0), (2, 0, 1))[largest - 1]
        q = np.empty(4)
        q[0] = m[k, j] - m[j, k]
        q[1 + i] = 1.0 + m[i, i] - m[j, j] - m[k, k]
        q[1 + j], q[1 + k] = m[j, i] + m[i, j], m[k, i] + m[i, k]
    return q / np.linalg.norm(q)


def turned(axis: ArrayLike, angle: float) -> Array:
    """The rotation by an angle [rad] about a unit vector, as a matrix."""
    skew = np.cross(np.asarray(axis, dtype=float), np.eye(3)).T
    return np.eye(3) + np.sin(angle) * skew + (1.0 - np.cos(angle)) * skew @ skew


def onto(normal: Array) -> Array:
    """The least rotation, as a matrix, that brings the z axis onto a unit vector."""
    x, y, z = normal
    if z < -1.0 + 1e-12:
        return np.diag([1.0, -1.0, -1.0])
    cross = np.array([[0.0, 0.0, x], [0.0, 0.0, y], [-x, -y, 0.0]])  # of z x n
    return np.eye(3) + cross + cross @ cross / (1.0 + z)
