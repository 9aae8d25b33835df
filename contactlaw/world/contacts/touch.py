"""A contact from touch to parting: its slot, frame, force and work, and the impulses on its bodies."""

from contactlaw.jit import jit_inline, jit_module
from contactlaw.laws import speeds
from contactlaw.laws.ellipse import share_along
from contactlaw.laws.hertz import BY_ITSELF, greatest_overlap, hertz_stiffness
from contactlaw.laws.record import OPEN
from contactlaw.laws.step import reset
from contactlaw.memory import set_whole, whole_at
from contactlaw.pair import DEEPEST
from contactlaw.world.bodies.motion import JUMP, kick, moved_at, velocity_at
from contactlaw.world.contacts import force
from contactlaw.world.contacts.ends import damped_end, elastic_end, single_end
from contactlaw.world.contacts.meeting import meet_closed
from contactlaw.world.contacts.pace import MASS_TURN, radius_where, share_of, update_masses
from contactlaw.world.contacts.springs import SHARE, closing_by_others, damper_weight, press_spring
from contactlaw.world.data.access import body_at, contact_at, guard_at, near_at, pair_at, shape_at
from contactlaw.world.data.call import address, call_roll, ready
from contactlaw.world.data.demand import ROLL
from contactlaw.world.data.materials import friction_of, law_of, memory_of, speed_numbers
from contactlaw.world.data.quaternion import rotate
from contactlaw.world.data.records import CLOSED, FREE, NEVER, PARTED, RESIZED
from contactlaw.world.data.saved import CONTACT_NUMBERS, LEDGER_NUMBER, contact_fields
from contactlaw.world.data.vec import ZERO, add, axpy, cross, dot, load, norm, scale, store, sub, tangent
from contactlaw.world.shapes import geometry
from contactlaw.world.trees.mobility import clear

# [rad] up to which the tangent turns by the first term of the series x, and is normalised by that of a root: its square
# is then 1 - 3/4 x^4, which `state.UNIT` must allow
SMALL_TURN = 1e-3
# least s of `ends.single_end` as a damped force ends: the correction is then at most 3.7 substeps of the force before
# it, whatever has torn the bodies apart
SUDDEN = 0.02
# share of a substep for which an impact may have been under way and yet begins at its end: what `ends` adds for a
# damper grows out of a force that is nearly zero there, and is lost if the step ends with this substep
BARELY = 1e-3
JUMP_SHARE = 0.1  # of a way, by which an overlap may grow more than by the motion along the normal; see `jump_of`
TOUCHING = 1e-10  # overlap or gap that counts as zero, over the effective radius


