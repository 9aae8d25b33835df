"""Which islands may take an implicit step, and whether a solved step is accepted.

No contact may strike, part or begin to stick within an implicit step, as these depend on the time when they happen.
"""

from contactlaw.jit import jit_module
from contactlaw.memory import whole_at
from contactlaw.world.bodies.bounds import time_to_close
from contactlaw.world.bodies.motion import velocity_at
from contactlaw.world.contacts import force
from contactlaw.world.contacts.meeting import radius_of
from contactlaw.world.contacts.pace import closing_speed, resting_duration, stays_closed
from contactlaw.world.contacts.substep import TOUCHING
from contactlaw.world.data.access import body_at, contact_at, near_at, pair_at, row_at, shape_at, tree_at
from contactlaw.world.data.kinds import CORNER, DISC, SEGMENT, SIDE
from contactlaw.world.data.materials import law_of
from contactlaw.world.data.records import NEVER, STRIKES
from contactlaw.world.data.vec import ZERO, axpy, cross, dot, load, norm, sub, to_body, to_world
from contactlaw.world.near.time_of_impact import find_gap
from contactlaw.world.shapes.core import CROWN

MAX_WHIRL = 0.01  # [rad] by which the deepest point of a disc may run round its rim in an implicit step
ENERGY_GAIN = 1e-6  # of an island's energy: what a step may add beyond what others have lost
MANY, WORTH = 128, 16.0  # unknowns from which substeps are cheaper, unless a step has so many `resting_duration`
LARGEST_TURN = 0.1  # [rad] of a body with shapes off its centre in an implicit step
LEAST_TURN = 1e-5  # [rad] of a body in contact in a step, from which islands with trees take two stages


def is_persistent(w, bodies, pairs):
    """Return whether an island has closed contacts and nothing strikes in it within the step.

    Numbers its unknowns.
    """
    unknowns = 0
    for i in range(bodies):
        b = body_at(w.bodies, whole_at(w.island_bodies, i))
        b.unknown = -1
        if b.tree != 0:
            if b.member == 0:
                tree_at(b.tree, 0).unknown = unknowns
                unknowns += tree_at(b.tree, 0).v_size
            b.unknown = tree_at(b.tree, 0).unknown
        elif b.inverse_mass != 0.0:
            b.unknown = unknowns
            unknowns += 6
    w.unknowns = unknowns
    if unknowns > w.unknown_room:
        return False
    closed, shortest = 0, NEVER
    for i in range(pairs):
        p = near_at(w.near, whole_at(w.island_pairs, i))
        if p.active == STRIKES:
            return False
        closed += p.closed
        if p.closed != 0 and unknowns > MANY:
            shortest = min(shortest, resting_duration(w, contact_at(w.contacts, p.slot)))
        for k in (p.body_a, p.body_b):
            b = body_at(w.bodies, k)
            if b.still != 0:
                b.unknown = -1
    if unknowns > MANY and w.step < WORTH * shortest:
        return False
    for i in range(bodies):
        b = body_at(w.bodies, whole_at(w.island_bodies, i))
        if (b.active != 0 or b.tree == 0) and turns_far(w, b):
            return False
    return closed > 0


def turns_far(w, b, foot=False):
    """Return whether a body turns so far within the step that its contacts and gaps are not those of its start.

    A turn about `BODY.round` leaves them as they are, but for those of the feet that it may stand on.
    """
    spin, axis = load(b.spin), to_world(b.axes, load(b.round))
    spin = spin if foot else axpy(-dot(spin, axis), axis, spin)
    return b.oriented != 0 and norm(spin) * w.step > LARGEST_TURN


def strikes(w, p):
    """Return whether a pair strikes within the step, or has a contact that an implicit step cannot take."""
    a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
    if p.closed == 0:
        if p.checked != 0.0:
            find_gap(w, p, 0.0)
        if p.gap < 0.0 and -p.gap > TOUCHING * radius_of(w, p, a, b):
            return True  # so that `touch.begin_contact` treats the overlap as an initial one
        if turns_far(w, a) or turns_far(w, b):
            return p.toi < w.step
        closing, gap, push = max(p.closing, 0.0), max(p.gap, 0.0), max_push(p, a, b)
        return time_to_close(gap, p.closing, push) < w.step and closing * closing + 2.0 * push * gap > 0.0
    if shape_at(w.shapes, p.a).kind == CORNER and turns_far(w, a, True):
        return True
    c = contact_at(w.contacts, p.slot)
    springless = c.touch.friction > 0.0 and not 0.0 < force.stuck_stiffness_of(w, c) < NEVER  # rigid, or by rates alone
    if springless or not stays_closed(c, a, b):
        return True
    return whirls(shape_at(w.shapes, p.a), a, load(c.normal), sub(load(a.spin), load(b.spin)), w.step)


def max_push(p, a, b):
    """Return a bound on the closing acceleration [m/s^2] of an open pair.

    Bodies with a closed contact count as not accelerated by their loads, which the contact carries.
    """
    held_a, held_b = a.active != 0 or a.still != 0, b.active != 0 or b.still != 0
    if not (held_a or held_b):
        return max(p.acceleration, 0.0)
    return norm(sub(ZERO if held_a else load(a.acceleration), ZERO if held_b else load(b.acceleration)))


