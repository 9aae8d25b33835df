"""Hooks "read" and "apply" for a body with joints, compiled: see `trees`, which says what is done and why."""

from math import inf

from contactlaw.jit import jit_module
from contactlaw.laws.record import record
from contactlaw.memory import element
from contactlaw.world.bodies.motion import settle
from contactlaw.world.data.access import axis_at, body_at, joint_at, link_at, tree_at, world_at
from contactlaw.world.data.call import call_with_body
from contactlaw.world.data.quaternion import load4, turn_by
from contactlaw.world.data.records import BALL
from contactlaw.world.data.vec import add, load, scale, store, sub
from contactlaw.world.near.following import overlaps
from contactlaw.world.trees.kinematics import is_free, vector
from contactlaw.world.trees.mobility import clear, copy

EXACT = 1e-9  # relative difference of a coordinate that counts as rounding
CARRIES = 0.01  # a motor holds its joint if less than this share of its torque accelerates the inertia that it carries
HELD = 1e3  # armature of a joint that a motor holds, over the inertia that it carries

# lengths are numbers of coordinates (q), of velocities (v), of hinges and slides (m), and of bodies (n)
KEPT = {"left": "q", "force": "v", "push": "v", "last_torque": "m", "limit": "m", "strongest": "m"}
"""What lasts from a step to the next: coordinates as the last step left them; see `trees`."""
NUMBERS = KEPT | {
    "start_q": "q", "start_v": "v", "after_q": "q", "after_v": "v", "torque": "m",  # as read before and after the step
    "free_acceleration": "v", "matrix": "vv",  # by the forces known at the start of the step; mass matrix there
    "new_q": "q", "new_v": "v", "gained": "v",  # to be written; acceleration that Bullet's velocities show
    "forces": "v3", "moments": "n3",  # of `push`: along each degree of freedom, and on each body
}  # fmt: skip
"""Arrays of a tree besides those of the world, by name, and their shapes."""

OWN = record(tree="u8", **dict.fromkeys(NUMBERS, "u8"))
"""Addresses of a tree's record in the world and of its arrays."""

own_at = element(OWN)


def take_start(block):
    """Return whether the user has moved the tree since the last step; if so it is neither pushed nor forced."""
    own = own_at(block, 0)
    t = tree_at(own.tree, 0)
    if is_left(own, t):
        return False
    clear(vector(own.force, t.v_size))
    clear(vector(own.push, t.v_size))
    return True


def is_left(own, t):
    """Return whether the coordinates are those that the last step left; NaN is not."""
    q, left, most = vector(own.start_q, t.q_size), vector(own.left, t.q_size), 0.0
    for k in range(t.q_size):
        most = max(most, abs(q[k]))
    close = 0.5 * EXACT * (1.0 + most)
    for i in range(t.joint_count):
        joint = joint_at(t.joints, i)
        ball, first = joint.kind == BALL, joint.first_q
        for k in range(first, first + 4 if ball else first + 1):
            other = abs(left[k] + q[k]) if ball else inf  # a quaternion and its negative are the same rotation
            if not min(abs(left[k] - q[k]), other) <= close:
                return False
    return True


def set_at_start(block, lag):
    """Set the world's tree at the start of the step, `lag` [s] after the time of its velocity, and find its matrix."""
    own = own_at(block, 0)
    t = tree_at(own.tree, 0)
    set_start(own, t, lag)
    clear(vector(own.matrix, t.v_size * t.v_size))
    t.weights, t.stride = own.matrix, t.v_size
    call_with_body(t.write_masses, body_at(t.bodies, 0))


def set_start(own, t, lag):
    """Set the world's tree at the start of the step, with `force`."""
    free, v = vector(own.free_acceleration, t.v_size), vector(own.new_v, t.v_size)
    copy(vector(own.force, t.v_size), vector(t.f, t.v_size))
    copy(vector(own.start_v, t.v_size), v)
    put(t, own.start_q, own.new_v)
    copy(vector(t.a, t.v_size), free)
    if lag > 0.0:
        for k in range(t.v_size):
            v[k] += lag * free[k]
        put(t, own.start_q, own.new_v)


def put(t, q, v):
    """Set coordinates and velocities of the world's tree, at addresses, and what follows; wakes its bodies."""
    copy(vector(q, t.q_size), vector(t.q, t.q_size))
    copy(vector(v, t.v_size), vector(t.v, t.v_size))
    t.stale = 1
    for i in range(t.count):
        body_at(t.bodies, i).asleep = 0
    settle(body_at(t.bodies, 0))


def add_product(m, x, share, out):
    """Add a share of M x to an array."""
    for i in range(x.size):
        for j in range(x.size):
            out[i] += share * m[i, j] * x[j]


