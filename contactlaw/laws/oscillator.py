"""The damped Hertz impact in closed form.

With y proportional to delta^(5/4) the damped Hertz motion obeys v dv/dy = -(y + 2 zeta v). In the plane of y and v it
is the linear damped oscillator, so its restitution, greatest overlap and velocity at any phase theta are elementary.
The contact ends when its force y + 2 zeta v falls to zero, at theta = 2 acos(zeta)/sqrt(1 - zeta^2) (the time found for
the linear spring and dashpot by Schwager & Poeschel, Granular Matter 9 (2007) 465); there v = -exp(-zeta theta).
"""

from math import acos, acosh, cos, cosh, exp, sin, sinh, sqrt

from contactlaw.jit import jit_module


def end_phase(zeta):
    """Phase at which the contact force falls to zero, for damping ratio zeta >= 0."""
    if abs(zeta - 1.0) < 1e-6:
        return 2.0 - 2.0 / 3.0 * (zeta - 1.0)
    if zeta < 1.0:
        return 2.0 * acos(zeta) / sqrt(1.0 - zeta * zeta)
    return 2.0 * acosh(zeta) / sqrt((zeta - 1.0) * (zeta + 1.0))


def restitution(zeta):
    """Restitution of the damped impact, which ends at zero force."""
    return exp(-zeta * end_phase(zeta))


def damping_ratio(e):
    """Damping ratio zeta of a restitution 0 < e <= 1, the inverse of `restitution`, by bisection to rounding."""
    if e == 1.0:
        return 0.0
    low, high = 0.0, 1.0 + 1.0 / sqrt(e)
    while True:
        middle = 0.5 * (low + high)
        if middle in (low, high):
            return middle
        if restitution(middle) > e:
            low = middle
        else:
            high = middle


def phase_point(theta, zeta):
    """Scaled y and v at a phase; at the touch y = theta and v = 1."""
    if abs(zeta - 1.0) < 1e-6:
        s, c = theta, 1.0
    elif zeta < 1.0:
        omega = sqrt(1.0 - zeta * zeta)
        s, c = sin(omega * theta) / omega, cos(omega * theta)
    else:
        omega = sqrt((zeta - 1.0) * (zeta + 1.0))
        s, c = sinh(omega * theta) / omega, cosh(omega * theta)
    fade = exp(-zeta * theta)
    return fade * s, fade * (c - zeta * s)


jit_module(__name__)
