"""Sensors: contacts of the law in the engine's own force and acceleration sensors, and a sensor of the law's contacts.

The engine's `force`, `torque`, `accelerometer` and acceleration sensors, cacc, cfrc_int and cfrc_ext come from
mj_rnePostConstraint. That function knows the engine's contacts and `xfrc_applied`, but no generalised forces. So, only
while sensors are evaluated, the wrenches of the law's contacts are added to `xfrc_applied`. At the end of mj_forward
these are the wrenches that contacts press with now. After a step the sensors are evaluated again, with the mean wrench
R over the step, R = impulse/step, and the accelerations that belong to it, qacc + M^-1 (J^T R - Q), where Q is the
generalised force that the engine was given for the contacts. Forces and accelerations then obey the equation of motion
of that step.

`touch` sensors, and the law's own sensor (docs/mujoco.md) on a site, include contacts by the engine's rule: the ray
from a contact along its normal meets the site.
"""

from typing import Any

import mujoco
from numba import types

from contactlaw.jit import address_of, compiling, jit_module
from contactlaw.memory import caller, doubles_at, whole_at
from contactlaw.mujoco_plugin import layout
from contactlaw.mujoco_plugin.block import entry, floats, head_at, sensor_at, shifted
from contactlaw.mujoco_plugin.free import mean_share
from contactlaw.mujoco_plugin.layout import data_at, model_at
from contactlaw.world.contacts.force import moment_of
from contactlaw.world.data.access import body_at, contact_at, world_at
from contactlaw.world.data.records import CLOSED, FREE
from contactlaw.world.data.vec import add, axpy, cross, dot, load, norm, scale, store, sub, to_world
from contactlaw.world.trees.mobility import clear, copy

NUMBERS = 10  # values of the law's own sensor: count, force, moment, point

SENSE = types.void(types.uint64, types.uint64)
call_sense: Any = caller(SENSE)
"""Call `sense` at an address."""

POINTER = types.uintp
find_forces = types.ExternalFunction("mj_rnePostConstraint", types.void(POINTER, POINTER))
read_sensors = types.ExternalFunction("mj_sensorAcc", types.void(POINTER, POINTER))
generalise = types.ExternalFunction("mj_applyFT", types.void(*5 * [POINTER], types.int32, POINTER))
solve = types.ExternalFunction("mj_solveM", types.void(*4 * [POINTER], types.int32))
ray = types.ExternalFunction("mju_rayGeom", types.float64(*5 * [POINTER], types.int32, POINTER))

_OF = mujoco.mjtObj
_PLACES = _OF.mjOBJ_BODY, _OF.mjOBJ_XBODY, _OF.mjOBJ_GEOM, _OF.mjOBJ_SITE


def rows_of(view: layout.ModelView, instances: dict[int, int]) -> tuple[bool, list[dict[str, Any]]]:
    """Return whether a model has force or acceleration sensors, and the `block.SENSOR` fields of touch and own sensors.

    instances: ids of all plugin instances, and the index of each among the contacts of the model; -1: it means all.
    """
    names = ("type", "needstage", "objtype", "objid", "adr", "plugin")
    kinds, stages, on, ids, places, plugins = (getattr(view, f"sensor_{name}").tolist() for name in names)
    cutoffs, owner = view.sensor_cutoff.tolist(), view.site_bodyid
    rows = []
    for i, kind in enumerate(kinds):
        own = kind == mujoco.mjtSensor.mjSENS_PLUGIN and plugins[i] in instances
        if own and on[i] not in _PLACES:
            raise ValueError(f"sensor {i}: objtype of a sensor of contacts must be body, xbody, geom or site")
        if own or kind == mujoco.mjtSensor.mjSENS_TOUCH:
            site = ids[i] if on[i] == _OF.mjOBJ_SITE else -1
            rows.append({
                "own": own, "site": site, "geom": ids[i] if on[i] == _OF.mjOBJ_GEOM else -1, "at": places[i],
                "body": owner[site] if site >= 0 else ids[i], "cutoff": cutoffs[i],
                "instance": instances[plugins[i]] if own else -1,
            })  # fmt: skip
    return int(mujoco.mjtStage.mjSTAGE_ACC) in stages, rows


def address() -> int:
    """Return the address of `sense`, compiled when the first model with such sensors is made."""
    with compiling("sensors", 4):
        return address_of(sense, SENSE, layout.KEY)


def sense(block, mean):
    """Evaluate sensors with the law's contacts; mean: averaged over the step, else as they press now.

    The engine, called to evaluate its sensors, calls this again for those of the law.
    """
    head = head_at(block, 0)
    if head.sensing != 0:
        write_readings(head, head.sensing - 1)
    elif gather_wrenches(head, mean):
        head.sensing = 1 + mean
        evaluate_sensors(head, mean)
        head.sensing = 0
    else:
        write_readings(head, mean)


def evaluate_sensors(head, mean):
    """Let the engine evaluate its sensors with the gathered wrenches applied; restore everything else."""
    n, nv, d = 6 * head.body_count, head.nv, data_at(head.data, 0)
    applied, loads, kept = floats(d.xfrc_applied, 0, n), floats(head.loads, 0, n), floats(head.loads, n, n)
    q, given = floats(head.loads, 2 * n, nv), floats(head.given, 0, nv)
    accelerations, before = floats(d.qacc, 0, nv), floats(head.loads, 2 * n + nv, nv)
    now = d.time
    for i in range(nv):
        before[i], q[i] = accelerations[i], -given[i]
    for i in range(n):
        kept[i] = applied[i]
        applied[i] += loads[i]
    if mean != 0:
        d.time = doubles_at(head.start)[0]
        push = shifted(head.loads, 2 * n)
        for body in range(1, head.body_count):
            wrench, centre = shifted(head.loads, 6 * body), shifted(d.xipos, 3 * body)
            generalise(head.model, head.data, wrench, shifted(wrench, 3), centre, types.int32(body), push)
        solve(head.model, head.data, push, push, types.int32(1))
        for i in range(nv):
            accelerations[i] += q[i]
    find_forces(head.model, head.data)
    read_sensors(head.model, head.data)
    d.time = now
    copy(before, accelerations)
    copy(kept, applied)


