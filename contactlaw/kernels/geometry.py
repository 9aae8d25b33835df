"""Where two simple shapes touch; A is always a ball.

Each returns the overlap [m], negative apart, and writes to n_out (3, world frame) the normal from B to A.
"""

from __future__ import annotations

from math import sqrt

from contactlaw.jit import jit


@jit
def ball_on_ball(a, radius_a, b, radius_b, n_out):
    """Centres a, b (3)."""
    x, y, z = a[0] - b[0], a[1] - b[1], a[2] - b[2]
    apart = sqrt(x * x + y * y + z * z)
    overlap = radius_a + radius_b - apart
    if apart == 0.0:
        n_out[0], n_out[1], n_out[2] = 0.0, 0.0, 1.0
    else:
        n_out[0], n_out[1], n_out[2] = x / apart, y / apart, z / apart
    return overlap


@jit
def ball_on_plane(a, radius, origin, frame, n_out):
    """Ball at a (3); plane through origin (3), its normal the third column of frame (9, row-major)."""
    height = 0.0
    for i in range(3):
        n_out[i] = frame[3 * i + 2]
        height += (a[i] - origin[i]) * n_out[i]
    overlap = radius - height
    return overlap


@jit
def ball_on_box(a, radius, centre, frame, half, n_out):
    """Ball at a (3); box at centre (3), frame (9, row-major), half lengths (3).

    Returns the overlap and whether the ball is over a face (not an edge or corner).
    """
    x = frame[0] * (a[0] - centre[0]) + frame[3] * (a[1] - centre[1]) + frame[6] * (a[2] - centre[2])
    y = frame[1] * (a[0] - centre[0]) + frame[4] * (a[1] - centre[1]) + frame[7] * (a[2] - centre[2])
    z = frame[2] * (a[0] - centre[0]) + frame[5] * (a[1] - centre[1]) + frame[8] * (a[2] - centre[2])
    dx = x - min(max(x, -half[0]), half[0])
    dy = y - min(max(y, -half[1]), half[1])
    dz = z - min(max(z, -half[2]), half[2])
    apart = sqrt(dx * dx + dy * dy + dz * dz)
    outside = (1 if dx != 0.0 else 0) + (1 if dy != 0.0 else 0) + (1 if dz != 0.0 else 0)
    if outside == 0:  # the centre is inside: out through the nearest face
        gx, gy, gz = half[0] - abs(x), half[1] - abs(y), half[2] - abs(z)
        apart = -min(gx, gy, gz)
        if gx <= gy and gx <= gz:
            dx = 1.0 if x >= 0.0 else -1.0
        elif gy <= gz:
            dy = 1.0 if y >= 0.0 else -1.0
        else:
            dz = 1.0 if z >= 0.0 else -1.0
    else:
        dx, dy, dz = dx / apart, dy / apart, dz / apart
    overlap = radius - apart
    for i in range(3):
        n_out[i] = frame[3 * i] * dx + frame[3 * i + 1] * dy + frame[3 * i + 2] * dz
    return overlap, outside <= 1


@jit
def nearest_on_segments(a, u, half_a, b, v, half_b):
    """Where two segments come nearest: signed distances from their middles a, b (3) along their units u, v (3)."""
    uv, ua, va = 0.0, 0.0, 0.0
    for i in range(3):
        d = a[i] - b[i]
        uv += u[i] * v[i]
        ua += u[i] * d
        va += v[i] * d
    det = 1.0 - uv * uv
    s = min(max((uv * va - ua) / det, -half_a), half_a) if det > 1e-12 else 0.0
    t = min(max(va + uv * s, -half_b), half_b)
    s = min(max(uv * t - ua, -half_a), half_a)
    return s, t
