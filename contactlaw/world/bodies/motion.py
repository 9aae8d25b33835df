"""Motion of one body between contacts, its change by impulses, and its mobility.

Bodies of a tree move together: for these the functions of `trees.mobility` and `trees.motion` are called by address.
"""

from math import ceil, sqrt

from contactlaw.jit import jit_inline, jit_module
from contactlaw.world.data.access import body_at, link_at, tree_at
from contactlaw.world.data.call import ask_mobility, call_with_body, call_with_number, call_with_vectors
from contactlaw.world.data.quaternion import conjugate, load4, product, rotate, rotation, rotation_vector, store4, unit
from contactlaw.world.data.records import PUT
from contactlaw.world.data.vec import ZERO, add, axpy, cross, dot, load, norm, scale, store, sub, to_body, to_world

LARGEST_TURN, MOST = 0.1, 1e4  # [rad] of a step of `tumble`; number of such steps, at most
LEAST_MOBILITY = 1e-9  # of the mobility of the free body: least mobility of a tree's point
MIDPOINTS, CLOSE = 12, 1e-20  # iterations of `spin_after`; squared relative change of a mean spin after which it ends
EXACT = 1e-31  # squared relative error of a spin at which the iteration ends
# [m/s]: a body whose speed would change by more in a step, to more than this and by more than it is, has jumped: robot
# arms and belts start with less, 10 mm in 2 ms is no motion. Also the limit of `touch.initial_overlap_limit`
JUMP = 5.0
PLANE_REACH = 1.0  # [m] from the centre, at which a plane, which has no end, has the speed by which it jumps


def fly(b, until):
    """Move a body to a time [s] of the step, in free flight."""
    if b.still == 0 and b.time != until:
        if b.tree != 0:
            call_with_number(tree_at(b.tree, 0).fly, b, until)
            return
        drift(b, until - b.time)
        settle(b)
        b.placed = 0  # it has come here by motion
    b.time = until


@jit_inline
def drift(b, h):
    """Move a body for h [s] without contacts, and set `shift` and `twist`. A tree moves when its first body does."""
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


def settle(b):
    """Apply the pending turn to the quaternion. Of a tree: apply pending impulses and find its accelerations anew."""
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


def set_axes(b):
    """Set the rotation matrix from the quaternion."""
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


def tumble(b, h):
    """Turn an anisotropic body for h [s], free of torque; energy and angular momentum stay constant to rounding.

    With L the angular momentum along the body's axes, the rotation R <- R exp(theta), theta = h I^-1 (L + exp(-theta)
    L)/2, is the implicit midpoint rule of L' = L x I^-1 L at a slightly different h. That rule conserves all quadratic
    invariants (Hairer, Lubich & Wanner, Geometric Numerical Integration, section IV.2), and R L is constant by
    construction.
    """
    total = (0.0, 0.0, 0.0)
    m, i = load(b.momentum), load(b.inverse_inertia)
    count, most = 1.0, (h * max_inverse_inertia(b)) ** 2 * dot(m, m)  # square of the turn, at most
    if most > LARGEST_TURN * LARGEST_TURN:
        count = max(min(ceil(norm(spin_change(b, m)) * abs(h) / LARGEST_TURN), MOST), 1.0)
    part, contraction = h / count, most / (count * count)  # the latter squared: of errors by an iteration, at most
    for _ in range(int(count)):
        start = to_body(b.axes, m)
        w = (i[0] * start[0], i[1] * start[1], i[2] * start[2])
        mean = axpy(0.5 * part, cross(start, w), start)  # by the first term of the series: an iteration less
        w = (i[0] * mean[0], i[1] * mean[1], i[2] * mean[2])
        for _ in range(40):
            mean = scale(0.5, add(start, rotate(scale(-part, w), start)))
            new = (i[0] * mean[0], i[1] * mean[1], i[2] * mean[2])
            change = sub(new, w)
            w = new
            if contraction * dot(change, change) <= EXACT * dot(w, w):
                break
        turn = to_world(b.axes, scale(part, w))
        store(b.pending_turn, turn)
        settle(b)
        total = add(total, turn)
    store(b.twist, total)


