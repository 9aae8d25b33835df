"""How a tree of bodies moves: what `motion` calls for a body that joints hold.

With q the generalised coordinates, v the velocities, M(q) the mass matrix, J_b the Jacobian of a body:

    flight     classical Runge-Kutta steps of q' = v, v' = a(q, v)
    drift      q <- q + h v + h^2/2 a,  v <- v + h a,  all of the tree's bodies at q: a substep of the leapfrog
    kick       v <- v + M^-1 J_b^T (p, r x p), an impulse p at an arm r of a body; all velocities J v anew
    mobility   d . J M^-1 J^T d

M and a are held for a few substeps, from the middle of these: what is left out is of second order in how far the tree
goes in this time. The middle is foreseen with the contact forces that there are: a holds centripetal terms, which jump
with v.
"""

from __future__ import annotations

from ctypes import CFUNCTYPE, c_uint64
from functools import lru_cache
from math import ceil, sqrt

import numba

from contactlaw.jit import address_of, jit_inside
from contactlaw.world.access import body_at, numbers_at, tree_at
from contactlaw.world.call import MOBILITY, WITH_BODY, WITH_NUMBER, WITH_VECTORS, call_on_tree
from contactlaw.world.motion import LEAST_MOBILITY, lightness, set_axes
from contactlaw.world.records import Array, Arrays, numbers_of
from contactlaw.world.vec import add, cross, dot, load, norm, scale, store, sub

HOLD = 8  # substeps that M and a are held for
LONGEST_HOLD = 1e-3  # [s]
LARGEST_TURN = 0.1  # [rad] of a Runge-Kutta step


@jit_inside
def vector(address, size):
    """The numbers at an address."""
    return numba.carray(numbers_at(address), size)


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
        vector(t.x, t.v_size)[:] = 0.0
        place(t)
        accelerate(t)
        t.stale = 0
        t.hold = 0


def fly(b, until):
    """Bring a tree to a time [s] of the step, in free flight."""
    t = tree_at(b.tree, 0)
    left = until - b.time
    steps = int(max(ceil(abs(left) * t.rate / LARGEST_TURN), 1.0))
    h = left / steps
    for _ in range(steps):
        runge_kutta(t, h)
    for i in range(t.count):
        body_at(t.bodies, i).time = until


@jit_inside
def runge_kutta(t, h):
    """One step of h [s], from accelerations that are those of q and v."""
    n = t.v_size
    q, v, a, x = vector(t.q, t.q_size), vector(t.v, n), vector(t.a, n), vector(t.x, n)
    q0, rest = vector(t.room, t.q_size), vector(t.room + 8 * t.q_size, (3, n))
    q0[:] = q
    rest[0] = v
    rest[1] = v  # sums of velocities and of accelerations
    rest[2] = a
    for stage in range(3):
        part = h if stage == 2 else 0.5 * h
        weight = 1.0 if stage == 2 else 2.0
        for k in range(n):
            x[k] = part * v[k]
            v[k] = rest[0, k] + part * a[k]
            rest[1, k] += weight * v[k]
        q[:] = q0
        place(t)
        call_on_tree(t.accelerate, t)
        for k in range(n):
            rest[2, k] += weight * a[k]
    for k in range(n):
        x[k] = h / 6.0 * rest[1, k]
        v[k] = rest[0, k] + h / 6.0 * rest[2, k]
    q[:] = q0
    place(t)
    accelerate(t)
    t.hold = 0
    for i in range(t.count):
        b = body_at(t.bodies, i)
        b.turned += abs(h) * t.rate


def drift(b, h):
    """Move a tree for h [s] without contacts; `shift` and `twist` are what its bodies moved by."""
    t = tree_at(b.tree, 0)
    n = t.v_size
    for i in range(t.count):
        one = body_at(t.bodies, i)
        store(one.shift, load(one.position))
        store(one.twist, load(one.spin))
    if t.hold == 0:
        foresee(t, h)
    t.hold -= 1
    v, a, x = vector(t.v, n), vector(t.a, n), vector(t.x, n)
    for k in range(n):
        x[k] = h * (v[k] + 0.5 * h * a[k])
        v[k] += h * a[k]
    place(t)
    for i in range(t.count):
        one = body_at(t.bodies, i)
        store(one.shift, sub(load(one.position), load(one.shift)))
        store(one.twist, scale(0.5 * h, add(load(one.spin), load(one.twist))))
        one.turned += norm(load(one.twist))
        one.time += h
    vector(t.push, n)[:] = 0.0
    t.stale = 1


@jit_inside
def foresee(t, h):
    """Find mass matrix and accelerations for the next substeps of h [s], in the middle of them."""
    n = t.v_size
    t.hold = int(max(min(HOLD, LONGEST_HOLD / h), 1.0))
    half = 0.5 * h * t.hold
    q, v, a, x = vector(t.q, t.q_size), vector(t.v, n), vector(t.a, n), vector(t.x, n)
    push, q0, v0 = vector(t.push, n), vector(t.room, t.q_size), vector(t.room + 8 * t.q_size, n)
    q0[:] = q
    v0[:] = v
    for k in range(n):
        change = half * (a[k] + push[k] / h)
        x[k] = half * (v[k] + 0.5 * change)
        v[k] += change
    place(t)
    accelerate(t)
    q[:] = q0
    v[:] = v0


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


@lru_cache
def addresses() -> dict[str, int]:
    """Where these functions stand, compiled, by their names in `records.TREE`."""
    return {
        "fly": address_of(fly, WITH_NUMBER), "drift": address_of(drift, WITH_NUMBER),
        "settle": address_of(settle, WITH_BODY), "kick": address_of(kick, WITH_VECTORS),
        "mobility": address_of(mobility, MOBILITY), "spread": address_of(spread, WITH_BODY),
    }  # fmt: skip


def numbers(world: Arrays, number: int, name: str) -> Array:
    """Those that a tree keeps by a name, a view."""
    tree = world.trees[number]
    sizes = numbers_of(tree)
    names = list(sizes)
    first = int(tree["numbers"]) + sum(sizes[one] for one in names[: names.index(name)])
    return world.joints[first : first + sizes[name]]


def coordinates(world: Arrays, number: int) -> tuple[Array, Array]:
    """Coordinates and velocities of a tree."""
    return numbers(world, number, "q").copy(), numbers(world, number, "v").copy()


def write_coordinates(world: Arrays, number: int, q: Array, v: Array) -> None:
    """Put a tree somewhere: new are its coordinates, its velocities and all that follows from them."""
    for name, value in (("q", q), ("v", v)):
        own = numbers(world, number, name)
        if value.shape != own.shape:
            raise ValueError(f"{name}: shape {value.shape}; must be {own.shape}")
        own[:] = value
    tree = world.trees[number]
    tree["stale"] = 1
    CFUNCTYPE(None, c_uint64)(int(tree["settle"]))(int(tree["bodies"]))
