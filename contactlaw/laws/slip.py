"""What laws share: gross slip from the touch on, and friction's share of the damper's force.

The damper does not touch the elastic contact: it changes the total normal force, and friction carries the same
mobilised share F/(mu P) of it as it would without. So stick and slip, and with them the regimes of the elastic
theory, stay exact at any restitution. (Scaling the caps mu p instead makes every damped contact stick at the first
touch, where the damper's share of P is infinite: gross slip then misses psi_1 - 2 chi (1 + e) by 4 chi zeta^2/psi_1,
0.08 at e = 0.5.)
"""

from __future__ import annotations

from math import sqrt

from contactlaw.jit import jit_inline as jit
from contactlaw.laws.record import LASTING, SLIDING

STRAIGHT = 1e-6  # sine of the angle to which a slide may turn in a step and still count as straight


@jit
def slides_on(contact, du, dv, given_up):
    """Whether a contact that has slid as a whole since the touch still does; if so, its force is that of friction.

    Under gross slip all points move together (Maw, Barber & Fawcett 1976, appendix), so the middle of the contact, cap
    mu E* delta, speaks for all: it slides while its displacement outruns the growth of that cap. Nothing else need be
    known until it sticks, or until the slide turns: then the places near the rim turn first. A single spring on its
    limit says the same, as mu dP = 2 mu E* a d(delta) and dF = 2 G* a ds. given_up: share of the fall of P by which a
    law lets its force fall by itself while the contact shrinks.
    """
    mu_e, overlap, before = contact.friction * contact.e_star, contact.overlap, contact.before
    part = 1.0 if before >= 0.0 else overlap / (overlap - before)
    u, v = contact.g_star * part * du, contact.g_star * part * dv
    if overlap < before:
        before += given_up * (overlap - before)
    old = sqrt(contact.f * contact.f + contact.g * contact.g)
    if old > 0.0:
        if abs(u * contact.g - v * contact.f) > STRAIGHT * old * sqrt(u * u + v * v):
            return False
        stretch = mu_e * max(before, 0.0) / old
        u += stretch * contact.f
        v += stretch * contact.g
    size = sqrt(u * u + v * v)
    if size == 0.0 or size < mu_e * overlap:
        return False
    contact.state = SLIDING
    contact.f = contact.friction * contact.force * u / size
    contact.g = contact.friction * contact.force * v / size
    return True


@jit
def sliding_direction(contact):
    """Direction of the force of a contact that slides; (0, 0) where it has none."""
    size = sqrt(contact.f * contact.f + contact.g * contact.g)
    if size == 0.0:
        return 0.0, 0.0
    return contact.f / size, contact.g / size


@jit
def held(contact, f, g):
    """Share of the springs' tangential force (f, g) [N] that a contact holds: mu times the elastic P, at most 1."""
    pull, limit = sqrt(f * f + g * g), contact.friction * contact.elastic
    return limit / pull if pull > limit else 1.0


@jit
def carried(contact, f, g):
    """What of the springs' tangential force (f, g) [N], within mu times the elastic P, a contact gives.

    Friction carries the same share of the damper's force as of the elastic one while bodies bounce: the whole is then
    on the friction limit where the springs are. In a contact that lasts this would not be passive: a force that is
    stuck at F and grows with the closing speed v by c F/P v does the work c F/P v w at a sliding speed w, of either
    sign, beside the damper's c v^2, and a ball wedged into a groove would begin to swing by itself. Once bodies that
    have begun to part come together again, at v = 0 and a ratio of 1, friction has the springs' force alone, within
    its limit.
    """
    if contact.course == LASTING:
        pull, limit = sqrt(f * f + g * g), contact.friction * contact.force
        contact.ratio = limit / pull if pull > limit else 1.0
    return contact.ratio * f, contact.ratio * g


@jit
def span_of(contact, span):
    """Radius [m] for nodes or rings to span: it stays unless the contact outgrows it or lives far inside.

    A contact that settles from a bounce to rest keeps few of its nodes; it is judged by the overlap it can still reach,
    so that the thin contacts at the start and end of an impact are left alone.
    """
    a2 = contact.radius * contact.overlap
    if a2 > span * span:
        return 1.25 * sqrt(a2)
    if a2 * 4.0 < span * span:
        overlap, quarter = contact.overlap, 0.25 * span * span / contact.radius
        energy = overlap * overlap * sqrt(overlap)  # over 2/5 k, with that of the closing speed
        energy += 1.25 * contact.mass * contact.closing * contact.closing / contact.stiffness
        if energy < quarter * quarter * sqrt(quarter):
            return 1.02 * sqrt(contact.radius * energy**0.4)
    return span
