"""Sleep: bodies at rest stand still to the last bit, and cost nothing.

Bodies that closed contacts connect fall asleep together when their forces are in balance but for a tiny share s, and
their kinetic energy is less than that share of the contacts' elastic one: within the duration of an impact, in which
k = m (pi/T)^2, accelerations would move none of these contacts by more than s of its overlap, nor velocities by more
than sqrt(s). They wake when a body that is awake touches them, or may do so in a window, or when the user changes the
velocity or acceleration of one of them.
"""

from math import sqrt

from contactlaw.jit import jit_module
from contactlaw.memory import whole_at
from contactlaw.world.bodies.motion import settle, spin_change, turning_of, wake_body
from contactlaw.world.contacts.force import moment_of
from contactlaw.world.contacts.pace import contact_duration
from contactlaw.world.data.access import body_at, contact_at, near_at, tree_at
from contactlaw.world.data.call import address, call_on_island, call_with_body, call_with_vectors, ready
from contactlaw.world.data.demand import SLEEP
from contactlaw.world.data.vec import ZERO, add, axpy, cross, dot, load, norm, scale, store, sub
from contactlaw.world.window import join, root_of

POSITION_ROUNDING = 1.6e-14  # motion of a contact by rounding of positions in an impact's duration, over these
SAME = 1e-12  # relative difference of accelerations that count as equal
UNPRESSED, STILL, MOVING = range(3)  # values of `BODY.active` of the first body of what may sleep together


def fall_asleep(w, bodies, pairs):
    """Put those parts of an island to sleep that are nearly still and whose forces are in balance.

    A part is what closed contacts connect. Bodies without contact, and what rolls or flies among others that are at
    rest, are parts of their own.
    """
    if w.stillness == 0.0:
        return
    for i in range(bodies):
        k = whole_at(w.island_bodies, i)
        b = body_at(w.bodies, k)
        b.island, b.active = k - b.member, UNPRESSED
    for i in range(pairs):
        p = near_at(w.near, whole_at(w.island_pairs, i))
        if p.closed != 0:
            join(w, p.body_a, p.body_b)
    if find_still_parts(w, pairs, 1) and ready(w, SLEEP):
        call_on_island(address(w, SLEEP), w, bodies, pairs)


def sleep_if_balanced(w, bodies, pairs):
    """Put those parts of an island to sleep that have hardly any velocity and whose forces are in balance."""
    for i in range(bodies):  # `shift` and `twist` are free between substeps: here they hold accelerations
        b = body_at(w.bodies, whole_at(w.island_bodies, i))
        store(b.shift, load(b.acceleration))
        store(b.twist, turning_of(b))
        b.square_rate = 0.0
    for i in range(pairs):
        p = near_at(w.near, whole_at(w.island_pairs, i))
        if p.closed != 0 and part_of(w, p).active == STILL:
            c, a, b = contact_at(w.contacts, p.slot), body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
            force, moment = load(c.force), moment_of(c)
            add_load(a, force, sub(cross(load(c.arm_a), force), moment))
            add_load(b, scale(-1.0, force), sub(moment, cross(load(c.arm_b), force)))
            rate = contact_duration(w, c, a, b) ** -2
            a.square_rate, b.square_rate = max(a.square_rate, rate), max(b.square_rate, rate)
    if not find_still_parts(w, pairs, 2):
        return
    for i in range(bodies):
        k = whole_at(w.island_bodies, i)
        b = body_at(w.bodies, k)
        if body_at(w.bodies, root_of(w, k)).active != STILL:
            continue
        store(b.held, load_on(b))
        store(b.velocity, ZERO)
        store(b.spin, ZERO)
        store(b.momentum, ZERO)
        b.asleep, b.still = 1, 1
        b.pause, b.last_pause = 0, 0  # a saved state has none of what sleeps
        if b.tree != 0 and b.member == 0:
            call_with_body(tree_at(b.tree, 0).stop, b)


def find_still_parts(w, pairs, order):
    """Mark those parts of an island as MOVING that have a contact that moves; return whether any is STILL.

    `active` of a part's first body tells. order: see `moves`; 2: only parts that are STILL so far are looked at.
    """
    some = False
    for i in range(pairs):
        p = near_at(w.near, whole_at(w.island_pairs, i))
        if p.closed != 0:
            part = part_of(w, p)
            if part.active != MOVING:
                part.active = MOVING if moves(w, p, order) else STILL
    for i in range(pairs):
        p = near_at(w.near, whole_at(w.island_pairs, i))
        some = some or (p.closed != 0 and part_of(w, p).active == STILL)
    return some


