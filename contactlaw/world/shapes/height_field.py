"""Contact of round shapes with a height field.

A ball touches at the point of the surface nearest to its centre, found by Newton's method from the nearest grid point.
A ball wider than a valley touches both flanks: each contact is a local minimum of the distance from its centre. The
side of a capsule or a cylinder, or an edge, of half axis u and radius r(s), lies on ridges at the minima over s of

    D(c + s u) - r(s)               slope n.u - r'               growth u.B (1 + D B)^-1 u - r''

with B the curvature of the surface at the foot of c + s u, positive on ridges (the Hessian of a distance). As an edge
on a core (`core.set_back`) it is set back, so that ends and corners carry where they can. A rim or an ellipsoid touches
at the point x, y whose tangent plane has the deepest point of the shape straight above. With L the greatest slope, a
point at a height H over the surface is at least H/sqrt(1 + L^2) away from it.

A field is PLACES shapes of one surface: each keeps the contact of one minimum of the distance, which it follows
(`geometry.meet_place`). Three contacts fix a ball. On fields too smooth for several only the first of them is used, see
`geometry.places_of`.
"""

from math import ceil, floor

from contactlaw.jit import jit_module
from contactlaw.world.data.access import field_at
from contactlaw.world.data.kinds import DISC, ELLIPSOID, SEGMENT
from contactlaw.world.data.records import NEVER
from contactlaw.world.data.vec import ZERO, add, axpy, dot, load, norm, scale, sub, to_world
from contactlaw.world.shapes import field_surface
from contactlaw.world.shapes.core import clip, local, next_place, set_back
from contactlaw.world.shapes.disc import line_of, lowest_over_plane
from contactlaw.world.shapes.ellipsoid import facing
from contactlaw.world.shapes.field_surface import curvatures, descend, distance, is_outside, normal, start, surface
from contactlaw.world.shapes.geometry import FOLLOW, LOST, NEAREST, bounding_radius, centre

ALIGNED = 1e-12  # of a line's half length or a shape's size, to which a place is found
SAMPLES_A_CELL = 2.0  # places along a line among which its minima are sought; SAMPLES of them at most
FINE = 2.5  # places a radius away from a ball's centre, at least, among which minima are sought
STRAIGHT = 1e-9  # of a distance, by which the height over the tangent plane at its foot may be less
APART = 0.05  # [rad] between normals, or of a line's half length, from which two minima are different ones
WITHIN = 1.5  # of a ball's radius, or the least distance found so far, up to which places are of interest
WIDE = 0.2  # [rad] by which the normal of a followed contact may turn at once
CUTS = 20  # halvings of a step of `touching_ball`, at most
DIFFERENCE = 1e-7  # step of its finite differences, over the shape's size
UNSEEN = 0.01  # of the radius, by which bodies may move before they are searched anew for a place that there was not


def offset(x, y, c, pair):
    """Return the offset [m] along x and y from the point x, y of the field to a shape's deepest point over its plane.

    c: the shape's centre in the field's frame [m]. pair: both shapes and bodies. Returns the deepest ball as well: its
    centre from the shape's in the world, its radius, and its centre in the field's frame [m].
    """
    _, _, sb, _ = pair
    h, slopes, _ = surface(sb, x, y)
    way, radius, p = deepest_ball(normal(slopes), c, pair)
    d = p[2] - h
    return (p[0] - x + d * slopes[0], p[1] - y + d * slopes[1]), way, radius, p


def deepest_ball(n, c, pair):
    """Return the deepest ball of a rim or an ellipsoid over a plane of normal n, as `offset` does."""
    sa, a, sb, b = pair
    n, radius = to_world(b.axes, to_world(sb.axes, n)), 0.0
    if sa.kind == DISC:
        way, radius = lowest_over_plane(sa, a, n)
    else:
        way = sub(facing(sa, a, scale(-1.0, n)), centre(sa, a))
    return way, radius, add(c, local(way, sb, b))


