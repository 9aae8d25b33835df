"""Effective radius of elliptic Hertz contacts: that of the ball on a plane with the same force law.

With the relative principal curvatures p <= q [1/m] in two perpendicular directions the contact is an ellipse of half
axes a >= b, k^2 = 1 - (b/a)^2, where (Johnson 1985, section 4.2)

    q/p = [(a/b)^2 E(k) - K(k)]/(K(k) - E(k))        a^3 = 3 P D/(pi E* p)        delta = 3 P K(k)/(2 pi E* a)

and D = (K - E)/k^2. Hence P = 4/3 E* sqrt(R) delta^1.5 as for balls, with R = pi^2 D/(2 p K^3). R sqrt(p q) is a
function of ln(q/p) alone, here a fit to 5e-4 for q/p up to 1e5.
"""

from math import atan2, cos, exp, log, log1p, sin, sqrt

from contactlaw.jit import jit_module
from contactlaw.world.data.access import body_at, shape_at
from contactlaw.world.data.kinds import BOX, CORNER, EDGE, SEGMENT
from contactlaw.world.data.vec import add, axpy, dot, load, scale, to_body, to_world
from contactlaw.world.shapes.geometry import meet

SCALE = 0.0312022  # of the fit of ln(R sqrt(p q)) in ln(1 + SCALE ln^2(q/p))
FIT = (1.3265492, 0.13058459, 0.11675849)  # its coefficients
FLATTEST = 1e-5  # ratio of curvatures, at least: the range of the fit
ALIGNED = 1.0 - 1e-9  # cosine of the angle between a normal and an axis of a box from which it counts as a face's
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
    the least. The curvature tensors add; their deviators turn by twice the angle between both directions.
    """
    along_a, across_a, e = one
    along_b, across_b, f = two
    mean = 0.5 * (along_a + across_a + along_b + across_b)
    x, y, cosine = 0.5 * (across_a - along_a), 0.5 * (across_b - along_b), dot(e, f)
    differ = sqrt(max(x * x + y * y + 2.0 * x * y * (2.0 * cosine * cosine - 1.0), 0.0))
    p = max(mean - differ, FLATTEST * (mean + differ))
    return equivalent_radius(p, mean + differ), scale(log((mean + differ) / p), between(x, e, y, f, differ))


def between(x, e, y, f, differ):
    """Return the direction of least relative curvature.

    x, y >= 0: half differences of the principal curvatures of both bodies; e, f: their directions of least curvature;
    differ: half difference of the relative curvatures.
    """
    cosine = dot(e, f)
    across = axpy(-cosine, e, f)
    sine = sqrt(dot(across, across))
    if y == 0.0 or sine == 0.0:
        return e if x > 0.0 else f
    if x == 0.0 or differ == 0.0:
        return f
    double = (x + y * (2.0 * cosine * cosine - 1.0)) / differ
    near, far = sqrt(max(0.5 + 0.5 * double, 0.0)), sqrt(max(0.5 - 0.5 * double, 0.0))
    return add(scale(near, e), scale((far if cosine >= 0.0 else -far) / sine, across))


def principal(tt, tu, uu, t, u):
    """Return the curvatures of a body, see `radius_between`, of which those along two unit vectors t, u are given."""
    mean, differ = 0.5 * (tt + uu), sqrt(0.25 * (tt - uu) ** 2 + tu * tu)
    angle = 0.5 * atan2(2.0 * tu, tt - uu)
    return mean - differ, mean + differ, add(scale(-sin(angle), t), scale(cos(angle), u))


def rim(s, b):
    """Return `radius_between` of a cylinder's rim and a flat shape; the vector is along the cylinder's axis instead.

    The rim has the radius of its edge, and that of the circle, as where the cylinder stands upright.
    """
    p, q = 1.0 / (s.radius + sqrt(dot(load(s.half), load(s.half)))), 1.0 / s.radius
    return equivalent_radius(p, q), scale(log(q / p), to_world(b.axes, load(s.normal)))


def feature(radius, count, edge):
    """Return the curvatures, see `radius_between`, of a swept core at a vertex, an edge or a face: count = 1, 2, 3."""
    k = 1.0 / radius if radius > 0.0 and count < 3 else 0.0
    return (0.0, k, scale(1.0 / sqrt(dot(edge, edge)), edge)) if count == 2 else (k, k, edge)


def side_at(s, u, place, crown):
    """Return the curvatures, see `radius_between`, of a sphere, or of a capsule at a place along its half axis u."""
    k, square = 1.0 / s.radius, dot(u, u)
    if square == 0.0 or abs(place) >= 1.0:
        return k, k, (1.0, 0.0, 0.0)
    return 2.0 * crown * s.radius / square, k, scale(1.0 / sqrt(square), u)


def radius_is_clear(w, c):
    """Return whether two shapes touch where both have one radius: not a box's edge, nor a box with a capsule's side.

    Parts of boxes and cylinders have a radius by definition.
    """
    sa, sb = shape_at(w.shapes, c.shape_a), shape_at(w.shapes, c.shape_b)
    if sa.kind == CORNER or EDGE <= sa.kind < BOX or sb.kind != BOX:
        return True
    if sa.kind == SEGMENT:
        return False
    a, b, clear = body_at(w.bodies, c.body_a), body_at(w.bodies, c.body_b), False
    _, normal, _, _ = meet(sa, a, sb, b)  # the contact's own normal may be older than the box's pose
    n = to_body(b.axes, normal)
    for i in range(3):
        clear = clear or abs(n[0] * sb.axes[i] + n[1] * sb.axes[3 + i] + n[2] * sb.axes[6 + i]) > ALIGNED
    return clear


jit_module(__name__)
