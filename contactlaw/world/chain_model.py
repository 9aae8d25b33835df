"""Equations of motion of a chain of hinges (`chain`), compiled.

Newton's and Euler's equations of all bodies, projected by the Jacobians (Kane & Levinson 1985):

    M = sum_b m J^T J + W^T I W      M a = sum_b m J^T (g - dJ/dt v) - W^T (I dW/dt v + w x I w)

J and W (3, n) give the velocity of a body's centre of mass and its spin w by v, and I is its inertia in the world.
"""

from __future__ import annotations

from functools import lru_cache
from math import sqrt
from typing import Any

from contactlaw.jit import jit_inside
from contactlaw.world.access import body_at, element
from contactlaw.world.call import model_function
from contactlaw.world.motion import set_axes
from contactlaw.world.records import VECTOR as THREE
from contactlaw.world.records import record
from contactlaw.world.trees import clear, vector
from contactlaw.world.vec import add, cross, dot, half_turn, load, scale, store, sub, to_body, to_world

LINK = record(anchor=THREE, hinge=THREE, axis=THREE, point=THREE, direction=THREE)
"""As `chain.Link`; and where its hinge and its axis are in the world."""

link_at: Any = element(LINK)


@jit_inside
def turned(q, turn):
    """The quaternion of a body that has turned by a rotation vector along its axes [rad]."""
    c, s = half_turn(dot(turn, turn))
    u, p = (q[1], q[2], q[3]), scale(s, turn)
    w = c * q[0] - dot(u, p)
    x, y, z = add(cross(u, p), add(scale(c, u), scale(q[0], p)))
    one = 1.0 / sqrt(w * w + x * x + y * y + z * z)
    return one * w, one * x, one * y, one * z


@jit_inside
def set_quaternion(b, q):
    """Turn a body."""
    for i in range(4):
        b.quaternion[i] = q[i]
    set_axes(b)


def move(t):
    """See `records.TREE`."""
    q, x = vector(t.q, t.q_size), vector(t.x, t.v_size)
    free = t.v_size > t.count
    first = 6 if free else 0  # of the hinges' velocities
    base = body_at(t.bodies, 0)
    if free:
        for i in range(3):
            q[i] += x[i]
        store(base.position, load(q))
        set_quaternion(base, turned((q[3], q[4], q[5], q[6]), (x[3], x[4], x[5])))
        for i in range(4):
            q[3 + i] = base.quaternion[i]
    for i in range(1 if free else 0, t.count):
        k = first + i - free
        angle = k + (1 if free else 0)
        q[angle] += x[k]
        b, link = body_at(t.bodies, i), link_at(t.model, i)
        point, before = load(link.anchor), (1.0, 0.0, 0.0, 0.0)
        if i > 0:
            parent = body_at(t.bodies, i - 1)
            point = add(load(parent.position), to_world(parent.axes, point))
            before = (parent.quaternion[0], parent.quaternion[1], parent.quaternion[2], parent.quaternion[3])
        set_quaternion(b, turned(before, scale(q[angle], load(link.axis))))
        store(link.point, point)
        store(link.direction, to_world(b.axes, load(link.axis)))
        store(b.position, sub(point, to_world(b.axes, load(link.hinge))))
    for i in range(t.count):
        fill_jacobian(t, i, free, first)


@jit_inside
def fill_jacobian(t, i, free, first):
    """Velocity and spin of body i by each velocity: of an axis e through p, e x (position - p) and e."""
    b, base = body_at(t.bodies, i), body_at(t.bodies, 0)
    j = vector(t.jacobian + 48 * t.v_size * i, (6, t.v_size))
    clear(vector(t.jacobian + 48 * t.v_size * i, 6 * t.v_size))
    for k in range(first + i + 1 - free):
        if k < first - 3:
            j[k, k] = 1.0
            continue
        if k < first:
            e, point = (base.axes[k - 3], base.axes[k], base.axes[k + 3]), load(base.position)
        else:
            link = link_at(t.model, k - first + free)
            e, point = load(link.direction), load(link.point)
        velocity = cross(e, sub(load(b.position), point))
        j[0, k], j[1, k], j[2, k] = velocity
        j[3, k], j[4, k], j[5, k] = e


