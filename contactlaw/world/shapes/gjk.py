"""Nearest points of swept cores, hulls with all shapes, by the algorithm of Gilbert, Johnson & Keerthi (1988).

While two of them overlap by less than the sum of radii their cores are apart, so that the vector between the nearest
points of the cores is unique and moves continuously. Flat on flat, a hull rests on its parts, see
`description.parts_of`; two cores meet directly in one point only where none of these lie between.

The distance is that of the Minkowski difference from the origin. A simplex of its vertices is moved towards the origin,
until the vertex furthest towards the origin is already in the simplex: the result is then exact.
"""

from math import atan2, copysign, cos, floor, pi, sin

from contactlaw.jit import jit_module
from contactlaw.memory import doubles_at
from contactlaw.world.data.call import ask_deepest
from contactlaw.world.data.kinds import BOX, CYLINDER, DISC, EDGE, HULL, PLANE, SEGMENT, SIDE
from contactlaw.world.data.records import NEVER
from contactlaw.world.data.vec import ZERO, add, axpy, dot, load, norm, scale, sub, to_body, to_world
from contactlaw.world.shapes.core import NO_PLACES, clip, deepest_on_line
from contactlaw.world.shapes.disc import dimensions
from contactlaw.world.shapes.geometry import BACK, centre, note, recall

ITERATIONS = 100  # at most; never reached
CELLS = 4  # along each side of each face of the cube of directions
STAVE = pi / 16.0  # [rad] a side of the prism that stands for a cylinder: on smooth shapes GJK does not end exactly
DEEP = 1e-6  # of the sum of radii: distance of cores up to which they count as overlapping


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
    return to_world(b.axes, furthest(s, to_body(b.axes, d))) if b.oriented != 0 else ZERO


def furthest(s, own):
    """Return the point of a core furthest along a direction, as `support`, both along the axes of its body."""
    at = load(s.at)
    if s.kind == HULL:
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
        at = axpy(1.0 if dot(own, u) >= 0.0 else -1.0, u, at)
    elif s.kind == DISC or s.kind == SIDE:
        out, _, along = dimensions(s)
        axis = load(s.normal)
        up = dot(own, axis)
        across = axpy(-up, axis, own)
        at = axpy(copysign(along, up), axis, axpy(out / max(norm(across), 1e-300), across, at))
    elif s.kind == BOX:
        own, h, r = to_body(s.axes, own), s.half, s.radius
        corner = copysign(h[0] - r, own[0]), copysign(h[1] - r, own[1]), copysign(h[2] - r, own[2])
        at = add(at, to_world(s.axes, corner))
    elif s.kind == CYLINDER:
        own, h, r = to_body(s.axes, own), s.half, s.radius
        angle = floor(atan2(own[1], own[0]) / STAVE + 0.5) * STAVE
        out = (h[0] - r) * (0.5 + 0.5 / cos(0.5 * STAVE))
        at = add(at, to_world(s.axes, (out * cos(angle), out * sin(angle), copysign(h[2] - r, own[2]))))
    return at


def on_triangle(p, q, r):
    """Return the barycentric coordinates of a triangle's point nearest to the origin (Ericson 2005, section 5.1.5).

    Of a segment the last two vertices are the same, of a single vertex all three.
    """
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


def mean(k, points):
    """Return the sum of three vectors weighted by k."""
    return axpy(k[0], points[0], axpy(k[1], points[1], scale(k[2], points[2])))


def extended(points, count, new):
    """Return the vertices of a simplex with one more, repeated up to three."""
    return new if count < 1 else points[0], new if count < 2 else points[1], new


def without(points, i):
    """Return what is left without vertex i, 0 or 1, first."""
    return points[1] if i == 0 else points[0], points[2], points[2]


def kept(points, on_b, k):
    """Return a simplex without vertices of zero weight, with their points on B; its weights, and how many are left."""
    for i in (1, 0):
        if k[i] == 0.0:
            points, on_b, k = without(points, i), without(on_b, i), (k[1 - i], k[2], 0.0)
    return points, on_b, k, 3 if k[2] > 0.0 else (2 if k[1] > 0.0 else 1)


def side_of(points, i, new):
    """Return the triangle of a vertex `new` and those of another triangle but vertex i."""
    return points[(i + 1) % 3], points[(i + 2) % 3], new


def nearest_side(points, new):
    """Find the triangle with vertex `new` nearest to the origin; returns which vertex it lacks, and coordinates."""
    best, lacks, found = 1e300, 0, (0.0, 0.0, 1.0)
    for i in range(3):
        side = side_of(points, i, new)
        k = on_triangle(side[0], side[1], new)
        v = mean(k, side)
        if dot(v, v) < best:
            best, lacks, found = dot(v, v), i, k
    return lacks, found