def begin_contact(w, k, overlap):
    """Give near pair k a contact, with overlap [m] <= 0 before the touch; returns whether there was a free slot.

    The overlap is positive if the pair overlaps already when it is first looked at. If it exceeds
    `initial_overlap_limit`, the user has built or moved the shapes into each other: if the pair is relaxed, this
    initial overlap counts as none from then on. It shrinks with the overlap while the contact is open and never grows,
    so that it gives no energy. So do edges over a face, listed as they come to its border, and what is found late.
    """
    q = near_at(w.near, k)
    sa, sb = shape_at(w.shapes, q.a), shape_at(w.shapes, q.b)
    a, b = body_at(w.bodies, q.body_a), body_at(w.bodies, q.body_b)
    now, n, arm_a, arm_b = geometry.meet_near(w, q, a, b)
    radius, along = radius_where(w, q, a, b, n, arm_a, arm_b)
    if q.places > 1 and now < -TOUCHING * radius:  # another pair of both has just taken this place
        q.gap = -now
        return False
    if q.slot < 0:
        if w.spares == 0:
            w.lost += 1
            return False
        q.slot = new_slot(w)
    q.closed = 1
    for i in range(q.first, q.first + q.places):  # others of both now look for other places
        other = near_at(w.near, i)
        if other.closed == 0:
            other.listed_gap, other.path_limit, other.checked, other.toi = -NEVER, -1.0, -1.0, 0.0
    c = contact_at(w.contacts, q.slot)
    link, before = c.link, c.initial_overlap
    clear(contact_fields(w, q.slot, 0, LEDGER_NUMBER))
    c.phase, c.near, c.link, c.initial_overlap = CLOSED, k, link, before
    c.shape_a, c.shape_b, c.body_a, c.body_b, c.pair = q.a, q.b, q.body_a, q.body_b, q.pair
    c.touches += 1
    t = c.touch
    law = law_of(w, pair_at(w.pairs, q.pair))
    reset(t, law, radius)
    t.share = share_of(t, sa, sb)
    t.e_star, t.g_star, t.stiffness = t.share * t.e_star, t.share * t.g_star, t.share * t.stiffness
    clear(memory_of(w, q.slot))  # else what the last contact here left would show in saved states
    t.mu = friction_of(pair_at(w.pairs, q.pair), sa, sb)
    t.friction = t.mu
    store(c.normal, n)
    store(c.tangent, tangent(n))
    store(c.arm_a, arm_a)
    store(c.arm_b, arm_b)
    if law.sectors != 0.0 and dot(along, along) > 0.0:
        set_ellipse(c, along, norm(along))
    update_masses(c, a, b)
    deep = pair_at(w.pairs, q.pair).relaxed != 0 and overlap > initial_overlap_limit(w, c)
    if overlap > TOUCHING * radius and not is_placed(w, a, b):
        w.late, w.latest, c.appeared, deep = w.late + 1, max(w.latest, overlap), 1, True
    if deep or (overlap > 0.0 and geometry.lies_over_face(sa, a, sb, b, 0.0)):
        c.initial_overlap, overlap = geometry.set_initial_overlap(w, q, c.initial_overlap + overlap), 0.0
    t.overlap, t.before = overlap, overlap
    slide = sub(velocity_at(a, arm_a), velocity_at(b, arm_b))
    t.closing = -dot(slide, n)
    if law.speeds != 0.0:
        push = -dot(sub(load(a.acceleration), load(b.acceleration)), n)
        speeds.read(t, speed_numbers(w, pair_at(w.pairs, q.pair)), push, norm(axpy(t.closing, n, slide)))
    if overlap > TOUCHING * t.radius:
        force.advance_contact(w, c, q.slot, ZERO, ZERO, 0.0, BY_ITSELF)
        store(c.force, scale(t.force, n))
        c.closing_acceleration = -t.force / t.mass
    return True


def new_slot(w):
    """Take a free slot for a contact, a record of zeros; return its number. Released slots are taken again first."""
    w.spares -= 1
    slot = whole_at(w.spare, w.spares)
    w.slots = max(w.slots, slot + 1)
    clear(contact_fields(w, slot, 0, CONTACT_NUMBERS))
    return slot


def initial_overlap_limit(w, c):
    """Return the overlap [m] at first contact above which it cannot come from motion; zero after shapes were resized.

    Above it Hertz's theory does not hold, or the elastic energy would accelerate the bodies to more than JUMP. The
    radius of shape A counts too: the effective radius of a capsule's crowned side is metres.
    """
    s, t = shape_at(w.shapes, c.shape_a), c.touch
    least = min(s.radius, t.radius) if s.radius > 0.0 else t.radius
    fast = greatest_overlap(hertz_stiffness(t), t.mass, 0.0, JUMP)
    return min(DEEPEST * least, fast) if w.edited < RESIZED else 0.0


def release_if_put_deeper(w, p):
    """Release the contact of a closed pair if the user has moved its shapes deep into each other.

    `begin_contact` then gives the pair a new contact.
    """
    c = contact_at(w.contacts, p.slot)
    a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
    overlap, _, _, _ = geometry.meet_near(w, p, a, b)
    deeper = overlap - c.touch.overlap
    if pair_at(w.pairs, p.pair).relaxed != 0 and deeper > max(initial_overlap_limit(w, c), TOUCHING * c.touch.radius):
        release(w, p.slot)
        p.slot, p.closed, p.initial_overlap, w.stale = -1, 0, 0.0, 1


def set_ellipse(c, along, length):
    """Make a new contact elliptic, its first tangent along the longer axis; length: ln(q/p), see `share_along`."""
    n, t = load(c.normal), c.touch
    e = axpy(-dot(along, n), n, along)
    size = norm(e)
    if size > 0.0:
        store(c.tangent, scale(1.0 / size, e))
        t.skew = 2.0 * (1.0 - t.g_star / t.e_star) * share_along(length)


