"""The compiled callbacks: what MuJoCo calls in every step. No Python runs here.

`compute`, which MuJoCo asks for forces as often as it likes, changes nothing that lasts: it gives the force that the
contacts pressed with at the end of the last step, so that joint limits, equalities and the engine's own contacts feel
it, and notes the state. `advance`, called once when the engine has taken its step, moves the world from the noted state
through the step, with the accelerations that the engine had but for that force, and writes coordinates and velocities
of all that was touched.
"""

from __future__ import annotations

import numpy as np
from numba import types  # pyright: ignore[reportPrivateImportUsage]

from contactlaw.jit import c_callback
from contactlaw.memory import whole_at
from contactlaw.mujoco_plugin import layout, notices
from contactlaw.mujoco_plugin.block import LED, LEFT, PUSH, STARTS, TOKEN, floats, free_at, head_at, place, placed_at
from contactlaw.mujoco_plugin.free import is_far, lead_free, mean_share, press_free, read_free, same_as_left, write_free
from contactlaw.mujoco_plugin.jointed import FIND, READ, WRITE, call_press, call_trees
from contactlaw.mujoco_plugin.layout import data_at, jit, model_at
from contactlaw.mujoco_plugin.notices import edited, look_over, notice, tell_of
from contactlaw.mujoco_plugin.sensors import call_sense
from contactlaw.world.bodies.prescribed import move_kinematic
from contactlaw.world.data.access import body_at, contact_at, near_at, world_at
from contactlaw.world.data.call import address, call_read, call_step, ready
from contactlaw.world.data.checksum import as_float, mix
from contactlaw.world.data.demand import READ as READ_STATE
from contactlaw.world.data.demand import STEP
from contactlaw.world.data.records import RESIZED
from contactlaw.world.data.vec import load, load4, scale, store, store4
from contactlaw.world.sleep import lies
from contactlaw.world.state import forget_motion, unused_span, write
from contactlaw.world.step import FIND_PRESSED, FIXED_ROOM
from contactlaw.world.trees.mobility import clear, copy

LARGEST = 1e100  # [N], a force that can be computed with
CHANGED, MOVED, CALM, LYING = -1, 0, 1, 2  # how a step went, see `move`

free_memory = types.ExternalFunction("PyMem_RawFree", types.void(types.uintp))


@jit
def block_of(d, instance):
    """Address of the block of an instance."""
    return types.uintp(whole_at(data_at(d, 0).plugin_data, instance))


@jit
def move(head, w, state):
    """Take the step of the world; returns LYING where all lies as it did, CHANGED, and takes none, where calm ends and
    the model is another than the world was made of."""
    w.step = head.step_size
    known = head.placed_count == 0 and w.stale != 0
    known = known and state[LEFT] == left_of(head, place(head.start, 1), place(head.start, 1 + head.nq))
    for i in range(head.free_count):
        read_free(head, free_at(head.frees, i), known)
    for i in range(head.placed_count):
        read_placed(head, w, placed_at(head.placed, i), state[PUSH + 2 * head.nv + LED * i :])
    trees(head, FIND)
    if head.tree_count == 0 and head.placed_count == 0 and lies(w):
        for i in range(head.free_count):
            write_free(head, free_at(head.frees, i), state[PUSH + head.nv :])
        copy(floats(data_at(head.data, 0).qacc, 0, head.nv), floats(head.left, 1 + head.nq + head.nv, head.nv))
        return LYING
    if head.calm != 0 and edited(head):
        return CHANGED
    call_step(address(w, STEP), w, head.step_size, FIND_PRESSED)
    if trees(head, READ) and head.free_count + head.placed_count == 0 and head.idle != 0:
        return MOVED
    for i in range(head.free_count):
        lead_free(head, free_at(head.frees, i))
    call_step(address(w, STEP), w, head.step_size, FIXED_ROOM)
    call_step(address(w, STEP), w, head.step_size, FIND_PRESSED)
    if head.lag > 0.0:
        keep_near(w)
    for i in range(head.free_count):
        write_free(head, free_at(head.frees, i), state[PUSH + head.nv :])
    trees(head, WRITE)
    look_over(head, w)
    leave(head, w, state)
    return MOVED


@jit
def go_on(head):
    """The same, if anything is near; CALM where all fly far from each other."""
    w = world_at(head.world, 0)
    find_start(head)
    if head.calm == LYING and lies_on(head):
        pushes = floats(data_at(head.data, 0).plugin_state, head.state + PUSH + head.nv, head.nv)
        for i in range(head.free_count):
            write_free(head, free_at(head.frees, i), pushes)
        return LYING
    state = take(head)
    far = w.nears == 0 and w.guard_count == 0 and w.stale == 0 and all_far(head)
    return CALM if far else move(head, w, state)


