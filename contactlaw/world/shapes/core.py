"""Nearest points of convex cores - boxes, solid cylinders, hulls - to a point or a line.

For spheres and capsules the edges of a core are sharp. For edges, rims and sides of other cores they are rounded by the
core's own radius: the distance is that from a core smaller by this radius all around, less the radius.
"""

from math import copysign, nan, sqrt

from contactlaw.jit import jit_module
from contactlaw.world.data.call import ask_nearest
from contactlaw.world.data.kinds import BOX, EDGE, HULL
from contactlaw.world.data.records import NEVER
from contactlaw.world.data.vec import ZERO, add, axpy, dot, norm, scale, to_body

ITERATIONS = 60  # of Newton's method, which ends on the right piece of the slope; guarded by bisection
CROWN = 0.01  # of the radius, by which sides, edges and discs are lower at their middle, and again at their ends
FALL = 0.1  # of the radius, by which an edge falls off towards a corner: as deep as Hertz's theory holds
FALL_LENGTH = 2.0  # of the radius, from the corner, within which it does
LEAST = 1e-9  # [m] least distance from a core in quotients
NO_PLACES = ZERO, ZERO, ZERO
NOWHERE = ZERO, 0, ZERO, NO_PLACES
CONVERGED, CONVERGED_ON_HULL = 1e-15, 1e-10  # of a half length, a step at which the iteration ends; hulls cost more


def clip(x, most=1.0):
    """Return the number from -most to most nearest to x."""
    return min(max(x, -most), most)


def next_place(at, value, slope, ends):
    """Take a step of Newton's method for the root, from -1 to 1, of a growing function; bisect where that leads out.

    value, slope: of the function at a place `at`. ends: between which the root was before. Returns the next place, and
    between which the root is now. The place remains if the step is lost in rounding.
    """
    low, high = (ends[0], at) if value > 0.0 else (at, ends[1])
    new = clip(at - value / slope) if slope > 0.0 else nan
    if not (low < new < high or new == at):
        new = clip(0.5 * (low + high))
    return new, (low, high)


def excess(x, half):
    """Return by how much a coordinate lies outside the interval from -half to half."""
    return x - clip(x, half)


def excess_of(p, s, less):
    """Return the vector to a point p, in a core's own frame [m], from the nearest point of the core; zero inside.

    less: by how much the core is smaller all around [m].
    """
    h, z = s.half[0] - less, excess(p[2], s.half[2] - less)
    if s.kind == BOX:
        return excess(p[0], h), excess(p[1], s.half[1] - less), z
    radial = sqrt(p[0] * p[0] + p[1] * p[1])
    out = 1.0 - h / radial if radial > h else 0.0
    return out * p[0], out * p[1], z


def local(v, s, b):
    """Return a vector of the world along a core's own axes."""
    return to_body(s.axes, to_body(b.axes, v))


def excess_at(m, offset, less, shapes, last):
    """Return the excess over a core at m + offset, and what `change_of` and the next call need.

    m, offset: along the core's axes; of a hull in the world, `offset` from A's middle. shapes: (sa, a, sb, b), the
    shape A that the point belongs to and the core B, with their bodies. last: result at a point nearby, or `NOWHERE`.
    The further results are, of a hull, those of `gjk.nearest`; of other cores 0, and the point along the core's axes.
    """
    sa, a, sb, b = shapes
    if sb.kind == HULL:
        e, _, count, edge, vertices = ask_nearest(sb.nearest, sa, a, sb, b, offset, last[1], last[3], NEVER)
        return e, count, edge, vertices
    x = add(m, offset)
    return excess_of(x, sb, less), 0, x, last[3]


def change_of(e, count, other, q, less, s):
    """Return the derivative of an excess along q: H q, H the second derivative of distance^2/2.

    e, count, other: as found by `excess_at`; of a hull H is that of its nearest vertex, edge or face.
    """
    if s.kind == HULL:
        if count == 2:
            return axpy(-dot(other, q) / dot(other, other), other, q)
        return q if count < 2 else scale(dot(e, q) / max(dot(e, e), LEAST * LEAST), e)
    p, z = other, q[2] if e[2] != 0.0 else 0.0
    if s.kind == BOX:
        return q[0] if e[0] != 0.0 else 0.0, q[1] if e[1] != 0.0 else 0.0, z
    square, h = p[0] * p[0] + p[1] * p[1], s.half[0] - less
    out = 1.0 - h / sqrt(square) if square > h * h else 0.0
    turned = (1.0 - out) * (p[0] * q[0] + p[1] * q[1]) / square if out > 0.0 else 0.0
    return out * q[0] + turned * p[0], out * q[1] + turned * p[1], z


