"""A step of all contacts of a model: who is near whom, where they touch, what they exchange, and what is remembered.

An engine's adapter fills the tables of bodies and places, calls `meet`, completes the pulls of bodies that hang
together with others, then calls `kernels.coupling.couple` and `finish`, and applies what comes out.
"""

from __future__ import annotations

from math import cos, sin, sqrt

from contactlaw.jit import jit
from contactlaw.kernels.contact import PHASE
from contactlaw.kernels.coupling import add_cross, copy, couples, on_a
from contactlaw.kernels.frame import turn_frame
from contactlaw.kernels.rows import (
    CLOSED,
    CUT,
    EARLY,
    FASTEST,
    FRAME,
    FROM,
    IMPULSE,
    LAW_AT,
    LAW_SIZE,
    LEDGER,
    MOTION,
    OVERLAP_NOW,
    PIECES,
    PUSH,
    ROW,
    SLID,
    STRAYED,
    TURN_A,
)
from contactlaw.kernels.subcycle import NEVER
from contactlaw.kernels.touch import (
    AXES,
    BALL,
    CAPSULE,
    CENTRE,
    FOUND_OVERLAP,
    KIND,
    NORMAL,
    SIZE,
    STAYS_A,
    STAYS_B,
    TURNS_A,
    TURNS_B,
)
from contactlaw.kernels.workspace import numbers, table, zero_table, zeros
from contactlaw.laws.hertz import hertz_stiffness, time_scale
from contactlaw.laws.record import OPEN, pair_of

# Shapes, shape (n, SHAPES): kind and sizes as in `kernels.touch`, the body they belong to, radius of a sphere around.
BODY_OF, BOUND, SHAPES = 4, 5, 6
# Bodies, shape (n, BODY): what they move with (a tree; -1: nothing); for a free one inverse mass [1/kg] and inertia
# [1/(kg m^2)], row-major, world frame, else zeros; centre of mass [m]; its velocity [m/s] and spin [rad/s] now, and
# their rates of change but for the contacts; velocity and spin that the engine moved it with in the last step.
TREE, INVERSE_MASS, INVERSE_INERTIA, COM, LINEAR, ANGULAR, RATE, ANGULAR_RATE, MEAN, MEAN_SPIN, BODY = (
    0, 1, 2, 11, 14, 17, 20, 23, 26, 29, 32,
)  # fmt: skip
# Pairs, shape (n, PAIR): two shapes, A the rounder; where their parameters stand and how many; substeps a contact; 1:
# keep a ledger; slots.
SHAPE_A, SHAPE_B, PARAMETERS_AT, PARAMETER_COUNT, SUBSTEPS, COUNTED, SLOTS, PAIR = range(8)
# A record, kept from step to step: pair and slot; the impulse on A that the next step owes, and the whole of the last
# one, world frame [N s]; where it acts, as in `kernels.touch`; the sliding foreseen [m] (NEVER: not told); how long of
# the last step it was closed at its end [s]; the history of the law.
KEY, OWED, GIVEN, POINTS, FORESEEN, LASTED, HISTORY = 0, 1, 4, 7, 19, 21, 22
MOST_SLOTS = 4  # pair and slot make the key: MOST_SLOTS pair + slot


@jit
def lever(shape, place, bodies, points, turns, stays, out):
    """Arm of a contact point from the body's centre of mass to out (3), as the body stands now [m]."""
    body = bodies[int(shape[BODY_OF])]
    for i in range(3):
        out[i] = place[CENTRE + i] - body[COM + i] + points[stays + i]
        for j in range(3):
            out[i] += place[AXES + 3 * i + j] * points[turns + j]


