"""Bodies between PyBullet and the world, compiled: what was read of them, what they are pushed by, where they are put.

Bullet steps v <- v + dt a, then x <- x + dt v: its velocity is that of half a step before its position, and x1 = x0 +
dt (v0 + dt a) is a parabola if the velocity at x0 is v0 + dt/2 a. So velocities are read, and so they are handed back;
but where a contact is closed at the end of a step the velocity is the true one, so that what rests has none. Of what
has lifted off a then has as much of the step's own force as was there in the step before: of a kick for one step Bullet
knows no more in the next. The same holds of the spin, whose rate of change is gyroscopic.

A step comes to an impulse and a place. Where Bullet has yet to step, a force gives the impulse, and what its place
lacks then is put right at the next call (`receive`). Where it has stepped, the world goes the same step again with
the accelerations that there were, and both are put there (`hand_back`). These follow from the velocity alone; where it
shows more than gravity and the push, Python is asked to read the place too, and the mass of what was pushed.
"""

from __future__ import annotations

from math import isfinite, nan
from typing import Any

from numba import carray  # pyright: ignore[reportPrivateImportUsage]

from contactlaw.jit import jit, jit_inside
from contactlaw.memory import doubles_at, element, set_whole
from contactlaw.pair import DEEPEST
from contactlaw.world.bodies.motion import gyroscopic, is_static, set_axes, spin_change, spin_rate
from contactlaw.world.bodies.prescribed import move_kinematic
from contactlaw.world.data.access import body_at, contact_at, near_at, pair_at, shape_at, world_at
from contactlaw.world.data.call import address, call_step, ready
from contactlaw.world.data.demand import STEP
from contactlaw.world.data.records import CLOSED, FREE, NEVER, VECTOR, record
from contactlaw.world.data.vec import (
    add,
    axpy,
    dot,
    half_turn,
    load,
    load4,
    norm,
    product,
    scale,
    share_of,
    store,
    store4,
    sub,
    to_body,
    to_world,
    unit,
)  # fmt: skip
from contactlaw.world.near.guards import outgrown, surface_speed
from contactlaw.world.near.listing import list_near, strayed
from contactlaw.world.shapes.curvature import radius_is_clear
from contactlaw.world.shapes.geometry import meet
from contactlaw.world.sleep import disturbed, lies
from contactlaw.world.step import FIND_PRESSED, GROWING_ROOM

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
    pressed="i8", was="i8",  # a contact was closed at the end of it, and of the one before
    usual=VECTOR, wrench=VECTOR,  # acceleration and moment besides gravity and contacts, in the last step that touched
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
NOTED, LISTED, LYING, FLAGS = 1, 2, 4, 8
NOT_FINITE, NO_ROOM, OTHERS, UNKNOWN = -1, -2, -3, -4
PASSED, LIST = -2, -3  # of `set_off`
SEEN, TOO_FAR, NO_RADIUS, PUT_IN = 1, 2, 4, 8  # of `look`: what is known of a contact

head_at: Any = element(HEAD)
row_at: Any = element(ROW)


@jit_inside
def receive(head, w):
    """Take what was read: put right what a body's place lacks, and give the world's bodies their motion.

    Returns twice how many bodies must be put elsewhere before Bullet steps, and one more if somebody has put one where
    it is; or -1: not finite.
    """
    head.names, head.looked, strange, moved = 0, 0, 0, False
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
            if b.asleep == 0 and (r.mass > 0.0 or not is_static(b)):
                set_out(r, b, head.dt)
            continue
        v = load(r.before.velocity)
        if r.mass == 0.0 and dot(v, v) + dot(load(r.before.spin), load(r.before.spin)) == 0.0:
            go(w, r, b, head.dt)
            strange |= r.strange
            moved = moved or r.strange != 0
            continue
        if r.mass > 0.0:
            r.strange = 0 if went(r, v) or (r.lacks != 0 and went(r, load(r.left.velocity))) else 1
        if r.lacks != 0 and r.strange == 0:
            store(r.before.position, add(load(r.before.position), load(r.shift)))
            store_quaternion(r.before, unit(product(load4(r.turn), quaternion_of(r.before))))
            if b.asleep != 0 and norm(v) + norm(load(r.before.spin)) <= EXACT * head.dt * norm(load(b.acceleration)):
                store(r.before.velocity, (0.0, 0.0, 0.0))
                store(r.before.spin, (0.0, 0.0, 0.0))
            name(head, k)
        if r.mass == 0.0 or r.strange != 0:
            strange |= r.strange
            r.pressed, moved = 0, True
        r.lacks = 0
        set_out(r, b, head.dt)
    if moved:  # something that does not sleep: itself and what it may have held wake
        w.stale = 1
        for i in range(1, w.body_count):
            b = body_at(w.bodies, i)
            if b.asleep != 0:
                b.held[0] = nan
    return 2 * head.names + strange


