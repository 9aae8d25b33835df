"""A tree of bodies in an implicit step: its mass matrix, its Jacobians, and the pose that its velocities lead to."""

from contactlaw.jit import jit
from contactlaw.world.data.access import axis_at, tree_at
from contactlaw.world.data.records import PLACED
from contactlaw.world.trees.dynamics import add_impulse, limit_force
from contactlaw.world.trees.kinematics import vector
from contactlaw.world.trees.mobility import clear, copy, move_bodies


def move_from_start(b):
    """Move the tree by x from its coordinates at the start of the step; sets poses and velocities of its bodies."""
    t = tree_at(b.tree, 0)
    copy(vector(t.start, t.q_size), vector(t.q, t.q_size))
    move_bodies(t)
    t.stale = PLACED


def write_masses(b):
    """Add the mass matrix of the start of the step to the matrix at `weights`."""
    t = tree_at(b.tree, 0)
    add_masses(t, vector(t.weights, (t.v_size, t.stride)))


@jit
def add_masses(t, out):
    """Add the mass matrix L^T D L to a matrix, see `trees.dynamics`."""
    m = vector(t.factor, (t.v_size, t.v_size))
    for k in range(t.v_size):
        i, p, pivot = k, axis_at(t.axes, k).depth, 1.0 / axis_at(t.axes, k).inverse
        while i >= 0:
            left = pivot * (1.0 if i == k else m[k, p])
            j, q = k, axis_at(t.axes, k).depth
            while j >= 0:
                out[i, j] += left * (1.0 if j == k else m[k, q])
                j, q = axis_at(t.axes, j).parent, q - 1
            i, p = axis_at(t.axes, i).parent, p - 1


def add_damping(b):
    """Add damping and active limits to the matrix at `weights`; x <- their force, less that at the start of the step.

    With D and limits as in `trees.dynamics`: b D + b^2 K, and -D (V - v) and the change of a limit's force. In a single
    stage springs keep the force of the start, which then neither adds to their energy nor takes from it.
    """
    t = tree_at(b.tree, 0)
    n, held = t.v_size, 1.0 if t.stage == t.span else 0.0
    d, out, x = vector(t.d, (n, n)), vector(t.weights, (n, t.stride)), vector(t.x, n)
    springs = vector(t.springs, (n, n))
    q, v = vector(t.q, t.q_size), vector(t.v, n)
    q0, v0 = vector(t.start, t.q_size), vector(t.start + 8 * t.q_size, n)
    clear(x)
    for k in range(n):
        axis = axis_at(t.axes, k)
        for i in range(n):
            spring = held * springs[k, i]
            own = d[k, i] - spring
            out[k, i] += t.stage * own
            x[k] += spring * v0[i] - own * (v[i] - v0[i])
        if axis.side != 0.0:
            now = max(limit_force(axis, q[axis.coordinate], v[k]), 0.0)
            x[k] += axis.side * (now - max(limit_force(axis, q0[axis.coordinate], v0[k]), 0.0))
            if now > 0.0:
                out[k, k] += t.stage * (axis.resistance + t.stage * axis.stiffness)


def add_force(b, force, moment):
    """Add the generalised force of a force on a body and a moment to x."""
    t = tree_at(b.tree, 0)
    add_impulse(t, b, force, moment, vector(t.x, t.v_size), 1.0)
