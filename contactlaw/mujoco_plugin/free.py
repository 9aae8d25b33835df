"""Bodies that nothing but their contacts holds: from mjData to the world, and back.

The coordinates of a free joint are those of the body's frame, the world's those of its centre of mass. Under all
integrators but Runge-Kutta MuJoCo's velocity is half a step of acceleration behind its position: x1 = x0 + dt (v0 + dt
a) is a parabola if the velocity at x0 is v0 + dt/2 a. Where a contact presses at the end of a step, the velocity is
the true one, so that what rests has none. What a force of this very step has lifted off goes on half a step behind with
as much of it as was there in the step before: a kick for one step would else be half a kick, as the engine knows no
more of it. The spin of what tumbles is taken as it is: with half a step of its gyroscopic acceleration, which is across
it, energy would be gained each time, by the square of that.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from contactlaw.memory import whole_at
from contactlaw.mujoco_plugin.block import floats, place
from contactlaw.mujoco_plugin.layout import data_at, jit
from contactlaw.world.bodies.motion import set_axes, spin_change, spin_rate, update_momentum
from contactlaw.world.contacts.force import is_quasi_static
from contactlaw.world.data.access import body_at, world_at
from contactlaw.world.data.vec import (
    add,
    axpy,
    cross,
    dot,
    load,
    load4,
    norm,
    product,
    share_of,
    store,
    store4,
    sub,
    turn_by,
)
from contactlaw.world.trees.mobility import clear, copy


@jit
def coordinates(head, state, f):
    """Of a body: its coordinates and its velocities, of a state at an address."""
    return floats(state, 1 + f.q, 7), floats(state, 1 + head.nq + f.v, 6)


@jit
def back(q):
    """The conjugate of a quaternion."""
    return q[0], -q[1], -q[2], -q[3]


@jit
def frame_of(f, q):
    """Of a body whose coordinates are q: its quaternion, and its centre of mass from its frame's origin [m]."""
    own = (q[3], q[4], q[5], q[6])
    one = 1.0 / max((own[0] ** 2 + own[1] ** 2 + own[2] ** 2 + own[3] ** 2) ** 0.5, 1e-300)
    own = (one * own[0], one * own[1], one * own[2], one * own[3])
    return own, turn_by(own, load(f.offset))


@jit
def is_far(head, f):
    """Whether a body has stayed within its margin, by its way in the step; counts how far it has turned, if it matters.

    That of a ball about its centre does not. Of the way, which is short, a bound: the sum along the axes.
    """
    b, offset = body_at(world_at(head.world, 0).bodies, f.body), load(f.offset)
    q, old = coordinates(head, head.start, f)
    new = floats(data_at(head.data, 0).qvel, f.v, 6)
    v, centre, apart = load(new), load(q), dot(offset, offset)
    change = sub(v, load(old))
    way = abs(v[0]) + abs(v[1]) + abs(v[2]) + abs(change[0]) + abs(change[1]) + abs(change[2])
    way = head.step_size * way
    if b.reach + apart > 0.0:
        turned = head.step_size * max(norm((new[3], new[4], new[5])), norm((old[3], old[4], old[5])))
        b.turned += turned
        way += b.turned * b.reach + turned * sqrt(apart)
        _, arm = frame_of(f, q)
        centre = add(centre, arm)
        if not same_as_left(head, f.q, 7, f.v, 6):
            return False
    left, gone = b.margin - way, sub(centre, load(b.listed_position))
    return left >= 0.0 and dot(gone, gone) <= left * left


@jit
def read_free(head, f, known):
    """Where a body is, how it moves, and what moves it besides contacts, at the start of the step.

    known: all are as a step has left them, be it one of other data. One that sleeps is read too, if it is not where it
    fell asleep: set back, it wakes where all do.
    """
    b = body_at(world_at(head.world, 0).bodies, f.body)
    q, v = coordinates(head, head.start, f)
    own, arm = frame_of(f, q)
    push, moment = outer_force(head, f, own, arm)
    store(b.acceleration, axpy(b.inverse_mass, push, load(head.gravity)))
    store(b.torque, moment)
    same = same_as_left(head, f.q, 7, f.v, 6)
    if same and b.asleep != 0 and b.touched == 0:  # where it has been read before
        return
    placed = not (known or same)
    if placed or b.oriented != 0:  # how such a flight is cut, and so its rounding, depends on when the list was made
        world_at(head.world, 0).stale = 1
    if placed:
        b.placed = 1
        b.held[0] = np.nan  # it wakes
    store(b.position, add(load(q), arm))
    store4(b.quaternion, product(own, f.frame))
    set_axes(b)
    spin = turn_by(own, (v[3], v[4], v[5]))
    store(b.spin, spin)
    store(b.velocity, add(load(v), cross(spin, arm)))
    store(b.momentum, (0.0, 0.0, 0.0))
    update_momentum(b)


