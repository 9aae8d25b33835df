"""The compiled callbacks: what MuJoCo calls in every step. No Python runs here."""

from __future__ import annotations

import numpy as np
from numba import carray, types  # pyright: ignore[reportPrivateImportUsage]

from contactlaw.jit import c_callback, jit_for
from contactlaw.kernels.scene import (
    KEY,
    MOST_SLOTS,
)
from contactlaw.memory import doubles_at, load_double, load_int, load_pointer
from contactlaw.mujoco_plugin import block as b
from contactlaw.mujoco_plugin import layout
from contactlaw.mujoco_plugin.evaluate import evaluate
from contactlaw.mujoco_plugin.flight import far_apart
from contactlaw.mujoco_plugin.memo import stands
from contactlaw.mujoco_plugin.motion import field as field_of
from contactlaw.mujoco_plugin.motion import row as row_of
from contactlaw.mujoco_plugin.tables import address_of_block, part, report, room_taken, table

STATE_AT = layout.DATA["plugin_state"]
TIME_AT = layout.DATA["time"]
XMAT_AT = layout.DATA["xmat"]
PASSIVE_AT = layout.DATA["qfrc_passive"]
TIMESTEP_AT = layout.TIMESTEP
INTEGRATOR_AT = layout.INTEGRATOR
RUNGE_KUTTA = layout.RUNGE_KUTTA

jit = jit_for(layout.KEY)
free_memory = types.ExternalFunction("mju_free", types.void(types.uintp))


@jit
def add_up(ledger_io, step):
    """Add a step to a ledger."""
    for i in range(step.size):
        if i in (b.OVERLAP, b.FORCE):
            ledger_io[i] = max(ledger_io[i], step[i])
        elif i == b.SHORTEST:
            if step[i] < 1e300:
                ledger_io[i] = min(ledger_io[i], step[i]) if ledger_io[i] > 0.0 else step[i]
        else:
            ledger_io[i] += step[i]


@jit
def keep_frames(d, block, head):
    """Note how free bodies are turned at the start of a Runge-Kutta step."""
    facts = table(block, int(head[b.BODIES_AT]), int(head[b.BODIES]), b.BODY_FACTS)
    frames = table(block, int(head[b.FRAMES_AT]), facts.shape[0], 9)
    for i in range(1, facts.shape[0]):
        now = row_of(d, XMAT_AT, int(facts[i, b.BODY_ID]), 9)
        for j in range(9):
            frames[i, j] = now[j]


@jit
def turn_torques(d, block, head, total_io):
    """Keep the torques on free bodies fixed in space while Runge-Kutta turns the axes that they are told along."""
    facts = table(block, int(head[b.BODIES_AT]), int(head[b.BODIES]), b.BODY_FACTS)
    frames = table(block, int(head[b.FRAMES_AT]), facts.shape[0], 9)
    turn, torque = np.empty(3), np.empty(3)
    for i in range(1, facts.shape[0]):
        if facts[i, b.LIGHTNESS] == 0.0:
            continue
        now, first = row_of(d, XMAT_AT, int(facts[i, b.BODY_ID]), 9), int(facts[i, b.TREE_DOF]) + 3
        for j in range(3):
            turn[j] = 0.0
            for k in range(3):
                turn[j] += frames[i, 3 * j + k] * total_io[first + k]
        for j in range(3):
            torque[j] = 0.0
            for k in range(3):
                torque[j] += now[3 * k + j] * turn[k]
        for j in range(3):
            total_io[first + j] = torque[j]
    keep_frames(d, block, head)


