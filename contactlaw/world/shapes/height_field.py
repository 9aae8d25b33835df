"""Contact of round shapes with a height field.

A ball touches at the point of the surface nearest to its centre, found by Newton's method from the nearest grid point.
A rim or an ellipsoid touches at the point x, y whose tangent plane has the deepest point of the shape straight above.
With L the greatest slope, a point at a height H over the surface is at least H/sqrt(1 + L^2) away from it.

A field is PLACES shapes of one surface: each keeps the contact of one minimum of the distance (`field_places`), which
it follows (`geometry.meet_place`). Three contacts fix a ball. On fields too smooth for several only the first
of them is used, see `places.places_of`.
"""

from contactlaw.jit import jit
from contactlaw.world.data.access import field_at
from contactlaw.world.data.call import ask_beside
from contactlaw.world.data.kinds import DISC, ELLIPSOID, SEGMENT
from contactlaw.world.data.vec import ZERO, add, axpy, load, norm, scale, sub, to_world
from contactlaw.world.shapes.core import local, set_back
from contactlaw.world.shapes.disc import lowest_over_plane
from contactlaw.world.shapes.ellipsoid import facing
from contactlaw.world.shapes.field_places import NEAREST, line_of, other_foot, other_place, place_of
from contactlaw.world.shapes.field_surface import CUTS, NEWTON, distance, nearest, normal, surface, within
from contactlaw.world.shapes.geometry import FOLLOW, LOST, centre

ALIGNED = 1e-12  # offset between a shape's deepest point and its plane's point of contact, over the shape's size
DIFFERENCE = 1e-7  # step of finite differences, over the shape's size
NO_PLACES = ZERO, ZERO, ZERO
UNSEEN = 0.05  # of the radius, by which bodies may move before they are searched anew for a place that there was not


@jit
def size(s):
    """Return the radius [m] of the sphere around a shape."""
    if s.kind == ELLIPSOID:
        return max(s.half[0], s.half[1], s.half[2])
    return s.radius + (norm(load(s.half)) if s.kind >= SEGMENT else 0.0)


@jit
def lowest(s, b, n):
    """Return the centre, from the shape's, and radius [m] of a shape's ball deepest below a plane of normal n."""
    if s.kind == DISC:
        return lowest_over_plane(s, b, n)
    return sub(facing(s, b, scale(-1.0, n)), centre(s, b)), 0.0


@jit
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


@jit
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
    far, n, radius = (c[2] - h) * field_at(sb.points, 0).away, normal(slopes), size(sa)
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


def meet(sa, a, sb, b, _along):
    """`geometry.meet` of a round shape and a height field; where they are clearly apart, a lower bound on the gap."""
    return ask_beside(sb.beside, sa, a, sb, b, NEAREST, NO_PLACES, NO_PLACES)
