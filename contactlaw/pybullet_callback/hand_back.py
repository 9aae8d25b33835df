"""What a step of the world came to, handed back to PyBullet, compiled; see `exchange`."""

from __future__ import annotations

from numba import carray  # pyright: ignore[reportPrivateImportUsage]

from contactlaw.jit import jit, jit_inside
from contactlaw.memory import doubles_at
from contactlaw.pair import DEEPEST
from contactlaw.pybullet_callback.exchange import (
    EXACT,
    FLAGS,
    LISTED,
    NO_ROOM,
    NOT_FINITE,
    NOTED,
    OTHERS,
    UNKNOWN,
    alike,
    compare,
    head_at,
    moment,
    name,
    quaternion_of,
    receive,
    row_at,
    steady,
    store_quaternion,
)
from contactlaw.world.access import body_at, contact_at, near_at, pair_at, shape_at, world_at
from contactlaw.world.call import address, call_step, ready
from contactlaw.world.clear import is_clear
from contactlaw.world.demand import STEP
from contactlaw.world.geometry import meet
from contactlaw.world.guards import outgrown, surface_speed
from contactlaw.world.motion import set_axes, spin_rate
from contactlaw.world.near import list_near, strayed
from contactlaw.world.records import CLOSED, FREE, NEVER
from contactlaw.world.step import GROWS
from contactlaw.world.vec import axpy, dot, half_turn, load, load4, norm, product, scale, store, store4, sub

PASSED, LIST = -2, -3  # of `set_off`
SEEN, TOO_FAR, NO_RADIUS, PUT_IN = 1, 2, 4, 8  # of `look`: what is known of a contact


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
                b.still = 1 if b.inverse_mass == 0.0 else 0
            if strayed(b, 2.0 * head.dt):
                w.stale = 1
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
    if not (ready(w, STEP) and call_step(address(w, STEP), w, head.dt, GROWS)):
        return NO_ROOM
    return hand_back(head, w, stepped)


@jit_inside
def hand_back(head, w, stepped):
    """After the world's step: names the bodies that were touched, to be pushed with `force` and `torque` or, where
    Bullet has stepped, put where they are `left`.

    Returns FLAGS times how many, and what `look` says.
    """
    head.names = 0
    for k in range(head.count):
        row_at(head.rows, k).pressed = 0
    flags = look(head, w)
    for k in range(head.count):
        r = row_at(head.rows, k)
        b = body_at(w.bodies, k + 1)
        if r.linked != 0:
            continue
        if r.mass == 0.0:
            keep(r, r.before, 0.0)
        elif b.asleep != 0 and b.touched == 0:
            hold(r, b)
            keep(r, r.before, 0.0)
            if stepped == 0 or not alike(r.after, r.before):
                name(head, k)
        elif b.touched == 0:
            if stepped == 0:
                keep(r, r.before, head.dt)
            else:
                keep(r, r.after, 0.0)
        else:
            finish(head, k, r, b, stepped)
    return FLAGS * head.names + flags


@jit_inside
def look(head, w):
    """See which bodies have closed contacts; returns whether there is something to say of them, and whether the list
    of near pairs is new.
    """
    flags = 0 if w.lists == head.lists else LISTED
    head.lists = w.lists
    said = carray(doubles_at(head.seen), w.contact_room)
    for slot in range(w.contact_room):
        c = contact_at(w.contacts, slot)
        if c.phase == FREE:
            said[slot] = 0.0
            continue
        known = int(said[slot])
        notes = known | SEEN | (TOO_FAR if c.deepest > DEEPEST * c.touch.radius else 0)
        notes |= PUT_IN if c.built > 0.0 else 0
        if known == 0 and pair_at(w.pairs, c.pair).radius == 0.0 and not is_clear(w, c):
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
def hold(r, b):
    """What holds a body that sleeps."""
    store(r.force, scale(-r.mass, load(b.acceleration)))
    store(r.torque, scale(-1.0, load(b.torque)))


@jit_inside
def finish(head, k, r, b, stepped):
    """Hand back a body that was touched."""
    dt = head.dt
    lag = 0.0 if r.pressed != 0 else -0.5 * dt
    v = axpy(lag, load(b.acceleration), load(b.velocity))
    spin = load(b.spin)
    spin = axpy(lag, spin_rate(b, spin), spin)
    x1 = load(b.position)
    turned = load4(b.quaternion)
    m = r.before
    gained = sub(scale(1.0 / dt, sub(v, load(m.velocity))), load(b.acceleration))
    store(r.force, scale(r.mass, gained))
    # the moment at the start of the step, where Bullet takes its inertia
    store4(b.quaternion, quaternion_of(m))
    set_axes(b)
    rate = sub(scale(1.0 / dt, sub(spin, load(m.spin))), spin_rate(b, load(m.spin)))
    store(r.torque, moment(r, b, rate))
    store4(b.quaternion, turned)
    set_axes(b)
    name(head, k)
    if stepped == 0:
        keep(r, m, dt)
        store(r.left.velocity, v)
        place = axpy(dt, v, load(m.position))
        store(r.shift, sub(x1, place))
        c, s = half_turn(dt * dt * dot(spin, spin))
        x, y, z = scale(s * dt, spin)
        c, x, y, z = product((c, x, y, z), quaternion_of(m))  # where Bullet will have turned it
        store4(r.turn, product(turned, (c, -x, -y, -z)))
        off = norm(load(r.shift)) > EXACT * norm(sub(place, load(m.position)))
        off = off or abs(r.turn[1]) + abs(r.turn[2]) + abs(r.turn[3]) > EXACT
        r.lacks = 1 if off or b.asleep != 0 else 0
        return
    done = r.after
    store(done.position, x1)
    store_quaternion(done, turned)
    store(done.velocity, v)
    store(done.spin, spin)
    keep(r, done, 0.0)
    r.lacks = 0
    if b.asleep != 0:
        hold(r, b)
