"""Bounds on the motion of free bodies, for times of impact."""

from math import sqrt

from contactlaw.jit import jit
from contactlaw.world.bodies.motion import max_inverse_inertia
from contactlaw.world.data.records import NEVER
from contactlaw.world.data.vec import dot, load, norm

LARGEST_TURN = 0.2  # [rad] horizon of times of impact of bodies with shapes off their centres


@jit
def time_to_close(gap, closing, push):
    """Return the time [s] until a gap [m] >= 0 closes, or NEVER; push: closing acceleration."""
    square = closing * closing + 2.0 * push * gap
    if square < 0.0:
        return NEVER
    if closing > 0.0:
        return 2.0 * gap / (closing + sqrt(square))
    return (sqrt(square) - closing) / push if push > 0.0 else NEVER


@jit
def turning_bound(b, time):
    """Return a bound on the angular acceleration [rad/s^2] of a body within a time [s]; in a tree: the present value.

    In I w' = M - w x L the last moment is at most (1/I_min - 1/I_max) L^2/2, whatever the direction of L in the body
    (Wielandt's inequality).
    """
    if b.tree != 0:
        return norm(load(b.turning))
    i, most, moment, gyroscopic = b.inverse_inertia, max_inverse_inertia(b), norm(load(b.torque)), 0.0
    if b.isotropic == 0:
        momentum = norm(load(b.momentum)) + time * moment
        gyroscopic = 0.5 * (most - min(i[0], min(i[1], i[2]))) * momentum * momentum
    return most * (moment + gyroscopic)


@jit
def spin_bound(b, time):
    """Return a bound on the angular speed [rad/s] of a body within a time [s]: I_min w^2 is at most w.L."""
    spin = load(b.spin)
    straight = norm(spin) + time * turning_bound(b, time)
    if b.tree != 0 or b.isotropic != 0:
        return straight
    most = max_inverse_inertia(b)
    return min(straight, sqrt(most * max(dot(spin, load(b.momentum)), 0.0)) + time * most * norm(load(b.torque)))
