"""Height fields: a smooth surface z = h(x, y) through heights on a grid, and its contact with round shapes.

Between the grid points h is the cubic convolution of Keys (IEEE Trans. ASSP 29 (1981), a = -1/2): it passes through the
heights, reproduces quadratic surfaces, and has a continuous slope, so the normal under a rolling ball is continuous.
(The flat triangles that engines use have a kink at each edge, at which a ball touches twice.)

A ball touches at the point of the surface nearest to its centre, found by Newton's method from the nearest grid point.
A rim or an ellipsoid touches at the point x, y whose tangent plane has the deepest point of the shape straight above.
With L the greatest slope, a point at a height H over the surface is at least H/sqrt(1 + L^2) away from it.

A ball wider than a valley touches both flanks: each contact is a local minimum of the distance from its centre. The
side of a capsule or a cylinder, or an edge, of half axis u and radius r(s), lies on ridges at the minima over s of

    D(c + s u) - r(s)               slope n.u - r'               growth u.B (1 + D B)^-1 u - r''

with B the curvature of the surface at the foot of c + s u, positive on ridges (the Hessian of a distance). As an edge
on a core (`core.set_back`) it is set back, so that ends and corners carry where they can. So a field is PLACES shapes
of one surface: each keeps the contact of one minimum, which it follows (`contacts.meeting.meet_place`). Three contacts
fix a ball. On fields too smooth for this only the first of them is used, see `pairing.places_of`.
"""

from functools import lru_cache
from math import ceil, floor, sqrt

import numpy as np

from contactlaw.jit import address_of, jit_inside
from contactlaw.memory import doubles_at
from contactlaw.world.data.call import ask_beside, ask_deepest, ask_meeting, ask_radius
from contactlaw.world.data.kinds import DISC, ELLIPSOID, SEGMENT, SIDE
from contactlaw.world.data.records import NEVER, Array
from contactlaw.world.data.vec import ZERO, add, axpy, cross, dot, load, norm, scale, sub, tangent, to_world
from contactlaw.world.shapes.core import CROWN, local, set_back
from contactlaw.world.shapes.curvature import feature, principal, radius_between, rim
from contactlaw.world.shapes.disc import dimensions, lowest_over_plane
from contactlaw.world.shapes.ellipsoid import curved, facing
from contactlaw.world.shapes.geometry import FOLLOW, LOST, centre
from contactlaw.world.shapes.segments import clip

NEWTON, CUTS = 40, 20  # iterations of Newton's method, and halvings of one step, at most
CONVERGED = 1e-13  # gradient of distance^2/2 over the distance, at a minimum
ALIGNED = 1e-12  # offset between a shape's deepest point and its plane's point of contact, over the shape's size
DIFFERENCE = 1e-7  # step of finite differences, over the shape's size
SAMPLES = 16  # grid points each way, at most, among which the start of Newton's method is chosen
OVERSHOOT = 1.25  # sum of the magnitudes of Keys' weights, at most (half way between two grid points)
HEAD = 6  # numbers before the heights in a table
NEAREST = -2  # of `meet_beside`, instead of a number of places: one only is sought
NO_PLACES = ZERO, ZERO, ZERO
SAMPLES_A_CELL = 2.0  # places along a line among which its minima are sought; SAMPLES of them at most
FINE = 2.5  # places a radius away from a ball's centre, at least, among which minima are sought
STRAIGHT = 1e-9  # of a distance, by which the height over the tangent plane at its foot may be less
APART = 0.05  # [rad] between normals, or of a line's half length, from which two minima are different ones
WITHIN = 1.5  # of a ball's radius, or the least distance found so far, up to which places are of interest
WIDE = 0.2  # [rad] by which the normal of a followed contact may turn at once
UNSEEN = 0.05  # of the radius, by which bodies may move before they are searched anew for a place that there was not


def table(heights: Array, half: Array) -> tuple[Array, float]:
    """Return heights in the layout of compiled code, shape (n, 3), and an upper bound on the surface [m].

    heights: [m], shape (rows along y, columns along x). half: half lengths along x and y [m]. The first two rows hold
    the numbers of columns and rows, 1/sqrt(1 + L^2), and `sharpest`. The others hold the heights relative to the bound,
    with one more grid point on each side, extrapolated linearly.
    """
    spacing = 2.0 * half / (np.array(heights.shape[::-1]) - 1)
    # negative weights add up to (S - 1)/2 where all magnitudes add up to S
    top = float(heights.max() + 0.5 * (OVERSHOOT**2 - 1.0) * np.ptp(heights))
    padded = np.pad(heights, 1, mode="reflect", reflect_type="odd") - top
    # a cubic's slope is at most twice the greatest difference of neighbours over their spacing
    slopes = [2.0 * OVERSHOOT * float(np.abs(np.diff(padded, axis=1 - i)).max()) / spacing[i] for i in range(2)]
    head = [float(heights.shape[1]), float(heights.shape[0]), 1.0 / sqrt(1.0 + slopes[0] ** 2 + slopes[1] ** 2)]
    numbers = np.concatenate([head, sharpest(padded, spacing), [0.0], padded.ravel()])
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
            h = points[HEAD + (j + 1) * (columns + 2) + i + 1]
            square = (u - c[0]) ** 2 + (v - c[1]) ** 2 + (h - c[2]) ** 2
            if square < best:
                best, x, y = square, u, v
    return x, y


