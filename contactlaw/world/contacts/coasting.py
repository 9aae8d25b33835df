"""Coasting: a cheap model of contacts that hardly change from substep to substep, without their laws and shapes.

In a heap most contacts carry a nearly constant load. While such a contact coasts, normal, arms and tangential stiffness
are held. Its overlap x changes by the bodies' motion along the normal, P = k x^1.5 plus the damper. Tangentially it is
one spring of Mindlin's stiffness 2 G* a, which begins with the present force and slips at mu P. Afterwards the law is
advanced by the whole displacement at once. The spring is never softer than the law: in loading it takes no less energy
than the law stores, in unloading it gives back no more. Each contact coasts as long as it is in the range in which
this holds.
"""

from math import sqrt

from contactlaw.jit import jit_inside
from contactlaw.laws import torsion
from contactlaw.laws.hertz import damping_of, hertz_stiffness
from contactlaw.laws.record import LASTING, SPRUNG, UNSHEARED
from contactlaw.laws.slip import stuck_stiffness
from contactlaw.memory import whole_at
from contactlaw.world.bodies.motion import moved_at
from contactlaw.world.contacts.force import dashpot_of, has_dashpot, is_quasi_static
from contactlaw.world.contacts.pace import closing_speed
from contactlaw.world.contacts.touch import turn_frame
from contactlaw.world.data.access import body_at, coasting_at, contact_at, near_at, pair_at
from contactlaw.world.data.materials import law_of
from contactlaw.world.data.records import NEVER
from contactlaw.world.data.saved import body_address
from contactlaw.world.data.vec import add, axpy, cross, dot, load, norm, scale, store, sub

# Roots of m delta/P in which a contact must be expected to hardly change: 0.4 durations of an impact. An impact changes
# by CHANGE in 0.9 of them even where it is deepest, so it never coasts: a billiard break converges with its substeps
STEADY = 1.3
CHANGE = 0.4  # changes of overlap and friction while a contact coasts, at most: share of the overlap and of mu P
LEAST, MOST = 0.65, 1.5  # range of the overlap, over that at the start
TURNING = 0.02  # change of the overlap by turning of the normal, at most: share of the overlap
FULL = 0.98  # share of mu P from which a friction force counts as the limit
TORSION_PHASE = 0.3  # [rad] of a torsional oscillation for which its moment may be held: critically damped, stable to 1


def start_coasting(w, pairs, h):
    """Let contacts of an island coast that hardly change, in substeps of h [s]; return how many coast now."""
    coasting = 0
    for i in range(pairs):
        p = near_at(w.near, whole_at(w.island_pairs, i))
        if p.closed != 0 and p.coasts == 0 and has_model(w, p):
            c = contact_at(w.contacts, p.slot)
            t, time = c.touch, steady_time(c, body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b))
            if time * time * t.force > STEADY * STEADY * t.mass * t.overlap:
                p.coasts = 1
                begin_coasting(w, p, h, time)
        coasting += p.coasts
    return coasting


@jit_inside
def has_model(w, p):
    """Return whether a closed contact can coast: it is persistent, without rolling resistance, between round bodies.

    Kinematic bodies count as round.
    """
    c, law = contact_at(w.contacts, p.slot), law_of(w, pair_at(w.pairs, p.pair))
    t = c.touch
    if not (t.state == SPRUNG or t.state == UNSHEARED) or t.course != LASTING or t.overlap <= 0.0:
        return False
    plain = law.sectors != 0.0 and law.rolling == 0.0 and t.skew == 0.0
    return plain and is_round(body_at(w.bodies, p.body_a)) and is_round(body_at(w.bodies, p.body_b))


@jit_inside
def steady_time(c, a, b):
    """Return the time [s] in which overlap, normal and friction of a closed contact are expected to hardly change.

    With closing speed v and acceleration a, the overlap changes by (v + a t/2) t.
    """
    speed, change = abs(closing_speed(c, a, b)), CHANGE * c.touch.overlap
    root = sqrt(speed * speed + 2.0 * abs(c.closing_acceleration) * change)
    time = min(2.0 * change / max(speed + root, 1e-300), turning_time(c, a, b))
    slid = sqrt(c.moved[0] ** 2 + c.moved[1] ** 2)
    return min(time, longest_slide(c.touch) * c.interval / max(slid, 1e-300))


