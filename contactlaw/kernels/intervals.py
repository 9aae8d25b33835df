"""A step cut into intervals, where bodies go too far past each other for the frames of one touch.

Two round bodies turn their common normal as they go past each other. Within one impact that hardly matters; but a light
ball that bounces to and fro between a heavy one and the floor, all within one step, meets the heavy one from another
side each time. The bodies are then moved on by intervals, each with frames of its own, for which overlaps are linear in
the motion; what the engine is told in the end is the sum: momentum and position as if it had gone the whole way.

Only groups of free bodies are cut, and only those groups that need it.
"""

from __future__ import annotations

from math import cos, sin, sqrt

import numpy as np

from contactlaw.jit import jit
from contactlaw.kernels.contact import OPEN, PHASE
from contactlaw.kernels.coupling import add_cross, copy, count_trees, couple, find, on_a
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
    ANGULAR,
    ANGULAR_RATE,
    BODY_OF,
    COM,
    HISTORY,
    INVERSE_INERTIA,
    INVERSE_MASS,
    KEY,
    LINEAR,
    MEAN_SPIN,
    MOST_SLOTS,
    RATE,
    SHAPE_A,
    SHAPE_B,
    TREE,
    describe,
    finish,
    is_round,
    meet,
    near_pairs,
)
from contactlaw.kernels.subcycle import NEVER
from contactlaw.kernels.touch import CAPSULE, FOUND, KIND, NORMAL, OTHER, PLACE, SIZE, STAYS_A, STAYS_B
from contactlaw.kernels.workspace import USED, numbers

# What one interval may hold, weighed by the share that a contact has in the impulses of its group: the angle that its
# normal turns by, and what its surfaces part by curving away from each other, over the overlap.
TURN, SAG = 0.05, 0.02
MOST_INTERVALS = 1024.0


@jit
def needs_cutting(who, times, found, rows, trees, pairs, shapes, bodies, dt, cut_out, work_io):
    """Whether any group goes too far for one step; cut_out: which contacts are of such a group, shape (n,)."""
    n, any_cut = who.shape[0], False
    for i in range(n):
        cut_out[i] = excess(i, who, times, found, rows, pairs, shapes, bodies, dt, 1.0, work_io) > 1.0
        any_cut = any_cut or cut_out[i]
    if not any_cut:
        return False
    parents, owner = np.arange(n), np.full(count_trees(trees), -1)
    for i in range(n):
        for side in range(2):
            tree = trees[i, side]
            if tree >= 0 and owner[tree] < 0:
                owner[tree] = i
            elif tree >= 0:
                one, two = find(parents, owner[tree]), find(parents, i)
                parents[max(one, two)] = min(one, two)
    strongest, fit, chosen = np.zeros(n), np.ones(n, dtype=np.bool_), np.zeros(n, dtype=np.bool_)
    for i in range(n):
        root = find(parents, i)
        strongest[root] = max(strongest[root], size_of(rows[i]))
        fit[root] = fit[root] and can_be_cut(pairs[who[i, 0]], shapes, bodies)
    any_cut = False
    for i in range(n):
        root = find(parents, i)
        if cut_out[i] and fit[root]:
            weight = size_of(rows[i]) / strongest[root]
            chosen[root] = (
                chosen[root] or excess(i, who, times, found, rows, pairs, shapes, bodies, dt, weight, work_io) > 1.0
            )
            any_cut = any_cut or chosen[root]
    for i in range(n):
        cut_out[i] = chosen[find(parents, i)]
    return any_cut


@jit
def can_be_cut(pair, shapes, bodies):
    """Whether both bodies of a pair are free or fixed, and their shapes known here."""
    for side in range(2):
        shape = shapes[int(pair[SHAPE_A + side])]
        body = bodies[int(shape[BODY_OF])]
        if shape[KIND] == OTHER or (body[TREE] >= 0.0 and body[INVERSE_MASS] == 0.0):
            return False
    return True