@jit
def describe(who, times, found, pairs, shapes, places, bodies, parameters, records, count, dt, watch, width, work_io):
    """Rows, histories, arms, pulls and answers of the contacts that `meet` found.

    records: count of them, sorted by key. watch: whether the engine moves bodies by their mean velocity, so that what
    they have strayed from the way foreseen can be told. width: coordinates of the largest tree. Pulls and answers are
    those of free bodies; the adapter fills the rest. Returns them.
    """
    n = who.shape[0]
    rows, histories = zero_table(work_io, n, ROW), zero_table(work_io, n, records.shape[1] - HISTORY)
    arms = numbers(work_io, 6 * n).reshape((n, 2, 3))
    pulls = zeros(work_io, 6 * n * width).reshape((n, 2, 3, width))
    answers = zeros(work_io, 6 * n * width).reshape((n, 2, 3, width))
    mean = numbers(work_io, 3)
    at = 0
    for i in range(n):
        row, pair = rows[i], pairs[who[i, 0]]
        row[FASTEST], row[FROM] = NEVER, NEVER
        key = MOST_SLOTS * who[i, 0] + who[i, 1]
        row[LAW_AT], row[LAW_SIZE] = pair[PARAMETERS_AT], pair[PARAMETER_COUNT]
        row[PIECES], row[LEDGER] = pair[SUBSTEPS], pair[COUNTED]
        p = parameters[int(row[LAW_AT]) : int(row[LAW_AT] + row[LAW_SIZE])]
        while at < count and records[at, KEY] < key:
            at += 1
        old = at < count and records[at, KEY] == key
        if old:
            copy(records[at, HISTORY:], histories[i])
        one, two = int(pair[SHAPE_A]), int(pair[SHAPE_B])
        a, b = bodies[int(shapes[one, BODY_OF])], bodies[int(shapes[two, BODY_OF])]
        if is_round(shapes[one]) and is_round(shapes[two]):
            turn_to_middle(found[i], times[i], p, shapes[one], places[one], a, shapes[two], places[two], b, dt, work_io)
        if found[i, FOUND_OVERLAP] > 0.0 and a[INVERSE_MASS] > 0.0 and b[INVERSE_MASS] > 0.0:
            share_point(found[i], a[INVERSE_MASS], b[INVERSE_MASS])
        lever(shapes[one], places[one], bodies, found[i], TURNS_A, STAYS_A, arms[i, 0])
        lever(shapes[two], places[two], bodies, found[i], TURNS_B, STAYS_B, arms[i, 1])
        normal = found[i, NORMAL : NORMAL + 3]
        twist = 0.0
        if old and histories[i, PHASE] != OPEN:
            for j in range(3):
                twist += 0.5 * records[at, LASTED] * normal[j] * (a[MEAN_SPIN + j] + b[MEAN_SPIN + j])
        turn_frame(histories[i], normal, twist, row)
        resolve(row, a, b, arms[i], LINEAR, ANGULAR, row[MOTION : MOTION + 3])
        resolve(row, a, b, arms[i], RATE, ANGULAR_RATE, row[PUSH : PUSH + 3])
        if watch and old and histories[i, PHASE] != OPEN and records[at, FORESEEN] < NEVER:
            resolve(row, a, b, arms[i], MEAN, MEAN_SPIN, mean)
            stray(dt * mean[1], dt * mean[2], records[at, FORESEEN], records[at, FORESEEN + 1], twist, row)
        for j in range(3):
            axis = row[FRAME + 3 * j : FRAME + 3 * j + 3]
            pull_free(axis, a, arms[i, 0], pulls[i, 0, j], answers[i, 0, j])
            pull_free(axis, b, arms[i, 1], pulls[i, 1, j], answers[i, 1, j])
        row[OVERLAP_NOW] = found[i, FOUND_OVERLAP]
        if times[i] > 0.0:
            row[OVERLAP_NOW] = -times[i] * (row[MOTION] + 0.5 * times[i] * row[PUSH])
    return rows, histories, arms, pulls, answers


@jit
def stray(u, v, foreseen_u, foreseen_v, twist, row_out):
    """How much further a contact slid than foreseen: known in the frame before its twist, needed in that after it."""
    c, s = cos(twist), sin(twist)
    du, dv = c * u - s * v - foreseen_u, s * u + c * v - foreseen_v
    row_out[STRAYED], row_out[STRAYED + 1] = c * du + s * dv, c * dv - s * du


