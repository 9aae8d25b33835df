"""Swept shapes: capsules and edges (a sphere along a segment), rims and sides of cylinders (along a disc), and cores.

Hulls and ellipsoids have functions of their own in place of some, see `functions`.
"""

from contactlaw.jit import jit
from contactlaw.world.bodies.bounds import LARGEST_TURN, time_to_close, turning_bound
from contactlaw.world.bodies.motion import change_bound, turn_rate, velocity_at
from contactlaw.world.data.call import ask_deepest
from contactlaw.world.data.kinds import CYLINDER, DISC, EDGE, PLANE, SEGMENT, SIDE
from contactlaw.world.data.records import NEVER
from contactlaw.world.data.vec import add, axpy, cross, dot, load, norm, scale, sub, to_world
from contactlaw.world.shapes.core import clip, deepest_on_line, excess_of, local, way_out
from contactlaw.world.shapes.geometry import NO_PLACES, centre, half_axis, note, recall, round_on_round

CAPSULE_CROWN = 1e-3  # of the radius, by which the side of a capsule is lower at its ends
GROWN = 1.5  # bound on the growth of accelerations by rotation within LARGEST_TURN


@jit
def nearest_on_segments(d, u, radius_a, v, radius_b):
    """Return the places s and t along the half axes u of A and v of B; d: from the middle of B to that of A [m].

    Of two parallel segments no point is the nearest, and of nearly parallel ones it jumps from end to end. So the sides
    of capsules are slightly crowned, as rollers are: r(s) = R (1 - C s^2), s from -1 to 1, C = CAPSULE_CROWN. The
    overlap r_a(s) + r_b(t) - |d + s u - t v| is greatest, where contact begins, at the minimum of

        |d + s u - t v|^2/2 + (R_a + R_b) C (R_a s^2 + R_b t^2),

    which is strictly convex: its minimum over the square of s and t has a closed form and moves continuously. By the
    envelope theorem the force along the line of both points is the gradient of the overlap.
    """
    both = 2.0 * CAPSULE_CROWN * (radius_a + radius_b)
    uu, vv, uv = dot(u, u) + both * radius_a, dot(v, v) + both * radius_b, dot(u, v)
    du, dv = dot(d, u), dot(d, v)
    s = clip((uv * dv - vv * du) / (uu * vv - uv * uv))
    t = clip((dv + uv * s) / vv)
    return clip((uv * t - du) / uu), t


def meet(sa, a, sb, b, last):
    """`geometry.meet` of any round shape with a segment, a box or a cylinder, and of a rim with a plane."""
    from_a, from_b = centre(sa, a), centre(sb, b)
    d = add(sub(load(a.position), load(b.position)), sub(from_a, from_b))
    if sb.kind == SEGMENT:
        u, v = half_axis(sa, a), half_axis(sb, b)
        s, t = nearest_on_segments(d, u, sa.radius, v, sb.radius)
        d = sub(axpy(s, u, d), scale(t, v))
        radius_a, radius_b = sa.radius * (1.0 - CAPSULE_CROWN * s * s), sb.radius * (1.0 - CAPSULE_CROWN * t * t)
        return round_on_round(radius_a, axpy(s, u, from_a), radius_b, axpy(t, v, from_b), d)
    radius, rounding = sa.radius, sb.radius if sa.kind >= EDGE else 0.0
    if sa.kind == SEGMENT or sa.kind == EDGE:
        u = half_axis(sa, a)
        s, radius, _ = deepest_on_line(d, u, rounding, (sa, a, sb, b), recall(last)[0][2])
        note(last, (0.0, 0.0, s), 0, NO_PLACES)
        d, from_a = axpy(s, u, d), axpy(s, u, from_a)
    elif sa.kind == DISC or sa.kind == SIDE:
        offset, radius = ask_deepest(sa.deepest, sa, a, sb, b, d, last)
        d, from_a = add(d, offset), add(from_a, offset)
    if sb.kind == PLANE:
        n = to_world(b.axes, load(sb.normal))
        distance = dot(d, n)
    else:
        p = local(d, sb, b)
        e = excess_of(p, sb, rounding)
        distance = norm(e)
        one = (e[0] / distance, e[1] / distance, e[2] / distance)
        distance, n = (distance - rounding, one) if distance > 0.0 else way_out(p, sb)
        n = to_world(b.axes, to_world(sb.axes, n))
    arm = axpy(-radius, n, from_a)
    return radius - distance, n, arm, add(arm, sub(load(a.position), load(b.position)))


def predict_side(p, sa, a, sb, b, n, arm_a, left):
    """Predict the time of impact of a segment, a disc or anything wider, A: `near.time_of_impact.predict` for these.

    On entry p.gap and p.checked are set, and p.acceleration without the part by rotation. n: normal from B to A; arm_a:
    of the nearest point of A; left: rest of the step [s].

    The distance of two convex shapes is at least that along any direction fixed to B (a separating axis): here the
    present normal. Along it the points of A's middle line x(s) = m + s c, -1 <= s <= 1, have gaps of at least the
    present gap, and at least x(s) - R; they move at speeds linear in s. So the first to close is one of both ends, or
    the point where both bounds are equal. Of a disc or anything wider only the gap and the greatest speed of all points
    are used. Accelerations relative to B are bounded. A cylinder is where it is however it turns about its axis: it
    counts as turning about that as the other shape does, so that what rolls does not come nearer.
    """
    from_a, u = centre(sa, a), half_axis(sa, a)
    from_b = add(from_a, sub(load(a.position), load(b.position)))
    half, rate_a, rate_b = norm(u), turn_rate(a), turn_rate(b)
    reach_a, reach_b = norm(from_a) + half, norm(from_b) + half
    moving = sub(velocity_at(a, from_a), velocity_at(b, from_b))
    turning = sub(load(a.spin), load(b.spin))
    if sb.kind == CYLINDER:
        axis, off = to_world(b.axes, to_world(sb.axes, (0.0, 0.0, 1.0))), sub(from_b, centre(sb, b))
        own = dot(turning, axis)
        moving, turning = axpy(-own, cross(axis, off), moving), axpy(-own, axis, turning)
        rate_b, reach_b = rate_b + abs(own), reach_b + 2.0 * norm(off)
    if sa.kind == DISC or sa.kind == SIDE:
        axis = to_world(a.axes, load(sa.normal))
        own = dot(turning, axis)
        turning, rate_a = axpy(-own, axis, turning), rate_a + abs(own)
    middle, along, rises, height = -dot(moving, n), norm(cross(turning, n)) * half, 0.0, p.gap
    if sa.kind < DISC:
        along, rises, height = -dot(cross(turning, u), n), dot(u, n), dot(sub(from_a, arm_a), n) - sa.radius
    rate = rate_a + rate_b
    curving = rate_a * rate_a * reach_a + rate_b * rate_b * reach_b + 2.0 * rate_b * (norm(moving) + rate * half)
    curving += reach_a * turning_bound(a, left) + reach_b * turning_bound(b, left)
    horizon = LARGEST_TURN / rate if rate * left > LARGEST_TURN else left
    p.acceleration += GROWN * curving + change_bound(a, reach_a, horizon) + change_bound(b, reach_b, horizon)
    p.closing = middle + abs(along)
    wait = NEVER
    for s in (-1.0, 1.0, clip((p.gap - height) / rises) if rises != 0.0 else 1.0):
        wait = min(wait, time_to_close(max(p.gap, height + s * rises), middle + s * along, p.acceleration))
    p.toi = p.checked + min(wait, horizon) if wait < left or horizon < left else NEVER
