"""Coupling of normal and tangential tractions between unlike materials.

Pressing unlike bodies together also shears their surfaces against each other, in proportion to Dundurs' second
parameter

    beta = 1/2 [(1 - 2 nu_A)/G_A - (1 - 2 nu_B)/G_B] / [(1 - nu_A)/G_A + (1 - nu_B)/G_B]

which the theory of oblique impact takes as zero. (The first footnote of Maw, Barber & Fawcett (1981) has the same
condition without the factor 1/2.)

Sources: Dundurs, J. Appl. Mech. 36 (1969) 650; Johnson, Contact Mechanics (1985), section 5.4; for contact that sticks
throughout: Mossakovskii, J. Appl. Math. Mech. 18 (1954) 418; Spence, Proc. R. Soc. A 305 (1968) 55; for finite
friction: Spence, J. Elasticity 5 (1975) 297.
"""

from math import atanh
from typing import Any

from scipy.optimize import brentq
from scipy.special import ellipkm1


def beta(compliance_a: float, nu_a: float, compliance_b: float, nu_b: float) -> float:
    """Dundurs' second parameter, between -1/2 and 1/2 for nu >= 0; compliances: 1/G of the bodies [1/Pa], 0: rigid.

    Raises:
        ValueError: Both bodies are rigid.
    """
    if compliance_a == compliance_b == 0.0:
        raise ValueError("compliance_a and compliance_b are both 0; at least one body must be elastic")
    difference = (1.0 - 2.0 * nu_a) * compliance_a - (1.0 - 2.0 * nu_b) * compliance_b
    return 0.5 * difference / ((1.0 - nu_a) * compliance_a + (1.0 - nu_b) * compliance_b)


def stiffening(beta: float) -> float:
    """Normal stiffness of a contact that sticks throughout, over the frictionless one: atanh(beta)/beta.

    That is (1/(2 beta)) ln[(1 + beta)/(1 - beta)] = 1 + beta^2/3 + ..: the most that the coupling can do to P over the
    contact radius; slip makes it less.
    """
    if not -1.0 < beta < 1.0:
        raise ValueError(f"beta is {beta!r}; it must lie in (-1, 1)")
    return atanh(beta) / beta if beta else 1.0


def stick_radius(beta: float, friction: float) -> float:
    """Radius c over a within which unlike bodies stick while they are pressed together; outside they slip radially.

    Root of atanh(c)/c = (mu/|beta|) K(sqrt(1 - c^2)), K the complete elliptic integral; the same for a flat punch and,
    by self-similarity, for a Hertz contact that grows. It follows for small beta, with mu/beta fixed, thus: write the
    Hankel transform of a radial traction as integral chi(t) sin(k t) dt. Traction mu/sqrt(1 - r^2) on the whole punch
    has chi = (2 mu/pi) t K(sqrt(1 - t^2)), the traction that would undo the radial displacement under the punch, beta
    (1 - sqrt(1 - r^2))/r, has chi = (2 beta/pi) atanh(t), and the traction is continuous at c where the two are equal.

    Raises:
        ValueError: Nothing would stick.
    """
    ratio = abs(beta) / friction
    if ratio > 100.0:
        raise ValueError(f"beta = {beta!r} is more than 100 times the friction {friction!r}: nothing would stick")

    def excess(c: float) -> float:
        return ratio * atanh(c) - c * float(ellipkm1(c * c))

    widest = 1.0 - 2.0**-53
    if excess(widest) <= 0.0:  # a ring of slip some exp(-pi/ratio) wide is below rounding
        return 1.0
    root: Any = brentq(excess, 1e-60, widest, xtol=1e-60)
    return float(root)