def update_geometry(w, c):
    """Set overlap, frame and arms of a closed contact after one of its shapes was placed anew, not by motion."""
    a, b = body_at(w.bodies, c.body_a), body_at(w.bodies, c.body_b)
    overlap, n, arm_a, arm_b = geometry.meet(shape_at(w.shapes, c.shape_a), a, shape_at(w.shapes, c.shape_b), b)
    turn_frame(c, n, 0.0)
    store(c.arm_a, arm_a)
    store(c.arm_b, arm_b)
    c.touch.overlap = overlap - c.initial_overlap
    store(c.force, force_of(c))


def end_contact(q, c):
    """Open a contact. Its slot is kept until the next step, or as long as it has an initial overlap."""
    q.closed, q.initial_overlap = 0, c.initial_overlap
    q.gap = max(-c.touch.overlap, 0.0)
    c.phase = PARTED
    store(c.force, (0.0, 0.0, 0.0))
    c.touch.state, c.touch.force, c.touch.f, c.touch.g = OPEN, 0.0, 0.0, 0.0
    c.torsion.moment = 0.0
    c.bend[0], c.bend[1], c.bending[0], c.bending[1] = 0.0, 0.0, 0.0, 0.0
    if c.initial_overlap > 0.0:
        c.touch.overlap = 0.0


def update_initial_overlap(w, p):
    """Reduce the initial overlap of an open pair to the present overlap; returns whether some is left."""
    c = contact_at(w.contacts, p.slot)
    if c.initial_overlap > 0.0:
        a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
        sa, sb = shape_at(w.shapes, p.a), shape_at(w.shapes, p.b)
        overlap, _, _, _ = geometry.meet_place(w, p, a, b) if p.places > 1 else geometry.meet(sa, a, sb, b)
        before = c.initial_overlap
        parts_unlisted = p.guard >= 0 and guard_at(w.guards, p.guard).unlisted != 0
        if geometry.is_ignored(p) and parts_unlisted:
            if overlap > -geometry.BACK * (sa.radius + sb.radius):
                return True
            overlap, w.stale = 0.0, 1
        c.initial_overlap = geometry.set_initial_overlap(w, p, max(min(before, overlap), 0.0))
        if geometry.is_ignored(p):
            p.listed_gap = NEVER  # so that its guard keeps it from being measured
        elif c.initial_overlap < before:  # and so is the gap, by as much: what is known of it no longer holds
            p.listed_gap, p.checked = -NEVER, -1.0
    return c.initial_overlap > 0.0


def has_parted(p):
    """Return whether a near pair has the slot of a contact that parted in this step and leaves no initial overlap."""
    return p.slot >= 0 and p.closed == 0 and p.initial_overlap == 0.0


def release(w, slot):
    """Free the slot of a contact; its ledger is added to that of its pair of materials."""
    c = contact_at(w.contacts, slot)
    c.phase = FREE
    w.deepest = max(w.deepest, c.deepest / c.touch.radius)
    add_to_ledger(c, pair_at(w.pairs, c.pair).ledger)
    set_whole(w.spare, w.spares, slot)
    w.spares += 1


def add_to_ledger(c, ledger_io):
    """Add the sums of a contact to a ledger, see `records.PAIR`."""
    ledger_io[0] += c.touches
    ledger_io[1] = max(ledger_io[1], c.deepest)
    ledger_io[2] = max(ledger_io[2], c.strongest)
    ledger_io[3] += c.duration
    ledger_io[4] += c.normal_work
    ledger_io[5] += c.friction_work


@jit_inline
def turn_frame(c, n, twist):
    """Turn a contact's frame to normal n: the tangent turns with it without twist, then by `twist` [rad] about it."""
    old = load(c.normal)
    if twist == 0.0 and n == old:
        return
    e = load(c.tangent)
    e = axpy(-dot(e, n) / max(1.0 + dot(n, old), 1e-300), add(n, old), e)
    e = axpy(twist, cross(n, e), e) if abs(twist) < SMALL_TURN else rotate(scale(twist, n), e)
    e = axpy(-dot(e, n), n, e)
    store(c.tangent, scale(1.5 - 0.5 * dot(e, e), e))
    store(c.normal, n)


