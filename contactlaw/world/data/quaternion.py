"""Quaternions as tuples of four floats, scalar first, and rotation vectors."""

from math import atan2, copysign, cos, sin, sqrt

from contactlaw.jit import jit_module
from contactlaw.world.data.vec import ZERO, add, cross, dot, norm, scale

SMALL_ANGLE = 0.03  # [rad] below which sine and cosine are taken from their series, exact to rounding


def half_turn(angle2):
    """Return cos(angle/2), and sin(angle/2) over the angle [1/rad]; angle2: the angle squared."""
    if angle2 < SMALL_ANGLE * SMALL_ANGLE:
        x = 0.25 * angle2
        c = 1.0 - x * (0.5 - x * (1.0 / 24.0 - x * (1.0 / 720.0)))  # no division, which would take as long as the rest
        return c, 0.5 - x * (1.0 / 12.0 - x * (1.0 / 240.0 - x * (1.0 / 10080.0)))
    angle = sqrt(angle2)
    return cos(0.5 * angle), sin(0.5 * angle) / angle


def rotate(turn, a):
    """Return the vector a rotated by a rotation vector [rad] (Rodrigues' formula in half angles)."""
    c, s = half_turn(dot(turn, turn))
    q = scale(s, turn)
    t = scale(2.0, cross(q, a))
    return add(a, add(scale(c, t), cross(q, t)))


def rotation(turn):
    """Return the quaternion of a rotation vector [rad]."""
    c, s = half_turn(dot(turn, turn))
    return c, s * turn[0], s * turn[1], s * turn[2]


def rotation_vector(q):
    """The rotation vector [rad], by half a turn at most, of a quaternion of length one."""
    way = q[1], q[2], q[3]
    half = norm(way)
    return scale(copysign(2.0 * atan2(half, abs(q[0])) / half, q[0]), way) if half > 0.0 else ZERO


def unit(q):
    """Return a quaternion normalised."""
    one = 1.0 / sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    return one * q[0], one * q[1], one * q[2], one * q[3]


def conjugate(q):
    """Return the conjugate of a quaternion: the inverse of a rotation."""
    return q[0], -q[1], -q[2], -q[3]


def product(p, q):
    """Return the product p q of two quaternions, scalar first: rotation by q, then by p."""
    return (
        p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3],
        p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
        p[0] * q[2] + p[2] * q[0] + p[3] * q[1] - p[1] * q[3],
        p[0] * q[3] + p[3] * q[0] + p[1] * q[2] - p[2] * q[1],
    )


def turn_by(q, a):
    """Return the vector a rotated by a unit quaternion."""
    u = (q[1], q[2], q[3])
    t = scale(2.0, cross(u, a))
    return add(a, add(scale(q[0], t), cross(u, t)))


def load4(a):
    """Return the first four numbers of an array as a quaternion."""
    return a[0], a[1], a[2], a[3]


def store4(a_out, q):
    """Write a quaternion into the first four numbers of an array."""
    a_out[0] = q[0]
    a_out[1] = q[1]
    a_out[2] = q[2]
    a_out[3] = q[3]


jit_module(__name__)
