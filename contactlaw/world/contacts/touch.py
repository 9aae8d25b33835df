"""How a contact begins and ends: its slot, its initial overlap, its ledger."""

from contactlaw.jit import jit_module
from contactlaw.laws.ellipse import share_along
from contactlaw.laws.hertz import BY_ITSELF, greatest_overlap, hertz_stiffness
from contactlaw.laws.record import OPEN
from contactlaw.laws.step import reset
from contactlaw.losses import set_losses
from contactlaw.memory import set_whole, whole_at
from contactlaw.pair import DEEPEST
from contactlaw.world.bodies.motion import JUMP, velocity_at
from contactlaw.world.contacts import force
from contactlaw.world.contacts.meeting import longer_axis, radius_where, share_of
from contactlaw.world.contacts.pace import update_masses
from contactlaw.world.contacts.substep import TOUCHING, force_of, is_placed, turn_frame
from contactlaw.world.data.access import body_at, contact_at, guard_at, near_at, pair_at, shape_at
from contactlaw.world.data.materials import friction_of, law_of, memory_of, speed_numbers
from contactlaw.world.data.records import CLOSED, FREE, NEVER, PARTED, RESIZED
from contactlaw.world.data.saved import CONTACT_NUMBERS, LEDGER_NUMBER, contact_fields
from contactlaw.world.data.vec import ZERO, axpy, dot, load, norm, scale, store, sub, tangent
from contactlaw.world.shapes import geometry
from contactlaw.world.trees.mobility import clear


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
    if not take_slot(w, q, k):
        return False
    c, law = contact_at(w.contacts, q.slot), law_of(w, pair_at(w.pairs, q.pair))
    t = c.touch
    reset(t, law, radius)
    t.share = share_of(t, sa, sb)
    t.e_star, t.g_star, t.stiffness = t.share * t.e_star, t.share * t.g_star, t.share * t.stiffness
    t.mu = t.friction = friction_of(pair_at(w.pairs, q.pair), sa, sb)
    store(c.normal, n)
    store(c.tangent, tangent(n))
    store(c.arm_a, arm_a)
    store(c.arm_b, arm_b)
    if dot(along, along) > 0.0:
        t.skew = law.sectors * 2.0 * (1.0 - t.g_star / t.e_star) * share_along(norm(along))
        store(c.tangent, longer_axis(c, along))
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
        set_losses(t, speed_numbers(w, pair_at(w.pairs, q.pair)), push, norm(axpy(t.closing, n, slide)))
    if overlap > TOUCHING * t.radius:
        force.advance_contact(w, c, q.slot, ZERO, ZERO, 0.0, BY_ITSELF)
        store(c.force, scale(t.force, n))
        c.closing_acceleration = -t.force / t.mass
    return True


def take_slot(w, q, k):
    """Close near pair q, of number k, with a contact that keeps its ledger alone; return whether there is a slot."""
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
    clear(memory_of(w, q.slot))  # else what the last contact here left would show in saved states
    c.phase, c.near, c.link, c.initial_overlap = CLOSED, k, link, before
    c.shape_a, c.shape_b, c.body_a, c.body_b, c.pair = q.a, q.b, q.body_a, q.body_b, q.pair
    c.touches += 1
    return True


def has_contacts(w):
    """Return whether any contact is in use: closed, or parted in the last step."""
    return w.spares < w.contact_room


def nears_in_use(w):
    """Return how many near pairs must be gone through for those with a contact: none while no contact is in use."""
    return w.nears if has_contacts(w) else 0


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
    c.torsion.moment, c.torsion.rolled, c.torsion.passed[0], c.torsion.passed[1] = 0.0, 0.0, 0.0, 0.0
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


jit_module(__name__)