@jit_inside
def fill_bias(t, first, free):
    """Accelerations of the bodies where a = 0: each hinge's axis turns with the body before it."""
    v, bias = vector(t.v, t.v_size), vector(t.bias, (t.count, 6))
    linear, angular, before = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for i in range(t.count):
        b, link = body_at(t.bodies, i), link_at(t.model, i)
        spin = load(b.spin)
        if i >= free:
            if i > 0:
                arm = sub(load(link.point), load(body_at(t.bodies, i - 1).position))
                linear = add(linear, turning(angular, before, arm))
            angular = add(angular, scale(v[first + i - free], cross(before, load(link.direction))))
            linear = add(linear, turning(angular, spin, sub(load(b.position), load(link.point))))
        before = spin
        bias[i, 0], bias[i, 1], bias[i, 2] = linear
        bias[i, 3], bias[i, 4], bias[i, 5] = angular


@jit_inside
def turning(alpha, w, arm):
    """Acceleration of a point over another of the same body."""
    return add(cross(alpha, arm), cross(w, cross(w, arm)))


def accelerate(t):
    """See `records.TREE`."""
    n = t.v_size
    free = 1 if n > t.count else 0
    fill_bias(t, 6 * free, free)
    a, m, bias = vector(t.a, n), vector(t.factor, (n, n)), vector(t.bias, (t.count, 6))
    clear(a)
    clear(vector(t.factor, n * n))
    for i in range(t.count):
        b, j = body_at(t.bodies, i), vector(t.jacobian + 48 * n * i, (6, n))
        mass, spin = 1.0 / b.inverse_mass, load(b.spin)
        push = scale(mass, sub(load(t.gravity), (bias[i, 0], bias[i, 1], bias[i, 2])))
        moment = add(inertia(b, (bias[i, 3], bias[i, 4], bias[i, 5])), cross(spin, inertia(b, spin)))
        for k in range(n):
            linear, angular = (j[0, k], j[1, k], j[2, k]), (j[3, k], j[4, k], j[5, k])
            a[k] += dot(linear, push) - dot(angular, moment)
            momentum, about = scale(mass, linear), inertia(b, angular)
            for other in range(k + 1):
                m[k, other] += dot(momentum, (j[0, other], j[1, other], j[2, other])) + dot(
                    about, (j[3, other], j[4, other], j[5, other])
                )
    factorise(m, n)
    solve(m, a, n)


@jit_inside
def inertia(b, w):
    """I w in the world."""
    own, i = to_body(b.axes, w), b.inverse_inertia
    return to_world(b.axes, (own[0] / i[0], own[1] / i[1], own[2] / i[2]))


@jit_inside
def factorise(m, n):
    """The lower triangle of a matrix becomes its Cholesky factor."""
    for k in range(n):
        for other in range(k + 1):
            s = m[k, other]
            for i in range(other):
                s -= m[k, i] * m[other, i]
            m[k, other] = sqrt(s) if k == other else s / m[other, other]


@jit_inside
def solve(m, x, n):
    """x becomes the solution of L L^T y = x."""
    for k in range(n):
        for i in range(k):
            x[k] -= m[k, i] * x[i]
        x[k] /= m[k, k]
    for k in range(n - 1, -1, -1):
        for i in range(k + 1, n):
            x[k] -= m[i, k] * x[i]
        x[k] /= m[k, k]


def respond(t):
    """See `records.TREE`."""
    solve(vector(t.factor, (t.v_size, t.v_size)), vector(t.x, t.v_size), t.v_size)


@lru_cache
def addresses() -> dict[str, int]:
    """Where these functions stand, compiled."""
    functions = {"move": move, "accelerate": accelerate, "respond": respond}
    return {name: model_function(function) for name, function in functions.items()}
