"""Nearest points of an ellipsoid and a plane, ball, segment, polyhedron, cylinder or ellipsoid.

With Q = R diag(a^2, b^2, c^2) R^T the support function is h(n) = sqrt(n.Q n), the point there Q n/h. Along a normal n
from another convex body the gap is s(n) = n.(x - y), x and y the points that face each other; the distance is its
maximum, where x - y is parallel to n. Newton's method finds it: the derivative of x - y across n is

    -(Q/h - (Q n)(Q n)^T/h^3)

for the ellipsoid, and zero for a polyhedron while n stays across the edge that y lies on. Which vertex, edge or face is
nearest is found with the ball that touches the ellipsoid there from inside: if it is nearest to the polyhedron along n
itself, so is the ellipsoid. Where Newton's method on a feature does not increase the gap, the line from the ball's
centre to the polyhedron gives the next normal, that of the ellipsoid where the line leaves it (Lin & Han 2002, SIAM J.
Optim. 13, 298-321): the gap is then smaller at each iteration, so that no feature is tried for ever.
"""

from math import copysign, sqrt

from contactlaw.jit import jit_module
from contactlaw.world.data.kinds import BOX, CYLINDER, ELLIPSOID, HULL, PLANE
from contactlaw.world.data.records import NEVER
from contactlaw.world.data.vec import ZERO, add, axpy, cross, dot, load, norm, scale, sub, tangent, to_body, to_world
from contactlaw.world.shapes.core import excess_of, local
from contactlaw.world.shapes.geometry import ANY, SUNK, centre
from contactlaw.world.shapes.gjk import nearest, support

ITERATIONS = 30  # of Newton's method at most; it needs a few
FEATURES = 400  # features that are tried at most, mostly one or two; beside an ellipsoid seven times as long as wide 57
WIDEST = 0.5  # [rad] longest step of Newton's method
NARROW = 1e-6  # [rad] step below which rounding hides whether the gap grows
CONVERGED = 1e-9  # [rad] difference of normals that count as equal
INSIDE = SUNK  # radius of the inscribed ball, of the least radius; deeper, `meeting.meet_closed` holds the normal


def swell(s, b, n):
    """Return Q n, world frame."""
    m, h = to_body(s.axes, to_body(b.axes, n)), s.half
    return to_world(b.axes, to_world(s.axes, (m[0] * h[0] * h[0], m[1] * h[1] * h[1], m[2] * h[2] * h[2])))


def shrink(s, b, n):
    """Return Q^-1 n, world frame."""
    m, h = to_body(s.axes, to_body(b.axes, n)), s.half
    return to_world(b.axes, to_world(s.axes, (m[0] / (h[0] * h[0]), m[1] / (h[1] * h[1]), m[2] / (h[2] * h[2]))))


def facing(s, b, n):
    """Return the point of an ellipsoid furthest along n, from its body's centre of mass [m]."""
    q = swell(s, b, n)
    return axpy(1.0 / sqrt(dot(n, q)), q, centre(s, b))


def bend(s, b, n, t, u):
    """Return the derivative along u of the point furthest along n as n turns along t [m/rad]; t, u: across n."""
    q = swell(s, b, n)
    h = sqrt(dot(n, q))
    return dot(t, swell(s, b, u)) / h - dot(t, q) * dot(u, q) / (h * h * h)


def on_rim(s, b, n, up):
    """Return the point of a cylinder's rim furthest along n, from its body's centre of mass [m], and how it moves.

    The latter by the angle of n: rate [m/rad] and tangent. up: along the cylinder's axis, with the sign of the end.
    """
    m, h = local(n, s, b), s.half
    out = max(sqrt(m[0] * m[0] + m[1] * m[1]), 1e-300)
    r, z = (h[0] - s.radius) / out, copysign(h[2] - s.radius, up)
    along = to_world(b.axes, to_world(s.axes, (-m[1] / out, m[0] / out, 0.0)))
    return add(centre(s, b), to_world(b.axes, to_world(s.axes, (r * m[0], r * m[1], z)))), r, along


def across(sa, a, sb, b, y, up, n):
    """Return x - y, the points of an ellipsoid A and of B that face each other along n [m]; y; and how y moves.

    y, up: as for `climb`; the motion of y with n as of `on_rim`.
    """
    rate, along = 0.0, n
    if sb.kind == ELLIPSOID:
        y = facing(sb, b, n)
    elif up != 0.0:
        y, rate, along = on_rim(sb, b, n, up)
    x = add(sub(load(a.position), load(b.position)), facing(sa, a, scale(-1.0, n)))
    return sub(x, y), y, rate, along


