"""How a body moves between forces, what an impulse does to it, and how much it gives way.

The only file that knows how a free body moves. A body of a tree moves with all of it: the functions of `trees` and
`trees.motion` are called by their addresses.
"""

from __future__ import annotations

from math import ceil, sqrt

from contactlaw.jit import jit_inside
from contactlaw.world.data.access import link_at, tree_at
from contactlaw.world.data.call import ask_mobility, call_with_body, call_with_number, call_with_vectors
from contactlaw.world.data.vec import (
    ZERO,
    add,
    axpy,
    cross,
    dot,
    load,
    load4,
    norm,
    product,
    rotate,
    rotation,
    scale,
    store,
    store4,
    sub,
    to_body,
    to_world,
    unit,
)

LARGEST_TURN, MOST = 0.1, 1e4  # [rad] a step of the rotation of a body that is not isotropic; such steps, at most
LEAST_MOBILITY = 1e-9  # of a free body's, below which a tree does not give way
EXACT = 1e-31  # relative change of a spin, squared, at which it counts as found


@jit_inside
def fly(b, until):
    """Bring a body to a time [s] of the step, in free flight."""
    if b.still == 0 and b.time != until:
        if b.tree != 0:
            call_with_number(tree_at(b.tree, 0).fly, b, until)
            return
        drift(b, until - b.time)
        settle(b)
    b.time = until


@jit_inside
def drift(b, h):
    """Move a body for h [s] without contacts; `shift` and `twist` are what it moved by. A tree moves with its first."""
    if b.tree != 0:
        if b.member == 0:
            call_with_number(tree_at(b.tree, 0).drift, b, h)
        return
    v, a = load(b.velocity), load(b.acceleration)
    shift = scale(h, axpy(0.5 * h, a, v))
    store(b.shift, shift)
    store(b.position, add(load(b.position), shift))
    store(b.velocity, axpy(h, a, v))
    b.time += h
    if b.isotropic != 0:
        w = load(b.spin)
        rate = scale(b.inverse_inertia[0], load(b.torque))
        twist = scale(h, axpy(0.5 * h, rate, w))
        store(b.twist, twist)
        store(b.pending_turn, add(load(b.pending_turn), twist))
        store(b.spin, axpy(h, rate, w))
        if b.oriented != 0:
            settle(b)
    else:
        torque = scale(0.5 * h, load(b.torque))
        store(b.momentum, add(load(b.momentum), torque))
        tumble(b, h)
        store(b.momentum, add(load(b.momentum), torque))
        store(b.spin, spin_change(b, load(b.momentum)))


@jit_inside
def settle(b):
    """Turn the quaternion by what a body has turned; a tree finds its accelerations anew."""
    if b.tree != 0:
        call_with_body(tree_at(b.tree, 0).settle, b)
        return
    t = load(b.pending_turn)
    t2 = dot(t, t)
    if t2 == 0.0:
        return
    store4(b.quaternion, unit(product(rotation(t), load4(b.quaternion))))
    b.turned += sqrt(t2)
    store(b.pending_turn, (0.0, 0.0, 0.0))
    set_axes(b)


@jit_inside
def set_axes(b):
    """The matrix of the quaternion."""
    w, x, y, z = b.quaternion[0], b.quaternion[1], b.quaternion[2], b.quaternion[3]
    m = b.axes
    m[0] = 1.0 - 2.0 * (y * y + z * z)
    m[1] = 2.0 * (x * y - w * z)
    m[2] = 2.0 * (x * z + w * y)
    m[3] = 2.0 * (x * y + w * z)
    m[4] = 1.0 - 2.0 * (x * x + z * z)
    m[5] = 2.0 * (y * z - w * x)
    m[6] = 2.0 * (x * z - w * y)
    m[7] = 2.0 * (y * z + w * x)
    m[8] = 1.0 - 2.0 * (x * x + y * y)