def whirls(s, a, n, spin, time):
    """Return whether the deepest point of a disc runs round its rim by more than MAX_WHIRL in a time [s].

    It is where the normal's component in the disc's plane points, see `shapes.disc`: the flatter, the faster.
    """
    if s.kind != DISC and s.kind != SIDE:
        return False
    axis = to_world(a.axes, load(s.normal))
    flat = 2.0 * CROWN * s.radius / norm(load(s.half))
    return norm(cross(spin, axis)) * time > MAX_WHIRL * max(norm(cross(n, axis)), flat)


def motion_of(w, bodies, pairs):
    """Return how many stages an island takes, and whether it slides steadily at the start of the step.

    One stage: it has a tree, whose velocities have not followed forces as two stages need it (`TREE.followed`), no
    contact slides as a whole by more than its springs yield, and no body turns: the load of what is carried round has
    the direction of a stage's end, and one stage would take some (omega h)^2 of its energy. It slides steadily if it
    has no tree, no contact moves along its normal, nor do its bodies (after an implicit step, a contact knows its mean
    speed alone), and all closed contacts slide so, against friction, without spin (or it depends on rates): one that
    begins to slip may have the slopes of sticking. They are those of balls and corners, others run along with tilt, and
    have a constant friction: an iteration takes that of the speed before it.
    """
    jointed, twice = False, False
    for i in range(bodies):
        b = body_at(w.bodies, whole_at(w.island_bodies, i))
        jointed = jointed or b.tree != 0
        twice = twice or (b.tree != 0 and tree_at(b.tree, 0).followed != 0)
    slides = not jointed
    for i in range(pairs):
        r = row_at(w.rows, i)
        if r.slot >= 0:
            c = contact_at(w.contacts, r.slot)
            a, b, arm_a, arm_b = body_at(w.bodies, c.body_a), body_at(w.bodies, c.body_b), load(c.arm_a), load(c.arm_b)
            speed = closing_speed(c, a, b)
            steady = force.is_quasi_static(c, 1.0) and force.is_slow(c, speed, 1.0)
            way = w.step * norm(sub(velocity_at(a, arm_a), velocity_at(b, arm_b)))
            slipping = force.slips_fully(c.touch) and way > force.slide_to_slip(c.touch, c.touch.friction)
            runs = shape_at(w.shapes, c.shape_a).kind >= SEGMENT
            varies = c.torsion.span != 0.0 or law_of(w, pair_at(w.pairs, c.pair)).speeds != 0.0
            slides = slides and steady and slipping and c.touch.friction != 0.0 and not (runs or varies)
            turn = w.step * max(norm(load(a.spin)), norm(load(b.spin)))
            twice = twice or turn > LEAST_TURN or slipping
    return 1 if jointed and not twice else 2, slides


def changes_regime(w, pairs):
    """Return whether a contact parts, touches what sleeps, begins to stick or to roll back.

    It sticks after sliding or spinning as a whole, and rolls back if rolling resistance is at its limit there.
    """
    for i in range(pairs):
        r = row_at(w.rows, i)
        if r.fresh != 0:
            c = contact_at(w.contacts, r.slot)
            if body_at(w.bodies, c.body_a).asleep + body_at(w.bodies, c.body_b).asleep > 0:
                return True
        if r.slot >= 0 and r.fresh == 0:
            c = contact_at(w.contacts, r.slot)
            saved = contact_at(w.saved_contacts, r.slot)
            start, now = saved.touch, c.touch
            bent_back = saved.bending[0] * c.bending[0] + saved.bending[1] * c.bending[1] < 0.0
            if (now.overlap <= 0.0 and start.overlap > 0.0) or (bent_back and c.rolled[2] < 1.0):
                return True
            far = force.slide_to_slip(now, now.mu)  # by spin: no force, slips by any motion
            reverses = now.f * r.slide[0] + now.g * r.slide[1] < 0.0 or start.f * now.f + start.g * now.g < 0.0
            # what spin leaves hardly any friction creeps as it rolls, whichever way that is
            rolls = c.torsion.rolled > 0.0 and start.friction < 0.5 * now.mu
            sticks = force.slips_fully(start) and ((reverses and not rolls) or not force.slips_fully(now))
            if sticks and c.moved[0] ** 2 + c.moved[1] ** 2 > far * far:
                return True
            if c.torsion.moment * r.slide[2] < 0.0 and c.torsion.rolled == 0.0 and force.twist_slips(now, c.moved[2]):
                return True
    return False


def energy(w, bodies, pairs):
    """Return the energy [J] of an island: kinetic, less the work of loads since the step began, and stored in contacts.

    The third result is the sum of the absolute values of these terms; NEVER where joints, or drives of kinematic
    bodies, do work. The last one is the credit of its contacts, see `implicit.step`.
    """
    total, stored, size, credit = 0.0, 0.0, 0.0, 0.0
    for i in range(bodies):
        b = body_at(w.bodies, whole_at(w.island_bodies, i))
        if b.tree != 0 or b.unknown < 0:
            return 0.0, 0.0, NEVER, 0.0
        v, spin = load(b.velocity), to_body(b.axes, load(b.spin))
        motion = dot(v, v) / b.inverse_mass
        for j in range(3):
            motion += spin[j] * spin[j] / b.inverse_inertia[j]
        work = dot(load(b.acceleration), load(b.shift)) / b.inverse_mass + dot(load(b.torque), load(b.twist))
        total += 0.5 * motion - work
        size += 0.5 * motion + abs(work)
    for i in range(pairs):
        slot = row_at(w.rows, i).slot
        if slot >= 0:
            stored += force.stored_energy(w, contact_at(w.contacts, slot), slot)
            credit += contact_at(w.contacts, slot).credit
    return total, stored, size + stored, credit


jit_module(__name__)
