"""One step of all contacts of a model: from mjData to the generalized force and to what is remembered."""

from __future__ import annotations

import numpy as np
from numba import types  # pyright: ignore[reportPrivateImportUsage]

from contactlaw.jit import jit_for
from contactlaw.kernels.contact import RADIUS
from contactlaw.kernels.coupling import copy, couple
from contactlaw.kernels.cutting import needs_cutting
from contactlaw.kernels.intervals import march
from contactlaw.kernels.meeting import meet, near_pairs
from contactlaw.kernels.rest import SAME
from contactlaw.kernels.rows import (
    BEGUN,
    DEEPEST,
    DRAG,
    FASTEST,
    FRAME,
    OVERLAP_NOW,
    SPENT,
    STRONGEST,
    TOUCHING,
    WORK,
)
from contactlaw.kernels.scene import (
    BODY_OF,
    COM,
    COUNTED,
    INVERSE_MASS,
    KEY,
    LINEAR,
    MOST_SLOTS,
    OWED,
    POINTS,
    RATE,
    SHAPE_A,
    SHAPE_B,
    TREE,
    describe,
    finish,
    lever,
)
from contactlaw.kernels.scene import (
    PARAMETERS_AT as LAW_OF_PAIR,
)
from contactlaw.kernels.touch import (
    AXES,
    CLEAR,
    FOUND,
    FOUND_OVERLAP,
    KIND,
    NORMAL,
    OTHER,
    TURNS_A,
    TURNS_B,
)
from contactlaw.kernels.workspace import clear, numbers, zero_table, zeros
from contactlaw.kernels.workspace import table as table_of
from contactlaw.mujoco_plugin import block as b
from contactlaw.mujoco_plugin import layout
from contactlaw.mujoco_plugin.flight import fall_of
from contactlaw.mujoco_plugin.memo import remember
from contactlaw.mujoco_plugin.motion import (
    add_motion,
    add_turning,
    damped,
    free_acceleration,
    project,
    pull_tree,
    relax,
    solve_inertia,
    stiffen,
)
from contactlaw.mujoco_plugin.motion import row as row_of
from contactlaw.mujoco_plugin.tables import count_records, gather, look, part, report, table
from contactlaw.pair import DEEPEST as DEEP_FROM

XIPOS_AT = layout.DATA["xipos"]
FAR = 1e6  # [m]; how far the engine is asked to look for a distance

jit = jit_for(layout.KEY)

geom_distance = types.ExternalFunction(
    "mj_geomDistance", types.float64(types.uintp, types.uintp, types.intc, types.intc, types.float64, types.uintp)
)


@jit
def measure(m, d, near, pairs, shapes, geoms, places, work_io):
    """Distances of near pairs by the engine, where a shape has no closed form here: pair and `FOUND`."""
    count = 0
    for pair in near:
        if shapes[int(pairs[pair, SHAPE_A]), KIND] == OTHER or shapes[int(pairs[pair, SHAPE_B]), KIND] == OTHER:
            count += 1
    out, ends = zero_table(work_io, count, 1 + FOUND), numbers(work_io, 6)
    count = 0
    for pair in near:
        one, two = int(pairs[pair, SHAPE_A]), int(pairs[pair, SHAPE_B])
        if shapes[one, KIND] != OTHER and shapes[two, KIND] != OTHER:
            continue
        apart = geom_distance(m, d, int(geoms[one]), int(geoms[two]), FAR, types.uintp(ends.ctypes.data))
        row = out[count]
        count += 1
        row[0] = -1.0
        if apart >= FAR or apart == 0.0:
            continue
        row[0], row[1 + FOUND_OVERLAP], row[1 + CLEAR] = pair, -apart, 1.0
        for i in range(3):
            row[1 + NORMAL + i] = (ends[i] - ends[3 + i]) / apart
            for j in range(3):
                row[1 + TURNS_A + i] += places[one, AXES + 3 * j + i] * (ends[j] - places[one, j])
                row[1 + TURNS_B + i] += places[two, AXES + 3 * j + i] * (ends[3 + j] - places[two, j])
    return out


