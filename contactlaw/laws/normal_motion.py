"""Normal motion of a whole impact, scaled so that m = V_z1 = 1 and P = delta^1.5 (P = delta with linear springs).

An impact then obeys delta'' = -P and psi' = -2 chi F/mu. The normal motion does not depend on the tangential one.
Therefore it is tabulated once, in closed form (`oscillator`), at equal phases theta, and shared by all impacts; each
step then integrates the tangential springs alone. psi advances by the exact normal impulse of a step times the
mobilised share F/(mu P). So gross slip is exact.
"""

from functools import lru_cache
from math import sqrt
from typing import NamedTuple

import numpy as np

from contactlaw.jit import jit
from contactlaw.laws.base import Array
from contactlaw.laws.oscillator import end_phase, phase_point
from contactlaw.laws.record import record

SQRT_5_4 = sqrt(1.25)
SCALED_DEEPEST = 1.25**0.4  # greatest overlap without damping
TIME_PER_PHASE = 0.8 * SCALED_DEEPEST  # dt = TIME_PER_PHASE y^(-1/5) dtheta

TRACK = np.dtype((np.record, record("force", "stored", "work", "speed")))
"""An instant of an impact: tangential force [N], elastic energy [J], work of the force so far [J], sliding speed [m/s].
"""


@jit
def time_of_phases(start, end, zeta):
    """Scaled time between two phases, TIME_PER_PHASE times the integral of y^(-1/5) dtheta, by 5 Gauss points.

    Near an end at which y is zero the variable is the fifth root of the distance from it, without a singularity.
    """
    length, last, total = end - start, end_phase(zeta), 0.0
    for i in range(5):
        s, w = GAUSS_5[i, 0], GAUSS_5[i, 1]
        if start < 0.5 * length:
            theta, weight = start + length * s**5, 5.0 * s**4
        elif zeta == 0.0 and end >= last:
            theta, weight = end - length * s**5, 5.0 * s**4
        else:
            theta, weight = start + length * s, 1.0
        y, _ = phase_point(theta, zeta)
        total += w * weight * max(y, 1e-300) ** -0.2
    return TIME_PER_PHASE * total * length


_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(5)
GAUSS_5 = np.column_stack([0.5 * (_POINTS + 1.0), 0.5 * _WEIGHTS])


class Motion(NamedTuple):
    """A scaled normal motion at steps + 1 instants, the shape of all arrays; with linear springs time is phase."""

    deepest: float  # greatest overlap of these instants
    theta: Array  # phase
    delta: Array  # overlap
    root: Array  # its square root
    force: Array  # normal force
    ratio: Array  # normal force over the undamped one
    v_mid: Array  # closing speed in the middle of each step, (steps,)
    drop: Array  # decrease of the closing speed from half a step before an instant to half a step after
    speed: Array  # closing speed
    energy: Array  # elastic energy
    instant: Array  # time
    step: Array  # time to the next instant


@jit
def normal_table(zeta, steps, linear):
    """The `Motion` of a whole impact."""
    end, before = end_phase(zeta), 1.0
    theta, v_mid = np.linspace(0.0, end, steps + 1), np.empty(steps)
    delta, force, ratio, energy = np.zeros(steps + 1), np.zeros(steps + 1), np.zeros(steps + 1), np.zeros(steps + 1)
    drop, speed, instant, step = np.empty(steps + 1), np.empty(steps + 1), np.zeros(steps + 1), np.zeros(steps + 1)
    for k in range(steps + 1):
        y, speed[k] = phase_point(theta[k], zeta)
        y, after = max(y, 0.0), speed[k]
        if k > 0:
            delta[k] = y if linear else (SQRT_5_4 * y) ** 0.8
        if 0 < k < steps:
            ratio[k] = max(y + 2.0 * zeta * speed[k], 0.0) / y
            force[k] = ratio[k] * (y if linear else delta[k] ** 1.5)
        # With a damper the final overlap still holds elastic energy, but no force remains that could return it.
        if zeta == 0.0 or k < steps:
            energy[k] = 0.5 * delta[k] ** 2 if linear else 0.4 * delta[k] ** 2.5
        if k < steps:
            _, v_mid[k] = phase_point(0.5 * (theta[k] + theta[k + 1]), zeta)
            step[k] = theta[k + 1] - theta[k] if linear else time_of_phases(theta[k], theta[k + 1], zeta)
            instant[k + 1] = instant[k] + step[k]
            after = v_mid[k]
        drop[k], before = before - after, after
    return Motion(np.max(delta), theta, delta, np.sqrt(delta), force, ratio, v_mid, drop, speed, energy, instant, step)


normal_motion = lru_cache(maxsize=64)(normal_table)


@lru_cache(maxsize=64)
def duration(zeta: float) -> float:
    """Scaled time of a whole impact, by Gauss points in s, where s^5 is the distance in phase from its start or end."""
    end = end_phase(zeta)
    omega = np.emath.sqrt(1.0 - zeta * zeta) if abs(zeta - 1.0) > 1e-6 else 1e-4
    s, weights = np.polynomial.legendre.leggauss(40)
    s = 0.5 * (s + 1.0)
    total = 0.0
    for theta in (0.5 * end * s**5, end - 0.5 * end * s**5):
        y = np.exp(-zeta * theta) * np.real(np.sin(omega * theta) / omega)
        total += weights @ (1.25 * end * s**4 * y**-0.2)
    return float(TIME_PER_PHASE * total)
