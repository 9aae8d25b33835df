"""Bodies at the start of a step, compiled: where they stand, what they are owed, and how they truly move."""

from __future__ import annotations

from math import isfinite

import numpy as np

from contactlaw.jit import jit
from contactlaw.kernels.coupling import add_cross
from contactlaw.kernels.scene import (
    ANGULAR,
    ANGULAR_RATE,
    BODY_OF,
    COM,
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
    lever,
)
from contactlaw.kernels.workspace import clear, numbers, table
from contactlaw.pybullet_callback.tables import (
    BAD,
    DT,
    GRAVITY,
    POSE,
    POSITION,
    QUATERNION,
    READ,
    SPIN,
    STAYS_INERTIA,
    STAYS_MASS,
    STAYS_TREE,
    VELOCITY,
    workspace,
)
from contactlaw.pybullet_callback.tables import OWED as BODIES_OWED


@jit
def set_out(memory, tables):
    """Where bodies and shapes are, what is owed to them, and how they move before this step's contacts.

    Of bodies with links the readings as they are: the rest is the caller's. Returns whether all is finite.
    """
    bodies, shapes, places, pairs, _, records, _, count = tables
    work = workspace(memory)
    clear(work)
    turns, half, g = table(work, bodies.shape[0], 9), 0.5 * memory[DT], memory[GRAVITY : GRAVITY + 3]
    for i in range(bodies.shape[0]):
        b = bodies[i]
        total = g[0] + g[1] + g[2] + half
        for j in range(POSITION, READ):
            total += b[j]
        if not isfinite(total):
            memory[BAD] = i
            return False
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
    arm = numbers(work, 3)
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
    return True


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
def tumble(body_io, dt):
    """Add to what pushes a free body in this step the gyroscopic torque that the push itself brings about.

    The engine knows only that of the spin before; but over half of the step, in the mean, the body tumbles with the
    spin after it.
    """
    inverse = body_io[STAYS_INERTIA : STAYS_INERTIA + 3]
    if inverse[0] == inverse[1] and inverse[1] == inverse[2]:
        return
    push, frame, spin, rate = body_io[BODIES_OWED : BODIES_OWED + 6], np.empty(9), np.empty(3), np.zeros(3)
    turn(body_io[QUATERNION : QUATERNION + 4], frame)
    for i in range(3):
        spin[i] = body_io[SPIN + i]
        for j in range(3):
            spin[i] += body_io[INVERSE_INERTIA + 3 * i + j] * push[3 + j]
    nutate(inverse, frame, spin, rate)
    for j in range(3):
        along = 0.0
        for i in range(3):
            along += frame[3 * i + j] * (rate[i] - body_io[ANGULAR_RATE + i])
        for i in range(3):
            push[3 + i] += 0.5 * dt * frame[3 * i + j] * along / max(inverse[j], 1e-300)
