"""Functions that laws share: gross slip from the touch on, and friction under the force of the damper.

The damper leaves the elastic contact unchanged. It changes the total normal force, and the mobilised share F/(mu P) of
that total is the same as without a damper. So stick and slip, and the regimes of the elastic theory, stay exact at any
restitution. (Scaling the limits mu p instead makes every damped contact stick at the first touch, where the damper's
share of P is infinite; gross slip then misses psi_1 - 2 chi (1 + e) by 4 chi zeta^2/psi_1, 0.08 at e = 0.5.)
"""

from math import sqrt

from contactlaw.jit import jit_inline, jit_module
from contactlaw.laws.record import LASTING, SLIDING

STRAIGHT = 1e-6  # sine of the angle up to which a slide that turns within a step counts as straight
# Square of a friction force over that of its limit from which it is at its limit: tractions at their limits then differ
# in direction by sqrt(2) STRAIGHT at most
AT_LIMIT = 1.0 - STRAIGHT**2


def stuck_stiffness(contact):
    """Tangential stiffness 2 G* a [N/m] of a contact that sticks everywhere (Mindlin 1949)."""
    return 2.0 * contact.g_star * sqrt(contact.radius * contact.overlap)


def slides_on(contact, du, dv, given_up):
    """Return whether a contact that has slid as a whole since the touch still does; if so, set its force to friction.

    Under gross slip all points move together (Maw, Barber & Fawcett 1976, appendix). So the centre of the contact, with
    the limit mu E* delta, decides for all: it slides while its displacement exceeds the growth of that limit. No
    history is needed until the contact sticks or the slide turns, which changes the tractions at the rim first. A
    single spring on its limit gives the same condition, as mu dP = 2 mu E* a d(delta) and dF = 2 G* a ds.

    given_up: share of the fall of P by which the law reduces its force by itself while the contact shrinks.
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


def sliding_direction(contact):
    """Direction of the tangential force of a sliding contact; (0, 0) if the force is zero."""
    size = max(sqrt(contact.f * contact.f + contact.g * contact.g), 1e-300)
    return contact.f / size, contact.g / size


def slipped_along_mean(x, y, u, v, along, over):
    """Traction q on a limit P after slip along the mean of the tractions before, q_0 = (u, v), and after, q.

    t = (x, y): traction without slip. From t - q = lambda (q_0 + q) and |q_0| = |q| = P follows lambda = over/(2 along)
    with along = P^2 + t.q_0 and over = t^2 - P^2.
    """
    scale = 1.0 / (2.0 * along + over)
    return (2.0 * along * x - over * u) * scale, (2.0 * along * y - over * v) * scale


def held(contact, f, g):
    """Factor <= 1 that reduces the springs' tangential force (f, g) [N] to at most mu times the elastic P."""
    pull, limit = sqrt(f * f + g * g), contact.friction * contact.elastic
    return limit / pull if pull > limit else 1.0


def carried(contact, f, g):
    """Tangential force of the contact [N] that belongs to the springs' force (f, g), at most mu times the elastic P.

    While bodies bounce, the force of the contact is that of the springs times P over the elastic P, so that it is on
    the friction limit exactly when the springs are. In a persistent contact this would not be passive. A stuck force F
    that grows with the closing speed v by c F/P v does work at the rate c F/P v w at a sliding speed w, of either sign,
    besides the damper's c v^2; a ball wedged into a groove would begin to swing by itself. So once bodies that had
    begun to separate approach again (at v = 0, where the ratio is 1), the force is that of the springs alone, within
    its limit.
    """
    if contact.course == LASTING:
        pull, limit = sqrt(f * f + g * g), contact.friction * contact.force
        contact.ratio = limit / pull if pull > limit else 1.0
    return contact.ratio * f, contact.ratio * g


def span_of(contact, span):
    """Radius [m] that nodes or rings should span: the present span, unless it is too small or much too large.

    A contact that settles from a bounce to rest would keep few active nodes. Whether the span is too large is decided
    by the overlap that the contact can still reach, so that an impact keeps its span near its start and end.
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


jit_module(__name__, jit_inline)
