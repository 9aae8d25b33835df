"""Free bodies: read from mjData into the world, and written back; and mocap bodies, which are only read.

The coordinates of a free joint are those of the body's frame, the world's those of the centre of mass. With all
integrators but Runge-Kutta MuJoCo's velocity is half a step behind its position, see `note_usual` and `spin_after`.
"""

from math import sqrt

import numpy as np

from contactlaw.jit import jit_module
from contactlaw.memory import copy_wholes, same_wholes
from contactlaw.mujoco_plugin.block import floats, free_at, mocap_at, moved_at, shifted
from contactlaw.mujoco_plugin.layout import data_at
from contactlaw.world.bodies import motion
from contactlaw.world.bodies.motion import note_usual, set_axes, spin_after, spin_rate, update_momentum
from contactlaw.world.contacts.force import is_quasi_static
from contactlaw.world.data.access import body_at, near_at, world_at
from contactlaw.world.data.quaternion import conjugate, load4, product, store4, turn_by
from contactlaw.world.data.records import AGED
from contactlaw.world.data.vec import add, axpy, cross, dot, load, norm, store, sub
from contactlaw.world.shapes.geometry import meet_near
from contactlaw.world.trees.mobility import clear


def frame_of(f, q):
    """Return the normalised quaternion of a body frame at coordinates q, and its arm [m] to the centre of mass."""
    own = (q[3], q[4], q[5], q[6])
    one = 1.0 / max((own[0] ** 2 + own[1] ** 2 + own[2] ** 2 + own[3] ** 2) ** 0.5, 1e-300)
    own = (one * own[0], one * own[1], one * own[2], one * own[3])
    return own, turn_by(own, load(f.offset))


def pose_in(f, coordinates):
    """Return position and quaternion of a body, of its centre of mass and principal axes; coordinates: address."""
    q = floats(coordinates, f.q, 7)
    own, arm = frame_of(f, q)
    return add(load(q), arm), product(own, f.frame)


def set_clearances(head, w):
    """Set how far [m] the surface of each body may move from where the world has it until anything can touch.

    Rotation since near pairs were listed counts. The two bodies of a near pair share its gap.
    """
    for i in range(head.free_count):
        b = body_at(w.bodies, free_at(head.frees, i).body)
        free_at(head.frees, i).clearance = b.margin - norm(sub(load(b.position), load(b.listed_position)))
    for k in range(w.nears):
        p = near_at(w.near, k)
        a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
        overlap, _, _, _ = meet_near(w, p, a, b)
        share = 0.5 if a.inverse_mass != 0.0 and b.inverse_mass != 0.0 else 1.0
        for one, i in ((a, p.body_a), (b, p.body_b)):
            if one.inverse_mass != 0.0:
                f = free_at(head.frees, i - 1)
                f.clearance = min(f.clearance, one.turned * one.reach - share * overlap)


def stays_clear(head, f):
    """Return whether a body cannot have touched anything in this step: it has stayed within its clearance.

    Also sums up the angle that it has turned, unless it is a ball about its own centre. The path in the step is short,
    so the sum of its components bounds it.
    """
    b, offset = body_at(world_at(head.world, 0).bodies, f.body), load(f.offset)
    q, old = floats(head.start, 1 + f.q, 7), floats(head.start, 1 + head.nq + f.v, 6)
    new = floats(data_at(head.data, 0).qvel, f.v, 6)
    v, centre, arm_squared = load(new), load(q), dot(offset, offset)
    change = sub(v, load(old))
    path = abs(v[0]) + abs(v[1]) + abs(v[2]) + abs(change[0]) + abs(change[1]) + abs(change[2])
    path = head.step_size * path
    if b.reach + arm_squared > 0.0:
        turned = head.step_size * max(norm((new[3], new[4], new[5])), norm((old[3], old[4], old[5])))
        b.turned += turned
        path += b.turned * b.reach + turned * sqrt(arm_squared)
        _, arm = frame_of(f, q)
        centre = add(centre, arm)
        if not same_as_left(head, f):
            return False
    left, moved = f.clearance - path, sub(centre, load(b.position))
    return left >= 0.0 and dot(moved, moved) <= left * left


