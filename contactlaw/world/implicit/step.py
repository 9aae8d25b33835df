"""What lasts: an island in which nothing strikes takes one implicit step.

Contacts that carry a load are a hundred times stiffer than the engine's step can follow, and nothing that they do
within it matters. The velocities V of the bodies at the end of a stage of b seconds satisfy

    M (V - v) = b (M a + J^T F(X, V))        X = x + b V

with contacts where the bodies are then. Two such stages, b = (1 - 1/sqrt 2) h, make a step of second order that damps
what is stiff (Alexander, SIAM J. Numer. Anal. 14 (1977), the method S2): what slides or rolls under a constant load
goes where it should, what swings comes to rest. They are solved by Newton's method, whose factors stay while they
serve; momentum is kept by each of its steps. Nothing is changed where it does not converge.

Where joints hold bodies, forces on these stay what they are as the step begins, and what swings would gain
omega^2 h/2 of its energy a second. One stage b = h, which keeps it as engines do, takes the place of both unless
something slides.
"""

from __future__ import annotations

from math import isfinite, sqrt

from contactlaw.jit import jit_inside
from contactlaw.memory import whole_at
from contactlaw.world.bodies.motion import settle, spin_change, spin_rate, update_momentum
from contactlaw.world.contacts.rolling import moment_of
from contactlaw.world.contacts.touch import add_work, end_contact, force_of
from contactlaw.world.data.access import (
    body_at,
    contact_at,
    copy_numbers,
    near_at,
    restore_body,
    restore_contact,
    restore_law_state,
    row_at,
    save_body,
    save_contact,
    saved_body,
    tree_at,
)
from contactlaw.world.data.call import call_with_body
from contactlaw.world.data.records import NEVER, PAUSE_LIMIT
from contactlaw.world.data.vec import add, axpy, cross, load, load4, norm, product, rotation_vector, scale, store, sub
from contactlaw.world.implicit.acceptance import GAINED, changes, energy, is_held, is_lasting, is_steady
from contactlaw.world.implicit.equations import (
    ACCELERATION,
    BEFORE,
    BEGUN,
    FREE,
    RIGHT,
    VELOCITY,
    factorise,
    masses,
    part,
    substitute,
)
from contactlaw.world.implicit.newton import begin_equations, begin_matrix, enter, look_at
from contactlaw.world.island import members
from contactlaw.world.sleep import fall_asleep, wake
from contactlaw.world.trees.kinematics import vector
from contactlaw.world.window import activate, link

SHARE = 1.0 - sqrt(0.5)  # of the step, a stage
LOOKS, FACTORED = 25, 12  # steps of Newton's method, and factorisations, at most: who needs more hardly ever gets there
CHORD = 0.1  # of what was missing, left by a step: as long as it is less, the factors stay


def let_last(w):
    """Take islands of contacts that last through the step; returns whether there are any."""
    while activate(w, 0.0, w.step):
        wake(w, 0.0)
    link(w)
    some = False
    for k in range(w.islands):
        bodies, pairs = members(w, whole_at(w.roots, k))
        if tries(w, bodies) and is_lasting(w, bodies, pairs) and last(w, bodies, pairs):
            fall_asleep(w, bodies, pairs)
            some = True
    return some


@jit_inside
def tries(w, bodies):
    """Whether an island is to be tried: where none was found, it waits, each time about twice as many steps."""
    now = True
    for i in range(bodies):
        b = body_at(w.bodies, whole_at(w.island_bodies, i))
        if b.pause > 0:
            b.pause -= 1
            now = False
    return now


