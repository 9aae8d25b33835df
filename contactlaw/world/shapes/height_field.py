"""Height fields: a surface z = h(x, y) through heights given on a grid, and where round shapes are nearest to it.

Between the grid's points h is the cubic convolution of Keys (IEEE Trans. ASSP 29 (1981), a = -1/2): it passes through
the heights, reproduces quadratic surfaces, and its slope is continuous, so that the normal of a rolling ball is too.
Flat triangles, as engines draw them, have a kink at each edge, where a ball would touch twice.

The point of the surface nearest to a centre c is the minimum of the distance within the field's border, found by
Newton's method from the nearest of the grid's points. A shape that is no ball (a rim, an ellipsoid) meets the field at
the place x, y whose tangent plane has the shape's deepest point straight above. The steepness L bounds distances: a
point so high above the surface is at least height/sqrt(1 + L^2) away from it.
"""

from __future__ import annotations

from functools import lru_cache
from math import sqrt

import numpy as np

from contactlaw.jit import address_of, jit_inside
from contactlaw.memory import doubles_at
from contactlaw.world.data.call import MEETING, RADIUS, ask_meeting
from contactlaw.world.data.records import DISC, ELLIPSOID, SEGMENT, Array
from contactlaw.world.data.vec import ZERO, add, axpy, dot, load, norm, scale, sub, to_body, to_world
from contactlaw.world.shapes.curvature import feature, radius_between, rim
from contactlaw.world.shapes.disc import lowest_over_plane, parts
from contactlaw.world.shapes.ellipsoid import curved, facing
from contactlaw.world.shapes.geometry import centre

NEWTON, CUTS = 40, 20  # steps of Newton's method, and halvings of one, at most
FOUND = 1e-13  # of the distance, the slope of distance^2/2 at a minimum
SAME = 1e-12  # of the size, an offset of a rim or an ellipsoid from its own plane
STRIDE = 1e-7  # of the size, for differences
ACROSS = 16  # grid points each way that the nearest is sought among, at most: of more every second, third, ... is taken


def table(heights: Array, half: Array) -> tuple[Array, float]:
    """Heights as compiled code reads them, rows (n, 3), and the highest of the surface [m].

    heights: [m], shape (rows along y, columns along x). half: half lengths along x and y [m]. The first row holds the
    numbers of columns and rows, and 1/sqrt(1 + L^2). Heights are below the top; around them stands a border that
    continues them straight on, as interpolation asks.
    """
    steps = 2.0 * half / (np.array(heights.shape[::-1]) - 1)
    # It overshoots: its weights below zero add up to half of (1.25^2 - 1) at most
    top = float(heights.max() + 0.5 * (1.25**2 - 1.0) * np.ptp(heights))
    own = np.pad(heights, 1, mode="reflect", reflect_type="odd") - top
    # Its slope is at most twice the greatest difference of neighbours along an axis, times 1.25 across it
    slopes = [2.5 * float(np.abs(np.diff(own, axis=1 - i)).max()) / steps[i] for i in range(2)]
    head = [float(heights.shape[1]), float(heights.shape[0]), 1.0 / sqrt(1.0 + slopes[0] ** 2 + slopes[1] ** 2)]
    numbers = np.concatenate([head, own.ravel()])
    return np.concatenate([numbers, np.zeros(-len(numbers) % 3)]).reshape(-1, 3), top


@jit_inside
def weights(t):
    """Of four neighbours at a place t in [0, 1] between the middle ones: for the value, its slope and its bend."""
    value = ((1.0 - 0.5 * t) * t - 0.5) * t, (1.5 * t - 2.5) * t * t + 1.0, ((2.0 - 1.5 * t) * t + 0.5) * t
    slope = (2.0 - 1.5 * t) * t - 0.5, (4.5 * t - 5.0) * t, (4.0 - 4.5 * t) * t + 0.5, (1.5 * t - 1.0) * t
    bend = 2.0 - 3.0 * t, 9.0 * t - 5.0, 4.0 - 9.0 * t, 3.0 * t - 1.0
    return (value[0], value[1], value[2], 0.5 * (t - 1.0) * t * t), slope, bend


@jit_inside
def cell(x, half, count):
    """Of a coordinate: the grid's point before it, the share of the cell that is behind it, and points a metre."""
    dense = 0.5 * (count - 1) / half
    u = (x + half) * dense
    i = min(max(int(u), 0), count - 2)
    return i, u - i, dense