def nearest(sa, a, sb, b, shift, count=0, on_b=NO_PLACES, far=NEVER):
    """Find the nearest points of two cores.

    A is a box or a hull, or else a point, its middle; shift: added to A [m]. count, on_b: number and vertices of the
    nearest feature, found with A a point nearby; 0: not known. far: distance [m] from which on any points will do whose
    difference shows that the cores are so far apart. Returns the vector from the point on B to that on A, zero if the
    cores overlap; the point on B from its body's centre of mass [m]; how many vertices span the nearest feature, of B
    where A is a point; the direction of that feature's edge, if there are two; and the vertices on B, along its body's
    axes.
    """
    to_a, is_core = add(sub(load(a.position), load(b.position)), shift), sa.kind >= BOX
    above = to_body(b.axes, add(to_a, centre(sa, a)))  # all that follows is along B's axes
    v = sub(above, load(sb.at))
    points, square, k, new = NO_PLACES, 1e300, (1.0, 0.0, 0.0), ZERO
    if count > 0:
        on_b = on_b[0], on_b[0 if count < 2 else 1], on_b[count - 1]
        points = sub(above, on_b[0]), sub(above, on_b[1]), sub(above, on_b[2])
        points, on_b, k, count = kept(points, on_b, on_triangle(points[0], points[1], points[2]))
        v = mean(k, points)
        square = dot(v, v)
    for _ in range(ITERATIONS):
        to_b = furthest(sb, v)
        if is_core:
            above = to_body(b.axes, add(to_a, support(sa, a, to_world(b.axes, scale(-1.0, v)))))
        new = sub(above, to_b)
        if dot(v, new) > far * norm(v):
            break
        if (count > 0 and new == points[0]) or (count > 1 and new == points[1]) or (count > 2 and new == points[2]):
            break
        if count < 3:
            more, ends = extended(points, count, new), extended(on_b, count, to_b)
            m = on_triangle(more[0], more[1], new)
        else:
            lacks, m = nearest_side(points, new)
            more, ends = side_of(points, lacks, new), side_of(on_b, lacks, to_b)
        w = mean(m, more)
        if not dot(w, w) < square:
            break
        v, square = w, dot(w, w)
        points, on_b, k, count = kept(more, ends, m)
    if dot(v, new) <= 0.0:
        v = ZERO
    edge = to_world(b.axes, sub(on_b[0], on_b[1]))
    return to_world(b.axes, v), to_world(b.axes, mean(k, on_b)), count, edge, on_b


def meet(sa, a, sb, b, last):
    """`geometry.meet` with a hull."""
    radius_a, radius_b, from_a, u = sa.radius, sb.radius, centre(sa, a), ZERO
    place, count, on_b = recall(last)
    if sa.kind == DISC:
        offset, radius_a = ask_deepest(sa.deepest, sa, a, sb, b, ZERO, last)
        from_a = add(from_a, offset)
        _, count, on_b = recall(last)  # what that has noted
        v, y, _, _, _ = nearest(sa, a, sb, b, offset, count, on_b)
    elif sa.kind == SEGMENT or sa.kind == EDGE:
        u = to_world(a.axes, load(sa.half))
        known = ZERO, count, ZERO, on_b
        at, radius_a, (v, count, _, on_b) = deepest_on_line(ZERO, u, 0.0, (sa, a, sb, b), place[2], known)
        y = sub(add(sub(load(a.position), load(b.position)), axpy(at, u, from_a)), v)
        note(last, (0.0, 0.0, at), count, on_b)
    else:
        v, y, count, _, on_b = nearest(sa, a, sb, b, ZERO, count, on_b)
        note(last, ZERO, count if sa.kind < BOX else 0, on_b)
    both = radius_a + radius_b
    distance = norm(v)
    if distance > DEEP * both:
        n = scale(1.0 / distance, v)
    else:  # as between two balls at the centres; of a line at its point nearest to the other centre
        n = sub(add(load(a.position), from_a), add(load(b.position), centre(sb, b)))
        n = axpy(clip(-dot(n, u) / max(dot(u, u), 1e-300)), u, n)
        n = scale(1.0 / max(norm(n), 1e-300), n)
    overlap = both - distance
    if sa.kind >= BOX:
        overlap -= BACK * both
    arm_b = axpy(distance / both * radius_b, n, y)
    arm_a = add(arm_b, sub(load(b.position), load(a.position)))
    return overlap, n, arm_a, arm_b


def separate(sa, a, sb, b, n, far):
    """Find two parallel planes that separate a core A from a plane or a core B.

    n: their normal from B to A, or zero if it is to be found: the best one, or one by which they are further apart than
    `far` [m]. Returns the normal, zero if the cores overlap; the least height of A along it and the greatest of B,
    without the radii that sweep them, from B's centre of mass [m]; and A's lowest point from its own centre of mass.
    """
    if sb.kind >= PLANE:
        n = to_world(b.axes, load(sb.normal))
        high = dot(n, centre(sb, b))
    else:
        if dot(n, n) == 0.0:
            v, _, _, _, _ = nearest(sa, a, sb, b, ZERO, far=far)
            n = scale(1.0 / max(norm(v), 1e-300), v)
        high = dot(n, support(sb, b, n))
    lowest = support(sa, a, scale(-1.0, n))
    return n, dot(n, add(sub(load(a.position), load(b.position)), lowest)), high, lowest


jit_module(__name__)
