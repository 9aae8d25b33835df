"""Response of a tree of bodies to impulses; in an implicit step its mass matrix, Jacobians and poses.

With q the generalised coordinates, v the velocities, M(q) = L^T D L the mass matrix, J_b the Jacobian of a body:

    kick       v <- v + M^-1 J_b^T (p, m), an impulse and an angular impulse on a body
    mobility   d . J M^-1 J^T d = y . D^-1 y, y = L^-T J^T d
"""

from math import sqrt

from contactlaw.jit import jit_module
from contactlaw.memory import whole_at
from contactlaw.world.bodies.motion import LEAST_MOBILITY, mobility_bound
from contactlaw.world.data.access import axis_at, body_at, link_at, tree_at
from contactlaw.world.data.call import call_on_tree
from contactlaw.world.data.checksum import as_float, mix
from contactlaw.world.data.tree import PLACED
from contactlaw.world.data.vec import add, cross, load, norm, store, sub
from contactlaw.world.trees import dynamics, limits
from contactlaw.world.trees.kinematics import response_of, spread_velocity, vector

SAME = 1e-12  # of the sum of forces on a tree: changes up to this are rounding
FREE_SIZE = 6  # velocities of a tree of one body that nothing holds
GOLDEN, SILVER = 0.5 * (sqrt(5.0) - 1.0), sqrt(2.0) - 1.0  # irrational, so that the weights of forces all differ


def copy(source, target):
    """Copy an array; a loop compiles faster than an assignment of arrays."""
    for k in range(source.size):
        target[k] = source[k]


def clear(target):
    """Set an array to zero."""
    for k in range(target.size):
        target[k] = 0.0


def move_bodies(t):
    """Move the coordinates by x, and set poses and velocities of all bodies."""
    call_on_tree(t.move, t)
    spread_velocity(t)


def leave_placed(t):
    """Note that accelerations and factor do not belong to q and v; poses do if they did before."""
    if t.stale == 0:
        t.stale = PLACED


def accelerate(t):
    """Find the mass matrix, the accelerations at q and v, and bounds on how fast they change."""
    call_on_tree(t.accelerate, t)
    t.rate, t.change_rate, t.max_acceleration, t.effort, t.coupling = 0.0, 0.0, 0.0, 0.0, 0.0
    t.rigid, e = 1 if t.count == 1 and t.v_size == FREE_SIZE else 0, vector(t.e, (t.v_size, t.v_size))
    for k in range(t.v_size):
        axis = axis_at(t.axes, k)
        t.coupling = max(t.coupling, axis.inertia * axis.inverse)
        if axis.armature + e[k, k] != 0.0:
            t.rigid = 0
    for i in range(t.count):
        link, b = link_at(t.links, i), body_at(t.bodies, i)
        spin, pull = load(b.spin), norm(load(b.acceleration))
        link.rate = norm(spin) + sqrt(norm(load(b.turning)))
        t.change_rate = max(t.change_rate, link.rate)
        if link.parent >= 0:
            t.change_rate = max(t.change_rate, link.rate + norm(sub(spin, load(body_at(t.bodies, link.parent).spin))))
            link.rate = max(link.rate, link_at(t.links, link.parent).rate)
        t.rate = max(t.rate, link.rate)
        t.max_acceleration = max(t.max_acceleration, pull)
        t.effort = max(t.effort, pull / sqrt(mobility_bound(b, b.reach)))


def settle(b):
    """Find the accelerations of a tree whose coordinates, velocities or forces have changed.

    Where the world has moved it to the end of the step, which needs none, it finds velocities alone.
    A tree that sleeps is left as it is, and marked if it is disturbed.
    """
    t = tree_at(b.tree, 0)
    if b.asleep != 0:
        t.disturbed = 1 if is_disturbed(t) else 0
        return
    if t.stale != 0:
        ends = t.stale == PLACED and b.time == t.span
        apply_pending(t, 0.5 * t.held, t.held == 0.0)
        t.hold, t.held = 0, 0.0
        if t.stale != PLACED:
            clear(vector(t.x, t.v_size))
            call_on_tree(t.move, t)
        spread_velocity(t)
        t.stale = PLACED
        if not ends:
            accelerate(t)
            t.stale = 0
        clear(vector(t.kick_v, t.v_size))
    if b.time == 0.0:  # D is constant over a step, and M nearly
        dynamics.bound_decay(t)


def kick(b, impulse, moment):
    """Add an impulse [N s] and an angular impulse [N m s] on a body of a tree to the pending ones."""
    t = tree_at(b.tree, 0)
    dynamics.add_impulse(t, b, impulse, moment, vector(t.pending, t.v_size), 1.0)
    t.kicked = 1
    leave_placed(t)


