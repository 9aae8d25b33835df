"""Convex bodies: a core, and the small radius that sweeps it. Where two of them are nearest.

While they overlap by less than both radii their cores are apart: the vector between the nearest points of these is
unique, and moves continuously. Flat on flat, a hull lies on its vertices, which are shapes of their own; of two hulls
the cores meet where edges cross.
"""

from __future__ import annotations

from functools import lru_cache
from math import sqrt

from contactlaw.jit import address_of, jit_inside
from contactlaw.world.call import MEETING, RADIUS
from contactlaw.world.curvature import feature, radius_between, side_at
from contactlaw.world.gjk import NONE, middle, nearest
from contactlaw.world.records import BOX, SEGMENT
from contactlaw.world.segments import clip
from contactlaw.world.vec import add, axpy, dot, load, norm, scale, sub, to_world

CROWN = 0.02  # of both radii, that two polyhedra lie deeper than their vertices do
SIDE = 0.01  # of its radius: the crown of a capsule's side, as in `box`
STEPS = 30  # of Newton's method, which is done when it comes to the right piece; bisection guards it
SAME = 1e-10  # of a half length, a place that is another's
DEEP = 1e-6  # of both radii: a distance of cores that is none


@jit_inside
def deepest_on_hull(sa, a, sb, b):
    """`nearest` of the point of a capsule's middle line that is the deepest, as in `box.deepest_on_box`.

    Returns its place along the half axis, its radius [m], and what `nearest` does.
    """
    u = to_world(a.axes, load(sa.half))
    crown = 2.0 * SIDE * sa.radius * sa.radius
    low, high, at = -2.0, 2.0, 0.0
    v, y, count, e = nearest(sa, a, sb, b, NONE)
    for _ in range(STEPS):
        value = crown * at + dot(v, u)
        slope = crown + dot(u, u)
        if count == 2:
            slope -= dot(u, e) ** 2 / dot(e, e)
        elif count == 3:
            slope = crown + dot(u, v) ** 2 / dot(v, v)
        if value > 0.0:
            high = at
        else:
            low = at
        new = clip(at - value / slope)
        if not low < new < high:
            new = clip(0.5 * (low + high))
        if abs(new - at) <= SAME:
            break
        at = new
        v, y, count, e = nearest(sa, a, sb, b, scale(at, u))
    return at, sa.radius * (1.0 - SIDE * (1.0 + at * at)), v, y


def radius(sa, a, sb, b):
    """`geometry.effective_radius` of the same. Of two edges the angle is taken for a right one."""
    if sa.kind >= BOX:
        return sqrt(sb.radius * (sa.radius if sa.radius > 0.0 else sb.radius))
    at, u = 0.0, NONE
    if sa.kind == SEGMENT:
        u = to_world(a.axes, load(sa.half))
        at, _, _, _ = deepest_on_hull(sa, a, sb, b)
    _, _, count, e = nearest(sa, a, sb, b, scale(at, u))
    return radius_between(side_at(sa, u, at, SIDE), feature(sb.radius, count, e))


def meet(sa, a, sb, b):
    """`geometry.meet` of two shapes of which one is convex without a closed form."""
    radius_a, radius_b, from_a = sa.radius, sb.radius, middle(sa, a)
    if sa.kind == SEGMENT:
        _, radius_a, v, y = deepest_on_hull(sa, a, sb, b)
    else:
        v, y, _, _ = nearest(sa, a, sb, b, NONE)
    both = radius_a + radius_b
    far = norm(v)
    if far > DEEP * both:
        n = scale(1.0 / far, v)
    else:  # as between two balls
        n = sub(add(load(a.position), from_a), add(load(b.position), middle(sb, b)))
        n = scale(1.0 / max(norm(n), 1e-300), n)
    overlap = both - far
    if sa.kind >= BOX:
        overlap -= CROWN * both
    arm_b = axpy(far / both * radius_b, n, y)
    arm_a = add(arm_b, sub(load(b.position), load(a.position)))
    return overlap, n[0], n[1], n[2], arm_a[0], arm_a[1], arm_a[2], arm_b[0], arm_b[1], arm_b[2]


@lru_cache
def addresses() -> dict[str, int]:
    """Of both, compiled where there are hulls."""
    return {"meet": address_of(meet, MEETING), "curve": address_of(radius, RADIUS)}