@jit_inside
def go(w, r, b, dt):
    """Let a body that nothing pushes, and that has not been given a velocity, go where it has been put."""
    store(b.position, load(r.left.position))
    store4(b.quaternion, quaternion_of(r.left))
    move_kinematic(w, b, load(r.before.position), quaternion_of(r.before), dt)
    r.pressed, r.strange = 0, b.placed


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
    call_step(address(w, STEP), w, head.dt, FIND_PRESSED)
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
    dt, gravity = head.dt, load(head.gravity)
    for k in range(head.count):
        r, b = row_at(head.rows, k), body_at(w.bodies, k + 1)
        r.other = 0
        if r.mass == 0.0 or r.linked != 0:
            continue
        v, old = load(r.after.velocity), load(r.before.velocity)
        u, older = load(r.after.spin), load(r.before.spin)
        if not isfinite(dot(v, v) + dot(u, u)):
            head.bad = k
            return -1
        sleep = sleep and b.asleep != 0 and not disturbed(b)
        falls = falls or (r.pressed == 0 and b.asleep == 0 and norm(gravity) > 0.0)
        other = sub(sub(v, old), scale(dt, axpy(1.0 / r.mass, load(r.force), gravity)))
        size = norm(v) + norm(old) + dt * (norm(gravity) + norm(load(r.force)) / r.mass)
        store(b.acceleration, gravity)
        turning = spin_change(b, sub(load(r.torque), gyroscopic(b, older)))
        twist = sub(sub(u, older), scale(dt, turning))
        spins = norm(u) + norm(older) + dt * norm(turning) + norm(spin_change(b, load(r.torque))) * dt
        store(b.torque, (0.0, 0.0, 0.0))
        slow, even = norm(other) <= EXACT * size, norm(twist) <= EXACT * spins
        if slow and even:
            if head.looked == 0:
                store(r.after.position, axpy(dt, v, load(r.before.position)))
                store4(r.after.quaternion, load4(r.before.quaternion))  # as it matters for what sleeps
            continue
        others += 1
        r.other = 2 if r.pressed != 0 else 1
        if not slow:
            store(b.acceleration, axpy(1.0 / dt, other, gravity))
        if not even:
            store(b.torque, moment(r, b, scale(1.0 / dt, twist)))
        set_out(r, b, dt)
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


@jit
def set_off(place):
    """The beginning of a step: `receive` and `steady`. Returns how many bodies are pushed; or, where all are so far
    from each other that they cannot touch in this step or the next, PASSED: there is no more to do.

    Or LIST: the list of near pairs must be made anew; LIST less what `receive` found, where somebody must see to it; or
    NOT_FINITE. Called again it does the same.
    """
    head = head_at(place, 0)
    w = world_at(head.world, 0)
    found = receive(head, w)
    if found != 0:
        return NOT_FINITE if found < 0 else LIST - found
    apart = head.plain != 0 and w.spares == w.contact_room and w.step > 0.0
    if apart or head.ahead != 0:
        for k in range(head.count):
            b = body_at(w.bodies, k + 1)
            if apart:
                b.still = 1 if is_static(b) else 0
            w.stale |= strayed(b, 2.0 * head.dt)
        if outgrown(w, -NEVER, 2.0 * head.dt):
            w.stale = 1
    if w.stale != 0 and head.ahead != 0:
        return LIST
    if w.stale != 0 and apart:
        list_near(w)
        w.stale = 0 if 2 * w.nears <= w.near_room else 1
    if w.stale != 0 or not (apart and far_apart(w, 2.0 * head.dt)):
        return steady(place)
    for k in range(head.count):
        r, b = row_at(head.rows, k), body_at(w.bodies, k + 1)
        b.turned += head.dt * norm(load(b.spin))  # Bullet turns it, the world does not
        keep(r, r.before, head.dt if r.mass > 0.0 else 0.0)
    return PASSED


@jit_inside
def far_apart(w, time):
    """Whether no two near shapes can touch within a time [s]."""
    for k in range(w.nears):
        p = near_at(w.near, k)
        a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
        overlap, _, _, _ = meet(shape_at(w.shapes, p.a), a, shape_at(w.shapes, p.b), b)
        if time * (surface_speed(a, time) + surface_speed(b, time)) >= -overlap:
            return False
    return True


@jit
def complete(place, stepped):
    """The world's step, after `compare` if Bullet has stepped, and `hand_back`, which returns.

    Or NOT_FINITE; or NO_ROOM: there may not be room enough in the world; or UNKNOWN: the time step and gravity must be
    read; or OTHERS: also the places of bodies that something else moved, and masses of those of them that were pushed.
    """
    head = head_at(place, 0)
    w = world_at(head.world, 0)
    if stepped != 0:
        others = compare(head, w)
        if others < 0:
            return NOT_FINITE
        if (others > 0 or head.unknown != 0) and head.looked == 0:
            head.looked = 1
            return OTHERS if others > 0 else UNKNOWN
    if not (ready(w, STEP) and call_step(address(w, STEP), w, head.dt, GROWING_ROOM)):
        return NO_ROOM
    done = hand_back(head, w, stepped)
    return done if done > 0 or not lies(w) else LYING


