"""Coasting: a cheap model of contacts that hardly change from substep to substep, without their laws and shapes.

While a contact coasts, arms and tangential stiffness are held, and P = k x^1.5 plus the damper. As balls turn about
each other, the normal follows by the first term of the series and the overlap x by the second: work and stored energy
agree. Where both ignored the turning, a pack that was pressed lost 1 % of the work on it. Tangentially the contact is
one spring of Mindlin's stiffness 2 G* a, which begins with the present force and slips at mu P, and about the normal
one of 16/3 G_t a^3 that slips at 3 pi/16 mu P a, with the law's dashpots: a moment that was held instead came late, and
kept heaps that rest humming by 10 um/s. Afterwards the law is advanced by the whole displacement at once. Springs are
never softer than the law: in loading they take no less energy than the law stores, in unloading they give back no more.
Each contact coasts as long as this holds.
"""

from math import copysign, sqrt

from contactlaw.jit import jit_inline, jit_module
from contactlaw.laws import torsion
from contactlaw.laws.hertz import damping_of, elastic_force, hertz_stiffness
from contactlaw.laws.record import LASTING, SPUN
from contactlaw.laws.slip import stuck_stiffness
from contactlaw.memory import copy_wholes, set_whole, whole_at
from contactlaw.world.bodies.motion import kick
from contactlaw.world.contacts.force import (
    TORSION_EVERY,
    dashpot_of,
    has_dashpot,
    is_quasi_static,
    slide_to_slip,
    spin_mobility,
    torsion_time,
)
from contactlaw.world.contacts.leapfrog import UNKNOWN, side_by_side
from contactlaw.world.contacts.pace import closing_speed, longest_substep, substeps_per_impact
from contactlaw.world.contacts.substep import turn_frame
from contactlaw.world.data.access import body_at, coasting_at, contact_at, near_at, pair_at
from contactlaw.world.data.materials import law_of
from contactlaw.world.data.records import COASTING, COASTS, NEVER
from contactlaw.world.data.saved import body_address
from contactlaw.world.data.vec import ZERO, add, axpy, cross, dot, load, norm, scale, store, sub

# Roots of m delta/P in which a contact must be expected to hardly change: 0.4 durations of an impact. An impact changes
# by CHANGE in 0.9 of them even where it is deepest, so it never coasts: a billiard break converges with its substeps
STEADY = 1.3
CHANGE = 0.4  # changes of overlap and friction while a contact coasts, at most: share of the overlap and of mu P
LEAST, MOST = 0.65, 1.5  # range of the overlap, over that at the start
TURNING = 0.02  # change of the overlap by turning of the normal, at most: share of the overlap
FULL = 0.98  # share of mu P from which a friction force counts as the limit
SIZE = COASTING.itemsize


def start_coasting(w, pairs, coasting, h):
    """Let contacts of an island coast that hardly change: of `pairs` in its list, which they leave; return how many do.

    coasting: how many coast already. h: length of substeps [s].
    """
    left = 0
    for i in range(pairs):
        k = whole_at(w.island_pairs, i)
        p = near_at(w.near, k)
        if p.closed != 0 and has_model(w, p):
            c = contact_at(w.contacts, p.slot)
            t, time = c.touch, steady_time(c, body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b))
            if time * time * t.force > STEADY * STEADY * t.mass * t.overlap:
                begin_coasting(w, k, coasting_at(w.coasting, coasting), h, time)
                p.active = COASTS
                coasting += 1
                continue
        set_whole(w.island_pairs, left, k)
        left += 1
    return coasting


def has_model(w, p):
    """Return whether a closed contact can coast: it lasts, without rolling resistance or fast torsion, on round bodies.

    Its law must know what it moved while it coasted before: a start in between would lose that.
    """
    c, law = contact_at(w.contacts, p.slot), law_of(w, pair_at(w.pairs, p.pair))
    t = c.touch
    if t.state == SPUN or t.course != LASTING or t.overlap <= 0.0 or c.coasted_from > 0.0 or t.skew != 0.0:
        return False
    plain = law.sectors != 0.0 and law.rolling == 0.0 and TORSION_EVERY * c.interval < torsion_time(w, c)
    return plain and is_round(body_at(w.bodies, p.body_a)) and is_round(body_at(w.bodies, p.body_b))


def steady_time(c, a, b):
    """Return the time [s] in which overlap, (v + a t/2) t, normal and friction are expected to hardly change."""
    speed, change = abs(closing_speed(c, a, b)), CHANGE * c.touch.overlap
    root = sqrt(speed * speed + 2.0 * abs(c.closing_acceleration) * change)
    time = min(2.0 * change / max(speed + root, 1e-300), turning_time(c, a, b))
    slid = sqrt(c.moved[0] ** 2 + c.moved[1] ** 2)
    return min(time, longest_slide(c.touch) * c.interval / max(slid, 1e-300))


