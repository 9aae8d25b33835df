"""One step of all contacts, compiled: from what was read of the bodies to what pushes them.

Bullet steps v <- v + dt f/m, then x <- x + dt v. The velocity that it reports is therefore that of half a step before;
and an impulse within the step is placed exactly, in momentum and position, in two shares: one now, one that the next
step owes.
"""

from __future__ import annotations

from math import isfinite

import numpy as np

from contactlaw.jit import jit
from contactlaw.kernels.contact import OPEN, PHASE
from contactlaw.kernels.coupling import add_cross, couple
from contactlaw.kernels.rows import BEGUN, DEEPEST, DRAG, FASTEST, IMPULSE, SPENT, STRONGEST, TOUCHING, WORK
from contactlaw.kernels.scene import (
    ANGULAR,
    ANGULAR_RATE,
    BODY_OF,
    COM,
    COUNTED,
    INVERSE_INERTIA,
    INVERSE_MASS,
    KEY,
    LINEAR,
    MEAN,
    MEAN_SPIN,
    MOST_SLOTS,
    OWED,
    POINTS,
    RATE,
    SHAPE_A,
    SHAPE_B,
    TREE,
    describe,
    finish,
    lever,
    meet,
    near_pairs,
)
from contactlaw.kernels.touch import CLEAR, FOUND
from contactlaw.pybullet_callback.tables import (
    BAD,
    BY_SHAPE,
    CLAMPED,
    COUNT,
    CROOKED,
    DEEP,
    DT,
    FLAGS,
    GAVE_UP,
    GRAVITY,
    IN_FORCE,
    NEW,
    POSE,
    POSITION,
    QUATERNION,
    READ,
    SPIN,
    STAYS_INERTIA,
    STAYS_MASS,
    STAYS_TREE,
    TOLD,
    TOLD_BEGUN,
    TOLD_DEEPEST,
    TOLD_DRAG,
    TOLD_FASTEST,
    TOLD_PAIR,
    TOLD_SLOT,
    TOLD_STRONGEST,
    TOLD_TOUCHING,
    TOLD_WORK,
    TOO_DEEP,
    UNCLEAR,
    VELOCITY,
    WIDTH,
    outputs,
    views,
)
from contactlaw.pybullet_callback.tables import OWED as BODIES_OWED

# What a step comes to: nothing near, forces to apply, and bits: something to look at before, a ledger to keep, a
# contact that has ended; from PUSHES on, how many bodies are pushed; or a failure.
NOTHING, ACT, LOOK, LEDGERS, ENDED, PUSHES = 0, 1, 2, 4, 8, 16
NOT_FINITE, NO_ROOM, DIVERGED = -1, -2, -3

CLAMP = 100.0  # Bullet's default limit of each velocity component [m/s], [rad/s]


@jit
def advance(memory):
    """A step of free and fixed bodies whose shapes the kernels know."""
    tables = views(memory)
    if set_out(memory, tables) != NOTHING:
        return NOT_FINITE
    near, ways = look_around(memory, tables)
    if near.size == 0:
        return NOTHING
    return act(memory, tables, near, ways)


@jit
def act(memory, tables, near, ways):
    """What those do that are near."""
    bodies, shapes, places, pairs, parameters, records, _, count = tables
    dt = memory[DT]
    who, times, found, trees = meet(near, ways, pairs, shapes, places, bodies, np.empty((0, 1 + FOUND)), dt)
    if who.shape[0] == 0 and count == 0:
        return NOTHING
    rows, histories, arms, pulls, answers, crooked = describe(
        who, times, found, pairs, shapes, places, bodies, parameters, records, count, dt, True, int(memory[WIDTH])
    )
    return exchange(memory, tables, who, times, found, trees, rows, histories, arms, pulls, answers, crooked)


