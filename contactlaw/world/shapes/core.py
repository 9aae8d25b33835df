"""Where a point, or a line, is nearest to a box, to a solid cylinder, or to a hull: convex cores.

Their edges are sharp for what is round by itself. For edges, rims and sides of others they are rounded by the core's
own radius: the distance is that from a core which is smaller by so much all around, less it.
"""

from __future__ import annotations

from math import sqrt

from contactlaw.jit import jit_inside
from contactlaw.world.data.call import ask_nearest
from contactlaw.world.data.records import BOX, HULL
from contactlaw.world.data.vec import ZERO, add, axpy, dot, norm, scale, to_body, to_world
from contactlaw.world.shapes.segments import clip

STEPS = 60  # of Newton's method, which is done when it comes to the right piece; bisection guards it
CROWN = 0.01  # of the radius
LEAST = 1e-9  # [m], a distance from a core that is none
NOWHERE = ZERO, 0.0, ZERO, (ZERO, ZERO, ZERO)
EQUAL, SAME = 1e-15, 1e-10  # of a half length, a step that is none; on a hull, which takes longer to ask


@jit_inside
def excess(x, half):
    """By how much a coordinate is beyond a box that reaches from -half to half."""
    return x - min(max(x, -half), half)


@jit_inside
def excess_of(p, s, less):
    """From the nearest point of a core to a point p of its own frame [m]; zero inside.

    less: by how much the core is smaller all around [m].
    """
    h, z = s.half[0] - less, excess(p[2], s.half[2] - less)
    if s.kind == BOX:
        return excess(p[0], h), excess(p[1], s.half[1] - less), z
    far = sqrt(p[0] * p[0] + p[1] * p[1])
    out = 1.0 - h / far if far > h else 0.0
    return out * p[0], out * p[1], z


@jit_inside
def excess_along(p, e, q, s, less):
    """How the excess e of a point p changes along a direction q: H q, H the second derivative of distance^2/2."""
    z = q[2] if e[2] != 0.0 else 0.0
    if s.kind == BOX:
        return q[0] if e[0] != 0.0 else 0.0, q[1] if e[1] != 0.0 else 0.0, z
    square, h = p[0] * p[0] + p[1] * p[1], s.half[0] - less
    out = 1.0 - h / sqrt(square) if square > h * h else 0.0
    turned = (1.0 - out) * (p[0] * q[0] + p[1] * q[1]) / square if out > 0.0 else 0.0
    return out * q[0] + turned * p[0], out * q[1] + turned * p[1], z


@jit_inside
def local(v, s, b):
    """A vector of the world along a core's own axes."""
    return to_body(s.axes, to_body(b.axes, v))


@jit_inside
def excess_at(m, way, less, one, last):
    """From a core to m + way, along its axes, of a hull those of the world, and what else `change_of` asks.

    one: the shape that the point is of, and the core, with their bodies; way: of a hull from that shape's middle. last:
    what was found at a place nearby, or `NOWHERE`: on a hull it is sought from there.
    """
    sa, a, sb, b = one
    if sb.kind == HULL:
        return ask_nearest(sb.nearest, sa, a, sb, b, way, last[1], last[3])
    x = add(m, way)
    return excess_of(x, sb, less), 0.0, x, last[3]


@jit_inside
def change_of(e, count, other, q, less, s):
    """How the excess changes along a direction; of a hull by its vertex, edge or face, see `gjk.nearest`."""
    if s.kind != HULL:
        return excess_along(other, e, q, s, less)
    if count == 2.0:
        return axpy(-dot(other, q) / dot(other, other), other, q)
    return q if count < 2.0 else scale(dot(e, q) / max(dot(e, e), LEAST * LEAST), e)


@jit_inside
def way_out(p, s):
    """Of a point within a core: minus its depth, and the direction, through the nearest face or the side."""
    x, y, z = p
    h = s.half
    k = h[2] - abs(z)
    up = 0.0, 0.0, 1.0 if z >= 0.0 else -1.0
    if s.kind == BOX:
        i, j = h[0] - abs(x), h[1] - abs(y)
        if i <= min(j, k):
            return -i, (1.0 if x >= 0.0 else -1.0, 0.0, 0.0)
        return (-j, (0.0, 1.0 if y >= 0.0 else -1.0, 0.0)) if j <= k else (-k, up)
    far = sqrt(x * x + y * y)
    if k <= h[0] - far or far == 0.0:
        return -k, up
    return far - h[0], (x / far, y / far, 0.0)


@jit_inside
def nearest_on_core(d, s, b, rounding):
    """Distance [m] of a point from a core, and the unit vector from there to it, in the world.

    d: from the core's centre, in the world. rounding: of its edges [m]. Inside, the distance has a minus, and the way
    out is through the nearest face.
    """
    p = local(d, s, b)
    e = excess_of(p, s, rounding)
    far = norm(e)
    if far > 0.0:
        far, n = far - rounding, scale(1.0 / far, e)
    else:
        far, n = way_out(p, s)
    return far, to_world(b.axes, to_world(s.axes, n))


def lies_over_face(d, u, margin, s, b):
    """Whether all of an edge is over one face of a box, by a margin [m] from the face's border.

    Its ends, where corners are, lie as deep as it or deeper then: it never touches. d, u: as for `deepest_on_line`.
    """
    p, q = local(d, s, b), local(u, s, b)
    beyond, over = 0, 0
    for i in range(3):
        if abs(p[i]) + abs(q[i]) + margin <= s.half[i] - s.radius:
            over += 1
        elif abs(p[i]) - abs(q[i]) >= s.half[i] - 2.0 * s.radius:
            beyond += 1
    return over == 2 and beyond == 1


@jit_inside
def deepest_on_line(d, u, rounding, one):
    """Which point of a capsule's side, or of a box's edge, is the deepest in a core: its place along the half axis u,
    its radius [m], and what `excess_at` finds there.

    d: from the core's centre to the segment's middle, in the world. one: as above. On a face a capsule lies on its
    ends, and a box on its corners; sides and edges meet edges. They are crowned, r(s) = R (1 - CROWN (1 + s^2)), so
    that they do not share the load of the ends, and so that the deepest point is one that moves continuously, at the
    minimum of D + CROWN R s^2: the root of the slope of D^2/2 + CROWN R D s^2 with the distance D held, a function that
    grows, on what has flat faces all but piece by piece along straight lines.
    """
    s, b, radius = one[2], one[3], one[0].radius
    p, q, same = d, u, SAME
    if s.kind != HULL:
        p, q, same = local(d, s, b), local(u, s, b), EQUAL
    crown = 2.0 * CROWN * radius
    low, high, at, seen = -2.0, 2.0, 0.0, NOWHERE
    for _ in range(STEPS):
        seen = excess_at(p, scale(at, q), rounding, one, seen)
        e, count, other, _ = seen
        k = crown * max(norm(e), LEAST)
        value, slope = k * at + dot(e, q), k + dot(change_of(e, count, other, q, rounding, s), q)
        if value == 0.0:  # all of it is inside
            break
        if value > 0.0:
            high = at
        else:
            low = at
        new = clip(at - value / slope)
        if not low < new < high:
            new = clip(0.5 * (low + high))
        if abs(new - at) <= same:
            break
        at = new
    return at, radius * (1.0 - CROWN * (1.0 + at * at)), seen