def take_response(block, dt, lag):
    """From velocities after Bullet's step: find forces on joints, and which a motor held; then as `set_at_start`."""
    own = own_at(block, 0)
    t = tree_at(own.tree, 0)
    m, force, push = vector(own.matrix, (t.v_size, t.v_size)), vector(own.force, t.v_size), vector(own.push, t.v_size)
    before, after = vector(own.start_v, t.v_size), vector(own.after_v, t.v_size)
    gained = vector(own.gained, t.v_size)
    for k in range(t.v_size):
        gained[k] = (after[k] - before[k]) / dt
        force[k] -= push[k]
    add_product(m, vector(own.free_acceleration, t.v_size), -1.0, force)
    motor = 0
    for i in range(4 if is_free(t, link_at(t.links, 0)) else 0, t.joint_count):
        joint = joint_at(t.joints, i)
        if joint.kind != BALL:
            k = joint.first_axis
            axis = axis_at(t.axes, k)
            inertia = m[k, k] - axis.armature
            m[k, k] = inertia
            axis.armature = armature_of(own, t, motor, k, inertia, dt)
            m[k, k] += axis.armature
            motor += 1
    add_product(m, gained, 1.0, force)
    set_start(own, t, lag)


def armature_of(own, t, motor, k, inertia, dt):
    """Return the armature of degree of freedom k by its motor; inertia: without it; note the motor's torque."""
    count = t.joint_count  # there are at most as many motors
    torques, last, limits = vector(own.torque, count), vector(own.last_torque, count), vector(own.limit, count)
    strongest = vector(own.strongest, count)
    torque, speed = abs(torques[motor]), abs(vector(own.after_v, t.v_size)[k])
    accelerating = abs(vector(own.gained, t.v_size)[k]) * inertia
    if torque > (1.0 + EXACT) * limits[motor]:
        limits[motor] = inf
    if abs(torque - last[motor]) <= EXACT * torque and accelerating > EXACT * torque:
        limits[motor] = torque
    last[motor] = torque
    strongest[motor] = max(strongest[motor], torque)
    held = accelerating < max(abs(vector(own.push, t.v_size)[k]), CARRIES * torque)
    if not (held and 0.0 < torque < (1.0 - EXACT) * limits[motor]):
        return 0.0
    return min(HELD * inertia, dt * strongest[motor] / speed) if speed > 0.0 else HELD * inertia


def find_end(block, world, dt, pressed):
    """After the world's step: find what is to be written and the push that gave it; return whether it is needed.

    That is if a contact has touched the tree, or see `near.following`.
    """
    own, w = own_at(block, 0), world_at(world, 0)
    t, touched = tree_at(own.tree, 0), False
    left, v, push = vector(own.left, t.q_size), vector(own.new_v, t.v_size), vector(own.push, t.v_size)
    copy(vector(t.q, t.q_size), vector(own.new_q, t.q_size))
    copy(vector(t.v, t.v_size), v)
    for i in range(t.count):
        b = body_at(t.bodies, i)
        touched = touched or b.asleep != 0 or b.touched != 0
    if not touched:
        put(t, own.after_q, own.after_v)
        if not overlaps(w, t.first, t.count):
            copy(vector(own.after_q, t.q_size), left)
            clear(push)
            return False
        put(t, own.new_q, own.new_v)
    copy(vector(own.new_q, t.q_size), left)
    a, gained = vector(t.a, t.v_size), vector(own.gained, t.v_size)
    for k in range(t.v_size):
        v[k] -= 0.0 if pressed else 0.5 * dt * a[k]
    copy(v, gained)
    # Bullet keeps the spin of a base along the axes before its step
    if is_free(t, link_at(t.links, 0)):
        turn, (w_0, x_0, y_0, z_0) = load4(left[3:7]), load4(vector(own.start_q, t.q_size)[3:7])
        store(gained[3:6], turn_by((w_0, -x_0, -y_0, -z_0), turn_by(turn, load(v[3:6]))))
    before, free = vector(own.start_v, t.v_size), vector(own.free_acceleration, t.v_size)
    for k in range(t.v_size):
        gained[k] = (gained[k] - before[k]) / dt - free[k]
    clear(push)
    add_product(vector(own.matrix, (t.v_size, t.v_size)), gained, 1.0, push)
    return True


def spread_push(block):
    """Find forces and moments of `push` at the present pose of the world's tree; return whether there are any."""
    own = own_at(block, 0)
    t = tree_at(own.tree, 0)
    push, some = vector(own.push, t.v_size), False
    forces, moments = vector(own.forces, (t.v_size, 3)), vector(own.moments, (t.count, 3))
    for i in range(t.count):
        store(moments[i], (0.0, 0.0, 0.0))
    for i in range(t.count):
        link = link_at(t.links, i)
        for k in range(link.first_axis, link.first_axis + link.axes):
            axis = axis_at(t.axes, k)
            some = some or push[k] != 0.0
            store(forces[k], scale(push[k], load(axis.velocity)))
            moment = scale(push[k], load(axis.spin))
            store(moments[i], add(load(moments[i]), moment))
            if link.parent >= 0:
                store(moments[link.parent], sub(load(moments[link.parent]), moment))
    return some


jit_module(__name__)