@jit_inline
def is_placed(w, a, b):
    """Return whether the overlap of two bodies may be as the user has made it since the last step."""
    return a.placed + b.placed != 0 or w.edited != 0


@jit_inline
def jump_of(c, overlap, normals, moved, way):
    """Return by how much [m] the overlap has grown without motion, where a contact jumps to another place.

    That counts as initial overlap: the elastic energy, which depends on the rest alone, grows by no more than the work
    of the motion. The overlap of a place that lasts grows by the motion along a normal between its last and its new
    one, up to errors of third order in `moved` [m], the motion of the points that touched, and `way`, of the centres.
    """
    jump = overlap - c.initial_overlap - max(c.touch.overlap, 0.0) + min(dot(moved, normals[0]), dot(moved, normals[1]))
    if jump <= TOUCHING * c.touch.radius:
        return 0.0
    return jump if jump > JUMP_SHARE * (norm(moved) + norm(way)) else 0.0


@jit_inline
def measure(w, c, a, b):
    """Update overlap, frame, arms and displacement of a contact after its bodies have moved.

    Callers loop over all contacts before they call `advance`: in one loop, contacts would wait for the square roots and
    divisions of the law of the contact before.
    """
    overlap, n, arm_a, arm_b = meet_closed(w, c, a, b)
    t, old = c.touch, load(c.normal)
    mean_a, mean_b = scale(0.5, add(arm_a, load(c.arm_a))), scale(0.5, add(arm_b, load(c.arm_b)))
    moved = sub(moved_at(a, mean_a), moved_at(b, mean_b))
    turn_frame(c, n, 0.5 * dot(add(load(a.twist), load(b.twist)), n))
    store(c.arm_a, arm_a)
    store(c.arm_b, arm_b)
    if n != old and dot(n, old) < 1.0 - 0.5 * MASS_TURN * MASS_TURN:
        update_masses(c, a, b)
    e = load(c.tangent)
    f = cross(n, e)
    store(c.moved, (dot(moved, e), dot(moved, f), force.twist_of(c, a, b)))
    jump = jump_of(c, overlap, (old, n), moved, sub(load(a.shift), load(b.shift)))
    if jump > 0.0 and not is_placed(w, a, b):
        c.initial_overlap, c.appeared = c.initial_overlap + jump, 1
    near_at(w.near, c.near).initial_overlap = c.initial_overlap
    law = law_of(w, pair_at(w.pairs, c.pair))
    if law.rolling != 0.0:
        rolled = sub(load(a.twist), load(b.twist))
        c.rolled[0], c.rolled[1] = dot(rolled, e), dot(rolled, f)
    t.before = t.overlap
    t.overlap = overlap - c.initial_overlap
    press_spring(c, a, b, law.linear != 0.0)


