"""Torsion as contacts that spin about their normals ask for it, by address: most scenes have none."""

from __future__ import annotations

from math import sqrt

from numba import carray  # pyright: ignore[reportPrivateImportUsage]

from contactlaw.laws import sectors, torsion
from contactlaw.laws.hertz import greatest_overlap
from contactlaw.laws.record import LASTING, OPEN, SPUN
from contactlaw.laws.slip import span_of
from contactlaw.laws.step import touch
from contactlaw.memory import doubles_at


def limit(c, memory, vectors, modulus, moved):
    """Lower the friction of a contact to what spin leaves of it; returns what sliding leaves for its moment.

    Where its law allows, a contact that has just touched spinning is given sectors instead, until it lasts or outgrows
    them.

    memory: address of what its law remembers. vectors: how many, zero: it allows none. modulus: G_t [Pa]. moved: as for
    `force.advance_contact`.
    """
    t = c.touch
    du, dv, angle = moved
    if t.state == OPEN and vectors > 0.0:
        deepest = greatest_overlap(t.stiffness, t.mass, max(t.before, 0.0), t.closing)
        sigma = t.g_star * abs(angle) * sqrt(t.radius * deepest) / (t.mu * t.e_star * (t.overlap - t.before))
        if sigma > sectors.LEAST_SPIN:
            touch(t, False)
            t.state = SPUN
    elif t.state == SPUN and (t.course == LASTING or span_of(t, c.torsion.span) != c.torsion.span):
        sectors.hand_over(t, c.torsion, carray(doubles_at(memory), 2 * int(vectors)), modulus)
    if t.state == SPUN:
        return t.mu
    share, left = torsion.limits(c.torsion, t, t.mu, du, dv, angle)
    t.friction = share * t.mu
    return left * t.mu


def twist(c, memory, modulus, moved, left, dashpot):
    """Twist a contact by an angle [rad], see `torsion.twist`; dashpot: spin [rad/s] and inertia, zero: it has none.

    memory: address of what its law remembers. moved: as for `force.advance_contact`.
    """
    if c.touch.state == SPUN:
        own = carray(doubles_at(memory), (2, sectors.RINGS, sectors.SECTORS))
        sectors.advance(c.touch, c.torsion, own, modulus, moved)
    else:
        torsion.twist(c.torsion, c.touch, modulus, moved[2], left)
    spin, inertia = dashpot
    if inertia > 0.0:
        torsion.damp(c.torsion, c.touch, modulus, left, spin, inertia)
