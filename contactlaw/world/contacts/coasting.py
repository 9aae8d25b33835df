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
from contactlaw.world.bodies.motion import kick_round
from contactlaw.world.contacts.force import (
    TORSION_EVERY,
    dashpot_of,
    has_dashpot,
    is_quasi_static,
    slide_to_slip,
    spin_mobility,
    torsion_time,
    way_through,
)
from contactlaw.world.contacts.leapfrog import UNKNOWN, side_by_side
from contactlaw.world.contacts.pace import closing_speed, longest_substep, substeps_per_impact
from contactlaw.world.contacts.substep import turn_frame
from contactlaw.world.data.access import body_at, coasting_at, contact_at, near_at, pair_at
from contactlaw.world.data.materials import law_of
from contactlaw.world.data.records import COASTING, NEVER
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
    store(r.tangent, e)
    store(r.side, cross(n, e))
    r.radius_a, r.radius_b = -dot(load(c.arm_a), n), dot(load(c.arm_b), n)
    r.tilting = 1.0 / (r.radius_a + r.radius_b) if a.inverse_mass * b.inverse_mass > 0.0 else 0.0
    apart, place = places_of(r, a, b)
    store(r.start, place)
    r.start_a = dot(load(a.pending_turn), n)
    r.first = r.overlap = t.overlap
    r.reach, r.force = apart[0] + t.overlap, t.force
    r.stiffness, damping = hertz_stiffness(t), damping_of(t, False, t.stiffness * sqrt(t.overlap))
    count, alone = side_by_side(a, b), 0.5 * damping * h / t.mass  # solved for the damper as in `hertz.normal_force`
    share = 1.0 / (1.0 + count * alone)
    r.lag, r.beside = 1.0 - share, (count - 1.0) * alone * share
    r.share, r.late = share + r.beside, 0.5 * share * damping / h
    r.carried = carried_of(r, t.force, h * t.closing, elastic_force(t, False, t.overlap))
    r.spring, r.drag, r.friction = stuck_stiffness(t), 0.0, t.friction
    r.longest = min(turning_time(c, a, b) if is_quasi_static(c, 1.0) else longest, torsion_time(w, c) - 2.0 * h)
    r.furthest = longest_slide(t) ** 2
    if has_dashpot(w, c):
        r.drag = dashpot_of(t, r.spring, (count - 1.0) * h) / h
    begin_torsion(w, c, r, h)
    add_passed(c, r, -1.0)
    store(r.pull, (t.f, t.g, c.torsion.moment))
    slid = scale(-h / c.interval, load(c.moved))
    store(r.held, springs_of(r, load(r.pull), (0.0, 0.0, c.pending_twist), slid))
    store(r.moved, ZERO)
    store(r.impulse, ZERO)
    r.normal_work, r.friction_work, r.time = 0.0, 0.0, 0.0


def begin_torsion(w, c, r, h):
    """Set the torsion of a model that begins: spring, dashpot and limit; h: length of substeps [s]."""
    t = c.touch
    r.torsion, r.torsion_drag, r.torsion_limit = 0.0, 0.0, 0.0
    if c.torsion.span == 0.0:
        return
    radius = sqrt(t.radius * t.overlap)
    r.torsion = torsion.stuck_stiffness(law_of(w, pair_at(w.pairs, c.pair)).g_t, radius)
    # what sliding leaves, if it slides that far: else, as friction falls, springs would be softer than the law
    slides = r.longest * sqrt(c.moved[0] ** 2 + c.moved[1] ** 2) > c.interval * slide_to_slip(t, t.friction)
    r.torsion_limit = torsion.FULL * radius * (c.torsion.friction if slides else t.mu)
    if r.drag != 0.0:
        r.torsion_drag = 2.0 * sqrt(r.torsion * (1.0 / spin_mobility(w, c, load(c.normal)))) / h


def add_passed(c, r, sign):
    """Add the way of the surfaces through a contact since their bodies' `pending_turn` was zero, times a sign."""
    turned = sub(load(body_at(r.body_a, 0).pending_turn), load(body_at(r.body_b, 0).pending_turn))
    way = way_through(c, turned)
    for i in range(2):
        c.torsion.passed[i] += sign * way[i]


@jit_inline
def places_of(r, a, b):
    """Return A's centre over B's along normal and tangents [m]; and along both tangents A's contact point over B's [m],
    and A's turn over B's about the normal [rad], but for constants. Both arms are along the normal.
    """
    n, e, f = load(r.normal), load(r.tangent), load(r.side)
    apart, turn_a, turn_b = sub(load(a.position), load(b.position)), load(a.pending_turn), load(b.pending_turn)
    turn, u, v = axpy(r.radius_a, turn_a, scale(r.radius_b, turn_b)), dot(apart, e), dot(apart, f)
    return (dot(apart, n), u, v), (u - dot(turn, f), v + dot(turn, e), dot(sub(turn_a, turn_b), n))


@jit_inline
def carried_of(r, force, gained, elastic):
    """Return what this substep's force [N], gain of overlap [m] and elastic force [N] add to the next one's force."""
    return r.lag * force - r.late * gained - r.beside * elastic


