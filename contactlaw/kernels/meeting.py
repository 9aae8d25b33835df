"""Who may meet whom within a step, and when and where they touch first."""

from __future__ import annotations

from math import sqrt

from contactlaw.jit import jit
from contactlaw.kernels.contact import MASS, OVERLAP
from contactlaw.kernels.contact import NORMAL as NORMAL_FORCE
from contactlaw.kernels.coupling import copy
from contactlaw.kernels.scene import (
    ANGULAR,
    ANGULAR_RATE,
    BODY_OF,
    BOUND,
    COM,
    HISTORY,
    INVERSE_MASS,
    KEY,
    LINEAR,
    MOST_SLOTS,
    PARAMETER_COUNT,
    PARAMETERS_AT,
    RATE,
    SHAPE_A,
    SHAPE_B,
    SLOTS,
    TREE,
)
from contactlaw.kernels.subcycle import next_touch
from contactlaw.kernels.touch import (
    ACCELERATION,
    AXES,
    BALL,
    ENDS,
    FOUND,
    FOUND_OVERLAP,
    KIND,
    NORMAL,
    OTHER,
    PLACE,
    PLANE,
    SPIN,
    STAYS_A,
    STAYS_B,
    VELOCITY,
    first_touch,
    locate,
    within_reach,
)
from contactlaw.kernels.workspace import numbers, table, wholes
from contactlaw.laws.hertz import hertz_stiffness
from contactlaw.laws.record import pair_of

SAFETY = 2.0  # on the way that a body may go in a step: forces may be at work that are not foreseen


@jit
def place_of(shape, place, bodies, out):
    """Centre, axes, velocity, spin and acceleration of a shape; place: the first two."""
    body = bodies[int(shape[BODY_OF])]
    copy(place, out)
    x, y, z = place[0] - body[COM], place[1] - body[COM + 1], place[2] - body[COM + 2]
    for start, linear, angular in ((VELOCITY, LINEAR, ANGULAR), (ACCELERATION, RATE, ANGULAR_RATE)):
        out[start] = body[linear] + body[angular + 1] * z - body[angular + 2] * y
        out[start + 1] = body[linear + 1] + body[angular + 2] * x - body[angular] * z
        out[start + 2] = body[linear + 2] + body[angular] * y - body[angular + 1] * x
    for i in range(3):
        out[SPIN + i] = body[ANGULAR + i]


@jit
def way(shape, place, bodies, dt):
    """Greatest way [m] of any point of a shape within a step."""
    body = bodies[int(shape[BODY_OF])]
    v, w, a, r = 0.0, 0.0, 0.0, 0.0
    for i in range(3):
        v += body[LINEAR + i] ** 2
        w += body[ANGULAR + i] ** 2
        a += body[RATE + i] ** 2
        r += (place[i] - body[COM + i]) ** 2
    if shape[KIND] != BALL and shape[KIND] != PLANE:
        r = (sqrt(r) + shape[BOUND]) ** 2
    return dt * (sqrt(v) + sqrt(w * r) + 0.5 * dt * sqrt(a))


@jit
def gap_of_bounds(a, place_a, b, place_b):
    """Distance [m] of two shapes, or less."""
    x, y, z = place_a[0] - place_b[0], place_a[1] - place_b[1], place_a[2] - place_b[2]
    if b[KIND] == PLANE:
        return x * place_b[AXES + 2] + y * place_b[AXES + 5] + z * place_b[AXES + 8] - a[BOUND]
    return sqrt(x * x + y * y + z * z) - a[BOUND] - b[BOUND]


@jit
def near_pairs(pairs, shapes, places, bodies, parameters, records, count, dt, work_io):
    """Pairs that may touch within the step, or have a record, in their order; and the way [m] of each shape.

    A contact that is compressed may throw its bodies off within the step: what it can give back counts as way.
    """
    ways, fastest = numbers(work_io, shapes.shape[0]), 0.0
    for i in range(shapes.shape[0]):
        ways[i] = way(shapes[i], places[i], bodies, dt)
    place_a, place_b, found = numbers(work_io, PLACE), numbers(work_io, PLACE), numbers(work_io, FOUND)
    at = 0
    for i in range(pairs.shape[0]):
        a, b = int(pairs[i, SHAPE_A]), int(pairs[i, SHAPE_B])
        speed, known = 0.0, False
        while at < count and records[at, KEY] < MOST_SLOTS * (i + 1):
            h = records[at, HISTORY:]
            if h[OVERLAP] > 0.0:
                speed += thrown_by(h[NORMAL_FORCE], h[OVERLAP], 1.0 / h[MASS])
            at += 1
            known = True
        if not known and gap_of_bounds(shapes[a], places[a], shapes[b], places[b]) < 0.0:  # put there by the user
            light = bodies[int(shapes[a, BODY_OF]), INVERSE_MASS] + bodies[int(shapes[b, BODY_OF]), INVERSE_MASS]
            if light > 0.0 and shapes[a, KIND] != OTHER and shapes[b, KIND] != OTHER:
                p = parameters[int(pairs[i, PARAMETERS_AT]) : int(pairs[i, PARAMETERS_AT] + pairs[i, PARAMETER_COUNT])]
                place_of(shapes[a], places[a], bodies, place_a)
                place_of(shapes[b], places[b], bodies, place_b)
                for slot in range(min(int(pairs[i, SLOTS]), ENDS)):
                    overlap = max(locate(shapes[a], place_a, shapes[b], place_b, slot, found), 0.0)
                    speed += thrown_by(hertz_stiffness(pair_of(p)) * overlap * sqrt(overlap), overlap, light)
        ways[a] += dt * speed
        ways[b] += dt * speed
    for i in range(shapes.shape[0]):
        fastest = max(fastest, ways[i])
    out, near, at = wholes(work_io, pairs.shape[0]), 0, 0
    for i in range(pairs.shape[0]):
        known = False
        while at < count and records[at, KEY] < MOST_SLOTS * (i + 1):
            known = True
            at += 1
        a, b = int(pairs[i, SHAPE_A]), int(pairs[i, SHAPE_B])
        reach = SAFETY * max(ways[a] + ways[b], 2.0 * fastest)
        if known or gap_of_bounds(shapes[a], places[a], shapes[b], places[b]) <= reach:
            out[near] = i
            near += 1
    return out[:near], ways