@jit_inside
def last(w, bodies, pairs):
    """Take the step with an island of lasting contacts; returns whether it was found."""
    stages = 1 if is_held(w, bodies, pairs) else 2
    begin(w, bodies, pairs)
    before, _ = energy(w, bodies, pairs)
    stage = SHARE * w.step if stages == 2 else w.step
    launch(w, stage, 0.0)
    steady = is_steady(w, bodies, pairs)
    if steady:
        go_on(w, bodies, pairs, stage)
    solved = solve(w, bodies, pairs, stage, stage)
    if solved and stages == 2:
        add_impulses(w, pairs, w.step - stage)
        launch(w, stage, w.step - stage)
        if steady:
            velocity, begun = part(w, VELOCITY), part(w, BEGUN)
            for i in range(w.unknowns):
                velocity[i] += (w.step / stage - 1.0) * (velocity[i] - begun[i])
        solved = solve(w, bodies, pairs, stage, w.step)
    found = solved and not changes(w, pairs)
    if found:
        after, size = energy(w, bodies, pairs)
        found = after - before <= GAINED * size
    if found:
        add_impulses(w, pairs, stage)
        w.implicit += 1
    for i in range(bodies):
        k = whole_at(w.island_bodies, i)
        b = body_at(w.bodies, k)
        waits = 0 if solved else min(2 * b.last_pause + 1, PAUSE_LIMIT - 1)
        if found:
            b.time = w.step
            b.done = 1
            b.touched = 1
            b.changed = 1
            update_momentum(b)
        else:
            restore_body(w, k)
        b.pause, b.last_pause = waits, waits
        if b.tree != 0 and b.member == 0:
            if not found:
                t = tree_at(b.tree, 0)
                copy_numbers(t.start, t.q, t.q_size)
                copy_numbers(t.start + 8 * t.q_size, t.v, t.v_size)
            settle(b)
    for i in range(pairs):
        end(w, row_at(w.rows, i), found)
    return found


@jit_inside
def begin(w, bodies, pairs):
    """Keep what the step starts from; begin the rows."""
    v, a = part(w, BEGUN), part(w, ACCELERATION)
    for i in range(bodies):
        k = whole_at(w.island_bodies, i)
        save_body(w, k)
        b = body_at(w.bodies, k)
        if b.tree != 0:
            if b.member == 0:
                t = tree_at(b.tree, 0)
                copy_numbers(t.q, t.start, t.q_size)
                copy_numbers(t.v, t.start + 8 * t.q_size, t.v_size)
                own, gained = vector(t.v, t.v_size), vector(t.a, t.v_size)
                for j in range(t.v_size):
                    v[t.unknown + j] = own[j]
                    a[t.unknown + j] = gained[j]
        elif b.unknown >= 0:
            store(v[b.unknown :], load(b.velocity))
            store(v[b.unknown + 3 :], load(b.spin))
            store(a[b.unknown :], load(b.acceleration))
            store(a[b.unknown + 3 :], spin_rate(b, load(b.spin)))
    velocity = part(w, VELOCITY)
    for i in range(w.unknowns):
        velocity[i] = v[i]
    for i in range(pairs):
        r = row_at(w.rows, i)
        r.near = whole_at(w.island_pairs, i)
        p = near_at(w.near, r.near)
        r.slot, r.fresh = p.slot if p.closed != 0 else -1, 0
        store(r.impulse, (0.0, 0.0, 0.0))
        if r.slot >= 0:
            save_contact(w, r.slot)


@jit_inside
def launch(w, stage, before):
    """Begin a stage, before which a time [s] has passed with the velocities of the last one."""
    velocity, begun, free = part(w, VELOCITY), part(w, BEGUN), part(w, FREE)
    moved, a = part(w, BEFORE), part(w, ACCELERATION)
    for i in range(w.unknowns):
        moved[i] = before * velocity[i]
        free[i] = begun[i] + before / stage * (velocity[i] - begun[i]) + stage * a[i]


@jit_inside
def go_on(w, bodies, pairs, stage):
    """Look first for what loads, and contacts as they press when the step begins, make of free bodies."""
    velocity, a = part(w, VELOCITY), part(w, ACCELERATION)
    for i in range(bodies):
        b = body_at(w.bodies, whole_at(w.island_bodies, i))
        if b.tree == 0 and b.unknown >= 0:
            for j in range(b.unknown, b.unknown + 6):
                velocity[j] += stage * a[j]
    for i in range(pairs):
        r = row_at(w.rows, i)
        if r.slot >= 0:
            c = contact_at(w.contacts, r.slot)
            moment = moment_of(c)
            for k, arm, sign in ((c.body_a, load(c.arm_a), stage), (c.body_b, load(c.arm_b), -stage)):
                b = body_at(w.bodies, k)
                if b.tree == 0 and b.unknown >= 0:
                    impulse, own = scale(sign, load(c.force)), velocity[b.unknown :]
                    store(own, axpy(b.inverse_mass, impulse, load(own)))
                    store(own[3:], add(load(own[3:]), spin_change(b, axpy(-sign, moment, cross(arm, impulse)))))


