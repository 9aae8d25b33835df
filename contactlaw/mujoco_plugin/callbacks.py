"""The compiled callbacks that MuJoCo calls in every step; no Python runs here.

`compute`, which MuJoCo may call several times a step, adds the force with which contacts pressed at the end of the last
step, so that joint limits, equalities and the engine's own contacts respond to it. It saves the state that the engine
steps from, and changes nothing else that lasts. `advance`, called once after the engine's step, reads bodies at the
saved state (hook read), with the accelerations of the engine's step less that force, takes the same step of the world,
and writes coordinates and velocities of all bodies that contacts have touched, or that cannot be where the engine has
them, see `near` (hook apply). Hooks load and store are `load_state` and `store_state`.
"""

import numpy as np
from numba import types  # pyright: ignore[reportPrivateImportUsage]

from contactlaw.jit import address_of, jit_module
from contactlaw.memory import copy_wholes, doubles_at, same_wholes, whole_at
from contactlaw.mujoco_plugin import free, layout, notices
from contactlaw.mujoco_plugin.block import PUSH, STARTS, checksums, floats, free_at, head_at, last_state, shifted
from contactlaw.mujoco_plugin.layout import data_at, model_at
from contactlaw.mujoco_plugin.notices import is_edited, report_contacts, report_once, send_report
from contactlaw.mujoco_plugin.sensors import call_sense
from contactlaw.mujoco_plugin.trees import FIND, MOVE, READ, WRITE, call_press, call_trees
from contactlaw.world.contacts.touch import has_contacts, nears_in_use
from contactlaw.world.data.access import body_at, contact_at, near_at, world_at
from contactlaw.world.data.call import address, call_read, call_step, ready
from contactlaw.world.data.checksum import as_float, mix
from contactlaw.world.data.demand import READ as READ_STATE
from contactlaw.world.data.demand import STEP
from contactlaw.world.data.records import AGED, CERTAIN, FRESH, LATE, RESIZED, UNLISTED, WIDE
from contactlaw.world.data.vec import cross, load, scale, store
from contactlaw.world.near.passing import follow, may_follow, part
from contactlaw.world.sleep import is_at_rest
from contactlaw.world.state import forget_motion, unused_span, write
from contactlaw.world.step import FIND_PRESSED, FIXED_ROOM
from contactlaw.world.trees.mobility import clear

LARGEST = 1e100  # [N], forces beyond are not applied: the engine's results would not be finite
STRUCK, EDITED, MOVED, CALM, ASLEEP, REPEATED = -2, -1, 0, 1, 2, 3  # how a step went, see `move_world` and `step_world`

free_memory = types.ExternalFunction("PyMem_RawFree", types.void(types.uintp))


def block_address(d, instance):
    """Return the address of the block of an instance."""
    return types.uintp(whole_at(data_at(d, 0).plugin_data, instance))