def gather_wrenches(head, mean):
    """Sum the wrench of contacts on each body, about its centre of mass; return whether there are any contacts."""
    w, found = world_at(head.world, 0), False
    owner, d = model_at(head.model, 0).geom_bodyid, data_at(head.data, 0)
    loads = floats(head.loads, 0, 6 * head.body_count)
    clear(loads)
    for slot in range(w.slots):
        c = contact_at(w.contacts, slot)
        if c.phase == FREE or (mean == 0 and c.phase != CLOSED):
            continue
        found = True
        x, (force, moment) = point_of(head, c), load_of(head, w, c, mean)
        for shape, sign in ((c.shape_a, 1.0), (c.shape_b, -1.0)):
            body = entry(owner, whole_at(head.geoms, shape))
            arm = sub(x, load(floats(d.xipos, 3 * body, 3)))
            push, turn = loads[6 * body : 6 * body + 3], loads[6 * body + 3 : 6 * body + 6]
            store(push, axpy(sign, force, load(push)))
            store(turn, axpy(sign, add(moment, cross(arm, force)), load(turn)))
    return found


def load_of(head, w, c, mean):
    """Return the force [N] and the moment [N m] on A."""
    step = model_at(head.model, 0).opt.timestep
    sleeps = body_at(w.bodies, c.body_a).asleep != 0 or body_at(w.bodies, c.body_b).asleep != 0
    if sleeps or mean == 0:
        force = load(c.force) if sleeps else scale(mean_share(c, step), load(c.force))
    else:
        force = scale(1.0 / step, sub(load(c.impulse), load(c.earlier)))
    return force, scale(-1.0, moment_of(c))


def point_of(head, c):
    """Return the point of a contact [m], from the present position of the geom of A."""
    d, geom = data_at(head.data, 0), whole_at(head.geoms, c.shape_a)
    centre = load(floats(head.centres, 3 * c.shape_a, 3))
    turned = to_world(floats(d.geom_xmat, 9 * geom, 9), centre)
    return add(load(c.arm_a), add(load(floats(d.geom_xpos, 3 * geom, 3)), turned))


def write_readings(head, mean):
    """Write the readings of the law's own sensors, and add the law's contacts to those of touch sensors."""
    w, readings = world_at(head.world, 0), data_at(head.data, 0).sensordata
    for i in range(head.sensor_count):
        s = sensor_at(head.sensors, i)
        out, s.weight = floats(readings, s.at, NUMBERS if s.own != 0 else 1), 0.0
        if s.own != 0:
            clear(out)
        for slot in range(w.slots):
            c = contact_at(w.contacts, slot)
            if c.phase != FREE and (mean != 0 or c.phase == CLOSED):
                add_to(head, s, c, out, mean)
        if s.own == 0:
            out[0] = min(out[0], s.cutoff) if s.cutoff > 0.0 else out[0]
        elif s.weight > 0.0:
            x = scale(1.0 / s.weight, load(out[7:10]))
            store(out[7:10], x)
            store(out[4:7], sub(load(out[4:7]), cross(x, load(out[1:4]))))


def add_to(head, s, c, out, mean):
    """Add a contact to the readings of a sensor, if the sensor measures it."""
    if s.instance >= 0 and s.instance != c.pair:
        return
    side, owner = 0.0, model_at(head.model, 0).geom_bodyid
    for shape, sign in ((c.shape_b, -1.0), (c.shape_a, 1.0)):
        geom = whole_at(head.geoms, shape)
        if geom == s.geom or (s.geom < 0 and entry(owner, geom) == s.body):
            side = sign
    w, x = world_at(head.world, 0), point_of(head, c)
    force, moment = load_of(head, w, c, mean)
    normal = dot(force, load(c.normal))
    if side == 0.0 or normal <= 0.0 or (s.site >= 0 and not meets(head, s.site, x, scale(-side, load(c.normal)))):
        return
    if s.own == 0:
        out[0] += normal
        return
    force = scale(side, force)
    s.weight += norm(force)
    out[0] += 1.0
    store(out[1:4], add(load(out[1:4]), force))
    store(out[4:7], add(load(out[4:7]), axpy(side, moment, cross(x, force))))
    store(out[7:10], axpy(norm(force), x, load(out[7:10])))


def meets(head, site, x, direction):
    """Return whether a ray from a point hits a site."""
    m, d, room = model_at(head.model, 0), data_at(head.data, 0), shifted(head.loads, 12 * head.body_count + 2 * head.nv)
    store(floats(room, 0, 3), x)
    store(floats(room, 3, 3), direction)
    at, turn, size = shifted(d.site_xpos, 3 * site), shifted(d.site_xmat, 9 * site), shifted(m.site_size, 3 * site)
    kind = types.int32(entry(m.site_type, site))
    # the last pointer, from MuJoCo 3.4 on, is where it would write the normal
    return ray(at, turn, size, room, shifted(room, 3), kind, POINTER(0)) >= 0.0


jit_module(__name__)