@jit_inside
def hand_back(head, w, stepped):
    """After the world's step: names the bodies that were touched, to be pushed with `force` and `torque` or, where
    Bullet has stepped, put where they are `left`.

    Returns FLAGS times how many, and what `look` says.
    """
    head.names = 0
    flags = look(head, w)
    for k in range(head.count):
        r, b = row_at(head.rows, k), body_at(w.bodies, k + 1)
        if r.linked != 0:
            continue
        if b.touched != 0 and r.mass > 0.0:
            finish(head, k, r, b, stepped)
        elif b.asleep != 0 or r.mass == 0.0:
            keep(r, r.before, 0.0)
            if r.mass > 0.0 and (stepped == 0 or not alike(r.after, r.before)):
                name(head, k)
        elif stepped == 0:
            keep(r, r.before, head.dt)
        else:
            keep(r, r.after, 0.0)
        if b.asleep != 0 and (stepped != 0 or b.touched == 0):  # what holds it
            store(r.force, scale(-r.mass, load(b.acceleration)))
            store(r.torque, scale(-1.0, load(b.torque)))
    return FLAGS * head.names + flags


@jit_inside
def look(head, w):
    """See which bodies have closed contacts; returns whether there is something to say of them, and whether the list
    of near pairs is new.
    """
    flags = 0 if w.lists == head.lists else LISTED
    head.lists = w.lists
    for k in range(head.count):
        r = row_at(head.rows, k)
        r.was, r.pressed = r.pressed, 0
    said = carray(doubles_at(head.seen), w.contact_room)
    for slot in range(w.contact_room):
        c = contact_at(w.contacts, slot)
        if c.phase == FREE:
            said[slot] = 0.0
            continue
        known = int(said[slot])
        notes = known | SEEN | (TOO_FAR if c.deepest > DEEPEST * c.touch.radius else 0)
        notes |= PUT_IN if c.initial_overlap > 0.0 else 0
        if known == 0 and pair_at(w.pairs, c.pair).radius == 0.0 and not radius_is_clear(w, c):
            notes |= NO_RADIUS
        if notes > known | SEEN:
            flags |= NOTED
        said[slot] = notes
        if c.phase == CLOSED:
            row_at(head.rows, c.body_a - 1).pressed = 1
            row_at(head.rows, c.body_b - 1).pressed = 1
    return flags


@jit_inside
def keep(r, m, ahead):
    """Note how a body is left, and for how long Bullet will move it yet."""
    r.left = m
    r.ahead = ahead


@jit_inside
def finish(head, k, r, b, stepped):
    """Hand back a body that was touched."""
    dt, m, turned = head.dt, r.before, load4(b.quaternion)
    lag = 0.0 if r.pressed != 0 else -0.5 * dt
    a, moved = load(b.acceleration), load(b.torque)
    push = sub(a, load(head.gravity))
    if r.was != 0 and r.pressed == 0:
        store(b.acceleration, add(load(head.gravity), share_of(load(r.usual), push)))
        store(b.torque, share_of(load(r.wrench), moved))
    store(r.usual, push)
    store(r.wrench, moved)
    v, spin = axpy(lag, load(b.acceleration), load(b.velocity)), load(b.spin)
    spin = axpy(lag, spin_rate(b, spin), spin)
    store(b.torque, moved)
    gained = sub(scale(1.0 / dt, sub(v, load(m.velocity))), a)
    store(r.force, scale(r.mass, gained))
    # the moment at the start of the step, where Bullet takes its inertia
    store4(b.quaternion, quaternion_of(m))
    set_axes(b)
    rate = sub(scale(1.0 / dt, sub(spin, load(m.spin))), spin_rate(b, load(m.spin)))
    store(r.torque, moment(r, b, rate))
    store4(b.quaternion, turned)
    set_axes(b)
    name(head, k)
    if stepped != 0:
        store(r.left.position, load(b.position))
        store_quaternion(r.left, turned)
        store(r.left.velocity, v)
        store(r.left.spin, spin)
        r.ahead, r.lacks = 0.0, 0
        return
    keep(r, m, dt)
    store(r.left.velocity, v)
    place = axpy(dt, v, load(m.position))
    store(r.shift, sub(load(b.position), place))
    c, s = half_turn(dt * dt * dot(spin, spin))
    x, y, z = scale(s * dt, spin)
    c, x, y, z = product((c, x, y, z), quaternion_of(m))  # where Bullet will have turned it
    store4(r.turn, product(turned, (c, -x, -y, -z)))
    off = norm(load(r.shift)) > EXACT * norm(sub(place, load(m.position)))
    off = off or abs(r.turn[1]) + abs(r.turn[2]) + abs(r.turn[3]) > EXACT
    r.lacks = 1 if off or b.asleep != 0 else 0
