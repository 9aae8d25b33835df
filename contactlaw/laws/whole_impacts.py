"""Whole impacts in scaled variables, eight at a time: psi_2 from psi_1 and chi, for springs with a Coulomb limit each.

The springs are the nodes of `microslip`, or the only one of `single_spring`. All impacts of one restitution share the
normal motion. So they also share, for each step and spring, the stiffness and the limit of the traction. The
integration of an impact that starts sliding begins where it sticks. Impacts are sorted by that step, so that those side
by side have nearly all steps in common.

All nodes move by the displacement itself, without the second factor of `nodes.levers`. An impact follows no path twice,
so no energy can be gained; and if the tangential motion is proportional to the normal one (2 chi = 1), the nodes have
no error.
"""

from functools import partial
from math import sqrt

import numpy as np

from contactlaw.jit import jit, jit_module, jit_of_sums
from contactlaw.laws.base import Array, Impacts
from contactlaw.laws.normal_motion import SQRT_5_4, first_stick, normal_motion, time_of_phases
from contactlaw.laws.oscillator import phase_point

LANES = 8  # impacts integrated side by side
WHOLE = np.ones(1)  # position and weight of a single spring


def impacts(
    zeta: float, steps: int, x: Array = WHOLE, w: Array = WHOLE, *, linear: bool = False, held: float = 1.0
) -> Impacts:
    """Return the kernel for whole impacts with its tables.

    Args:
        zeta: Damping ratio.
        steps: Steps per impact.
        x, w: Positions and weights of the nodes on [0, 1], shape (n,); n = 1: a single spring for the whole contact.
        linear: Whether the single spring is linear, as the normal one is.
        held: Share of the fall of P that a sliding spring must follow; rescaling gives up the rest by itself.
    """
    motion = normal_motion(zeta, steps, linear)
    span = sqrt(motion.deepest)
    springs = (span * x) ** 2, 1.5 * span * w, linear, held  # the weights include 2 E* = 3/2
    known = motion.theta, motion.delta, motion.v_mid, motion.step, zeta
    return partial(rebound, known, springs, table(motion.delta, springs))


@jit
def table(delta, springs):
    """`gains` and `limits` of all steps of a normal motion, (steps, n), and 1 over the sums of the limits, (steps,).

    Tractions are counted over their reduction by rescaling since the first step, the last array, so that `run` need not
    reduce them.
    """
    steps, n = delta.size - 1, springs[1].size
    gain, cap, share, faded = np.zeros((steps, n)), np.zeros((steps, n)), np.zeros(steps), np.ones(steps)
    for k in range(1, steps):
        faded[k] = faded[k - 1] * gains(springs, delta[k - 1], delta[k], gain[k])
        share[k] = limits(springs, delta[k], cap[k]) * faded[k]
        for i in range(n):
            gain[k, i], cap[k, i] = gain[k, i] / faded[k], cap[k, i] / faded[k]
    return gain, cap, share, faded


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
    x2, w, linear, held = springs
    if w.size == 1:
        a, b = sqrt(before), sqrt(overlap)
        fade = b / a if held < 1.0 and b < a else 1.0
        gain_out[0] = 1.0 if linear else sqrt(fade) * (a * a + a * b + b * b) / (a + b)  # 3/2 a averaged over the step
        return fade
    rate = 1.0 / (overlap - before) if overlap > before else 1e300
    for i in range(w.size):
        gain_out[i] = w[i] * min(max(overlap - x2[i], 0.0) * rate, 1.0)
    return 1.0


