"""Records of bodies that Python and the compiled `hooks` share.

Bullet's velocity is half a step behind its position, see `note_usual`, and so is the spin, see `spin_after`: by the
explicit gyroscopic rate each reading and writing would raise the energy of what tumbles by the square of half a step.

Bullet steps first, with the force of the contacts in the step before as a push (`select_pushed`). Then the world takes
the same step with the accelerations that Bullet's step had besides that push, and pose and velocity of what contacts
have touched, or what tumbles in free flight, are written to PyBullet (`write_bodies`). The accelerations follow from
the change of velocity. If that of a body that was pushed is not due to gravity and the push alone, Python is asked to
read its mass. Where Bullet's step has taken a body follows from its velocity after it (`fly`).
"""

from math import cos, isfinite, pi, sin
from typing import Any

from contactlaw.jit import jit_module
from contactlaw.laws.record import VECTOR, record
from contactlaw.memory import element, set_whole
from contactlaw.world.bodies.motion import gyroscopic, set_axes, spin_after, spin_change
from contactlaw.world.data.quaternion import product, store4, unit
from contactlaw.world.data.vec import axpy, load, norm, scale, store, to_body, to_world

POSE, TWIST = {"position": VECTOR, "quaternion": ("f8", (4,))}, {"velocity": VECTOR, "spin": VECTOR}
MOTION = record(**POSE, **TWIST)
"""Pose and velocity as PyBullet gives them, quaternion scalar last."""

ROW = record(
    before=MOTION, after=MOTION,  # before and after Bullet's step
    left=MOTION,  # as the last call left it in PyBullet; at the start of a step that `begin_step` has PASSED
    mass="f8", inertia=VECTOR,  # zero mass: nothing can move it
    force=VECTOR, torque=VECTOR,  # mean force [N] and torque [N m] of contacts over the last step
    was_pressed="i8",  # a contact was closed at its start, as `pressed` of its body tells of its end
    usual=VECTOR, wrench=VECTOR,  # acceleration, torque besides gravity and contacts in the last step that touched
    placed="i8",  # the user has moved it since
    lag="f8",  # [s] length of the step by half of which its velocity before Bullet's step is behind its position
    disturbed="i8",  # Bullet's step moved it not by gravity and the push alone
    forced="i8",  # steps for which it is not left to Bullet's flight, after a force that is not slight
)  # fmt: skip
"""A body of PyBullet without joints; those that have a mass come first, as in the world, where trees follow."""

HEAD = record(
    world="u8", rows="u8", singles="i8", moving="i8",  # number of bodies without joints; of these with mass
    motions="u8", poses="u8", velocities="u8",  # of those: as read before Bullet's step, and what was read after it
    dt="f8", gravity=VECTOR,
    simple="i8",  # no body has joints, no shape must be measured
    refreshed="i8",  # the masses that PUSHED_OTHERWISE asked for have been read in this step
    lists="i8",  # number of lists of near pairs made so far
    bad="i8",  # row with numbers that are not finite
    selected="u8", selected_count="i8",  # rows of bodies that Python must look at, push or put elsewhere
)  # fmt: skip
"""Input of the compiled code (addresses, time step [s], gravity [m/s^2]) and its results."""

MOST_TURN = 0.25 * pi  # [rad] in a step of Bullet
# Share of its spin by which gyroscopic moments change that of a free body in a step: Bullet, in which they act
# explicitly, raises its energy by the square of that in each step
MOST_TUMBLE = 1e-4
EXACT = 1e-12  # relative difference that counts as rounding
SLIGHT = 0.5  # acceleration over gravity of slight forces, as of Bullet's damping, and not of its contacts
NOTED, LISTED, ASLEEP, FLAGS = 1, 2, 4, 8  # bits of `check_contacts`, and the first free one: see there
NOT_FINITE, NO_ROOM, PUSHED_OTHERWISE = -1, -2, -3  # of `finish_step`
PASSED, PLACED, STRAYED = -2, -3, -4  # of `begin_step` and `has_flown`

head_at: Any = element(HEAD)
row_at: Any = element(ROW)
motion_at: Any = element(MOTION)
pose_at: Any = element(record(**POSE))
twist_at: Any = element(record(**TWIST))


def finite(m):
    """Return whether pose and velocity are finite."""
    total = 0.0
    for i in range(3):
        total += m.position[i] + m.velocity[i] + m.spin[i]
    return isfinite(total + m.quaternion[0] + m.quaternion[1] + m.quaternion[2] + m.quaternion[3])


def same_motion(a, b):
    """Return whether two poses and velocities are the same to the bit."""
    same = a.quaternion[3] == b.quaternion[3]
    for i in range(3):
        same = same and a.position[i] == b.position[i] and a.quaternion[i] == b.quaternion[i]
        same = same and a.velocity[i] == b.velocity[i] and a.spin[i] == b.spin[i]
    return same


def quaternion_of(m):
    """Return the quaternion of a motion, scalar first."""
    return m.quaternion[3], m.quaternion[0], m.quaternion[1], m.quaternion[2]


def set_body(r, b):
    """Put the world's body where PyBullet's is, with the velocity at that time; its acceleration is known."""
    m = r.before
    store(b.position, load(m.position))
    store4(b.quaternion, quaternion_of(m))
    set_axes(b)
    lag = 0.5 * r.lag if b.pressed == 0 and r.mass > 0.0 else 0.0
    store(b.velocity, axpy(lag, load(b.acceleration), load(m.velocity)))
    store(b.spin, spin_after(b, load(m.spin), lag))


def store_turn(m, turn):
    """Write a quaternion, scalar first, into a motion."""
    m.quaternion[3], m.quaternion[0], m.quaternion[1], m.quaternion[2] = turn


def fly(r, dt):
    """Set the pose of a body after Bullet's step.

    Its velocity after the step moves it, and turns it by MOST_TURN at most: `integrateTransform` of Bullet's
    btTransformUtil, and `stepPositionsMultiDof` of its btMultiBody.
    """
    store(r.after.position, axpy(dt, load(r.after.velocity), load(r.before.position)))
    store_turn(r.after, product(turn_in(dt, load(r.after.spin)), quaternion_of(r.before)))


def turn_in(dt, spin):
    """Return the quaternion of the rotation by which Bullet's step turns a body at a spin after it."""
    whole = scale(dt, spin)
    half = 0.5 * min(norm(whole), MOST_TURN)
    x, y, z = scale(0.5 * sin(half) / max(half, 1e-300), whole)
    return unit((cos(half), x, y, z))


def tumbles(b, dt):
    """Return whether a body in free flight turns such that Bullet would do it wrong."""
    if b.oriented == 0:
        return False
    spin = load(b.spin)
    turn, change = dt * norm(spin), dt * norm(spin_change(b, gyroscopic(b, spin)))
    return turn >= MOST_TURN or change > MOST_TUMBLE * norm(spin)


def torque_for(r, b, rate):
    """Return the torque [N m] for an angular acceleration of a body."""
    p, i = to_body(b.axes, rate), r.inertia
    return to_world(b.axes, (i[0] * p[0], i[1] * p[1], i[2] * p[2]))


def select(head, k):
    """Add a row to those that Python must look at, push or put elsewhere."""
    set_whole(head.selected, head.selected_count, k)
    head.selected_count += 1


jit_module(__name__)
