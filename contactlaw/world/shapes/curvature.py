"""Curvatures of all shapes, and the effective radius of a contact: of the ball on a plane with the same force law.

With the relative principal curvatures p <= q [1/m] in two perpendicular directions the contact is an ellipse of half
axes a >= b, k^2 = 1 - (b/a)^2, where (Johnson 1985, section 4.2)

    q/p = [(a/b)^2 E(k) - K(k)]/(K(k) - E(k))        a^3 = 3 P D/(pi E* p)        delta = 3 P K(k)/(2 pi E* a)

and D = (K - E)/k^2. Hence P = 4/3 E* sqrt(R) delta^1.5 as for balls, with R = pi^2 D/(2 p K^3). R sqrt(p q) is a
function of ln(q/p) alone, here a fit to 5e-4 for q/p up to 1e5.
"""

from math import atan2, cos, exp, log, log1p, sin, sqrt

from contactlaw.jit import jit_module
from contactlaw.world.data.access import body_at, shape_at
from contactlaw.world.data.call import ask_curve, ask_nearest
from contactlaw.world.data.kinds import BOX, CORNER, DISC, EDGE, ELLIPSOID, HULL, PLANE, SEGMENT, SIDE
from contactlaw.world.data.records import NEVER
from contactlaw.world.data.vec import ZERO, add, axpy, cross, dot, load, norm, scale, sub, tangent, to_world
from contactlaw.world.shapes.core import CROWN, NO_PLACES, clip, local
from contactlaw.world.shapes.disc import line_of
from contactlaw.world.shapes.ellipsoid import shrink, swell
from contactlaw.world.shapes.field_surface import curvatures, normal, surface
from contactlaw.world.shapes.geometry import centre, meet
from contactlaw.world.shapes.swept import CAPSULE_CROWN

SCALE = 0.0312022  # of the fit of ln(R sqrt(p q)) in ln(1 + SCALE ln^2(q/p))
FIT = (1.3265492, 0.13058459, 0.11675849)  # its coefficients
FLATTEST = 1e-5  # ratio of curvatures, at least: the range of the fit
ALIGNED = 1.0 - 1e-9  # cosine of the angle between a normal and an axis of a box from which it counts as a face's
LEVEL = 1e-6  # component of a normal along or across an axis that counts as zero: `ellipsoid` finds it to 1e-8
UNCLEAR = (
    "touching at the edge of a box, or with the side of a capsule on a box: R = {:.3g} m is taken from the ball or "
    "capsule; give the pair its radius"
)


def equivalent_radius(p, q):
    """Return R [m] of two relative principal curvatures p <= q [1/m]."""
    p = max(p, FLATTEST * q)
    ratio = log(q / p)
    x = log1p(SCALE * ratio * ratio)
    return exp(x * (FIT[0] + x * (FIT[1] + x * FIT[2]))) / sqrt(p * q)


def radius_between(one, two):
    """Return R [m] of two bodies, and the longer axis of the ellipse, a vector of length ln(q/p).

    one, two: of each body the least principal curvature [1/m], the greatest, and the unit vector of the direction of
    the least. The curvature tensors add.
    """
    along_a, across_a, e = one
    along_b, across_b, f = two
    cosine, bent = dot(e, f), along_b - across_b
    u = axpy(-cosine, e, f)
    sine = norm(u)
    tt, uu = along_a + across_b + bent * cosine * cosine, across_a + across_b + bent * sine * sine
    p, q, way = principal(tt, bent * cosine * sine, uu, e, scale(1.0 / max(sine, 1e-300), u))
    p = max(p, FLATTEST * q)
    return equivalent_radius(p, q), scale(log(q / p), way)


def principal(tt, tu, uu, t, u):
    """Return the curvatures of a body, see `radius_between`, of which those along two unit vectors t, u are given."""
    mean, differ = 0.5 * (tt + uu), sqrt(0.25 * (tt - uu) ** 2 + tu * tu)
    angle = 0.5 * atan2(2.0 * tu, tt - uu)
    return mean - differ, mean + differ, add(scale(-sin(angle), t), scale(cos(angle), u))


def has_known_radius(sa, sb):
    """Return whether R of two shapes is that of balls, or a ball on a plane, wherever they touch.

    Boxes count as flat for all but rims and ellipsoids.
    """
    flat = sb.curve == 0 or sb.kind >= PLANE
    return sa.kind < DISC and ((sa.curve == 0 and flat) or sb.kind == BOX)


def effective_radius(sa, a, sb, b, n, arm_a, arm_b):
    """Return R [m] where two shapes meet, and the longer axis of the contact ellipse as `radius_between`.

    n, arm_a, arm_b: as of `geometry.meet`, if it has no known radius. Of two cores, and where an edge crosses one of a
    hull, the radii are those of edges, at a right angle.
    """
    if has_known_radius(sa, sb):
        return sa.radius if sb.kind >= BOX else sa.radius * sb.radius / (sa.radius + sb.radius), ZERO
    if sa.kind >= BOX:
        return sqrt(sa.radius * sb.radius), ZERO
    one, two = curvatures_of(sb, b, sa, a, scale(-1.0, n), arm_a), curvatures_of(sa, a, sb, b, n, arm_b)
    if sa.kind == EDGE and sb.kind == HULL and two[1] > 0.0:
        return sqrt(sa.radius * sb.radius), ZERO
    return radius_between(one, two)


