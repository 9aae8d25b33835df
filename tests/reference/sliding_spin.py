"""Force and moment of a Hertz contact that slides and spins about its normal at once, slipping everywhere.

With v the velocity of its middle, omega the spin and the pole, where nothing moves, at s = v/(omega a) from the middle,
q = sqrt(s^2 - 1) (Hertz pressure, P = a = 1):

    s <= 1: F/mu = 3 pi/32 (4 s - s^3)          M/mu = 3 pi/128 (8 - 8 s^2 + 3 s^4)
    s >= 1: F/mu = 3/16 [(4 s - s^3) asin(1/s) + (s^2 + 2) q/s]
            M/mu = 3/64 [(8 - 8 s^2 + 3 s^4) asin(1/s) + (6 - 3 s^2) q]

Derivation, in polar coordinates about the pole: on the chord at angle t to the line from pole to middle, slip is across
the chord, and pressure is sqrt(w^2 - m^2) at distance m from the chord's middle, w^2 = 1 - s^2 sin^2 t, so that

    F/mu = 3/2 s integral cos^2 t (1 - s^2 sin^2 t) dt      M/mu = 3/8 integral (1 - s^2 sin^2 t)^2 dt

from 0 to pi/2 (pole inside), to asin(1/s) (outside). There the terms cancel where s is large; Gauss' series does not:

    F/mu = 2F1(1/2, -1/2; 5/2; 1/s^2)       M/mu = 1/(5 s) 2F1(1/2, 1/2; 7/2; 1/s^2)

Sources: the problem: Zhuravlev, J. Appl. Math. Mech. 62 (1998) 705; potential of the pressure: Johnson, Contact
Mechanics (1985), section 3.4 (c).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import hyp2f1

from validation.reference.normal_motion import Array


def force_and_moment(velocity: ArrayLike, spin: ArrayLike) -> tuple[Array, Array]:
    """F/(mu P) and M/(mu P a), each with the sign of its own motion; arrays broadcast.

    Args:
        velocity: v of the middle of the contact, finite.
        spin: omega a, in the same units, finite. Both zero: no slip, no force.
    """

    def one(v: float, w: float) -> tuple[float, float]:
        force, moment = _of(abs(v), abs(w))
        return math.copysign(force, v), math.copysign(moment, w)

    force, moment = np.vectorize(one, otypes=[float, float])(velocity, spin)
    return force, moment


def _of(v: float, w: float) -> tuple[float, float]:
    if v <= w:
        s = v / w if w > 0.0 else 0.0
        scale = 3.0 * math.pi / 128.0 * (w > 0.0)
        return scale * (16.0 * s - 4.0 * s**3), scale * (8.0 - 8.0 * s * s + 3.0 * s**4)
    k = w / v
    return float(hyp2f1(0.5, -0.5, 2.5, k * k)), 0.2 * k * float(hyp2f1(0.5, 0.5, 3.5, k * k))
