"""Rolling resistance: a moment against rolling that grows like a spring's, up to mu_r R P, and unloads elastically.

    dM = k_r d(theta), |M| <= mu_r R P        k_r = 2.25 k_N (mu_r R)^2, k_N = 2 E* a

with theta the angle that A has rolled over B about axes across the normal and R the effective radius: the
elastic-plastic model, type C, of Ai, Chen, Rotter & Ooi, Powder Technol. 206 (2011) 269, with their k_r. It is taken
rather than that of Luding (Granul. Matter 10 (2008) 235), a force between surfaces that roll, because it is a moment
alone, equal and opposite: a force that acts for it cannot be told from friction, nor does it keep what spins.
Where it is on its limit a ball that rolls on a plane slows at mu_r g/(1 + K^2), K^2 = 2/5 if it is solid, and stops; on
a slope of tan(alpha) < mu_r it stands. It dissipates in each cycle that reaches the limit (hysteresis), else nothing.

While load grows the moment stays, while it falls the angle does: neither makes energy, M^2/(2 k_r). Over the time of an
impact the spring hardly bends.
"""

from __future__ import annotations

from math import sqrt

from contactlaw.jit import jit

CALM = 0.3  # of critical damping: of a contact that lasts and hardly moves


@jit
def stiffness(contact, resistance):
    """k_r [N m]."""
    width = resistance * contact.radius
    return 4.5 * contact.e_star * sqrt(contact.radius * contact.overlap) * width * width


@jit
def roll(bend, contact, resistance, u, v):
    """Roll a contact by angles about both tangents [rad]; bend, shape (2,): the moments of its spring [N m], new.

    Returns what the limit leaves of them, 1: all.
    """
    share = 1.0
    if contact.before < contact.overlap:
        inside = 1.0 if contact.before >= 0.0 else contact.overlap / (contact.overlap - contact.before)
        u, v = inside * u, inside * v
    else:
        share = sqrt(contact.overlap / contact.before)
    k = stiffness(contact, resistance)
    u, v = share * bend[0] + k * u, share * bend[1] + k * v
    limit = resistance * contact.radius * min(contact.force, contact.elastic)
    share = min(limit / sqrt(u * u + v * v + 1e-300), 1.0)
    bend[0], bend[1] = share * u, share * v
    return share


@jit
def stored(bend, contact, resistance):
    """Energy of the spring [J]."""
    if contact.overlap <= 0.0:
        return 0.0
    return 0.5 * (bend[0] * bend[0] + bend[1] * bend[1]) / stiffness(contact, resistance)
