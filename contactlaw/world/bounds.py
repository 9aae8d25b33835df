"""Bounds on the motion of bodies towards each other, of which times of impact are made."""

from __future__ import annotations

from math import sqrt

from contactlaw.jit import jit_inside
from contactlaw.world.records import NEVER
from contactlaw.world.vec import cross, load, norm

LARGEST_TURN = 0.2  # [rad] for which a time of impact of a body with shapes off its centre is foreseen


@jit_inside
def time_to_close(gap, closing, push):
    """Time [s] until a gap [m] >= 0 closes, at a closing speed [m/s] and acceleration [m/s^2]."""
    square = closing * closing + 2.0 * push * gap
    if square < 0.0:
        return NEVER
    if closing > 0.0:
        return 2.0 * gap / (closing + sqrt(square))
    return (sqrt(square) - closing) / push if push > 0.0 else NEVER


@jit_inside
def torque_bound(b, arm):
    """Acceleration [m/s^2] of a point by torques, the gyroscopic one included, at most."""
    if b.isotropic != 0:
        return norm(load(b.torque)) * b.inverse_inertia[0] * norm(arm)
    i = b.inverse_inertia
    moment = norm(load(b.torque)) + norm(cross(load(b.spin), load(b.momentum)))
    return moment * max(i[0], max(i[1], i[2])) * norm(arm)