@jit_inside
def nearest(s, c):
    """Return the coordinates x, y of the point of the surface nearest to a point c, all in the field's frame [m]."""
    x, y = start(s, c)
    return descend(s, c, x, y)


@jit_inside
def descend(s, c, x, y):
    """Return the coordinates x, y of a local minimum of the distance from a point c, found from given ones.

    Newton's method on distance^2/2 within the border, with backtracking. Where the second derivatives make it concave
    they are left out (Gauss-Newton), which always descends.
    """
    x, y = within(x, s.half[0]), within(y, s.half[1])
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
def distance(s, c, x, y):
    """Return the signed distance [m] of a point c from its foot x, y, and the normal there, in the field's frame.

    Beyond the border the distance is positive and the normal points to c.
    """
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
    if s.kind == ELLIPSOID:
        return max(s.half[0], s.half[1], s.half[2])
    return s.radius + (norm(load(s.half)) if s.kind >= SEGMENT else 0.0)


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
    p = add(c, local(way, sb, b))
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


@jit_inside
def is_new(at, n, others):
    """Return whether a place along a line and its normal are those of none of others: how many, places, normals."""
    held, places, normals = others
    out = True
    for i in range(held):
        out = out and max(abs(at - places[i]), norm(sub(n, normals[i]))) > APART
    return out


@jit_inside
def is_nearest(s, c, x, y, far):
    """Return whether a point c, at a height [m] over the tangent plane at x, y, is straight above x, y.

    It is not where an iteration has not converged, nor where x, y is on the far side of a ridge, seen from within.
    """
    h, _, _ = surface(s, x, y)
    return far >= (1.0 - STRAIGHT) * norm((c[0] - x, c[1] - y, c[2] - h))


@jit_inside
def net(x, radius, half, count):
    """Return first coordinate, width [m] and number of places around x among which minima are sought.

    They include grid points and the middles between these, or some if there are too many; count: of grid points.
    """
    density = (count - 1.0) / half
    density *= max(ceil(FINE / (density * radius)), 1.0)
    width = (1.0 + floor(2.0 * radius * density / SAMPLES)) / density
    first = floor((x - radius + half) * density) / density - half
    return first, width, int((x + radius - first) / width) + 2


@jit_inside
def minimum_within(s, c, x, y, near):
    """Return whether a step of Newton's method from x, y leads near a minimum of the distance, not above a given one.

    near: greatest step [m], greatest distance [m].
    """
    width, most = near
    h, slopes, bends = surface(s, x, y)
    d = h - c[2]
    g, k = (x - c[0] + d * slopes[0], y - c[1] + d * slopes[1]), scale(d, bends)
    xx, yy, xy = 1.0 + slopes[0] ** 2 + k[0], 1.0 + slopes[1] ** 2 + k[2], slopes[0] * slopes[1] + k[1]
    determinant = xx * yy - xy * xy
    step = yy * g[0] - xy * g[1], xx * g[1] - xy * g[0]
    if xx <= 0.0 or determinant <= 0.0 or max(abs(step[0]), abs(step[1])) > width * determinant:
        return False
    square = (x - c[0]) ** 2 + (y - c[1]) ** 2 + d * d
    return square - (g[0] * step[0] + g[1] * step[1]) / determinant <= most * most