@jit
def share_point(found_io, light_a, light_b):
    """Let two free bodies that overlap meet at one point between their surfaces, nearer to that of the lighter.

    The theory has the arms of undeformed bodies, as they are at a touch and against a fixed body. Of bodies that lie on
    each other these would leave over a couple, and none of them would come to rest.
    """
    part = found_io[FOUND_OVERLAP] / (light_a + light_b)
    for i in range(3):
        found_io[STAYS_A + i] += part * light_b * found_io[NORMAL + i]
        found_io[STAYS_B + i] -= part * light_a * found_io[NORMAL + i]


@jit
def is_round(shape):
    """A ball or a capsule."""
    return shape[KIND] == BALL or shape[KIND] == CAPSULE


@jit
def turn_to_middle(found_io, time, p, shape_a, place_a, a, shape_b, place_b, b, dt, work_io):
    """Turn the normal of two round bodies to where it will be in the middle of their contact, or of the step.

    They go on past each other while they touch: with the normal of the touch their forces would not be central, and
    what that leaves over of the angular momentum would go into their spins.
    """
    inverse = a[INVERSE_MASS] + b[INVERSE_MASS]
    if inverse == 0.0 or (a[TREE] >= 0.0 and a[INVERSE_MASS] == 0.0) or (b[TREE] >= 0.0 and b[INVERSE_MASS] == 0.0):
        return
    n = found_io[NORMAL : NORMAL + 3]
    radius_a, radius_b = shape_a[SIZE], shape_b[SIZE]
    arm, v, push, closing = numbers(work_io, 3), numbers(work_io, 3), 0.0, 0.0
    for i in range(3):
        arm[i] = place_a[CENTRE + i] + place_a[AXES + 3 * i + 2] * found_io[TURNS_A + 2] - a[COM + i]
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        v[i] = a[LINEAR + i] + a[ANGULAR + j] * arm[k] - a[ANGULAR + k] * arm[j]
    for i in range(3):
        arm[i] = place_b[CENTRE + i] + place_b[AXES + 3 * i + 2] * found_io[TURNS_B + 2] - b[COM + i]
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        v[i] -= b[LINEAR + i] + b[ANGULAR + j] * arm[k] - b[ANGULAR + k] * arm[j]
        push -= n[i] * (a[RATE + i] - b[RATE + i])
    for i in range(3):
        closing -= n[i] * v[i]
    overlap = max(found_io[FOUND_OVERLAP], 0.0)
    steady = 0.08 * inverse * hertz_stiffness(pair_of(p)) * overlap * overlap * sqrt(overlap)
    left = dt - max(time, 0.0)
    if time != 0.0 or closing * closing > steady:
        left = min(left, time_scale(pair_of(p), 1.0 / inverse, overlap, closing + max(time, 0.0) * push, push))
    size = 0.0
    for i in range(3):
        n[i] += 0.5 * left * (v[i] + closing * n[i]) / (radius_a + radius_b - overlap)
        size += n[i] * n[i]
    for i in range(3):
        n[i] /= sqrt(size)
        found_io[STAYS_A + i], found_io[STAYS_B + i] = -radius_a * n[i], radius_b * n[i]


@jit
def resolve(row, a, b, arms, linear, angular, out):
    """Motion of A's contact point less that of B's along the axes of a contact; linear, angular: which motion."""
    r, s = arms[0], arms[1]
    x = a[linear] + a[angular + 1] * r[2] - a[angular + 2] * r[1]
    y = a[linear + 1] + a[angular + 2] * r[0] - a[angular] * r[2]
    z = a[linear + 2] + a[angular] * r[1] - a[angular + 1] * r[0]
    x -= b[linear] + b[angular + 1] * s[2] - b[angular + 2] * s[1]
    y -= b[linear + 1] + b[angular + 2] * s[0] - b[angular] * s[2]
    z -= b[linear + 2] + b[angular] * s[1] - b[angular + 1] * s[0]
    for i in range(3):
        out[i] = row[FRAME + 3 * i] * x + row[FRAME + 3 * i + 1] * y + row[FRAME + 3 * i + 2] * z


