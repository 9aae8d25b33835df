"""A contact in the engines' kernels, a row of float64: `laws.record.CONTACT`, its frame, what its law remembers.

The numbers of a pair are a row as well: `laws.record.PAIR`, then the law's own.
"""

from __future__ import annotations

from contactlaw.jit import jit_inline as jit
from contactlaw.laws.hertz import elastic_force
from contactlaw.laws.record import CONTACT, CONTACT_SIZE, OPEN, PAIR, PAIR_SIZE, ask_stiffness, contact_of, pair_of
from contactlaw.laws.step import advance, ask, know

_PLACE = {name: place for kind in (CONTACT, PAIR) for place, name in enumerate(kind.names or ())}
# Where what both records have by one name would be found is that of the pair.
E_STAR, G_STAR, RADIUS, FRICTION, ZETA, LINEAR = (
    _PLACE[name] for name in ("e_star", "g_star", "radius", "friction", "zeta", "linear")
)
PHASE, OVERLAP, NORMAL, RATIO, TANGENTIAL = (_PLACE[name] for name in ("state", "overlap", "force", "ratio", "f"))
STIFFNESS, CLOSING, MASS, TANGENTIAL_MASS = (
    _PLACE[name] for name in ("stiffness", "closing", "mass", "tangential_mass")
)
TANGENT = CONTACT_SIZE  # first tangent vector, world frame; the second is n x t
DIRECTION = TANGENT + 3  # normal n, world frame
HEADER = DIRECTION + 3


@jit
def step(p, h_io, overlap, before, closing, free, du, dv, dt, mass, tangential_mass):
    """Advance one contact to the overlap it has now.

    p: of the pair. h_io: of the contact. overlap, before [m]: now and at the start of the step, below zero apart.
    closing: mean closing speed over the step [m/s]. free: see `hertz.normal_force`. du, dv: tangential displacement of
    A relative to B over the step along the two tangents [m]. dt: step [s]. mass, tangential_mass: effective [kg], read
    at a touch alone. Returns P, F along each tangent [N].
    """
    if overlap <= 0.0:
        forget(h_io)
        return 0.0, 0.0, 0.0
    contact, pair = contact_of(h_io), pair_of(p)
    if contact.state == OPEN:
        know(contact, pair, pair.radius)
        contact.mass, contact.tangential_mass = mass, tangential_mass
    contact.overlap, contact.before, contact.closing = overlap, before, closing
    advance(contact, pair, p[PAIR_SIZE:], h_io[HEADER:], free, du, dv, dt)
    return contact.force, contact.f, contact.g


@jit
def displace(p, h_io, overlap, du, dv, force, dt):
    """Tangential force [N] after a displacement [m], at an overlap [m] and a normal force [N] that are given.

    dt: step [s], 0 where time does not matter.
    """
    contact = contact_of(h_io)
    pair = pair_of(p)
    contact.before, contact.overlap, contact.force = contact.overlap, overlap, force
    contact.elastic = elastic_force(contact, pair.linear != 0.0, overlap)
    ask(contact, pair, p[PAIR_SIZE:], h_io[HEADER:], du, dv, dt)
    return contact.f, contact.g


@jit
def forget(h_out):
    """An open contact remembers nothing but the frame that it was in."""
    for i in range(h_out.size):
        if i < TANGENT or i >= HEADER:
            h_out[i] = 0.0


@jit
def stuck_stiffness(p, h, overlap):
    """Tangential stiffness [N/m] of a contact that sticks everywhere; infinite: rigid."""
    contact = contact_of(h)
    kept, contact.overlap = contact.overlap, overlap
    stiffness = ask_stiffness(pair_of(p), contact, p[PAIR_SIZE:])
    contact.overlap = kept
    return stiffness
