"""Sleep: bodies of an island at rest stand still to the last bit, and cost nothing.

An island falls asleep when, within the duration of an impact, the present velocities and accelerations would move no
contact of it by more than a tiny share of its overlap. It wakes when a body that is awake comes near, or when the user
changes the velocity or acceleration of one of its bodies.
"""

from contactlaw.jit import jit_inside
from contactlaw.memory import whole_at
from contactlaw.world.bodies.motion import settle, spin_change
from contactlaw.world.contacts.pace import contact_duration
from contactlaw.world.contacts.rolling import moment_of
from contactlaw.world.data.access import body_at, contact_at, near_at, tree_at
from contactlaw.world.data.call import address, call_on_island, call_with_body, call_with_vectors, ready
from contactlaw.world.data.demand import SLEEP
from contactlaw.world.data.vec import ZERO, add, axpy, cross, dot, load, norm, scale, store, sub

POSITION_ROUNDING = 1.6e-14  # motion of a contact by rounding of positions in an impact's duration, over these
SAME = 1e-12  # relative difference of accelerations that count as equal


@jit_inside
def fall_asleep(w, bodies, pairs):
    """Put an island to sleep if it is nearly still and its forces are in balance."""
    if w.stillness != 0.0 and is_nearly_still(w, pairs, w.stillness, 1) and ready(w, SLEEP):
        call_on_island(address(w, SLEEP), w, bodies, pairs)


def sleep_if_balanced(w, bodies, pairs):
    """Put an island with hardly any velocity to sleep if its forces are in balance, and act on all its bodies."""
    for i in range(bodies):  # `shift` and `twist` are free between substeps: here they hold accelerations
        b = body_at(w.bodies, whole_at(w.island_bodies, i))
        store(b.shift, load(b.acceleration))
        store(b.twist, load(b.turning) if b.tree != 0 else spin_change(b, load(b.torque)))
        b.active = 0
    for i in range(pairs):
        p = near_at(w.near, whole_at(w.island_pairs, i))
        if p.closed != 0:
            c = contact_at(w.contacts, p.slot)
            force, moment = load(c.force), moment_of(c)
            add_load(body_at(w.bodies, p.body_a), force, sub(cross(load(c.arm_a), force), moment))
            add_load(body_at(w.bodies, p.body_b), scale(-1.0, force), sub(moment, cross(load(c.arm_b), force)))
    if not is_nearly_still(w, pairs, w.stillness, 2):
        return
    for i in range(bodies):
        b = body_at(w.bodies, whole_at(w.island_bodies, i))
        if b.active == 0:
            return
    for i in range(bodies):
        b = body_at(w.bodies, whole_at(w.island_bodies, i))
        store(b.held, load(b.acceleration))
        store(b.velocity, ZERO)
        store(b.spin, ZERO)
        store(b.momentum, ZERO)
        b.asleep = 1
        b.still = 1
        if b.tree != 0 and b.member == 0:
            call_with_body(tree_at(b.tree, 0).stop, b)


@jit_inside
def is_nearly_still(w, pairs, share, order):
    """Return whether closed contacts move by less than a share of their overlaps in an impact's duration; none: False.

    order: 1, by the bodies' velocities; 2, by the accelerations in `shift` and `twist`.
    """
    some = False
    for i in range(pairs):
        p = near_at(w.near, whole_at(w.island_pairs, i))
        if p.closed != 0:
            some = True
            c = contact_at(w.contacts, p.slot)
            a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
            time = contact_duration(w, c, a, b)
            rate = max_rate(a, norm(load(c.arm_a)), order) + max_rate(b, norm(load(c.arm_b)), order)
            rounding = POSITION_ROUNDING * (norm(load(a.position)) + norm(load(b.position)))
            if rate * time * (time if order == 2 else 1.0) > share * c.touch.overlap + rounding:
                return False
    return some


@jit_inside
def max_rate(b, arm, order):
    """Return a bound on the speed or acceleration of a point `arm` [m] from a body's centre of mass.

    In a tree that of all its bodies. order: as for `is_nearly_still`.
    """
    out = max_rate_of_one(b, arm, order)
    if b.tree != 0:
        t = tree_at(b.tree, 0)
        for i in range(t.count):
            out = max(out, max_rate_of_one(body_at(t.bodies, i), arm, order))
    return out


@jit_inside
def max_rate_of_one(b, arm, order):
    """Return `max_rate` of a single body."""
    if order == 2:
        return norm(load(b.shift)) + norm(load(b.twist)) * arm
    return norm(load(b.velocity)) + norm(load(b.spin)) * arm


@jit_inside
def add_load(b, force, moment):
    """Add the effect of a force [N] and a moment [N m] to the accelerations of a body, unless it stands still."""
    if b.still == 0 and b.tree != 0:
        call_with_vectors(tree_at(b.tree, 0).add_accelerations, b, force, moment)
    elif b.still == 0:
        store(b.shift, axpy(b.inverse_mass, force, load(b.shift)))
        store(b.twist, add(load(b.twist), spin_change(b, moment)))
        b.active = 1


@jit_inside
def wake(w, now):
    """Wake all sleeping bodies of pairs that are active in the window that begins now [s]."""
    for k in range(w.nears):
        p = near_at(w.near, k)
        if p.active != 0:
            for i in (p.body_a, p.body_b):
                b = body_at(w.bodies, i)
                if b.asleep != 0:
                    wake_body(b, now)
                    settle(b)


@jit_inside
def wake_body(b, now):
    """Wake a body, and all others of its tree."""
    if b.tree == 0:
        wake_one(b, now)
    else:
        t = tree_at(b.tree, 0)
        for i in range(t.count):
            wake_one(body_at(t.bodies, i), now)


@jit_inside
def wake_one(b, now):
    """Wake a single body."""
    b.asleep = 0
    b.still = 0
    b.time = now
    b.changed = 1


@jit_inside
def is_at_rest(w):
    """Return whether no body has moved in the last step, and none will in this one."""
    if w.rested == 0 or w.stale != 0:
        return False
    for i in range(w.body_count):
        b = body_at(w.bodies, i)
        if b.inverse_mass != 0.0 and (b.asleep == 0 or is_disturbed(b)):
            return False
    return True


@jit_inside
def is_disturbed(b):
    """Return whether a sleeping body has a velocity, or another load than when it fell asleep.

    Engines may report one and the same load with rounding errors. `held` may be NaN: then the load differs.
    """
    if b.tree != 0:
        return tree_at(b.tree, 0).disturbed != 0
    held = load(b.held)
    change = sub(load(b.acceleration), held)
    moving = dot(load(b.velocity), load(b.velocity)) + dot(load(b.spin), load(b.spin))
    same = dot(change, change) <= SAME * SAME * dot(held, held)
    return moving != 0.0 or not same or dot(load(b.torque), load(b.torque)) != 0.0
