"""What a quasi-static contact leaves out: waves sent into a half-space, and the slowest oscillation of a ball.

A force F(t) at a point of a half-space moves that point partly in step with its rate: the mean work of a harmonic
force is F^2 omega^2 B/2, so that a pulse radiates B integral (dF/dt)^2 dt, with B = I(nu)/(2 pi rho c_s^3) and I the
imaginary part of Lamb's integral. For a Hertz force both integrals are closed (or one quadrature).

Sources: Lamb, Phil. Trans. R. Soc. A 203 (1904) 1; Miller & Pursey, Proc. R. Soc. A 233 (1955) 55; Hunter, J. Mech.
Phys. Solids 5 (1957) 162; Johnson, Contact Mechanics (1985), section 11.4; modes of a sphere: Lamb, Proc. London Math.
Soc. 13 (1882) 189.
"""

from functools import lru_cache
from math import pi, sqrt

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import beta, spherical_jn

from validation.reference.closed_forms.hertz import HertzImpact


def shear_speed(shear_modulus: float, density: float) -> float:
    """c_s = sqrt(G/rho) [m/s] from [Pa] and [kg/m^3]."""
    return sqrt(shear_modulus / density)


def slowness_ratio(poissons_ratio: float) -> float:
    """c_s/c_d = sqrt[(1 - 2 nu)/(2 (1 - nu))]; zero for nu = 1/2, which pressure waves cross at once."""
    return sqrt((1.0 - 2.0 * poissons_ratio) / (2.0 * (1.0 - poissons_ratio)))


@lru_cache(maxsize=64)
def admittance_parts(poissons_ratio: float) -> tuple[float, float, float]:
    """I(nu) in three parts, by horizontal slowness times c_s: up to c_s/c_d, from there to 1, Rayleigh waves."""
    h2 = slowness_ratio(poissons_ratio) ** 2

    def steep(x: float) -> float:
        a, b = sqrt(h2 - x * x), sqrt(1.0 - x * x)
        return x * a / ((2.0 * x * x - 1.0) ** 2 + 4.0 * x * x * a * b)

    def flat(x: float) -> float:
        a, b = sqrt(x * x - h2), sqrt(1.0 - x * x)
        return 4.0 * x**3 * a * a * b / ((2.0 * x * x - 1.0) ** 4 + (4.0 * x * x * a * b) ** 2)

    def rayleigh(x: float) -> float:
        return (2.0 * x * x - 1.0) ** 2 - 4.0 * x * x * sqrt((x * x - h2) * (x * x - 1.0))

    first = quad(steep, 0.0, sqrt(h2), epsabs=1e-13)[0] if h2 > 0.0 else 0.0
    second = quad(flat, sqrt(h2), 1.0, epsabs=1e-13)[0]
    root: float = brentq(rayleigh, 1.0 + 1e-9, 3.0, xtol=1e-14)  # type: ignore[assignment]
    a, b = sqrt(root**2 - h2), sqrt(root**2 - 1.0)
    slope = 8.0 * root * (2.0 * root**2 - 1.0) - 8.0 * root * a * b - 4.0 * root**3 * (a / b + b / a)
    return float(first), float(second), pi * root * a / abs(slope)


def radiated_share(impact: HertzImpact, mass: float, speed: float, *, shear: float, density: float, nu: float) -> float:
    """Part of the energy of a normal impact that leaves as waves in a half-space.

    With P = k d^(3/2), integral (dP/dt)^2 dt = 1.8 Beta(4/5, 3/2) k^2 V d_m^2. First order: the impact itself is taken
    as that of Hertz. Effective mass [kg] and approach speed [m/s] of the impact; G [Pa], rho [kg/m^3] and Poisson's
    ratio of the half-space.
    """
    rate = 1.8 * float(beta(0.8, 1.5)) * impact.stiffness**2 * speed * impact.overlap**2
    admittance = sum(admittance_parts(nu)) / (2.0 * pi * density * shear_speed(shear, density) ** 3)
    return admittance * rate / (0.5 * mass * speed**2)


@lru_cache(maxsize=64)
def lowest_mode(poissons_ratio: float) -> float:
    """omega R/c_s of the slowest oscillation that a normal impact can excite: spheroidal, n = 2 (ball to egg).

    Root of Lamb's frequency equation of the free sphere; spherical Bessel functions of the pressure wave enter only by
    x j_3(x)/j_2(x), which is zero for nu = 1/2.
    """
    ratio = slowness_ratio(poissons_ratio)

    def equation(eta: float) -> float:
        xi = ratio * eta
        bend = xi * float(spherical_jn(3, xi) / spherical_jn(2, xi)) if xi > 0.0 else 0.0
        j2, j3 = float(spherical_jn(2, eta)), eta * float(spherical_jn(3, eta))
        half = 0.5 * eta * eta
        return (2.0 - half + 2.0 * bend) * ((3.0 - half) * j2 + j3) - 6.0 * (j2 - j3) * (1.0 - bend)

    grid = np.linspace(1.0, 4.0, 301)
    values = np.array([equation(float(eta)) for eta in grid])
    first = int(np.flatnonzero(values[:-1] * values[1:] < 0.0)[0])
    root: float = brentq(equation, float(grid[first]), float(grid[first + 1]), xtol=1e-14)  # type: ignore[assignment]
    return float(root)


def mode_period(radius: float, poissons_ratio: float, shear_modulus: float, density: float) -> float:
    """Period of that oscillation [s] of a ball of radius [m], G [Pa] and rho [kg/m^3]."""
    return 2.0 * pi * radius / (lowest_mode(poissons_ratio) * shear_speed(shear_modulus, density))
