"""When a step must be cut into intervals: round bodies that go too far past each other for the frames of one touch."""

from __future__ import annotations

from math import sqrt

from contactlaw.jit import jit
from contactlaw.kernels.coupling import connect, find, on_a
from contactlaw.kernels.rows import DEEPEST, FROM, IMPULSE, UNTIL
from contactlaw.kernels.scene import ANGULAR, BODY_OF, INVERSE_MASS, LINEAR, RATE, SHAPE_A, SHAPE_B, TREE, is_round
from contactlaw.kernels.touch import CAPSULE, KIND, NORMAL, OTHER, SIZE
from contactlaw.kernels.workspace import numbers, zeros

# What one interval may hold, weighed by the share that a contact has in the impulses of its group: the angle that its
# normal turns by, and what its surfaces part by curving away from each other, over the overlap.
TURN, SAG = 0.05, 0.02


@jit
def needs_cutting(who, times, found, rows, trees, pairs, shapes, bodies, dt, cut_out, work_io):
    """Whether any group goes too far for one step; cut_out: which contacts are of such a group, shape (n,)."""
    n, any_cut = who.shape[0], False
    for i in range(n):
        cut_out[i] = excess(i, who, times, found, rows, pairs, shapes, bodies, dt, 1.0, work_io) > 1.0
        any_cut = any_cut or cut_out[i]
    if not any_cut:
        return False
    parents = connect(trees, work_io)
    strongest, unfit, chosen = zeros(work_io, n), zeros(work_io, n), zeros(work_io, n)
    for i in range(n):
        root = find(parents, i)
        strongest[root] = max(strongest[root], size_of(rows[i]))
        if not can_be_cut(pairs[who[i, 0]], shapes, bodies):
            unfit[root] = 1.0
    any_cut = False
    for i in range(n):
        root = find(parents, i)
        if cut_out[i] and unfit[root] == 0.0:
            weight = size_of(rows[i]) / strongest[root]
            if excess(i, who, times, found, rows, pairs, shapes, bodies, dt, weight, work_io) > 1.0:
                chosen[root], any_cut = 1.0, True
    for i in range(n):
        cut_out[i] = chosen[find(parents, i)] != 0.0
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
