"""Torsion of contacts that spin about their normals, a function called by address: most scenes do not need it."""

from math import sqrt

from numba import carray  # pyright: ignore[reportPrivateImportUsage]

from contactlaw.laws import sectors, torsion
from contactlaw.laws.hertz import greatest_overlap
from contactlaw.laws.record import LASTING, OPEN, PAIR_SIZE, SPUN
from contactlaw.laws.slip import span_of
from contactlaw.memory import doubles_at
from contactlaw.world.data.materials import law_at


def advance_spinning(c, memory, numbers, moved, since, dt, roomy, dashpot):
    """Update the tangential force and the moment of a contact that spins; its normal force is that of this step.

    Where its law allows, sectors (`laws.sectors`) follow a contact from its touch, until it is a persistent contact or
    the span of its rings no longer fits.

    memory, numbers: addresses of the law's history and of the pair's numbers. moved, since, dt: as for
    `torsion.advance`. roomy: whether sectors may begin. dashpot: spin of A over B [rad/s] and effective moment of
    inertia [kg m^2], of a dashpot about the normal; inertia 0: none.
    """
    t, pair, law = c.touch, law_at(numbers, 0), carray(doubles_at(numbers + 8 * PAIR_SIZE), 1)
    own = carray(doubles_at(memory), 2 * int(pair.vectors))
    if t.state == OPEN and roomy and pair.sectors > 0.0:
        deepest = greatest_overlap(t.stiffness, t.mass, max(t.before, 0.0), t.closing)
        sigma = t.g_star * abs(moved[2]) * sqrt(t.radius * deepest) / (t.mu * t.e_star * (t.overlap - t.before))
        if sigma > sectors.LEAST_SPIN:
            t.state = SPUN
    elif t.state == SPUN and (t.course == LASTING or span_of(t, c.torsion.span) != c.torsion.span):
        sectors.hand_over(t, c.torsion, own, pair.g_t)
    left = t.mu
    if t.state == SPUN:
        tractions = carray(doubles_at(memory), (2, sectors.RINGS, sectors.SECTORS))
        sectors.advance(t, c.torsion, tractions, pair.g_t, moved)
    else:
        left = torsion.advance(c.torsion, t, pair, law, own, moved, since, dt)
    rate, inertia = dashpot
    if inertia > 0.0:
        torsion.damp(c.torsion, t, pair.g_t, left, rate, inertia)
