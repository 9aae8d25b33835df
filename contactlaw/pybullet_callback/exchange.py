"""Bodies between PyBullet and the world, compiled: what was read of them, what they are pushed by, where they are put.

Bullet steps v <- v + dt a, then x <- x + dt v: its velocity is that of half a step before its position, and x1 = x0 +
dt (v0 + dt a) is a parabola if the velocity at x0 is v0 + dt/2 a. So velocities are read, and so they are handed back;
but where a contact is closed at the end of a step the velocity is the true one, so that what rests has none. The same
holds of the spin, whose rate of change is gyroscopic.

A step comes to an impulse and a place. Where Bullet has yet to step, a force gives the impulse, and what its place
lacks then is put right at the next call (`receive`). Where it has stepped, the world goes the same step again with
the accelerations that there were, and both are put there (`hand_back`). These follow from the velocity alone; where it
shows more than gravity and the push, Python is asked to read the place too, and the mass of what was pushed.
"""

from __future__ import annotations

from math import isfinite, nan, sqrt
from typing import Any

from contactlaw.jit import jit, jit_inside
from contactlaw.memory import element, set_whole
from contactlaw.world.access import body_at, world_at
from contactlaw.world.call import address, call_step
from contactlaw.world.demand import STEP
from contactlaw.world.leading import lead
from contactlaw.world.motion import give, gyroscopic, set_axes, spin_rate, stands
from contactlaw.world.records import VECTOR, record
from contactlaw.world.sleep import disturbed
from contactlaw.world.step import PRESSED
from contactlaw.world.vec import (
    add,
    axpy,
    dot,
    load,
    load4,
    norm,
    product,
    scale,
    store,
    store4,
    sub,
    to_body,
    to_world,
)  # fmt: skip

MOTION = record(position=VECTOR, quaternion=("f8", (4,)), velocity=VECTOR, spin=VECTOR)
"""As PyBullet tells it, quaternion scalar last."""

ROW = record(
    before=MOTION, after=MOTION,  # Bullet's step
    left=MOTION,  # how the last call left it
    ahead="f8",  # [s] that Bullet has stepped since
    lacks="i8",  # its place lacks something then
    shift=VECTOR, turn=("f8", (4,)),  # and what: [m], quaternion scalar first
    mass="f8", inertia=VECTOR,  # zero mass: nothing can move it
    linked="i8",  # of a body with joints, see `linked`
    force=VECTOR, torque=VECTOR,  # mean of what contacts did in the last step [N], [N m]
    pressed="i8",  # a contact was closed at the end of it
    strange="i8",  # somebody has put it where it is
    other="i8",  # how Bullet's step moved it was not gravity and the push alone; 2: of one that was pushed
)  # fmt: skip
"""A body as the world and PyBullet exchange it."""

HEAD = record(
    world="u8", rows="u8", seen="u8", count="i8",
    dt="f8", gravity=VECTOR,
    plain="i8",  # nobody has joints, or must be measured
    ahead="i8",  # who may touch in the next step must be listed before it
    looked="i8",  # what was asked for in this step has been read
    unknown="i8",  # nothing has shown that the time step and gravity are those known
    lists="i8",  # of near pairs that there have been
    bad="i8",  # the row whose numbers are not finite
    named="u8", names="i8",  # rows of bodies that are to be pushed, or put elsewhere, and how many
)  # fmt: skip
"""What compiled code is given: addresses, the step [s], gravity; and what came out."""

EXACT = 1e-12  # relative difference that is rounding
NOTED, LISTED, FLAGS = 1, 2, 4
NOT_FINITE, NO_ROOM, OTHERS, UNKNOWN = -1, -2, -3, -4

head_at: Any = element(HEAD)
row_at: Any = element(ROW)