@jit
def lies_on(head):
    """Whether a step in which all lay is taken once more: from the same state, with the same accelerations."""
    d, kept, differ = data_at(head.data, 0), place(head.left, 1 + head.nq + head.nv), 0
    for i in range(head.nv):
        differ |= whole_at(d.qacc, i) ^ whole_at(kept, i)
    same = differ == 0 and same_as_left(head, 0, head.nq, 0, head.nv)
    return same and floats(d.plugin_state, head.state, 1)[TOKEN] == head.token


@jit
def trees(head, stage):
    """Take bodies that joints hold through a stage of the step, see `jointed.serve`; False: there are none."""
    return head.tree_count > 0 and call_trees(head.serve, head.own, stage)


@jit
def read_placed(head, w, p, left_io):
    """Let such a body go from where it was left, by the state, to where it has been put; no state: it is there."""
    b, d = body_at(w.bodies, p.body), data_at(head.data, 0)
    place, turn = load(floats(d.xpos, 3 * p.id, 3)), load4(floats(d.xquat, 4 * p.id, 4))
    known = left_io[3] != 0.0 or left_io[4] != 0.0 or left_io[5] != 0.0 or left_io[6] != 0.0
    store(b.position, load(left_io) if known else place)
    store4(b.quaternion, load4(left_io[3:]) if known else turn)
    store(b.velocity, load(left_io[7:]))
    store(b.spin, load(left_io[10:]))
    move_kinematic(w, b, place, turn, head.step_size)
    store(left_io, place)
    store4(left_io[3:], turn)
    store(left_io[7:], load(b.velocity))
    store(left_io[10:], load(b.spin))


@jit
def keep_near(w):
    """Let all trees that are near something be where the world has them.

    In their first-order flight by the engine, which differs, they could end within what they passed by in the world.
    """
    for k in range(w.nears):
        p = near_at(w.near, k)
        for i in (p.body_a, p.body_b):
            b = body_at(w.bodies, i)
            if b.tree != 0 and b.done == 0:
                b.touched = 1


@jit
def find_start(head):
    """What the step began with.

    Runge-Kutta has asked three times more since then, the last time at the step's end; only stepping in two halves
    under it does not, for MuJoCo then takes a step of Euler.
    """
    m, size = model_at(head.model, 0), 1 + head.nq + head.nv
    head.start = place(head.starts, size * head.turn)
    if floats(head.start, 0, 1)[0] + m.opt.timestep != data_at(head.data, 0).time:
        head.start = place(head.starts, size * ((head.turn + 1) % STARTS))
    head.step_size = m.opt.timestep
    head.lag = 0.0 if m.opt.integrator == layout.RUNGE_KUTTA else 0.5 * m.opt.timestep
    store(head.gravity, (0.0, 0.0, 0.0) if m.opt.disableflags & layout.NO_GRAVITY else load(m.opt.gravity))


@jit
def note(head, state):
    """Keep the coordinates and velocities that there are in a state at an address."""
    d, q, v = data_at(head.data, 0), head.nq, head.nv
    floats(state, 0, 1)[0] = d.time
    copy(floats(d.qpos, 0, q), floats(state, 1, q))
    copy(floats(d.qvel, 0, v), floats(state, 1 + q, v))


@jit
def take(head):
    """The state; the world is brought to it."""
    state = floats(data_at(head.data, 0).plugin_state, head.state, head.own_size)
    if state[TOKEN] != head.token:
        take_over(head, world_at(head.world, 0), state)
    return state


@jit
def take_over(head, w, state):
    """Bring the world to a state that its own last step did not leave; without contacts, if nobody's has."""
    sound, dropped = state[TOKEN] == token_of(head, state, state.size, state.size), 0
    if not sound:
        clear(state[PUSH:])
    forget_motion(w)
    if ready(w, READ_STATE):
        row = state[head.row :]
        dropped = call_read(address(w, READ_STATE), w, row.ctypes.data, row.size)
        head.token, head.idle = state[TOKEN], 0
    if head.token == 0.0:  # a reset, perhaps to where all bodies were: who is in whom has to be found
        left = floats(head.left, 1, head.nq)
        for i in range(head.nq):
            left[i] = np.nan
    if not sound or (dropped > 0 and w.edited < RESIZED):
        notice(head, notices.DAMAGED, float(dropped))


@jit
def all_far(head):
    """Whether no body has left its margin, be it that somebody has put it elsewhere."""
    far = head.placed_count + head.tree_count == 0
    for i in range(head.free_count if far else 0):
        far = far and is_far(head, free_at(head.frees, i))
    return far


