"""Trees of bodies: their velocities and accelerations, what an impulse does to one, and how much it gives way.

With q the generalised coordinates, v the velocities, M(q) the mass matrix, J_b the Jacobian of a body:

    kick       v <- v + M^-1 J_b^T (p, r x p), an impulse p at an arm r of a body; all velocities J v anew
    mobility   d . J M^-1 J^T d

`motion` calls these functions by their addresses, for bodies that joints hold; and those of `tree_motion`. They in
turn ask the model of the joints (`records.TREE`: move, accelerate, respond).
"""

from __future__ import annotations

from math import sqrt

from numba import carray  # pyright: ignore[reportPrivateImportUsage]

from contactlaw.jit import jit_inside
from contactlaw.world.access import body_at, numbers_at, tree_at
from contactlaw.world.call import call_on_tree
from contactlaw.world.motion import LEAST_MOBILITY, lightness, set_axes
from contactlaw.world.vec import add, cross, dot, load, norm, store


@jit_inside
def vector(address, size):
    """The numbers at an address."""
    return carray(numbers_at(address), size)


@jit_inside
def copy(source, target):
    """Copy numbers; a loop compiles faster than an assignment of arrays."""
    for k in range(source.size):
        target[k] = source[k]


@jit_inside
def clear(target):
    """Make numbers zero."""
    for k in range(target.size):
        target[k] = 0.0


@jit_inside
def place(t):
    """Move the coordinates by x, and bring all bodies along."""
    call_on_tree(t.move, t)
    for i in range(t.count):
        set_axes(body_at(t.bodies, i))
    spread_velocity(t)


@jit_inside
def spread_velocity(t):
    """Give all bodies their velocity and spin J v."""
    v = vector(t.v, t.v_size)
    for i in range(t.count):
        b = body_at(t.bodies, i)
        linear, angular = of_body(t, i, v)
        store(b.velocity, linear)
        store(b.spin, angular)


@jit_inside
def of_body(t, i, v):
    """J v of one body: along its centre of mass, and about it."""
    n = t.v_size
    jacobian = vector(t.jacobian + 48 * n * i, (6, n))
    x = y = z = u = w = s = 0.0
    for k in range(n):
        x += jacobian[0, k] * v[k]
        y += jacobian[1, k] * v[k]
        z += jacobian[2, k] * v[k]
        u += jacobian[3, k] * v[k]
        w += jacobian[4, k] * v[k]
        s += jacobian[5, k] * v[k]
    return (x, y, z), (u, w, s)


@jit_inside
def accelerate(t):
    """The mass matrix and the accelerations at q and v, those of the bodies too: J a + dJ/dt v."""
    call_on_tree(t.accelerate, t)
    a, bias = vector(t.a, t.v_size), vector(t.bias, (t.count, 6))
    t.rate = 0.0
    t.pull = 0.0
    for i in range(t.count):
        b = body_at(t.bodies, i)
        linear, angular = of_body(t, i, a)
        store(b.acceleration, add(linear, (bias[i, 0], bias[i, 1], bias[i, 2])))
        store(b.turning, add(angular, (bias[i, 3], bias[i, 4], bias[i, 5])))
        t.rate = max(t.rate, norm(load(b.spin)) + sqrt(norm(load(b.turning))))
        t.pull = max(t.pull, norm(load(b.acceleration)))


def settle(b):
    """Find the accelerations of a tree whose coordinates or velocities have been changed."""
    t = tree_at(b.tree, 0)
    if t.stale != 0:
        clear(vector(t.x, t.v_size))
        place(t)
        accelerate(t)
        t.stale = 0
        t.hold = 0


def kick(b, arm, impulse):
    """Give a body of a tree an impulse [N s] at an arm [m] from its centre of mass."""
    t = tree_at(b.tree, 0)
    x, v, push = vector(t.x, t.v_size), vector(t.v, t.v_size), vector(t.push, t.v_size)
    respond(t, b, arm, impulse)
    for k in range(t.v_size):
        v[k] += x[k]
        push[k] += x[k]
    spread_velocity(t)
    t.stale = 1


@jit_inside
def respond(t, b, arm, impulse):
    """x <- M^-1 J^T p of an impulse [N s] on a body."""
    n = t.v_size
    x, jacobian = vector(t.x, n), vector(t.jacobian + 48 * n * b.member, (6, n))
    moment = cross(arm, impulse)
    for k in range(n):
        x[k] = dot((jacobian[0, k], jacobian[1, k], jacobian[2, k]), impulse)
        x[k] += dot((jacobian[3, k], jacobian[4, k], jacobian[5, k]), moment)
    call_on_tree(t.respond, t)


def mobility(a, arm_a, b, arm_b, direction):
    """Velocity [m/s] of a point of B along a unit vector, by a unit impulse along it on a point of A [1/kg]."""
    t = tree_at(a.tree, 0)
    respond(t, a, arm_a, direction)
    linear, angular = of_body(t, b.member, vector(t.x, t.v_size))
    out = dot(add(linear, cross(angular, arm_b)), direction)
    return out if a.member != b.member else max(out, LEAST_MOBILITY * a.inverse_mass)


def spread(b):
    """Hand on to the tree's other bodies by how much impacts may change the velocity of one.

    By Cauchy and Schwarz, one point's answer to a kick at another is at most the geometric mean of both mobilities.
    """
    t = tree_at(b.tree, 0)
    for i in range(t.count):
        one = body_at(t.bodies, i)
        one.delta_v = max(one.delta_v, b.delta_v * sqrt(max(lightness(one) / lightness(b), 1.0)))
