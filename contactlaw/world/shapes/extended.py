"""Shapes that are more than a sphere: sides of capsules, edges, boxes and cylinders, their rims and sides.

What is asked of them is called by its address, so that it is compiled where there are any; hulls and ellipsoids have
their own of some of it, see `convex` and `ellipsoid`.
"""

from __future__ import annotations

from functools import lru_cache
from math import sqrt

import numpy as np

from contactlaw.jit import address_of
from contactlaw.world.data.call import FACE, MEETING, RADIUS, TIME, ask_deepest
from contactlaw.world.data.records import DISC, EDGE, SEGMENT, SIDE
from contactlaw.world.data.vec import add, axpy, dot, load, scale, sub, to_world
from contactlaw.world.shapes.core import deepest_on_line, lies_over_face, nearest_on_core
from contactlaw.world.shapes.curvature import radius_between, rim, side_at
from contactlaw.world.shapes.geometry import OF_FACE, OF_MEETING, OF_RADIUS, OF_TIME, centre, half_axis, round_on_round
from contactlaw.world.shapes.segments import CROWN, nearest_on_segments
from contactlaw.world.shapes.side import predict_side

TABLE = np.zeros(4, np.uint64)
"""Addresses, see `geometry.OF_MEETING` and those after it."""


def meet(sa, a, sb, b):
    """`geometry.meet` of a shape with a segment or a core."""
    from_a, from_b = centre(sa, a), centre(sb, b)
    d = add(sub(load(a.position), load(b.position)), sub(from_a, from_b))
    if sb.kind == SEGMENT:
        u, v = half_axis(sa, a), half_axis(sb, b)
        s, t = nearest_on_segments(d, u, sa.radius, v, sb.radius)
        d = sub(axpy(s, u, d), scale(t, v))
        radius_a, radius_b = sa.radius * (1.0 - CROWN * s * s), sb.radius * (1.0 - CROWN * t * t)
        return round_on_round(radius_a, axpy(s, u, from_a), radius_b, axpy(t, v, from_b), d)
    radius, rounding = sa.radius, sb.radius if sa.kind >= EDGE else 0.0
    if sa.kind == SEGMENT or sa.kind == EDGE:
        u = half_axis(sa, a)
        s, radius, _ = deepest_on_line(d, u, rounding, (sa, a, sb, b))
        d, from_a = axpy(s, u, d), axpy(s, u, from_a)
    elif sa.kind == DISC or sa.kind == SIDE:
        way, radius = ask_deepest(sa.deepest, sa, a, sb, b, d)
        d, from_a = add(d, way), add(from_a, way)
    far, n = nearest_on_core(d, sb, b, rounding)
    arm = axpy(-radius, n, from_a)
    return radius - far, n, arm, add(arm, sub(load(a.position), load(b.position)))


def radius(sa, a, sb, b):
    """`geometry.effective_radius` of two segments or a sphere and one, or of a cylinder's rim or side."""
    if sa.kind == DISC:
        return rim(sa, a)
    if sa.kind == SIDE:
        along, axis = dot(load(sa.half), load(sa.normal)), (0.0, 0.0, 1.0)
        across = sqrt(dot(load(sa.half), load(sa.half)) - along * along)
        one = 0.0, 1.0 / (sa.radius + across), to_world(a.axes, load(sa.normal))
        return radius_between(one, (0.0, 1.0 / sb.half[0], to_world(b.axes, to_world(sb.axes, axis))))
    u, v = half_axis(sa, a), half_axis(sb, b)
    d = add(sub(load(a.position), load(b.position)), sub(centre(sa, a), centre(sb, b)))
    s, t = nearest_on_segments(d, u, sa.radius, v, sb.radius)
    return radius_between(side_at(sa, u, s, CROWN), side_at(sb, v, t, CROWN))


@lru_cache
def address() -> int:
    """Of the table, filled; what is in it is compiled where there are such shapes."""
    TABLE[OF_MEETING], TABLE[OF_RADIUS] = address_of(meet, MEETING), address_of(radius, RADIUS)
    TABLE[OF_TIME], TABLE[OF_FACE] = address_of(predict_side, TIME), address_of(lies_over_face, FACE)
    return TABLE.ctypes.data
