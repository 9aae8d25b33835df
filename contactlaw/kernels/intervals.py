"""A step cut into intervals, where bodies go too far past each other for the frames of one touch.

Two round bodies turn their common normal as they go past each other. Within one impact that hardly matters; but a light
ball that bounces to and fro between a heavy one and the floor, all within one step, meets the heavy one from another
side each time. The bodies are then moved on by intervals, each with frames of its own, for which overlaps are linear in
the motion; what the engine is told in the end is the sum: momentum and position as if it had gone the whole way.

Only groups of free bodies are cut, and only those groups that need it.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from contactlaw.jit import jit
from contactlaw.kernels.contact import PHASE
from contactlaw.kernels.coupling import add_cross, copy, count_trees, couple, on_a
from contactlaw.kernels.cutting import too_far
from contactlaw.kernels.meeting import meet, near_pairs
from contactlaw.kernels.rows import (
    BEGUN,
    CLOSED,
    CUT,
    DEEPEST,
    DRAG,
    EARLY,
    FASTEST,
    FRAME,
    FROM,
    IMPULSE,
    ROW,
    SLID,
    SPENT,
    STRONGEST,
    TOUCHING,
    TURN_A,
    UNTIL,
    WORK,
)
from contactlaw.kernels.scene import (
    BODY_OF,
    HISTORY,
    KEY,
    MOST_SLOTS,
    SHAPE_A,
    TREE,
    describe,
    finish,
)
from contactlaw.kernels.subcycle import NEVER
from contactlaw.kernels.touch import FOUND, PLACE, STAYS_A, STAYS_B
from contactlaw.kernels.transport import advance
from contactlaw.kernels.workspace import USED
from contactlaw.laws.record import OPEN

MOST_INTERVALS = 1024.0


@jit
def march(
    cut, who, times, found, trees, rows, histories, arms, pairs, shapes, places, bodies, parameters, records,
    known, dt, moves, width, room, work_io,
):  # fmt: skip
    """Redo a step by intervals for the groups that `needs_cutting` names.

    Arguments as `meet` and `describe` take and return them; room: contacts at most. Returns who, times, found, trees,
    rows, histories and arms of all contacts, sorted: those that were cut anew, the others as they were.
    """
    trees_cut = np.zeros(count_trees(trees), dtype=np.bool_)
    for i in range(who.shape[0]):
        for side in range(2):
            if cut[i] and trees[i, side] >= 0:
                trees_cut[trees[i, side]] = True
    places, bodies = widen(places), bodies.copy()
    old, new = np.zeros((room, records.shape[1])), np.zeros((room, records.shape[1]))
    count, no = known - known, known < 0  # no literals: numba compiles a function anew for each that it is given
    for i in range(known):
        if is_cut(pairs[int(records[i, KEY]) // MOST_SLOTS], shapes, bodies, trees_cut):
            copy(records[i], old[count])
            count += 1
    sums, keys, points, ends = np.zeros((room, ROW)), np.empty(room), np.empty((room, FOUND)), np.empty((room, 2, 3))
    whose, when = np.empty((room, 2), dtype=np.int64), np.empty(room)
    total, early, measured = np.zeros((room, 3)), np.zeros((room, 3)), np.empty((0, 1 + FOUND))
    early_turns = np.zeros((room, 2, 3))
    now, interval, met, used = 0.0, 0.5 * dt, 0, work_io[USED]
    while now < dt:
        h, work_io[USED] = min(interval, dt - now), used
        near, ways = near_pairs(pairs, shapes, places, bodies, parameters, old, count, h, work_io)
        near = near[: keep_cut(near, pairs, shapes, bodies, trees_cut)]
        w, t, f, tr = meet(near, ways, pairs, shapes, places, bodies, measured, h, work_io)
        r, hs, ar, pulls, answers = describe(
            w, t, f, pairs, shapes, places, bodies, parameters, old, count, h, no, width, work_io
        )
        couple(r, hs, parameters, tr, pulls, answers, h, work_io)
        if interval > dt / MOST_INTERVALS and too_far(w, t, f, r, pairs, shapes, bodies, h, work_io):
            interval *= 0.5
            continue
        m = w.shape[0]
        pushed, turned = np.empty((m, 3)), np.empty((m, 2, 3))
        count = finish(w, f, r, hs, tr, ar, pairs, shapes, bodies, h, no, new, pushed, turned, work_io)
        old, new = new, old
        for i in range(m):
            if r[i, UNTIL] == 0.0 and hs[i, PHASE] == OPEN and r[i, DEEPEST] == 0.0:
                continue
            at, key = 0, float(MOST_SLOTS * w[i, 0] + w[i, 1])
            while at < met and keys[at] != key:
                at += 1
            if at == room:
                continue  # reported as full where the records are written
            if at == met:
                met += 1
                keys[at], when[at], sums[at, FASTEST], sums[at, FROM] = key, now + max(t[i], 0.0), NEVER, NEVER
                whose[at] = tr[i]
            points[at], ends[at] = f[i], ar[i]
            add_up(r[i], ar[i], turned[i], now, h, dt, sums[at], total[at], early[at], early_turns[at])
        advance(w, r, tr, ar, turned, pairs, shapes, h, bodies, places)
        now = dt if h >= dt - now else now + h
        interval = 2.0 * h
    # A contact that is over is remembered for what it owes; its frame is the last it had.
    own = np.zeros((met, histories.shape[1]))
    for i in range(met):
        for k in range(count):
            if old[k, KEY] == keys[i]:
                copy(old[k, HISTORY:], own[i])
        express(total[i], sums[i, IMPULSE : IMPULSE + 3], sums[i])
        express(early[i], sums[i, EARLY : EARLY + 3], sums[i])
        sums[i, CUT], sums[i, SLID] = 1.0, NEVER
        if own[i, PHASE] == OPEN:
            sums[i, CLOSED] = 0.0
        place_owed(sums[i], total[i], early[i], early_turns[i], 0.5 if moves else 0.0, ends[i], points[i])
    n = met
    for i in range(who.shape[0]):
        if not cut[i]:
            n += 1
    order = np.empty(n, dtype=np.int64)
    merge(keys[:met], who, cut, order)
    who_out, times_out, found_out = np.empty((n, 2), dtype=np.int64), np.empty(n), np.empty((n, FOUND))
    trees_out, rows_out = np.empty((n, 2), dtype=np.int64), np.empty((n, ROW))
    histories_out, arms_out = np.empty((n, histories.shape[1])), np.empty((n, 2, 3))
    for k in range(n):
        i = order[k]
        if i < met:
            who_out[k, 0], who_out[k, 1] = int(keys[i]) // MOST_SLOTS, int(keys[i]) % MOST_SLOTS
            times_out[k] = when[i]
            take(
                points[i],
                whose[i],
                sums[i],
                own[i],
                ends[i],
                k,
                found_out,
                trees_out,
                rows_out,
                histories_out,
                arms_out,
            )
        else:
            i -= met
            who_out[k, 0], who_out[k, 1], times_out[k] = who[i, 0], who[i, 1], times[i]
            take(found[i], trees[i], rows[i], histories[i], arms[i], k, found_out, trees_out, rows_out, histories_out,
                 arms_out)  # fmt: skip
    return who_out, times_out, found_out, trees_out, rows_out, histories_out, arms_out


@jit
def merge(keys, who, cut, order_out):
    """Order by key: which of the contacts cut (0 to m - 1) or left as they were (m + i) comes where; both few."""
    m = keys.size
    for k in range(order_out.size):
        order_out[k] = -1
    for i in range(m + cut.size):
        if i >= m and cut[i - m]:
            continue
        key, place = key_of(i, keys, who), 0
        for j in range(m + cut.size):
            if (j < m or not cut[j - m]) and key_of(j, keys, who) < key:
                place += 1
        order_out[place] = i


@jit
def key_of(i, keys, who):
    """Of a contact by its number in `merge`."""
    return keys[i] if i < keys.size else float(MOST_SLOTS * who[i - keys.size, 0] + who[i - keys.size, 1])


@jit
def take(found, tree, row, history, arms, k, found_out, trees_out, rows_out, histories_out, arms_out):
    """Let a contact be the one with number k."""
    copy(found, found_out[k])
    copy(row, rows_out[k])
    copy(history, histories_out[k])
    for side in range(2):
        trees_out[k, side] = tree[side]
        copy(arms[side], arms_out[k, side])


@jit
def widen(places):
    """Places as (n, PLACE): what moves them is filled in from their bodies."""
    out = np.zeros((places.shape[0], PLACE))
    for i in range(places.shape[0]):
        for j in range(places.shape[1]):
            out[i, j] = places[i, j]
    return out


@jit
def is_cut(pair, shapes, bodies, trees_cut):
    """Whether a pair belongs to what is cut: all of it that moves."""
    moving = False
    for side in range(2):
        tree = int(bodies[int(shapes[int(pair[SHAPE_A + side]), BODY_OF]), TREE])
        if tree >= 0:
            if tree >= trees_cut.size or not trees_cut[tree]:
                return False
            moving = True
    return moving


@jit
def keep_cut(near_io, pairs, shapes, bodies, trees_cut):
    """Move those of the near pairs that belong to what is cut to the front; returns how many they are."""
    count = 0
    for i in range(near_io.size):
        if is_cut(pairs[near_io[i]], shapes, bodies, trees_cut):
            near_io[count] = near_io[i]
            count += 1
    return count


@jit
def add_up(row, arms, turned, now, h, dt, sum_io, total_io, early_io, early_turns_io):
    """Add an interval from now [s] on, of length h, to what a contact does in the step of dt.

    total, early: world frame on A (3), as `IMPULSE` and `EARLY` mean them; early_turns: angular ones (2, 3) on A and B.
    sum: a row, its angular impulses too.
    """
    whole, first = np.empty(3), np.empty(3)
    turn, turn_first = np.empty(3), np.empty(3)
    on_a(row, row[IMPULSE : IMPULSE + 3], whole)
    on_a(row, row[EARLY : EARLY + 3], first)
    left, part = 1.0 - now / dt, h / dt
    for j in range(3):
        total_io[j] += whole[j]
        early_io[j] += left * whole[j] - part * (whole[j] - first[j])
    for side in range(2):
        for j in range(3):
            turn[j], turn_first[j] = turned[side, j], 0.5 * turned[side, j]
        add_cross(arms[side], whole, 1.0 - 2.0 * side, turn)
        add_cross(arms[side], first, 1.0 - 2.0 * side, turn_first)
        for j in range(3):
            sum_io[TURN_A + 3 * side + j] += turn[j]
            early_turns_io[side, j] += left * turn[j] - part * (turn[j] - turn_first[j])
    for j in (BEGUN, TOUCHING, WORK, DRAG):
        sum_io[j] += row[j]
    for j in (DEEPEST, SPENT, STRONGEST):
        sum_io[j] = max(sum_io[j], row[j])
    sum_io[FASTEST], sum_io[CLOSED] = min(sum_io[FASTEST], row[FASTEST]), row[CLOSED]
    sum_io[FROM], sum_io[UNTIL] = min(sum_io[FROM], now + row[FROM]), now + row[UNTIL]
    for j in range(FRAME, IMPULSE):  # the frame, where its law is, its substeps
        sum_io[j] = row[j]


@jit
def place_owed(row, total, early, early_turns, ahead, arms_io, found_io):
    """Let what the next step owes act at arms that give the angular impulse owed as well.

    Impulses on a small body squeezed from two sides are far greater than what becomes of it: with the arms of the last
    interval alone it would spin wildly from one step to the next. ahead: share of the whole given now besides.
    """
    owed, rest, shift = np.empty(3), np.empty(3), np.empty(3)
    square = 0.0
    for j in range(3):
        owed[j] = (1.0 - ahead) * total[j] - early[j]
        square += owed[j] * owed[j]
    if square == 0.0:
        return
    for side in range(2):
        sign, arm, moved = 1.0 - 2.0 * side, 0.0, 0.0
        for j in range(3):
            rest[j] = (1.0 - ahead) * row[TURN_A + 3 * side + j] - early_turns[side, j]
            shift[j] = 0.0
        add_cross(arms_io[side], owed, -sign, rest)
        add_cross(owed, rest, sign / square, shift)
        for j in range(3):
            arm += arms_io[side, j] ** 2
            moved += shift[j] ** 2
        share = min(1.0, sqrt(arm / moved)) if moved > 0.0 else 0.0
        at = STAYS_A if side == 0 else STAYS_B
        for j in range(3):
            arms_io[side, j] += share * shift[j]
            found_io[at + j] += share * shift[j]


@jit
def express(vector, out, row):
    """A world vector on A along a contact's axes, as `on_a` reads it."""
    for i in range(3):
        out[i] = 0.0
        for j in range(3):
            out[i] -= row[FRAME + 3 * i + j] * vector[j]