def rebound(motion, springs, rows, psi_1, chi, psi_2_out):
    """psi_2 of whole impacts, arrays (n,). motion: theta, delta, v_mid and step of `Motion`; zeta. rows: of `table`."""
    (theta, _, v_mid, _, zeta), (_, w, _, held), many = motion, springs, psi_1.size
    steps, n = v_mid.size, w.size
    _, v_end = phase_point(theta[steps], zeta)
    join, stick = np.zeros(many, np.int64), np.empty((many, 3))
    count = np.zeros(steps + 2, np.int64)  # impacts that begin in each step; then their first index in the order
    for j in range(many):
        psi, c = abs(psi_1[j]), 2.0 * chi[j]
        if psi >= 1.0 and psi >= c * (1.0 - v_end) + held * v_end:
            psi_2_out[j] = psi - c * (1.0 - v_end)
        elif psi > 1.0:
            phase, k, psi, v = first_stick(psi, chi[j], zeta, theta, held)
            stick[j, 0], stick[j, 1], stick[j, 2] = phase, psi, v
            join[j] = k + 2
        else:  # the contact starts stuck: F/(mu P) = psi_1 at the touch
            stick[j, 1] = psi - c * psi * (1.0 - v_mid[0])
            join[j] = 1
        count[join[j]] += 1
    sliding, at = count[0], 0
    for k in range(steps + 2):
        at, count[k] = at + count[k], at
    order = np.empty(many, np.int64)
    for j in range(many):
        order[count[join[j]]] = j
        count[join[j]] += 1
    q, gain, work = np.empty((LANES, n)), np.empty(n), np.empty((3, LANES))  # work: psi, 2 chi, F/(mu P)
    for at in range(sliding, many, LANES):
        lanes = min(LANES, many - at)
        last = join[order[at + lanes - 1]]
        q[:] = 0.0
        work[:] = 0.0
        for lane in range(lanes):
            j = order[at + lane]
            work[0, lane], work[1, lane] = stick[j, 1], 2.0 * chi[j]
            if join[j] > 1:
                begin(motion, springs, rows, join[j] - 1, stick[j], (q[lane], gain), work[:, lane])
            if join[j] < last:
                run(motion, rows, join[j], min(last, steps), q[lane : lane + 1], work[:, lane : lane + 1])
        run(motion, rows, min(last, steps), steps, q[:lanes], work[:, :lanes])
        for lane in range(lanes):
            j = order[at + lane]
            psi_2_out[j] = work[0, lane] - work[1, lane] * work[2, lane] * (v_mid[steps - 1] - v_end)
    for j in range(many):
        if psi_1[j] < 0.0:
            psi_2_out[j] = -psi_2_out[j]


def begin(motion, springs, rows, k, stick, out, work_io):
    """Advance an impact from the instant at which it sticks to the end of step k.

    stick: phase, psi and v of `first_stick`. out: tractions of the springs, and room for their gains, (n,).
    """
    (theta, delta, v_mid, _, zeta), (_, _, linear, _), (_, cap, share, faded), (q, gain) = motion, springs, rows, out
    phase, psi, v = stick[0], stick[1], stick[2]
    y, w_now = phase_point(phase, zeta)
    overlap = y if linear else (SQRT_5_4 * y) ** 0.8
    psi -= work_io[1] * (w_now - v)
    if k < v_mid.size:  # the rest of the step, in which the overlap at the instant of sticking is the first
        du, pull = psi * (theta[k] - phase if linear else time_of_phases(phase, theta[k], zeta)), 0.0
        limits(springs, overlap, q)  # at that instant all tractions are on their limits
        fade, one = gains(springs, overlap, delta[k], gain), 1.0 / faded[k]
        for i in range(q.size):
            q[i] = min(max(one * (fade * q[i] + gain[i] * du), -cap[k, i]), cap[k, i])
            pull += q[i]
        work_io[2] = pull * share[k]
        psi -= work_io[1] * work_io[2] * (v - v_mid[k])
    work_io[0] = psi


def run(motion, rows, start, end, q, work):
    """Advance impacts side by side from step `start` to `end`. q: tractions (lanes, n). work: psi, 2 chi, F/(mu P).

    The loop over lanes is inside that over steps: the steps of one lane depend on each other, those of different lanes
    do not, so the processor overlaps them.
    """
    (_, _, v_mid, dt, _), (gain, cap, part, _), psi, share = motion, rows, work[0], work[2]
    for k in range(start, end):
        drop, length = v_mid[k - 1] - v_mid[k], dt[k - 1]
        for lane in range(q.shape[0]):
            du, pull = psi[lane] * length, 0.0
            for i in range(q.shape[1]):
                t = min(max(q[lane, i] + gain[k, i] * du, -cap[k, i]), cap[k, i])
                q[lane, i] = t
                pull += t
            share[lane] = pull * part[k]
            psi[lane] -= work[1, lane] * share[lane] * drop


jit_module(__name__, jit_of_sums)