@jit_inside
def receive(head, w):
    """Take what was read: put right what a body's place lacks, and give the world's bodies their motion.

    Returns twice how many bodies must be put elsewhere before Bullet steps, and one more if somebody has put one where
    it is; or -1: not finite.
    """
    head.names = 0
    head.looked = 0
    strange = 0
    for k in range(head.count):
        r = row_at(head.rows, k)
        if not finite(r.before):
            head.bad = k
            return -1
    for k in range(head.count):
        r = row_at(head.rows, k)
        if r.linked != 0:
            continue
        b = body_at(w.bodies, k + 1)
        store(b.acceleration, load(head.gravity) if r.mass > 0.0 else (0.0, 0.0, 0.0))
        store(b.torque, (0.0, 0.0, 0.0))
        r.strange = 0
        if r.ahead == 0.0 and alike(r.before, r.left):
            if b.asleep == 0 and (r.mass > 0.0 or not stands(b)):
                set_out(r, b, head.dt)
            continue
        v = load(r.before.velocity)
        if r.mass == 0.0 and dot(v, v) + dot(load(r.before.spin), load(r.before.spin)) == 0.0:
            go(w, k + 1, r, b, head.dt)
            continue
        if r.mass > 0.0:
            r.strange = 0 if went(r, v) or (r.lacks != 0 and went(r, load(r.left.velocity))) else 1
        if r.lacks != 0 and r.strange == 0:
            store(r.before.position, add(load(r.before.position), load(r.shift)))
            q = product(load4(r.turn), quaternion_of(r.before))
            one = 1.0 / sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
            store_quaternion(r.before, (one * q[0], one * q[1], one * q[2], one * q[3]))
            if b.asleep != 0 and norm(v) + norm(load(r.before.spin)) <= EXACT * head.dt * norm(load(b.acceleration)):
                store(r.before.velocity, (0.0, 0.0, 0.0))
                store(r.before.spin, (0.0, 0.0, 0.0))
            name(head, k)
        if r.mass == 0.0 or r.strange != 0:
            strange |= r.strange
            r.pressed = 0
            w.stale = 1
            stir(w)  # itself, and what it may have held
        r.lacks = 0
        set_out(r, b, head.dt)
    return 2 * head.names + strange


@jit_inside
def go(w, i, r, b, dt):
    """Let a body that nothing pushes, and that has not been given a velocity, go where it has been put."""
    store(b.position, load(r.left.position))
    store4(b.quaternion, quaternion_of(r.left))
    lead(w, i, b, load(r.before.position), quaternion_of(r.before), dt)
    r.pressed = 0
    if b.placed != 0:
        stir(w)


@jit_inside
def finite(m):
    """Whether a motion is."""
    total = 0.0
    for i in range(3):
        total += m.position[i] + m.velocity[i] + m.spin[i]
    return isfinite(total + m.quaternion[0] + m.quaternion[1] + m.quaternion[2] + m.quaternion[3])


@jit_inside
def alike(a, b):
    """Whether two motions are the same to the bit."""
    same = a.quaternion[3] == b.quaternion[3]
    for i in range(3):
        same = same and a.position[i] == b.position[i] and a.quaternion[i] == b.quaternion[i]
        same = same and a.velocity[i] == b.velocity[i] and a.spin[i] == b.spin[i]
    return same


@jit_inside
def went(r, v):
    """Whether a body is where a velocity takes it in the time that Bullet has stepped since it was left."""
    x, way = load(r.before.position), scale(r.ahead, v)
    return norm(sub(sub(x, load(r.left.position)), way)) <= EXACT * (norm(x) + norm(way))


@jit_inside
def stir(w):
    """Wake all bodies: something that does not sleep was moved."""
    for i in range(1, w.body_count):
        b = body_at(w.bodies, i)
        if b.asleep != 0:
            b.held[0] = nan


@jit_inside
def set_out(r, b, dt):
    """The world's body where PyBullet's is, with its true velocity; `acceleration` and `torque` are known."""
    m = r.before
    store(b.position, load(m.position))
    store4(b.quaternion, quaternion_of(m))
    set_axes(b)
    lag = 0.5 * dt if r.pressed == 0 and r.mass > 0.0 else 0.0
    store(b.velocity, axpy(lag, load(b.acceleration), load(m.velocity)))
    store(b.spin, axpy(lag, spin_rate(b, load(m.spin)), load(m.spin)))


