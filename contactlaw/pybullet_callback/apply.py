"""Hook "apply", compiled: the step of the world, and its results for the bodies that contacts have touched."""

from contactlaw.jit import jit_module
from contactlaw.pybullet_callback import rows
from contactlaw.pybullet_callback.read import read_accelerations
from contactlaw.world.bodies.motion import set_axes, spin_after, spin_rate
from contactlaw.world.data.access import body_at, contact_at, near_at, world_at
from contactlaw.world.data.call import address, call_step, ready
from contactlaw.world.data.demand import STEP
from contactlaw.world.data.quaternion import load4, store4
from contactlaw.world.data.records import CLOSED, FREE
from contactlaw.world.data.vec import add, axpy, load, scale, share_of, store, sub
from contactlaw.world.near.following import follow, may_follow, part
from contactlaw.world.readout import doubts_of
from contactlaw.world.sleep import is_at_rest
from contactlaw.world.step import GROWING_ROOM


def finish_step(block):
    """After Bullet's step: take that of the world and select the bodies to be written; return as `write_bodies`.

    Other results: ASLEEP: all bodies go on sleeping, and nothing else. NOT_FINITE. NO_ROOM: the world may need more
    room. UNKNOWN: time step and gravity must be read.
    OTHERS: these, the poses of bodies that something else moved, and the masses of those of them that were pushed.
    """
    head = rows.head_at(block, 0)
    w = world_at(head.world, 0)
    others = read_accelerations(head, w)
    if others < 0:
        return rows.NOT_FINITE
    if (others > 0 or head.unknown != 0) and head.refreshed == 0:
        head.refreshed = 1
        return rows.OTHERS if others > 0 else rows.UNKNOWN
    if not (ready(w, STEP) and call_step(address(w, STEP), w, head.dt, GROWING_ROOM)):
        return rows.NO_ROOM
    keep_tumbling(head, w)
    end_near(head, w)
    done = write_bodies(head, w)
    return done if done > 0 or not is_at_rest(w) else rows.ASLEEP


def keep_tumbling(head, w):
    """Mark bodies in free flight that Bullet would turn wrong as touched, so that they end it as in the world."""
    for k in range(head.count):
        r, b = rows.row_at(head.rows, k), body_at(w.bodies, k + 1)
        free = r.mass > 0.0 and r.in_tree == 0 and r.disturbed == 0 and b.asleep == 0
        if free and rows.tumbles(b, head.dt):
            b.touched = 1


def end_near(head, w):
    """Let free bodies that nothing has touched end the step where Bullet has them, if they touch nothing there."""
    for k in range(w.nears):
        p = near_at(w.near, k)
        for i in (p.body_a, p.body_b):
            if i > 0 and may_follow(body_at(w.bodies, i)):
                position, turn = rows.flown(rows.row_at(head.rows, i - 1), head.dt)
                follow(w, i, position, turn)
    part(w)


def write_bodies(head, w):
    """After the world's step: select the bodies that were touched, which Python puts where they are `left`.

    Returns FLAGS times the number of bodies plus the bits of `check_contacts`.
    """
    head.selected_count = 0
    flags = check_contacts(head, w)
    for k in range(head.count):
        r, b = rows.row_at(head.rows, k), body_at(w.bodies, k + 1)
        if r.in_tree != 0:
            continue
        if b.touched != 0 and r.mass > 0.0:
            write_touched(head, k, r, b)
        elif b.asleep != 0 or r.mass == 0.0:
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
    for k in range(head.count):
        r = rows.row_at(head.rows, k)
        r.was_pressed, r.pressed = r.pressed, 0
    for slot in range(w.contact_room):
        c = contact_at(w.contacts, slot)
        if c.phase == FREE:
            continue
        bits = doubts_of(w, c)
        flags |= rows.NOTED if bits & ~c.noted != 0 else 0
        c.noted |= bits
        if c.phase == CLOSED:
            rows.row_at(head.rows, c.body_a - 1).pressed = 1
            rows.row_at(head.rows, c.body_b - 1).pressed = 1
    return flags


def write_touched(head, k, r, b):
    """Write the result of the step for a body that was touched."""
    dt, m, turned = head.dt, r.before, load4(b.quaternion)
    lag = 0.0 if r.pressed != 0 else -0.5 * dt
    a, moment = load(b.acceleration), load(b.torque)
    push = sub(a, load(head.gravity))
    if r.was_pressed != 0 and r.pressed == 0:
        store(b.acceleration, add(load(head.gravity), share_of(load(r.usual), push)))
        store(b.torque, share_of(load(r.wrench), moment))
    store(r.usual, push)
    store(r.wrench, moment)
    v, spin = axpy(lag, load(b.acceleration), load(b.velocity)), spin_after(b, load(b.spin), lag)
    store(b.torque, moment)
    gained = sub(scale(1.0 / dt, sub(v, load(m.velocity))), a)
    store(r.force, scale(r.mass, gained))
    # the torque for the axes at the start of the step, as Bullet uses the inertia there
    store4(b.quaternion, rows.quaternion_of(m))
    set_axes(b)
    rate = sub(scale(1.0 / dt, sub(spin, load(m.spin))), spin_rate(b, load(m.spin)))
    store(r.torque, rows.torque_for(r, b, rate))
    store4(b.quaternion, turned)
    set_axes(b)
    rows.select(head, k)
    store(r.left.position, load(b.position))
    q = r.left.quaternion
    q[3], q[0], q[1], q[2] = turned
    store(r.left.velocity, v)
    store(r.left.spin, spin)


jit_module(__name__)
