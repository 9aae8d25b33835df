"""One step of all contacts, compiled: from what was read of the bodies to what pushes them.

Bullet steps v <- v + dt f/m, then x <- x + dt v. The velocity that it reports is therefore that of half a step before;
and an impulse within the step is placed exactly, in momentum and position, in two shares: one now, one that the next
step owes.
"""

from __future__ import annotations

from math import isfinite, sqrt

import numpy as np
from numba import types

from contactlaw.jit import INTERPRETED, compile_now, compiling, jit
from contactlaw.kernels.contact import PHASE
from contactlaw.kernels.coupling import add_cross, couple
from contactlaw.kernels.cutting import needs_cutting
from contactlaw.kernels.intervals import march
from contactlaw.kernels.meeting import gap_of_bounds, meet, near_pairs, place_of
from contactlaw.kernels.rest import SAME
from contactlaw.kernels.rows import (
    BEGUN,
    DEEPEST,
    DRAG,
    FASTEST,
    IMPULSE,
    OVERLAP_NOW,
    SPENT,
    STRONGEST,
    TOUCHING,
    WORK,
)
from contactlaw.kernels.scene import (
    BODY_OF,
    COM,
    COUNTED,
    INVERSE_MASS,
    KEY,
    MOST_SLOTS,
    POINTS,
    SHAPE_A,
    SHAPE_B,
    TREE,
    describe,
    finish,
)
from contactlaw.kernels.touch import BALL, CLEAR, FOUND, KIND, PLACE, PLANE, first_touch
from contactlaw.kernels.workspace import USED, bare, clear, numbers, table
from contactlaw.laws.record import OPEN
from contactlaw.pybullet_callback.stance import set_out, tumble
from contactlaw.pybullet_callback.tables import (
    APART,
    BAD,
    BY_SHAPE,
    CLAMPED,
    COUNT,
    DEEP,
    DT,
    FLAGS,
    GAVE_UP,
    GRAVITY,
    IN_FORCE,
    KEPT,
    NEW,
    POSITION,
    READ,
    READING,
    SLACK,
    STILL,
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
    workspace,
)
from contactlaw.pybullet_callback.tables import OWED as BODIES_OWED

# What a step comes to: nothing near, forces to apply, and bits: something to look at before, a ledger to keep, a
# contact that has ended; from PUSHES on, how many bodies are pushed; or a failure.
NOTHING, ACT, LOOK, LEDGERS, ENDED, PUSHES = 0, 1, 2, 4, 8, 16
NOT_FINITE, NO_ROOM, DIVERGED = -1, -2, -3

MOST_APART = 1000.0  # steps that are foreseen
COMPILE_TIME = 15  # [s]
CLAMP = 100.0  # Bullet's default limit of each velocity component [m/s], [rad/s]


@jit
def advance(lent):
    """A step of free and fixed bodies whose shapes the kernels know."""
    memory = bare(lent)
    tables = views(memory)
    if memory[STILL] != 0.0 and stands(memory, tables[0]):
        return int(memory[STILL])
    if not set_out(memory, tables):
        return NOT_FINITE
    near, ways = look_around(memory, tables)
    if near.size == 0:
        memory[APART] = steps_apart(memory, tables, ways)
        return NOTHING
    memory[APART] = 0.0
    return act(memory, tables, near, ways)


def prepare() -> None:
    """Compile what a step needs."""
    if not INTERPRETED:
        with compiling("the PyBullet callback", COMPILE_TIME):
            compile_now(advance, types.float64[::1])


@jit
def steps_apart(memory, tables, ways):
    """How many steps more no pair can touch, while nothing but gravity acts on free bodies."""
    bodies, shapes, places, pairs, _, _, _, _ = tables
    dt = memory[DT]
    soonest = MOST_APART * dt
    fall = sqrt(memory[GRAVITY] ** 2 + memory[GRAVITY + 1] ** 2 + memory[GRAVITY + 2] ** 2)
    work = workspace(memory)
    a, b, found, used = numbers(work, PLACE), numbers(work, PLACE), numbers(work, FOUND), work[USED]
    for i in range(pairs.shape[0]):
        one, two = int(pairs[i, SHAPE_A]), int(pairs[i, SHAPE_B])
        gap = max(gap_of_bounds(shapes[one], places[one], shapes[two], places[two]), 0.0)
        speed = (ways[one] + ways[two]) / dt
        time = 2.0 * gap / (speed + sqrt(speed * speed + 4.0 * fall * gap) + 1e-300)
        if time < soonest and shapes[one, KIND] == BALL and shapes[two, KIND] in (BALL, PLANE):
            place_of(shapes[one], places[one], bodies, a)
            place_of(shapes[two], places[two], bodies, b)
            work[USED] = used
            touch = first_touch(shapes[one], a, shapes[two], b, 0, soonest, found, work)
            time = soonest if touch < 0.0 else touch
        soonest = min(soonest, time)
    return max(soonest / dt - 2.0, 0.0)


@jit
def stands(memory, bodies):
    """Whether all is where it was and moves as it did when the last step found it at rest."""
    slack, kept = memory[SLACK], outputs(memory)[2]
    for i in range(4):
        if memory[KEPT + i] != memory[i]:
            memory[STILL] = 0.0
    for i in range(bodies.shape[0]):
        for j in range(READING):
            if not abs(bodies[i, POSITION + j] - kept[i, j]) <= (slack if j < 7 else slack / memory[DT]):
                memory[STILL] = 0.0
    return memory[STILL] != 0.0