@jit
def lead_free(head, f):
    """Bring the velocity of a body that nothing presses to the time of its position."""
    b = body_at(world_at(head.world, 0).bodies, f.body)
    f.pressed = b.pressed
    if b.asleep != 0 or b.pressed != 0 or head.lag == 0.0:
        return
    _, arm = frame_of(f, floats(head.start, 1 + f.q, 7))
    velocity = axpy(head.lag, origin_acceleration(b, arm), sub(load(b.velocity), cross(load(b.spin), arm)))
    store(b.spin, axpy(head.lag, spin_change(b, load(b.torque)), load(b.spin)))
    store(b.velocity, add(velocity, cross(load(b.spin), arm)))


@jit
def outer_force(head, f, own, arm):
    """Force [N] on a body besides gravity and contacts of the law, and its moment about the centre of mass [N m]."""
    d, push, moment = data_at(head.data, 0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for forces, sign in (
        (d.qfrc_passive, 1.0), (head.given, -1.0), (d.qfrc_constraint, 1.0), (d.qfrc_applied, 1.0),
        (d.qfrc_actuator, 1.0),
    ):  # fmt: skip
        push = axpy(sign, load(floats(forces, f.v, 3)), push)
        moment = axpy(sign, load(floats(forces, f.v + 3, 3)), moment)
    moment = sub(turn_by(own, moment), cross(arm, push))
    extra = place(d.xfrc_applied, 6 * f.id)
    return add(push, load(floats(extra, 0, 3))), add(moment, load(floats(extra, 3, 3)))


@jit
def origin_acceleration(b, arm):
    """Acceleration [m/s^2] of the origin of a body's frame; arm: from there to the centre of mass."""
    w = load(b.spin)
    return sub(load(b.acceleration), add(cross(spin_rate(b, w), arm), cross(w, cross(w, arm))))


@jit
def same_as_left(head, q, q_size, v, v_size):
    """Whether nobody has changed some coordinates and velocities, from q and v on, since the last step."""
    differ = 0
    for first, size in ((1 + q, q_size), (1 + head.nq + v, v_size)):
        now, left = place(head.start, first), place(head.left, first)
        for i in range(size):
            differ |= whole_at(now, i) ^ whole_at(left, i)
    return differ == 0


@jit
def axes_of(b, f):
    """The quaternion of a body's frame, and its centre of mass from the frame's origin [m]."""
    own = product(load4(b.quaternion), back(load4(f.frame)))
    return own, turn_by(own, load(f.offset))


@jit
def write_free(head, f, pushes):
    """Put a body that was touched where the world has it; pushes: generalised forces (nv,) on what was pressed."""
    b, d = body_at(world_at(head.world, 0).bodies, f.body), data_at(head.data, 0)
    q, v = floats(d.qpos, f.q, 7), floats(d.qvel, f.v, 6)
    if b.asleep != 0:
        copy(floats(head.start, 1 + f.q, 7), q)
        clear(v)
        return
    if b.touched == 0:
        return
    own, arm = axes_of(b, f)
    velocity, spin = sub(load(b.velocity), cross(load(b.spin), arm)), load(b.spin)
    push, moment = sub(load(b.acceleration), load(head.gravity)), load(b.torque)
    before, wrench = pushes[f.v : f.v + 3], pushes[f.v + 3 : f.v + 6]
    if b.pressed == 0 and head.lag > 0.0:
        if f.pressed != 0:
            store(b.acceleration, add(load(head.gravity), share_of(load(before), push)))
            store(b.torque, share_of(load(wrench), moment))
        velocity = axpy(-head.lag, origin_acceleration(b, arm), velocity)
        spin = axpy(-head.lag, spin_change(b, load(b.torque)), spin)
    store(before, push)
    store(wrench, moment)
    store(q, sub(load(b.position), arm))
    store4(floats(d.qpos, f.q + 3, 4), own)
    store(v, velocity)
    v[3], v[4], v[5] = turn_by(back(own), spin)


@jit
def mean_share(c, dt):
    """What a closed contact will press with in the mean over the next step, over what it presses with now.

    Of an impact that is going on the impulse left is m (v + u): v closing speed now, u parting speed, from
    m u^2/2 = m v^2/2 + 2/5 P delta. Limits and equalities would hold against all of its force for a whole step.
    """
    t = c.touch
    if t.force <= 0.0 or is_quasi_static(c, 1.0):
        return 1.0
    parting = sqrt(t.closing * t.closing + 0.8 * t.force * max(t.overlap, 0.0) / t.mass)
    return min(t.mass * (t.closing + parting) / (t.force * dt), 1.0)


@jit
def press_free(b, f, arm, force, push_io):
    """Add a force on a body [N], at an arm [m] from its centre of mass, to the generalised one."""
    own, centre = axes_of(b, f)
    moment = turn_by(back(own), cross(add(arm, centre), force))
    for i in range(3):
        push_io[f.v + i] += force[i]
        push_io[f.v + 3 + i] += moment[i]