def climb(sa, a, sb, b, y, edge, n):
    """Find the normal from B to an ellipsoid A by Newton's method. Returns it, the gap [m] and the point of B.

    B: an ellipsoid, or a point y of a core, from B's centre of mass; edge: the normal is kept across it, unless zero.
    On a cylinder without an edge y stays on its rim: the other rim is a feature of its own, and there is no derivative
    from one to the other.
    """
    two, along, up = sb.kind == ELLIPSOID, norm(edge), 0.0
    if sb.kind == CYLINDER and along == 0.0:
        up = local(sub(y, centre(sb, b)), sb, b)[2]
    was, best, step = n, -NEVER, ZERO
    for _ in range(ITERATIONS):
        p, y, rate, e = across(sa, a, sb, b, y, up, n)
        if dot(p, n) < best and norm(step) > NARROW:  # too far: each step increases the gap at first
            step = scale(0.5, step)
            n = add(was, step)
            n = scale(1.0 / norm(n), n)
            continue
        was, best, gap = n, dot(p, n), max(dot(p, n), 0.0)
        t = scale(1.0 / along, cross(edge, n)) if along > 0.0 else tangent(n)
        u = cross(n, t)
        tt, tu, uu = bend(sa, a, n, t, t), bend(sa, a, n, t, u), bend(sa, a, n, u, u)
        if two:
            tt, tu, uu = tt + bend(sb, b, n, t, t), tu + bend(sb, b, n, t, u), uu + bend(sb, b, n, u, u)
        et, eu = dot(e, t), dot(e, u)
        tt, tu, uu = tt + gap + rate * et * et, tu + rate * et * eu, uu + gap + rate * eu * eu
        x, z = dot(p, t), dot(p, u)
        if along > 0.0:
            step = scale(x / tt, t)
        else:
            step = scale(1.0 / (tt * uu - tu * tu), add(scale(uu * x - tu * z, t), scale(tt * z - tu * x, u)))
        wide = norm(step)
        step = scale(min(1.0, WIDEST / max(wide, 1e-300)), step)
        n = add(n, step)
        n = scale(1.0 / norm(n), n)
        if wide <= CONVERGED:
            break
    p, y, _, _ = across(sa, a, sb, b, y, up, n)
    return n, dot(p, n), y


def feature_at(sa, a, sb, b, shift):
    """Return `gjk.nearest` of a point and a core, and the radius [m] that sweeps the nearest feature.

    Of a cylinder in closed form: its side is its axis, swept by its radius, and its rim an edge.
    """
    if sb.kind != CYLINDER:
        v, y, count, e, _ = nearest(sa, a, sb, b, shift)
        return v, y, count, e, sb.radius
    d = add(sub(load(a.position), load(b.position)), add(centre(sa, a), shift))
    p = to_body(sb.axes, to_body(b.axes, sub(d, centre(sb, b))))
    e = excess_of(p, sb, sb.radius)
    out, around = sqrt(e[0] * e[0] + e[1] * e[1]), sb.radius
    edge = (0.0, 0.0, 1.0) if e[2] == 0.0 else (-e[1], e[0], 0.0)
    if e[2] == 0.0 and out > 0.0:
        e, around = scale((out + sb.half[0] - sb.radius) / out, e), sb.half[0]
    v = to_world(b.axes, to_world(sb.axes, e))
    return v, sub(d, v), 2 if out > 0.0 else 3, to_world(b.axes, to_world(sb.axes, edge)), around


def plane_gap(sa, a, sb, b, n):
    """Return the distance [m] of the planes across n that touch an ellipsoid and a core; the gap is its maximum."""
    up = copysign(1.0, local(n, sb, b)[2]) if sb.kind == CYLINDER else 0.0
    p, _, _, _ = across(sa, a, sb, b, support(sb, b, n), up, n)
    return dot(p, n)


def face_over(s, b, d, i):
    """Return the normal of a box's face, or a cylinder's end or side (i), on the side of a point d from its middle."""
    p = local(d, s, b)
    x, y, z = (p[0], p[1], 0.0) if s.kind == CYLINDER else (p[0] if i == 2 else 0.0, p[1] if i == 1 else 0.0, 0.0)
    if i == 0:
        x, y, z = 0.0, 0.0, p[2]
    n = to_world(b.axes, to_world(s.axes, (x, y, z)))
    return scale(1.0 / max(norm(n), 1e-300), n)


