"""How fast contacts go: when an open one could close, and how long a substep of a closed one may be."""

from __future__ import annotations

from math import sqrt

from numba import types

from contactlaw.jit import jit_inside
from contactlaw.laws.hertz import hertz_stiffness
from contactlaw.memory import whole_at
from contactlaw.world.access import body_at, law_of, pair_at, shape_at
from contactlaw.world.bounds import LARGEST_TURN, time_to_close, turning_bound
from contactlaw.world.call import ask_time
from contactlaw.world.force import hardly_moves
from contactlaw.world.geometry import OF_TIME, centre, effective_radius, meet_near
from contactlaw.world.guards import keeps_apart, over_plane
from contactlaw.world.motion import (
    acceleration_at,
    acceleration_of,
    closing_at,
    decay,
    mobility_between,
    rate,
    swing,
    velocity_at,
)
from contactlaw.world.records import NEVER, PLANE, SEGMENT, SPHERE
from contactlaw.world.vec import add, cross, dot, load, norm, sub

FEW = 4.0  # of the substeps of an impact, those of a contact that hardly moves
SLOW = 0.1  # of P delta, the energy m v^2 of a contact that does not strike
LONG = 1.0 / 3.0  # durations of an impact that a step has at least for contacts to be lasting ones in it
SLOWED, FOLLOWED = 0.5, 4.0  # of a velocity, by damping in joints within a substep; times fewer, for that, at most
OVER = 0.01  # of the radius, over a plane that parts whole shapes: what is higher is seen against this alone
TURNED = 0.1  # [rad] by which a normal may turn before masses are looked at again
STEADY, FEWEST = 1e-2, 8.0  # a contact that moves by less than so much of that; its substeps, of stability alone


@jit_inside
def impact_time(k, duration, mass, overlap, closing, push):
    """Duration [s] of an impact of this overlap (zero or more) and closing speed; push: closing acceleration.

    k: of P = k delta^1.5. duration: of an impact, times speed, over the greatest overlap. A contact that is pressed
    together is as fast as its overlap at rest makes it, however slowly it began.
    """
    square = closing * closing + 0.8 * k * overlap * overlap * sqrt(overlap) / mass
    if push > 0.0:
        square += 2.0 * push * (mass * push / k) ** (2.0 / 3.0)
    if square == 0.0:
        return NEVER
    return duration * (1.25 * mass * square / k) ** 0.4 / sqrt(square)


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
    p.seen = now
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
    if sa.kind >= SEGMENT:
        ask_time(types.uint64(whole_at(sa.long, OF_TIME)), p, sa, a, sb, b, n, arm_a, left)
        return
    slack, horizon = 0.0, left
    if a.oriented != 0 or b.oriented != 0:
        from_a = centre(sa, a)
        turning = sub(acceleration_at(a, from_a), acceleration_at(b, add(from_a, sub(arm_b, arm_a))))
        more = sub(turning, rest)
        p.acceleration += -dot(more, n) if flat or sb.kind == SPHERE else norm(more)
        far = norm(from_a)
        w = rate(b) + (rate(a) if far > 0.0 or a.tree != 0 else 0.0)
        across = norm(sub(velocity_at(a, from_a), velocity_at(b, add(from_a, sub(arm_b, arm_a)))))
        speed = w * (far + norm(arm_b)) + across
        twist = turning_bound(a, left) * far + turning_bound(b, left) * norm(arm_b) + 2.0 * norm(load(b.spin)) * across
        for _ in range(2):
            if w * horizon > LARGEST_TURN:
                horizon = LARGEST_TURN / w
            change = w * w * speed * horizon + swing(a, far, horizon) + swing(b, norm(arm_b), horizon)
            slack = (change + twist) * horizon
            horizon = min(horizon, 2.0 * time_to_close(p.gap, max(p.closing + slack, 0.0), max(p.acceleration, 0.0)))
    wait = time_to_close(p.gap, p.closing + slack, p.acceleration)
    p.toi = now + min(wait, horizon) if wait < left or horizon < left else NEVER


@jit_inside
def radius_of(w, p):
    """Effective radius [m] of a near pair, where its bodies are."""
    return ellipse_of(w, p)[0]


