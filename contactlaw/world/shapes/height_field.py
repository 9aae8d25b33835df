"""Height fields: a smooth surface z = h(x, y) through heights on a grid, and its contact with round shapes.

Between the grid points h is the cubic convolution of Keys (IEEE Trans. ASSP 29 (1981), a = -1/2): it passes through the
heights, reproduces quadratic surfaces, and has a continuous slope, so the normal under a rolling ball is continuous.
(The flat triangles that engines use have a kink at each edge, at which a ball touches twice.)

A ball touches at the point of the surface nearest to its centre, found by Newton's method from the nearest grid point.
A rim or an ellipsoid touches at the point x, y whose tangent plane has the deepest point of the shape straight above.
With L the greatest slope, a point at a height H over the surface is at least H/sqrt(1 + L^2) away from it.
"""

from functools import lru_cache
from math import sqrt

import numpy as np

from contactlaw.jit import address_of, jit_inside
from contactlaw.memory import doubles_at
from contactlaw.world.data.call import ask_meeting, ask_radius
from contactlaw.world.data.kinds import DISC, ELLIPSOID, SEGMENT
from contactlaw.world.data.records import Array
from contactlaw.world.data.vec import ZERO, add, axpy, dot, load, norm, scale, sub, to_body, to_world
from contactlaw.world.shapes.curvature import feature, radius_between, rim
from contactlaw.world.shapes.disc import dimensions, lowest_over_plane
from contactlaw.world.shapes.ellipsoid import curved, facing
from contactlaw.world.shapes.geometry import centre

NEWTON, CUTS = 40, 20  # iterations of Newton's method, and halvings of one step, at most
CONVERGED = 1e-13  # gradient of distance^2/2 over the distance, at a minimum
ALIGNED = 1e-12  # offset between a shape's deepest point and its plane's point of contact, over the shape's size
DIFFERENCE = 1e-7  # step of finite differences, over the shape's size
SAMPLES = 16  # grid points each way, at most, among which the start of Newton's method is chosen
OVERSHOOT = 1.25  # sum of the magnitudes of Keys' weights, at most (half way between two grid points)


def table(heights: Array, half: Array) -> tuple[Array, float]:
    """Return heights in the layout of compiled code, shape (n, 3), and an upper bound on the surface [m].

    heights: [m], shape (rows along y, columns along x). half: half lengths along x and y [m]. The first row holds the
    numbers of columns and rows, and 1/sqrt(1 + L^2). The others hold the heights relative to the bound, with one more
    grid point on each side, extrapolated linearly.
    """
    spacing = 2.0 * half / (np.array(heights.shape[::-1]) - 1)
    # negative weights add up to (S - 1)/2 where all magnitudes add up to S
    top = float(heights.max() + 0.5 * (OVERSHOOT**2 - 1.0) * np.ptp(heights))
    padded = np.pad(heights, 1, mode="reflect", reflect_type="odd") - top
    # a cubic's slope is at most twice the greatest difference of neighbours over their spacing
    slopes = [2.0 * OVERSHOOT * float(np.abs(np.diff(padded, axis=1 - i)).max()) / spacing[i] for i in range(2)]
    head = [float(heights.shape[1]), float(heights.shape[0]), 1.0 / sqrt(1.0 + slopes[0] ** 2 + slopes[1] ** 2)]
    numbers = np.concatenate([head, padded.ravel()])
    return np.concatenate([numbers, np.zeros(-len(numbers) % 3)]).reshape(-1, 3), top


@jit_inside
def weights(t):
    """Return Keys' weights of four neighbours at a share t between the middle two, and their first two derivatives."""
    value = ((1.0 - 0.5 * t) * t - 0.5) * t, (1.5 * t - 2.5) * t * t + 1.0, ((2.0 - 1.5 * t) * t + 0.5) * t
    slope = (2.0 - 1.5 * t) * t - 0.5, (4.5 * t - 5.0) * t, (4.0 - 4.5 * t) * t + 0.5, (1.5 * t - 1.0) * t
    bend = 2.0 - 3.0 * t, 9.0 * t - 5.0, 4.0 - 9.0 * t, 3.0 * t - 1.0
    return (value[0], value[1], value[2], 0.5 * (t - 1.0) * t * t), slope, bend


@jit_inside
def cell(x, half, count):
    """Return the index of the grid point before a coordinate, the share of the cell past it, grid points a metre."""
    density = 0.5 * (count - 1) / half
    u = (x + half) * density
    i = min(max(int(u), 0), count - 2)
    return i, u - i, density


