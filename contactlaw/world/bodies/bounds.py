"""Bounds on the motion of bodies towards each other, of which times of impact are made."""

from __future__ import annotations

from math import sqrt

from contactlaw.jit import jit_inside
from contactlaw.world.data.records import NEVER
from contactlaw.world.data.vec import dot, load, norm

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
def turning_bound(b, time):
    """Angular acceleration [rad/s^2] of a body within a time [s] without contacts, at most; in a tree: the one it has.

    Of I w' = M - w x L the last is at most (1/I_min - 1/I_max) L^2/2, whichever way L lies in the body: the product of
    length and height of all ellipses in which w and L can be, by Wielandt's inequality.
    """
    if b.tree != 0:
        return norm(load(b.turning))
    i, moment, gyroscopic = b.inverse_inertia, norm(load(b.torque)), 0.0
    most = max(i[0], max(i[1], i[2]))
    if b.isotropic == 0:
        momentum = norm(load(b.momentum)) + time * moment
        gyroscopic = 0.5 * (most - min(i[0], min(i[1], i[2]))) * momentum * momentum
    return most * (moment + gyroscopic)


@jit_inside
def spin_bound(b, time):
    """Angular speed [rad/s] of a body within a time [s] without contacts, at most: I_min w^2 is at most w L."""
    spin = load(b.spin)
    straight = norm(spin) + time * turning_bound(b, time)
    if b.tree != 0 or b.isotropic != 0:
        return straight
    i = b.inverse_inertia
    most = max(i[0], max(i[1], i[2]))
    return min(straight, sqrt(most * max(dot(spin, load(b.momentum)), 0.0)) + time * most * norm(load(b.torque)))
