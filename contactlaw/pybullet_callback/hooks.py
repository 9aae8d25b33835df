"""Hooks "read" and "apply", compiled: bodies from PyBullet into the world before a step, accelerations after Bullet's
step, and the results of the world's step for the bodies that contacts have touched.
"""

from math import isfinite, nan

from contactlaw.jit import jit_module
from contactlaw.memory import whole_at
from contactlaw.pybullet_callback import rows
from contactlaw.world.bodies import motion
from contactlaw.world.bodies.bounds import closing_along
from contactlaw.world.bodies.motion import set_axes, spin_rate
from contactlaw.world.contacts.touch import has_contacts
from contactlaw.world.data.access import body_at, contact_at, near_at, shape_at, world_at
from contactlaw.world.data.call import address, call_step, ready
from contactlaw.world.data.demand import STEP
from contactlaw.world.data.quaternion import conjugate, load4, product, rotation_vector, store4
from contactlaw.world.data.records import CLOSED, FREE, NEVER, PUT
from contactlaw.world.data.vec import add, axpy, dot, load, norm, scale, store, sub, to_body
from contactlaw.world.near.guards import any_guard_exceeded
from contactlaw.world.near.listing import list_near, may_leave_margin
from contactlaw.world.near.passing import follow, may_follow, part
from contactlaw.world.readout import doubts_of
from contactlaw.world.shapes.geometry import meet
from contactlaw.world.sleep import is_at_rest
from contactlaw.world.step import FIND_PRESSED, GROWING_ROOM, begin_pairs

FALLS, TURNS = 2.0, 0.5  # of the fall and of the turn in a step: what more or less than due is free flight, too
UNDOING = 20  # iterations for the spin before a step of Bullet; each reduces the error by the turn in that step


def begin_step(block):
    """Begin a step: read bodies and select those to be pushed; return how many.

    Other results: PASSED: no two bodies can touch in this step, and there is no more to do but `has_flown` after
    Bullet's step. PLACED: the user has moved bodies. NOT_FINITE. A second call does the same again.
    """
    head = rows.head_at(block, 0)
    w = world_at(head.world, 0)
    found = read_bodies(head, w)
    if found != 0:
        return found
    if head.simple != 0 and has_contacts(w):
        begin_pairs(w)  # those that parted in the last step
    if head.simple == 0 or has_contacts(w) or w.step != head.dt or not all_pass(head, w):
        return select_pushed(block)
    for k in range(head.singles):
        r = rows.row_at(head.rows, k)
        r.left = r.before
    return rows.PASSED


def read_bodies(head, w):
    """Give the world's bodies the poses and velocities that were read; return 0, NOT_FINITE or PLACED.

    PLACED: the user has moved those selected.
    """
    head.refreshed, head.selected_count = 0, 0
    for k in range(head.singles):
        r, b = rows.row_at(head.rows, k), body_at(w.bodies, k + 1)
        r.before = rows.motion_at(head.motions, k)
        if not rows.finite(r.before):
            head.bad = k
            return rows.NOT_FINITE
        store(b.acceleration, load(head.gravity) if r.mass > 0.0 else (0.0, 0.0, 0.0))
        store(b.torque, (0.0, 0.0, 0.0))
        r.placed = 0
        as_left = w.step > 0.0 and load(r.before.velocity) == load(r.left.velocity)
        r.lag = w.step if as_left else head.dt
        if rows.same_motion(r.before, r.left):
            if b.asleep == 0 and (r.mass > 0.0 or not motion.is_static(b)):
                rows.set_body(r, b)
            continue
        x, v = load(r.before.position), load(r.before.velocity)
        if r.mass == 0.0 and dot(v, v) + dot(load(r.before.spin), load(r.before.spin)) == 0.0:
            # nothing pushes it, and it has no velocity in PyBullet: it moves to where the user has put it
            store(b.position, load(r.left.position))
            store4(b.quaternion, rows.quaternion_of(r.left))
            motion.move_kinematic(w, b, x, rows.quaternion_of(r.before), head.dt)
            b.pressed, r.placed = 0, b.placed
        else:
            r.placed = 0 if r.mass == 0.0 or norm(sub(x, load(r.left.position))) <= rows.EXACT * norm(x) else 1
            b.pressed = 0 if r.mass == 0.0 else max(b.pressed, r.placed)  # `find_pressed` needs its true velocity
            rows.set_body(r, b)
        if r.placed != 0:
            rows.select(head, k)
    return rows.PLACED if head.selected_count > 0 else 0