def turning_time(c, a, b):
    """Return the time [s] in which turning of the normal changes the overlap by the share TURNING, see `tilting`."""
    n, velocity = load(c.normal), sub(load(a.velocity), load(b.velocity))
    across = norm(axpy(-dot(velocity, n), n, velocity))
    return sqrt(2.0 * TURNING * c.touch.overlap * (norm(load(c.arm_a)) + norm(load(c.arm_b)))) / max(across, 1e-300)


def longest_slide(t):
    """Return the displacement [m] that changes the friction of a stuck contact by CHANGE; NEVER if it slides."""
    limit = t.friction * t.force
    return NEVER if t.f * t.f + t.g * t.g > (FULL * limit) ** 2 else CHANGE * limit / stuck_stiffness(t)


def is_round(b):
    """Return whether a body is kinematic and does not turn, or free, its inertia and shapes the same as it turns."""
    if b.inverse_mass == 0.0:
        return b.tree == 0 and dot(load(b.spin), load(b.spin)) == 0.0
    return b.tree == 0 and b.isotropic != 0 and b.oriented == 0


def begin_coasting(w, k, r, h, longest):
    """Set the model r of pair k's contact, in substeps of h [s]; longest: `r.longest` unless quasi-static."""
    p = near_at(w.near, k)
    c = contact_at(w.contacts, p.slot)
    t, n, e = c.touch, load(c.normal), load(c.tangent)
    r.near = k
    r.body_a, r.body_b = body_address(w.bodies, p.body_a), body_address(w.bodies, p.body_b)
    a, b = body_at(r.body_a, 0), body_at(r.body_b, 0)
    r.pace = longest_substep(w, c, a, b, substeps_per_impact(w, p, False))
    a.touched, b.touched = 1, 1
    store(r.normal, n)
    r.radius_a, r.radius_b = -dot(load(c.arm_a), n), dot(load(c.arm_b), n)
    r.tilting = 1.0 / (r.radius_a + r.radius_b) if a.inverse_mass * b.inverse_mass > 0.0 else 0.0
    store(r.start, place_of(r, a, b))
    r.start_a = dot(load(a.pending_turn), n)
    r.start_turn = r.start_a - dot(load(b.pending_turn), n)
    r.first = r.overlap = t.overlap
    r.closing, r.force = t.closing, t.force
    r.stiffness, r.elastic = hertz_stiffness(t), elastic_force(t, False, t.overlap)
    r.damping = damping_of(t, False, t.stiffness * sqrt(t.overlap))
    count, alone = side_by_side(a, b), 0.5 * r.damping * h / t.mass  # solved for the damper as in `hertz.normal_force`
    r.share = 1.0 / (1.0 + count * alone)
    r.beside = (count - 1.0) * alone * r.share
    r.spring, r.drag, r.friction = stuck_stiffness(t), 0.0, t.friction
    side = cross(n, e)
    store(r.pull, axpy(t.f, e, scale(t.g, side)))
    store(r.held, load(r.pull))
    if has_dashpot(c):
        r.drag = dashpot_of(t, r.spring, (count - 1.0) * h)
        sliding = axpy(c.moved[0], e, scale(c.moved[1], side))
        store(r.held, axpy(-r.drag / c.interval, sliding, load(r.pull)))
    r.longest = min(turning_time(c, a, b) if is_quasi_static(c, 1.0) else longest, torsion_time(w, c) - 2.0 * h)
    begin_torsion(w, c, r)
    r.furthest = longest_slide(t)
    store(r.slide, ZERO)
    store(r.impulse, ZERO)
    r.normal_work, r.friction_work, r.time = 0.0, 0.0, 0.0


def begin_torsion(w, c, r):
    """Set the torsion of a model that begins: spring, dashpot and limit."""
    t = c.touch
    r.turn, r.moment, r.twisted = 0.0, c.torsion.moment, c.torsion.moment
    r.torsion, r.torsion_drag, r.torsion_limit = 0.0, 0.0, 0.0
    if c.torsion.span == 0.0:
        return
    radius = sqrt(t.radius * t.overlap)
    r.torsion = torsion.stuck_stiffness(law_of(w, pair_at(w.pairs, c.pair)).g_t, radius)
    # what sliding leaves, if it slides that far: else, as friction falls, springs would be softer than the law
    slides = r.longest * sqrt(c.moved[0] ** 2 + c.moved[1] ** 2) > c.interval * slide_to_slip(t)
    r.torsion_limit = torsion.FULL * radius * (c.torsion.friction if slides else t.mu)
    if r.drag != 0.0:
        r.torsion_drag = torsion.critical_dashpot(r.torsion, 1.0 / spin_mobility(w, c))
    r.twisted += r.torsion * c.pending_twist - r.torsion_drag * c.moved[2] / c.interval


@jit_inline
def torsion_at(r, turn, rate):
    """Return the moment on B [N m] as A has turned over B by an angle since the start [rad]; the spring slips at most.

    rate: 1/h [1/s].
    """
    most = r.torsion_limit * r.force
    moment = r.twisted + r.torsion * turn + r.torsion_drag * rate * (turn - r.turn)
    if abs(moment) > most:
        moment = copysign(most, moment)
        r.twisted = moment - r.torsion * turn
    return moment