@jit_inside
def tumble(b, h):
    """Turn a body with three moments of inertia for h [s], free of torque: its energy and momentum stay to rounding.

    With L the angular momentum along the body, the rotation R <- R exp(theta), theta = h I^-1 (L + exp(-theta) L)/2,
    is the implicit midpoint rule of L' = L x I^-1 L for a slightly other h; that rule keeps all quadratic invariants
    (Hairer, Lubich & Wanner, Geometric Numerical Integration, section IV.2), and R L stays what it was.
    """
    total = (0.0, 0.0, 0.0)
    m, i = load(b.momentum), load(b.inverse_inertia)
    speed = norm(spin_change(b, m))
    count = max(min(ceil(speed * abs(h) / LARGEST_TURN), MOST), 1.0)
    part = h / count
    for _ in range(int(count)):
        start = to_body(b.axes, m)
        w = (i[0] * start[0], i[1] * start[1], i[2] * start[2])
        for _ in range(40):
            mean = scale(0.5, add(start, rotate(scale(-part, w), start)))
            new = (i[0] * mean[0], i[1] * mean[1], i[2] * mean[2])
            change = sub(new, w)
            w = new
            if dot(change, change) <= EXACT * dot(w, w):
                break
        turn = to_world(b.axes, scale(part, w))
        store(b.pending_turn, turn)
        settle(b)
        total = add(total, turn)
    store(b.twist, total)


@jit_inside
def spin_change(b, moment):
    """Change of spin by an angular impulse [N m s] about the centre of mass: R I^-1 R^T L [rad/s]."""
    if b.isotropic != 0:
        return scale(b.inverse_inertia[0], moment)
    p, i = to_body(b.axes, moment), b.inverse_inertia
    return to_world(b.axes, (i[0] * p[0], i[1] * p[1], i[2] * p[2]))


@jit_inside
def spin_rate(b, w):
    """Angular acceleration [rad/s^2] without contacts, at a spin."""
    return spin_change(b, sub(load(b.torque), gyroscopic(b, w)))


@jit_inside
def update_momentum(b):
    """The angular momentum of the spin that a body was given."""
    spin = load(b.spin)
    change = sub(spin, spin_change(b, load(b.momentum)))
    if b.isotropic == 0 and dot(change, change) != 0.0:
        w, i = to_body(b.axes, spin), b.inverse_inertia
        store(b.momentum, to_world(b.axes, (w[0] / i[0], w[1] / i[1], w[2] / i[2])))


@jit_inside
def gyroscopic(b, w):
    """The moment w x I w [N m]."""
    if b.isotropic != 0 or b.inverse_mass == 0.0:
        return 0.0, 0.0, 0.0
    p, i = to_body(b.axes, w), b.inverse_inertia
    return cross(w, to_world(b.axes, (p[0] / i[0], p[1] / i[1], p[2] / i[2])))


@jit_inside
def is_static(b):
    """Whether a body that nothing can push does not move by itself either."""
    return b.inverse_mass == 0.0 and dot(load(b.velocity), load(b.velocity)) + dot(load(b.spin), load(b.spin)) == 0.0


@jit_inside
def velocity_at(b, arm):
    """Velocity [m/s] of the point of a body at an arm [m] from its centre of mass."""
    return add(load(b.velocity), cross(load(b.spin), arm))


@jit_inside
def closing_at(a, arm_a, b, arm_b, n):
    """Speed [m/s] of the point of B towards that of A, along the normal from B to A."""
    return -dot(sub(velocity_at(a, arm_a), velocity_at(b, arm_b)), n)


@jit_inside
def greatest_closing(a, b):
    """Speed [m/s] at which any two points of the shapes of two bodies come nearer, at most."""
    turning = norm(load(a.spin)) * a.reach + norm(load(b.spin)) * b.reach
    return norm(sub(load(a.velocity), load(b.velocity))) + turning