@jit
def set_out(memory, tables):
    """Where bodies and shapes are, what is owed to them, and how they move before this step's contacts.

    Of bodies with links the readings as they are: the rest is the caller's.
    """
    bodies, shapes, places, pairs, _, records, _, count = tables
    turns, half, g = np.empty((bodies.shape[0], 9)), 0.5 * memory[DT], memory[GRAVITY : GRAVITY + 3]
    for i in range(bodies.shape[0]):
        b = bodies[i]
        total = g[0] + g[1] + g[2] + half
        for j in range(POSITION, READ):
            total += b[j]
        if not isfinite(total):
            memory[BAD] = i
            return NOT_FINITE
        turn(b[QUATERNION : QUATERNION + 4], turns[i])
        b[TREE], b[INVERSE_MASS] = b[STAYS_TREE], b[STAYS_MASS]
        spread_inertia(b[STAYS_INERTIA : STAYS_INERTIA + 3], turns[i], b[INVERSE_INERTIA : INVERSE_INERTIA + 9])
        for j in range(3):
            b[COM + j] = b[POSITION + j]
            b[MEAN + j], b[MEAN_SPIN + j] = b[VELOCITY + j], b[SPIN + j]
            b[RATE + j], b[ANGULAR_RATE + j] = g[j] if b[TREE] >= 0.0 else 0.0, 0.0
        nutate(b[STAYS_INERTIA : STAYS_INERTIA + 3], turns[i], b[SPIN : SPIN + 3], b[ANGULAR_RATE : ANGULAR_RATE + 3])
        b[BODIES_OWED : BODIES_OWED + 6] = 0.0
    for i in range(shapes.shape[0]):
        k = int(shapes[i, BODY_OF])
        t, pose, place = turns[k], shapes[i, POSE : POSE + 12], places[i]
        for j in range(3):
            place[j] = bodies[k, COM + j]
            for m in range(3):
                place[j] += t[3 * j + m] * pose[m]
                place[3 + 3 * j + m] = 0.0
                for n in range(3):
                    place[3 + 3 * j + m] += t[3 * j + n] * pose[3 + 3 * n + m]
    arm = np.empty(3)
    for i in range(count):
        pair = pairs[int(records[i, KEY]) // MOST_SLOTS]
        impulse, sign = records[i, OWED : OWED + 3], 1.0
        for side in range(2):
            k = int(pair[SHAPE_A if side == 0 else SHAPE_B])
            at = POINTS + 6 * side
            lever(shapes[k], places[k], bodies, records[i], at, at + 3, arm)
            to = bodies[int(shapes[k, BODY_OF]), BODIES_OWED : BODIES_OWED + 6]
            for j in range(3):
                to[j] += sign * impulse[j]
            add_cross(arm, impulse, sign, to[3:6])
            sign = -1.0
    for i in range(bodies.shape[0]):
        b = bodies[i]
        change = b[BODIES_OWED : BODIES_OWED + 6]
        for j in range(3):
            b[LINEAR + j] = b[MEAN + j] + half * b[RATE + j] + b[INVERSE_MASS] * change[j]
            b[ANGULAR + j] = b[MEAN_SPIN + j] + half * b[ANGULAR_RATE + j]
            for m in range(3):
                b[ANGULAR + j] += b[INVERSE_INERTIA + 3 * j + m] * change[3 + m]
    return NOTHING


@jit
def look_around(memory, tables):
    """Pairs that may touch, and the way that each shape may go, as `near_pairs`."""
    bodies, shapes, places, pairs, _, records, _, count = tables
    return near_pairs(pairs, shapes, places, bodies, records, count, memory[DT])


@jit
def turn(q, out):
    """Rotation matrix (9, row-major) of a quaternion."""
    x, y, z, w = q[0], q[1], q[2], q[3]
    s = 2.0 / (x * x + y * y + z * z + w * w)
    out[0], out[1], out[2] = 1.0 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)
    out[3], out[4], out[5] = s * (x * y + w * z), 1.0 - s * (x * x + z * z), s * (y * z - w * x)
    out[6], out[7], out[8] = s * (x * z - w * y), s * (y * z + w * x), 1.0 - s * (x * x + y * y)


@jit
def spread_inertia(inverse, frame, out):
    """Inverse inertia in the world (9, row-major) from that about the body's axes (3); isotropic without rounding."""
    x, y, z = inverse[0], inverse[1], inverse[2]
    if x == y and y == z:
        for i in range(9):
            out[i] = 0.0
        out[0], out[4], out[8] = x, x, x
        return
    for i in range(3):
        for j in range(3):
            out[3 * i + j] = (
                x * frame[3 * i] * frame[3 * j]
                + y * frame[3 * i + 1] * frame[3 * j + 1]
                + z * frame[3 * i + 2] * frame[3 * j + 2]
            )


@jit
def nutate(inverse, frame, spin, out):
    """Angular acceleration of a free body without torque, -I^-1 (w x I w) [rad/s^2]; inverse: as `spread_inertia`."""
    x, y, z = inverse[0], inverse[1], inverse[2]
    if (x == y and y == z) or x * y * z == 0.0:
        return
    u = frame[0] * spin[0] + frame[3] * spin[1] + frame[6] * spin[2]
    v = frame[1] * spin[0] + frame[4] * spin[1] + frame[7] * spin[2]
    w = frame[2] * spin[0] + frame[5] * spin[1] + frame[8] * spin[2]
    a, b, c = x * v * w * (1.0 / y - 1.0 / z), y * w * u * (1.0 / z - 1.0 / x), z * u * v * (1.0 / x - 1.0 / y)
    for i in range(3):
        out[i] = frame[3 * i] * a + frame[3 * i + 1] * b + frame[3 * i + 2] * c


