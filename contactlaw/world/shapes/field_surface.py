"""The smooth surface z = h(x, y) of a height field, through heights on a grid, and its point nearest to a given one.

Between the grid points h is the cubic convolution of Keys (IEEE Trans. ASSP 29 (1981), a = -1/2): it passes through the
heights, reproduces quadratic surfaces, and has a continuous slope, so the normal under a rolling ball is continuous.
(The flat triangles that engines use have a kink at each edge, at which a ball touches twice.)
"""

from math import copysign, sqrt

import numpy as np

from contactlaw.jit import jit_module
from contactlaw.memory import doubles_at
from contactlaw.world.data.access import field_at
from contactlaw.world.data.records import FIELD, Array
from contactlaw.world.data.vec import cross, dot, norm, scale, sub, tangent
from contactlaw.world.shapes.core import clip

NEWTON, CUTS = 40, 20  # iterations of Newton's method, and halvings of one step, at most
CONVERGED = 1e-13  # gradient of distance^2/2 over the distance, at a minimum
SAMPLES = 16  # grid points each way, at most, among which the start of Newton's method is chosen
OVERSHOOT = 1.25  # sum of the magnitudes of Keys' weights, at most (half way between two grid points)
HEAD = FIELD.itemsize // 8  # numbers before the heights in a table


def table(heights: Array, half: Array) -> tuple[Array, float]:
    """Return heights in the layout of compiled code, shape (n, 3), and an upper bound on the surface [m].

    heights: [m], shape (rows along y, columns along x). half: half lengths along x and y [m]. The first two rows are a
    `records.FIELD`. The others hold the heights relative to the bound, with one more grid point on each side,
    extrapolated linearly.
    """
    spacing = 2.0 * half / (np.array(heights.shape[::-1]) - 1)
    # negative weights add up to (S - 1)/2 where all magnitudes add up to S
    top = float(heights.max() + 0.5 * (OVERSHOOT**2 - 1.0) * np.ptp(heights))
    padded = np.pad(heights, 1, mode="reflect", reflect_type="odd") - top
    # a cubic's slope is at most twice the greatest difference of neighbours over their spacing
    slopes = [2.0 * OVERSHOOT * float(np.abs(np.diff(padded, axis=1 - i)).max()) / spacing[i] for i in range(2)]
    away = 1.0 / sqrt(1.0 + slopes[0] ** 2 + slopes[1] ** 2)
    head = np.array([(*heights.shape[::-1], away, *sharpest(padded, spacing), 0.0)], FIELD)
    numbers = np.concatenate([head.view(np.float64), padded.ravel()])
    return np.concatenate([numbers, np.zeros(-len(numbers) % 3)]).reshape(-1, 3), top


def sharpest(padded: Array, spacing: Array) -> list[float]:
    """Return the greatest curvature [1/m] at the grid points of valleys, and that of ridges; of flat fields zero.

    With first derivatives p, q and second ones r, s, t the mean curvature ((1 + q^2) r - 2 p q s + (1 + p^2) t)/2 W^3
    and Gauss's (r t - s^2)/W^4, W^2 = 1 + p^2 + q^2. On both sides of a grid point r and t differ: the sharper counts.
    """

    def bends(values: Array) -> Array:
        a, b, c, d = values[:-3], values[1:-2], values[2:-1], values[3:]
        after, before = 2.0 * a - 5.0 * b + 4.0 * c - d, 4.0 * b - a - 5.0 * c + 2.0 * d
        return np.stack([np.concatenate([after, before[-1:]]), np.concatenate([after[:1], before])])

    p, q = (np.gradient(padded, spacing[i], axis=1 - i)[1:-1, 1:-1] for i in range(2))
    s = np.gradient(np.gradient(padded, spacing[0], axis=1), spacing[1], axis=0)[1:-1, 1:-1]
    xx = bends(padded[1:-1].T).transpose(0, 2, 1) / spacing[0] ** 2
    yy = bends(padded[:, 1:-1]) / spacing[1] ** 2
    w, out = 1.0 + p * p + q * q, []
    for sign in (1.0, -1.0):
        r, t = (sign * xx).max(0), (sign * yy).max(0)
        mean = 0.5 * ((1.0 + q * q) * r - 2.0 * sign * p * q * s + (1.0 + p * p) * t) / w**1.5
        most = mean + np.sqrt(np.maximum(mean**2 - (r * t - s * s) / w**2, 0.0))
        out.append(max(float(most.max()), 0.0))
    return out


def weights(t):
    """Return Keys' weights of four neighbours at a share t between the middle two, and their first two derivatives."""
    value = ((1.0 - 0.5 * t) * t - 0.5) * t, (1.5 * t - 2.5) * t * t + 1.0, ((2.0 - 1.5 * t) * t + 0.5) * t
    slope = (2.0 - 1.5 * t) * t - 0.5, (4.5 * t - 5.0) * t, (4.0 - 4.5 * t) * t + 0.5, (1.5 * t - 1.0) * t
    bend = 2.0 - 3.0 * t, 9.0 * t - 5.0, 4.0 - 9.0 * t, 3.0 * t - 1.0
    return (value[0], value[1], value[2], 0.5 * (t - 1.0) * t * t), slope, bend


def cell(x, half, count):
    """Return the index of the grid point before a coordinate, the share of the cell past it, grid points a metre."""
    density = 0.5 * (count - 1) / half
    u = (x + half) * density
    i = min(max(int(u), 0), count - 2)
    return i, u - i, density


