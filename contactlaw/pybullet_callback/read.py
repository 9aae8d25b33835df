"""Hook "read", compiled: bodies from PyBullet into the world before a step, and accelerations after Bullet's step."""

from math import isfinite, nan

from contactlaw.jit import jit, jit_inside
from contactlaw.pybullet_callback import rows
from contactlaw.world.bodies.motion import gyroscopic, is_static, move_kinematic, spin_change
from contactlaw.world.data.access import body_at, near_at, shape_at, world_at
from contactlaw.world.data.call import address, call_step
from contactlaw.world.data.demand import STEP
from contactlaw.world.data.quaternion import load4, store4
from contactlaw.world.data.records import NEVER
from contactlaw.world.data.vec import axpy, dot, load, norm, scale, store, sub
from contactlaw.world.near.guards import any_guard_exceeded, surface_speed
from contactlaw.world.near.listing import list_near, may_leave_margin
from contactlaw.world.shapes.geometry import meet
from contactlaw.world.sleep import is_disturbed
from contactlaw.world.step import FIND_PRESSED


@jit
def begin_step(block):
    """Begin a step: read bodies and select those to be pushed; return how many.

    Other results: PASSED: no two bodies can touch in this step or the next, and there is no more to do. PLACED: the
    user has moved bodies. NOT_FINITE. A second call does the same again.
    """
    head = rows.head_at(block, 0)
    w = world_at(head.world, 0)
    found = read_bodies(head, w)
    if found != 0:
        return found
    apart = head.simple != 0 and w.spares == w.contact_room and w.step > 0.0
    if not apart:
        return select_pushed(block)
    for k in range(head.count):
        b = body_at(w.bodies, k + 1)
        b.still = 1 if is_static(b) else 0
        w.stale |= may_leave_margin(b, 2.0 * head.dt)
    if any_guard_exceeded(w, -NEVER, 2.0 * head.dt):
        w.stale = 1
    if w.stale != 0:
        list_near(w)
        w.stale = 0 if 2 * w.nears <= w.near_room else 1
    if w.stale != 0 or not far_apart(w, 2.0 * head.dt):
        return select_pushed(block)
    for k in range(head.count):
        r, b = rows.row_at(head.rows, k), body_at(w.bodies, k + 1)
        b.turned += head.dt * norm(load(b.spin))  # Bullet turns it, the world does not
        rows.note_end(r, r.before, head.dt if r.mass > 0.0 else 0.0)
    return rows.PASSED


@jit_inside
def read_bodies(head, w):
    """Give the world's bodies the poses and velocities that were read; return 0, PLACED or NOT_FINITE."""
    head.refreshed, placed, moved = 0, 0, False
    for k in range(head.count):
        r = rows.row_at(head.rows, k)
        if not rows.finite(r.before):
            head.bad = k
            return rows.NOT_FINITE
    for k in range(head.count):
        r = rows.row_at(head.rows, k)
        if r.in_tree != 0:
            continue
        b = body_at(w.bodies, k + 1)
        store(b.acceleration, load(head.gravity) if r.mass > 0.0 else (0.0, 0.0, 0.0))
        store(b.torque, (0.0, 0.0, 0.0))
        r.placed = 0
        if r.bullet_time == 0.0 and rows.same_motion(r.before, r.left):
            if b.asleep == 0 and (r.mass > 0.0 or not is_static(b)):
                rows.set_body(r, b, head.dt)
            continue
        x, v = load(r.before.position), load(r.before.velocity)
        if r.mass == 0.0 and dot(v, v) + dot(load(r.before.spin), load(r.before.spin)) == 0.0:
            # nothing pushes it, and it has no velocity in PyBullet: it moves to where the user has put it
            store(b.position, load(r.left.position))
            store4(b.quaternion, rows.quaternion_of(r.left))
            move_kinematic(w, b, x, rows.quaternion_of(r.before), head.dt)
            r.pressed, r.placed = 0, b.placed
            placed |= r.placed
            moved = moved or r.placed != 0
            continue
        if r.mass > 0.0:  # expected is where its velocity takes it in the time for which Bullet has moved it
            way = scale(r.bullet_time, v)
            off = norm(sub(sub(x, load(r.left.position)), way))
            r.placed = 0 if off <= rows.EXACT * (norm(x) + norm(way)) else 1
        if r.mass == 0.0 or r.placed != 0:
            placed |= r.placed
            r.pressed, moved = 0, True
        rows.set_body(r, b, head.dt)
    if moved:  # sleeping bodies must check again whether what holds them is still there
        w.stale = 1
        for i in range(1, w.body_count):
            b = body_at(w.bodies, i)
            if b.asleep != 0:
                b.held[0] = nan
    return rows.PLACED if placed != 0 else 0


