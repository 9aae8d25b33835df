"""Whole impacts of the microslip law in scaled variables, eight at a time: psi_2 from psi_1 and chi.

All impacts of one restitution share the normal motion. So they also share, for each step and node, the stiffness and
the limit of the traction. The integration of an impact that starts sliding begins where it sticks. Impacts are sorted
by that step, so that those side by side have nearly all steps in common.

All nodes move by the displacement itself, without the second factor of `nodes.levers`. An impact follows no path twice,
so no energy can be gained; and if the tangential motion is proportional to the normal one (2 chi = 1), the nodes have
no error.
"""

from __future__ import annotations

from functools import partial
from math import sqrt
from typing import NamedTuple

import numpy as np

from contactlaw.jit import jit, jit_of_sums
from contactlaw.laws.base import Array, Impacts
from contactlaw.laws.normal_motion import SQRT_5_4, first_stick, normal_motion, time_of_phases
from contactlaw.laws.oscillator import phase_point

LANES = 8  # impacts integrated side by side


class Nodes(NamedTuple):
    """Squared positions and weights of the nodes on the scaled contact line; the weights include 2 E* = 3/2."""

    x2: Array
    w: Array


class NodeTable(NamedTuple):
    """Table of steps and nodes, all times the weight of the node.

    Attributes:
        nodes: The nodes.
        gain: Traction per unit displacement, shape (steps, n).
        cap: Limit of the traction, shape (steps, n).
        share: 1 over the sum of the limits, shape (steps,).
    """

    nodes: Nodes
    gain: Array
    cap: Array
    share: Array


def impacts(zeta: float, steps: int, x: Array, w: Array) -> Impacts:
    """Return the kernel for whole impacts with its tables. x, w: positions and weights of the nodes on [0, 1]."""
    motion = normal_motion(zeta, steps, False)
    span = sqrt(float(motion.delta.max()))
    nodes = node_table(motion.delta, Nodes((span * x) ** 2, 1.5 * span * w))
    known = motion.theta, motion.delta, motion.v_mid, motion.step
    return partial(rebound, known, tuple(nodes), zeta)  # numba dispatches plain tuples faster than named ones


@jit
def node_table(delta, nodes):
    """Return the `NodeTable` of the overlaps of a normal motion."""
    steps, n = delta.size - 1, nodes.w.size
    gain, cap = np.zeros((steps, n)), np.zeros((steps, n))
    share = np.zeros(steps)
    for k in range(1, steps):
        gained, total = delta[k] - delta[k - 1], 0.0
        for i in range(n):
            z = delta[k] - nodes.x2[i]
            if z > 0.0:
                gain[k, i] = nodes.w[i] * (z / gained if z < gained else 1.0)
                cap[k, i] = nodes.w[i] * z
                total += cap[k, i]
        share[k] = 1.0 / total if total > 0.0 else 0.0
    return NodeTable(nodes, gain, cap, share)


@jit_of_sums
def rebound(motion, nodes, zeta, psi_1, chi, psi_2_out):
    """psi_2 of whole impacts, arrays (n,). motion: theta, delta, v_mid and step of `Motion`. nodes: `NodeTable`."""
    (theta, _, v_mid, _), steps, many = motion, motion[2].size, psi_1.size
    _, v_end = phase_point(theta[steps], zeta)
    join, stick = np.zeros(many, np.int64), np.empty((many, 3))
    count = np.zeros(steps + 2, np.int64)  # impacts that begin in each step; then their first index in the order
    for j in range(many):
        psi, c = abs(psi_1[j]), 2.0 * chi[j]
        if psi >= 1.0 and psi >= c * (1.0 - v_end) + v_end:
            psi_2_out[j] = psi - c * (1.0 - v_end)
        elif psi >= 1.0:
            phase, k, psi, v = first_stick(psi, chi[j], zeta, theta, 1.0)
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
    q, work = np.empty((LANES, nodes[1].shape[1])), np.empty((3, LANES))  # tractions; psi, 2 chi, F/(mu P)
    for at in range(sliding, many, LANES):
        lanes = min(LANES, many - at)
        last = join[order[at + lanes - 1]]
        q[:] = 0.0
        work[:] = 0.0
        for lane in range(lanes):
            j = order[at + lane]
            work[0, lane], work[1, lane] = stick[j, 1], 2.0 * chi[j]
            if join[j] > 1:
                begin(motion, nodes, zeta, join[j] - 1, stick[j], q[lane], work[:, lane])
            if join[j] < last:
                run(motion, nodes, join[j], min(last, steps), q[lane : lane + 1], work[:, lane : lane + 1])
        run(motion, nodes, min(last, steps), steps, q[:lanes], work[:, :lanes])
        for lane in range(lanes):
            j = order[at + lane]
            psi_2_out[j] = work[0, lane] - work[1, lane] * work[2, lane] * (v_mid[steps - 1] - v_end)
    for j in range(many):
        if psi_1[j] < 0.0:
            psi_2_out[j] = -psi_2_out[j]


@jit_of_sums
def begin(motion, nodes, zeta, k, stick, q_out, work_io):
    """Advance an impact from the instant at which it sticks to the end of step k.

    stick: phase of that instant, psi there, and v midway to the end of the step, of `first_stick`.
    """
    (theta, delta, v_mid, _), (line, _, cap, share) = motion, nodes
    phase, psi, v = stick[0], stick[1], stick[2]
    y, w_now = phase_point(phase, zeta)
    overlap = (SQRT_5_4 * y) ** 0.8
    psi -= work_io[1] * (w_now - v)
    if k < v_mid.size:  # the rest of the step, in which the overlap at the instant of sticking is the first
        du, pull = psi * time_of_phases(phase, theta[k], zeta), 0.0
        gained = delta[k] - overlap
        rate = 1.0 / gained if gained > 0.0 else 1e300
        for i in range(q_out.size):
            held, z = line.w[i] * max(overlap - line.x2[i], 0.0), max(delta[k] - line.x2[i], 0.0)
            q_out[i] = min(max(held + line.w[i] * min(z * rate, 1.0) * du, -cap[k, i]), cap[k, i])
            pull += q_out[i]
        work_io[2] = pull * share[k]
        psi -= work_io[1] * work_io[2] * (v - v_mid[k])
    work_io[0] = psi


@jit_of_sums
def run(motion, nodes, start, end, q, work):
    """Advance impacts side by side from step `start` to `end`. q: tractions (lanes, n). work: psi, 2 chi, F/(mu P).

    The loop over lanes is inside that over steps: the steps of one lane depend on each other, those of different lanes
    do not, so the processor overlaps them.
    """
    (_, _, v_mid, dt), (_, gain, cap, part), psi, share = motion, nodes, work[0], work[2]
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
