"""Round parts by which boxes, cylinders and hulls meet flat shapes."""

from itertools import product
from typing import Any

import numpy as np

from contactlaw.world.data.kinds import BOX, CORNER, CYLINDER, DISC, EDGE, HEIGHT_FIELD, HULL, PLANE, SIDE
from contactlaw.world.shapes.core import CROWN

Fields = dict[str, Any]

FEET = 0.7  # distance of a foot from the axis, of the radius of the rim


def parts_of(core: Fields, others: set[int]) -> list[Fields]:
    """Return the round parts by which a box, cylinder or hull meets flat shapes.

    others: kinds of the shapes that it may meet. Edges are rounded with the core's radius r, and all parts lie within
    the core. On a plane a box needs its CORNERs alone, spheres inscribed in its corners. With other cores and height
    fields it needs its EDGEs too: these are crowned, and set back by a hundredth of r, so that corners carry where they
    can. A cylinder rests on its rims, DISCs that reach to its side, and on four small feet an end, which leave the
    ground once the rim is lower by some hundredths of r. A hull has the same parts as a box.
    """
    flat, cores = others & {PLANE, HEIGHT_FIELD, BOX, CYLINDER, HULL}, others & {BOX, CYLINDER, HULL}
    if not flat:
        return []
    lined = cores | (others & {HEIGHT_FIELD})
    base, r = {"body": core["body"], "radius": core["radius"]}, core["radius"]
    if core["kind"] == HULL:
        own = core["at"] + core["vertices"]
        out = [base | {"kind": CORNER, "at": corner} for corner in own]
        for i, j in core["edges"] if lined else ():
            out.append(base | {"kind": EDGE, "at": 0.5 * (own[i] + own[j]), "half": 0.5 * (own[j] - own[i])})
        return out
    half, own = core["half"], core["axes"].reshape(3, 3)
    if core["kind"] == BOX:
        h = half - r
        ends = np.array(list(product((-1.0, 1.0), repeat=3)))
        out = [base | {"kind": CORNER, "at": core["at"] + own @ (h * end)} for end in ends]
        for i in range(3 if lined else 0):
            along = own[:, i] * h[i]
            middles = ends[ends[:, i] < 0.0] * (np.arange(3) != i)
            out += [base | {"kind": EDGE, "at": core["at"] + own @ (h * m), "half": along} for m in middles]
        return out
    radius, up, axis = half[0] - r * (1.0 - 2.0 * CROWN), (half[2] - r) * own[:, 2], own[:, 2]
    round_ = base | {"normal": axis}
    out = []
    for one in (up, -up):
        out.append(round_ | {"kind": DISC, "at": core["at"] + one, "half": radius * own[:, 0]})
        feet = (x * own[:, i] for i in (0, 1) for x in (FEET * radius, -FEET * radius))
        out += [base | {"kind": CORNER, "at": core["at"] + one + foot} for foot in feet]
    if lined & {CYLINDER, HEIGHT_FIELD}:
        out.append(round_ | {"kind": SIDE, "at": core["at"], "half": radius * own[:, 0] + up})
    return out