def all_pass(head, w):
    """Return whether no two bodies can touch in this step, even if they stray (`stray_speed`).

    Those that tumble, or have been moved by more than slight forces, may. Lists near pairs anew if need be.
    """
    for k in range(head.singles):
        b = body_at(w.bodies, k + 1)
        b.still = 1 if motion.is_static(b) else 0
        if b.still == 0 and (rows.row_at(head.rows, k).forced > 0 or rows.tumbles(b, head.dt)):
            return False
        w.stale |= may_leave_margin(b, head.dt, stray_speed(b, head.dt))
    if any_guard_exceeded(w, -NEVER, 2.0 * head.dt) or w.stale != 0:
        list_near(w)
        w.stale = 0 if 2 * w.nears <= w.near_room else 1
        if w.stale != 0:
            return False
    for k in range(w.nears):
        p = near_at(w.near, k)
        a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
        overlap, n, _, _ = meet(shape_at(w.shapes, p.a), a, shape_at(w.shapes, p.b), b)
        _, _, mean = closing_along(a, b, to_body(b.axes, n), head.dt)
        if head.dt * (mean + stray_speed(a, head.dt) + stray_speed(b, head.dt)) >= -overlap:
            return False
    return True


def stray_speed(b, dt):
    """Return the mean speed [m/s] by which a body's points may leave its free flight in a step for `has_flown`."""
    return 0.0 if b.still != 0 else FALLS * dt * norm(load(b.acceleration)) + TURNS * norm(load(b.spin)) * b.reach


def has_flown(block):
    """After a step in which no two bodies could touch in free flight, and reading of poses: return how it went.

    PASSED: nor can they in the next step, which needs no `begin_step`. STRAYED: a body has not flown freely from where
    it was left. 0: neither. Free flight includes FALLS and TURNS, see `stray_speed`. Velocities follow from the poses.
    """
    head = rows.head_at(block, 0)
    w, dt = world_at(head.world, 0), head.dt
    fall = scale(dt * dt, load(head.gravity))
    for k in range(head.moving):
        r, b, pose = rows.row_at(head.rows, k), body_at(w.bodies, k + 1), rows.pose_at(head.poses, k)
        x, way, turn = load(pose.position), scale(dt, load(r.left.velocity)), scale(dt, load(r.left.spin))
        gone = sub(x, load(r.left.position))
        if not norm(sub(gone, add(way, fall))) <= FALLS * norm(fall) + rows.EXACT * (norm(x) + norm(way)):
            return rows.STRAYED
        store(r.before.position, x)
        store4(r.before.quaternion, load4(pose.quaternion))
        store(r.before.velocity, scale(1.0 / dt, gone))
        if b.oriented != 0:
            twist = rotation_vector(product(rows.quaternion_of(r.before), conjugate(rows.quaternion_of(r.left))))
            if not norm(sub(twist, turn)) <= TURNS * norm(turn) + rows.EXACT:
                return rows.STRAYED
            store(r.before.spin, scale(1.0 / dt, twist))
            b.turned += norm(twist)
    for k in range(head.moving):
        r = rows.row_at(head.rows, k)
        rows.set_body(r, body_at(w.bodies, k + 1))
        r.left = r.before
    return rows.PASSED if all_pass(head, w) else 0


def rewind(block):
    """After STRAYED, and reading of all bodies: set the readings of those that Bullet moves back to before its step.

    Where they were left, if the velocities after the step lead from there to the poses after it; else the user has put
    them elsewhere, and Bullet's step is undone. What changed a velocity counts as if it had done so before the step.
    """
    head = rows.head_at(block, 0)
    w = world_at(head.world, 0)
    for k in range(head.moving):
        m, old = rows.motion_at(head.motions, k), rows.row_at(head.rows, k).left
        x, way = load(m.position), scale(head.dt, load(m.velocity))
        start = sub(x, way)
        moved = norm(sub(start, load(old.position))) > rows.EXACT * (norm(x) + norm(way))
        store(m.position, start if moved else load(old.position))
        v, known = axpy(-head.dt, load(head.gravity), load(m.velocity)), load(old.velocity)
        if norm(sub(v, known)) > rows.EXACT * (norm(v) + norm(known)):
            known, rows.row_at(head.rows, k).forced = v, 2  # maybe by a force, as the next step tells
        store(m.velocity, known)
        turn = product(rows.turn_in(head.dt, scale(-1.0, load(m.spin))), rows.quaternion_of(m))
        if norm(rotation_vector(product(turn, conjugate(rows.quaternion_of(old))))) <= rows.EXACT:
            turn = rows.quaternion_of(old)
        rows.store_turn(m, turn)
        b, spin = body_at(w.bodies, k + 1), load(m.spin)
        store4(b.quaternion, turn)
        set_axes(b)
        store(b.torque, (0.0, 0.0, 0.0))
        if b.isotropic == 0 and head.dt * norm(spin) < rows.MOST_TURN:
            for _ in range(UNDOING):
                store(m.spin, axpy(-head.dt, spin_rate(b, load(m.spin)), spin))