@jit_inside
def surface(s, x, y):
    """Return the height [m] in the field's frame, slopes along x and y, and second derivatives xx, xy, yy [1/m]."""
    points = doubles_at(s.points)
    columns, rows = int(points[0]), int(points[1])
    i, t, density_x = cell(x, s.half[0], columns)
    j, u, density_y = cell(y, s.half[1], rows)
    (value, slope, bend), (value_y, slope_y, bend_y) = weights(t), weights(u)
    h, h_x, h_y, h_xx, h_xy, h_yy = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for n in range(4):
        at = 3 + (j + n) * (columns + 2) + i
        a, b, c, d = points[at], points[at + 1], points[at + 2], points[at + 3]
        along = value[0] * a + value[1] * b + value[2] * c + value[3] * d
        along_x = slope[0] * a + slope[1] * b + slope[2] * c + slope[3] * d
        h += value_y[n] * along
        h_x += value_y[n] * along_x
        h_y += slope_y[n] * along
        h_xx += value_y[n] * (bend[0] * a + bend[1] * b + bend[2] * c + bend[3] * d)
        h_xy += slope_y[n] * along_x
        h_yy += bend_y[n] * along
    slopes = h_x * density_x, h_y * density_y
    return h, slopes, (h_xx * density_x * density_x, h_xy * density_x * density_y, h_yy * density_y * density_y)


@jit_inside
def normal(slopes):
    """Return the upward unit normal of the surface."""
    return scale(1.0 / sqrt(1.0 + slopes[0] * slopes[0] + slopes[1] * slopes[1]), (-slopes[0], -slopes[1], 1.0))


@jit_inside
def within(x, half):
    """Return a coordinate clamped to the border."""
    return min(max(x, -half), half)


