"""Times of impact of near pairs: one step of conservative advancement."""

from contactlaw.jit import jit_module
from contactlaw.world.bodies import motion
from contactlaw.world.bodies.bounds import LARGEST_TURN, time_to_close, turning_bound
from contactlaw.world.bodies.motion import acceleration_of, change_bound
from contactlaw.world.data.access import body_at, shape_at
from contactlaw.world.data.call import ask_predict
from contactlaw.world.data.kinds import HEIGHT_FIELD, PLANE, SEGMENT, SPHERE
from contactlaw.world.data.records import NEVER
from contactlaw.world.data.saved import scratch_body
from contactlaw.world.data.vec import add, dot, load, norm, sub
from contactlaw.world.near.guards import cores_stay_apart, raise_listed_gap, takes_known_time
from contactlaw.world.shapes.geometry import centre, meet_near, takes_known_gap


def time_to_spheres(sa, a, sb, b, n, top, left):
    """Return a time [s], a lower bound, until two shapes meet however their bodies turn.

    Each stays in a sphere about its body's centre of mass. So along normal n, fixed in space, their gap closes as those
    spheres do, by the motion of both centres. top: present height of B along n over its centre [m], which stays that
    of a body that does not turn. left: rest of the step [s].
    """
    if motion.turn_rate(b) > 0.0 or turning_bound(b, left) > 0.0:
        top = b.reach + sb.radius
    gap = dot(n, sub(load(a.position), load(b.position))) - top - a.reach - sa.radius
    if gap <= 0.0:
        return 0.0
    push = dot(n, sub(acceleration_of(b), acceleration_of(a))) + change_bound(a, 0.0, left) + change_bound(b, 0.0, left)
    return time_to_close(gap, dot(n, sub(load(b.velocity), load(a.velocity))), push)


def flown_to(w, i, now, place):
    """Return body i as it flies to a time [s]; a free body in a scratch copy, number `place`, a tree itself."""
    b = body_at(w.bodies, i)
    if b.time != now and b.still == 0 and b.tree == 0:
        b = scratch_body(w, i, place, now)
    motion.fly(b, now)
    return b


def predict(w, p, now):
    """Predict the time of impact [s] of an open pair as its bodies fly from a time of the step [s] on.

    It is a lower bound; NEVER: not within the step. Sets `toi`, `gap`, `closing`, `acceleration` and `checked` of the
    pair. Returns its bodies where they are then. A free body that is behind in time is copied, so that its flight stays
    in one piece, and its rounding does not depend on which pairs are predicted.
    """
    if takes_known_time(w, p, now):
        a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
    else:
        a, b = flown_to(w, p.body_a, now, 0), flown_to(w, p.body_b, now, 1)
        if p.places > 1 and takes_known_gap(w, p, now):
            return a, b
        find_time(w, p, a, b, now, w.step - now)
    raise_listed_gap(w, p, now)
    return a, b


def find_gap(w, p, now):
    """Find what `predict` finds, except for the time of impact: that must not depend on who has looked at the pair."""
    toi = p.toi
    predict(w, p, now)
    p.toi = toi


def find_time(w, p, a, b, now, left):
    """Find what `predict` sets; left: time to the end of the step [s].

    A step of conservative advancement (Mirtich 1996): the time is never too late, and exact for spheres that meet head
    on. The closing acceleration leaves out that the line of centres turns. This opens the gap, as the distance of a
    point from a convex shape is convex. The motion of shapes off their body's centre changes as the body turns; this is
    bounded.
    """
    sa, sb = shape_at(w.shapes, p.a), shape_at(w.shapes, p.b)
    p.checked = now
    if cores_stay_apart(w, p, a, b, left):
        return
    overlap, n, arm_a, arm_b = meet_near(w, p, a, b)
    p.gap, p.closing = -overlap, motion.closing_at(a, arm_a, b, arm_b, n)
    rest, flat = sub(acceleration_of(a), acceleration_of(b)), sb.kind >= PLANE
    p.acceleration = -dot(rest, n) if flat else norm(rest)
    p.toi = now
    if overlap > 0.0:
        return
    if sb.kind == HEIGHT_FIELD:  # not convex: the gap closes at most as fast as any point moves
        p.acceleration = norm(rest)
        for one in (a, b):  # by rotation and joints
            p.acceleration += turning_bound(one, left) * one.reach + change_bound(one, one.reach, left)
        wait = time_to_close(p.gap, motion.greatest_closing(a, b), p.acceleration)
        p.toi = now + wait if wait < left else NEVER
        return
    rate = motion.turn_rate(a) + motion.turn_rate(b)
    if rate * left > LARGEST_TURN:
        wait = time_to_spheres(sa, a, sb, b, n, dot(n, arm_b), left)
        if not wait < left or wait * rate > LARGEST_TURN:  # further than bounds on single points look ahead
            p.toi = now + wait if wait < left else NEVER
            return
    if sa.kind >= SEGMENT:
        ask_predict(sa.predict, p, sa, a, sb, b, n, arm_a, left)
        return
    slack, horizon = 0.0, left
    if a.oriented != 0 or b.oriented != 0:
        from_a = centre(sa, a)
        turning = sub(motion.acceleration_at(a, from_a), motion.acceleration_at(b, add(from_a, sub(arm_b, arm_a))))
        more = sub(turning, rest)
        p.acceleration += -dot(more, n) if flat or sb.kind == SPHERE else norm(more)
        far = norm(from_a)
        w = motion.turn_rate(b) + (motion.turn_rate(a) if far > 0.0 or a.tree != 0 else 0.0)
        across = norm(sub(motion.velocity_at(a, from_a), motion.velocity_at(b, add(from_a, sub(arm_b, arm_a)))))
        speed = w * (far + norm(arm_b)) + across
        twist = turning_bound(a, left) * far + turning_bound(b, left) * norm(arm_b) + 2.0 * norm(load(b.spin)) * across
        for _ in range(2):
            if w * horizon > LARGEST_TURN:
                horizon = LARGEST_TURN / w
            change = w * w * speed * horizon + change_bound(a, far, horizon) + change_bound(b, norm(arm_b), horizon)
            slack = (change + twist) * horizon
            horizon = min(horizon, 2.0 * time_to_close(p.gap, max(p.closing + slack, 0.0), max(p.acceleration, 0.0)))
    wait = time_to_close(p.gap, p.closing + slack, p.acceleration)
    p.toi = now + min(wait, horizon) if wait < left or horizon < left else NEVER


jit_module(__name__)
