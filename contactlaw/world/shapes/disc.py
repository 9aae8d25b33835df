"""Rims and sides of cylinders: a disc swept by a small sphere, and its deepest point in a plane or a core.

A cylinder's rim is a circle of radius c, the border of a disc across its axis, swept by a sphere of radius r. What it
touches is convex, so the disc has one deepest point; this moves round as the cylinder rolls or spins, and across the
disc as the cylinder comes to lie flat. To keep that motion continuous the disc is crowned: at y from its middle the
sphere has the radius r (1 - C (1 + y^2/c^2)). The overlap with a plane of normal n, r(y) - n.(m + y), is greatest at

    y = -n' c^2/(2 C r), or on the rim, y = -c n'/|n'|, whichever is shorter         n' = n across the axis,

and with a core (`core`), at distance D(y), where D + C r y^2/c^2 is least in the disc: the root of the slope of
D^2/2 + C r D y^2/c^2 with D held. Both minima are of strictly convex functions, so the point moves continuously; by the
envelope theorem the force on it is the gradient of the overlap. The side of a cylinder, which meets crossing cylinders,
is the disc swept along the axis too, crowned by C (1 + s^2 + y^2/c^2), s from -1 to 1.
"""

from math import sqrt

from contactlaw.jit import jit_module
from contactlaw.world.data.kinds import HULL, PLANE, SIDE
from contactlaw.world.data.vec import ZERO, axpy, cross, dot, load, norm, scale, to_world
from contactlaw.world.shapes.core import CROWN, LEAST, change_of, excess_at, local, next_place
from contactlaw.world.shapes.geometry import note, recall

ITERATIONS = 60  # of Newton's method at most; it takes three to six
CUTS = 40  # times that the length of a step is changed at most
CONVERGED = 1e-14  # of the radius, a step at which the iteration ends
ROOT_ITERATIONS = 50  # iterations for the place along the axis at most
ROOT_CONVERGED = 1e-12  # of half the length, a step at which they end


def dimensions(s):
    """Return a disc's radius [m], a unit vector across its axis, in its body, and half its length along it [m]."""
    along = dot(load(s.half), load(s.normal))
    across = axpy(-along, load(s.normal), load(s.half))
    radius = norm(across)
    return radius, scale(1.0 / radius, across), along


def line_of(s, b):
    """Return the half axis of a side or an edge, world frame, and its radius [m]."""
    if s.kind != SIDE:
        return to_world(b.axes, load(s.half)), s.radius
    out, _, along = dimensions(s)
    return to_world(b.axes, scale(along, load(s.normal))), out + s.radius * (1.0 - 2.0 * CROWN)


def within_circle(h, b, radius):
    """Minimise y.H y/2 + b.y over |y| <= radius: (H + t) y = -b, with t >= 0 by Newton's method on 1/|y|."""
    t, x, y = 0.0, 0.0, 0.0
    for _ in range(ITERATIONS):
        p, q = h[0] + t, h[2] + t
        det = p * q - h[1] * h[1]
        x, y = (h[1] * b[1] - q * b[0]) / det, (h[1] * b[0] - p * b[1]) / det
        square = x * x + y * y
        far = sqrt(square)
        if far <= radius * (1.0 + CONVERGED):
            break
        t += square * det / (q * x * x - 2.0 * h[1] * x * y + p * y * y) * (far - radius) / radius
    far = sqrt(x * x + y * y)
    share = radius / far if far > radius else 1.0
    return share * x, share * y


def slope_at(m, e1, e2, crown, y, shapes, last):
    """Return `excess_at` at m + y, the slope there of distance^2/2 with the crown, and the crown's factor.

    last: as for `excess_at`.
    """
    found = excess_at(m, axpy(y[1], e2, scale(y[0], e1)), shapes[2].radius, shapes, last)
    e = found[0]
    k = crown * max(norm(e), LEAST)
    return found, (dot(e, e1) + k * y[0], dot(e, e2) + k * y[1]), k