def move_world(head, w, state, again):
    """Take the step of the world; again: after STRUCK.

    Returns ASLEEP if all bodies go on sleeping; EDITED, before any step, if the model of a calm world has been edited;
    STRUCK, if the step must be taken again, as something has been thrown at a tree that had passed by everything.
    """
    w.brief = 1 if w.age == FRESH else 0  # something was going on: if pairs must be listed, then as for what goes on
    m, w.step, w.age = model_at(head.model, 0), head.step_size, 0
    head.lag = 0.5 * m.opt.timestep if head.start == last_state(head) else 0.0  # by Runge-Kutta there is no lag
    store(head.gravity, (0.0, 0.0, 0.0) if m.opt.disableflags & layout.NO_GRAVITY else load(m.opt.gravity))
    known, start = w.stale != 0, head.start
    known = known and checksums(head).left == end_checksum(head, shifted(start, 1), shifted(start, 1 + head.nq))
    head.known = 1 if known else 0
    for i in range(head.free_count):
        free.read_free(head, free_at(head.frees, i))
    for i in range(head.mocap_count):
        free.read_mocap(head, i, shifted(state.ctypes.data, PUSH + 2 * head.nv))
    run_trees(head, FIND)
    new = w.stale != 0 and w.brief == 1
    if head.tree_count == 0 and head.mocap_count == 0 and is_at_rest(w):
        for i in range(head.free_count):
            free.write_free(head, free_at(head.frees, i), state[PUSH + head.nv :])
        copy_wholes(data_at(head.data, 0).qacc, shifted(head.left, 1 + head.nq + head.nv), head.nv)
        return ASLEEP
    if head.calm != 0 and is_edited(head):
        return EDITED
    find_moves(head, w)
    if w.denied != 0:  # whether a tree passes must not depend on when, or how widely, pairs were listed
        if not new and w.denied == CERTAIN:
            w.stale, w.brief = 1, 1
        elif not new:
            find_moves_anew(head, w, 1)
        w.age = FRESH if w.age == AGED else w.age
    if w.denied == UNLISTED:
        find_moves_anew(head, w, WIDE)
        w.stale, w.brief = 1, 1  # such a list is long
    idle = not has_contacts(w) and checksums(head).left == 0.0  # nor at the end of the last step, which has stored it
    if run_trees(head, READ) and head.free_count + head.mocap_count == 0 and idle:
        return MOVED
    for i in range(head.free_count):
        free.lead_free(head, free_at(head.frees, i))
    call_step(address(w, STEP), w, head.step_size, FIXED_ROOM)
    if w.denied == LATE and not again and ready(w, READ_STATE):
        return STRUCK
    end_near(head, w)
    call_step(address(w, STEP), w, head.step_size, FIND_PRESSED)
    for i in range(head.free_count):
        free.write_free(head, free_at(head.frees, i), state[PUSH + head.nv :])
    run_trees(head, WRITE)
    report_contacts(head, w)
    store_state(head, w, state)
    if is_clear(head, w):
        free.set_clearances(head, w)
    return MOVED


def find_moves(head, w):
    """Find what presses at the start of the step, and which trees pass by everything in it."""
    call_step(address(w, STEP), w, head.step_size, FIND_PRESSED)
    run_trees(head, MOVE)


def find_moves_anew(head, w, brief):
    """Find this with a new list of near pairs; brief: see `WORLD.brief`."""
    w.stale, w.brief = 1, brief
    run_trees(head, FIND)
    find_moves(head, w)


def step_world(head):
    """Bring the world to the state of mjData and take its step.

    But not if all bodies stay clear of each other (CALM), or sleep on as in the step before (REPEATED).
    """
    w, m = world_at(head.world, 0), model_at(head.model, 0)
    head.start, head.step_size = last_state(head), m.opt.timestep
    # under Runge-Kutta three further calls of `compute` follow that at the start of the step; but a step in two halves
    # (mj_step1, mj_step2) is one of Euler, with a single call
    if doubles_at(head.start)[0] + m.opt.timestep != data_at(head.data, 0).time:
        head.start = last_state(head, STARTS - 1)
    if head.calm == ASLEEP and sleeps_on(head):
        for i in range(head.free_count):
            free.hold_free(head, free_at(head.frees, i))
        return REPEATED
    state = load_state(head)
    clear = w.stale == 0 and is_clear(head, w)
    for i in range(head.free_count if clear else 0):
        clear = clear and free.stays_clear(head, free_at(head.frees, i))
    if clear:
        return CALM
    edited = w.edited
    done = move_world(head, w, state, False)
    if done == STRUCK:
        read_state(w, state[head.row :])
        w.edited = edited
        done = move_world(head, w, state, True)
    return done


def sleeps_on(head):
    """Return whether a step in which all slept is repeated: from the same state with the same accelerations."""
    d, q_and_v = data_at(head.data, 0), head.nq + head.nv
    same = same_wholes(d.qacc, shifted(head.left, 1 + q_and_v), head.nv)
    same = same and same_wholes(shifted(head.start, 1), shifted(head.left, 1), q_and_v)
    return same and checksums(head).token == head.token


def goes_on(head):
    """Return whether the last step was calm or all slept in it, and the state that it left is there."""
    return head.calm != MOVED and checksums(head).token == head.token


def run_trees(head, stage):
    """Take the trees through a stage of the step, see `trees.serve`; False if there are none."""
    return head.tree_count > 0 and call_trees(head.tree_stage, head.address, stage)


