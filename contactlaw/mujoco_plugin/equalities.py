"""Equality constraints of bodies that joints hold: welds, connects, joints that are held at a value.

They are soft: the force along row J is D (a_ref - J a), with a_ref = -B J v - K I r (MuJoCo documentation,
Computation, "Constraint model"). Within the step they go on as they do there: with

    E = J^T D J        and        J^T D (B + h/2 K I) J        added to the damping

the force is what the engine found, for the accelerations and velocities that it found it with; it answers to what
contacts change about them, as a mass and a damper would. r goes by h/2 J v in the mean over a step of h seconds. Held
constant instead, a weld would push on by 20 times what a light hand weighs after the hand has been stopped.

What concerns joints of two branches, or of two trees, is held constant still.
"""

from __future__ import annotations

from contactlaw.mujoco_plugin.block import entry, floats
from contactlaw.mujoco_plugin.layout import data_at, jit
from contactlaw.world.access import axis_at
from contactlaw.world.tree_kinematics import vector
from contactlaw.world.trees import clear


@jit
def hold(head, j, t):
    """Let the equality constraints of a tree answer to its accelerations and velocities; f and D are known."""
    d, n = data_at(head.data, 0), t.v_size
    inertia, damping, row = vector(t.e, (n, n)), vector(t.d, (n, n)), vector(t.x, n)
    f, v, a = vector(t.f, n), vector(t.v_f, n), floats(d.qacc, j.v, n)
    for k in range(n):
        clear(inertia[k])
    for i in range(d.ne):
        last = read_row(head, j, t, i)
        reference, weight = floats(d.efc_KBIP, 4 * i, 3), floats(d.efc_D, i, 1)[0]
        spring = 0.5 * head.step_size * weight * reference[0] * reference[2]
        k, push = last, 0.0
        while k >= 0:
            push += row[k] * (weight * a[k] - spring * v[k])
            k = axis_at(t.axes, k).before
        k = last
        while k >= 0:
            f[k] += push * row[k]
            p, other = axis_at(t.axes, k).depth, k
            while other >= 0:
                inertia[k, p] += weight * row[k] * row[other]
                damping[k, p] += (weight * reference[1] + spring) * row[k] * row[other]
                p, other = p - 1, axis_at(t.axes, other).before
            k = axis_at(t.axes, k).before


@jit
def read_row(head, j, t, number):
    """Write a row of the engine's Jacobian into x; returns the last axis of it, -1: not all carry that, or are here."""
    d, x = data_at(head.data, 0), vector(t.x, t.v_size)
    sparse = d.nJ != d.nefc * head.nv  # if all entries are kept, they are in the order of a dense one
    first = entry(d.efc_J_rowadr, number) if sparse else number * head.nv + j.v
    values = floats(d.efc_J, first, entry(d.efc_J_rownnz, number) if sparse else t.v_size)
    clear(x)
    last, left = -1, 0
    for i in range(values.size):
        k = entry(d.efc_J_colind, first + i) - j.v if sparse else i
        if values[i] != 0.0:
            if k < 0 or k >= t.v_size:
                return -1
            x[k] = values[i]
            last, left = max(last, k), left + 1
    if last >= 0 and not sparse:
        left = 0
        for value in floats(d.efc_J, number * head.nv, head.nv):
            left += 1 if value != 0.0 else 0
    k = last
    while k >= 0:
        left -= 1 if x[k] != 0.0 else 0
        k = axis_at(t.axes, k).before
    return last if left == 0 else -1