@jit
def note_rest(memory, bodies, records, fresh, count, rows, result):
    """Let the pushes stand where nothing is remembered but what was before."""
    smallest, kept = 1e300, outputs(memory)[2]
    for i in range(count):
        for j in range(records.shape[1]):
            if records[i, j] != fresh[i, j]:
                return
    for i in range(rows.shape[0]):
        if rows[i, OVERLAP_NOW] > 0.0:
            smallest = min(smallest, rows[i, OVERLAP_NOW])
    memory[STILL], memory[SLACK] = result, 0.1 * SAME * smallest
    for i in range(4):
        memory[KEPT + i] = memory[i]
    for i in range(bodies.shape[0]):
        for j in range(READING):
            kept[i, j] = bodies[i, POSITION + j]


@jit
def act(memory, tables, near, ways):
    """What those do that are near."""
    bodies, shapes, places, pairs, parameters, records, _, count = tables
    dt, work = memory[DT], workspace(memory)
    who, times, found, trees = meet(near, ways, pairs, shapes, places, bodies, table(work, 0, 1 + FOUND), dt, work)
    if who.shape[0] == 0 and count == 0:
        memory[APART] = steps_apart(memory, tables, ways)
        return NOTHING
    rows, histories, arms, pulls, answers = describe(
        who,
        times,
        found,
        pairs,
        shapes,
        places,
        bodies,
        parameters,
        records,
        count,
        dt,
        True,
        int(memory[WIDTH]),
        work,
    )
    return exchange(memory, tables, who, times, found, trees, rows, histories, arms, pulls, answers)


@jit
def look_around(memory, tables):
    """Pairs that may touch, and the way that each shape may go, as `near_pairs`."""
    bodies, shapes, places, pairs, parameters, records, _, count = tables
    work = workspace(memory)
    clear(work)
    return near_pairs(pairs, shapes, places, bodies, parameters, records, count, memory[DT], work)


@jit
def hold_arms(who, arms, pairs, shapes, places, bodies, records_io, count):
    """Let what two free bodies are owed act at the arms of this step, as the couples of `finish` take it to do."""
    at = 0
    for i in range(who.shape[0]):
        if at >= count or records_io[at, KEY] != MOST_SLOTS * who[i, 0] + who[i, 1]:
            continue
        record, pair = records_io[at], pairs[who[i, 0]]
        at += 1
        one, two = int(pair[SHAPE_A]), int(pair[SHAPE_B])
        a, b = bodies[int(shapes[one, BODY_OF])], bodies[int(shapes[two, BODY_OF])]
        if a[INVERSE_MASS] == 0.0 or b[INVERSE_MASS] == 0.0:
            continue
        for j in range(3):
            record[POINTS + j], record[POINTS + 6 + j] = 0.0, 0.0
            record[POINTS + 3 + j] = arms[i, 0, j] - places[one, j] + a[COM + j]
            record[POINTS + 9 + j] = arms[i, 1, j] - places[two, j] + b[COM + j]


@jit
def exchange(memory, tables, who, times, found, trees, rows, histories, arms, pulls, answers):
    """Integrate the contacts; write records, tellings and pushes, in force at once if the result is ACT alone."""
    bodies, shapes, places, pairs, parameters, records, fresh, old = tables
    tellings, pushes, _ = outputs(memory)
    memory[STILL], still = 0.0, False
    n, dt, count = who.shape[0], memory[DT], 0
    if n > fresh.shape[0]:
        return NO_ROOM
    work = workspace(memory)
    now, twist = table(work, n, 3), numbers(work, 6 * n).reshape((n, 2, 3))
    if n > 0:
        still = couple(rows, histories, parameters, trees, pulls, answers, dt, work)
        cut = np.empty(n, dtype=np.bool_)
        if needs_cutting(who, times, found, rows, trees, pairs, shapes, bodies, dt, cut, work):
            who, times, found, trees, rows, histories, arms = march(
                cut, who, times, found, trees, rows, histories, arms, pairs, shapes, places, bodies,
                parameters, records, old, dt, dt < 0.0, int(memory[WIDTH]), fresh.shape[0],
                work,
            )  # fmt: skip
            n = who.shape[0]
            if n > fresh.shape[0]:
                return NO_ROOM
            now, twist = table(work, n, 3), numbers(work, 6 * n).reshape((n, 2, 3))
        count = finish(
            who, found, rows, histories, trees, arms, pairs, shapes, bodies, dt, False, fresh, now, twist,
            work,
        )  # fmt: skip
        hold_arms(who, arms, pairs, shapes, places, bodies, fresh, count)
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
        tumble(bodies[i], dt)
        out = pushes[pushed]
        out[0] = i
        for j in range(6):
            out[1 + j] = bodies[i, BODIES_OWED + j] / dt
        for j in range(3):
            out[7 + j] = bodies[i, COM + j]
        pushed += 1
    if result == ACT:  # nothing can fail any more
        if still and count == old:
            note_rest(memory, bodies, records, fresh, count, rows, ACT + PUSHES * pushed)
        memory[IN_FORCE] = 1.0 - memory[IN_FORCE]
    return result + PUSHES * pushed


@jit
def tell(who, flags, row, out):
    """What the callback's own checks and ledgers need to know of a contact."""
    out[TOLD_PAIR], out[TOLD_SLOT], out[FLAGS] = who[0], who[1], flags
    out[TOLD_BEGUN], out[TOLD_DEEPEST], out[TOLD_STRONGEST] = row[BEGUN], row[DEEPEST], row[STRONGEST]
    out[TOLD_TOUCHING], out[TOLD_FASTEST] = row[TOUCHING], row[FASTEST]
    out[TOLD_WORK], out[TOLD_DRAG] = row[WORK], row[DRAG]
