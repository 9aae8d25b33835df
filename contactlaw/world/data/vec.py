"""Vectors in space as tuples of three floats: no allocation, no reference counts, every component in a register."""

from math import sqrt

from contactlaw.jit import jit_module

ZERO = (0.0, 0.0, 0.0)


def load(a):
    """Return the first three numbers of an array as a vector."""
    return a[0], a[1], a[2]


def store(a_out, v):
    """Write a vector into the first three numbers of an array."""
    a_out[0] = v[0]
    a_out[1] = v[1]
    a_out[2] = v[2]


def add(a, b):
    """Return a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def sub(a, b):
    """Return a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def scale(s, a):
    """Return s a."""
    return s * a[0], s * a[1], s * a[2]


def axpy(s, a, b):
    """Return s a + b."""
    return b[0] + s * a[0], b[1] + s * a[1], b[2] + s * a[2]


def dot(a, b):
    """Return the scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a, b):
    """Return the vector product a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def norm(a):
    """Return the length."""
    return sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])


def to_world(m, a):
    """Return R a, of a matrix R (9,), row by row."""
    return (
        m[0] * a[0] + m[1] * a[1] + m[2] * a[2],
        m[3] * a[0] + m[4] * a[1] + m[5] * a[2],
        m[6] * a[0] + m[7] * a[1] + m[8] * a[2],
    )


def to_body(m, a):
    """Return R^T a."""
    return (
        m[0] * a[0] + m[3] * a[1] + m[6] * a[2],
        m[1] * a[0] + m[4] * a[1] + m[7] * a[2],
        m[2] * a[0] + m[5] * a[1] + m[8] * a[2],
    )


def tangent(n):
    """Return a unit vector across the unit vector n, a function of n alone."""
    e = cross(n, (1.0, 0.0, 0.0)) if abs(n[0]) < 0.6 else cross(n, (0.0, 1.0, 0.0))
    return scale(1.0 / norm(e), e)


jit_module(__name__)