@jit
def place_of_point(shape, place, bodies, points, turns, out):
    """Where a remembered contact point is now, world frame."""
    lever(shape, place, bodies, points, turns, turns + 3, out)
    body = bodies[int(shape[BODY_OF])]
    for i in range(3):
        out[i] += body[COM + i]


@jit
def push(m, d, facts, bodies, shape, point, impulse, torque, factor, total_io):
    """Add a generalized force to total (nv): factor times an impulse at a point and an angular impulse."""
    body = int(shape[BODY_OF])
    if bodies[body, TREE] >= 0.0:
        project(m, d, facts[body], point, impulse, torque, factor, total_io)


@jit
def repay(m, d, records, count, pairs, shapes, facts, places, bodies, total_io, work_io):
    """Add the generalized impulse (nv) that the last step left owing; returns whether there is any."""
    point, none, any_owed = numbers(work_io, 3), zeros(work_io, 3), False
    for k in range(count):
        owed = records[k, OWED : OWED + 3]
        if owed[0] == 0.0 and owed[1] == 0.0 and owed[2] == 0.0:
            continue
        any_owed = True
        pair = pairs[int(records[k, KEY]) // MOST_SLOTS]
        for side in range(2):
            shape = shapes[int(pair[SHAPE_A + side])]
            place_of_point(shape, places[int(pair[SHAPE_A + side])], bodies, records[k], POINTS + 6 * side, point)
            push(m, d, facts, bodies, shape, point, owed, none, 1.0 - 2.0 * side, total_io)
    return any_owed


@jit
def correct(m, d, facts, bodies, shapes, places, owed, rates, dt, moves, work_io):
    """Turn the engine's motion into the true one: what is owed and half a step of free acceleration are still to come.

    owed, rates: generalized velocities owed and acceleration (nv). moves: positions that Runge-Kutta moved with the
    force of the last step are ahead by half of what is owed.
    """
    half = 0.0 if moves else 0.5 * dt
    shift, turn, point = zeros(work_io, 3), zeros(work_io, 3), numbers(work_io, 3)
    if moves:
        for i in range(shapes.shape[0]):
            body = int(shapes[i, BODY_OF])
            if bodies[body, TREE] >= 0.0:
                shift[:] = 0.0
                add_motion(m, d, facts[body], places[i, :3], owed, -0.5 * dt, shift, turn)
                for j in range(3):
                    places[i, j] += shift[j]
    for k in range(1, bodies.shape[0]):
        body = bodies[k]
        if body[TREE] < 0.0:
            continue
        copy(body[COM : COM + 3], point)
        linear, angular = body[LINEAR : LINEAR + 3], body[LINEAR + 3 : LINEAR + 6]
        add_motion(m, d, facts[k], point, owed, 1.0, linear, angular)
        add_motion(m, d, facts[k], point, rates, 1.0, body[LINEAR + 6 : LINEAR + 9], body[LINEAR + 9 : LINEAR + 12])
        if half > 0.0:
            add_motion(m, d, facts[k], point, rates, half, linear, angular)
        if body[INVERSE_MASS] == 0.0:
            add_turning(m, d, facts[k], body)
        if moves:
            add_motion(m, d, facts[k], point, owed, -0.5 * dt, body[COM : COM + 3], turn)


@jit
def evaluate(m, d, block, head, dt, moves, total_out):
    """One step of all contacts: generalized force (nv) to total_out, what is to be remembered to the block."""
    nv = int(head[b.NV])
    work = part(block, int(head[b.WORK_AT]), int(head[b.WORK]))
    clear(work)
    shapes, facts, pairs, geoms, places, bodies = look(m, d, block, head)
    instances = table(block, int(head[b.INSTANCES_AT]), int(head[b.INSTANCES]), b.INSTANCE)
    parameters = part(block, int(head[b.PARAMETERS_AT]), int(head[b.PARAMETERS]))
    known = count_records(d, instances)
    records = zero_table(work, known, int(head[b.STRIDE]))
    if known == 0:
        for k in range(1, bodies.shape[0]):
            bodies[k, RATE] = 2.0 * fall_of(m, dt) / (dt * dt)
        near, _ = near_pairs(pairs, shapes, places, bodies, parameters, records, known, dt, work)
        for k in range(1, bodies.shape[0]):
            bodies[k, RATE] = 0.0
        if near.size == 0:
            return False
    known = gather(d, pairs, head, instances, records)
    force, rates, owed = zeros(work, nv), numbers(work, nv), zeros(work, nv)
    is_damped = damped(m, nv)
    kept = numbers(work, nv if is_damped else 0)
    if is_damped:
        stiffen(m, d, nv, dt, kept)
    if repay(m, d, records, known, pairs, shapes, facts, places, bodies, total_out, work):
        solve_inertia(m, d, types.uintp(owed.ctypes.data), types.uintp(total_out.ctypes.data), 1)
    free_acceleration(m, d, head[b.ACTUATED] != 0.0, nv, force, rates)
    correct(m, d, facts, bodies, shapes, places, owed, rates, dt, moves, work)
    near, ways = near_pairs(pairs, shapes, places, bodies, parameters, records, known, dt, work)
    measured = measure(m, d, near, pairs, shapes, geoms, places, work)
    who, times, found, trees = meet(near, ways, pairs, shapes, places, bodies, measured, dt, work)
    n = who.shape[0]
    now, couples = table_of(work, n, 3), zeros(work, 6 * n).reshape((n, 2, 3))
    new = table(block, int(head[b.NEW_AT]), int(head[b.CAPACITY]), int(head[b.STRIDE]))
    rows, histories, arms, pulls, answers = describe(
        who,
        times,
        found,
        pairs,
        shapes,
        places,
        bodies,
        parameters,
        records,
        known,
        dt,
        not moves,
        int(head[b.WIDTH]),
        work,
    )
    point = numbers(work, 3)
    for i in range(n):
        for side in range(2):
            body = int(shapes[int(pairs[who[i, 0], SHAPE_A + side]), BODY_OF])
            if trees[i, side] >= 0 and bodies[body, INVERSE_MASS] == 0.0:
                for j in range(3):
                    for k in range(3):
                        point[k] = engine_place(d, facts[body])[k] + arms[i, side, k]
                    axis = rows[i, FRAME + 3 * j : FRAME + 3 * j + 3]
                    pull_tree(m, d, facts[body], axis, point, nv, pulls[i, side, j], answers[i, side, j],
                              work)  # fmt: skip
    if is_damped:
        relax(m, d, nv, kept)
    still = couple(rows, histories, parameters, trees, pulls, answers, dt, work)
    cut = np.empty(n, dtype=np.bool_)
    if needs_cutting(who, times, found, rows, trees, pairs, shapes, bodies, dt, cut, work):
        who, times, found, trees, rows, histories, arms = march(
            cut, who, times, found, trees, rows, histories, arms, pairs, shapes, places, bodies, parameters,
            records, known, dt, moves, int(head[b.WIDTH]), new.shape[0],
            work,
        )  # fmt: skip
        n = who.shape[0]
        now, couples = table_of(work, n, 3), zeros(work, 6 * n).reshape((n, 2, 3))
    count = finish(
        who, found, rows, histories, trees, arms, pairs, shapes, bodies, dt, moves, new, now, couples,
        work,
    )  # fmt: skip
    for i in range(n):
        for side in range(2):
            shape = shapes[int(pairs[who[i, 0], SHAPE_A + side])]
            body = int(shape[BODY_OF])
            if body == 0:
                continue
            for k in range(3):
                point[k] = engine_place(d, facts[body])[k] + arms[i, side, k]
            push(m, d, facts, bodies, shape, point, now[i], couples[i, side] * (1.0 - 2.0 * side), 1.0 - 2.0 * side,
                 total_out)  # fmt: skip
    for i in range(nv):
        total_out[i] /= dt
    head[b.PENDING] = count
    note_rest(m, d, block, head, still and count == known, records, new, count, rows)
    tell(head, block, instances, who, found, rows, pairs, parameters)
    if moves:
        tell_of_joints(head, instances, who, rows, shapes, pairs, bodies)
    return True


@jit
def note_rest(m, d, block, head, still, records, new, count, rows):
    """Let the force stand where all is still and nothing is remembered but what was before."""
    head[b.STILL] = 0.0
    if not still or head[b.ACTUATED] != 0.0 or head[b.LEDGERS] != 0.0:
        return
    smallest = 1e300
    for i in range(count):
        for j in range(records.shape[1]):
            if records[i, j] != new[i, j]:
                return
    for i in range(rows.shape[0]):
        if rows[i, OVERLAP_NOW] > 0.0:
            smallest = min(smallest, rows[i, OVERLAP_NOW])
    head[b.STILL], head[b.SLACK] = 1.0, 0.1 * SAME * smallest
    remember(m, d, part(block, int(head[b.INPUTS_AT]), int(head[b.INPUTS])))


@jit
def engine_place(d, facts):
    """Centre of mass as the engine has it, which under Runge-Kutta is ahead of the true one."""
    return row_of(d, XIPOS_AT, int(facts[b.BODY_ID]), 3)


@jit
def tell_of_joints(head, instances, who, rows, shapes, pairs, bodies):
    """Report contacts under Runge-Kutta that push a body with joints."""
    instance = 0
    for i in range(who.shape[0]):
        while who[i, 0] >= instances[instance, b.LAST_PAIR]:
            instance += 1
        for side in range(2):
            body = bodies[int(shapes[int(pairs[who[i, 0], SHAPE_A + side]), BODY_OF])]
            if rows[i, DEEPEST] > 0.0 and body[TREE] >= 0.0 and body[INVERSE_MASS] == 0.0:
                report(instances, instance, b.RUNGE_KUTTA_JOINTS, 0.0, head)


@jit
def tell(head, block, instances, who, found, rows, pairs, parameters):
    """Report what should be known of a step, and write the ledger of those who keep one."""
    ledgers = table(block, int(head[b.LEDGER_AT]), instances.shape[0], b.LEDGER_SIZE)
    ledgers[:] = 0.0
    ledgers[:, b.SHORTEST] = 1e300
    instance = 0
    for i in range(who.shape[0]):
        while who[i, 0] >= instances[instance, b.LAST_PAIR]:
            instance += 1
        row = rows[i]
        pair = pairs[who[i, 0]]
        radius = parameters[int(pair[LAW_OF_PAIR]) + RADIUS]
        deepest = max(row[DEEPEST], row[OVERLAP_NOW])
        if deepest > DEEP_FROM * radius:
            report(instances, instance, b.DEEP, deepest / radius, head)
        if deepest > 0.0 and found[i, CLEAR] == 0.0 and instances[instance, b.RADIUS_GIVEN] == 0.0:
            report(instances, instance, b.UNCLEAR_RADIUS, radius, head)
        if row[SPENT] != 0.0:
            report(instances, instance, b.SPENT_SUBSTEPS, 0.0, head)
        if pair[COUNTED] != 0.0:
            ledger = ledgers[instance]
            ledger[b.IMPACTS] += row[BEGUN]
            ledger[b.OVERLAP] = max(ledger[b.OVERLAP], deepest)
            ledger[b.FORCE] = max(ledger[b.FORCE], row[STRONGEST])
            ledger[b.TIME] += row[TOUCHING]
            ledger[b.SHORTEST] = min(ledger[b.SHORTEST], row[FASTEST] if row[FASTEST] > 0.0 else 1e300)
            ledger[b.NORMAL_WORK] += row[WORK]
            ledger[b.TANGENTIAL_WORK] += row[DRAG]
