"""Bodies and shapes moved on by an interval of a step, with what their contacts did in it."""

from __future__ import annotations

from math import cos, sin, sqrt

import numpy as np

from contactlaw.jit import jit
from contactlaw.kernels.coupling import add_cross, on_a
from contactlaw.kernels.rows import EARLY, IMPULSE
from contactlaw.kernels.scene import (
    ANGULAR,
    ANGULAR_RATE,
    BODY_OF,
    COM,
    INVERSE_INERTIA,
    INVERSE_MASS,
    LINEAR,
    MEAN_SPIN,
    RATE,
    SHAPE_A,
    TREE,
)


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