@jit_inside
def surface(s, x, y):
    """Height over the field's origin [m] within its border, its slopes along x and y, and its second derivatives."""
    points = doubles_at(s.points)
    columns, rows = int(points[0]), int(points[1])
    i, t, dense_x = cell(x, s.half[0], columns)
    j, u, dense_y = cell(y, s.half[1], rows)
    (value, slope, bend), (value_y, slope_y, bend_y) = weights(t), weights(u)
    h, h_x, h_y, h_xx, h_xy, h_yy = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for n in range(4):
        at = 3 + (j + n) * (columns + 2) + i
        a, b, c, d = points[at], points[at + 1], points[at + 2], points[at + 3]
        own = value[0] * a + value[1] * b + value[2] * c + value[3] * d
        sloping = slope[0] * a + slope[1] * b + slope[2] * c + slope[3] * d
        h += value_y[n] * own
        h_x += value_y[n] * sloping
        h_y += slope_y[n] * own
        h_xx += value_y[n] * (bend[0] * a + bend[1] * b + bend[2] * c + bend[3] * d)
        h_xy += slope_y[n] * sloping
        h_yy += bend_y[n] * own
    slopes = h_x * dense_x, h_y * dense_y
    return h, slopes, (h_xx * dense_x * dense_x, h_xy * dense_x * dense_y, h_yy * dense_y * dense_y)


@jit_inside
def within(x, half):
    """A coordinate brought within the border."""
    return min(max(x, -half), half)


