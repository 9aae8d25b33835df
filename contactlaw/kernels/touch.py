"""Where and when two shapes will touch within a step: the frame and the lever arms of a contact are those of its touch.

Two balls that meet off centre at 3 m/s turn their common normal by degrees within one long step; the geometry of the
step's start would send them off in a wrong direction.
"""

from __future__ import annotations

from math import cos, sin, sqrt

from contactlaw.jit import jit
from contactlaw.kernels.geometry import ball_on_ball, ball_on_box, ball_on_plane, nearest_on_segments
from contactlaw.kernels.subcycle import next_touch
from contactlaw.kernels.workspace import numbers, zeros

# How a shape is described: kind, then sizes [m]: ball (radius), capsule (radius, half length along its third axis),
# plane (its normal is the third axis), box (half lengths). Place: centre [m], frame (9, row-major), velocity of the
# centre [m/s], spin [rad/s], acceleration of the centre [m/s^2].
KIND, SIZE, SHAPE = 0, 1, 4
BALL, CAPSULE, PLANE, BOX, OTHER = 0.0, 1.0, 2.0, 3.0, 4.0
CENTRE, AXES, VELOCITY, SPIN, ACCELERATION, PLACE = 0, 3, 12, 15, 18, 21
# What is found: overlap [m] at the touch (zero, or now where they touch already), 1 where the radius of curvature is
# clear, normal from B to A, the deepest point on A and on B: a part that turns with the shape, in its own axes, and a
# part that does not, both from its centre.
FOUND_OVERLAP, CLEAR, NORMAL, TURNS_A, STAYS_A, TURNS_B, STAYS_B, FOUND = 0, 1, 2, 5, 8, 11, 14, 17
ENDS, SIDE = 2, 2  # slots of a capsule on a plane or box: its two ends; on a box its side is a third

MOST_GUESSES = 30


@jit
def slots(kind_a, kind_b):
    """How many places a pair may touch at, A the rounder: a capsule lies on two."""
    if kind_a == CAPSULE and kind_b == PLANE:
        return ENDS
    return ENDS + 1 if kind_a == CAPSULE and kind_b == BOX else 1


@jit
def carry(place, time, out):
    """Where a shape is after some time."""
    for i in range(3):
        out[CENTRE + i] = place[CENTRE + i] + time * (place[VELOCITY + i] + 0.5 * time * place[ACCELERATION + i])
    for i in range(PLACE - AXES):
        out[AXES + i] = place[AXES + i]
    x, y, z = place[SPIN], place[SPIN + 1], place[SPIN + 2]
    rate = sqrt(x * x + y * y + z * z)
    if rate * time != 0.0:
        x, y, z = x / rate, y / rate, z / rate
        c, s = cos(rate * time), sin(rate * time)
        for j in range(3):  # each axis is a column of the frame
            u, v, w = place[AXES + j], place[AXES + 3 + j], place[AXES + 6 + j]
            along = (1.0 - c) * (x * u + y * v + z * w)
            out[AXES + j] = c * u + s * (y * w - z * v) + along * x
            out[AXES + 3 + j] = c * v + s * (z * u - x * w) + along * y
            out[AXES + 6 + j] = c * w + s * (x * v - y * u) + along * z


@jit
def locate(shape_a, a, shape_b, b, slot, out):
    """Overlap [m] of two shapes where they are, A a ball or capsule; out: as `FOUND` says."""
    kind = shape_b[KIND]
    if kind in (BALL, CAPSULE):
        return locate_round(shape_a, a, shape_b, b, out)
    if slot == SIDE:
        return locate_side(shape_a, a, shape_b, b, out)
    along = 0.0 if shape_a[KIND] == BALL else shape_a[SIZE + 1] * (1.0 - 2.0 * slot)
    return locate_point(shape_a, a, shape_b, b, along, out)


