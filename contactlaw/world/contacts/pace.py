"""Time scales of contacts: durations of impacts, lengths of substeps, effective masses."""

from math import sqrt

from contactlaw.jit import jit_module
from contactlaw.laws.hertz import greatest_overlap, hertz_stiffness
from contactlaw.laws.record import LASTING
from contactlaw.laws.slip import stuck_stiffness
from contactlaw.world.bodies.motion import acceleration_at, closing_at, mobility_between, swing, velocity_at
from contactlaw.world.contacts.force import is_quasi_static
from contactlaw.world.contacts.meeting import radius_where
from contactlaw.world.data.access import body_at, contact_at, pair_at, shape_at, tree_at
from contactlaw.world.data.kinds import ELLIPSOID
from contactlaw.world.data.materials import law_of
from contactlaw.world.data.records import NEVER
from contactlaw.world.data.vec import add, cross, dot, load, norm, scale, sub
from contactlaw.world.trees.motion import longest_turn

FEWER = 4.0  # by which the substeps of a quasi-static contact are divided
STEADY = 1e-2  # `share` of `force.is_quasi_static` below which substeps need only be stable
SETTLED = 0.1  # `share` of `force.is_quasi_static` below which a contact is no impact, though it has never sprung back
STABLE = 8.0  # substeps of an impact that are enough for stability
JOINTED = 20.0  # substeps of a damped impact with joints, at least: trees answer to each contact by itself
ELASTIC = 60.0  # substeps of an elastic impact in a crowd, at least: a column of 20 keeps its energy to 1e-3
# share of the substeps with which the restitution of a damped impact without slip is right to 8e-5 (measured, e 0.2 to
# 0.9, 100 substeps)
NORMAL = 0.4
ALIKE = 4.0  # equal contacts on one body, as the feet of a box, for which STABLE holds: h omega is 1 then, its limit 2
LEAST_STEP = 1.0 / 3.0  # shortest step for which implicit steps are tried, in `resting_duration` of a contact
MAX_SHORTENING = 4.0  # by which the length of substeps is divided for that, at most
UNLIKE = 1e-3  # ratio of masses from which `shared_push` counts
MASS_TURN = 0.1  # [rad] by which a normal may turn in a substep before effective masses are computed anew


def impact_duration(k, duration, mass, overlap, closing, push):
    """Return the duration [s] of an impact in which overlap [m] >= 0 and closing speed [m/s] are these.

    k: of P = k delta^1.5 [N/m^1.5]. duration: `laws.record.PAIR.duration`. mass: effective mass [kg]. push: closing
    acceleration by other forces [m/s^2]. A contact that these forces press together is at least as fast as the
    overlap at which they are in balance makes it, however slowly the bodies touched.
    """
    square = closing * closing + 0.8 * k * overlap * overlap * sqrt(overlap) / mass
    if push > 0.0:
        square += 2.0 * push * (mass * push / k) ** (2.0 / 3.0)
    if square == 0.0:
        return NEVER
    return duration * (1.25 * mass * square / k) ** 0.4 / sqrt(square)


def touch_duration(w, p, a, b, met):
    """Return the duration [s] of the impact that a near pair is about to have, as predicted with its bodies a and b.

    met: how they meet, see `geometry.meet`.
    """
    _, n, arm_a, arm_b = met
    mass = 1.0 / mobility_between(a, arm_a, b, arm_b, n)
    push = max(p.acceleration, 0.0) + shared_push(a, b)
    closing = sqrt(max(p.closing, 0.0) ** 2 + 2.0 * push * max(p.gap, 0.0))
    law = law_of(w, pair_at(w.pairs, p.pair))
    radius, _ = radius_where(w, p, a, b, n, arm_a, arm_b)
    k = 4.0 / 3.0 * law.e_star * sqrt(radius)
    return impact_duration(k, law.duration, mass, max(-p.gap, 0.0), closing, push)


def contact_duration(w, c, a, b):
    """Return the duration [s] of an impact with the present overlap and closing speed of a closed contact."""
    t = c.touch
    push = norm(sub(load(a.acceleration), load(b.acceleration)))
    if t.force == 0.0 and (a.oriented != 0 or b.oriented != 0):  # new, and perhaps pressed by turning alone
        push = max(push, closing_acceleration_of(w, c, a, b))
    push += shared_push(a, b)
    duration = law_of(w, pair_at(w.pairs, c.pair)).duration
    return impact_duration(hertz_stiffness(t), duration, t.mass, max(t.overlap, 0.0), closing_speed(c, a, b), push)