def surface(s, x, y):
    """Return the height [m] in the field's frame, slopes along x and y, and second derivatives xx, xy, yy [1/m]."""
    points, columns = doubles_at(s.points), field_at(s.points, 0).columns
    i, t, density_x = cell(x, s.half[0], columns)
    j, u, density_y = cell(y, s.half[1], field_at(s.points, 0).rows)
    (value, slope, bend), (value_y, slope_y, bend_y) = weights(t), weights(u)
    h, h_x, h_y, h_xx, h_xy, h_yy = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for n in range(4):
        at = HEAD + (j + n) * (columns + 2) + i
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


def normal(slopes):
    """Return the upward unit normal of the surface."""
    return scale(1.0 / sqrt(1.0 + slopes[0] * slopes[0] + slopes[1] * slopes[1]), (-slopes[0], -slopes[1], 1.0))


def curvatures(slopes, bends, n):
    """Return the curvatures [1/m] of a surface, positive on ridges, as `curvature.principal` takes them."""
    t, share = tangent(n), -1.0 / sqrt(1.0 + slopes[0] * slopes[0] + slopes[1] * slopes[1])
    f = cross(n, t)
    xx, xy, yy = scale(share, bends)
    tt = t[0] * (xx * t[0] + 2.0 * xy * t[1]) + t[1] * yy * t[1]
    ff = f[0] * (xx * f[0] + 2.0 * xy * f[1]) + f[1] * yy * f[1]
    return tt, t[0] * (xx * f[0] + xy * f[1]) + t[1] * (xy * f[0] + yy * f[1]), ff, t, f


def start(s, c):
    """Return x, y to start Newton's method from: straight below the point c, or the nearest grid point if nearer.

    Only grid points within the distance straight down can be nearer.
    """
    x, y = clip(c[0], s.half[0]), clip(c[1], s.half[1])
    h, _, _ = surface(s, x, y)
    best = (x - c[0]) ** 2 + (y - c[1]) ** 2 + (h - c[2]) ** 2
    points, far = doubles_at(s.points), sqrt(best)
    columns, rows = field_at(s.points, 0).columns, field_at(s.points, 0).rows
    first, _, density_x = cell(max(c[0] - far, -s.half[0]), s.half[0], columns)
    last, _, _ = cell(min(c[0] + far, s.half[0]), s.half[0], columns)
    low, _, density_y = cell(max(c[1] - far, -s.half[1]), s.half[1], rows)
    high, _, _ = cell(min(c[1] + far, s.half[1]), s.half[1], rows)
    for j in range(low, high + 2, 1 + (high - low) // SAMPLES):
        for i in range(first, last + 2, 1 + (last - first) // SAMPLES):
            u, v = i / density_x - s.half[0], j / density_y - s.half[1]
            h = points[HEAD + (j + 1) * (columns + 2) + i + 1]
            square = (u - c[0]) ** 2 + (v - c[1]) ** 2 + (h - c[2]) ** 2
            if square < best:
                best, x, y = square, u, v
    return x, y


def descend(s, c, place):
    """Return the coordinates x, y of a local minimum of the distance from a point c, found from a place x, y.

    Newton's method on distance^2/2 within the border, with backtracking. Where the second derivatives make it concave
    they are left out (Gauss-Newton), which always descends.
    """
    x, y = clip(place[0], s.half[0]), clip(place[1], s.half[1])
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
            x, y = clip(from_x + share * step[0], s.half[0]), clip(from_y + share * step[1], s.half[1])
            h, slopes, bends = surface(s, x, y)
            p, q, d = x - c[0], y - c[1], h - c[2]
            if p * p + q * q + d * d <= square * (1.0 + CONVERGED):  # near the minimum rounding may add to it
                break
            share *= 0.5
    return x, y


def is_outside(s, c):
    """Return whether a point is beyond the border of the field, or below its base."""
    return max(abs(c[0]) - s.half[0], abs(c[1]) - s.half[1], -s.half[2] - c[2]) > 0.0


def distance(s, c, x, y):
    """Return the signed distance [m] of a point c from its foot x, y, and the normal there, in the field's frame.

    The field is the top of a block with walls at its border. Outside of these, and of the block's bottom, the distance
    is positive, and the normal points from the nearest point of the block to c.
    """
    h, slopes, _ = surface(s, x, y)
    if is_outside(s, c):
        u, v = clip(c[0], s.half[0]), clip(c[1], s.half[1])
        border, _, _ = surface(s, u, v)
        away = sub(c, (u, v, max(c[2], -s.half[2])) if c[2] < border else (x, y, h))
        far = norm(away)
        return far, scale(1.0 / far, away)
    n = normal(slopes)
    far = dot(sub(c, (x, y, h)), n)
    deep_x, deep_y, deep_z = s.half[0] - abs(c[0]), s.half[1] - abs(c[1]), s.half[2] + c[2]
    if -far <= min(deep_x, deep_y, deep_z):
        return far, n
    if deep_z <= min(deep_x, deep_y):
        return -deep_z, (0.0, 0.0, -1.0)
    if deep_x < deep_y:
        return -deep_x, (copysign(1.0, c[0]), 0.0, 0.0)
    return -deep_y, (0.0, copysign(1.0, c[1]), 0.0)


jit_module(__name__)