@jit_inside
def start(s, c):
    """Return x, y to start Newton's method from: straight below the point c, or the nearest grid point if nearer.

    Only grid points within the distance straight down can be nearer.
    """
    x, y = within(c[0], s.half[0]), within(c[1], s.half[1])
    h, _, _ = surface(s, x, y)
    best = (x - c[0]) ** 2 + (y - c[1]) ** 2 + (h - c[2]) ** 2
    points, far = doubles_at(s.points), sqrt(best)
    columns, rows = int(points[0]), int(points[1])
    first, _, density_x = cell(max(c[0] - far, -s.half[0]), s.half[0], columns)
    last, _, _ = cell(min(c[0] + far, s.half[0]), s.half[0], columns)
    low, _, density_y = cell(max(c[1] - far, -s.half[1]), s.half[1], rows)
    high, _, _ = cell(min(c[1] + far, s.half[1]), s.half[1], rows)
    for j in range(low, high + 2, 1 + (high - low) // SAMPLES):
        for i in range(first, last + 2, 1 + (last - first) // SAMPLES):
            u, v = i / density_x - s.half[0], j / density_y - s.half[1]
            h = points[3 + (j + 1) * (columns + 2) + i + 1]
            square = (u - c[0]) ** 2 + (v - c[1]) ** 2 + (h - c[2]) ** 2
            if square < best:
                best, x, y = square, u, v
    return x, y


@jit_inside
def nearest(s, c):
    """Return the coordinates x, y of the point of the surface nearest to a point c, all in the field's frame [m].

    Newton's method on distance^2/2 within the border, with backtracking. Where the second derivatives make it concave
    they are left out (Gauss-Newton), which always descends.
    """
    x, y = start(s, c)
    h, slopes, bends = surface(s, x, y)
    p, q, d = x - c[0], y - c[1], h - c[2]
    for _ in range(NEWTON):
        g = p + d * slopes[0], q + d * slopes[1]
        held_x = abs(x) >= s.half[0] and g[0] * x < 0.0  # by the border
        held_y = abs(y) >= s.half[1] and g[1] * y < 0.0
        g = 0.0 if held_x else g[0], 0.0 if held_y else g[1]
        square = p * p + q * q + d * d
        if g[0] * g[0] + g[1] * g[1] <= CONVERGED * CONVERGED * square:
            break
        xx, yy, xy = 1.0 + slopes[0] * slopes[0], 1.0 + slopes[1] * slopes[1], slopes[0] * slopes[1]
        full_xx, full_xy, full_yy = xx + d * bends[0], xy + d * bends[1], yy + d * bends[2]
        if full_xx > 0.0 and full_yy > 0.0 and full_xx * full_yy > full_xy * full_xy:
            xx, xy, yy = full_xx, full_xy, full_yy
        if held_x or held_y:
            xy = 0.0
        determinant = xx * yy - xy * xy
        step = (xy * g[1] - yy * g[0]) / determinant, (xy * g[0] - xx * g[1]) / determinant
        share, from_x, from_y = 1.0, x, y
        for _ in range(CUTS):
            x, y = within(from_x + share * step[0], s.half[0]), within(from_y + share * step[1], s.half[1])
            h, slopes, bends = surface(s, x, y)
            p, q, d = x - c[0], y - c[1], h - c[2]
            if p * p + q * q + d * d <= square * (1.0 + CONVERGED):  # near the minimum rounding may add to it
                break
            share *= 0.5
    return x, y


@jit_inside
def distance(s, c):
    """Return the signed distance [m] of a point c from the surface, and the normal there, in the field's frame.

    Beyond the border the distance is positive and the normal points to c.
    """
    x, y = nearest(s, c)
    h, slopes, _ = surface(s, x, y)
    away = c[0] - x, c[1] - y, c[2] - h
    if abs(c[0]) > s.half[0] or abs(c[1]) > s.half[1]:
        far = norm(away)
        return far, scale(1.0 / far, away)
    n = normal(slopes)
    return dot(away, n), n


@jit_inside
def size(s):
    """Return the radius [m] of the sphere around a shape."""
    if s.kind == DISC:
        return dimensions(s)[0] + s.radius
    return max(s.half[0], s.half[1], s.half[2]) if s.kind == ELLIPSOID else s.radius


@jit_inside
def lowest(s, b, n):
    """Return the centre, from the shape's, and radius [m] of a shape's ball deepest below a plane of normal n."""
    if s.kind == DISC:
        return lowest_over_plane(s, b, n)
    return sub(facing(s, b, scale(-1.0, n)), centre(s, b)), 0.0


@jit_inside
def offset(x, y, c, pair):
    """Return the offset [m] along x and y from the point x, y of the field to a shape's deepest point over its plane.

    c: the shape's centre in the field's frame [m]. pair: both shapes and bodies. Returns the deepest ball as well: its
    centre from the shape's in the world, its radius, and its centre in the field's frame [m].
    """
    sa, a, sb, b = pair
    h, slopes, _ = surface(sb, x, y)
    way, radius = lowest(sa, a, to_world(b.axes, to_world(sb.axes, normal(slopes))))
    p = add(c, to_body(sb.axes, to_body(b.axes, way)))
    d = p[2] - h
    return (p[0] - x + d * slopes[0], p[1] - y + d * slopes[1]), way, radius, p


@jit_inside
def touching_ball(c, pair):
    """Return the ball by which a rim or an ellipsoid touches the field, as `offset` does.

    Newton's method on the offset, from the point nearest to the shape's centre c, with finite differences: the
    derivative of a rim's deepest point is discontinuous.
    """
    sa, _, sb, _ = pair
    x, y = nearest(sb, c)
    length = size(sa)
    off, way, radius, p = offset(x, y, c, pair)
    for _ in range(NEWTON):
        square = off[0] * off[0] + off[1] * off[1]
        if square <= (ALIGNED * length) ** 2:
            break
        e = DIFFERENCE * length
        by_x, _, _, _ = offset(x + e, y, c, pair)
        by_y, _, _, _ = offset(x, y + e, c, pair)
        xx, yx = (by_x[0] - off[0]) / e, (by_x[1] - off[1]) / e
        xy, yy = (by_y[0] - off[0]) / e, (by_y[1] - off[1]) / e
        determinant = xx * yy - xy * yx
        if determinant == 0.0:
            break
        step = (xy * off[1] - yy * off[0]) / determinant, (yx * off[0] - xx * off[1]) / determinant
        share, from_x, from_y = 1.0, x, y
        for _ in range(CUTS):
            x, y = within(from_x + share * step[0], sb.half[0]), within(from_y + share * step[1], sb.half[1])
            off, way, radius, p = offset(x, y, c, pair)
            if off[0] * off[0] + off[1] * off[1] < square:
                break
            share *= 0.5
    return way, radius, p


def meet(sa, a, sb, b):
    """`geometry.meet` of a round shape and a height field; where they are clearly apart, a lower bound on the gap."""
    from_a = centre(sa, a)
    between = sub(load(a.position), load(b.position))
    c = to_body(sb.axes, to_body(b.axes, add(between, sub(from_a, centre(sb, b)))))
    h, slopes, _ = surface(sb, within(c[0], sb.half[0]), within(c[1], sb.half[1]))
    far, n, radius = (c[2] - h) * doubles_at(sb.points)[2], normal(slopes), size(sa)
    if far <= radius:
        radius = sa.radius
        if sa.kind >= SEGMENT:
            way, radius, c = touching_ball(c, (sa, a, sb, b))
            from_a = add(from_a, way)
        far, n = distance(sb, c)
    n = to_world(b.axes, to_world(sb.axes, n))
    arm = axpy(-radius, n, from_a)
    return radius - far, n, arm, add(arm, between)


def radius(sa, a, sb, b):
    """`geometry.effective_radius` of the same pair; the field counts as flat."""
    if sa.kind == DISC:
        return rim(sa, a)
    if sa.kind != ELLIPSOID:
        return sa.radius, ZERO
    _, n, _, _ = ask_meeting(sb.meet, sa, a, sb, b)
    return radius_between(curved(sa, a, n), feature(0.0, 3, ZERO))


@lru_cache
def addresses() -> dict[str, int]:
    """Return the addresses of both, compiled when a scene has a height field."""
    return {"meet": address_of(meet, ask_meeting), "curve": address_of(radius, ask_radius)}