def nearest_in_disc(m, e1, e2, radius, crown, shapes, y, last):
    """Return the point y of a disc round m, along e1 and e2, with the least distance + crown y^2/2 from a core.

    y, last: where to begin, and `excess_at` nearby; also returns that at the point. Newton's method within the circle.
    The function is convex and piecewise smooth, so a step that goes too far is shortened to about where the slope along
    it vanishes: between two rims a much shorter one would be followed by hundreds like it.
    """
    core = shapes[2]
    last, g, k = slope_at(m, e1, e2, crown, y, shapes, last)
    for _ in range(ITERATIONS):
        e, count, other, _ = last
        by1 = change_of(e, count, other, e1, core.radius, core)
        by2 = change_of(e, count, other, e2, core.radius, core)
        h = dot(by1, e1) + k, dot(by1, e2), dot(by2, e2) + k
        b = g[0] - h[0] * y[0] - h[1] * y[1], g[1] - h[1] * y[0] - h[2] * y[1]
        z = within_circle(h, b, radius)
        step = z[0] - y[0], z[1] - y[1]
        start = g[0] * step[0] + g[1] * step[1]
        if not start < 0.0 or step[0] * step[0] + step[1] * step[1] <= (CONVERGED * radius) ** 2:
            break
        share, low, high, below, above = 1.0, 0.0, 1.0, start, 0.0
        for _ in range(CUTS):
            new = y[0] + share * step[0], y[1] + share * step[1]
            last, g, k = slope_at(m, e1, e2, crown, new, shapes, last)
            end = g[0] * step[0] + g[1] * step[1]
            if end > -0.1 * start:
                high, above = share, end
            elif share < 1.0 and end < 0.5 * start:
                low, below = share, end
            else:
                break
            share = low + (high - low) * min(max(below / (below - above), 0.1), 0.9)
        y = new
    return y, last


def lowest_over_plane(s, b, n):
    """Return the vector from a disc's middle to its deepest point below a plane of normal n [m], and the radius."""
    radius, _, _ = dimensions(s)
    r, axis = s.radius, to_world(b.axes, load(s.normal))
    across = axpy(-dot(n, axis), axis, n)
    far = norm(across)
    t = 0.5 * radius / (CROWN * r)
    share = t * far
    if share > 1.0:
        t, share = 1.0 / far, 1.0
    return scale(-t * radius, across), r * (1.0 - CROWN * (1.0 + share * share))


def deepest(sa, a, sb, b, d, last):
    """Return the vector from a disc's middle to its deepest point in a plane or a core [m], and the radius there [m].

    d: from B's centre, or a plane's point, to the middle of the disc, world frame. last: as for `geometry.meet`.
    """
    if sb.kind == PLANE:
        return lowest_over_plane(sa, a, to_world(b.axes, load(sb.normal)))
    radius, side, length = dimensions(sa)
    side, axis, shapes = to_world(a.axes, side), to_world(a.axes, load(sa.normal)), (sa, a, sb, b)
    m, e1, u = d, side, axis
    if sb.kind != HULL:
        m, e1, u = local(d, sb, b), local(side, sb, b), local(axis, sb, b)
    e2, crown = cross(u, e1), 2.0 * CROWN * sa.radius
    (x, z, s), count, on_b = recall(last)
    y, near = (x, z), (ZERO, count, ZERO, on_b)
    if length > 0.0:
        s, y, near = along_axis(m, e1, e2, (scale(length, u), crown, radius), shapes, (s, y, near))
    else:
        y, near = nearest_in_disc(m, e1, e2, radius, crown / (radius * radius), shapes, y, near)
    note(last, (y[0], y[1], s), near[1], near[3])
    offset = axpy(s * length, axis, axpy(y[0], side, scale(y[1], cross(axis, side))))
    square = (y[0] * y[0] + y[1] * y[1]) / (radius * radius)
    return offset, sa.radius * (1.0 - CROWN * (1.0 + s * s + square))


def along_axis(m, e1, e2, made, shapes, start):
    """Return where a cylinder's side is deepest, along its axis (-1..1) and across it, and `excess_at` there.

    made: half the axis, the crown, and the radius. start: the same three nearby. The slope along the axis of the least
    distance of each disc is that of the distance at its nearest point, and grows: the secant method, guarded by
    bisection.
    """
    (at, y, last), slope, ends = start, 0.0, (-2.0, 2.0)
    value, y, last = slope_along(m, e1, e2, made, at, shapes, y, last)
    for _ in range(ROOT_ITERATIONS):
        new, ends = next_place(at, value, slope, ends)
        if value == 0.0 or abs(new - at) <= ROOT_CONVERGED:
            break
        other, y, last = slope_along(m, e1, e2, made, new, shapes, y, last)
        at, value, slope = new, other, (other - value) / (new - at)
    return at, y, last


def slope_along(m, e1, e2, made, at, shapes, y, last):
    """Return the slope along the axis at a place of it, the deepest point of the disc there, and `excess_at` at that.

    y, last: as for `nearest_in_disc`.
    """
    along, crown, radius = made
    m = axpy(at, along, m)
    y, last = nearest_in_disc(m, e1, e2, radius, crown / (radius * radius), shapes, y, last)
    return dot(last[0], along) + crown * norm(last[0]) * at, y, last


jit_module(__name__)