@jit_inline
def advance(w, c, slot, span):
    """Update the force, the end weight and the ledger of the contact in a slot, after `measure`.

    span: lengths [s] of this substep and of the next.
    """
    h, following = span
    t, moved = c.touch, load(c.moved)
    a, b = body_at(w.bodies, c.body_a), body_at(w.bodies, c.body_b)
    before, overlap = t.before, t.overlap
    c.end_weight = 0.0
    law = law_of(w, pair_at(w.pairs, c.pair))
    linear = law.linear != 0.0
    if before < 0.0 < overlap < BARELY * (overlap - before):
        return
    if overlap <= 0.0:
        if before > 0.0 and t.zeta == 0.0 and c.interval > 0.0:
            c.end_weight = elastic_end(before / (before - overlap), linear)
            store(c.force, force_of(c))
        add_work(c, 0.5 + c.end_weight, overlap - before, moved)
        return
    add_work(c, 0.5, overlap - before, moved)
    pushed = t.force, t.f, t.g
    closing = (overlap - before) * (1.0 / h)  # products by quotients that are known before the overlap is
    own = t.force / t.mass
    if c.interval > 0.0:
        c.closing_acceleration = (closing - t.closing) * (2.0 / (h + c.interval))
    else:
        c.closing_acceleration = -dot(sub(load(a.acceleration), load(b.acceleration)), load(c.normal)) - own
    t.closing = closing
    opening = t.force == 0.0 and c.interval == 0.0
    total = moved
    if c.coasted_from > 0.0:
        total, t.before, c.coasted_from = add(moved, load(c.coasted)), c.coasted_from, 0.0
    others = closing_by_others(c, a, b)
    side_by_side = max(max(a.pressing if a.still == 0 else 1, b.pressing if b.still == 0 else 1), 1)  # dampers
    weight = damper_weight(c, a, b, side_by_side) if t.zeta > 0.0 and side_by_side > 1 else 1.0
    motion = others, side_by_side, SHARE * h * h * (others - c.spring / t.mass), weight
    pressed = force.advance_contact(w, c, slot, total, scale(1.0 / h, moved), h, motion)
    if opening:
        inside = min(overlap / (overlap - min(before, 0.0)), 1.0)
        spacing = max(following, inside * h)  # of the points of the sum that begins here
        inside *= h / spacing
        end = elastic_end(inside, linear)
        if t.zeta > 0.0 and t.ratio > 1.0:
            end = damped_end(inside, linear) * (1.0 - 1.0 / t.ratio) + single_end(inside, linear) / t.ratio
        c.end_weight = (spacing * (1.0 + end) - 0.5 * (h + following)) / h
    if pressed < 0.0 and own > 0.0:  # the force has ended within the substep
        weight = single_end(max(pushed[0] / (pushed[0] - pressed), SUDDEN), True)
        store(c.force, in_frame(c, *pushed))  # at its present arms it would turn round bodies in its earlier direction
        apply_force(c, a, b, weight * h)
        c.normal_work -= weight * pushed[0] * (overlap - before)
        c.friction_work -= weight * (pushed[1] * moved[0] + pushed[2] * moved[1])
    store(c.force, force_of(c))
    c.interval = h
    if law.rolling != 0.0 and ready(w, ROLL):
        call_roll(address(w, ROLL), w, c, (c.rolled[0] / h, c.rolled[1] / h))
    add_work(c, 0.5 + c.end_weight, overlap - before, moved)
    c.deepest = max(c.deepest, overlap)
    c.strongest = max(c.strongest, t.force)
    if t.force > 0.0:
        c.duration += h


@jit_inline
def add_work(c, share, gained, moved):
    """Add the work of a share of a contact's force and moments on the bodies to its ledger.

    gained: increase of the overlap [m]. moved: displacement along both tangents [m], and rotation about the normal
    [rad].
    """
    t = c.touch
    du, dv, angle = moved
    c.normal_work -= share * t.force * gained
    c.friction_work -= share * (t.f * du + t.g * dv + c.torsion.moment * angle)
    c.friction_work -= share * (c.bending[0] * c.rolled[0] + c.bending[1] * c.rolled[1])


@jit_inline
def force_of(c):
    """Return the force on A [N], in the contact's present frame."""
    return in_frame(c, c.touch.force, c.touch.f, c.touch.g)


@jit_inline
def in_frame(c, p, f, g):
    """Return the force on A [N] of which a contact has these components: P, and friction along both tangents on B."""
    n, e = load(c.normal), load(c.tangent)
    return axpy(p, n, axpy(-f, e, scale(-g, cross(n, e))))


@jit_inline
def apply_force(c, a, b, time):
    """Apply the force and moment of a contact to both bodies for a time [s], equal and opposite, at one point."""
    impulse = scale(time, load(c.force))
    a.touched = 1
    b.touched = 1
    about_a, about_b = cross(load(c.arm_a), impulse), cross(impulse, load(c.arm_b))
    if c.torsion.moment != 0.0 or c.bending[0] != 0.0 or c.bending[1] != 0.0:
        moment = scale(time, force.moment_of(c))
        about_a, about_b = sub(about_a, moment), add(about_b, moment)
    kick(a, impulse, about_a)
    kick(b, scale(-1.0, impulse), about_b)
    store(c.impulse, add(load(c.impulse), impulse))


jit_module(__name__)
