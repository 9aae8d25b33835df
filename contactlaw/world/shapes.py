"""The records of shapes, field by field, from what describes them: what engines and `World` fill `records.SHAPE` with.

Each function takes the body's row, and the matrix (3, 3) from the axes that places are given in to its principal ones.
"""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np

from contactlaw import checks
from contactlaw.world import convex, disc, ellipsoid
from contactlaw.world.core import CROWN
from contactlaw.world.hulls import core_of
from contactlaw.world.records import (
    BOX,
    CORNER,
    CYLINDER,
    DISC,
    EDGE,
    ELLIPSOID,
    END,
    HULL,
    PLANE,
    SEGMENT,
    SIDE,
    SPHERE,
    TANGENT,
    Array,
)

Fields = dict[str, Any]

ROUNDING = 0.1  # of the smallest half length of a box or a cylinder, the radius of its edges unless told otherwise
FEET = 0.7  # of the radius of a rim, where the feet of a cylinder's end are


def sphere(row: int, turn: Array, radius: float, at: Array) -> Fields:
    """Radius and centre [m]."""
    return {"kind": SPHERE, "body": row, "radius": radius, "at": turn @ at}


def capsule(row: int, turn: Array, radius: float, at: Array, half: Array) -> list[Fields]:
    """Radius, middle, and the vector from there to an end of the middle line [m]; three shapes: side and both ends."""
    side = {"kind": SEGMENT, "body": row, "radius": radius, "at": turn @ at, "half": turn @ half}
    return [side, *(sphere(row, turn, radius, at + s * half) | {"kind": END} for s in (1.0, -1.0))]


def box(row: int, turn: Array, half_lengths: Array, at: Array, axes: Array, rounding: float | None) -> Fields:
    """Half lengths and centre [m]; axes: the box's own as columns (3, 3); rounding: see `ROUNDING`."""
    least = float(half_lengths.min())
    radius = ROUNDING * least if rounding is None else checks.positive("rounding", rounding)
    if radius > 0.5 * least:
        raise ValueError(f"rounding = {radius}: must be at most half of the smallest half length, {0.5 * least}")
    return {"kind": BOX, "body": row, "half": half_lengths, "at": turn @ at, "axes": (turn @ axes).ravel(),
            "radius": radius} | convex.parting()  # fmt: skip


def cylinder(row: int, turn: Array, sizes: Array, at: Array, axes: Array, rounding: float | None) -> Fields:
    """Radius and half length, and centre [m]; axes: its own as columns (3, 3), the third along it."""
    curve = disc.addresses()["curve"]
    return box(row, turn, sizes[[0, 0, 1]], at, axes, rounding) | {"kind": CYLINDER, "curve": curve}


def parts_of(core: Fields, others: set[int]) -> list[Fields]:
    """The round parts by which a box, cylinder or hull meets flat things; others: kinds of shapes that it may meet.

    Edges are rounded with the core's radius r, and all parts lie within the core. On a plane a box stands on its
    CORNERs alone, spheres that touch its faces from within. With other cores its EDGEs are needed too: they are
    crowned, and set back by a hundredth of r where corners carry. A cylinder lies on its rims, DISCs whose border
    reaches to its side, and stands on four small feet, off the ground once the rim is lower by some hundredths of r.
    Those of a hull are the same as those of a box.
    """
    flat, cores = others & {PLANE, BOX, CYLINDER, HULL}, others & {BOX, CYLINDER, HULL}
    if not flat:
        return []
    base, r = {"body": core["body"], "radius": core["radius"]}, core["radius"]
    if core["kind"] == HULL:
        own = core["at"] + core["vertices"]
        out = [base | {"kind": CORNER, "at": corner} for corner in own]
        for i, j in core["edges"] if cores else ():
            out.append(base | {"kind": EDGE, "at": 0.5 * (own[i] + own[j]), "half": 0.5 * (own[j] - own[i])})
        return out
    half, own = core["half"], core["axes"].reshape(3, 3)
    if core["kind"] == BOX:
        h = half - r
        ends = np.array(list(product((-1.0, 1.0), repeat=3)))
        out = [base | {"kind": CORNER, "at": core["at"] + own @ (h * end)} for end in ends]
        for i in range(3 if cores else 0):
            along = own[:, i] * h[i]
            middles = ends[ends[:, i] < 0.0] * (np.arange(3) != i)
            out += [base | {"kind": EDGE, "at": core["at"] + own @ (h * m), "half": along} for m in middles]
        return out
    radius, up, axis = half[0] - r * (1.0 - 2.0 * CROWN), (half[2] - r) * own[:, 2], own[:, 2]
    round_ = base | {"normal": axis, "deepest": disc.addresses()["deepest"]}
    out = []
    for one in (up, -up):
        out.append(round_ | {"kind": DISC, "at": core["at"] + one, "half": radius * own[:, 0]})
        feet = (x * own[:, i] for i in (0, 1) for x in (FEET * radius, -FEET * radius))
        out += [base | {"kind": CORNER, "at": core["at"] + one + foot} for foot in feet]
    if CYLINDER in cores:
        out.append(round_ | {"kind": SIDE, "at": core["at"], "half": radius * own[:, 0] + up})
    return out


def ellipsoid_of(row: int, turn: Array, half_axes: Array, at: Array, axes: Array) -> Fields:
    """Half axes and centre [m]; axes: its own as columns (3, 3)."""
    own = {"kind": ELLIPSOID, "body": row, "half": half_axes, "at": turn @ at, "axes": (turn @ axes).ravel()}
    return own | ellipsoid.addresses()


def hull(row: int, turn: Array, points: Array, at: Array, axes: Array, rounding: float | None) -> Fields:
    """Points (n, 3) [m] along axes, as columns (3, 3), from a place; rounding: radius of its edges, see `hulls`."""
    vertices, edges, radius = core_of(points, rounding)
    own = vertices @ (turn @ axes).T
    middle = 0.5 * (own.max(0) + own.min(0))
    own -= middle
    reach = float(np.linalg.norm(own, axis=1).max()) + radius
    return {"kind": HULL, "body": row, "radius": radius, "at": turn @ at + middle, "half": np.array([reach, 0.0, 0.0]),
            "vertices": own, "edges": edges} | convex.addresses() | convex.parting()  # fmt: skip


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