def spin_change(b, moment):
    """Return the change of spin [rad/s] by an angular impulse L [N m s] about the centre of mass: R I^-1 R^T L."""
    if b.isotropic != 0:
        return scale(b.inverse_inertia[0], moment)
    p, i = to_body(b.axes, moment), b.inverse_inertia
    return to_world(b.axes, (i[0] * p[0], i[1] * p[1], i[2] * p[2]))


def spin_rate(b, w):
    """Return the angular acceleration [rad/s^2] of a free body without contacts, at a spin w."""
    return spin_change(b, sub(load(b.torque), gyroscopic(b, w)))


def spin_after(b, w, h):
    """Return the spin of a free body without contacts h [s] after it was w, or before; torques alone change its energy.

    This is the implicit midpoint rule with the axes of now: I (w1 - w) = h (M + I m x m), m the mean spin. Each
    iteration solves I m = I w + h/2 M + k x m with k = h/2 I m of the last one. Whatever k is, it does no work.
    """
    if b.isotropic != 0 or h == 0.0:
        return axpy(h, spin_change(b, load(b.torque)), w)
    i, own, moment = b.inverse_inertia, to_body(b.axes, w), scale(0.5 * h, to_body(b.axes, load(b.torque)))
    d, mean, last = (1.0 / i[0], 1.0 / i[1], 1.0 / i[2]), own, ZERO
    start = (d[0] * own[0] + moment[0], d[1] * own[1] + moment[1], d[2] * own[2] + moment[2])
    for _ in range(MIDPOINTS):
        change = sub(mean, last)
        if dot(change, change) <= CLOSE * dot(mean, mean):
            break
        last = mean
        k = (0.5 * h * d[0] * mean[0], 0.5 * h * d[1] * mean[1], 0.5 * h * d[2] * mean[2])
        dk = (d[0] * k[0], d[1] * k[1], d[2] * k[2])
        cofactors = (d[1] * d[2] * start[0], d[2] * d[0] * start[1], d[0] * d[1] * start[2])
        mean = axpy(dot(k, start), k, add(cofactors, cross(dk, start)))
        mean = scale(1.0 / (d[0] * d[1] * d[2] + dot(k, dk)), mean)
    return sub(scale(2.0, to_world(b.axes, mean)), w)


def note_usual(b, gravity, usual_io, wrench_io, lifted):
    """Note a body's acceleration besides gravity, and its torque, as the usual ones of steps in which it was touched.

    Engines step v <- v + h a, then x <- x + h v: x1 = x0 + h (v0 + h a) is a parabola if the velocity at x0 is v0 +
    h/2 a. So adapters read and write velocities, spins too, half a step behind positions; but the true one if a contact
    is closed at the end of a step, so that a body at rest has none. If the body has lifted off its contacts within the
    step, a is only as much as was usual before: a kick for one step that lifts it would otherwise be half a kick, as
    the engine does not repeat it in the next step.
    """
    push, moment = sub(load(b.acceleration), gravity), load(b.torque)
    if lifted:
        store(b.acceleration, add(gravity, share_of(load(usual_io), push)))
        store(b.torque, share_of(load(wrench_io), moment))
    store(usual_io, push)
    store(wrench_io, moment)


def share_of(a, b):
    """Of a vector a as much as b has of it: a multiple of a, by 0 to 1."""
    square = dot(a, a)
    return scale(min(max(dot(a, b) / square, 0.0), 1.0), a) if square > 0.0 else ZERO


def update_momentum(b):
    """Make the angular momentum that of the spin, which the user may have changed."""
    spin = load(b.spin)
    change = sub(spin, spin_change(b, load(b.momentum)))
    if b.isotropic == 0 and dot(change, change) != 0.0:
        store(b.momentum, angular_momentum(b, spin))


def gyroscopic(b, w):
    """Return the moment w x I w [N m]."""
    if b.isotropic != 0 or b.inverse_mass == 0.0:
        return 0.0, 0.0, 0.0
    return cross(w, angular_momentum(b, w))


def angular_momentum(b, w):
    """Return I w [N m s], the angular momentum of a body of finite mass about its centre of mass, at a spin w."""
    p, i = to_body(b.axes, w), b.inverse_inertia
    return to_world(b.axes, (p[0] / i[0], p[1] / i[1], p[2] / i[2]))