def list_placed(block):
    """List near pairs where the user has put bodies, in a step of no length; return whether there was room for it."""
    w = world_at(rows.head_at(block, 0).world, 0)
    w.stale, w.together = 1, 1
    for i in range(w.body_count):
        body_at(w.bodies, i).held[0] = nan  # what sleeps must check again whether what holds it is still there
    return ready(w, STEP) and call_step(address(w, STEP), w, 0.0, GROWING_ROOM)


def find_pressed(block):
    """Find which bodies are pressed where the user has put bodies: these have their true velocities in PyBullet.

    For all others that remains as they were written. Returns as `select_pushed`.
    """
    head = rows.head_at(block, 0)
    w = world_at(head.world, 0)
    for i in range(w.body_count):
        b = body_at(w.bodies, i)
        b.pressing = b.pressed  # that place is free between steps
        if 0 < i <= head.singles:
            b.placed = rows.row_at(head.rows, i - 1).placed
    call_step(address(w, STEP), w, head.dt, FIND_PRESSED)
    for i in range(w.body_count):
        b = body_at(w.bodies, i)
        if b.placed == 0:
            b.pressed = b.pressing
        elif b.tree == 0:
            rows.set_body(rows.row_at(head.rows, i - 1), b)
    return select_pushed(block)


def select_pushed(block):
    """Select the bodies to be pushed with the force of the contacts in the last step; return how many.

    Not by an impact that began in it: with its push Bullet would pass its greatest speed, and cut that of the body.
    """
    head = rows.head_at(block, 0)
    w, head.selected_count = world_at(head.world, 0), 0
    for k in range(head.moving):
        r = rows.row_at(head.rows, k)
        if body_at(w.bodies, k + 1).pressed == 0 or r.was_pressed == 0 or r.placed != 0:
            store(r.force, (0.0, 0.0, 0.0))
            store(r.torque, (0.0, 0.0, 0.0))
        else:
            rows.select(head, k)
    return head.selected_count


def read_accelerations(head, w):
    """After Bullet's step: find the accelerations that it gave to bodies besides the push of the contacts.

    Where that is gravity alone, it is set to gravity, to the bit. Selects bodies that were pushed and had others.
    Returns whether all are finite.
    """
    head.selected_count, dt, gravity = 0, head.dt, load(head.gravity)
    for k in range(head.moving):
        r, b = rows.row_at(head.rows, k), body_at(w.bodies, k + 1)
        r.disturbed = 0
        read = rows.twist_at(head.velocities, k)
        store(r.after.velocity, load(read.velocity))
        store(r.after.spin, load(read.spin))
        v, old = load(r.after.velocity), load(r.before.velocity)
        u, older = load(r.after.spin), load(r.before.spin)
        if not isfinite(dot(v, v) + dot(u, u)):
            head.bad = k
            return False
        rows.fly(r, dt)
        gained = sub(sub(v, old), scale(dt, axpy(1.0 / r.mass, load(r.force), gravity)))
        speeds = norm(v) + norm(old) + dt * (norm(gravity) + norm(load(r.force)) / r.mass)
        store(b.acceleration, gravity)
        turning = motion.spin_change(b, sub(load(r.torque), motion.gyroscopic(b, older)))
        twist = sub(sub(u, older), scale(dt, turning))
        spins = norm(u) + norm(older) + dt * norm(turning) + norm(motion.spin_change(b, load(r.torque))) * dt
        store(b.torque, (0.0, 0.0, 0.0))
        no_force, no_torque = norm(gained) <= rows.EXACT * speeds, norm(twist) <= rows.EXACT * spins
        if no_force and no_torque:
            continue
        r.disturbed = 1
        if b.pressed != 0:
            rows.select(head, k)
        if not no_force:
            store(b.acceleration, axpy(1.0 / dt, gained, gravity))
        if not no_torque:
            store(b.torque, rows.torque_for(r, b, scale(1.0 / dt, twist)))
        rows.set_body(r, b)
    return True


def finish_step(block):
    """After Bullet's step: take that of the world and select the bodies to be written; return as `write_bodies`.

    Other results: ASLEEP: all bodies go on sleeping, and nothing else. NOT_FINITE. NO_ROOM: the world may need more
    room. PUSHED_OTHERWISE: masses must be read of the selected, which were pushed and moved by something else too.
    """
    head = rows.head_at(block, 0)
    w = world_at(head.world, 0)
    if not read_accelerations(head, w):
        return rows.NOT_FINITE
    if head.selected_count > 0 and head.refreshed == 0:
        head.refreshed = 1
        return rows.PUSHED_OTHERWISE
    if not (ready(w, STEP) and call_step(address(w, STEP), w, head.dt, GROWING_ROOM)):
        return rows.NO_ROOM
    keep_own(head, w)
    end_near(head, w)
    done = write_bodies(head, w)
    return done if done > 0 or not is_at_rest(w) else rows.ASLEEP


