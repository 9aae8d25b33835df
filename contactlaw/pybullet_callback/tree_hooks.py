"""Steps of bodies with joints in PyBullet: from what is read of a tree to what is written back, in compiled code.

As for free bodies (`rows`), Bullet's velocity belongs to half a step before its position: v + dt/2 a is read, unless v
is as the last step left it, and what is written back is half a step before, except where a contact is closed; for this
a is that of the model alone, as limits act on Bullet's velocities at once. A tree on which hardly more than gravity
acts flies as in the world: Bullet's centrifugal and gyroscopic forces are explicit, and chains run away by them. With
M(q) a + c(q, v) = f, the force on the joints besides gravity and contacts is f = M (a - a0), where a0 is the
acceleration of the model alone and a that of Bullet: of the step that Bullet has taken, or, before it steps, of the
last one. If contacts change the velocities by u dt, they are applied as the generalised force M u: on joints by torque
control, which adds to that of the user, and on a free base by a force and a couple.

A motor of PyBullet is a constraint: it keeps the speed of its joint with up to its greatest force. In a contact within
a step such a joint is given an armature that is heavy against what it carries. (A constant force instead would come a
step late and shake a robot off its feet.) Which joints are held is read from their response to the push in Bullet's own
step. A joint that its motor's torque hardly moves is held too, pushed or not, so that a foot that is just lifted is as
heavy when it lands. A motor at its limit gives a constant force and holds nothing. PyBullet does not tell the limit: a
motor has reached it if its torque is the same in two steps while it accelerates its joint. The armature of a joint that
moves is at most such that its momentum is what the motor can give in a step with the greatest torque that it has had:
else a finger would press what it meets with many times the force of its motor.

A constraint of `createConstraint` likewise: what would part the bodies that it joins, J v, meets an inertia w J^T J
that is heavy against theirs, unless the constraint gives its greatest force in Bullet's step. It is such that this step
changes its momentum by no more than the force that is left gives: else it would press with many times that force.
"""

from math import inf

from contactlaw.jit import jit_module
from contactlaw.laws.record import VECTOR, record
from contactlaw.memory import element
from contactlaw.world.bodies.motion import settle
from contactlaw.world.data.access import axis_at, body_at, joint_at, link_at, tree_at, world_at
from contactlaw.world.data.call import call_with_body
from contactlaw.world.data.quaternion import conjugate, load4, turn_by
from contactlaw.world.data.tree import BALL
from contactlaw.world.data.vec import ZERO, axpy, cross, dot, load, scale, store, to_world
from contactlaw.world.near.passing import overlaps
from contactlaw.world.trees import dynamics
from contactlaw.world.trees.kinematics import is_free, is_pressed, vector
from contactlaw.world.trees.mobility import clear, copy

SLIGHT = 1e-3  # of the momenta along an axis: change in a step up to which a force, as of damping, is slight
EXACT = 1e-9  # relative difference of a coordinate that counts as rounding
CARRIES = 0.01  # a motor holds its joint if less than this share of its torque accelerates the inertia that it carries
HELD = 1e3  # armature of a joint that a motor holds, over the inertia that it carries
TIED = 1e4  # inertia of a constraint over that of what it joins: from 1e5 on a Minitaur that stands jitters at 1/240 s

# lengths are numbers of coordinates (q), of velocities (v) and of constraints (t)
KEPT = {"left": "q", "lags": "", "pressed": "", "left_v": "v", "true_v": "v", "force": "v", "push": "v"}
KEPT |= {"left_over": "t", "last_torque": "v", "limit": "v", "strongest": "v"}
"""What lasts from a step to the next: coordinates as the last step left them; `lags`, 1: it left velocities half a step
behind them, which are known at both times; `pressed`, 1: it left a closed contact; the force [N] that each constraint
can give besides that in the last step of Bullet; of motors (bases have zeros)."""
NUMBERS = KEPT | {
    "start_q": "q", "start_v": "v", "after_q": "q", "after_v": "v", "torque": "v",  # as read before and after the step
    "free_acceleration": "v", "matrix": "vv",  # by the forces known at the start of the step; mass matrix there
    "new_q": "q", "new_v": "v", "gained": "v",  # to be written; acceleration that Bullet's velocities show
}  # fmt: skip
"""Arrays of a tree besides those of the world, by name, and their shapes."""

OWN = record(tree="u8", ties="u8", tie_count="i8", **dict.fromkeys(NUMBERS, "u8"))
"""Addresses of a tree's record in the world, of its constraints, and of its arrays."""

TIE = record(
    bodies=("i8", (2,)),  # that it joins, by number in the tree; -1: what nothing can push
    at=("f8", (2, 3)),  # its place on them, from the centre of mass along their axes [m]
    points="i8", turns="i8",  # 1: it holds the two places together; the relative turn
    axis=VECTOR,  # along which the places may part, along the axes of the first body; zero: none
    geared=("i8", (2,)), ratio="f8",  # of a gear: axes of two joints, v1 + ratio v2 being held; else zero
)  # fmt: skip
"""A constraint of `createConstraint`; its ends that nothing can push, as the world, have no bodies."""