def is_static(b):
    """Return whether a body is kinematic and at rest."""
    return b.inverse_mass == 0.0 and dot(load(b.velocity), load(b.velocity)) + dot(load(b.spin), load(b.spin)) == 0.0


def velocity_at(b, arm):
    """Return the velocity [m/s] of a body's point at an arm [m] from its centre of mass."""
    return add(load(b.velocity), cross(load(b.spin), arm))


def closing_at(a, arm_a, b, arm_b, n):
    """Return the closing speed [m/s] of two points of contact; n: normal from B to A."""
    return -dot(sub(velocity_at(a, arm_a), velocity_at(b, arm_b)), n)


def greatest_closing(a, b):
    """Return a bound on the closing speed [m/s] of any two points of the shapes of two bodies."""
    turning = norm(load(a.spin)) * a.reach + norm(load(b.spin)) * b.reach
    return norm(sub(load(a.velocity), load(b.velocity))) + turning


def acceleration_of(b):
    """Return the acceleration [m/s^2] of a body without contacts; zero if it sleeps, as its contacts balance it."""
    return load(b.acceleration) if b.asleep == 0 else ZERO


def acceleration_at(b, arm):
    """Return the acceleration [m/s^2] of a body's point at an arm [m], without contacts."""
    if b.asleep != 0:
        return ZERO
    w = load(b.spin)
    return add(load_at(b, arm), cross(w, cross(w, arm)))


@jit_inline
def load_at(b, arm):
    """Return the acceleration [m/s^2] of a body's point at an arm [m] by loads besides contacts, not by its spin."""
    if b.inverse_mass == 0.0:
        return ZERO
    return add(load(b.acceleration), cross(turning_of(b), arm))


@jit_inline
def turning_of(b):
    """Return the angular acceleration [rad/s^2] of a body by its loads."""
    return load(b.turning) if b.tree != 0 else spin_change(b, load(b.torque))


@jit_inline
def moved_at(b, arm):
    """Return the displacement [m] of a body's point in the last substep; arm: at its middle."""
    if b.still != 0:
        return ZERO
    return add(load(b.shift), cross(load(b.twist), arm))


@jit_inline
def kick(b, impulse, moment):
    """Apply an impulse [N s] and an angular impulse about the centre of mass [N m s] to a body."""
    if b.tree != 0:
        call_with_vectors(tree_at(b.tree, 0).kick, b, impulse, moment)
    elif b.isotropic != 0:
        kick_round(b, impulse, moment)
    elif b.inverse_mass != 0.0:
        store(b.velocity, axpy(b.inverse_mass, impulse, load(b.velocity)))
        store(b.momentum, add(load(b.momentum), moment))
        store(b.spin, spin_change(b, load(b.momentum)))


@jit_inline
def kick_round(b, impulse, moment):
    """Do so to a body without joints whose moments of inertia are equal, or that is kinematic."""
    if b.inverse_mass != 0.0:
        store(b.velocity, axpy(b.inverse_mass, impulse, load(b.velocity)))
        store(b.spin, axpy(b.inverse_inertia[0], moment, load(b.spin)))


def mobility(b, arm, direction):
    """Return the mobility [1/kg] of a body's point: its velocity along a unit vector by a unit impulse along it."""
    if b.tree != 0:
        return ask_mobility(tree_at(b.tree, 0).mobility, b, arm, b, arm, direction)
    r = cross(arm, direction)
    return b.inverse_mass + dot(r, spin_change(b, r))


def mobility_between(a, arm_a, b, arm_b, direction):
    """Return the mobility [1/kg] of two points: their relative velocity by equal and opposite unit impulses."""
    both = mobility(a, arm_a, direction) + mobility(b, arm_b, direction)
    if a.tree != 0 and a.tree == b.tree:
        both -= 2.0 * ask_mobility(tree_at(a.tree, 0).mobility, a, arm_a, b, arm_b, direction)
        both = max(both, LEAST_MOBILITY * a.inverse_mass)
    return both


