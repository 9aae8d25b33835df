"""The round parts by which boxes, cylinders and hulls meet what is flat."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np

from contactlaw.world.data.records import BOX, CORNER, CYLINDER, DISC, EDGE, HEIGHT_FIELD, HULL, PLANE, SIDE
from contactlaw.world.shapes import disc
from contactlaw.world.shapes.core import CROWN

Fields = dict[str, Any]

FEET = 0.7  # of the radius of a rim, where the feet of a cylinder's end are


def parts_of(core: Fields, others: set[int]) -> list[Fields]:
    """The round parts by which a box, cylinder or hull meets flat things; others: kinds of shapes that it may meet.

    Edges are rounded with the core's radius r, and all parts lie within the core. On a plane a box stands on its
    CORNERs alone, spheres that touch its faces from within. With other cores its EDGEs are needed too: they are
    crowned, and set back by a hundredth of r where corners carry. A cylinder lies on its rims, DISCs whose border
    reaches to its side, and stands on four small feet, off the ground once the rim is lower by some hundredths of r.
    Those of a hull are the same as those of a box.
    """
    flat, cores = others & {PLANE, HEIGHT_FIELD, BOX, CYLINDER, HULL}, others & {BOX, CYLINDER, HULL}
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
