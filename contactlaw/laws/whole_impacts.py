"""Whole impacts in scaled variables, eight at a time: psi_2 from psi_1 and chi, for springs with a Coulomb limit each.

The springs are the nodes of `microslip`, or the only one of `single_spring`. All impacts of one restitution share the
normal motion. So they also share, for each step and spring, the stiffness and the limit of the traction. While a
contact slides as a whole, all springs are on their limits, and psi is exact.

All nodes move by the displacement itself, without the second factor of `nodes.levers`. An impact follows no path twice,
so no energy can be gained; and if the tangential motion is proportional to the normal one (2 chi = 1), the nodes have
no error.
"""

from functools import partial
from math import copysign, sqrt

import numpy as np

from contactlaw.jit import jit, jit_module, jit_of_sums
from contactlaw.laws.base import Array, Impacts
from contactlaw.laws.normal_motion import normal_motion

LANES = 8  # impacts integrated side by side
WHOLE = np.ones(1)  # position and weight of a single spring


def impacts(
    zeta: float, steps: int, x: Array = WHOLE, w: Array = WHOLE, *, linear: bool = False, rescaled: bool = False
) -> Impacts:
    """Return the kernel for whole impacts with its tables.

    Args:
        zeta: Damping ratio.
        steps: Steps per impact.
        x, w: Positions and weights of the nodes on [0, 1], shape (n,); n = 1: a single spring for the whole contact.
        linear: Whether the single spring is linear, as the normal one is.
        rescaled: Whether the force of the single spring is reduced as the contact shrinks, see `single_spring`.
    """
    motion = normal_motion(zeta, steps, linear)
    span = sqrt(motion.deepest)
    springs = (span * x) ** 2, 1.5 * span * w, linear, rescaled  # the weights include 2 E* = 3/2
    held = (
        2.0 / 3.0 if rescaled else 1.0
    )  # of the fall of P, that a sliding spring follows: rescaling gives up the rest
    return partial(rebound, (motion.v_mid, motion.step, motion.speed[-1], held), table(motion.delta, springs))


@jit
def table(delta, springs):
    """`gains` and `limits` of all steps of a normal motion, (steps, n), and 1 over the sums of the limits, (steps,).

    Tractions are counted over their reduction by rescaling since the first step, so that `rebound` need not reduce
    them.
    """
    steps, n, faded = delta.size - 1, springs[1].size, 1.0
    gain, cap, share = np.zeros((steps, n)), np.zeros((steps, n)), np.zeros(steps)
    for k in range(1, steps):
        faded *= gains(springs, delta[k - 1], delta[k], gain[k])
        share[k] = limits(springs, delta[k], cap[k]) * faded
        for i in range(n):
            gain[k, i], cap[k, i] = gain[k, i] / faded, cap[k, i] / faded
    return gain, cap, share


def limits(springs, overlap, cap_out):
    """Limits of the tractions at an overlap, times the weight; returns 1 over their sum."""
    (x2, w, linear, _), total = springs, 1e-300
    if w.size == 1:
        cap_out[0] = overlap if linear else overlap * sqrt(overlap)
        return 1.0 / max(cap_out[0], 1e-300)
    for i in range(w.size):
        cap_out[i] = w[i] * max(overlap - x2[i], 0.0)
        total += cap_out[i]
    return 1.0 / total


def gains(springs, before, overlap, gain_out):
    """Tractions of the springs per unit displacement, times the weight, in a step of the overlap.

    Returns the factor by which rescaling reduces the tractions before; half of it acts on those of the displacement.
    """
    x2, w, linear, rescaled = springs
    if w.size == 1:
        a, b = sqrt(before), sqrt(overlap)
        fade = b / a if rescaled and b < a else 1.0
        gain_out[0] = 1.0 if linear else sqrt(fade) * (a * a + a * b + b * b) / (a + b)  # 3/2 a averaged over the step
        return fade
    rate = 1.0 / (overlap - before) if overlap > before else 1e300
    for i in range(w.size):
        gain_out[i] = w[i] * min(max(overlap - x2[i], 0.0) * rate, 1.0)
    return 1.0


def rebound(motion, rows, psi_1, chi, psi_2_out):
    """psi_2 of whole impacts, arrays (n,). motion: v_mid and step of `Motion`, v at the end, held. rows: of `table`.

    The loop over lanes is inside that over steps: the steps of one lane depend on each other, those of different lanes
    do not, so the processor overlaps them.
    """
    (v_mid, dt, v_end, held), (gain, cap, part), many = motion, rows, psi_1.size
    steps, n = cap.shape
    q, psi, fall, share = np.empty((LANES, n)), np.empty(LANES), np.empty(LANES), np.empty(LANES)
    for at in range(0, many, LANES):
        lanes = min(LANES, many - at)
        q[:] = 0.0
        for lane in range(lanes):
            psi[lane], fall[lane] = psi_1[at + lane], 2.0 * chi[at + lane]
            share[lane] = min(max(psi[lane], -1.0), 1.0)  # F/(mu P) at the touch
            psi[lane] -= fall[lane] * share[lane] * (1.0 - v_mid[0])
        for k in range(1, steps):
            drop, length = v_mid[k - 1] - v_mid[k], dt[k - 1]
            for lane in range(lanes):
                du, pull = psi[lane] * length, 0.0
                for i in range(n):
                    t = min(max(q[lane, i] + gain[k, i] * du, -cap[k, i]), cap[k, i])
                    q[lane, i] = t
                    pull += t
                share[lane] = pull * part[k]
                psi[lane] -= fall[lane] * share[lane] * drop
        for lane in range(lanes):
            psi_2_out[at + lane] = psi[lane] - fall[lane] * share[lane] * (v_mid[steps - 1] - v_end)
            lost, before = fall[lane] * (1.0 - v_end), psi_1[at + lane]
            if abs(before) >= max(lost + held * v_end, 1.0):  # slides throughout, to the bit of its bound
                psi_2_out[at + lane] = before - copysign(lost, before)


jit_module(__name__, jit_of_sums)