@jit
def exchange(memory, tables, who, times, found, trees, rows, histories, arms, pulls, answers, crooked):
    """Integrate the contacts; write records, tellings and pushes, in force at once if the result is ACT alone."""
    bodies, shapes, _, pairs, parameters, records, fresh, old = tables
    tellings, pushes = outputs(memory)
    n, dt, count = who.shape[0], memory[DT], 0
    if n > fresh.shape[0]:
        return NO_ROOM
    now, twist = np.empty((n, 3)), np.empty((n, 2, 3))
    if n > 0:
        couple(rows, histories, parameters, trees, pulls, answers, dt)
        count = finish(
            who, found, rows, histories, trees, arms, pairs, shapes, bodies, dt, False, fresh, now, twist
        )  # fmt: skip
    memory[COUNT + 1 - int(memory[IN_FORCE])] = count
    result, at = ACT, 0
    for i in range(n):
        pair, key = pairs[who[i, 0]], MOST_SLOTS * who[i, 0] + who[i, 1]
        while at < old and records[at, KEY] < key:
            at += 1
        known = at < old and records[at, KEY] == key
        sign = 1.0
        touched = times[i] >= 0.0 or rows[i, DEEPEST] > 0.0
        flags = 0
        for side in range(2):
            k = int(shapes[int(pair[SHAPE_A if side == 0 else SHAPE_B]), BODY_OF])
            push = bodies[k, BODIES_OWED : BODIES_OWED + 6]
            for j in range(3):
                push[j] += sign * now[i, j]
                push[3 + j] += twist[i, side, j]
            add_cross(arms[i, side], now[i], sign, push[3:6])
            sign = -1.0
            for j in range(VELOCITY, READ):
                if touched and abs(bodies[k, j]) == CLAMP:
                    flags |= CLAMPED
        if touched:
            if crooked[i]:
                flags |= CROOKED
            if pair[BY_SHAPE] != 0.0 and found[i, CLEAR] == 0.0:
                flags |= UNCLEAR
            if not known:
                flags |= NEW
            if rows[i, DEEPEST] > pair[DEEP]:
                flags |= TOO_DEEP
            if rows[i, SPENT] != 0.0:
                flags |= GAVE_UP
        if flags != 0:
            result |= LOOK
        if pair[COUNTED] != 0.0:
            result |= LEDGERS
        if known and histories[i, PHASE] == OPEN and rows[i, DEEPEST] == 0.0:
            result |= ENDED
        tell(who[i], flags, rows[i], tellings[i])
        total = now[i, 0] + now[i, 1] + now[i, 2] + rows[i, IMPULSE] + rows[i, IMPULSE + 1] + rows[i, IMPULSE + 2]
        for j in range(histories.shape[1]):
            total += histories[i, j]
        if not isfinite(total):
            memory[BAD] = who[i, 0]
            return DIVERGED
    if old > 0 and count == 0:
        result |= ENDED
    memory[TOLD] = n
    pushed = 0
    for i in range(bodies.shape[0]):
        size = 0.0
        for j in range(6):
            size += abs(bodies[i, BODIES_OWED + j])
        if size == 0.0 or bodies[i, TREE] < 0.0:
            continue
        out = pushes[pushed]
        out[0] = i
        for j in range(6):
            out[1 + j] = bodies[i, BODIES_OWED + j] / dt
        for j in range(3):
            out[7 + j] = bodies[i, COM + j]
        pushed += 1
    if result == ACT:  # nothing can fail any more
        memory[IN_FORCE] = 1.0 - memory[IN_FORCE]
    return result + PUSHES * pushed


@jit
def tell(who, flags, row, out):
    """What the callback's own checks and ledgers need to know of a contact."""
    out[TOLD_PAIR], out[TOLD_SLOT], out[FLAGS] = who[0], who[1], flags
    out[TOLD_BEGUN], out[TOLD_DEEPEST], out[TOLD_STRONGEST] = row[BEGUN], row[DEEPEST], row[STRONGEST]
    out[TOLD_TOUCHING], out[TOLD_FASTEST] = row[TOUCHING], row[FASTEST]
    out[TOLD_WORK], out[TOLD_DRAG] = row[WORK], row[DRAG]