@jit_inside
def begin_at(s, c):
    """Where Newton's method begins: the foot of c, or the grid's point nearest to it, if that is nearer.

    No point that is further from c along x or y than its foot is from it can be nearest.
    """
    x, y = within(c[0], s.half[0]), within(c[1], s.half[1])
    h, _, _ = surface(s, x, y)
    best = (x - c[0]) ** 2 + (y - c[1]) ** 2 + (h - c[2]) ** 2
    points, far = doubles_at(s.points), sqrt(best)
    columns, rows = int(points[0]), int(points[1])
    first, _, dense_x = cell(max(c[0] - far, -s.half[0]), s.half[0], columns)
    last, _, _ = cell(min(c[0] + far, s.half[0]), s.half[0], columns)
    low, _, dense_y = cell(max(c[1] - far, -s.half[1]), s.half[1], rows)
    high, _, _ = cell(min(c[1] + far, s.half[1]), s.half[1], rows)
    for j in range(low, high + 2, 1 + (high - low) // ACROSS):
        for i in range(first, last + 2, 1 + (last - first) // ACROSS):
            u, v = i / dense_x - s.half[0], j / dense_y - s.half[1]
            h = points[3 + (j + 1) * (columns + 2) + i + 1]
            square = (u - c[0]) ** 2 + (v - c[1]) ** 2 + (h - c[2]) ** 2
            if square < best:
                best, x, y = square, u, v
    return x, y


@jit_inside
def normal(slopes):
    """Of the surface, by its slopes."""
    return scale(1.0 / sqrt(1.0 + slopes[0] * slopes[0] + slopes[1] * slopes[1]), (-slopes[0], -slopes[1], 1.0))


@jit_inside
def foot(s, c):
    """Where the field is nearest to a point c, in its frame: x, y [m]."""
    x, y = begin_at(s, c)
    h, slopes, bends = surface(s, x, y)
    p, q, d = x - c[0], y - c[1], h - c[2]
    for _ in range(NEWTON):
        g = p + d * slopes[0], q + d * slopes[1]
        held_x = abs(x) >= s.half[0] and g[0] * x < 0.0
        held_y = abs(y) >= s.half[1] and g[1] * y < 0.0
        g = 0.0 if held_x else g[0], 0.0 if held_y else g[1]
        square = p * p + q * q + d * d
        if g[0] * g[0] + g[1] * g[1] <= FOUND * FOUND * square:
            break
        xx, yy, xy = 1.0 + slopes[0] * slopes[0], 1.0 + slopes[1] * slopes[1], slopes[0] * slopes[1]
        full_xx, full_xy, full_yy = xx + d * bends[0], xy + d * bends[1], yy + d * bends[2]
        if full_xx > 0.0 and full_yy > 0.0 and full_xx * full_yy > full_xy * full_xy:
            xx, xy, yy = full_xx, full_xy, full_yy  # else without bends, which always leads down
        if held_x or held_y:
            xy = 0.0
        size = xx * yy - xy * xy
        step = (xy * g[1] - yy * g[0]) / size, (xy * g[0] - xx * g[1]) / size
        share, from_x, from_y = 1.0, x, y
        for _ in range(CUTS):
            x, y = within(from_x + share * step[0], s.half[0]), within(from_y + share * step[1], s.half[1])
            h, slopes, bends = surface(s, x, y)
            p, q, d = x - c[0], y - c[1], h - c[2]
            if p * p + q * q + d * d <= square * (1.0 + FOUND):  # which rounding alone may make longer
                break
            share *= 0.5
    return x, y


@jit_inside
def distance(s, c):
    """Signed distance [m] of a point c from the surface, and the normal at the nearest point, in the field's frame.

    Beyond the border the normal is towards c.
    """
    x, y = foot(s, c)
    h, slopes, _ = surface(s, x, y)
    away = c[0] - x, c[1] - y, c[2] - h
    if abs(c[0]) > s.half[0] or abs(c[1]) > s.half[1]:
        far = norm(away)
        return far, scale(1.0 / far, away)
    n = normal(slopes)
    return dot(away, n), n


@jit_inside
def lowest(sa, a, n):
    """From a shape's centre to the ball of it that is deepest over a plane of normal n [m], and that ball's radius."""
    if sa.kind == DISC:
        return lowest_over_plane(sa, a, n)
    if sa.kind == ELLIPSOID:
        return sub(facing(sa, a, scale(-1.0, n)), centre(sa, a)), 0.0
    return ZERO, sa.radius


@jit_inside
def offset(x, y, c, one):
    """How far [m] a shape's deepest point over the plane that touches the field at x, y is from there, along x and y.

    c: the shape's centre, in the field's frame. one: both shapes and bodies. Returns the ball there as well.
    """
    sa, a, sb, b = one
    h, slopes, _ = surface(sb, x, y)
    way, radius = lowest(sa, a, to_world(b.axes, to_world(sb.axes, normal(slopes))))
    p = add(c, to_body(sb.axes, to_body(b.axes, way)))
    d = p[2] - h
    return (p[0] - x + d * slopes[0], p[1] - y + d * slopes[1]), way, radius, p


@jit_inside
def ball_of(c, one):
    """The ball of a shape by which it meets the field: from its centre [m], its radius, and its centre in the field.

    Newton's method, from where the shape's centre is nearest to the field, on the offset, with differences for its
    derivatives: the curvature of a rim's deepest point has jumps.
    """
    sa, _, sb, _ = one
    x, y = foot(sb, c)
    scale_of = size(sa)
    off, way, radius, p = offset(x, y, c, one)
    for _ in range(NEWTON):
        square = off[0] * off[0] + off[1] * off[1]
        if square <= (SAME * scale_of) ** 2:
            break
        e = STRIDE * scale_of
        one_x, _, _, _ = offset(x + e, y, c, one)
        one_y, _, _, _ = offset(x, y + e, c, one)
        xx, yx = (one_x[0] - off[0]) / e, (one_x[1] - off[1]) / e
        xy, yy = (one_y[0] - off[0]) / e, (one_y[1] - off[1]) / e
        determinant = xx * yy - xy * yx
        if determinant == 0.0:
            break
        step = (xy * off[1] - yy * off[0]) / determinant, (yx * off[0] - xx * off[1]) / determinant
        share, from_x, from_y = 1.0, x, y
        for _ in range(CUTS):
            x, y = within(from_x + share * step[0], sb.half[0]), within(from_y + share * step[1], sb.half[1])
            off, way, radius, p = offset(x, y, c, one)
            if off[0] * off[0] + off[1] * off[1] < square:
                break
            share *= 0.5
    return way, radius, p


@jit_inside
def size(sa):
    """Radius [m] of the sphere around a shape."""
    if sa.kind == DISC:
        return parts(sa)[0] + sa.radius
    return max(sa.half[0], sa.half[1], sa.half[2]) if sa.kind == ELLIPSOID else sa.radius


def meet(sa, a, sb, b):
    """`geometry.meet` of a round shape with a height field; where it is clear of it, a gap that there is at least."""
    from_a = centre(sa, a)
    between = sub(load(a.position), load(b.position))
    c = to_body(sb.axes, to_body(b.axes, add(between, sub(from_a, centre(sb, b)))))
    h, slopes, _ = surface(sb, within(c[0], sb.half[0]), within(c[1], sb.half[1]))
    far, n, radius = (c[2] - h) * doubles_at(sb.points)[2], normal(slopes), size(sa)
    if far <= radius:
        radius = sa.radius
        if sa.kind >= SEGMENT:
            way, radius, c = ball_of(c, (sa, a, sb, b))
            from_a = add(from_a, way)
        far, n = distance(sb, c)
    n = to_world(b.axes, to_world(sb.axes, n))
    arm = axpy(-radius, n, from_a)
    return radius - far, n, arm, add(arm, between)


def radius(sa, a, sb, b):
    """`geometry.effective_radius` of the same; the field counts as flat."""
    if sa.kind == DISC:
        return rim(sa, a)
    if sa.kind != ELLIPSOID:
        return sa.radius, ZERO
    _, n, _, _ = ask_meeting(sb.meet, sa, a, sb, b)
    return radius_between(curved(sa, a, n), feature(0.0, 3, ZERO))


@lru_cache
def addresses() -> dict[str, int]:
    """Of both, compiled where there are height fields."""
    return {"meet": address_of(meet, MEETING), "curve": address_of(radius, RADIUS)}