def mobility_bound(b, reach):
    """Return a bound on the mobility [1/kg] within `reach` [m] of a body's centre of mass; joints only reduce it."""
    return b.inverse_mass + reach * reach * max_inverse_inertia(b)


def max_inverse_inertia(b):
    """Return the inverse of the least moment of inertia of a body [1/(kg m^2)]."""
    return max(b.inverse_inertia[0], max(b.inverse_inertia[1], b.inverse_inertia[2]))


def turn_rate(b):
    """Return the angular speed [rad/s] of a body; in a tree a bound for the body and its ancestors, see `LINK.rate`."""
    return norm(load(b.spin)) if b.tree == 0 else link_at(tree_at(b.tree, 0).links, b.member).rate


def swing(b):
    """Return the least rate [1/s] of substeps for damping in joints not to let a body swing, see `trees.dynamics`."""
    return 0.0 if b.tree == 0 else tree_at(b.tree, 0).swing


def change_bound(b, reach, time, most=1.0, along=False):
    """Return a bound on the change, by joints, of the acceleration [m/s^2] of a point within a time [s].

    The point is within `reach` [m] of the centre of mass. The body and its ancestors turn at a rate r at most:
    centripetal acceleration r^2 reach. The other bodies of the tree accelerate it from directions that turn at most as
    fast as the fastest of them, by no more than the load on them times the geometric mean of both mobilities
    (Cauchy-Schwarz). A vector that turns changes by at most twice its length. `most` [rad] is 1, or 3 for six times the
    mean change of the velocity over that time, divided by it: of min(r t, 1) the mean of the integral is at most
    time min(r time, 3)/6. along: only of its part along the path of the point. Centripetal acceleration has none; what
    remains of its change is the precession of the body's axes: by the rate of its parent, if it has one axis.
    """
    if b.tree == 0:
        return 0.0
    t, own = tree_at(b.tree, 0), turn_rate(b)
    pull = min(t.max_acceleration, t.effort * sqrt(mobility_bound(b, reach))) * min(t.rate * time, most)
    link, carried = link_at(t.links, b.member), own
    if along and link.axes == 1:
        carried = link_at(t.links, link.parent).rate if link.parent >= 0 else 0.0
    turning = 4.0 * reach * own * carried if along else 4.0 * reach * own**2
    return 4.0 * pull + turning * min(own * time, most)


def move_kinematic(w, b, place, turn, h):
    """Set the velocities of a kinematic body such that it reaches a pose at the end of a step of h [s].

    The user moves it from step to step. Its motion is uniform within a step, so that contacts feel it.
    place, turn: that pose, position [m] and quaternion. On entry the pose of the body is where the last step left it,
    its velocities are those that `lead` gives for that step. A body that jumps is put there at once, at rest, marked as
    `placed`; if it goes on as fast, it moves.
    """
    velocity, spin, reach = load(b.velocity), load(b.spin), min(b.reach, PLANE_REACH)
    lead(b, load(b.position), load4(b.quaternion), place, turn, h)
    speed = norm(load(b.velocity)) + reach * norm(load(b.spin))
    change = norm(sub(load(b.velocity), velocity)) + reach * norm(sub(load(b.spin), spin))
    b.placed = 0
    if not (min(speed, change) <= JUMP or change <= norm(velocity) + reach * norm(spin)):
        store(b.position, place)
        store4(b.quaternion, turn)
        b.placed, w.stale = PUT, 1
        store(b.velocity, ZERO)
        store(b.spin, ZERO)
    b.still = 0
    set_axes(b)


def lead(b, position, quaternion, place, turn, h):
    """Give a kinematic body the velocities that take it from a pose to `place`, `turn` in h [s]."""
    store(b.velocity, scale(1.0 / h, sub(place, position)))
    store(b.spin, scale(1.0 / h, rotation_vector(product(turn, conjugate(quaternion)))))


def wake_body(b, now):
    """Wake a body, and all others of its tree."""
    for i in range(tree_at(b.tree, 0).count if b.tree != 0 else 1):
        one = body_at(tree_at(b.tree, 0).bodies, i) if b.tree != 0 else b
        one.asleep, one.still, one.changed = 0, 0, 1
        one.time = now


jit_module(__name__)
