"""Nearest points of two convex polyhedra, or of a point and a polyhedron: Gilbert, Johnson & Keerthi (1988).

The distance is that of the Minkowski difference from the origin. A simplex of its vertices is moved towards the origin,
until the vertex furthest towards the origin is already in the simplex: the result is then exact.
"""

from math import atan2, copysign, cos, floor, pi, sin

from contactlaw.jit import jit_module
from contactlaw.memory import doubles_at
from contactlaw.world.data.kinds import BOX, CYLINDER, DISC, EDGE, HULL, SEGMENT, SIDE
from contactlaw.world.data.vec import ZERO, add, axpy, dot, load, norm, scale, sub, to_body, to_world
from contactlaw.world.shapes.disc import dimensions
from contactlaw.world.shapes.geometry import centre

ITERATIONS = 100  # at most; never reached
CELLS = 4  # along each side of each face of the cube of directions
STAVE = pi / 16.0  # [rad] a side of the prism that stands for a cylinder: on smooth shapes GJK does not end exactly


def cell_of(d):
    """Return the number of the cell through which a direction leaves a cube around the origin."""
    x, y, z = abs(d[0]), abs(d[1]), abs(d[2])
    face, most, u, v = 4, d[2], d[0], d[1]
    if x >= y and x >= z:
        face, most, u, v = 0, d[0], d[1], d[2]
    elif y >= z:
        face, most, u, v = 2, d[1], d[2], d[0]
    face += 1 if most < 0.0 else 0
    return (face * CELLS + cell_along(u / most)) * CELLS + cell_along(v / most)


def cell_along(x):
    """Return the cell of a coordinate from -1 to 1; the first one for NaN."""
    cell = 0.5 * CELLS * (x + 1.0)
    return min(int(cell), CELLS - 1) if cell >= 0.0 else 0


def support(s, b, d):
    """Return the point of a core furthest along d, from its body's centre of mass [m], world frame."""
    at = load(s.at)
    if s.kind == HULL:
        own = to_body(b.axes, d)
        points, cell = doubles_at(s.points), 3 * cell_of(own)
        first = 3 * int(points[cell])
        best, most = first, -1e300
        for i in range(first, first + 3 * int(points[cell + 1]), 3):
            far = points[i] * own[0] + points[i + 1] * own[1] + points[i + 2] * own[2]
            if far > most:
                best, most = i, far
        at = add(at, (points[best], points[best + 1], points[best + 2]))
    elif s.kind == SEGMENT or s.kind == EDGE:
        u = load(s.half)
        at = axpy(1.0 if dot(to_body(b.axes, d), u) >= 0.0 else -1.0, u, at)
    elif s.kind == DISC or s.kind == SIDE:
        out, _, along = dimensions(s)
        own, axis = to_body(b.axes, d), load(s.normal)
        up = dot(own, axis)
        across = axpy(-up, axis, own)
        at = axpy(copysign(along, up), axis, axpy(out / max(norm(across), 1e-300), across, at))
    elif s.kind == BOX:
        own, h, r = to_body(s.axes, to_body(b.axes, d)), s.half, s.radius
        corner = copysign(h[0] - r, own[0]), copysign(h[1] - r, own[1]), copysign(h[2] - r, own[2])
        at = add(at, to_world(s.axes, corner))
    elif s.kind == CYLINDER:
        own, h, r = to_body(s.axes, to_body(b.axes, d)), s.half, s.radius
        angle = floor(atan2(own[1], own[0]) / STAVE + 0.5) * STAVE
        out = (h[0] - r) * (0.5 + 0.5 / cos(0.5 * STAVE))
        at = add(at, to_world(s.axes, (out * cos(angle), out * sin(angle), copysign(h[2] - r, own[2]))))
    return to_world(b.axes, at) if b.oriented != 0 else ZERO


def on_triangle(p, q, r):
    """Return the barycentric coordinates of a triangle's point nearest to the origin (Ericson 2005, section 5.1.5)."""
    e, f = sub(q, p), sub(r, p)
    ep, fp, eq, fq, er, fr = -dot(e, p), -dot(f, p), -dot(e, q), -dot(f, q), -dot(e, r), -dot(f, r)
    if ep <= 0.0 and fp <= 0.0:
        return 1.0, 0.0, 0.0
    if eq >= 0.0 and fq <= eq:
        return 0.0, 1.0, 0.0
    c = ep * fq - eq * fp
    if c <= 0.0 and ep >= 0.0 and eq <= 0.0:
        return 1.0 - ep / (ep - eq), ep / (ep - eq), 0.0
    if fr >= 0.0 and er <= fr:
        return 0.0, 0.0, 1.0
    b = er * fp - ep * fr
    if b <= 0.0 and fp >= 0.0 and fr <= 0.0:
        return 1.0 - fp / (fp - fr), 0.0, fp / (fp - fr)
    a = eq * fr - er * fq
    one, two = fq - eq, er - fr
    if a <= 0.0 and one >= 0.0 and two >= 0.0:
        return 0.0, two / (one + two), one / (one + two)
    return a / (a + b + c), b / (a + b + c), c / (a + b + c)


