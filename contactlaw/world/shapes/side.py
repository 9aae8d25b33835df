"""When the side of a capsule, a disc or a hull could touch: of all points of its middle line, or of it, the first."""

from __future__ import annotations

from contactlaw.world.bodies.bounds import LARGEST_TURN, time_to_close, turning_bound
from contactlaw.world.bodies.motion import rate, swing, velocity_at
from contactlaw.world.data.records import DISC, NEVER
from contactlaw.world.data.vec import add, cross, dot, load, norm, sub
from contactlaw.world.shapes.geometry import centre, half_axis
from contactlaw.world.shapes.segments import clip

GROWN = 1.5  # what accelerations by turning may grow to, within LARGEST_TURN, over what they are now


def predict_side(p, sa, a, sb, b, n, arm_a, left):
    """`pace.predict` where A is a segment, or wider; the record knows gap, time, and acceleration without turning.

    Two convex shapes are at least as far apart as along any direction that one of them holds (a separating axis): here
    along the normal that there is, as B turns. Along it the middle line of A is x(s) = m + s c, and the gap of each
    point at least the gap that there is, and at least x(s) - R; both move at speeds that are linear in s. So the
    first is one of both ends, or the point where both bounds meet. Of a disc and of what
    is wider only the gap and the greatest speed of all points count. Accelerations as B sees them are bounded.
    """
    from_a, u = centre(sa, a), half_axis(sa, a)
    from_b = add(from_a, sub(load(a.position), load(b.position)))
    half = norm(u)
    moving = sub(velocity_at(a, from_a), velocity_at(b, from_b))
    turning = sub(load(a.spin), load(b.spin))
    middle, along = -dot(moving, n), -dot(cross(turning, u), n)
    if sa.kind >= DISC:
        along = norm(cross(turning, n)) * half
    reach_a, reach_b = norm(from_a) + half, norm(from_b) + half
    rate_a, rate_b = rate(a), rate(b)
    speed = norm(moving) + (rate_a + rate_b) * half
    curving = rate_a * rate_a * reach_a + rate_b * rate_b * reach_b + 2.0 * rate_b * speed
    curving += reach_a * turning_bound(a, left) + reach_b * turning_bound(b, left)
    horizon = left
    if (rate_a + rate_b) * horizon > LARGEST_TURN:
        horizon = LARGEST_TURN / (rate_a + rate_b)
    p.acceleration += GROWN * curving + swing(a, reach_a, horizon) + swing(b, reach_b, horizon)
    p.closing = middle + abs(along)
    rises = dot(u, n) if sa.kind < DISC else 0.0
    height = dot(sub(from_a, arm_a), n) - sa.radius if sa.kind < DISC else p.gap
    shared = clip((p.gap - height) / rises) if rises != 0.0 else 1.0
    wait = NEVER
    for s in (-1.0, 1.0, shared):
        gap = max(p.gap, height + s * rises)
        wait = min(wait, time_to_close(gap, middle + s * along, p.acceleration))
    p.toi = p.seen + min(wait, horizon) if wait < left or horizon < left else NEVER