@jit
def size_of(row):
    """Of the impulse of a contact [N s]."""
    return sqrt(row[IMPULSE] ** 2 + row[IMPULSE + 1] ** 2 + row[IMPULSE + 2] ** 2)


@jit
def excess(i, who, times, found, rows, pairs, shapes, bodies, dt, weight, work_io):
    """How much further two round bodies go past each other while they push than one frame may serve; at most 1: fine.

    weight: the contact's share in the impulses of its group.
    """
    pair, row = pairs[who[i, 0]], rows[i]
    one, two = shapes[int(pair[SHAPE_A])], shapes[int(pair[SHAPE_B])]
    if row[UNTIL] == 0.0 or not (is_round(one) and is_round(two)):
        return 0.0
    a, b, n = bodies[int(one[BODY_OF])], bodies[int(two[BODY_OF])], found[i, NORMAL : NORMAL + 3]
    light = a[INVERSE_MASS] + b[INVERSE_MASS]
    before, after, along, then, swing = 0.0, 0.0, 0.0, 0.0, 0.0
    v, w = numbers(work_io, 3), numbers(work_io, 3)
    on_a(row, row[IMPULSE : IMPULSE + 3], w)
    for j in range(3):
        v[j] = a[LINEAR + j] - b[LINEAR + j]
        w[j] = v[j] + light * w[j] + dt * (a[RATE + j] - b[RATE + j])
        along += n[j] * v[j]
        then += n[j] * w[j]
    for j in range(3):
        before += (v[j] - along * n[j]) ** 2
        after += (w[j] - then * n[j]) ** 2
    for shape, body in ((one, a), (two, b)):
        if shape[KIND] == CAPSULE:
            spin = body[ANGULAR] ** 2 + body[ANGULAR + 1] ** 2 + body[ANGULAR + 2] ** 2
            swing += shape[SIZE + 1] * sqrt(spin)
    met = max(times[i], 0.0)
    way = (sqrt(max(before, after)) + swing) * max(row[UNTIL] - met, met - row[FROM])
    distance = one[SIZE] + two[SIZE]
    sag = 0.5 * weight * way * way / distance
    return max(weight * way / (distance * TURN), sag / max(SAG * row[DEEPEST], 1e-300))