def mean(k, p, q, r):
    """Return the sum of three vectors weighted by k."""
    return axpy(k[0], p, axpy(k[1], q, scale(k[2], r)))


def on_line(p, q):
    """Return the barycentric coordinates of a segment's point nearest to the origin."""
    e = sub(q, p)
    t = min(max(-dot(p, e) / dot(e, e), 0.0), 1.0)
    return 1.0 - t, t, 0.0


def kept(p, q, r, x, y, z, k):
    """Return a simplex without vertices of zero weight, with their points on B; its weights, and how many are left."""
    if k[0] == 0.0:
        p, x, q, y, k = q, y, r, z, (k[1], k[2], 0.0)
        if k[0] == 0.0:
            p, x, k = q, y, (k[1], 0.0, 0.0)
    elif k[1] == 0.0:
        q, y, k = r, z, (k[0], k[2], 0.0)
    return p, q, r, x, y, z, k, 3 if k[2] > 0.0 else (2 if k[1] > 0.0 else 1)


def on_tetrahedron(p, q, r, new):
    """Find the triangle with vertex `new` nearest to the origin; returns which of p, q, r it lacks, and coordinates."""
    best, lacks, found = 1e300, 0, (0.0, 0.0, 1.0)
    for i in range(3):
        one, two = (q, r) if i == 0 else ((r, p) if i == 1 else (p, q))
        k = on_triangle(one, two, new)
        v = mean(k, one, two, new)
        if dot(v, v) < best:
            best, lacks, found = dot(v, v), i, k
    return lacks, found


def nearest(sa, a, sb, b, shift):
    """Find the nearest points of two cores.

    A is a box or a hull, or else a point, its middle; shift: added to A [m]. Returns the vector from the point on B to
    that on A, zero if the cores overlap; the point on B from its body's centre of mass [m]; how many vertices span the
    nearest feature, of B where A is a point; and the direction of that feature's edge, if there are two.
    """
    return seek(sa, a, sb, b, shift, (0, (ZERO, ZERO, ZERO)))[:4]


def seek(sa, a, sb, b, shift, last):
    """Return the same, and the vertices on B; last: number and vertices found nearby, where A was a point; 0: none."""
    d = add(sub(load(a.position), load(b.position)), shift)
    to_a = centre(sa, a)
    v = add(d, sub(to_a, centre(sb, b)))
    known, (x, y, z) = last
    p, q, r = ZERO, ZERO, ZERO  # vertices of the simplex; their points on B are x, y and z
    count, square, k, new = 0, 1e300, (1.0, 0.0, 0.0), ZERO
    if known > 0:
        above = add(d, to_a)
        p, q, r = sub(above, x), sub(above, y), sub(above, z)
        k = on_line(p, q) if known == 2 else (on_triangle(p, q, r) if known == 3 else k)
        p, q, r, x, y, z, k, count = kept(p, q, r, x, y, z, k)
        v = mean(k, p, q, r)
        square = dot(v, v)
    for _ in range(ITERATIONS):
        to_b = support(sb, b, v)
        if sa.kind >= BOX:
            to_a = support(sa, a, scale(-1.0, v))
        new = sub(add(d, to_a), to_b)
        had = (count > 0 and new == p) or (count > 1 and new == q) or (count > 2 and new == r)
        if had:
            break
        if count < 2:
            p1, q1, r1, x1, y1, z1 = p, new, new, x, to_b, to_b
            if count == 0:
                m = 0.0, 1.0, 0.0
            else:
                m = on_line(p, new)
        elif count == 2:
            p1, q1, r1, x1, y1, z1 = p, q, new, x, y, to_b
            m = on_triangle(p, q, new)
        else:
            lacks, m = on_tetrahedron(p, q, r, new)
            p1, x1 = (q, y) if lacks == 0 else ((r, z) if lacks == 1 else (p, x))
            q1, y1 = (r, z) if lacks == 0 else ((p, x) if lacks == 1 else (q, y))
            r1, z1 = new, to_b
        w = mean(m, p1, q1, r1)
        if not dot(w, w) < square:
            break
        v, square, k = w, dot(w, w), m
        p, q, r, x, y, z, k, count = kept(p1, q1, r1, x1, y1, z1, k)
        if square == 0.0:
            break
    if dot(v, new) <= 0.0:
        v = ZERO
    return v, mean(k, x, y, z), count, sub(x, y), (x, y, z)


jit_module(__name__)