def way_out(p, s):
    """Return minus the depth of a point within a core, and the direction out through the nearest face or the side."""
    (x, y, z), h = p, s.half
    k, up = h[2] - abs(z), (0.0, 0.0, 1.0 if z >= 0.0 else -1.0)
    if s.kind == BOX:
        i, j = h[0] - abs(x), h[1] - abs(y)
        if i <= min(j, k):
            return -i, (1.0 if x >= 0.0 else -1.0, 0.0, 0.0)
        return (-j, (0.0, 1.0 if y >= 0.0 else -1.0, 0.0)) if j <= k else (-k, up)
    radial = sqrt(x * x + y * y)
    if k <= h[0] - radial or radial == 0.0:
        return -k, up
    return radial - h[0], (x / radial, y / radial, 0.0)


def set_back(s, u, at):
    """Return by how much a side or an edge is set back at a place of its half axis u [m], and its derivatives by that.

    An edge ends where the sphere of a corner begins: near its ends it falls off, so that the corner carries alone.
    """
    back, slope, growth = CROWN * (1.0 + at * at), 2.0 * CROWN * at, 2.0 * CROWN
    if s.kind == EDGE:
        share = min(FALL_LENGTH * s.radius / norm(u), 1.0)
        beyond = abs(at) - 1.0 + share
        if beyond > 0.0:
            k = FALL / (share * share)
            back, slope, growth = back + k * beyond * beyond, slope + copysign(2.0 * k * beyond, at), growth + 2.0 * k
    return s.radius * back, s.radius * slope, s.radius * growth


def slope_at(s, u, q, at, e, moved):
    """Return value and slope at a place of what has its root at the deepest point, see `deepest_on_line`.

    e: excess there; moved: its derivative.
    """
    _, falls, growth = set_back(s, u, at)
    far, along = max(norm(e), LEAST), dot(e, q)
    return far * falls + along, far * growth + falls * along / far + dot(moved, q)


def deepest_on_line(d, u, rounding, shapes, at, known=NOWHERE):
    """Find the deepest point of a capsule's side, or of a core's edge, in a core.

    Returns its place -1..1 along the half axis u, its radius [m], and the result of `excess_at` there.

    d: from the core's centre to the segment's middle, world frame. shapes: as for `excess_at`. at: where to begin;
    known: result of `excess_at` nearby. On a face a capsule lies on its ends and a box on its corners; sides and edges
    meet edges. They are set back by c(s), see `set_back`, so that they do not share the load of the ends, and so that
    the deepest point is unique and moves continuously: it is the minimum of D + c, at distance D, the root of
    D (D' + c') = e.q + D c', e being the excess and q half the axis. That grows with s by q.Hq + D c'' + c' e.q/D, and
    on cores with flat faces is almost piecewise linear.
    """
    own, s, b = shapes[0], shapes[2], shapes[3]
    p, q, same = d, u, CONVERGED_ON_HULL
    if s.kind != HULL:
        p, q, same = local(d, s, b), local(u, s, b), CONVERGED
    ends, found = (-2.0, 2.0), known
    for _ in range(ITERATIONS):
        found = excess_at(p, scale(at, q), rounding, shapes, found)
        e, count, other, vertices = found
        moved = change_of(e, count, other, q, rounding, s)
        value, slope = slope_at(own, u, q, at, e, moved)
        if value == 0.0:  # the whole line is inside
            break
        new, ends = next_place(at, value, slope, ends)
        step, at = new - at, new
        if abs(step) <= same:
            found = axpy(step, moved, e), count, other, vertices
            break
    return at, own.radius - set_back(own, u, at)[0], found


jit_module(__name__)
