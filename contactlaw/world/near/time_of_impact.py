"""When two near shapes could touch: one step of conservative advancement."""

from __future__ import annotations

from numba import types

from contactlaw.jit import jit_inside
from contactlaw.memory import whole_at
from contactlaw.world.bodies.bounds import LARGEST_TURN, time_to_close, turning_bound
from contactlaw.world.bodies.motion import (
    acceleration_at,
    acceleration_of,
    change_bound,
    closing_at,
    greatest_closing,
    turn_rate,
    velocity_at,
)
from contactlaw.world.data.access import shape_at
from contactlaw.world.data.call import ask_time
from contactlaw.world.data.records import HEIGHT_FIELD, NEVER, PLANE, SEGMENT, SPHERE
from contactlaw.world.data.vec import add, dot, load, norm, sub
from contactlaw.world.near.guards import keeps_apart, over_plane
from contactlaw.world.shapes.geometry import OF_TIME, centre, meet_near

OVER = 0.01  # of the radius, over a plane that parts whole shapes: what is higher is seen against this alone


@jit_inside
def bending(b, time):
    """Return a bound on the acceleration [m/s^2] by rotation of a body's points within a time [s]."""
    return turning_bound(b, time) * b.reach + change_bound(b, b.reach, time)


@jit_inside
def predict(w, p, a, b, now, left):
    """Time of impact of two near shapes, at the earliest; now: of the step, left: what there is of it after [s].

    a, b: their bodies, as they are now.

    A step of conservative advancement (Mirtich 1996): the time is never too late, and exact for spheres that meet head
    on. What the closing acceleration leaves out, the line of centres that turns, opens the gap, as the distance of a
    point from what is convex is convex; that of shapes off their body's centre, which changes as the body turns, is
    bounded.
    """
    sa, sb = shape_at(w.shapes, p.a), shape_at(w.shapes, p.b)
    p.checked = now
    if keeps_apart(w, p, a, b, left):
        return
    overlap, n, arm_a, arm_b = over_plane(w, p, a, b)
    if overlap > -OVER * sa.radius:
        overlap, n, arm_a, arm_b = meet_near(w, p, a, b)
    p.gap = -overlap
    p.closing = closing_at(a, arm_a, b, arm_b, n)
    rest = sub(acceleration_of(a), acceleration_of(b))
    flat = sb.kind >= PLANE
    p.acceleration = -dot(rest, n) if flat else norm(rest)
    p.toi = now
    if overlap > 0.0:
        return
    if sb.kind == HEIGHT_FIELD:  # not convex: it comes nearer as fast as any point moves, at most
        p.closing = greatest_closing(a, b)
        p.acceleration = norm(rest) + bending(a, left) + bending(b, left)
        wait = time_to_close(p.gap, p.closing, p.acceleration)
        p.toi = now + wait if wait < left else NEVER
        return
    if sa.kind >= SEGMENT:
        ask_time(types.uint64(whole_at(sa.swept, OF_TIME)), p, sa, a, sb, b, n, arm_a, left)
        return
    slack, horizon = 0.0, left
    if a.oriented != 0 or b.oriented != 0:
        from_a = centre(sa, a)
        turning = sub(acceleration_at(a, from_a), acceleration_at(b, add(from_a, sub(arm_b, arm_a))))
        more = sub(turning, rest)
        p.acceleration += -dot(more, n) if flat or sb.kind == SPHERE else norm(more)
        far = norm(from_a)
        w = turn_rate(b) + (turn_rate(a) if far > 0.0 or a.tree != 0 else 0.0)
        across = norm(sub(velocity_at(a, from_a), velocity_at(b, add(from_a, sub(arm_b, arm_a)))))
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