@jit_inside
def other_foot(s, c, radius, others):
    """Return the foot x, y of a ball in a given place, and whether there is one; others: see `meet_beside`."""
    held, _, normals = others
    if held == FOLLOW:
        was = axpy(-radius, normals[0], c)
        x, y = descend(s, c, was[0], was[1])
        far, n = distance(s, c, x, y)
        return x, y, is_nearest(s, c, x, y, far) and norm(sub(n, normals[0])) <= WIDE
    x, y = nearest(s, c)
    if held == NEAREST:
        return x, y, True
    far, n = distance(s, c, x, y)
    found = is_new(0.0, n, others)
    points, best = doubles_at(s.points), far if found and is_nearest(s, c, x, y, far) else NEVER
    (p, dx, columns), (q, dy, rows) = net(c[0], radius, s.half[0], points[0]), net(c[1], radius, s.half[1], points[1])
    for k in range(columns * rows):
        u, v = p + dx * (k % columns), q + dy * (k // columns)
        near = 2.0 * max(dx, dy), WITHIN * min(best, radius)
        if abs(u) > s.half[0] or abs(v) > s.half[1] or not minimum_within(s, c, u, v, near):
            continue
        u, v = descend(s, c, u, v)
        far, n = distance(s, c, u, v)
        if far < best and is_nearest(s, c, u, v, far) and is_new(0.0, n, others):
            best, x, y, found = far, u, v, True
    return x, y, found


@jit_inside
def line_of(s, b):
    """Return the half axis of a side or an edge, world frame, and its radius [m]."""
    if s.kind != SIDE:
        return to_world(b.axes, load(s.half)), s.radius
    out, _, along = dimensions(s)
    return to_world(b.axes, scale(along, load(s.normal))), out + s.radius * (1.0 - 2.0 * CROWN)


@jit_inside
def curvatures(slopes, bends, n):
    """Return the curvatures [1/m] of a surface, positive on ridges, as `curvature.principal` takes them."""
    t, share = tangent(n), -1.0 / sqrt(1.0 + slopes[0] * slopes[0] + slopes[1] * slopes[1])
    f = cross(n, t)
    xx, xy, yy = scale(share, bends)
    tt = t[0] * (xx * t[0] + 2.0 * xy * t[1]) + t[1] * yy * t[1]
    ff = f[0] * (xx * f[0] + 2.0 * xy * f[1]) + f[1] * yy * f[1]
    return tt, t[0] * (xx * f[0] + xy * f[1]) + t[1] * (xy * f[0] + yy * f[1]), ff, t, f


@jit_inside
def growth(s, x, y, far, n, u):
    """Return the second derivative of the distance along u, of a point at a distance `far` [m] from its foot x, y."""
    _, slopes, bends = surface(s, x, y)
    tt, tf, ff, t, f = curvatures(slopes, bends, n)
    p, q, det = dot(u, t), dot(u, f), tt * ff - tf * tf
    grows = p * p * tt + 2.0 * p * q * tf + q * q * ff + far * det * (p * p + q * q)
    return grows / (1.0 + far * (tt + ff) + far * far * det)


@jit_inside
def place_of(arm, from_a, axis):
    """Return the place along a half axis of the point at an arm from A's centre of mass [m]; 0 of a ball."""
    return clip(dot(sub(arm, from_a), axis) / max(dot(axis, axis), 1e-300))


@jit_inside
def lowest_on_line(s, sa, line, at, wide, foot):
    """Find a minimum of D + c along a line near a place: Newton's method, guarded by bisection.

    line: middle and half axis in the field's frame [m]. wide: places on both sides between which it must be. foot: x, y
    to start from. Returns the place, D, the normal, and whether it is a minimum.
    """
    c, u = line
    low, high, first = at - wide, at + wide, at
    far, n, (x, y) = 0.0, ZERO, foot
    for _ in range(NEWTON):
        p = axpy(at, u, c)
        x, y = descend(s, p, x, y)
        far, n = distance(s, p, x, y)
        _, falls, bends = set_back(sa, u, at)
        value, grows = dot(n, u) + falls, growth(s, x, y, far, n, u) + bends
        if value > 0.0:
            high = at
        else:
            low = at
        new = clip(at - value / grows) if grows > 0.0 else high
        if not low < new < high:
            new = clip(0.5 * (low + high))
        if abs(new - at) <= ALIGNED:
            break
        at = new
    return at, far, n, abs(at) == 1.0 or abs(at - first) < 0.99 * wide


@jit_inside
def other_place(s, sa, line, radius, others):
    """Return the place of a line on the field, D, the normal, and whether there is one; others: see `meet_beside`."""
    (c, u), (held, places, normals) = line, others
    points = doubles_at(s.points)
    density = 0.5 * max((points[0] - 1.0) / s.half[0], (points[1] - 1.0) / s.half[1])
    count = min(int(2.0 * SAMPLES_A_CELL * density * norm(u)) + 2, SAMPLES)
    wide, place, found = 3.0 / count, places[0], False
    if held == FOLLOW:
        p = axpy(-radius, normals[0], axpy(place, u, c))
        return lowest_on_line(s, sa, line, place, wide, (p[0], p[1]))
    best, far, n, last, before = NEVER, 0.0, (0.0, 0.0, 1.0), NEVER, NEVER
    for i in range(count + 2):
        at, value = 2.0 * i / count - 1.0, NEVER
        if i <= count:
            p = axpy(at, u, c)
            h, slopes, _ = surface(s, within(p[0], s.half[0]), within(p[1], s.half[1]))
            value = (p[2] - h) * normal(slopes)[2] + set_back(sa, u, at)[0]
        if last <= value and last < before:
            p = axpy(at - 2.0 / count, u, c)
            at, d, m, minimum = lowest_on_line(s, sa, line, at - 2.0 / count, wide, start(s, p))
            less = d + set_back(sa, u, at)[0]
            if (minimum or held <= 0) and less < best and is_new(at, m, others):
                best, place, far, n, found = less, at, d, m, True
        last, before = value, last
    return place, far, n, found


def meet_beside(sa, a, sb, b, held, arms, normals):
    """`geometry.meet` of a shape and a height field, in a place apart from those of contacts that there are.

    held: how many these are; with their arms on A [m], and normals. With FOLLOW it is the place of the first one, as it
    is now; with NEAREST the nearest place, as far as one attempt finds it. Where the shapes are clearly apart, and
    where there is no such place, the gap is a lower bound.
    """
    from_a = centre(sa, a)
    between = sub(load(a.position), load(b.position))
    to_a = sub(between, centre(sb, b))
    c = local(add(to_a, from_a), sb, b)
    h, slopes, _ = surface(sb, within(c[0], sb.half[0]), within(c[1], sb.half[1]))
    far, n, radius = (c[2] - h) * doubles_at(sb.points)[2], normal(slopes), size(sa)
    if far <= radius:
        if sa.kind == DISC or sa.kind == ELLIPSOID:
            way, radius, c = touching_ball(c, (sa, a, sb, b))
            from_a = add(from_a, way)
            x, y = nearest(sb, c)
            far, n = distance(sb, c, x, y)
        else:
            axis, radius = line_of(sa, a)
            places = place_of(arms[0], from_a, axis), place_of(arms[1], from_a, axis), place_of(arms[2], from_a, axis)
            others = held, places, (local(normals[0], sb, b), local(normals[1], sb, b), local(normals[2], sb, b))
            if sa.kind < SEGMENT:
                x, y, found = other_foot(sb, c, radius, others)
                far, n = distance(sb, c, x, y)
            else:
                place, far, n, found = other_place(sb, sa, (c, local(axis, sb, b)), radius, others)
                radius -= set_back(sa, axis, place)[0]
                from_a = axpy(place, axis, from_a)
            if not found:
                far = radius * (1.0 + (LOST if held == FOLLOW else UNSEEN))
    n = to_world(b.axes, to_world(sb.axes, n))
    arm = axpy(-radius, n, from_a)
    return radius - far, n, arm, add(arm, between)


def meet(sa, a, sb, b):
    """`geometry.meet` of a round shape and a height field; where they are clearly apart, a lower bound on the gap."""
    return ask_beside(sb.nearest, sa, a, sb, b, NEAREST, NO_PLACES, NO_PLACES)


def radius(sa, a, sb, b):
    """`geometry.effective_radius` of a ball, a rim or an ellipsoid and a field, which counts as flat."""
    if sa.kind == DISC:
        return rim(sa, a)
    if sa.kind != ELLIPSOID:
        return sa.radius, ZERO
    _, n, _, _ = ask_meeting(sb.meet, sa, a, sb, b)
    return radius_between(curved(sa, a, n), feature(0.0, 3, ZERO))


def ridge(sa, a, sb, b, arm):
    """Return `radius` of a side or an edge on a ridge, with both results interchanged; arm: of the contact on A [m]."""
    axis, radius = line_of(sa, a)
    to = sub(add(sub(load(a.position), load(b.position)), arm), centre(sb, b))
    foot = local(to, sb, b)
    _, slopes, bends = surface(sb, within(foot[0], sb.half[0]), within(foot[1], sb.half[1]))
    least, most, e = principal(*curvatures(slopes, bends, normal(slopes)))
    square = dot(axis, axis)
    one = 2.0 * CROWN * sa.radius / square, 1.0 / radius, scale(1.0 / sqrt(square), axis)
    size, along = radius_between(one, (least, most, to_world(b.axes, to_world(sb.axes, e))))
    return along, size


@lru_cache
def addresses() -> dict[str, int]:
    """Return the addresses of these functions, compiled when a scene has a height field."""
    own = {"meet": address_of(meet, ask_meeting), "curve": address_of(radius, ask_radius)}
    return own | {"nearest": address_of(meet_beside, ask_beside), "deepest": address_of(ridge, ask_deepest)}
