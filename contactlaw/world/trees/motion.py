"""How a tree of bodies moves between contacts: in free flight, and in the substeps of a leapfrog.

    flight     Runge-Kutta steps of q' = v, v' = a(q, v), of fourth order
    drift      q <- q + h v + h^2/2 a,  v <- v + h a,  all of the tree's bodies at q

Damping that would slow a velocity faster than the steps of a flight can follow comes behind it by half a step:
M + h/2 D takes the place of M, as in linearly implicit methods; all velocities still go where the forces send them.
In the leapfrog a group of T seconds begins with v0 and damps by the implicit midpoint rule, contacts included: with
M + T/2 D for M all of it gives v1 - v0 = M^-1 (T (f - D (v0 + v1)/2) + p). Where it is so stiff that this would swing,
it comes behind by as much as lets no velocity lose more than half of it in a substep: with M + s D a rate r becomes
r/(1 + s r).

In the leapfrog the mass matrix M and a are held for a few substeps, as they are in the middle of the kicks that end
these: what is left out is of second order in how far the tree goes in this time. The drift between two such groups has
the mean of both a. The middle is foreseen with the contact forces that there are, for a holds centripetal terms, which
jump with v.
"""

from __future__ import annotations

from math import ceil

from contactlaw.jit import jit_inside
from contactlaw.world.data.access import body_at, link_at, tree_at
from contactlaw.world.data.call import call_on_tree
from contactlaw.world.data.vec import add, load, norm, scale, store, sub
from contactlaw.world.trees.dynamics import decay
from contactlaw.world.trees.kinematics import vector
from contactlaw.world.trees.mobility import accelerate, clear, copy, place, take_up

HOLD = 4
LONGEST_HOLD, HELD_TURN = 2e-3, 0.02  # [s], or [rad] where the tree turns slowly
LARGEST_TURN, MOST = 0.1, 1e4  # [rad] of a Runge-Kutta step; how many steps a flight has, at most
LARGEST_DECAY = 0.5  # of a velocity by damping, in such a step
LARGEST_LAG = 2.0  # of a velocity, by damping that does not lag, in a group of substeps
STIFF = 4.0  # steps that damping may ask of a flight; then it lags


def fly(b, until):
    """Bring a tree to a time [s] of the step, in free flight."""
    t = tree_at(b.tree, 0)
    left = until - b.time
    t.decay = decay(t)
    longest = abs(left) / max(min(ceil(abs(left) * t.decay / LARGEST_DECAY), STIFF), 1.0)
    while left != 0.0:
        steps = max(min(ceil(abs(left) * t.change_rate / LARGEST_TURN), MOST), ceil(abs(left) / longest - 1e-6))
        h = left / steps
        runge_kutta(t, h)
        left = left - h if steps > 1.0 else 0.0
    for i in range(t.count):
        body_at(t.bodies, i).time = until


