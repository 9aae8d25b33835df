"""The records of shapes, field by field, from what describes them: what engines and `World` fill `records.SHAPE` with.

Each function takes the body's row, and the matrix (3, 3) from the axes that places are given in to its principal ones.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from contactlaw.world import convex, ellipsoid
from contactlaw.world.records import BOX, ELLIPSOID, END, HULL, PLANE, SEGMENT, SPHERE, TANGENT, Array

Fields = dict[str, Any]


def sphere(row: int, turn: Array, radius: float, at: Array) -> Fields:
    """Radius and centre [m]."""
    return {"kind": SPHERE, "body": row, "radius": radius, "at": turn @ at}


def capsule(row: int, turn: Array, radius: float, at: Array, half: Array) -> list[Fields]:
    """Radius, middle, and the vector from there to an end of the middle line [m]; three shapes: side and both ends."""
    side = {"kind": SEGMENT, "body": row, "radius": radius, "at": turn @ at, "half": turn @ half}
    return [side, *(sphere(row, turn, radius, at + s * half) | {"kind": END} for s in (1.0, -1.0))]


def box(row: int, turn: Array, half_lengths: Array, at: Array, axes: Array) -> Fields:
    """Half lengths and centre [m]; axes: the box's own as columns (3, 3)."""
    return {"kind": BOX, "body": row, "half": half_lengths, "at": turn @ at, "axes": (turn @ axes).ravel()}


def ellipsoid_of(row: int, turn: Array, half_axes: Array, at: Array, axes: Array) -> Fields:
    """Half axes and centre [m]; axes: its own as columns (3, 3)."""
    return box(row, turn, half_axes, at, axes) | {"kind": ELLIPSOID} | ellipsoid.addresses()


def hull(row: int, turn: Array, radius: float, vertices: Array) -> list[Fields]:
    """Radius, and vertices (n, 3) of the core [m], from the centre of mass; n + 1 shapes: the hull and its vertices."""
    at = 0.5 * (vertices.max(0) + vertices.min(0))
    own = (vertices - at) @ turn.T
    whole = {"kind": HULL, "body": row, "radius": radius, "at": turn @ at, "vertices": own,
             "half": np.array([np.linalg.norm(own, axis=1).max(), 0.0, 0.0])}  # fmt: skip
    return [whole | convex.addresses(), *(sphere(row, turn, radius, vertex) | {"kind": END} for vertex in vertices)]


def plane(row: int, turn: Array, point: Array, normal: Array) -> Fields:
    """A point [m] and the unit normal, out of the half space."""
    return {"kind": PLANE, "body": row, "at": turn @ point, "normal": turn @ normal}


def tangent(row: int, partner: int, reach: float) -> Fields:
    """A plane to be placed before each step, which shape number `partner`, a sphere or an end, alone meets.

    reach: how far from the body's centre of mass its points may be [m]. Until it is placed (`at`, `normal`) nothing
    touches it: it is far away.
    """
    return {"kind": TANGENT, "body": row, "partner": partner, "radius": reach, "normal": np.array([0.0, 0.0, 1.0]),
            "at": np.array([0.0, 0.0, -1e6])}  # fmt: skip