@c_callback(types.void(types.uintp, types.uintp, types.int32, types.int32), layout.KEY)
def compute(m, d, instance, capability):
    """Force of all contacts of the model at the present state; committed state is only read."""
    block = address_of_block(d, instance)
    head = part(block, 0, b.HEAD)
    if head[b.LEADS] == b.FOLLOWS:
        return
    nv = int(head[b.NV])
    total, passive = part(block, int(head[b.FORCE_AT]), nv), field_of(d, PASSIVE_AT, 0, nv)
    dt = load_double(m + types.uintp(TIMESTEP_AT))
    moves = load_int(m + types.uintp(INTEGRATOR_AT)) == RUNGE_KUTTA
    time = load_double(d + types.uintp(TIME_AT))
    # Runge-Kutta looks three times more into its step: the force is that of the first time, as the impulses say.
    ahead = time - head[b.STAGE_TIME]
    later = moves and (abs(ahead - 0.5 * dt) < 1e-9 * dt or abs(ahead - dt) < 1e-9 * dt)
    if not later:
        head[b.PENDING] = -1.0
        head[b.STAGE_TIME] = time
        if not stands(m, d, head, part(block, int(head[b.INPUTS_AT]), int(head[b.INPUTS]))):
            head[b.STILL] = 0.0
            if far_apart(m, d, block, head, dt):
                if moves:
                    for i in range(nv):
                        total[i] = 0.0
                return
            for i in range(nv):
                total[i] = 0.0
            if not evaluate(m, d, block, head, dt, moves, total):
                return
        if moves:
            keep_frames(d, block, head)
    else:
        turn_torques(d, block, head, total)
    for i in range(nv):
        passive[i] += total[i]


@c_callback(types.void(types.uintp, types.uintp, types.int32), layout.KEY)
def advance(m, d, instance):
    """The step is taken: what compute left becomes the state of all instances."""
    block = address_of_block(d, instance)
    head = part(block, 0, b.HEAD)
    if head[b.LEADS] == b.FOLLOWS:
        return
    head[b.STAGE_TIME] = np.nan
    if head[b.PENDING] < 0.0:
        return
    instances = table(block, int(head[b.INSTANCES_AT]), int(head[b.INSTANCES]), b.INSTANCE)
    new = table(block, int(head[b.NEW_AT]), int(head[b.CAPACITY]), int(head[b.STRIDE]))
    ledgers = table(block, int(head[b.LEDGER_AT]), instances.shape[0], b.LEDGER_SIZE)
    at, last = 0, int(head[b.PENDING])
    for k in range(instances.shape[0]):
        instance_row = instances[k]
        own = load_pointer(d + types.uintp(STATE_AT)) + types.uintp(8 * int(instance_row[b.STATE]))
        size, room = int(instance_row[b.RECORD_SIZE]), int(instance_row[b.ROOM])
        start = b.LEDGER_STATE + (b.LEDGER_SIZE if instance_row[b.HAS_LEDGER] != 0.0 else 0)
        state = carray(doubles_at(own), start + room * size)
        before, count = room_taken(state[b.COUNT], room), 0
        while at < last and new[at, KEY] < MOST_SLOTS * instance_row[b.LAST_PAIR]:
            if count < room:
                record = state[start + count * size : start + (count + 1) * size]
                record[:] = new[at, :size]
                record[KEY] -= MOST_SLOTS * instance_row[b.FIRST_PAIR]
                count += 1
            else:
                report(instances, k, b.FULL, float(room), head)
            at += 1
        state[start + count * size : start + max(before, count) * size] = 0.0
        state[b.COUNT] = count
        if instance_row[b.HAS_LEDGER] != 0.0:
            add_up(state[b.LEDGER_STATE : b.LEDGER_STATE + b.LEDGER_SIZE], ledgers[k])


@c_callback(types.void(types.uintp, types.uintp, types.uintp, types.int32), layout.KEY)
def reset(m, state, block, instance):
    """No contact, an empty ledger."""
    own = part(block, 0, b.OWN_SIZE + 1)
    values = part(state, 0, int(own[b.OWN_SIZE]))
    for i in range(values.size):
        values[i] = 0.0


@c_callback(types.void(types.uintp, types.int32), layout.KEY)
def destroy(d, instance):
    """Free the block of an instance."""
    free_memory(address_of_block(d, instance))