def keep_own(head, w):
    """Mark bodies that end the step as in the world as touched: those that Bullet would turn wrong in free flight, or
    move wrong as the step is of another length than the last, and those pushed by contacts that may be no more. Also
    counts the steps of `ROW.forced`.
    """
    gravity = load(head.gravity)
    for k in range(head.moving):
        r, b = rows.row_at(head.rows, k), body_at(w.bodies, k + 1)
        slight = norm(sub(load(b.acceleration), gravity)) <= rows.SLIGHT * norm(gravity)
        r.forced = max(r.forced - 1, 0) if slight else 1
        own = (r.disturbed == 0 and rows.tumbles(b, head.dt)) or (slight and r.lag != head.dt)
        if b.asleep == 0 and (own or b.pressed != 0):
            b.touched = 1


def end_near(head, w):
    """Let free bodies that nothing has touched end the step where Bullet has them, if they touch nothing there."""
    for n in range(w.near_body_count):
        i = whole_at(w.near_bodies, n)
        if may_follow(body_at(w.bodies, i)):
            m = rows.row_at(head.rows, i - 1).after
            follow(w, i, load(m.position), rows.quaternion_of(m))
    part(w)


def write_bodies(head, w):
    """After the world's step: select the bodies that were touched, which Python puts where they are `left`.

    Returns FLAGS times the number of bodies plus the bits of `check_contacts`.
    """
    head.selected_count = 0
    flags = check_contacts(head, w)
    for k in range(head.singles):
        r, b = rows.row_at(head.rows, k), body_at(w.bodies, k + 1)
        if b.touched != 0 and r.mass > 0.0:
            write_touched(head, k, r, b)
        elif b.asleep != 0 or r.mass == 0.0:
            if r.placed == PUT:  # should it go on like this, it moves
                x, turn = load(r.left.position), rows.quaternion_of(r.left)
                motion.lead(b, x, turn, load(b.position), load4(b.quaternion), head.dt)
            r.left = r.before
            if r.mass > 0.0 and not rows.same_motion(r.after, r.before):
                rows.select(head, k)
        else:
            r.left = r.after
        if b.asleep != 0:  # the contacts carry what accelerates it
            store(r.force, scale(-r.mass, load(b.acceleration)))
            store(r.torque, scale(-1.0, load(b.torque)))
    return rows.FLAGS * head.selected_count + flags


def check_contacts(head, w):
    """Find which bodies have closed contacts; return the bits NOTED (something to report) and LISTED."""
    flags = 0 if w.lists == head.lists else rows.LISTED
    head.lists = w.lists
    for k in range(head.singles):
        rows.row_at(head.rows, k).was_pressed = body_at(w.bodies, k + 1).pressed
    for i in range(w.body_count):
        body_at(w.bodies, i).pressed = 0
    for slot in range(w.slots):
        c = contact_at(w.contacts, slot)
        if c.phase == FREE:
            continue
        bits = doubts_of(w, c)
        flags |= rows.NOTED if bits & ~c.noted != 0 else 0
        c.noted |= bits
        if c.phase == CLOSED:
            body_at(w.bodies, c.body_a).pressed = 1
            body_at(w.bodies, c.body_b).pressed = 1
    return flags


def write_touched(head, k, r, b):
    """Write the result of the step for a body that was touched."""
    dt, m = head.dt, r.before
    lag = 0.0 if b.pressed != 0 else -0.5 * dt
    a, moment = load(b.acceleration), load(b.torque)
    motion.note_usual(b, load(head.gravity), r.usual, r.wrench, r.was_pressed != 0 and b.pressed == 0)
    v, spin = axpy(lag, load(b.acceleration), load(b.velocity)), motion.spin_after(b, load(b.spin), lag)
    store(b.torque, moment)
    gained = sub(scale(1.0 / dt, sub(v, load(m.velocity))), a)
    store(r.force, scale(r.mass, gained))
    rate = sub(scale(1.0 / dt, sub(spin, load(m.spin))), spin_rate(b, load(m.spin)))
    store(r.torque, rows.torque_for(r, b, rate))
    rows.select(head, k)
    store(r.left.position, load(b.position))
    rows.store_turn(r.left, load4(b.quaternion))
    store(r.left.velocity, v)
    store(r.left.spin, spin)


jit_module(__name__)