def leave(s, b, inside, m):
    """Return minus the normal where the line along -m from a point inside an ellipsoid, from its middle, exits."""
    to, at = shrink(s, b, m), shrink(s, b, inside)
    k, c, e = dot(m, to), dot(inside, to), dot(inside, at) - 1.0
    n = axpy(-(c + sqrt(max(c * c - k * e, 0.0))) / k, to, at)
    return scale(-1.0 / norm(n), n)


def nearest_to_ellipsoid(sa, a, sb, b):
    """Find the nearest points of an ellipsoid A and B, anything but a plane.

    Returns the normal from B, the gap [m], the point of B's core from its centre of mass, and the radius [m] that
    sweeps the core there. Where A's inscribed ball reaches the core, the gap is the greatest `plane_gap` of the normals
    tried, of that from the core to A's middle, and of the core's faces.
    """
    between = sub(load(a.position), load(b.position))
    to_b = sub(centre(sb, b), add(between, centre(sa, a)))  # from A's middle to B's
    if sb.kind == ELLIPSOID:
        n = add(shrink(sa, a, to_b), shrink(sb, b, to_b))
        size = norm(n)
        n, gap, y = climb(sa, a, sb, b, ZERO, ZERO, scale(-1.0 / size, n) if size > 1e-300 else ANY)
        return n, gap, y, 0.0
    h = sa.half
    ball = INSIDE * min(h[0], h[1], h[2]) ** 2 / max(h[0], h[1], h[2])
    v, y, count, e, around = feature_at(sa, a, sb, b, ZERO)
    if norm(v) == 0.0 and sb.kind == HULL:  # A's middle is in a core for which no depth is defined
        return ANY, -max(h[0], h[1], h[2]), y, sb.radius
    straight = scale(1.0 / max(norm(v), 1e-300), v)
    n = shrink(sa, a, v)
    n = scale(1.0 / max(norm(n), 1e-300), n)
    best, kept = -NEVER, n
    for _ in range(FEATURES if norm(v) > 0.0 else 0):
        x = facing(sa, a, scale(-1.0, n))
        inside = sub(axpy(ball, n, x), centre(sa, a))
        v, y, count, e, around = feature_at(sa, a, sb, b, inside)
        distance = norm(v)
        if distance == 0.0:
            break
        m = scale(1.0 / distance, v)
        if norm(sub(n, m)) <= 10.0 * CONVERGED:
            return n, dot(sub(add(between, x), y), n), y, around
        n = m
        if count < 3:
            edge = ZERO if count == 1 or (sb.kind == CYLINDER and around == sb.radius) else e
            n, _, _ = climb(sa, a, sb, b, y, edge, m)
        parted = plane_gap(sa, a, sb, b, n)
        if parted > best:
            best, kept = parted, n
        else:
            n = leave(sa, a, inside, m)
    for i in range(4 if sb.kind == BOX else (3 if sb.kind == CYLINDER else 1)):
        n = straight if i == 0 else face_over(sb, b, scale(-1.0, to_b), i - 1)
        gap = plane_gap(sa, a, sb, b, n) if dot(n, n) > 0.0 else -NEVER
        if gap >= best:
            kept, best = n, gap
    if best == -NEVER:
        kept, best = ANY, plane_gap(sa, a, sb, b, ANY)
    return kept, best, axpy(-best, kept, add(between, facing(sa, a, scale(-1.0, kept)))), sb.radius


def meet(sa, a, sb, b, _last):
    """`geometry.meet` with an ellipsoid; the point of contact is in the middle between both surfaces."""
    d = sub(load(a.position), load(b.position))
    if sb.kind == PLANE:
        n = to_world(b.axes, load(sb.normal))
        arm_a = facing(sa, a, scale(-1.0, n))
        arm_b = add(arm_a, d)
        return dot(sub(centre(sb, b), arm_b), n), n, arm_a, arm_b
    own = sa.kind == ELLIPSOID
    n, gap, y, around = nearest_to_ellipsoid(sa, a, sb, b) if own else nearest_to_ellipsoid(sb, b, sa, a)
    arm = axpy(0.5 * (around + gap), n, y)
    return (around - gap, n, sub(arm, d), arm) if own else (around - gap, scale(-1.0, n), arm, add(arm, d))


def separate(sa, a, sb, b, n, _):
    """`gjk.separate` of an ellipsoid and a core, with a known normal."""
    lowest = facing(sa, a, scale(-1.0, n))
    low = dot(n, add(sub(load(a.position), load(b.position)), lowest))
    return n, low, low - plane_gap(sa, a, sb, b, n), lowest


jit_module(__name__)
