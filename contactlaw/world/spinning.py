"""Torsion as contacts that spin about their normals ask for it, by address: most scenes have none."""

from __future__ import annotations

from contactlaw.jit import address_of
from contactlaw.laws import torsion
from contactlaw.world.call import LIMIT, TWIST


def limit(c, friction, moved):
    """Lower the friction of a contact to what spin leaves of it; returns what sliding leaves for its moment.

    friction: without spin. moved: as for `force.advance_contact`.
    """
    du, dv, angle = moved
    share, left = torsion.limits(c.torsion, c.touch, friction, du, dv, angle)
    c.touch.friction = share * friction
    return left * friction


def twist(c, modulus, angle, left, dashpot):
    """Twist a contact by an angle [rad], see `torsion.twist`; dashpot: spin [rad/s] and inertia, zero: it has none."""
    torsion.twist(c.torsion, c.touch, modulus, angle, left)
    spin, inertia = dashpot
    if inertia > 0.0:
        torsion.damp(c.torsion, c.touch, modulus, left, spin, inertia)


def address_of_limit() -> int:
    """Where `limit` is, compiled."""
    return address_of(limit, LIMIT)


def address_of_twist() -> int:
    """Where `twist` is, compiled."""
    return address_of(twist, TWIST)