@jit
def thrown_by(force, overlap, light):
    """Speed [m/s] that a compressed contact can give back; light: inverse effective mass [1/kg].

    The force grows ever faster with the overlap: the elastic energy is at most half their product.
    """
    return sqrt(max(force * overlap * light, 0.0))


@jit
def meet(near, ways, pairs, shapes, places, bodies, measured, dt, work_io):
    """Contacts that take part in a step: pair, slot, time of the touch (-1.0: none), and how they meet (`FOUND`).

    near, ways: of `near_pairs`. measured: for pairs with a shape that the engine measures, pair and `FOUND` as it is
    now, shape (n, 1 + FOUND).
    """
    most = MOST_SLOTS * near.size
    who, times = wholes(work_io, 2 * most).reshape((most, 2)), numbers(work_io, most)
    trees, found = wholes(work_io, 2 * most).reshape((most, 2)), table(work_io, most, FOUND)
    speeds, gaps = numbers(work_io, most), numbers(work_io, most)
    active, keep = numbers(work_io, most), numbers(work_io, most)
    a, b = numbers(work_io, PLACE), numbers(work_io, PLACE)
    n = 0
    for pair in near:
        one, two = int(pairs[pair, SHAPE_A]), int(pairs[pair, SHAPE_B])
        place_of(shapes[one], places[one], bodies, a)
        place_of(shapes[two], places[two], bodies, b)
        for slot in range(int(pairs[pair, SLOTS])):
            if shapes[one, KIND] == OTHER or shapes[two, KIND] == OTHER:
                times[n] = measured_touch(pair, measured, a, b, dt, found[n])
            else:
                times[n] = first_touch(shapes[one], a, shapes[two], b, slot, dt, found[n], work_io)
            who[n, 0], who[n, 1] = pair, slot
            trees[n, 0], trees[n, 1] = (
                int(bodies[int(shapes[one, BODY_OF]), TREE]),
                int(bodies[int(shapes[two, BODY_OF]), TREE]),
            )
            speeds[n], gaps[n] = (ways[one] + ways[two]) / dt, -found[n, FOUND_OVERLAP]
            active[n] = 1.0 if times[n] >= 0.0 else 0.0
            n += 1
    within_reach(trees[:n], gaps[:n], speeds[:n], active[:n], dt, keep[:n], work_io)
    kept = 0
    for i in range(n):
        if keep[i] != 0.0:
            if kept < i:
                who[kept], times[kept], found[kept], trees[kept] = who[i], times[i], found[i], trees[i]
            kept += 1
    return who[:kept], times[:kept], found[:kept], trees[:kept]


@jit
def measured_touch(pair, measured, a, b, dt, out):
    """As `first_touch`, for shapes whose distance the engine measures; their surfaces then count as flat."""
    out[:] = 0.0
    out[FOUND_OVERLAP], out[NORMAL + 2] = -1e300, 1.0
    for i in range(measured.shape[0]):
        if measured[i, 0] == pair:
            out[:] = measured[i, 1:]
    if out[FOUND_OVERLAP] >= 0.0:
        return 0.0
    closing, push = 0.0, 0.0
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        speed = a[VELOCITY + i] + a[SPIN + j] * out[STAYS_A + k] - a[SPIN + k] * out[STAYS_A + j]
        speed -= b[VELOCITY + i] + b[SPIN + j] * out[STAYS_B + k] - b[SPIN + k] * out[STAYS_B + j]
        closing -= out[NORMAL + i] * speed
        push -= out[NORMAL + i] * (a[ACCELERATION + i] - b[ACCELERATION + i])
    time = next_touch(out[FOUND_OVERLAP], closing, push)
    if time > dt:
        return -1.0
    out[FOUND_OVERLAP] = 0.0
    return time