@jit
def leave(head, w, state):
    """Write the state that the next step is given."""
    push = state[PUSH : PUSH + head.nv]
    clear(push)
    for k in range(w.nears):
        p = near_at(w.near, k)
        if p.closed != 0:
            c = contact_at(w.contacts, p.slot)
            force = scale(mean_share(c, head.step_size), load(c.force))
            press(head, p.body_a, load(c.arm_a), force, push)
            press(head, p.body_b, load(c.arm_b), scale(-1.0, force), push)
    d, head.idle, w.edited = data_at(head.data, 0), 1 if w.spares == w.contact_room else 0, 0
    state[LEFT] = left_of(head, d.qpos, d.qvel) if head.idle == 0 else 0.0
    lost = write(w, state[head.row :])
    if lost > 0:
        notice(head, notices.UNSAVED, float(lost))
    first, last = unused_span(w, state[head.row :])
    head.token = token_of(head, state, head.row + first, head.row + last)
    state[TOKEN] = head.token


@jit
def press(head, body, arm, force, push_io):
    """Add a force on a body of the world [N], at an arm [m] from its centre of mass, to the generalised one."""
    b = body_at(world_at(head.world, 0).bodies, body)
    if 0 < body <= head.free_count:
        press_free(b, free_at(head.frees, body - 1), arm, force, push_io)
    elif b.tree != 0:
        call_press(head.press, head.own, b, arm, force, push_io.ctypes.data)


@jit
def token_of(head, state, first, last):
    """A number that tells one state of one model from others; zero where all is zero.

    first, last: there are zeros alone from the one place to the other.
    """
    mixed = mix(state.ctypes.data, 1, first, 0) + mix(state.ctypes.data, last, state.size, 0)
    return as_float(mixed + types.uint64(head.signature)) if mixed != types.uint64(0) else 0.0


@jit
def left_of(head, q, v):
    """A number that tells coordinates and velocities, at two addresses, of a model as the law reads it."""
    return as_float(mix(q, 0, head.nq, 0) + mix(v, 0, head.nv, head.nq) + types.uint64(head.made))


@jit
def begin(m, d, instance):
    """The head of the block of an instance, which from now on knows whose it is."""
    head = head_at(block_of(d, instance), 0)
    head.model, head.data = m, d
    return head


@jit
def acts(head):
    """Whether an instance leads, and anything may touch."""
    return head.leads != 0 and model_at(head.model, 0).opt.disableflags & layout.NO_CONTACT == 0


@c_callback(types.void(types.uintp, types.uintp, types.int32, types.int32), layout.KEY)
def compute(m, d, instance, capability):
    """Note the state, and give the force that contacts press with; or read the sensors once more."""
    head = begin(m, d, instance)
    if not acts(head):
        return
    if capability == layout.SENSOR:
        if head.sense != 0:
            take(head)
            call_sense(head.sense, head.own, head.averages)
        return
    if (head.calm == 0 or head.turn == 0) and edited(head):
        tell_of(head, notices.EDITED, 0.0)
        head = begin(m, d, instance)
    head.turn = (head.turn + 1) % STARTS
    note(head, place(head.starts, head.turn * (1 + head.nq + head.nv)))
    d = data_at(head.data, 0)
    if head.calm * head.idle != 0 and floats(d.plugin_state, head.state, 1)[TOKEN] == head.token:
        return  # nothing presses, nor has
    push, given = floats(d.plugin_state, head.state + PUSH, head.nv), floats(head.given, 0, head.nv)
    passive = floats(d.qfrc_passive, 0, head.nv)
    for i in range(head.nv):
        given[i] = push[i] if abs(push[i]) < LARGEST else 0.0
        passive[i] += given[i]


@c_callback(types.void(types.uintp, types.uintp, types.int32), layout.KEY)
def advance(m, d, instance):
    """The engine has taken its step: take that of the world, and write what was touched."""
    head = begin(m, d, instance)
    if not acts(head):
        return
    if model_at(m, 0).opt.disableflags & layout.NO_PASSIVE == layout.NO_PASSIVE:  # `compute` was not asked
        notice(head, notices.SWITCHED_OFF, 0.0)
        return
    done = go_on(head)
    if done == CHANGED:
        tell_of(head, notices.EDITED, 0.0)
        head = begin(m, d, instance)
        done = go_on(head)
    head.calm = max(done, MOVED)
    note(head, head.left)
    if head.sense != 0:
        head.averages = 1
        call_sense(head.sense, head.own, 1)
        head.averages = 0


@c_callback(types.void(types.uintp, types.uintp, types.uintp, types.int32), layout.KEY)
def reset(m, state, block, instance):
    """No contact, and no motion: what follows is what follows in a new `MjData`."""
    head = head_at(block, 0)
    clear(floats(state, 0, head.own_size))
    if head.leads != 0:
        forget_motion(world_at(head.world, 0))


@c_callback(types.void(types.uintp, types.int32), layout.KEY)
def destroy(d, instance):
    """Free the block of an instance."""
    free_memory(block_of(d, instance))