def closing_acceleration_of(w, c, a, b):
    """Return the closing acceleration [m/s^2] by all but contacts of the point of A whose sphere touches.

    It is that in the frame of B, as if B were flat there; an ellipsoid A may be the flatter one.
    """
    n, s = load(c.normal), shape_at(w.shapes, c.shape_a)
    core = scale(s.radius, n)
    arm_a, arm_b = add(load(c.arm_a), core), add(load(c.arm_b), core)
    across = cross(sub(velocity_at(a, arm_a), velocity_at(b, arm_b)), n)
    rate = dot(load(b.spin), across)
    rate = max(rate, dot(load(a.spin), across)) if s.kind == ELLIPSOID else rate
    return 2.0 * rate + dot(n, sub(acceleration_at(b, arm_b), acceleration_at(a, arm_a)))


def shared_push(a, b):
    """Return the acceleration [m/s^2] by which both of two bodies fall: onto each other, once one of them is held.

    Zero if their masses are alike: what holds a body is about as fast as its contacts with others, and that counts.
    """
    if min(a.inverse_mass, b.inverse_mass) > UNLIKE * max(a.inverse_mass, b.inverse_mass):
        return 0.0
    return min(norm(load(a.acceleration)), norm(load(b.acceleration)))


def resting_duration(w, c):
    """Return the duration [s] of an undamped impact whose greatest overlap is the present one of a closed contact."""
    t = c.touch
    return law_of(w, pair_at(w.pairs, c.pair)).duration * sqrt(t.mass / (0.8 * hertz_stiffness(t) * sqrt(t.overlap)))


def closing_speed(c, a, b):
    """Return the closing speed [m/s] of a closed contact from the bodies' velocities.

    `touch.closing`, a difference of overlaps, would be all rounding error after a very short substep.
    """
    return closing_at(a, load(c.arm_a), b, load(c.arm_b), load(c.normal))


def stays_closed(c, a, b):
    """Return whether the energy of a damped closed contact is too small to open it against the load on it:

        m v^2/2 + 2/5 P delta < (P + m a) delta

    v: closing speed, a: closing acceleration, hence P + m a: load. How stiff the contact is does not matter: an
    implicit step follows or damps the oscillations of a soft contact beside stiffer ones. The load may also be that of
    an impact itself: of the other feet of a body that lands flat, or by friction on a slender one. What has not been
    pressed again since it first expanded must hardly move.
    """
    speed, t = closing_speed(c, a, b), c.touch
    if t.zeta == 0.0 or (t.course != LASTING and not is_quasi_static(c, SETTLED)):
        return False
    return 0.5 * speed * speed * t.mass < (0.6 * t.force + t.mass * c.closing_acceleration) * t.overlap


def longest_substep(w, c, a, b, substeps, alone=False):
    """Return the longest substep [s] for a closed contact.

    substeps: number of them in an impact. alone: whether no other pair of the island can touch in this window; what
    contacts do to each other needs all substeps. Notes `first_substep` of a contact that is looked at alone.
    """
    t = c.touch
    law = law_of(w, pair_at(w.pairs, c.pair))
    fine = substeps > max(w.crowd_substeps, JOINTED)
    if t.overlap > 0.0 and law.vectors > 0.0 and is_quasi_static(c, STEADY):
        substeps = STABLE  # not with rigid friction, where the contact creeps by the speed gained in a substep
    elif t.overlap > 0.0 and is_quasi_static(c, 1.0):
        enough = substeps if fine else max(0.5 * substeps, STABLE)
        substeps = max(substeps / FEWER, min(enough, 20.0))
    longest = oscillation_duration(w, c, a, b)
    if t.zeta > 0.0 and fine:
        if returns_within_step(w, c, a, b):
            substeps = w.crowd_substeps
        elif alone and t.course == LASTING:
            substeps = min(substeps, w.substeps * fineness_of(c, a, b))
        elif alone:  # by one length for the whole impact: a change would be an error of its own
            if c.first_substep == 0.0:
                c.first_substep = longest / (w.substeps * fineness_of(c, a, b))
            substeps = min(substeps, max(longest / c.first_substep, NORMAL * w.substeps))
    longest /= substeps
    together = max(a.square_rate, b.square_rate)
    if together > 0.0:
        longest = min(longest, sqrt(ALIKE / together) / STABLE)
    rate = swing(a) + (swing(b) if b.tree != a.tree else 0.0)
    longest = longest if rate * longest <= 1.0 else max(1.0 / rate, longest / MAX_SHORTENING)
    return min(longest, min(turn_time(a), turn_time(b)))


def turn_time(b):
    """Return the longest substep [s] in which the tree of a body turns little enough; NEVER for a single body."""
    return longest_turn(tree_at(b.tree, 0)) / max(tree_at(b.tree, 0).change_rate, 1e-9) if is_jointed(b) else NEVER