def apply_pending(t, time, first):
    """Change the velocities by all pending impulses together, which limits answer.

    time: [s] for which limits act by the present displacement; and springs, but if the accelerations have them, at the
    start of a group's first substep.
    """
    if t.kicked == 0 and (t.sprung + t.limited == 0 or first):
        return
    t.kicked = 0
    n = t.v_size
    v, push, due = vector(t.v, n), vector(t.kick_v, n), vector(t.pending, n)
    change = vector(t.room, n)
    dynamics.pull(t, 0.0 if first else time, due, change)
    copy(due, change)
    clear(due)
    dynamics.solve(t, change)
    if t.limited > 0:
        limits.find(t, change, time, 0.0, True)
    for k in range(n):
        v[k] += change[k]
        push[k] += change[k]
    spread_velocity(t)


def mobility(a, arm_a, b, arm_b, direction):
    """Return the velocity of a point of B along a unit vector by a unit impulse along it on a point of A [1/kg]."""
    t = tree_at(a.tree, 0)
    x, y = vector(t.x, t.v_size), vector(t.room, t.v_size)
    same = a.member == b.member
    out = 0.0
    if not same:
        clear(y)
        dynamics.project(t, b, direction, cross(arm_b, direction), y)
    k = dynamics.project(t, a, direction, cross(arm_a, direction), x)
    while k >= 0:
        axis = axis_at(t.axes, k)
        out += x[k] * axis.inverse * (x[k] if same else y[k])
        k = axis.parent
    return max(out, LEAST_MOBILITY * a.inverse_mass) if same else out


def add_accelerations(b, force, moment):
    """Add all bodies' accelerations by a force [N] and moment [N m] on one to `shift` and `twist`, see `sleep`."""
    t = tree_at(b.tree, 0)
    x, origin = vector(t.x, t.v_size), load(t.origin)
    clear(x)
    dynamics.project(t, b, force, moment, x)
    dynamics.solve_ld(t, x)
    for i in range(t.count):
        one = body_at(t.bodies, i)
        turning, gain = response_of(t, i, x)
        store(one.twist, add(load(one.twist), turning))
        store(one.shift, add(load(one.shift), add(gain, cross(turning, sub(load(one.position), origin)))))


def stop(b):
    """Stop a tree that falls asleep; its first body keeps the signature of its state."""
    t = tree_at(b.tree, 0)
    clear(vector(t.v, t.v_size))
    store(b.held, sleep_signature(t))
    leave_placed(t)


def is_disturbed(t):
    """Return whether coordinates, velocities, forces or gravity of a sleeping tree have changed since it fell asleep.

    Forces may differ by rounding: an engine's solver does not reproduce them to the bit.
    """
    held, now = load(body_at(t.bodies, 0).held), sleep_signature(t)
    v, f, size = vector(t.v, t.v_size), vector(t.f, t.v_size), 0.0
    out = held[0] != now[0]
    for k in range(t.v_size):
        out = out or v[k] != 0.0
        size += abs(f[k])
    return out or not max(abs(held[1] - now[1]), abs(held[2] - now[2])) <= SAME * size


def sleep_signature(t):
    """Return a checksum of a tree's coordinates and gravity, and two differently weighted sums of the other forces."""
    f, one, two = vector(t.f, t.v_size), 0.0, 0.0
    rest = mix(t.q, 0, t.q_size, 0) + mix(t.gravity.ctypes.data, 0, 3, t.q_size)
    for k in range(t.v_size):
        one += (0.5 + GOLDEN * (k + 1.0) % 1.0) * f[k]
        two += (0.5 + SILVER * (k + 1.0) % 1.0) * f[k]
    return as_float(rest), one, two


def spread_delta_v(b):
    """Bound by how much impacts on one body may change the velocities of the tree's other bodies.

    The response of one point to an impulse at another is at most the geometric mean of their mobilities
    (Cauchy-Schwarz).
    """
    t, own = tree_at(b.tree, 0), mobility_bound(b, b.reach)
    for i in range(t.count):
        one = body_at(t.bodies, i)
        one.delta_v = max(one.delta_v, b.delta_v * sqrt(max(mobility_bound(one, one.reach) / own, 1.0)))


def move_from_start(b):
    """Move the tree by x from its coordinates at the start of the step; sets poses and velocities of its bodies."""
    t = tree_at(b.tree, 0)
    copy(vector(t.start, t.q_size), vector(t.q, t.q_size))
    move_bodies(t)
    t.stale = PLACED


def write_masses(b):
    """Add the mass matrix L^T D L at the present factor to the matrix at `weights`."""
    t = tree_at(b.tree, 0)
    m, out = vector(t.factor, (t.v_size, t.v_size)), vector(t.weights, (t.v_size, t.stride))
    for k in range(t.v_size):
        path, last, pivot = dynamics.path_of(t, k), axis_at(t.axes, k).depth, 1.0 / axis_at(t.axes, k).inverse
        for p in range(last + 1):
            left = pivot * (1.0 if p == last else m[k, p])
            for q in range(last + 1):
                out[whole_at(path, p), whole_at(path, q)] += left * (1.0 if q == last else m[k, q])