@jit_inside
def acceleration_of(b):
    """Acceleration [m/s^2] of a body without contacts; none of one that sleeps, which they hold."""
    return load(b.acceleration) if b.asleep == 0 else ZERO


@jit_inside
def acceleration_at(b, arm):
    """The same of that point, without the change of spin of a free body."""
    if b.asleep != 0:
        return ZERO
    w = load(b.spin)
    return add(load(b.acceleration), add(cross(load(b.turning), arm), cross(w, cross(w, arm))))


@jit_inside
def moved_at(b, arm):
    """What that point moved by in the last substep [m]; arm: in its middle."""
    return add(load(b.shift), cross(load(b.twist), arm))


@jit_inside
def kick(b, impulse, moment):
    """Give a body an impulse [N s] and an angular one about its centre of mass [N m s]."""
    if b.tree != 0:
        call_with_vectors(tree_at(b.tree, 0).kick, b, impulse, moment)
        return
    if b.inverse_mass == 0.0:
        return
    store(b.velocity, axpy(b.inverse_mass, impulse, load(b.velocity)))
    if b.isotropic != 0:
        store(b.spin, axpy(b.inverse_inertia[0], moment, load(b.spin)))
    else:
        store(b.momentum, add(load(b.momentum), moment))
        store(b.spin, spin_change(b, load(b.momentum)))


@jit_inside
def mobility(b, arm, direction):
    """Velocity [m/s] of a point along a unit vector, by a unit impulse along it [1/kg]."""
    if b.tree != 0:
        return ask_mobility(tree_at(b.tree, 0).mobility, b, arm, b, arm, direction)
    r = cross(arm, direction)
    return b.inverse_mass + dot(r, spin_change(b, r))


@jit_inside
def mobility_between(a, arm_a, b, arm_b, direction):
    """The same of the point of A over that of B, by unit impulses on both, equal and opposite."""
    both = mobility(a, arm_a, direction) + mobility(b, arm_b, direction)
    if a.tree != 0 and a.tree == b.tree:
        both -= 2.0 * ask_mobility(tree_at(a.tree, 0).mobility, a, arm_a, b, arm_b, direction)
        both = max(both, LEAST_MOBILITY * a.inverse_mass)
    return both


@jit_inside
def mobility_bound(b, reach):
    """Mobility [1/kg] of what is so far from a body's centre of mass [m], at most: joints only take from it."""
    return b.inverse_mass + reach * reach * max_inverse_inertia(b)


@jit_inside
def max_inverse_inertia(b):
    """Inverse of the least moment of inertia of a body [1/(kg m^2)]."""
    return max(b.inverse_inertia[0], max(b.inverse_inertia[1], b.inverse_inertia[2]))


@jit_inside
def turn_rate(b):
    """Angular speed [1/s] of a body, or, in a tree, of all that carries it, at most."""
    return norm(load(b.spin)) if b.tree == 0 else link_at(tree_at(b.tree, 0).links, b.member).rate


@jit_inside
def decay(b):
    """Rate [1/s] at which damping in joints may slow a body, at most."""
    return 0.0 if b.tree == 0 else tree_at(b.tree, 0).decay


@jit_inside
def change_bound(b, reach, time):
    """Bound on how joints change the acceleration [m/s^2] of a point so far from the centre of mass [m] in a time [s].

    What carries the body turns it at a rate r, with r^2 of the reach; the others push it, from directions that turn as
    fast as the tree's fastest does: no more than it pushes them, over the geometric mean of both mobilities (Cauchy and
    Schwarz). A vector that turns changes by no more than twice itself.
    """
    if b.tree == 0:
        return 0.0
    t, own = tree_at(b.tree, 0), turn_rate(b)
    pull = min(t.max_acceleration, t.effort * sqrt(mobility_bound(b, reach)))
    return 4.0 * (pull * min(t.rate * time, 1.0) + own * own * reach * min(own * time, 1.0))