@jit_inline
def place_of(r, a, b):
    """Return the place of A's contact point over B's [m], but for a constant: both arms are along the normal."""
    turn = axpy(r.radius_a, load(a.pending_turn), scale(r.radius_b, load(b.pending_turn)))
    return sub(sub(load(a.position), load(b.position)), cross(turn, load(r.normal)))


def advance_coasting(w, pairs, coasting, span, may_coast):
    """Advance coasting contacts by the last substep and kick their bodies; return how many coast on.

    Those that leave the range of the model, or all unless `may_coast`, join the island's list of `pairs` again, and the
    next substep advances their laws by the whole displacement. span: lengths [s] of the last substep and of the next.
    """
    h, next_h = span
    rate, time, i = 1.0 / h, 0.5 * (h + next_h), 0
    while i < coasting:
        r = coasting_at(w.coasting, i)
        a, b, n = body_at(r.body_a, 0), body_at(r.body_b, 0), load(r.normal)
        moved, apart = sub(place_of(r, a, b), load(r.start)), sub(load(a.position), load(b.position))
        deeper, across = -dot(moved, n), axpy(-dot(apart, n), n, apart)
        tilt = scale(r.tilting, across)
        slide, overlap = axpy(deeper, n, moved), r.first + deeper - 0.5 * dot(tilt, across)
        gained, slid = overlap - r.overlap, sub(slide, load(r.slide))
        closing = rate * gained
        elastic = r.stiffness * overlap * sqrt(max(overlap, 0.0))
        force = elastic + r.damping * (1.5 * closing - 0.5 * r.closing)
        force = max(r.share * force + (1.0 - r.share) * r.force + r.beside * (elastic - r.elastic), 0.0)
        pull = axpy(r.spring, slide, axpy(r.drag * rate, slid, load(r.held)))
        square, limit = dot(pull, pull), r.friction * force
        if square > limit * limit:
            pull = scale(limit / sqrt(square), pull)
            store(r.held, axpy(-r.spring, slide, pull))
        r.normal_work -= 0.5 * (r.force + force) * gained
        r.overlap, r.closing, r.force, r.elastic = overlap, closing, force, elastic
        turn = dot(sub(load(a.pending_turn), load(b.pending_turn)), n) - r.start_turn
        moment = torsion_at(r, turn, rate)
        r.friction_work -= 0.5 * (dot(add(load(r.pull), pull), slid) + (r.moment + moment) * (turn - r.turn))
        r.turn, r.moment = turn, moment
        store(r.slide, slide)
        store(r.pull, pull)
        r.time += h
        impulse = scale(time, axpy(force, add(n, tilt), scale(-1.0, pull)))
        store(r.impulse, add(load(r.impulse), impulse))
        turning, twisting = scale(time, cross(n, pull)), scale(time * moment, n)
        kick(a, impulse, axpy(r.radius_a, turning, scale(-1.0, twisting)))
        kick(b, scale(-1.0, impulse), axpy(r.radius_b, turning, twisting))
        in_range = LEAST * r.first <= overlap <= MOST * r.first and dot(slide, slide) < r.furthest * r.furthest
        if may_coast and in_range and r.time < r.longest:
            i += 1
            continue
        end_coasting(w, r, 0.5 * time)
        set_whole(w.island_pairs, pairs, r.near)
        pairs, coasting = pairs + 1, coasting - 1
        copy_wholes(w.coasting + SIZE * coasting, w.coasting + SIZE * i, SIZE // 8)
    return coasting


def end_coasting(w, r, later):
    """Write the model of a contact that stops coasting back; later: see `CONTACT.later` [s]."""
    p, n = near_at(w.near, r.near), load(r.normal)
    c, a = contact_at(w.contacts, p.slot), body_at(r.body_a, 0)
    t, e = c.touch, load(c.tangent)
    turn_a = dot(load(a.pending_turn), n) - r.start_a
    c.coasted_from = r.first
    store(c.coasted, (dot(load(r.slide), e), dot(load(r.slide), cross(n, e)), r.turn))
    turn_frame(c, n, turn_a - 0.5 * r.turn)
    t.overlap, t.closing, c.neighbours, p.active = r.overlap, r.closing, UNKNOWN, 1
    t.force, t.elastic = r.force, r.stiffness * r.overlap * sqrt(max(r.overlap, 0.0))
    c.coasted_f, c.coasted_g, e = t.f, t.g, load(c.tangent)
    t.f, t.g = dot(load(r.pull), e), dot(load(r.pull), cross(n, e))
    store(c.impulse, add(load(c.impulse), load(r.impulse)))
    c.normal_work += r.normal_work
    c.friction_work += r.friction_work
    c.torsion.moment = r.moment
    c.duration += r.time
    c.later = later


jit_module(__name__)