@jit
def march(
    cut, who, times, found, trees, rows, histories, arms, crooked, pairs, shapes, places, bodies, parameters, records,
    known, dt, moves, width, room, work_io,
):  # fmt: skip
    """Redo a step by intervals for the groups that `needs_cutting` names.

    Arguments as `meet` and `describe` take and return them; room: contacts at most. Returns who, times, found, trees,
    rows, histories, arms and crooked of all contacts, sorted: those that were cut anew, the others as they were.
    """
    trees_cut = np.zeros(count_trees(trees), dtype=np.bool_)
    for i in range(who.shape[0]):
        for side in range(2):
            if cut[i] and trees[i, side] >= 0:
                trees_cut[trees[i, side]] = True
    places, bodies = widen(places), bodies.copy()
    old, new = np.zeros((room, records.shape[1])), np.zeros((room, records.shape[1]))
    count = 0
    for i in range(known):
        if is_cut(pairs[int(records[i, KEY]) // MOST_SLOTS], shapes, bodies, trees_cut):
            copy(records[i], old[count])
            count += 1
    sums, keys, points, ends = np.zeros((room, ROW)), np.empty(room), np.empty((room, FOUND)), np.empty((room, 2, 3))
    whose, when, bad = np.empty((room, 2), dtype=np.int64), np.empty(room), np.zeros(room)
    total, early, measured = np.zeros((room, 3)), np.zeros((room, 3)), np.empty((0, 1 + FOUND))
    early_turns = np.zeros((room, 2, 3))
    now, interval, met, used = 0.0, 0.5 * dt, 0, work_io[USED]
    while now < dt:
        h, work_io[USED] = min(interval, dt - now), used
        near, ways = near_pairs(pairs, shapes, places, bodies, old, count, h, work_io)
        near = near[cut_pairs(near, pairs, shapes, bodies, trees_cut)]
        w, t, f, tr = meet(near, ways, pairs, shapes, places, bodies, measured, h, work_io)
        r, hs, ar, pulls, answers, cr = describe(
            w, t, f, pairs, shapes, places, bodies, parameters, old, count, h, False, width, work_io
        )
        couple(r, hs, parameters, tr, pulls, answers, h, work_io)
        if interval > dt / MOST_INTERVALS and too_far(w, t, f, r, pairs, shapes, bodies, h, work_io):
            interval *= 0.5
            continue
        m = w.shape[0]
        pushed, turned = np.empty((m, 3)), np.empty((m, 2, 3))
        count = finish(w, f, r, hs, tr, ar, pairs, shapes, bodies, h, False, new, pushed, turned, work_io)
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
            points[at], ends[at], bad[at] = f[i], ar[i], max(bad[at], cr[i])
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
    kept = np.flatnonzero(~cut)
    all_keys = np.concatenate((keys[:met], (MOST_SLOTS * who[kept, 0] + who[kept, 1]).astype(np.float64)))
    order = np.argsort(all_keys)
    fresh = np.empty((met, 2), dtype=np.int64)
    for i in range(met):
        fresh[i, 0], fresh[i, 1] = int(keys[i]) // MOST_SLOTS, int(keys[i]) % MOST_SLOTS
    return (
        np.concatenate((fresh, who[kept]))[order], np.concatenate((when[:met], times[kept]))[order],
        np.concatenate((points[:met], found[kept]))[order], np.concatenate((whose[:met], trees[kept]))[order],
        np.concatenate((sums[:met], rows[kept]))[order], np.concatenate((own, histories[kept]))[order],
        np.concatenate((ends[:met], arms[kept]))[order], np.concatenate((bad[:met], crooked[kept]))[order],
    )  # fmt: skip


@jit
def widen(places):
    """Places as (n, PLACE): what moves them is filled in from their bodies."""
    out = np.zeros((places.shape[0], PLACE))
    out[:, : places.shape[1]] = places
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
def cut_pairs(near, pairs, shapes, bodies, trees_cut):
    """Which of the near pairs belong to what is cut."""
    out = np.empty(near.size, dtype=np.bool_)
    for i in range(near.size):
        out[i] = is_cut(pairs[near[i]], shapes, bodies, trees_cut)
    return out


@jit
def too_far(who, times, found, rows, pairs, shapes, bodies, h, work_io):
    """Whether an interval is too long for any contact in it."""
    strongest = 0.0
    for i in range(who.shape[0]):
        strongest = max(strongest, size_of(rows[i]))
    for i in range(who.shape[0]):
        weight = size_of(rows[i]) / strongest if strongest > 0.0 else 1.0
        if excess(i, who, times, found, rows, pairs, shapes, bodies, h, weight, work_io) > 1.0:
            return True
    return False


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


@jit
def advance(who, rows, trees, arms, turned, pairs, shapes, h, bodies_io, places_io):
    """Move bodies and shapes on by an interval h [s], with what the contacts did in it."""
    n = bodies_io.shape[0]
    whole, early, spun, turning = np.zeros((n, 3)), np.zeros((n, 3)), np.zeros((n, 3)), np.zeros((n, 3))
    given, first = np.empty(3), np.empty(3)
    for i in range(who.shape[0]):
        on_a(rows[i], rows[i, IMPULSE : IMPULSE + 3], given)
        on_a(rows[i], rows[i, EARLY : EARLY + 3], first)
        for side in range(2):
            body, sign = int(shapes[int(pairs[who[i, 0], SHAPE_A + side]), BODY_OF]), 1.0 - 2.0 * side
            for j in range(3):
                whole[body, j] += sign * given[j]
                early[body, j] += sign * first[j]
                spun[body, j] += turned[i, side, j]
                turning[body, j] += 0.5 * turned[i, side, j]
            add_cross(arms[i, side], given, sign, spun[body])
            add_cross(arms[i, side], first, sign, turning[body])
    turns = np.zeros((n, 3))
    moved = np.zeros((n, 3))
    for k in range(n):
        b = bodies_io[k]
        if b[TREE] < 0.0 or b[INVERSE_MASS] == 0.0:
            continue
        for j in range(3):
            moved[k, j] = h * (b[LINEAR + j] + 0.5 * h * b[RATE + j] + b[INVERSE_MASS] * early[k, j])
            turns[k, j] = h * (b[ANGULAR + j] + 0.5 * h * b[ANGULAR_RATE + j])
            for m in range(3):
                ease = b[INVERSE_INERTIA + 3 * j + m]
                turns[k, j] += h * ease * turning[k, m]
        for j in range(3):
            b[COM + j] += moved[k, j]
            b[LINEAR + j] += h * b[RATE + j] + b[INVERSE_MASS] * whole[k, j]
            b[ANGULAR + j] += h * b[ANGULAR_RATE + j]
            for m in range(3):
                b[ANGULAR + j] += b[INVERSE_INERTIA + 3 * j + m] * spun[k, m]
            b[MEAN_SPIN + j] = turns[k, j] / h
    frame, arm = np.empty(9), np.empty(3)
    for i in range(shapes.shape[0]):
        k = int(shapes[i, BODY_OF])
        b = bodies_io[k]
        if b[TREE] < 0.0 or b[INVERSE_MASS] == 0.0:
            continue
        rotation(turns[k], frame)
        for j in range(3):
            arm[j] = places_io[i, j] - b[COM + j] + moved[k, j]
        for j in range(3):
            places_io[i, j] = b[COM + j]
            for m in range(3):
                places_io[i, j] += frame[3 * j + m] * arm[m]
        turn_axes(frame, places_io[i, 3:12])
    for k in range(n):
        b = bodies_io[k]
        e = b[INVERSE_INERTIA : INVERSE_INERTIA + 9]
        if b[INVERSE_MASS] != 0.0 and (e[0] != e[4] or e[4] != e[8] or e[1] != 0.0 or e[2] != 0.0 or e[5] != 0.0):
            rotation(turns[k], frame)
            turn_axes(frame, e)
            transpose(e)
            turn_axes(frame, e)


@jit
def rotation(turn, out):
    """Matrix (9, row-major) of a rotation vector [rad]."""
    x, y, z = turn[0], turn[1], turn[2]
    angle = sqrt(x * x + y * y + z * z)
    s = sin(angle) / angle if angle > 0.0 else 1.0
    c = (1.0 - cos(angle)) / (angle * angle) if angle > 1e-4 else 0.5
    d = cos(angle)
    out[0], out[1], out[2] = d + c * x * x, c * x * y - s * z, c * x * z + s * y
    out[3], out[4], out[5] = c * x * y + s * z, d + c * y * y, c * y * z - s * x
    out[6], out[7], out[8] = c * x * z - s * y, c * y * z + s * x, d + c * z * z


@jit
def turn_axes(frame, axes_io):
    """Turn a matrix (9) by a rotation from the left."""
    for j in range(3):
        x, y, z = axes_io[j], axes_io[3 + j], axes_io[6 + j]
        for i in range(3):
            axes_io[3 * i + j] = frame[3 * i] * x + frame[3 * i + 1] * y + frame[3 * i + 2] * z


@jit
def transpose(matrix_io):
    """Exchange rows and columns of a matrix (9)."""
    for i, j in ((1, 3), (2, 6), (5, 7)):
        matrix_io[i], matrix_io[j] = matrix_io[j], matrix_io[i]
