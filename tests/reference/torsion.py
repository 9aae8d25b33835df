"""Closed form of torsion of a Hertz contact about its normal, with a ring of slip at its edge.

With stick radius c, k^2 = 1 - c^2/a^2 and 1/G_t = 1/G_A + 1/G_B, angle and moment are (nu does not enter)

    beta      = 3 mu P/(4 pi G_t a^2) [K(k) - E(k)]
    M/(mu P a) = (4/pi) {(c/a)^3 [K - E](c/a) + 3 integral_(c/a)^1 s^2 [K - E](s) ds}      [K - E](s) at k^2 = 1 - s^2

K - E is taken as Carlson's k^2 R_D(0, 1 - k^2, 1)/3, without cancellation. In the scaled units of the solvers
(E* = R = 1, mu and kappa taken out) G_t is (2 - nu)/4.

Sources: Lubkin, J. Appl. Mech. 18 (1951) 183; Deresiewicz, J. Appl. Mech. 21 (1954) 52; stuck: Reissner & Sagoci, J.
Appl. Phys. 15 (1944) 652.
"""

import math

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import quad
from scipy.special import elliprd

from validation.reference.normal_motion import Array

FULL_SLIP = 3.0 * math.pi / 16.0
"""Moment over mu P a once all of the contact slips."""
STIFFNESS = 16.0 / 3.0
"""Moment over angle of a contact that sticks, over G_t a^3."""


def _difference(ratio: float) -> float:
    """K - E at k^2 = 1 - ratio^2."""
    return (1.0 - ratio * ratio) / 3.0 * float(elliprd(0.0, ratio * ratio, 1.0))


def angle(stick_radius: ArrayLike) -> Array:
    """Angle beta G_t a^2/(mu P) at which the stick radius over a, in (0, 1], is reached; shaped as it."""
    return np.vectorize(lambda c: 0.75 / math.pi * _difference(_checked(c)), otypes=[float])(stick_radius)


def moment(stick_radius: ArrayLike) -> Array:
    """Moment M/(mu P a) at a stick radius over a, in (0, 1]; shaped as it."""

    def one(c: float) -> float:
        slipping = quad(lambda s: s * s * _difference(s), _checked(c), 1.0, epsabs=1e-13, epsrel=1e-12)[0]
        return 4.0 / math.pi * (c**3 * _difference(c) + 3.0 * slipping)

    return np.vectorize(one, otypes=[float])(stick_radius)


def _checked(stick_radius: float) -> float:
    if stick_radius > 1.0:
        raise ValueError(f"stick_radius is {stick_radius!r}; it must lie in (0, 1], the contact radius is 1")
    return stick_radius