@jit_inside
def solve(w, bodies, pairs, stage, time):
    """Find the velocities at the end of a stage, and put the bodies there; returns whether they were found.

    time [s]: since the step began.
    """
    velocity, change = part(w, VELOCITY), part(w, RIGHT)
    last, factored = 0.0 if stage == time else NEVER, 0
    for look in range(LOOKS):
        for i in range(bodies):
            place(w, whole_at(w.island_bodies, i), stage, time)
        begin_equations(w, bodies, stage)
        moves, least = look == 0, NEVER
        for i in range(pairs):
            moved, slow = look_at(w, row_at(w.rows, i), stage)
            moves, least = moved or moves, min(least, slow)
        missing = imbalance(w)
        if not moves or missing <= least < NEVER:
            return True
        if not missing < CHORD * last:
            if factored == FACTORED:
                return False
            factored += 1
            begin_matrix(w, bodies)
            for i in range(pairs):
                enter(w, row_at(w.rows, i), stage)
            factorise(w)
            w.solved += 1
        last = missing
        substitute(w)
        total = 0.0
        for i in range(w.unknowns):
            velocity[i] += change[i]
            total += abs(velocity[i])
        if not isfinite(total):
            return False
    return False


@jit_inside
def imbalance(w):
    """By how much [m/s] a velocity could change at most where momenta are missing, whatever contacts do.

    Infinite where a force is no number: the greatest of numbers does not see that.
    """
    m, right = masses(w), part(w, RIGHT)
    most, total = 0.0, 0.0
    for i in range(w.unknowns):
        most, total = max(most, abs(right[i]) / m[i, i]), total + right[i]
    return most if isfinite(total) else NEVER


@jit_inside
def place(w, k, stage, time):
    """Put a body where its velocity takes it by the end of the stage."""
    b, start = body_at(w.bodies, k), saved_body(w, k)
    if b.tree != 0:
        if b.member == 0:
            place_tree(w, b, stage)
        store(b.shift, sub(load(b.position), load(start.position)))
        back = start.quaternion[0], -start.quaternion[1], -start.quaternion[2], -start.quaternion[3]
        store(b.twist, rotation_vector(product(load4(b.quaternion), back)))
        b.turned = start.turned + norm(load(b.twist))
        return
    if b.unknown >= 0:
        velocity, before = part(w, VELOCITY)[b.unknown :], part(w, BEFORE)[b.unknown :]
        store(b.velocity, load(velocity))
        store(b.spin, load(velocity[3:]))
        store(b.shift, axpy(stage, load(velocity), load(before)))
        store(b.twist, axpy(stage, load(velocity[3:]), load(before[3:])))
    else:
        store(b.shift, scale(time, load(b.velocity)))
        store(b.twist, scale(time, load(b.spin)))
    store(b.position, add(load(start.position), load(b.shift)))
    for i in range(4):
        b.quaternion[i] = start.quaternion[i]
    b.turned = start.turned
    store(b.pending_turn, load(b.twist))
    settle(b)


@jit_inside
def place_tree(w, b, stage):
    """The same of a tree, with its first body."""
    t = tree_at(b.tree, 0)
    velocity, before = part(w, VELOCITY), part(w, BEFORE)
    v, x = vector(t.v, t.v_size), vector(t.x, t.v_size)
    for i in range(t.v_size):
        v[i] = velocity[t.unknown + i]
        x[i] = before[t.unknown + i] + stage * v[i]
    call_with_body(t.move_from_start, b)


@jit_inside
def add_impulses(w, pairs, time):
    """Count the impulses of contacts by a stage that weighs so many seconds."""
    for i in range(pairs):
        r = row_at(w.rows, i)
        if r.slot >= 0:
            store(r.impulse, axpy(time, force_of(contact_at(w.contacts, r.slot)), load(r.impulse)))


@jit_inside
def end(w, r, found):
    """Leave a contact as it is at the end of the step, or as it was at its start."""
    if r.slot < 0:
        return
    p, c = near_at(w.near, r.near), contact_at(w.contacts, r.slot)
    t = c.touch
    if not found:
        restore_contact(w, r.slot)
        restore_law_state(w, r.slot)
    else:
        gained = t.overlap - t.before
        add_work(c, 1.0, gained, load(c.moved))
        store(c.impulse, add(load(c.impulse), load(r.impulse)))
        store(c.force, force_of(c))
        t.closing = gained / w.step
        c.interval, c.closing_acceleration, c.end_weight = w.step, 0.0, 0.0
        c.deepest = max(c.deepest, t.overlap)
        c.strongest = max(c.strongest, t.force)
        c.duration += w.step
    if t.overlap <= 0.0 or (r.fresh != 0 and not found):
        c.touches -= r.fresh
        end_contact(p, c)