def end_near(head, w):
    """Let what nothing has touched end the step where the engine has it: free bodies if they touch nothing there.

    Trees that may have touched something end where the world has them, and so does what the engine's step has pushed by
    contacts that are no more: the user has moved a body away from them.
    """
    for i in range(head.free_count):
        f = free_at(head.frees, i)
        for k in range(6):
            if doubles_at(head.given)[f.v + k] != 0.0:
                body_at(w.bodies, f.body).touched = 1
    for k in range(w.nears):
        p = near_at(w.near, k)
        for i in (p.body_a, p.body_b):
            b = body_at(w.bodies, i)
            if b.tree != 0 and b.done == 0:
                b.touched = 1
            if may_follow(b):
                position, turn = free.pose_in(free_at(head.frees, i - 1), data_at(head.data, 0).qpos)
                follow(w, i, position, turn)
    part(w)


def save_state(head, state):
    """Save time, coordinates and velocities of mjData at an address."""
    d, q, v = data_at(head.data, 0), head.nq, head.nv
    floats(state, 0, 1)[0] = d.time
    copy_wholes(d.qpos, shifted(state, 1), q)
    copy_wholes(d.qvel, shifted(state, 1 + q), v)


def load_state(head):
    """Return the law's part of plugin_state, after the world has been brought to it."""
    state = floats(data_at(head.data, 0).plugin_state, head.state, head.size)
    if checksums(head).token != head.token:
        load_world(head, world_at(head.world, 0), state)
    return state


def load_world(head, w, state):
    """Bring the world to a state that its own last step has not left; without contacts if the checksum is wrong."""
    known, dropped = checksums(head), 0
    sound = known.token == token_of(head, state, state.size, state.size)
    if not sound:
        clear(state)
    if ready(w, READ_STATE):
        dropped = read_state(w, state[head.row :])
        head.token = known.token
        if head.token != 0.0 and known.content != 0.0:  # RESIZED: any number of the model may be another one
            w.edited = 0 if known.content == as_float(types.uint64(head.content)) else RESIZED
    if head.token == 0.0:  # after a reset all bodies count as moved by the user: initial overlaps must be found
        left = floats(head.left, 1, head.nq)
        for i in range(head.nq):
            left[i] = np.nan
    if not sound or (dropped > 0 and w.edited < RESIZED):
        report_once(head, notices.DAMAGED, float(dropped))


def read_state(w, row):
    """Bring the world to the state in a row; return how many contacts were left out."""
    forget_motion(w)
    return call_read(address(w, READ_STATE), w, row.ctypes.data, row.size)


def is_clear(head, w):
    """Return whether there are only free bodies, no contact is in use, and no two shapes have a guard."""
    return w.guard_count + head.tree_count + head.mocap_count == 0 and not has_contacts(w)


def store_state(head, w, state):
    """Write the force of the contacts and the state of the world to plugin_state."""
    push = state[PUSH : PUSH + head.nv]
    clear(push)
    for k in range(nears_in_use(w)):
        p = near_at(w.near, k)
        if p.closed != 0:
            c = contact_at(w.contacts, p.slot)
            force = scale(free.mean_share(c, head.step_size), load(c.force))
            add_force(head, p.body_a, load(c.arm_a), force, push)
            add_force(head, p.body_b, load(c.arm_b), scale(-1.0, force), push)
    for i in range(head.mocap_count):
        free.keep_mocap(head, i, shifted(state.ctypes.data, PUSH + 2 * head.nv))
    for i in range(head.free_count):
        free.turn_moment(head, free_at(head.frees, i), push)
    d, known, in_touch = data_at(head.data, 0), checksums(head), has_contacts(w)
    known.left = end_checksum(head, d.qpos, d.qvel) if in_touch else 0.0
    known.content = as_float(types.uint64(head.content)) if in_touch else 0.0
    lost = write(w, state[head.row :])
    if lost > 0:
        report_once(head, notices.UNSAVED, float(lost))
    first, last = unused_span(w, state[head.row :])
    known.token = head.token = token_of(head, state, head.row + first, head.row + last)


def add_force(head, body, arm, force, push_io):
    """Add a force on a body of the world [N], at an arm [m] from its centre of mass, to the generalised force.

    Of a free body the moment is left about its centre of mass, in the world frame, see `free.turn_moment`.
    """
    b = body_at(world_at(head.world, 0).bodies, body)
    if 0 < body <= head.free_count:
        f, moment = free_at(head.frees, body - 1), cross(arm, force)
        for i in range(3):
            push_io[f.v + i] += force[i]
            push_io[f.v + 3 + i] += moment[i]
    elif b.tree != 0:
        call_press(head.tree_force, head.address, b, arm, force, push_io.ctypes.data)