def add_damping(b):
    """Add b D + b^2 K of damping and stiff springs, and of limits, to the matrix at `weights`, b a stage [s]."""
    t = tree_at(b.tree, 0)
    n, square = t.v_size, t.stage * t.stage if is_stiff(t) else 0.0
    d, springs, out = vector(t.d, (n, n)), vector(t.springs, (n, n)), vector(t.weights, (n, t.stride))
    for k in range(n):
        for i in range(n):
            out[k, i] += t.stage * d[k, i] + square * springs[k, i]
        out[k, k] -= t.stage * axis_at(t.axes, k).loose
    limits.add_slopes(t, t.stage, out)


def resist(t, force):
    """Find the force of damping less that at the start of the step, -D (V - v).

    Springs keep the force of the start, unless they are too stiff for that.
    """
    n, d = t.v_size, vector(t.d, (t.v_size, t.v_size))
    v, v0, v_f = vector(t.v, n), vector(t.start + 8 * t.q_size, n), vector(t.v_f, n)
    for k in range(n):
        axis, (first, end) = axis_at(t.axes, k), (0, n) if t.coupled != 0 else (k, k + 1)
        force[k] = -dynamics.loosen(axis, v0[k] - v_f[k]) + dynamics.loosen(axis, v[k] - v_f[k])
        for i in range(first, end):
            force[k] -= d[k, i] * (v[i] - v0[i])
    if is_stiff(t):
        dynamics.pull(t, 1.0, force, vector(t.room + 16 * n, n))


def is_stiff(t):
    """Return whether springs would be unstable by their force at the start or middle of a step: omega h > 2."""
    return 0.25 * t.span * t.span * t.stiffness > 1.0


def balance(b):
    """Replace velocities x by momenta M x, and add those by damping and limits in a stage of an implicit step.

    Writes the diagonal of M + b D, the scale of what is left of momenta, to `weights`.
    """
    t = tree_at(b.tree, 0)
    x, force, diagonal = vector(t.x, t.v_size), vector(t.room, t.v_size), vector(t.weights, t.v_size)
    resist(t, force)
    limits.resist(t, force, x, 1.0 / t.stage)
    weigh(t, x)
    for k in range(t.v_size):
        x[k] += t.stage * force[k]
        diagonal[k] = axis_at(t.axes, k).inertia + t.stage * vector(t.d, (t.v_size, t.v_size))[k, k]


def weigh(t, x):
    """x <- M x, M = L^T D L."""
    m, n = vector(t.factor, (t.v_size, t.v_size)), t.v_size
    for k in range(n - 1, -1, -1):  # D L
        axis = axis_at(t.axes, k)
        x[k] = (x[k] + dynamics.sum_along(dynamics.path_of(t, k), axis.depth, m[k], x)) / axis.inverse
    for k in range(n):  # L^T
        for p in range(axis_at(t.axes, k).depth):
            x[whole_at(dynamics.path_of(t, k), p)] += m[k, p] * x[k]


def take_middle(b):
    """Find the mass matrix and accelerations for the second stage of a step, in the middle of the step.

    The velocities V are those at the end of the first stage. For coordinates the middle is h/2 V from the start, so
    that vibrations keep their energy, see `implicit.step`; velocities there are extrapolated.

    x: change of the velocities by contacts, damping and limits of the first stage, with the masses of the start; it
    becomes that by the same impulses, and by all other forces in the whole step, with the masses of the middle.
    """
    t = tree_at(b.tree, 0)
    n = t.v_size
    x, v, v0, a = vector(t.x, n), vector(t.v, n), vector(t.start + 8 * t.q_size, n), vector(t.a, n)
    carried, force = vector(t.room, n), vector(t.room + 8 * n, n)
    weigh(t, x)
    copy(x, carried)
    ahead = 0.5 * t.span / t.stage
    for k in range(n):
        x[k] = 0.5 * t.span * v[k]
        v[k] = v0[k] + ahead * (v[k] - v0[k])
    move_from_start(b)
    call_on_tree(t.accelerate, t)
    resist(t, force)
    for k in range(n):
        x[k] = carried[k] - t.span * force[k]  # the stages themselves have damping and limits
    dynamics.solve(t, x)
    for k in range(n):
        x[k] += t.span * a[k]


def add_force(b, force, moment):
    """Add the generalised force of a force on a body and a moment to x."""
    t = tree_at(b.tree, 0)
    dynamics.add_impulse(t, b, force, moment, vector(t.x, t.v_size), 1.0)


jit_module(__name__)