def deepest_start(c, pair, length):
    """Return x, y where the shape is about nearest to the field, of its deepest points over planes at a net of places.

    length: of the shape from its centre c [m].
    """
    _, _, sb, _ = pair
    field, best, x, y = field_at(sb.points, 0), NEVER, 0.0, 0.0
    first_x, dx, columns = net(c[0], length, sb.half[0], field.columns)
    first_y, dy, rows = net(c[1], length, sb.half[1], field.rows)
    for k in range(columns * rows):
        u, v = first_x + dx * (k % columns), first_y + dy * (k // columns)
        _, _, radius, p = offset(clip(u, sb.half[0]), clip(v, sb.half[1]), c, pair)
        u, v = clip(p[0], sb.half[0]), clip(p[1], sb.half[1])
        h, slopes, _ = surface(sb, u, v)
        far = (p[2] - h) * normal(slopes)[2] - radius
        if far < best:
            best, x, y = far, u, v
    return x, y


def touching_ball(c, pair):
    """Return the ball by which a rim or an ellipsoid touches the field, as `offset` does.

    Newton's method on the offset, from the point nearest to the shape's centre c, or in narrow valleys to its deepest
    points. With finite differences: the derivative of a rim's deepest point is discontinuous.
    """
    sa, _, sb, _ = pair
    length = bounding_radius(sa)
    valleys = field_at(sb.points, 0).valley * length > 1.0  # narrower than the shape, in which it has several places
    x, y = deepest_start(c, pair, length) if valleys else descend(sb, c, start(sb, c))
    off, way, radius, p = offset(x, y, c, pair)
    for _ in range(field_surface.NEWTON):
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
            x, y = clip(from_x + share * step[0], sb.half[0]), clip(from_y + share * step[1], sb.half[1])
            off, way, radius, p = offset(x, y, c, pair)
            if off[0] * off[0] + off[1] * off[1] < square:
                break
            share *= 0.5
    return way, radius, p


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
    h, slopes, _ = surface(sb, clip(c[0], sb.half[0]), clip(c[1], sb.half[1]))
    far, n, radius = (c[2] - h) * field_at(sb.points, 0).away, normal(slopes), bounding_radius(sa)
    if far <= radius:
        if sa.kind == DISC or sa.kind == ELLIPSOID:
            if c[2] < h and is_outside(sb, c):
                _, beside = distance(sb, c, 0.0, 0.0)
                way, radius, c = deepest_ball(beside, c, (sa, a, sb, b))
            else:
                way, radius, c = touching_ball(c, (sa, a, sb, b))
            from_a = add(from_a, way)
            x, y = descend(sb, c, start(sb, c))
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


def is_new(at, n, others):
    """Return whether a place along a line and its normal are those of none of others: how many, places, normals."""
    held, places, normals = others
    out = True
    for i in range(held):
        out = out and max(abs(at - places[i]), norm(sub(n, normals[i]))) > APART
    return out


def is_nearest(s, c, x, y, far):
    """Return whether a point c, at a height [m] over the tangent plane at x, y, is straight above x, y.

    It is not where an iteration has not converged, nor where x, y is on the far side of a ridge, seen from within.
    """
    h, _, _ = surface(s, x, y)
    return is_outside(s, c) or far >= (1.0 - STRAIGHT) * norm((c[0] - x, c[1] - y, c[2] - h))


def net(x, radius, half, count):
    """Return first coordinate, width [m] and number of places around x among which minima are sought.

    They include grid points and the middles between these, or some if there are too many; count: of grid points.
    """
    density = (count - 1.0) / half
    density *= max(ceil(FINE / (density * radius)), 1.0)
    width = (1.0 + floor(2.0 * radius * density / field_surface.SAMPLES)) / density
    first = floor((x - radius + half) * density) / density - half
    return first, width, int((x + radius - first) / width) + 2


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


def other_foot(s, c, radius, others):
    """Return the foot x, y of a ball in a given place, and whether there is one; others: see `meet_beside`."""
    held, _, normals = others
    if held == FOLLOW:
        was = axpy(-radius, normals[0], c)
        x, y = descend(s, c, (was[0], was[1]))
        far, n = distance(s, c, x, y)
        return x, y, is_nearest(s, c, x, y, far) and norm(sub(n, normals[0])) <= WIDE
    x, y = descend(s, c, start(s, c))
    if held == NEAREST:
        return x, y, True
    far, n = distance(s, c, x, y)
    found = is_new(0.0, n, others)
    field, best = field_at(s.points, 0), far if found and is_nearest(s, c, x, y, far) else NEVER
    p, dx, columns = net(c[0], radius, s.half[0], field.columns)
    q, dy, rows = net(c[1], radius, s.half[1], field.rows)
    for k in range(columns * rows):
        u, v = p + dx * (k % columns), q + dy * (k // columns)
        near = 2.0 * max(dx, dy), WITHIN * min(best, radius)
        if abs(u) > s.half[0] or abs(v) > s.half[1] or not minimum_within(s, c, u, v, near):
            continue
        u, v = descend(s, c, (u, v))
        far, n = distance(s, c, u, v)
        if far < best and is_nearest(s, c, u, v, far) and is_new(0.0, n, others):
            best, x, y, found = far, u, v, True
    return x, y, found


def growth(s, x, y, far, n, u):
    """Return the second derivative of the distance along u, of a point at a distance `far` [m] from its foot x, y."""
    _, slopes, bends = surface(s, x, y)
    tt, tf, ff, t, f = curvatures(slopes, bends, n)
    p, q, det = dot(u, t), dot(u, f), tt * ff - tf * tf
    grows = p * p * tt + 2.0 * p * q * tf + q * q * ff + far * det * (p * p + q * q)
    return grows / (1.0 + far * (tt + ff) + far * far * det)


def place_of(arm, from_a, axis):
    """Return the place along a half axis of the point at an arm from A's centre of mass [m]; 0 of a ball."""
    return clip(dot(sub(arm, from_a), axis) / max(dot(axis, axis), 1e-300))


def lowest_on_line(s, sa, line, at, wide, foot):
    """Find a minimum of D + c along a line near a place: Newton's method, guarded by bisection.

    line: middle and half axis in the field's frame [m]. wide: places on both sides between which it must be. foot: x, y
    to start from. Returns the place, D, the normal, and whether it is a minimum.
    """
    c, u = line
    ends, first = (at - wide, at + wide), at
    far, n, (x, y) = 0.0, ZERO, foot
    for _ in range(field_surface.NEWTON):
        p = axpy(at, u, c)
        x, y = descend(s, p, (x, y))
        far, n = distance(s, p, x, y)
        _, falls, bends = set_back(sa, u, at)
        new, ends = next_place(at, dot(n, u) + falls, growth(s, x, y, far, n, u) + bends, ends)
        if abs(new - at) <= ALIGNED:
            break
        at = new
    return at, far, n, abs(at) == 1.0 or abs(at - first) < 0.99 * wide


def other_place(s, sa, line, radius, others):
    """Return the place of a line on the field, D, the normal, and whether there is one; others: see `meet_beside`."""
    (c, u), (held, places, normals) = line, others
    field = field_at(s.points, 0)
    density = 0.5 * max((field.columns - 1) / s.half[0], (field.rows - 1) / s.half[1])
    count = min(int(2.0 * SAMPLES_A_CELL * density * norm(u)) + 2, field_surface.SAMPLES)
    wide, place, found = 3.0 / count, places[0], False
    if held == FOLLOW:
        p = axpy(-radius, normals[0], axpy(place, u, c))
        return lowest_on_line(s, sa, line, place, wide, (p[0], p[1]))
    best, far, n, last, before = NEVER, 0.0, (0.0, 0.0, 1.0), NEVER, NEVER
    for i in range(count + 2):
        at, value = 2.0 * i / count - 1.0, NEVER
        if i <= count:
            p = axpy(at, u, c)
            h, slopes, _ = surface(s, clip(p[0], s.half[0]), clip(p[1], s.half[1]))
            value = (p[2] - h) * normal(slopes)[2] + set_back(sa, u, at)[0]
        if last <= value and last < before:
            p = axpy(at - 2.0 / count, u, c)
            at, d, m, minimum = lowest_on_line(s, sa, line, at - 2.0 / count, wide, start(s, p))
            less = d + set_back(sa, u, at)[0]
            if (minimum or held <= 0) and less < best and is_new(at, m, others):
                best, place, far, n, found = less, at, d, m, True
        last, before = value, last
    return place, far, n, found


jit_module(__name__)