def part_of(w, p):
    """Return the first body of the part that a closed pair belongs to."""
    return body_at(w.bodies, root_of(w, p.body_a if body_at(w.bodies, p.body_a).still == 0 else p.body_b))


def moves(w, p, order):
    """Return whether a closed contact moves by more than a share of its overlap in an impact's duration.

    A kinematic body moves on for ever, so of its motion rounding alone does not count.
    order: 1, by the bodies' velocities; 2, by the accelerations in `shift` and `twist`. An acceleration acts for an
    impact of the body's stiffest contact, which then returns it: so rounding there does not count in a weak contact.
    """
    c = contact_at(w.contacts, p.slot)
    a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
    time = contact_duration(w, c, a, b)
    way_a, way_b = greatest_way(a, norm(load(c.arm_a)), time, order), greatest_way(b, norm(load(c.arm_b)), time, order)
    driven = (way_a if a.inverse_mass == 0.0 else 0.0) + (way_b if b.inverse_mass == 0.0 else 0.0)
    rounding = POSITION_ROUNDING * (norm(load(a.position)) + norm(load(b.position)))
    share = sqrt(w.stillness) if order == 1 else w.stillness
    return way_a + way_b > share * c.touch.overlap + rounding or driven > rounding


def greatest_way(b, arm, time, order):
    """Return a bound on how far [m] a point `arm` [m] from a body's centre of mass moves in a time [s].

    In a tree that of all its bodies. order: as for `moves`.
    """
    out = 0.0
    for i in range(tree_at(b.tree, 0).count if b.tree != 0 else 1):
        one = body_at(tree_at(b.tree, 0).bodies, i) if b.tree != 0 else b
        way = (norm(load(one.velocity)) + norm(load(one.spin)) * arm) * time
        if order == 2:
            way = (norm(load(one.shift)) + norm(load(one.twist)) * arm) * min(time * time, 1.0 / one.square_rate)
        out = max(out, way)
    return out


def add_load(b, force, moment):
    """Add the effect of a force [N] and a moment [N m] to the accelerations of a body, unless it stands still."""
    if b.still == 0 and b.tree != 0:
        call_with_vectors(tree_at(b.tree, 0).add_accelerations, b, force, moment)
    elif b.still == 0:
        store(b.shift, axpy(b.inverse_mass, force, load(b.shift)))
        store(b.twist, add(load(b.twist), spin_change(b, moment)))


def wake(w, now, touched):
    """Wake sleeping bodies of active pairs from a time of the step on [s]; return whether there were any.

    touched: only those with a closed contact with a body that is awake.
    """
    some = False
    for k in range(w.nears):
        p = near_at(w.near, k)
        if p.active != 0 and (p.closed != 0 or not touched):
            a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
            if touched and a.still != 0 and b.still != 0:
                continue
            for one in (a, b):
                if one.asleep != 0:
                    wake_body(one, now)
                    settle(one)
                    some = True
    return some


def is_at_rest(w):
    """Return whether no body has moved in the last step, and none will in this one."""
    if w.rested == 0 or w.stale != 0:
        return False
    for i in range(w.body_count):
        b = body_at(w.bodies, i)
        if b.inverse_mass != 0.0 and (b.asleep == 0 or is_disturbed(b)):
            return False
    return True


def is_disturbed(b):
    """Return whether a sleeping body has a velocity, or another load than when it fell asleep.

    Engines may report one and the same load with rounding errors. `held` may be NaN: then the load differs.
    """
    if b.tree != 0:
        return tree_at(b.tree, 0).disturbed != 0
    held = load(b.held)
    change = sub(load_on(b), held)
    moving = dot(load(b.velocity), load(b.velocity)) + dot(load(b.spin), load(b.spin))
    return moving != 0.0 or not dot(change, change) <= SAME * SAME * dot(held, held)


def load_on(b):
    """Return what acts on a free body besides contacts, as an acceleration [m/s^2]; torques act at its `size`."""
    return axpy(b.inverse_mass / b.size, load(b.torque), load(b.acceleration)) if b.size > 0.0 else load(b.acceleration)


jit_module(__name__)