def substeps_per_impact(w, p, few):
    """Return how many substeps an impact of a pair should have.

    few: no more than `WORLD.crowd` contacts of its island are closed. In a crowd and with joints damped impacts need
    fewer, as damping removes their errors; those of elastic ones add up.
    """
    damped = law_of(w, pair_at(w.pairs, p.pair)).zeta > 0.0
    joints = is_jointed(body_at(w.bodies, p.body_a)) or is_jointed(body_at(w.bodies, p.body_b))
    if few and not (damped and joints):
        return w.substeps
    if damped:
        return max(w.crowd_substeps, JOINTED) if joints else w.crowd_substeps
    return max(w.crowd_substeps, ELASTIC)


def is_jointed(b):
    """Return whether joints connect a body to other bodies."""
    return b.tree != 0 and tree_at(b.tree, 0).count > 1


def returns_within_step(w, c, a, b):
    """Return whether bodies that part with all the energy of their contact touch again within the step.

    The parting speed u is that of m u^2/2 = m v^2/2 + 2/5 P delta, the time of flight 2 u/g if an acceleration g along
    the normal brings them back; in a tree one in any direction counts, as it turns. Details of such a bounce are not
    visible at the ends of steps: substeps of a crowd will do. Not where friction presses a slender body on (Painleve).
    """
    t, speed, pull = c.touch, closing_speed(c, a, b), sub(load(b.acceleration), load(a.acceleration))
    back = w.step * (norm(pull) if a.tree != 0 or b.tree != 0 else dot(pull, load(c.normal)))
    if back <= 0.0 or w.step * c.closing_acceleration > back:
        return False
    return 4.0 * (speed * speed + 0.8 * t.force * max(t.overlap, 0.0) / t.mass) < back * back


def fineness_of(c, a, b):
    """Return the share of `WORLD.substeps` with which a damped impact is as exact as one that slides at mu V with all.

    The error of its tangential motion is proportional to the amplitude u and to the square of the substep (measured
    for u/(mu V) from 0.01 to 1, e = 0.5 and 0.9), so that this share is sqrt(u/(mu V)). V: closing speed. Spin about
    the normal counts by the speed that it has at the edge of the contact.
    """
    t, n = c.touch, load(c.normal)
    slide = sub(velocity_at(a, load(c.arm_a)), velocity_at(b, load(c.arm_b)))
    closing, spin, overlap = dot(slide, n), dot(sub(load(a.spin), load(b.spin)), n), max(t.overlap, 0.0)
    deepest = greatest_overlap(hertz_stiffness(t), t.mass, overlap, closing)
    square = dot(slide, slide) - closing * closing + spin * spin * t.radius * deepest
    if overlap > 0.0:
        square += (t.f * t.f + t.g * t.g) / (stuck_stiffness(t) * t.tangential_mass)
    limit = t.friction * t.friction * (closing * closing + 0.8 * t.force * overlap / t.mass)
    return max(sqrt(sqrt(min(square / limit, 1.0))), NORMAL) if limit > 0.0 else NORMAL


def oscillation_duration(w, c, a, b):
    """Return the duration [s] of the impact of a closed contact, or a tangential half period if that is shorter."""
    t = c.touch
    chi = 0.5 * t.g_star / t.e_star * t.mass / t.tangential_mass
    return contact_duration(w, c, a, b) / max(1.0, sqrt(0.5 * chi))


def add_square_rate(w, p):
    """Add 1/T^2 of a closed contact, T its `oscillation_duration`, to the sums of both bodies.

    The square of the frequency at which a body oscillates on several springs is at most the sum of their own squares.
    Balls are left out, which are not `oriented`: few of the contacts around a ball push along one line.
    """
    a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
    counts_a, counts_b = a.oriented != 0 and a.inverse_mass != 0.0, b.oriented != 0 and b.inverse_mass != 0.0
    if p.closed != 0 and (counts_a or counts_b):
        rate = oscillation_duration(w, contact_at(w.contacts, p.slot), a, b) ** -2
        a.square_rate += rate if counts_a else 0.0
        b.square_rate += rate if counts_b else 0.0


def update_masses(c, a, b):
    """Set the effective masses [kg] along the normal and across, the latter for the mean mobility of both tangents.

    Where joints prevent all motion along the normal, that mass is infinite, and so is the damper, which acts as soon
    as the normal turns. After a turn by an angle x the mass is at most 1/x^2 times that across: this limits it.
    """
    n, e = load(c.normal), load(c.tangent)
    arm_a, arm_b = load(c.arm_a), load(c.arm_b)
    both = mobility_between(a, arm_a, b, arm_b, e) + mobility_between(a, arm_a, b, arm_b, cross(n, e))
    c.touch.tangential_mass = 2.0 * c.touch.share / both
    c.touch.mass = c.touch.share / max(mobility_between(a, arm_a, b, arm_b, n), 0.5 * MASS_TURN * MASS_TURN * both)


jit_module(__name__)
