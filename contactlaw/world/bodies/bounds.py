"""Bounds on the motion of a body, and of one body in the frame of another, within a time to come."""

from math import sqrt

from contactlaw.jit import jit_module
from contactlaw.world.bodies.motion import acceleration_at, acceleration_of, change_bound, max_inverse_inertia
from contactlaw.world.data.records import NEVER
from contactlaw.world.data.vec import cross, dot, load, norm, sub, to_body

IDLE = 1e-9  # of its radius, by which what touches by rounding overlaps and moves in a step at most
LARGEST_TURN = 0.2  # [rad] horizon of times of impact of bodies with shapes off their centres


def time_to_close(gap, closing, push):
    """Return the time [s] until a gap [m] >= 0 closes, or NEVER; push: closing acceleration."""
    square = closing * closing + 2.0 * push * gap
    if square < 0.0:
        return NEVER
    if closing > 0.0:
        return 2.0 * gap / (closing + sqrt(square))
    return (sqrt(square) - closing) / push if push > 0.0 else NEVER


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


def is_idle(a, b, overlap, closing, time, radius):
    """Return whether two bodies that touch by rounding neither press nor part by themselves in a time [s].

    Their contact is so soft that an impact of it would last longer than those of what strikes them.
    """
    if overlap > IDLE * radius:
        return False
    push = norm(sub(acceleration_of(a), acceleration_of(b)))
    for one in (a, b):
        if one.oriented != 0:
            push += (dot(load(one.spin), load(one.spin)) + turning_bound(one, time)) * one.reach
    return overlap + (abs(closing) + push * time) * time < IDLE * radius


def spin_bound(b, time):
    """Return a bound on the angular speed [rad/s] of a body within a time [s]: I_min w^2 is at most w.L."""
    spin = load(b.spin)
    straight = norm(spin) + time * turning_bound(b, time)
    if b.tree != 0 or b.isotropic != 0:
        return straight
    most = max_inverse_inertia(b)
    return min(straight, sqrt(most * max(dot(spin, load(b.momentum)), 0.0)) + time * most * norm(load(b.torque)))


def motion_against(a, b):
    """Return the velocity [m/s] of A's centre of mass in B's frame, and the spin [rad/s] of A there."""
    r, spin = sub(load(a.position), load(b.position)), load(b.spin)
    slide = sub(sub(load(a.velocity), load(b.velocity)), cross(spin, r))
    return to_body(b.axes, slide), to_body(b.axes, sub(load(a.spin), spin))


def relative_speed(a, b, left):
    """Return bounds on the speed [m/s] of the points of A in B's frame: now, and its mean over a time [s] to come."""
    if a.still != 0 and b.still != 0:
        return 0.0, 0.0
    slide, twist = motion_against(a, b)
    now = norm(slide), norm(twist)
    slides, turns, _, _, _, change = motion_bounds(a, b, now, left, 0.5)
    return now[0] + now[1] * a.reach, slides + turns * a.reach + left / 6.0 * change


def motion_bounds(a, b, now, left, share):
    """Return bounds on how A moves in B's frame within a time [s] to come.

    Of A there: speed of the centre [m/s], spin [rad/s], acceleration of the centre along its path [m/s^2], angular
    acceleration [rad/s^2]; spin of B [rad/s]. These leave out how joints change accelerations: left/6 times the last
    result [m/s^2] adds to the mean speed of points of A. now: the first two now; share: 1, or 1/2 for their means.

    Coriolis forces do no work. So along its path A's centre is accelerated by the difference to the point of B that is
    there. In a tree accelerations are known as vectors: bodies that move together do not move apart.
    """
    slides, turns = now
    r, u = sub(load(a.position), load(b.position)), sub(load(a.velocity), load(b.velocity))
    gain, spin, twist = norm(sub(acceleration_of(a), acceleration_of(b))), spin_bound(b, left), turning_bound(b, left)
    fast = norm(u) + left * gain
    far = norm(r) + left * fast
    push, gradient = gain + far * twist + spin * fast, twist + spin * spin
    if b.tree != 0 and gradient * left * left < 1.0:  # the point of B is not the same all the time
        there = norm(sub(acceleration_of(a), acceleration_at(b, r))) + left * slides * gradient
        push = min(push, there * (1.0 + gradient * left * left))
    twist += turning_bound(a, left)
    if are_linked(a, b):
        twist = norm(sub(load(a.turning), load(b.turning)))
    change = change_bound(a, a.reach, left, 3.0, True) + change_bound(b, far + a.reach, left, 3.0)
    slides = min(slides + share * left * push, fast + spin * far)
    turns = min(turns + share * left * twist, spin_bound(a, left) + spin)
    return slides, turns, push, twist, spin, change


def are_linked(a, b):
    """Return whether two bodies belong to one tree that is awake, so that their accelerations are those of now."""
    return a.tree != 0 and a.tree == b.tree and a.asleep == 0


def closing_along(a, b, n, left):
    """Return bounds on the speed [m/s] of points of A against a normal n fixed to B.

    They are that of now, its growth [m/s^2] within a time [s], and its mean over it. Neighbours in an arm turn fast,
    but mostly along the planes between them. With s and w the velocity and spin of A and W the spin of B, in its frame,
    and L the reach of A, the speed is at most L |n x w| - n . s, and grows at a rate of at most

        |s'| + 2 W |s| + L (|n x w'| + W |w| + |w| |n x w|)
    """
    slide, spin_a = motion_against(a, b)
    slides, turns, push, twist, spin, change = motion_bounds(a, b, (norm(slide), norm(spin_a)), left, 1.0)
    if are_linked(a, b):
        twist = norm(cross(n, to_body(b.axes, sub(load(a.turning), load(b.turning)))))
    across, twist = norm(cross(n, spin_a)), twist + spin * turns
    growth = push + 2.0 * spin * slides + a.reach * (twist + turns * min(across + left * twist, turns))
    now = a.reach * across - dot(n, slide)
    mean = min(now + 0.5 * left * growth, slides + turns * a.reach) + left / 6.0 * change
    return now, growth + change / 3.0, mean


jit_module(__name__)