@jit_inline
def springs_of(r, held, moved, slid):
    """Return the forces along both tangents [N] and the moment [N m] of springs and dashpots on B.

    held: those of springs at the start. moved: since then, slid: in this substep; as `r.moved`.
    """
    return (
        held[0] + r.spring * moved[0] + r.drag * slid[0],
        held[1] + r.spring * moved[1] + r.drag * slid[1],
        held[2] + r.torsion * moved[2] + r.torsion_drag * slid[2],
    )


@jit_inline
def slipped(r, force, moved, pull):
    """Return what friction holds of the forces and the moment of `springs_of` under a force P [N]: the rest slips."""
    u, v, moment = pull
    square, limit, most = u * u + v * v, r.friction * force, r.torsion_limit * force
    if square > limit * limit:
        part = limit / sqrt(square)
        u, v = part * u, part * v
        r.held[0], r.held[1] = u - r.spring * moved[0], v - r.spring * moved[1]
    if abs(moment) > most:
        moment = copysign(most, moment)
        r.held[2] = moment - r.torsion * moved[2]
    return u, v, moment


def advance_coasting(w, pairs, coasting, span, may_coast):
    """Advance coasting contacts by the last substep and kick their bodies; return how many coast on.

    Those that leave the range of the model, or all unless `may_coast`, join the island's list of `pairs` again, and the
    next substep advances their laws by the whole displacement. span: lengths [s] of the last substep and of the next.
    """
    h, next_h = span
    time, i = 0.5 * (h + next_h), 0
    while i < coasting:
        r = coasting_at(w.coasting, i)
        a, b = body_at(r.body_a, 0), body_at(r.body_b, 0)
        (away, across, beside), place = places_of(r, a, b)
        tilt_e, tilt_f, moved = r.tilting * across, r.tilting * beside, sub(place, load(r.start))
        overlap = r.reach - away - 0.5 * (tilt_e * across + tilt_f * beside)
        gained, slid = overlap - r.overlap, sub(moved, load(r.moved))
        elastic = r.stiffness * overlap * sqrt(max(overlap, 0.0))
        force = max(r.share * elastic + 3.0 * r.late * gained + r.carried, 0.0)
        pull = slipped(r, force, moved, springs_of(r, load(r.held), moved, slid))
        r.carried = carried_of(r, force, gained, elastic)
        r.normal_work -= (r.force + force) * gained
        r.friction_work -= dot(add(load(r.pull), pull), slid)
        r.overlap, r.force = overlap, force
        store(r.moved, moved)
        store(r.pull, pull)
        r.time += h
        n, e, f = load(r.normal), load(r.tangent), load(r.side)
        parts = scale(time, (force, force * tilt_e - pull[0], force * tilt_f - pull[1]))
        store(r.impulse, add(load(r.impulse), parts))
        impulse = axpy(parts[0], n, axpy(parts[1], e, scale(parts[2], f)))
        u, v, moment = scale(time, pull)
        turning, twisting = axpy(u, f, scale(-v, e)), scale(moment, n)
        kick_round(a, impulse, axpy(r.radius_a, turning, scale(-1.0, twisting)))
        kick_round(b, scale(-1.0, impulse), axpy(r.radius_b, turning, twisting))
        in_range = LEAST * r.first <= overlap <= MOST * r.first
        if may_coast and in_range and r.time < r.longest and moved[0] * moved[0] + moved[1] * moved[1] < r.furthest:
            i += 1
            continue
        end_coasting(w, r, gained / h, 0.5 * time)
        set_whole(w.island_pairs, pairs, r.near)
        pairs, coasting = pairs + 1, coasting - 1
        copy_wholes(w.coasting + SIZE * coasting, w.coasting + SIZE * i, SIZE // 8)
    return coasting


def end_coasting(w, r, closing, later):
    """Write the model of a contact that stops coasting back; closing: speed [m/s]; later: see `CONTACT.later` [s]."""
    p, n, e, f = near_at(w.near, r.near), load(r.normal), load(r.tangent), load(r.side)
    c, a = contact_at(w.contacts, p.slot), body_at(r.body_a, 0)
    t, turn_a = c.touch, dot(load(a.pending_turn), n) - r.start_a
    c.coasted_from = r.first
    add_passed(c, r, 1.0)
    store(c.coasted, load(r.moved))
    turn_frame(c, n, turn_a - 0.5 * r.moved[2])
    t.overlap, t.closing, c.neighbours = r.overlap, closing, UNKNOWN
    t.force, t.elastic = r.force, r.stiffness * r.overlap * sqrt(max(r.overlap, 0.0))
    c.coasted_f, c.coasted_g, pull = t.f, t.g, axpy(r.pull[0], e, scale(r.pull[1], f))
    t.f, t.g = dot(pull, load(c.tangent)), dot(pull, cross(n, load(c.tangent)))
    impulse = axpy(r.impulse[0], n, axpy(r.impulse[1], e, scale(r.impulse[2], f)))
    store(c.impulse, add(load(c.impulse), impulse))
    c.normal_work += 0.5 * r.normal_work
    c.friction_work += 0.5 * r.friction_work
    c.torsion.moment = r.pull[2]
    c.duration += r.time
    c.later = later


jit_module(__name__)