def read_free(head, f):
    """Read position, velocity and external forces of a body at the start of the step."""
    w = world_at(head.world, 0)
    b = body_at(w.bodies, f.body)
    q, v = floats(head.start, 1 + f.q, 7), floats(head.start, 1 + head.nq + f.v, 6)
    own, arm = frame_of(f, q)
    push, moment = outer_force(head, f, own, arm)
    store(b.acceleration, axpy(b.inverse_mass, push, load(head.gravity)))
    store(b.torque, moment)
    placed = head.known == 0 and not same_as_left(head, f)
    b.placed = 1 if placed else 0
    if b.oriented != 0:  # the rounding of its flight depends on when its near pairs are predicted
        w.age = AGED
    if placed:
        w.stale = 1
        b.held[0] = np.nan  # it wakes
    store(b.position, add(load(q), arm))
    store4(b.quaternion, product(own, f.frame))
    set_axes(b)
    spin = turn_by(own, (v[3], v[4], v[5]))
    store(b.spin, spin)
    store(b.velocity, add(load(v), cross(spin, arm)))
    store(b.momentum, (0.0, 0.0, 0.0))
    update_momentum(b)


def read_mocap(head, i, moved):
    """Let a mocap body move to its present pose from where it was before; moved: `MOVED`."""
    w, d, p, before = world_at(head.world, 0), data_at(head.data, 0), mocap_at(head.mocaps, i), moved_at(moved, i)
    b, place, turn = body_at(w.bodies, p.body), load(floats(d.xpos, 3 * p.id, 3)), load4(floats(d.xquat, 4 * p.id, 4))
    known = load4(before.quaternion) != (0.0, 0.0, 0.0, 0.0)
    store(b.position, load(before.position) if known else place)
    store4(b.quaternion, load4(before.quaternion) if known else turn)
    store(b.velocity, load(before.velocity))
    store(b.spin, load(before.spin))
    motion.move_kinematic(w, b, place, turn, head.step_size)


def keep_mocap(head, i, moved):
    """Keep the pose of a mocap body for the next step, and the velocities that led there; moved: `MOVED`."""
    d, p, kept = data_at(head.data, 0), mocap_at(head.mocaps, i), moved_at(moved, i)
    b, place = body_at(world_at(head.world, 0).bodies, p.body), load(floats(d.xpos, 3 * p.id, 3))
    turn = load4(floats(d.xquat, 4 * p.id, 4))
    if load4(kept.quaternion) != (0.0, 0.0, 0.0, 0.0):
        motion.lead(b, load(kept.position), load4(kept.quaternion), place, turn, head.step_size)
    store(kept.position, place)
    store4(kept.quaternion, turn)
    store(kept.velocity, load(b.velocity))
    store(kept.spin, load(b.spin))


def lead_free(head, f):
    """Bring the velocity of a body that nothing presses to the time of its position."""
    b = body_at(world_at(head.world, 0).bodies, f.body)
    f.pressed = b.pressed
    if b.asleep != 0 or b.pressed != 0 or head.lag == 0.0:
        return
    _, arm = frame_of(f, floats(head.start, 1 + f.q, 7))
    velocity = axpy(head.lag, origin_acceleration(b, arm), sub(load(b.velocity), cross(load(b.spin), arm)))
    store(b.spin, spin_after(b, load(b.spin), head.lag))
    store(b.velocity, add(velocity, cross(load(b.spin), arm)))