def curvatures_of(sa, a, sb, b, n, arm):
    """Return the curvatures of shape B, see `radius_between`, where it touches shape A.

    n: its outward normal there. arm: of the point of contact from its body's centre of mass [m].
    """
    if sb.curve != 0:
        return ask_curve(sb.curve, sa, a, sb, b, n, arm)
    k = 1.0 / sb.radius if sb.kind < PLANE else 0.0
    return k, k, ZERO


def of_line(sa, a, sb, b, n, arm):
    """`curvatures_of` a capsule's or a cylinder's side, or an edge; of a sphere at the ends of the former."""
    u, radius = line_of(sb, b)
    square, crown = dot(u, u), CROWN if sa.kind >= BOX else CAPSULE_CROWN
    if abs(dot(sub(arm, centre(sb, b)), u)) >= square and sb.kind != SIDE:
        return 1.0 / radius, 1.0 / radius, ZERO
    return 2.0 * crown * sb.radius / square, 1.0 / radius, scale(1.0 / sqrt(square), u)


def of_rim(sa, a, sb, b, n, arm):
    """`curvatures_of` a cylinder's rim: those of its edge and, as where the cylinder stands upright, of the circle.

    Where it stands so nearly upright that it touches inside its disc, only rounding has a direction: there is none.
    """
    along, wide = cross(n, to_world(b.axes, load(sb.normal))), norm(load(sb.half))
    tilt, way = norm(along), ZERO
    if tilt * wide > 2.0 * CROWN * sb.radius:
        way = scale(1.0 / tilt, along)
    return 1.0 / (sb.radius + wide), 1.0 / sb.radius, way


def of_ellipsoid(sa, a, sb, b, n, arm):
    """`curvatures_of` an ellipsoid: those of Q^-1 times h, see `ellipsoid`."""
    t = tangent(n)
    u = cross(n, t)
    h, q = sqrt(dot(n, swell(sb, b, n))), shrink(sb, b, t)
    return principal(h * dot(t, q), h * dot(u, q), h * dot(u, shrink(sb, b, u)), t, u)


def of_cylinder(sa, a, sb, b, n, arm):
    """`curvatures_of` a cylinder's side, end or rim, which is sharp, and counts as flat, for balls and capsules."""
    m = local(n, sb, b)
    out, side = norm((m[0], m[1], 0.0)), abs(m[2]) < LEVEL
    radius = sb.half[0] if side else (sb.radius if sa.kind >= EDGE else 0.0)
    if out < LEVEL or radius == 0.0:
        return 0.0, 0.0, ZERO
    along = (0.0, 0.0, 1.0) if side else (-m[1] / out, m[0] / out, 0.0)
    return 0.0, 1.0 / radius, to_world(b.axes, to_world(sb.axes, along))


def of_box(sa, a, sb, b, n, arm):
    """`curvatures_of` a box at a corner, an edge or a face: the normal tells which."""
    m, k = local(n, sb, b), 1.0 / sb.radius
    x, y, z = 1.0 * (abs(m[0]) < LEVEL), 1.0 * (abs(m[1]) < LEVEL), 1.0 * (abs(m[2]) < LEVEL)
    if x + y + z == 2.0:
        return 0.0, 0.0, ZERO
    return (0.0 if x + y + z == 1.0 else k), k, to_world(b.axes, to_world(sb.axes, (x, y, z)))


def of_hull(sa, a, sb, b, n, arm):
    """`curvatures_of` a hull at a vertex, an edge or a face."""
    point = add(arm, sub(load(b.position), add(load(a.position), centre(sa, a))))
    _, _, count, edge, _ = ask_nearest(sb.nearest, sa, a, sb, b, point, 0, NO_PLACES, NEVER)
    k = 1.0 / sb.radius if count < 3 else 0.0
    return (0.0, k, scale(1.0 / norm(edge), edge)) if count == 2 else (k, k, ZERO)


def of_field(sa, a, sb, b, n, arm):
    """`curvatures_of` a height field under a side or an edge; for rims and ellipsoids it counts as flat."""
    if sa.kind == DISC or sa.kind == ELLIPSOID:
        return 0.0, 0.0, ZERO
    foot = local(sub(arm, centre(sb, b)), sb, b)
    _, slopes, bends = surface(sb, clip(foot[0], sb.half[0]), clip(foot[1], sb.half[1]))
    least, most, e = principal(*curvatures(slopes, bends, normal(slopes)))
    return least, most, to_world(b.axes, to_world(sb.axes, e))


def radius_is_clear(w, c):
    """Return whether two shapes touch where both have one radius: not a box's edge, nor a box with a capsule's side.

    Parts of boxes and cylinders have a radius by definition.
    """
    sa, sb = shape_at(w.shapes, c.shape_a), shape_at(w.shapes, c.shape_b)
    if sa.kind == CORNER or EDGE <= sa.kind < BOX or sb.kind != BOX:
        return True
    if sa.kind == SEGMENT:
        return False
    a, b = body_at(w.bodies, c.body_a), body_at(w.bodies, c.body_b)
    _, normal, _, _ = meet(sa, a, sb, b)  # the contact's own normal may be older than the box's pose
    n = local(normal, sb, b)
    return max(abs(n[0]), abs(n[1]), abs(n[2])) > ALIGNED


jit_module(__name__)