@jit_inside
def turning_time(c, a, b):
    """Return the time [s] in which turning of the normal changes the overlap by the share TURNING.

    A displacement x of the centres across the normal turns it by x over the sum of arms, which changes the overlap by
    x^2/2 over that sum.
    """
    n, velocity = load(c.normal), sub(load(a.velocity), load(b.velocity))
    across = norm(axpy(-dot(velocity, n), n, velocity))
    return sqrt(2.0 * TURNING * c.touch.overlap * (norm(load(c.arm_a)) + norm(load(c.arm_b)))) / max(across, 1e-300)


@jit_inside
def torsion_time(w, c, a, b):
    """Return the time [s] for which the moment about the normal may be held; NEVER if the contact has not spun."""
    if c.torsion.span == 0.0:
        return NEVER
    stiffness = torsion.stuck_stiffness(law_of(w, pair_at(w.pairs, c.pair)).g_t, sqrt(c.touch.radius * c.touch.overlap))
    return TORSION_PHASE / sqrt(stiffness * (a.inverse_inertia[0] + b.inverse_inertia[0]))


@jit_inside
def longest_slide(t):
    """Return the displacement [m] that changes the friction of a stuck contact by CHANGE; NEVER if it slides."""
    limit = t.friction * t.force
    return NEVER if t.f * t.f + t.g * t.g > (FULL * limit) ** 2 else CHANGE * limit / stuck_stiffness(t)


@jit_inside
def is_round(b):
    """Return whether a body is kinematic, or free with inertia and shapes that do not change as it turns."""
    return b.tree == 0 and (b.inverse_mass == 0.0 or (b.isotropic != 0 and b.oriented == 0))


@jit_inside
def begin_coasting(w, p, h, longest):
    """Set the model of a pair's contact in substeps of h [s]; it holds for the longest time [s] unless quasi-static."""
    c, r = contact_at(w.contacts, p.slot), coasting_at(w.coasting, p.slot)
    t, n, e = c.touch, load(c.normal), load(c.tangent)
    r.body_a, r.body_b = body_address(w.bodies, p.body_a), body_address(w.bodies, p.body_b)
    a, b = body_at(r.body_a, 0), body_at(r.body_b, 0)
    a.touched, b.touched = 1, 1
    store(r.normal, n)
    store(r.tangent, e)
    store(r.side, cross(n, e))
    store(r.arm_a, load(c.arm_a))
    store(r.arm_b, load(c.arm_b))
    r.overlap, r.closing, r.force = t.overlap, t.closing, t.force
    r.least, r.most = LEAST * t.overlap, MOST * t.overlap
    r.stiffness, r.damping = hertz_stiffness(t), damping_of(t)
    r.share = 1.0 / (1.0 + 0.5 * r.damping * h / t.mass)
    r.spring, r.drag, r.friction = stuck_stiffness(t), 0.0, t.friction
    r.f, r.g, r.held_f, r.held_g = t.f, t.g, t.f, t.g
    if has_dashpot(c):
        r.drag = dashpot_of(t)
        r.held_f -= r.drag * c.moved[0] / c.interval
        r.held_g -= r.drag * c.moved[1] / c.interval
    r.moment = c.torsion.moment
    r.longest = min(turning_time(c, a, b), torsion_time(w, c, a, b)) if is_quasi_static(c, 1.0) else longest
    r.furthest = longest_slide(t)
    store(r.slide, (0.0, 0.0, 0.0))
    store(r.impulse, (0.0, 0.0, 0.0))
    r.turned, r.normal_work, r.friction_work, r.time = 0.0, 0.0, 0.0, 0.0


