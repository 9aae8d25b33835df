"""Rolling resistance: the moment of an elastic-plastic spring against rolling, at most mu_r R P.

    dM = k_r d(theta), |M| <= mu_r R P        k_r = 2.25 k_N (mu_r R)^2, k_N = 2 E* a

theta is the angle by which A has rolled over B about tangential axes, R the effective radius. Where the contact is an
ellipse R is the radius of curvature along the way that it rolls: M/R and R theta, the force and the distance by which
this spring is described, are vectors along that way. This is the elastic-plastic model, type C, of Ai, Chen, Rotter &
Ooi, Powder Technol. 206 (2011) 269, with their k_r. It is taken instead of that of Luding (Granul. Matter 10 (2008)
235), a force between rolling surfaces, because it is a pure moment, equal and opposite on both bodies; such a force
cannot be distinguished from friction and does not conserve spin.
At the limit, a ball rolling on a plane decelerates at mu_r g/(1 + K^2), K^2 = 2/5 if it is solid, and stops. On a slope
of tan(alpha) < mu_r it stands still. A cycle that reaches the limit dissipates energy (hysteresis), others do not.

While the load grows, the moment of the spring is kept; while it falls, the angle is kept. Neither increases the energy
M^2/(2 k_r). During an impact the spring hardly deforms.
"""

from math import sqrt

from contactlaw.jit import jit


@jit
def stiffness(contact, resistance):
    """Stiffness k_r/R^2 [N/m]."""
    return 4.5 * contact.e_star * sqrt(contact.radius * contact.overlap) * resistance * resistance


@jit
def roll(bend, contact, resistance, u, v):
    """Roll a contact by R theta = (u, v), theta about two axes [m], and update M/R of its spring, bend (2,) [N].

    Returns the factor by which the limit reduces the spring's force; 1: not at all.
    """
    share = 1.0
    if contact.before < contact.overlap:
        inside = 1.0 if contact.before >= 0.0 else contact.overlap / (contact.overlap - contact.before)
        u, v = inside * u, inside * v
    else:
        share = sqrt(contact.overlap / contact.before)
    k = stiffness(contact, resistance)
    u, v = share * bend[0] + k * u, share * bend[1] + k * v
    limit = resistance * min(contact.force, contact.elastic)
    share = min(limit / sqrt(u * u + v * v + 1e-300), 1.0)
    bend[0], bend[1] = share * u, share * v
    return share


@jit
def stored(bend, contact, resistance):
    """Elastic energy of the spring [J]; of a closed contact."""
    return 0.5 * (bend[0] * bend[0] + bend[1] * bend[1]) / stiffness(contact, resistance)