own_at = element(OWN)
tie_at = element(TIE)


def take_start(block):
    """Set the world's tree at the start of the step, with the velocity as read; constraints do not resist yet.

    Returns whether the user has moved it since the last step; if so nothing presses or pushes it.
    """
    own = own_at(block, 0)
    t = tree_at(own.tree, 0)
    left = is_left(own, t)
    if not left:
        for i in range(t.count):
            body_at(t.bodies, i).pressed = 0
        clear(vector(own.force, t.v_size))
        clear(vector(own.push, t.v_size))
        vector(own.lags, 1)[0], vector(own.pressed, 1)[0] = 0.0, 0.0
    if own.tie_count > 0:
        clear(vector(t.e, t.v_size * t.v_size))
        t.coupled = 0
    put_at_start(own, t)
    return not left


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


def tie(own, t, dt):
    """Let the constraints of a tree resist what would part the bodies that they join; its factor is that without."""
    for i in range(own.tie_count):
        one = tie_at(own.ties, i)
        most = vector(own.left_over, own.tie_count)[i] * dt
        if most == 0.0:
            continue
        if one.ratio != 0.0:
            x = vector(t.x, t.v_size)
            clear(x)
            x[one.geared[0]] += 1.0
            x[one.geared[1]] += one.ratio
            add_inertia(own, t, most)
        axis = load(one.axis)
        if one.bodies[0] >= 0:
            axis = to_world(body_at(t.bodies, one.bodies[0]).axes, axis)
        for k in range(3):
            d = (1.0 if k == 0 else 0.0, 1.0 if k == 1 else 0.0, 1.0 if k == 2 else 0.0)
            if one.points != 0:
                separate(t, one, axpy(-dot(axis, d), axis, d), ZERO)
                add_inertia(own, t, most)
            if one.turns != 0:
                separate(t, one, ZERO, d)
                add_inertia(own, t, most)


def separate(t, one, way, turn):
    """x <- J^T of the velocity with which a constraint's two places part along a vector, and turn about one."""
    x, sign = vector(t.x, t.v_size), 1.0
    clear(x)
    for k in range(2):
        if one.bodies[k] >= 0:
            b = body_at(t.bodies, one.bodies[k])
            arm = to_world(b.axes, load(one.at[k]))
            p = scale(sign, way)
            dynamics.add_impulse(t, b, p, axpy(sign, turn, cross(arm, p)), x, 1.0)
        sign = -1.0


def add_inertia(own, t, most):
    """Add the inertia w x x^T to that of a tree, w being TIED times the inertia that meets an impulse along x.

    most: [N s] by which Bullet's step may have changed its momentum along x.
    """
    n = t.v_size
    x, y, answer, change = vector(t.x, n), vector(t.room, n), 0.0, 0.0
    for k in range(n):
        change += x[k] * (vector(own.after_v, n)[k] - vector(own.start_v, n)[k])
    copy(x, y)
    dynamics.solve_lt(t, y, n - 1, True)
    for k in range(n):
        answer += axis_at(t.axes, k).inverse * y[k] * y[k]
    inertia = TIED / answer if answer > 0.0 else 0.0
    dynamics.add_square(t, t.e, most / abs(change) if most < inertia * abs(change) else inertia)


def put_at_start(own, t):
    """Set the world's tree at the start of the step, with `force` and the velocity as read."""
    copy(vector(own.force, t.v_size), vector(t.f, t.v_size))
    put(t, own.start_q, own.start_v)
    copy(vector(t.a, t.v_size), vector(own.free_acceleration, t.v_size))


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


def take_response(block, dt):
    """From velocities after Bullet's step of dt [s]: find forces on joints, and which a motor held.

    Then the world's tree is at the start of the step again, with these forces and the velocity at that time.
    """
    own = own_at(block, 0)
    t = tree_at(own.tree, 0)
    if own.tie_count > 0:
        tie(own, t, dt)
        put_at_start(own, t)
    clear(vector(own.matrix, t.v_size * t.v_size))
    t.weights, t.stride = own.matrix, t.v_size
    call_with_body(t.write_masses, body_at(t.bodies, 0))
    m, force, push = vector(own.matrix, (t.v_size, t.v_size)), vector(own.force, t.v_size), vector(own.push, t.v_size)
    before, after = vector(own.start_v, t.v_size), vector(own.after_v, t.v_size)
    gained = vector(own.gained, t.v_size)
    for k in range(t.v_size):
        gained[k] = (after[k] - before[k]) / dt
        force[k] -= push[k]
    add_product(m, vector(own.free_acceleration, t.v_size), -1.0, force)
    for k in range(t.v_size):
        axis = axis_at(t.axes, k)
        inertia = m[k, k] - axis.armature
        axis.armature = armature_of(own, k, inertia, (abs(gained[k]), abs(after[k]), abs(push[k])), dt)
        m[k, k] = inertia + axis.armature
    add_product(m, gained, 1.0, force)
    put_at_start(own, t)
    if not is_pressed(t):
        v, left, off, most = vector(own.new_v, t.v_size), vector(own.left_v, t.v_size), 0.0, 0.0
        for k in range(t.v_size):
            most = max(most, abs(before[k]))
            off = max(off, abs(before[k] - left[k]))
            v[k] = before[k] + 0.5 * dt * vector(own.free_acceleration, t.v_size)[k]
        as_left = vector(own.lags, 1)[0] != 0.0 and off <= EXACT * most
        put(t, own.start_q, own.true_v if as_left else own.new_v)


