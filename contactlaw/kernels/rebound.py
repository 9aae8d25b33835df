"""Whole impacts in scaled variables: psi_1 and chi in, psi_2 out.

Scaled so that m = V_z1 = 1 and P = delta^1.5, an impact obeys delta'' = -P and psi' = -2 chi F/mu. The normal motion
does not depend on the tangential one, so it is tabulated once in closed form (`oscillator`) at equal phases theta and
shared by all impacts; per step only the tangential springs are left. psi is advanced by the exact normal impulse of
each step times the mobilised share F/(mu P), so gross slip is exact, and so is the start of stick: sliding ends where
psi has fallen to the closing velocity (all points of a sliding contact move together; appendix of Maw, Barber &
Fawcett 1981).
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from contactlaw.jit import jit, jit_of_sums
from contactlaw.kernels.contact import RESCALED
from contactlaw.kernels.oscillator import end_phase, phase_of_velocity, phase_point

SQRT_5_4 = sqrt(1.25)
SCALED_DEEPEST = 1.25**0.4  # greatest overlap without damping
TIME_PER_PHASE = 0.8 * SCALED_DEEPEST  # dt = this y^(-1/5) dtheta


@jit
def time_of_phases(start, end, zeta):
    """Scaled time between two phases, the integral of y^(-1/5) dtheta.

    Gauss-Legendre with 5 points; where y starts or ends at zero, in a variable whose fifth power is the distance from
    there, which makes a polynomial of the singularity.
    """
    length = end - start
    last = end_phase(zeta)
    total = 0.0
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


@jit
def normal_table(zeta, steps, linear):
    """The normal motion at equal phases.

    Returns theta, delta, force, ratio (force over the undamped one) at steps + 1 phases; v_mid, dt of the steps
    between. With linear normal springs delta is y and time is phase.
    """
    end = end_phase(zeta)
    theta = np.linspace(0.0, end, steps + 1)
    delta, force, ratio = np.zeros(steps + 1), np.zeros(steps + 1), np.zeros(steps + 1)
    v_mid, dt = np.empty(steps), np.empty(steps)
    for k in range(steps):
        middle = 0.5 * (theta[k] + theta[k + 1])
        y, v_mid[k] = phase_point(middle, zeta)
        dt[k] = theta[k + 1] - theta[k] if linear else time_of_phases(theta[k], theta[k + 1], zeta)
    for k in range(1, steps + 1):
        y, v = phase_point(theta[k], zeta)
        y = max(y, 0.0)
        delta[k] = y if linear else (SQRT_5_4 * y) ** 0.8
        if k < steps:
            ratio[k] = max(y + 2.0 * zeta * v, 0.0) / y
            force[k] = ratio[k] * (y if linear else delta[k] ** 1.5)
    return theta, delta, force, ratio, v_mid, dt


@jit
def node_table(delta, x, w):
    """Per step and node: traction gained per unit displacement, cap (both times the node's weight); summed caps.

    x, w: abscissae and weights of the nodes in the scaled contact line, the factor 2 E* = 3/2 included in w.
    """
    steps, n = delta.size - 1, x.size
    gain, cap = np.zeros((steps, n)), np.zeros((steps, n))
    total = np.zeros(steps)
    for k in range(1, steps):
        gained = delta[k] - delta[k - 1]
        for i in range(n):
            z = delta[k] - x[i] * x[i]
            if z > 0.0:
                gain[k, i] = w[i] * (z / gained if z < gained else 1.0)
                cap[k, i] = w[i] * z
                total[k] += cap[k, i]
    return gain, cap, total


@jit
def first_stick(psi_1, chi, zeta, theta, held):
    """Phase and step at which an impact that starts sliding sticks; psi there, and v midway through what is left.

    It slides while psi outruns the closing speed; where the bodies part, the share held of it, see `held_of`.
    """
    share = 1.0 if psi_1 <= 2.0 * chi else held
    v = (2.0 * chi - psi_1) / (2.0 * chi - share)
    phase = phase_of_velocity(v, zeta)
    k = min(int(phase / theta[1]), theta.size - 2)
    _, v_mid = phase_point(0.5 * (phase + theta[k + 1]), zeta)
    return phase, k, share * v, v_mid


@jit
def held_of(rescaled):
    """Share of the fall of P that a spring on its limit must follow: the rest it gives up by its own rescaling."""
    return 1.0 - RESCALED if rescaled else 1.0


@jit_of_sums
def rebound_microslip(psi_1, chi, zeta, x, w, theta, delta, v_mid, dt, gain, cap, total, psi_2_out):
    """psi_2 of each impact (flat arrays) by the microslip law."""
    steps, n = dt.size, x.size
    _, v_end = phase_point(theta[steps], zeta)
    q = np.empty(n)
    for j in range(psi_1.size):
        side = 1.0 if psi_1[j] >= 0.0 else -1.0
        psi, c = side * psi_1[j], 2.0 * chi[j]
        if psi > 1.0 and psi >= c * (1.0 - v_end) + v_end:
            psi_2_out[j] = side * (psi - c * (1.0 - v_end))
            continue
        q[:] = 0.0
        start, v, share, length, overlap = 0, v_mid[0], 0.0, dt[0], 0.0
        if psi > 1.0:
            phase, start, psi, v = first_stick(psi, chi[j], zeta, theta, 1.0)
            y, w_now = phase_point(phase, zeta)
            overlap = (SQRT_5_4 * y) ** 0.8
            for i in range(n):
                q[i] = w[i] * max(overlap - x[i] * x[i], 0.0)
            length = time_of_phases(phase, theta[start + 1], zeta)
            psi -= c * (w_now - v)
        else:  # F/(mu P) of a contact that sticks from the touch on is psi_1 at first
            psi -= c * psi * (1.0 - v)
        for k in range(start + 1, steps):
            du, pull = psi * length, 0.0
            if k == start + 1 and overlap > 0.0:  # the step that sticking cut short: gains from the overlap then
                for i in range(n):
                    z = delta[k] - x[i] * x[i]
                    part = min(z / (delta[k] - overlap), 1.0) if delta[k] > overlap else 1.0
                    q[i] = min(max(q[i] + w[i] * part * du, -cap[k, i]), cap[k, i]) if z > 0.0 else 0.0
                    pull += q[i]
            else:
                for i in range(n):
                    q[i] = min(max(q[i] + gain[k, i] * du, -cap[k, i]), cap[k, i])
                    pull += q[i]
            share = pull / total[k] if total[k] > 0.0 else 0.0
            psi -= c * share * (v - v_mid[k])
            v, length = v_mid[k], dt[k]
        psi_2_out[j] = side * (psi - c * share * (v - v_end))


@jit_of_sums
def rebound_single_spring(psi_1, chi, zeta, linear, rescaled, theta, delta, v_mid, dt, psi_2_out):
    """psi_2 of each impact (flat arrays) by one spring under one cap: linear_spring, mindlin, mindlin_rescaled."""
    steps = dt.size
    _, v_end = phase_point(theta[steps], zeta)
    held = held_of(rescaled)
    for j in range(psi_1.size):
        side = 1.0 if psi_1[j] >= 0.0 else -1.0
        psi, c = side * psi_1[j], 2.0 * chi[j]
        if psi > 1.0 and psi >= c * (1.0 - v_end) + held * v_end:
            psi_2_out[j] = side * (psi - c * (1.0 - v_end))
            continue
        start, v, share, length, q, before = 0, v_mid[0], 0.0, dt[0], 0.0, 0.0
        if psi > 1.0:
            phase, start, psi, v = first_stick(psi, chi[j], zeta, theta, held)
            y, w_now = phase_point(phase, zeta)
            before = y if linear else (SQRT_5_4 * y) ** 0.8
            q = before if linear else before**1.5
            length = theta[start + 1] - phase if linear else time_of_phases(phase, theta[start + 1], zeta)
            psi -= c * (w_now - v)
        else:
            psi -= c * psi * (1.0 - v)
        for k in range(start + 1, steps):
            a, b = sqrt(before), sqrt(delta[k])
            shrink = sqrt(b / a) if rescaled and b < a else 1.0
            stiffness = 1.0 if linear else (a * a + a * b + b * b) / (a + b)  # 3/2 a averaged over the overlap
            q = shrink * (shrink * q + stiffness * psi * length)
            load = delta[k] if linear else delta[k] ** 1.5
            q = min(max(q, -load), load)
            share = q / load
            psi -= c * share * (v - v_mid[k])
            v, length, before = v_mid[k], dt[k], delta[k]
        psi_2_out[j] = side * (psi - c * share * (v - v_end))