@jit
def press(place):
    """Find who is pressed: bodies that somebody has put on others have their true velocities, as all that touch do."""
    head = head_at(place, 0)
    w = world_at(head.world, 0)
    call_step(address(w, STEP), w, head.dt, PRESSED)
    for k in range(head.count):
        r, b = row_at(head.rows, k), body_at(w.bodies, k + 1)
        if r.strange != 0 and b.pressed != 0:
            r.pressed = 1
            if r.linked == 0:
                set_out(r, b, head.dt)


@jit
def steady(place):
    """Name those that are to be pushed with what pressed on them in the last step; returns how many."""
    head = head_at(place, 0)
    head.names = 0
    for k in range(head.count):
        r = row_at(head.rows, k)
        if r.linked != 0 or r.mass == 0.0:
            continue
        if r.pressed == 0 or r.strange != 0:
            store(r.force, (0.0, 0.0, 0.0))
            store(r.torque, (0.0, 0.0, 0.0))
        else:
            name(head, k)
    return head.names


@jit_inside
def compare(head, w):
    """After Bullet's step: the accelerations that it gave to bodies besides the steady push; -1: not finite.

    Where that was gravity alone they are left as they are, to the bit. Returns how many had others. One that falls free
    shows that the time step and gravity are those known; where all sleep, held, the step does not matter.
    """
    others, falls, sleep = 0, False, head.plain != 0
    for k in range(head.count):
        r = row_at(head.rows, k)
        b = body_at(w.bodies, k + 1)
        r.other = 0
        if r.mass == 0.0 or r.linked != 0:
            continue
        v, old = load(r.after.velocity), load(r.before.velocity)
        u, older = load(r.after.spin), load(r.before.spin)
        if not isfinite(dot(v, v) + dot(u, u)):
            head.bad = k
            return -1
        sleep = sleep and b.asleep != 0 and not disturbed(b)
        falls = falls or (r.pressed == 0 and b.asleep == 0 and norm(load(head.gravity)) > 0.0)
        known = axpy(1.0 / r.mass, load(r.force), load(head.gravity))
        other = sub(sub(v, old), scale(head.dt, known))
        size = norm(v) + norm(old) + head.dt * (norm(load(head.gravity)) + norm(load(r.force)) / r.mass)
        store(b.acceleration, load(head.gravity))
        store(b.torque, sub(load(r.torque), gyroscopic(b, older)))
        turning = give(b, load(b.torque))
        twist = sub(sub(u, older), scale(head.dt, turning))
        spins = norm(u) + norm(older) + head.dt * norm(turning) + norm(give(b, load(r.torque))) * head.dt
        store(b.torque, (0.0, 0.0, 0.0))
        slow, even = norm(other) <= EXACT * size, norm(twist) <= EXACT * spins
        if slow and even:
            if head.looked == 0:
                store(r.after.position, axpy(head.dt, v, load(r.before.position)))
                for i in range(4):  # as it matters for what sleeps
                    r.after.quaternion[i] = r.before.quaternion[i]
            continue
        others += 1
        r.other = 2 if r.pressed != 0 else 1
        if not slow:
            store(b.acceleration, axpy(1.0 / head.dt, other, load(head.gravity)))
        if not even:
            store(b.torque, moment(r, b, scale(1.0 / head.dt, twist)))
        set_out(r, b, head.dt)
    head.unknown = 0 if others == 0 and (sleep or falls) else 1
    return others


@jit_inside
def moment(r, b, rate):
    """What it takes to give a body an angular acceleration [N m]."""
    p, i = to_body(b.axes, rate), r.inertia
    return to_world(b.axes, (i[0] * p[0], i[1] * p[1], i[2] * p[2]))


@jit_inside
def quaternion_of(m):
    """Of a motion, scalar first."""
    return m.quaternion[3], m.quaternion[0], m.quaternion[1], m.quaternion[2]


@jit_inside
def store_quaternion(m, q):
    """Write a quaternion, scalar first, into a motion."""
    m.quaternion[3], m.quaternion[0], m.quaternion[1], m.quaternion[2] = q


@jit_inside
def name(head, k):
    """Name a row, of a body that Python must push or put."""
    set_whole(head.named, head.names, k)
    head.names += 1