def armature_of(own, motor, inertia, sizes, dt):
    """Return the armature of an axis by the motor of its joint, and note the motor's torque; a base has none.

    inertia: without armature; sizes: of the axis' acceleration and velocity by Bullet's step, and of the push.
    """
    count, (acceleration, speed, push) = motor + 1, sizes
    torques, last, limits = vector(own.torque, count), vector(own.last_torque, count), vector(own.limit, count)
    strongest, torque, accelerating = vector(own.strongest, count), abs(torques[motor]), acceleration * inertia
    if torque > (1.0 + EXACT) * limits[motor]:
        limits[motor] = inf
    if abs(torque - last[motor]) <= EXACT * torque and accelerating > EXACT * torque:
        limits[motor] = torque
    last[motor] = torque
    strongest[motor] = max(strongest[motor], torque)
    held = accelerating < max(push, CARRIES * torque)
    if not (held and 0.0 < torque < (1.0 - EXACT) * limits[motor]):
        return 0.0
    return min(HELD * inertia, dt * strongest[motor] / speed) if speed > 0.0 else HELD * inertia


def flies(own, t, dt):
    """Return whether a tree flies as known: gravity and slight forces act, and neither motors nor constraints hold it.

    Others may be impulses within Bullet's step, as of its own contacts and of limits, which have no half step.
    """
    m, force = vector(own.matrix, (t.v_size, t.v_size)), vector(own.force, t.v_size)
    before, after, alone = vector(own.start_v, t.v_size), vector(own.after_v, t.v_size), own.tie_count == 0
    for k in range(t.v_size):
        size = 0.0
        for i in range(t.v_size):
            size += abs(m[k, i]) * (abs(before[i]) + abs(after[i]))
        alone = alone and axis_at(t.axes, k).armature == 0.0 and abs(force[k]) * dt <= SLIGHT * size
    return alone


def find_end(block, world, dt):
    """After the world's step: find what is to be written, if a contact has touched the tree, or see `near.passing`.

    Returns whether there is. If a contact is closed, finds the push of the contacts too.
    """
    own, w = own_at(block, 0), world_at(world, 0)
    t, touched = tree_at(own.tree, 0), False
    left, v, push = vector(own.left, t.q_size), vector(own.new_v, t.v_size), vector(own.push, t.v_size)
    copy(vector(t.q, t.q_size), vector(own.new_q, t.q_size))
    copy(vector(t.v, t.v_size), v)
    for i in range(t.count):
        b = body_at(t.bodies, i)
        touched = touched or b.asleep != 0 or b.touched != 0
    for k in range(t.v_size):
        touched = touched or push[k] != 0.0  # Bullet's step has it, though the contact may be no more
    clear(push)
    lags, pressed, alone = vector(own.lags, 1), vector(own.pressed, 1), flies(own, t, dt)
    lasts = pressed[0] != 0.0
    lags[0], pressed[0] = 0.0, 0.0
    if not (touched or alone):
        put(t, own.after_q, own.after_v)
        if not overlaps(w, t.first, t.count):
            copy(vector(own.after_q, t.q_size), left)
            return False
        put(t, own.new_q, own.new_v)
    copy(vector(own.new_q, t.q_size), left)
    if not is_pressed(t):
        copy(v, vector(own.true_v, t.v_size))
        if alone:
            clear(vector(t.f, t.v_size))
            put(t, own.new_q, own.true_v)
        for k in range(t.v_size):
            v[k] -= 0.5 * dt * vector(t.a, t.v_size)[k]
        copy(v, vector(own.left_v, t.v_size))
        lags[0] = 1.0
        return True
    pressed[0] = 1.0
    if not lasts:  # see `hooks.select_pushed`
        return True
    gained = vector(own.gained, t.v_size)
    copy(v, gained)
    before = vector(own.start_q, t.q_size)
    for i in range(t.count):  # Bullet keeps the spin of a base along the axes before its step
        link = link_at(t.links, i)
        if is_free(t, link):
            ball = joint_at(t.joints, link.first_joint + 3)
            q, k = ball.first_q, ball.first_axis
            turn = turn_by(load4(left[q : q + 4]), load(v[k : k + 3]))
            store(gained[k : k + 3], turn_by(conjugate(load4(before[q : q + 4])), turn))
    began, free = vector(own.start_v, t.v_size), vector(own.free_acceleration, t.v_size)
    for k in range(t.v_size):
        gained[k] = (gained[k] - began[k]) / dt - free[k]
    add_product(vector(own.matrix, (t.v_size, t.v_size)), gained, 1.0, push)
    if own.tie_count > 0:  # constraints act in Bullet's step themselves
        add_product(vector(t.e, (t.v_size, t.v_size)), gained, -1.0, push)
    return True


jit_module(__name__)