@jit_inside
def far_apart(w, time):
    """Return whether no two near shapes can touch within a time [s]."""
    for k in range(w.nears):
        p = near_at(w.near, k)
        a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
        overlap, _, _, _ = meet(shape_at(w.shapes, p.a), a, shape_at(w.shapes, p.b), b)
        if time * (surface_speed(a, time) + surface_speed(b, time)) >= -overlap:
            return False
    return True


@jit
def stays_apart(block):
    """After `begin_step` has found PASSED, and other velocities have been read: return whether that still holds."""
    head = rows.head_at(block, 0)
    w, ahead = world_at(head.world, 0), 2.0 * head.dt
    for k in range(head.count):
        r, b = rows.row_at(head.rows, k), body_at(w.bodies, k + 1)
        if r.mass > 0.0:
            rows.set_body(r, b, head.dt)
            b.turned += head.dt * norm(load(b.spin))
            if may_leave_margin(b, ahead):
                return False
    return not any_guard_exceeded(w, -NEVER, ahead) and far_apart(w, ahead)


@jit
def find_pressed(block):
    """Find which bodies are pressed where the user has put bodies: these have their true velocities in PyBullet."""
    head = rows.head_at(block, 0)
    w = world_at(head.world, 0)
    for k in range(head.count):
        body_at(w.bodies, k + 1).placed = rows.row_at(head.rows, k).placed
    call_step(address(w, STEP), w, head.dt, FIND_PRESSED)
    for k in range(head.count):
        r, b = rows.row_at(head.rows, k), body_at(w.bodies, k + 1)
        if r.placed != 0 and b.pressed != 0:
            r.pressed = 1
            if r.in_tree == 0:
                rows.set_body(r, b, head.dt)


@jit
def select_pushed(block):
    """Select the bodies to be pushed with the force of the contacts in the last step; return how many."""
    head = rows.head_at(block, 0)
    head.selected_count = 0
    for k in range(head.count):
        r = rows.row_at(head.rows, k)
        if r.in_tree != 0 or r.mass == 0.0:
            continue
        if r.pressed == 0 or r.placed != 0:
            store(r.force, (0.0, 0.0, 0.0))
            store(r.torque, (0.0, 0.0, 0.0))
        else:
            rows.select(head, k)
    return head.selected_count


@jit_inside
def read_accelerations(head, w):
    """After Bullet's step: find the accelerations that it gave to bodies besides the push of the contacts.

    Where that is gravity alone, it is set to gravity, to the bit. Returns how many bodies had others; -1: not finite. A
    body in free fall shows that time step and gravity are the known ones; where all bodies sleep, neither matters.
    """
    others, falls, sleep = 0, False, head.simple != 0
    dt, gravity = head.dt, load(head.gravity)
    for k in range(head.count):
        r, b = rows.row_at(head.rows, k), body_at(w.bodies, k + 1)
        r.disturbed = 0
        if r.mass == 0.0 or r.in_tree != 0:
            continue
        v, old = load(r.after.velocity), load(r.before.velocity)
        u, older = load(r.after.spin), load(r.before.spin)
        if not isfinite(dot(v, v) + dot(u, u)):
            head.bad = k
            return -1
        sleep = sleep and b.asleep != 0 and not is_disturbed(b)
        falls = falls or (r.pressed == 0 and b.asleep == 0 and norm(gravity) > 0.0)
        gained = sub(sub(v, old), scale(dt, axpy(1.0 / r.mass, load(r.force), gravity)))
        speeds = norm(v) + norm(old) + dt * (norm(gravity) + norm(load(r.force)) / r.mass)
        store(b.acceleration, gravity)
        turning = spin_change(b, sub(load(r.torque), gyroscopic(b, older)))
        twist = sub(sub(u, older), scale(dt, turning))
        spins = norm(u) + norm(older) + dt * norm(turning) + norm(spin_change(b, load(r.torque))) * dt
        store(b.torque, (0.0, 0.0, 0.0))
        no_force, no_torque = norm(gained) <= rows.EXACT * speeds, norm(twist) <= rows.EXACT * spins
        if no_force and no_torque:
            if head.refreshed == 0:
                store(r.after.position, axpy(dt, v, load(r.before.position)))
                store4(
                    r.after.quaternion, load4(r.before.quaternion)
                )  # right for sleeping bodies, the only ones it is used for
            continue
        others += 1
        r.disturbed = 2 if r.pressed != 0 else 1
        if not no_force:
            store(b.acceleration, axpy(1.0 / dt, gained, gravity))
        if not no_torque:
            store(b.torque, rows.torque_for(r, b, scale(1.0 / dt, twist)))
        rows.set_body(r, b, dt)
    head.unknown = 0 if others == 0 and (sleep or falls) else 1
    return others