def advance_coasting(w, pairs, span):
    """Advance coasting contacts by the last substep and kick their bodies; return how many coast on.

    Those that leave the range of the model stop: the next substep advances their laws by the whole displacement.

    span: length [s] of the substep, and time [s] for which the forces act.
    """
    h, time = span
    rate, coasting = 1.0 / h, 0
    for i in range(pairs):
        p = near_at(w.near, whole_at(w.island_pairs, i))
        if p.coasts == 0:
            continue
        r = coasting_at(w.coasting, p.slot)
        a, b = body_at(r.body_a, 0), body_at(r.body_b, 0)
        n, e, s, arm_a, arm_b = load(r.normal), load(r.tangent), load(r.side), load(r.arm_a), load(r.arm_b)
        moved = sub(moved_at(a, arm_a), moved_at(b, arm_b))
        gained, du, dv = -dot(moved, n), dot(moved, e), dot(moved, s)
        turn_a, turn_b = dot(load(a.twist), n), dot(load(b.twist), n)
        overlap, closing = r.overlap + gained, rate * gained
        force = r.stiffness * overlap * sqrt(max(overlap, 0.0)) + r.damping * (1.5 * closing - 0.5 * r.closing)
        force = max(r.share * force + (1.0 - r.share) * r.force, 0.0)
        r.held_f += r.spring * du
        r.held_g += r.spring * dv
        f, g, limit = r.held_f + r.drag * rate * du, r.held_g + r.drag * rate * dv, r.friction * force
        square = f * f + g * g
        if square > limit * limit:
            share = limit / sqrt(square)
            f, g = share * f, share * g
            r.held_f, r.held_g = f, g
        r.normal_work -= 0.5 * (r.force + force) * gained
        r.friction_work -= 0.5 * ((r.f + f) * du + (r.g + g) * dv) + r.moment * (turn_a - turn_b)
        r.overlap, r.closing, r.force, r.f, r.g = overlap, closing, force, f, g
        store(r.slide, add(load(r.slide), (du, dv, turn_a - turn_b)))
        r.turned += 0.5 * (turn_a + turn_b)
        r.time += h
        impulse = scale(time, axpy(force, n, axpy(-f, e, scale(-g, s))))
        store(r.impulse, add(load(r.impulse), impulse))
        moment = scale(-time * r.moment, n)
        if a.inverse_mass != 0.0:
            store(a.velocity, axpy(a.inverse_mass, impulse, load(a.velocity)))
            store(a.spin, axpy(a.inverse_inertia[0], add(cross(arm_a, impulse), moment), load(a.spin)))
        if b.inverse_mass != 0.0:
            store(b.velocity, axpy(-b.inverse_mass, impulse, load(b.velocity)))
            store(b.spin, axpy(-b.inverse_inertia[0], add(cross(arm_b, impulse), moment), load(b.spin)))
        if is_in_range(r):
            coasting += 1
        else:
            end_coasting(w, p)
    return coasting


def stop_coasting(w, pairs):
    """Stop every coasting contact; this substep advances their laws by the whole displacement."""
    for i in range(pairs):
        p = near_at(w.near, whole_at(w.island_pairs, i))
        if p.coasts != 0:
            end_coasting(w, p)


@jit_inside
def is_in_range(r):
    """Return whether a contact may coast on."""
    slid = r.slide[0] * r.slide[0] + r.slide[1] * r.slide[1]
    return r.least <= r.overlap <= r.most and slid < r.furthest * r.furthest and r.time < r.longest


@jit_inside
def end_coasting(w, p):
    """Stop the coasting contact of a pair, and write its model back."""
    p.coasts = 0
    c, r = contact_at(w.contacts, p.slot), coasting_at(w.coasting, p.slot)
    if r.time == 0.0:
        return
    t = c.touch
    c.coasted_from = t.overlap
    store(c.coasted, load(r.slide))
    turn_frame(c, load(c.normal), r.turned)
    t.overlap, t.closing = r.overlap, r.closing
    store(c.impulse, add(load(c.impulse), load(r.impulse)))
    c.normal_work += r.normal_work
    c.friction_work += r.friction_work
    c.duration += r.time
