"""A tree of bodies in an implicit step: its masses, its Jacobians, and where its velocities take it."""

from __future__ import annotations

from contactlaw.world.data.access import axis_at, tree_at
from contactlaw.world.trees.dynamics import limit_force, load_axes
from contactlaw.world.trees.kinematics import vector
from contactlaw.world.trees.mobility import clear, copy, place


def move_from_start(b):
    """Move the coordinates that the step began with by x; all bodies there, with the velocities that there are."""
    t = tree_at(b.tree, 0)
    copy(vector(t.start, t.q_size), vector(t.q, t.q_size))
    place(t)
    t.stale = 1


def write_masses(b):
    """Write the mass matrix L^T D L of the step's start where the tree's `weights` are."""
    t = tree_at(b.tree, 0)
    n = t.v_size
    m, out = vector(t.factor, (n, n)), vector(t.weights, (n, t.stride))
    for k in range(n):
        i, p, pivot = k, axis_at(t.axes, k).depth, 1.0 / axis_at(t.axes, k).inverse
        while i >= 0:
            left = pivot * (1.0 if i == k else m[k, p])
            j, q = k, axis_at(t.axes, k).depth
            while j >= 0:
                out[i, j] += left * (1.0 if j == k else m[k, q])
                j, q = axis_at(t.axes, j).before, q - 1
            i, p = axis_at(t.axes, i).before, p - 1


def add_damping(b):
    """Add what damping and limits that are reached do, to the weights; in x what they have added to the forces.

    With D and limits as `trees.dynamics` has them: b D + b^2 K, and -D (V - v) and the change of a limit's force.
    """
    t = tree_at(b.tree, 0)
    n = t.v_size
    d, out, x = vector(t.d, (n, n)), vector(t.weights, (n, t.stride)), vector(t.x, n)
    q, v = vector(t.q, t.q_size), vector(t.v, n)
    q0, v0 = vector(t.start, t.q_size), vector(t.start + 8 * t.q_size, n)
    clear(x)
    for k in range(n):
        axis = axis_at(t.axes, k)
        i, p = k, axis.depth
        while i >= 0:
            out[k, i] += t.stage * d[k, p]
            x[k] -= d[k, p] * (v[i] - v0[i])
            if i != k:
                out[i, k] += t.stage * d[k, p]
                x[i] -= d[k, p] * (v[k] - v0[k])
            i, p = axis_at(t.axes, i).before, p - 1
        if axis.side != 0.0:
            now = max(limit_force(axis, q[axis.coordinate], v[k]), 0.0)
            x[k] += axis.side * (now - max(limit_force(axis, q0[axis.coordinate], v0[k]), 0.0))
            if now > 0.0:
                out[k, k] += t.stage * (axis.resistance + t.stage * axis.stiffness)


def add_force(b, force, moment):
    """Add to x what a force on a body and a moment do along the tree's velocities."""
    t = tree_at(b.tree, 0)
    load_axes(t, b, force, moment, vector(t.x, t.v_size), 1.0)