def outer_force(head, f, own, arm):
    """Return force [N] and moment about the centre of mass [N m] on a body besides gravity and the law's contacts."""
    d, push, moment = data_at(head.data, 0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for forces, sign in (
        (d.qfrc_passive, 1.0), (head.given, -1.0), (d.qfrc_constraint, 1.0), (d.qfrc_applied, 1.0),
        (d.qfrc_actuator, 1.0),
    ):  # fmt: skip
        push = axpy(sign, load(floats(forces, f.v, 3)), push)
        moment = axpy(sign, load(floats(forces, f.v + 3, 3)), moment)
    moment = sub(turn_by(own, moment), cross(arm, push))
    for body in range(f.id, f.id + f.parts):
        extra, centre = shifted(d.xfrc_applied, 6 * body), load(floats(d.xipos, 3 * body, 3))
        force, arm = load(floats(extra, 0, 3)), sub(centre, load(floats(d.xipos, 3 * f.id, 3)))
        push = add(push, force)
        moment = add(moment, add(load(floats(extra, 3, 3)), cross(arm, force)))
    return push, moment


def origin_acceleration(b, arm):
    """Return the acceleration [m/s^2] of the origin of a body's frame; arm: from there to the centre of mass."""
    w = load(b.spin)
    return sub(load(b.acceleration), add(cross(spin_rate(b, w), arm), cross(w, cross(w, arm))))


def same_as_left(head, f):
    """Return whether the coordinates and velocities of a body are still those at the end of the last step."""
    q, v = 1 + f.q, 1 + head.nq + f.v
    same = same_wholes(shifted(head.start, q), shifted(head.left, q), 7)
    return same and same_wholes(shifted(head.start, v), shifted(head.left, v), 6)


def axes_of(b, f):
    """Return the quaternion of a body frame in the world's pose, and its arm [m] to the centre of mass."""
    own = product(load4(b.quaternion), conjugate(load4(f.frame)))
    return own, turn_by(own, load(f.offset))


def hold_free(head, f):
    """Set a body back to where it was at the start of the step, at rest."""
    d = data_at(head.data, 0)
    copy_wholes(shifted(head.start, 1 + f.q), shifted(d.qpos, f.q), 7)
    clear(floats(d.qvel, f.v, 6))


def write_free(head, f, pushes_io):
    """Write position and velocity of a body that a contact has touched, or that sleeps, to mjData.

    pushes_io: acceleration and torque, shape (nv,), by forces besides gravity and contacts in the last step that
    touched.
    """
    b, d = body_at(world_at(head.world, 0).bodies, f.body), data_at(head.data, 0)
    if b.asleep != 0 and pose_in(f, shifted(head.start, 1)) == (load(b.position), load4(b.quaternion)):
        hold_free(head, f)  # what falls asleep after it has moved is written like others
        return
    if b.touched == 0:
        return
    q, v = floats(d.qpos, f.q, 7), floats(d.qvel, f.v, 6)
    own, arm = axes_of(b, f)
    velocity, spin = sub(load(b.velocity), cross(load(b.spin), arm)), load(b.spin)
    lags, usual = b.pressed == 0 and head.lag > 0.0, pushes_io[f.v : f.v + 6]
    note_usual(b, load(head.gravity), usual[:3], usual[3:], lags and f.pressed != 0)
    if lags:
        velocity = axpy(-head.lag, origin_acceleration(b, arm), velocity)
        spin = spin_after(b, spin, -head.lag)
    store(q, sub(load(b.position), arm))
    store4(floats(d.qpos, f.q + 3, 4), own)
    store(v, velocity)
    v[3], v[4], v[5] = turn_by(conjugate(own), spin)


def mean_share(c, dt):
    """Return the expected mean force of a closed contact over the next step, over its force now, at most 1.

    In an impact under way the impulse left is m (v + u): v closing speed now, u parting speed, from m u^2/2 = m v^2/2 +
    2/5 P delta. With the full force for a whole step, limits and equalities would respond to more than the impulse that
    is left.
    """
    t = c.touch
    if t.force <= 0.0 or is_quasi_static(c, 1.0):
        return 1.0
    parting = sqrt(t.closing * t.closing + 0.8 * t.force * max(t.overlap, 0.0) / t.mass)
    return min(t.mass * (t.closing + parting) / (t.force * dt), 1.0)


def turn_moment(head, f, push_io):
    """Refer the moment of a body in `push_io` to the origin and the axes of its frame, as generalised forces are."""
    b = body_at(world_at(head.world, 0).bodies, f.body)
    if b.pressed == 0:
        return
    own, centre = axes_of(b, f)
    moment = add(load(push_io[f.v + 3 :]), cross(centre, load(push_io[f.v :])))
    store(push_io[f.v + 3 :], turn_by(conjugate(own), moment))


jit_module(__name__)