@jit_inside
def ellipse_of(w, p):
    """The same, and the longer axis, see `geometry.effective_radius`; a radius that is given is that of a circle."""
    own = pair_at(w.pairs, p.pair).radius
    if own > 0.0:
        return own, (0.0, 0.0, 0.0)
    sa, sb = shape_at(w.shapes, p.a), shape_at(w.shapes, p.b)
    return effective_radius(sa, body_at(w.bodies, p.body_a), sb, body_at(w.bodies, p.body_b))


@jit_inside
def touch_time(w, p):
    """Duration [s] of the impact that two near shapes are about to have."""
    a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
    _, n, arm_a, arm_b = meet_near(w, p, a, b)
    mass = 1.0 / mobility_between(a, arm_a, b, arm_b, n)
    push = max(p.acceleration, 0.0)
    closing = sqrt(max(p.closing, 0.0) ** 2 + 2.0 * push * max(p.gap, 0.0))
    law = law_of(w, pair_at(w.pairs, p.pair))
    k = 4.0 / 3.0 * law.e_star * sqrt(radius_of(w, p))
    return impact_time(k, law.duration, mass, max(-p.gap, 0.0), closing, push)


@jit_inside
def contact_time(w, c, a, b):
    """Duration [s] of the impact that a closed contact is in."""
    t = c.touch
    pull = sub(load(a.acceleration), load(b.acceleration))
    duration = law_of(w, pair_at(w.pairs, c.pair)).duration
    return impact_time(hertz_stiffness(t), duration, t.mass, max(t.overlap, 0.0), closing_speed(c, a, b), norm(pull))


@jit_inside
def closing_speed(c, a, b):
    """Closing speed [m/s] of a closed contact; `touch.closing` is rounding alone if its substep was as short."""
    return closing_at(a, load(c.arm_a), b, load(c.arm_b), load(c.normal))


@jit_inside
def rests(c, a, b):
    """Whether a closed contact does not strike within the step, see `SLOW`.

    One that is near its balance may be as soft as it likes: what it does beside stiffer ones a step follows, or damps.
    """
    speed, t = closing_speed(c, a, b), c.touch
    if t.zeta == 0.0:
        return False
    return speed * speed * t.mass <= SLOW * t.force * t.overlap and hardly_moves(c, 1.0)


@jit_inside
def substep(w, c, a, b, substeps):
    """Longest substep [s] for a closed contact; substeps: of an impact."""
    t = c.touch
    chi = 0.5 * t.g_star / t.e_star * t.mass / t.tangential_mass
    law = law_of(w, pair_at(w.pairs, c.pair))
    if t.overlap > 0.0 and law.vectors > 0.0 and hardly_moves(c, STEADY):
        substeps = FEWEST  # but where friction is rigid: what drives it then creeps by what it gains in a substep
    elif t.overlap > 0.0 and hardly_moves(c, 1.0):
        calm = substeps if substeps > w.crowd_substeps else 0.5 * substeps  # as it is in a crowd
        substeps = max(substeps / FEW, min(calm, 20.0))
    longest = contact_time(w, c, a, b) / (substeps * max(1.0, sqrt(0.5 * chi)))
    slowing = decay(a) + (decay(b) if b.tree != a.tree else 0.0)
    return longest if slowing * longest <= SLOWED else max(SLOWED / slowing, longest / FOLLOWED)


@jit_inside
def masses(c, a, b):
    """Effective masses [kg] along the normal and across, the mean of both tangents, as the normal is now.

    Where joints let nothing move along it the damper would be as strong as one likes, and would act as soon as the
    normal has turned by an angle x: the mass there is at most 1/x^2 times that across, which is what is taken.
    """
    n, e = load(c.normal), load(c.tangent)
    arm_a, arm_b = load(c.arm_a), load(c.arm_b)
    both = mobility_between(a, arm_a, b, arm_b, e) + mobility_between(a, arm_a, b, arm_b, cross(n, e))
    c.touch.tangential_mass = 2.0 / both
    c.touch.mass = 1.0 / max(mobility_between(a, arm_a, b, arm_b, n), 0.5 * TURNED * TURNED * both)