@jit
def locate_round(shape_a, a, shape_b, b, out):
    """Balls and capsules on each other, where their middle lines come nearest."""
    s, t, clear = 0.0, 0.0, True
    end_a, end_b = out[STAYS_A : STAYS_A + 3], out[STAYS_B : STAYS_B + 3]
    if shape_a[KIND] == CAPSULE or shape_b[KIND] == CAPSULE:
        for i in range(3):
            end_a[i], end_b[i] = a[AXES + 3 * i + 2], b[AXES + 3 * i + 2]
        half_a = shape_a[SIZE + 1] if shape_a[KIND] == CAPSULE else 0.0
        half_b = shape_b[SIZE + 1] if shape_b[KIND] == CAPSULE else 0.0
        s, t = nearest_on_segments(a[0:3], end_a, half_a, b[0:3], end_b, half_b)
        clear = abs(s) == half_a and abs(t) == half_b
    n = out[NORMAL : NORMAL + 3]
    for i in range(3):
        end_a[i] = a[i] + s * a[AXES + 3 * i + 2]
        end_b[i] = b[i] + t * b[AXES + 3 * i + 2]
    overlap = ball_on_ball(end_a, shape_a[SIZE], end_b, shape_b[SIZE], n)
    for i in range(3):
        out[TURNS_A + i], out[TURNS_B + i] = 0.0, 0.0
        out[STAYS_A + i], out[STAYS_B + i] = -shape_a[SIZE] * n[i], shape_b[SIZE] * n[i]
    out[TURNS_A + 2], out[TURNS_B + 2] = s, t
    out[CLEAR] = 1.0 if clear else 0.0
    out[FOUND_OVERLAP] = overlap
    return overlap


@jit
def locate_point(shape_a, a, shape_b, b, along, out):
    """Ball, or the ball around a point of a capsule's middle line (along it from its centre), on a plane or box."""
    n, point = out[NORMAL : NORMAL + 3], out[STAYS_A : STAYS_A + 3]
    radius = shape_a[SIZE]
    out[TURNS_A], out[TURNS_A + 1], out[TURNS_A + 2] = 0.0, 0.0, along
    for i in range(3):
        point[i] = a[i] + along * a[AXES + 3 * i + 2]
    clear = True
    if shape_b[KIND] == PLANE:
        overlap = ball_on_plane(point, radius, b[0:3], b[AXES : AXES + 9], n)
    else:
        overlap, clear = ball_on_box(point, radius, b[0:3], b[AXES : AXES + 9], shape_b[SIZE : SIZE + 3], n)
    for i in range(3):  # the point of B is under the ball's deepest, on B's own surface
        out[STAYS_B + i] = point[i] + (overlap - radius) * n[i] - b[i]
    for i in range(3):
        out[TURNS_B + i] = 0.0
        for j in range(3):
            out[TURNS_B + i] += b[AXES + 3 * j + i] * out[STAYS_B + j]
    for i in range(3):
        out[STAYS_A + i], out[STAYS_B + i] = -radius * n[i], 0.0
    out[CLEAR] = 1.0 if clear else 0.0
    out[FOUND_OVERLAP] = overlap
    return overlap


@jit
def locate_side(shape_a, a, shape_b, b, out):
    """Side of a capsule on a box, where neither end touches: the deepest point of the middle line, a convex search."""
    half, ends = shape_a[SIZE + 1], -1e300
    for end in range(2):
        ends = max(ends, locate_point(shape_a, a, shape_b, b, half * (1.0 - 2.0 * end), out))
    if ends > 0.0:
        out[FOUND_OVERLAP] = -half
        return -half
    low, high = -half, half
    for _ in range(80):
        one, two = low + (high - low) / 3.0, high - (high - low) / 3.0
        if locate_point(shape_a, a, shape_b, b, one, out) > locate_point(shape_a, a, shape_b, b, two, out):
            high = two
        else:
            low = one
    overlap = locate_point(shape_a, a, shape_b, b, 0.5 * (low + high), out)
    if overlap <= ends + 1e-9 * shape_a[SIZE]:  # no deeper than an end: the end's own slot tells of it
        overlap = -half
        out[FOUND_OVERLAP] = overlap
    out[CLEAR] = 0.0
    return overlap