@jit_inside
def runge_kutta(t, h):
    """One step of h [s], from accelerations that are those of q and v; of fourth order, on rotations too.

    The classical method with two moves where one would not commute (Celledoni, Marthinsen & Owren 2003):
    q4 = q moved by h/2 v1, then by h (v3 - v1/2); at the end by h/12 (3 v1 + 2 v2 + 2 v3 - v4), then by
    h/12 (-v1 + 2 v2 + 2 v3 + 3 v4).
    """
    n = t.v_size
    if t.decay * abs(h) > 2.0 * LARGEST_DECAY:
        t.lag = 0.5 * abs(h)
        call_on_tree(t.accelerate, t)
    q, v, a = vector(t.q, t.q_size), vector(t.v, n), vector(t.a, n)
    rest = t.room + 8 * t.q_size
    q0, v0 = vector(t.room, t.q_size), vector(rest, n)
    middle, gained = vector(rest + 8 * n, n), vector(rest + 16 * n, n)  # v2 + v3; sum of accelerations
    copy(q, q0)
    copy(v, v0)
    clear(middle)
    copy(a, gained)
    for stage in range(3):
        last = stage == 2
        part, weight = (h, 1.0) if last else (0.5 * h, 2.0)
        copy(q0, q)
        if last:
            combine(t, 0.5 * h, v0, 0.0, v)
            call_on_tree(t.move, t)
        combine(t, part, v, -0.5 * h if last else 0.0, v0)
        for k in range(n):
            v[k] = v0[k] + part * a[k]
            middle[k] += 0.0 if last else v[k]
        place(t)
        call_on_tree(t.accelerate, t)
        for k in range(n):
            gained[k] += weight * a[k]
    for k in range(n):
        v[k] -= v0[k]
        middle[k] = 2.0 * middle[k] + 2.0 * v0[k] + v[k]  # v1 + 2 v2 + 2 v3 + v4; and v4 - v1 in v
    copy(q0, q)
    combine(t, h / 12.0, middle, -h / 6.0, v)
    call_on_tree(t.move, t)
    combine(t, h / 12.0, middle, h / 6.0, v)
    for k in range(n):
        v[k] = v0[k] + h / 6.0 * gained[k]
    t.lag = 0.0
    place(t)
    accelerate(t)
    t.hold = 0
    for i in range(t.count):
        b = body_at(t.bodies, i)
        b.turned += abs(h) * link_at(t.links, i).rate


@jit_inside
def combine(t, r, a, s, b):
    """x <- r a + s b."""
    x = vector(t.x, t.v_size)
    for k in range(t.v_size):
        x[k] = r * a[k] + s * b[k]


def drift(b, h):
    """Move a tree for h [s] without contacts; `shift` and `twist` are what its bodies moved by."""
    t = tree_at(b.tree, 0)
    n = t.v_size
    take_up(t)
    for i in range(t.count):
        one = body_at(t.bodies, i)
        store(one.shift, load(one.position))
        store(one.twist, load(one.spin))
    v, a, x = vector(t.v, n), vector(t.a, n), vector(t.x, n)
    before = a
    if t.hold == 0 or t.held != h:
        before = vector(t.room + 8 * (t.q_size + n), n)
        copy(a, before)
        foresee(t, h)
    t.hold -= 1
    for k in range(n):
        gain = 0.5 * h * (before[k] + a[k])
        x[k] = h * (v[k] + 0.5 * gain)
        v[k] += gain
    place(t)
    for i in range(t.count):
        one = body_at(t.bodies, i)
        store(one.shift, sub(load(one.position), load(one.shift)))
        store(one.twist, scale(0.5 * h, add(load(one.spin), load(one.twist))))
        one.turned += norm(load(one.twist))
        one.time += h
    clear(vector(t.kick_v, n))
    t.stale = 1


@jit_inside
def foresee(t, h):
    """Find mass matrix and accelerations for the next substeps of h [s], as they are amid the kicks that end these."""
    n = t.v_size
    longest = min(max(LONGEST_HOLD, HELD_TURN / max(t.change_rate, 1e-9)), LARGEST_LAG / max(t.decay, 1e-9))
    t.hold = int(max(min(HOLD, longest / h), 1.0)) if t.held == h else 1
    kicks = 0.5 * t.hold if t.held > 0.0 else 1.0  # of a group's first substep half a kick is known
    t.held = h
    stiff = h * t.decay > LARGEST_LAG
    t.lag = h / LARGEST_DECAY - 1.0 / t.decay if stiff else 0.5 * h * t.hold
    half = 0.5 * h * (t.hold + 1)
    q, v, a, x = vector(t.q, t.q_size), vector(t.v, n), vector(t.a, n), vector(t.x, n)
    push, q0, v0 = vector(t.kick_v, n), vector(t.room, t.q_size), vector(t.room + 8 * t.q_size, n)
    copy(q, q0)
    copy(v, v0)
    for k in range(n):
        change = half * a[k] + kicks * push[k]
        x[k] = half * (v[k] + 0.5 * change)
        v[k] += change
    place(t)
    t.midway = 0 if stiff else 1
    accelerate(t)
    t.lag, t.midway = 0.0, 0
    copy(q0, q)
    copy(v0, v)