@jit
def pull_free(axis, body, arm, pull_out, answer_out):
    """Generalized force on a free body of a unit force along an axis, and the velocities that a unit impulse gives."""
    light = body[INVERSE_MASS]
    if light == 0.0:
        return
    x, y, z = axis[0], axis[1], axis[2]
    pull_out[0], pull_out[1], pull_out[2] = x, y, z
    answer_out[0], answer_out[1], answer_out[2] = light * x, light * y, light * z
    u, v, w = arm[1] * z - arm[2] * y, arm[2] * x - arm[0] * z, arm[0] * y - arm[1] * x
    pull_out[3], pull_out[4], pull_out[5] = u, v, w
    for i in range(3):
        at = INVERSE_INERTIA + 3 * i
        answer_out[3 + i] = body[at] * u + body[at + 1] * v + body[at + 2] * w


@jit
def finish(
    who, found, rows, histories, trees, arms, pairs, shapes, bodies, dt, moves, records_out, now_out, couple_out,
    work_io,
):  # fmt: skip
    """What a step gives and leaves: returns how many records there are now.

    moves: whether the engine's position moves with the force inside its step (Runge-Kutta), as dt^2 F/(2 m).
    records_out: sorted by key. now_out: impulse on A to be given in this step, world frame [N s], shape (n, 3).
    couple_out: angular impulse on A and B [N m s], shape (n, 2, 3).
    """
    n = rows.shape[0]
    inverse_mass, apart, speed = table(work_io, n, 2), table(work_io, n, 3), table(work_io, n, 3)
    rest, whole, early = table(work_io, n, 3), numbers(work_io, 3), numbers(work_io, 3)
    count = 0
    for i in range(n):
        pair = pairs[who[i, 0]]
        a, b = bodies[int(shapes[int(pair[SHAPE_A]), BODY_OF])], bodies[int(shapes[int(pair[SHAPE_B]), BODY_OF])]
        inverse_mass[i, 0], inverse_mass[i, 1] = a[INVERSE_MASS], b[INVERSE_MASS]
        for j in range(3):
            apart[i, j] = a[COM + j] - b[COM + j]
            speed[i, j] = a[LINEAR + j] - b[LINEAR + j] + 0.5 * dt * (a[RATE + j] - b[RATE + j])
        on_a(rows[i], rows[i, IMPULSE : IMPULSE + 3], whole)
        on_a(rows[i], rows[i, EARLY : EARLY + 3], early)
        owes = False
        for j in range(3):
            now_out[i, j] = early[j] + (0.5 * whole[j] if moves else 0.0)
            owes = owes or whole[j] != 0.0
        if (owes or histories[i, PHASE] != OPEN) and count < records_out.shape[0]:
            record = records_out[count]
            record[KEY] = MOST_SLOTS * who[i, 0] + who[i, 1]
            for j in range(3):
                record[OWED + j], record[GIVEN + j] = whole[j] - now_out[i, j], whole[j]
            copy(found[i, TURNS_A : TURNS_A + 12], record[POINTS : POINTS + 12])
            record[FORESEEN], record[FORESEEN + 1], record[LASTED] = rows[i, SLID], rows[i, SLID + 1], rows[i, CLOSED]
            copy(histories[i], record[HISTORY:])
            count += 1
    couples(rows, trees, inverse_mass, arms, apart, speed, dt, rest, work_io)
    for i in range(n):
        total = inverse_mass[i, 0] + inverse_mass[i, 1]
        share = inverse_mass[i, 1] / total if total > 0.0 else 0.0
        pair = pairs[who[i, 0]]
        if is_round(shapes[int(pair[SHAPE_A])]) and not is_round(shapes[int(pair[SHAPE_B])]):
            share = 1.0  # a round body's arm stays its radius; it is the flat one's that grows as they go on
        for j in range(3):
            couple_out[i, 0, j], couple_out[i, 1, j] = (1.0 - share) * rest[i, j], share * rest[i, j]
        if rows[i, CUT] != 0.0:
            on_a(rows[i], rows[i, IMPULSE : IMPULSE + 3], whole)
            for side in range(2):
                for j in range(3):
                    couple_out[i, side, j] = rows[i, TURN_A + 3 * side + j]
                add_cross(arms[i, side], whole, 2.0 * side - 1.0, couple_out[i, side])
    return count