@jit
def speed_at(place, found, turns, stays, along, time, r, out):
    """Velocity of a shape's contact point to out (3); the parts of the point from the centre start at turns, stays.

    r: scratch (3).
    """
    for i in range(3):
        r[i] = found[stays + i]
        for j in range(3):
            r[i] += along[AXES + 3 * i + j] * found[turns + j]
    x, y, z = place[SPIN], place[SPIN + 1], place[SPIN + 2]
    out[0] = place[VELOCITY] + time * place[ACCELERATION] + y * r[2] - z * r[1]
    out[1] = place[VELOCITY + 1] + time * place[ACCELERATION + 1] + z * r[0] - x * r[2]
    out[2] = place[VELOCITY + 2] + time * place[ACCELERATION + 2] + x * r[1] - y * r[0]


@jit
def first_touch(shape_a, a, shape_b, b, slot, dt, out, work_io):
    """Time [s] of the touch of two shapes within dt; 0.0 where they touch now, -1.0 where they will not.

    out: as `FOUND` says, at the touch, or now where there is none. The gap of two shapes on their way is nearly convex
    in time, so Newton's method comes to the touch from before.
    """
    gap = -locate(shape_a, a, shape_b, b, slot, out)
    if gap <= 0.0:
        return 0.0
    then_a, then_b = numbers(work_io, PLACE), numbers(work_io, PLACE)
    speed_a, speed_b, r = numbers(work_io, 3), numbers(work_io, 3), numbers(work_io, 3)
    for i in range(PLACE):
        then_a[i], then_b[i] = a[i], b[i]
    time = 0.0
    for _ in range(MOST_GUESSES):
        speed_at(a, out, TURNS_A, STAYS_A, then_a, time, r, speed_a)
        speed_at(b, out, TURNS_B, STAYS_B, then_b, time, r, speed_b)
        closing, push = 0.0, 0.0
        for i in range(3):
            closing -= out[NORMAL + i] * (speed_a[i] - speed_b[i])
            push -= out[NORMAL + i] * (a[ACCELERATION + i] - b[ACCELERATION + i])
        wait = next_touch(-gap, closing, push) if gap > 0.0 else gap / max(abs(closing), 1e-300)
        time = max(time + wait, 0.0)
        if time > dt:
            break
        carry(a, time, then_a)
        carry(b, time, then_b)
        gap = -locate(shape_a, then_a, shape_b, then_b, slot, out)
        if abs(wait) <= 1e-9 * dt:
            break
    if time <= dt:  # what is left after many guesses is rounding
        out[FOUND_OVERLAP] = 0.0
        return time
    locate(shape_a, a, shape_b, b, slot, out)
    return -1.0


REACH = 2.0  # a body may be hit and fly off at twice the speed of what hit it


@jit
def within_reach(trees, gaps, speeds, active, dt, keep_out, work_io):
    """Which near pairs can take part in a step: those that touch or will, and what they may be knocked into.

    trees: what moves on each side, -1 for nothing, shape (n, 2). gaps [m], speeds: sum of both bodies' [m/s]. active:
    touching or about to, 1, or not, 0; keep_out likewise.
    """
    n = gaps.size
    most = 0
    for i in range(n):
        most = max(most, trees[i, 0], trees[i, 1])
    fastest = zeros(work_io, most + 1)
    for i in range(n):
        keep_out[i] = active[i]
    changed = True
    while changed:
        changed = False
        for i in range(n):
            one, two = trees[i, 0], trees[i, 1]
            known = max(fastest[one] if one >= 0 else 0.0, fastest[two] if two >= 0 else 0.0)
            if keep_out[i] == 0.0:
                if known == 0.0 or gaps[i] > REACH * max(known, speeds[i]) * dt:
                    continue
                keep_out[i] = 1.0
                changed = True
            known = max(known, speeds[i], 1e-300)
            for tree in (one, two):
                if tree >= 0 and fastest[tree] < known:
                    fastest[tree] = known
                    changed = True