def token_of(head, state, first, last):
    """Return a checksum of a state of this model, zero if all is zero; between `first` and `last` the state is zero."""
    mixed = mix(state.ctypes.data, 1, first, 0) + mix(state.ctypes.data, last, state.size, 0)
    return as_float(mixed + types.uint64(head.signature)) if mixed != types.uint64(0) else 0.0


def end_checksum(head, q, v):
    """Return a checksum of coordinates and velocities, at two addresses, and of what the law reads of the model."""
    return as_float(mix(q, 0, head.nq, 0) + mix(v, 0, head.nv, head.nq) + types.uint64(head.content))


def head_of(m, d, instance):
    """Return the head of the block of the leading instance, and note in it the model and mjData of this call."""
    head = head_at(block_address(d, instance), 0)
    head.model, head.data = m, d
    return head


def is_active(m, d, instance):
    """Return whether an instance leads and contacts are enabled."""
    leads = block_address(d, instance) != types.uintp(0)
    return leads and model_at(m, 0).opt.disableflags & layout.NO_CONTACT == 0


def compute(m, d, instance, capability):
    """Save the state and add the force of the contacts; or, for sensors, evaluate those of the law."""
    if not is_active(m, d, instance):
        return
    head = head_of(m, d, instance)
    if capability == layout.SENSOR:
        if head.sense != 0:
            load_state(head)
            call_sense(head.sense, head.address, 0)
        return
    if (head.newest == 0 or not goes_on(head)) and is_edited(head):
        send_report(head, notices.EDITED, 0.0)
        head = head_of(m, d, instance)
    head.newest = (head.newest + 1) % STARTS
    save_state(head, last_state(head))
    d = data_at(head.data, 0)
    state, given = floats(d.plugin_state, head.state, head.size), floats(head.given, 0, head.nv)
    known = goes_on(head)  # `given` is what it was in the last step
    for i in range(0 if known else head.nv):
        given[i] = state[PUSH + i] if abs(state[PUSH + i]) < LARGEST else 0.0
    passive = floats(d.qfrc_passive, 0, head.nv)
    for i in range(0 if known and not has_contacts(world_at(head.world, 0)) else head.nv):  # else it is zero
        passive[i] += given[i]


def advance(m, d, instance):
    """After the engine's step: take that of the world and write the bodies that were touched."""
    if not is_active(m, d, instance):
        return
    head, opt = head_of(m, d, instance), model_at(m, 0).opt
    if opt.enableflags & layout.SLEEP:
        opt.enableflags &= ~layout.SLEEP  # the engine then wakes all at the start of its next step
        report_once(head, notices.SLEEPS, 0.0)
    if opt.disableflags & layout.NO_PASSIVE == layout.NO_PASSIVE:  # MuJoCo has not called `compute`
        report_once(head, notices.SWITCHED_OFF, 0.0)
        return
    done = step_world(head)
    if done == EDITED:
        send_report(head, notices.EDITED, 0.0)
        head = head_of(m, d, instance)
        done = step_world(head)
    if done != REPEATED:
        head.calm = max(done, MOVED)
        save_state(head, head.left)
    if head.sense != 0:
        call_sense(head.sense, head.address, 1)


def reset(m, state, block, instance):
    """Clear the state and all contacts, so that what follows is as in a new `MjData`."""
    if block != types.uintp(0):
        head = head_at(block, 0)
        head.calm = MOVED
        clear(floats(state, 0, head.size))
        forget_motion(world_at(head.world, 0))


def look(m, d, instance):
    """Bring the world to the state of mjData, for a readout from Python."""
    load_state(head_of(m, d, instance))


def destroy(d, instance):
    """Free the block of an instance."""
    free_memory(block_address(d, instance))


jit_module(__name__)

ADDRESSES = {
    one.__name__: address_of(one, types.void(*[types.uintp] * pointers, *[types.int32] * numbers), layout.KEY)
    for one, pointers, numbers in ((compute, 2, 2), (advance, 2, 1), (reset, 3, 1), (look, 2, 1), (destroy, 1, 1))
}
"""Of the functions that MuJoCo calls, and of `look`."""
