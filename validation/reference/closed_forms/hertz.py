"""Normal impact of two elastic bodies with a circular contact, in SI units (Hertz 1882).

With m the effective mass, k = 4/3 E* sqrt(R), P = k d^(3/2) and V the approach speed, energy gives
v = V sqrt(1 - (d/d_m)^(5/2)), d_m = [5 m V^2/(4 k)]^(2/5). The time from touch to release is

    T = 2 (d_m/V) integral_0^1 dx/sqrt(1 - x^(5/2)) = (4 sqrt(pi)/5) Gamma(2/5)/Gamma(9/10) d_m/V = 2.9432.. d_m/V.

Source: Johnson, Contact Mechanics (1985), section 11.4(a).
"""

from math import pi, sqrt
from typing import NamedTuple

from scipy.special import gamma

DURATION = float(0.8 * sqrt(pi) * gamma(0.4) / gamma(0.9))
"""Duration of contact times approach speed over greatest overlap."""


class HertzImpact(NamedTuple):
    """Duration [s], greatest overlap d_m [m] and force [N] of an impact; k of P = k d^(3/2) [N/m^1.5]."""

    duration: float
    overlap: float
    force: float
    stiffness: float


def impact(mass: float, radius: float, modulus: float, speed: float) -> HertzImpact:
    """Of effective mass [kg], radius [m] and modulus E* [Pa] (1/m = 1/m_A + 1/m_B and so on) at a speed [m/s]."""
    stiffness = 4.0 / 3.0 * modulus * sqrt(radius)
    overlap = (1.25 * mass * speed**2 / stiffness) ** 0.4
    return HertzImpact(DURATION * overlap / speed, overlap, stiffness * overlap**1.5, stiffness)
