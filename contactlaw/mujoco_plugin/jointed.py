"""Bodies that joints hold: a kinematic tree from mjData to the world, and back.

All forces on the joints are those that the engine had in its step, the force of the contacts taken out: applied ones,
springs, actuators, limits and other constraints. They stay what they are within the step, but for what goes with the
velocities: f + D (v - v_f), where D = df/dv is the engine's own derivative of passive and actuator forces, and v_f what
it was last asked for forces at, under Runge-Kutta near the step's end. How velocities are read and handed back is told
in `free`; here too the half step is one of what pushes at rest alone: with that of centripetal forces energy would be
gained, and damping may be stiff.

Joint limits that the engine has found reached are soft, and act in the world as they do there. The force of such a
constraint is f = D (a_ref - a), never less than zero, with a_ref = -B dr/dt - K I r, where r < 0 is how far the joint
is beyond its limit and a the acceleration of r (MuJoCo documentation, Computation, "Constraint model"). As a = a_0 + A
f, A = (M^-1)_kk, it changes by -D/(1 + D A) (K I dr + B d(dr/dt) + da_0). Held instead, it would go on against what a
contact has turned back within the step, and give way to what strikes a joint at its stop. A limit that is reached
behind a contact acts from the engine's next step on, as it does there.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from numba import types

from contactlaw.jit import address_of, compiling
from contactlaw.memory import caller, load_int
from contactlaw.mujoco_plugin import layout
from contactlaw.mujoco_plugin.block import head_at, jointed_at
from contactlaw.mujoco_plugin.free import jit
from contactlaw.mujoco_plugin.memory import entry, field, floats, place
from contactlaw.world.access import axis_at, body_at, link_at, tree_at, world_at
from contactlaw.world.call import BODY_TYPE, VECTOR, call_with_body
from contactlaw.world.passing import find_passing
from contactlaw.world.records import ASKED, PASSES, SLIDE, STAYS
from contactlaw.world.tree_dynamics import ascend, descend, mobility_along
from contactlaw.world.tree_kinematics import vector
from contactlaw.world.trees import clear, copy
from contactlaw.world.vec import add, cross, dot, load, norm, store, sub

SMOOTH, BIAS, CONSTRAINED, QPOS, QVEL, XPOS, XQUAT = (
    layout.DATA[name] for name in ("qfrc_smooth", "qfrc_bias", "qfrc_constraint", "qpos", "qvel", "xpos", "xquat")
)
DERIVATIVE, DIAGONAL, ROWS = layout.DATA["qDeriv"], layout.MODEL["D_diag"], layout.MODEL["D_rowadr"]

KIND, JOINT, BEYOND, MARGIN, REFERENCE, WEIGHT, FORCE = (
    layout.DATA[name] for name in ("efc_type", "efc_id", "efc_pos", "efc_margin", "efc_KBIP", "efc_D", "efc_force")
)
TYPE, DOF, COORDINATE, RANGE = (layout.MODEL[name] for name in ("jnt_type", "jnt_dofadr", "jnt_qposadr", "jnt_range"))
EQUALITIES, FRICTIONS, LIMITS, JOINT_LIMIT = layout.EQUALITIES, layout.FRICTIONS, layout.LIMITS, layout.JOINT_LIMIT

FIND, READ, WRITE, NOTE = range(4)
"""Stages of a step, see `serve`."""

SERVE = types.boolean(*3 * [types.uintp], types.int64)
PRESS = types.void(types.uint64, BODY_TYPE, VECTOR, VECTOR, types.uint64)
call_trees: Any = caller(SERVE)
call_press: Any = caller(PRESS)

smooth_derivative = types.ExternalFunction("mjd_smooth_vel", types.void(types.uintp, types.uintp, types.intc))


def serve(m, d, block, stage):
    """Take all trees through a stage of the step; after READ, whether the engine's own step takes them past all."""
    head = head_at(block, 0)
    if stage == READ:
        return read_trees(m, d, head)
    for i in range(head.tree_count):
        j = jointed_at(head.trees, i)
        if stage == FIND:
            find_jointed(d, head, j)
        elif stage == WRITE:
            write_jointed(d, head, j)
        else:
            note_jointed(d, head, j)
    return False


@jit
def read_trees(m, d, head):
    """Leave to the engine those that have passed by everything, and read the others; returns whether there are none."""
    for i in range(head.tree_count):
        foresee_jointed(d, head, jointed_at(head.trees, i))
    find_passing(head.world)
    known = False
    for i in range(head.tree_count):
        j = jointed_at(head.trees, i)
        if tree_at(world_at(head.world, 0).trees, j.tree).passes == PASSES:
            j.there = 1
            continue
        if not known:  # the engine finds D, that of the bias forces left out
            smooth_derivative(types.uintp(m), types.uintp(d), 0)
            known = True
        read_jointed(m, d, head, j)
    return not known


@jit
def read_damping(m, d, first, damping_out):
    """-D of a tree whose degrees of freedom begin at `first`; its rows are kept as the engine keeps them."""
    for k in range(damping_out.shape[0]):
        row, size = entry(m, ROWS, first + k), entry(m, DIAGONAL, first + k) + 1
        values = field(d, DERIVATIVE, row, size)
        for p in range(size):
            damping_out[k, p] = -values[p]


@jit
def find_jointed(d, head, j):
    """Where a tree is at the start of the step; it passes by everything unless something says otherwise."""
    w = world_at(head.world, 0)
    t = tree_at(w.trees, j.tree)
    start, rates = floats(head.start, 1 + j.q, t.q_size), floats(head.start, 1 + head.nq + j.v, t.v_size)
    left = floats(j.left, 0, t.q_size + t.v_size)
    if j.base != 0:
        store(t.base, load(field(d, XPOS, 3 * j.base, 3)))
        turn = field(d, XQUAT, 4 * j.base, 4)
        for i in range(4):
            t.base_turn[i] = turn[i]
    placed = False
    for i in range(t.q_size):
        placed = placed or start[i] != left[i]
    for i in range(t.v_size):
        placed = placed or rates[i] != left[t.q_size + i]
    for i in range(t.count):
        body_at(t.bodies, i).placed = 1 if placed else 0
    if placed:
        w.stale = 1
    t.passes = STAYS if body_at(t.bodies, 0).asleep != 0 else ASKED
    if t.passes != STAYS and (placed or j.there == 0):
        set_down(t, start, rates)
    j.there = 0


@jit
def set_down(t, coordinates, velocities):
    """Put the bodies of a tree where coordinates and velocities have them."""
    start, v, x = floats(t.start, 0, t.q_size), floats(t.v, 0, t.v_size), floats(t.x, 0, t.v_size)
    copy(coordinates, start)
    copy(velocities, v)
    clear(x)
    call_with_body(t.stand, body_at(t.bodies, 0))


@jit
def foresee_jointed(d, head, j):
    """Take a tree to the engine's end of the step, for `passing`."""
    t = tree_at(world_at(head.world, 0).trees, j.tree)
    if t.passes != STAYS:
        set_down(t, field(d, QPOS, j.q, t.q_size), field(d, QVEL, j.v, t.v_size))
        for i in range(t.count):
            b = body_at(t.bodies, i)
            b.turned += head.step_size * norm(load(b.spin))


@jit
def read_jointed(m, d, head, j):
    """Where a tree is, how it moves, and what moves it besides contacts, at the start of the step."""
    w = world_at(head.world, 0)
    t = tree_at(w.trees, j.tree)
    q, v = floats(t.q, 0, t.q_size), floats(t.v, 0, t.v_size)
    start, rates = floats(head.start, 1 + j.q, t.q_size), floats(head.start, 1 + head.nq + j.v, t.v_size)
    asked = floats(head.starts, (1 + head.nq + head.nv) * head.turn + 1 + head.nq + j.v, t.v_size)
    smooth, bias = field(d, SMOOTH, j.v, t.v_size), field(d, BIAS, j.v, t.v_size)
    held, given = field(d, CONSTRAINED, j.v, t.v_size), floats(head.given, j.v, t.v_size)
    f, v_f = floats(t.f, 0, t.v_size), floats(t.v_f, 0, t.v_size)
    read_damping(m, d, j.v, vector(t.d, (t.v_size, t.v_size)))
    store(t.gravity, load(head.gravity))
    copy(start, q)
    copy(asked, v_f)
    for i in range(t.v_size):
        v[i] = 0.0
        f[i] = (smooth[i] + bias[i]) + (held[i] - given[i])
    for k in range(t.v_size):
        axis_at(t.axes, k).side = 0.0
    t.stale = 1
    if load_int(d + types.uintp(LIMITS)) > 0:
        call_with_body(t.settle, body_at(t.bodies, 0))
        hand_over_limits(m, d, head, j, t)
    leads = head.lag > 0.0 and not (is_pressed(t) or body_at(t.bodies, 0).asleep != 0)
    a = accelerated(t, head.step_size) if leads else floats(t.a, 0, t.v_size)
    for i in range(t.v_size):
        v[i] = rates[i] + (head.lag * a[i] if leads else 0.0)  # the velocities at the time of the coordinates
    t.stale = 1


@jit
def accelerated(t, step):
    """Accelerations that an engine's step [s] makes of what pushes a tree at rest; its velocities are zero.

    Euler's method damps implicitly there: (M + h D) a = f. By M alone what stiff damping holds would be off at once.
    """
    t.lag, t.stale = step, 1
    call_with_body(t.settle, body_at(t.bodies, 0))
    t.lag = 0.0
    return floats(t.a, 0, t.v_size)


@jit
def is_pressed(t):
    """Whether something presses a body of a tree."""
    pressed = False
    for i in range(t.count):
        pressed = pressed or body_at(t.bodies, i).pressed != 0
    return pressed


@jit
def write_jointed(d, head, j):
    """Put a tree of which a body was touched, or that is at a limit, where the world has it."""
    t = tree_at(world_at(head.world, 0).trees, j.tree)
    touched, asleep = False, body_at(t.bodies, 0).asleep != 0
    for i in range(t.count):
        touched = touched or body_at(t.bodies, i).touched != 0
    for k in range(t.v_size):
        touched = touched or axis_at(t.axes, k).side != 0.0
    if not (touched or asleep):
        return
    q, v, a = floats(t.q, 0, t.q_size), floats(t.v, 0, t.v_size), floats(t.a, 0, t.v_size)
    coordinates, rates = field(d, QPOS, j.q, t.q_size), field(d, QVEL, j.v, t.v_size)
    copy(q, coordinates)
    for i in range(t.v_size):
        rates[i] = 0.0 if asleep else v[i]
    if not (is_pressed(t) or asleep) and head.lag > 0.0:
        for i in range(t.v_size):
            v[i] = 0.0
        accelerated(t, head.step_size)
        for i in range(t.v_size):
            v[i] = rates[i]
            rates[i] -= head.lag * a[i]


@jit
def note_jointed(d, head, j):
    """Keep how a tree was left."""
    t = tree_at(world_at(head.world, 0).trees, j.tree)
    copy(field(d, QPOS, j.q, t.q_size), floats(j.left, 0, t.q_size))
    copy(field(d, QVEL, j.v, t.v_size), floats(j.left, t.q_size, t.v_size))


def press(block, b, arm, force, push):
    """Add a force on a body of a tree [N], at an arm [m] from its centre of mass, to the generalised one there."""
    head, t, first = head_at(block, 0), tree_at(b.tree, 0), 0
    for i in range(head.tree_count):
        j = jointed_at(head.trees, i)
        if tree_at(world_at(head.world, 0).trees, j.tree).bodies == t.bodies:
            first = j.v
    link = link_at(t.links, b.member)
    moment, push_io = cross(add(sub(load(b.position), load(t.origin)), arm), force), floats(push, first, t.v_size)
    k = link.first_axis + link.axes - 1
    while k >= 0:
        axis = axis_at(t.axes, k)
        push_io[k] += dot(load(axis.spin), moment) + dot(load(axis.velocity), force)
        k = axis.before


@jit
def hand_over_limits(m, d, head, j, t):
    """Let the limits of a tree go with its coordinates and velocities, for a step whose other forces are known."""
    first = load_int(d + types.uintp(EQUALITIES)) + load_int(d + types.uintp(FRICTIONS))
    n = t.v_size
    answer, factor = vector(t.room, n), vector(t.factor, (n, n))
    copy(floats(head.given, j.v, n), answer)
    descend(t, factor, answer, n - 1, True)
    ascend(t, factor, answer)
    for row in range(first, first + load_int(d + types.uintp(LIMITS))):
        if entry(d, KIND, row) == JOINT_LIMIT and entry(m, TYPE, entry(d, JOINT, row)) >= SLIDE:
            hand_over(m, d, head, j, row)


@jit
def hand_over(m, d, head, j, row):
    """The same for one limit, if it is of a hinge or slide of the tree."""
    t = tree_at(world_at(head.world, 0).trees, j.tree)
    answer = vector(t.room, t.v_size)
    joint = entry(d, JOINT, row)
    k = entry(m, DOF, joint) - j.v
    force = field(d, FORCE, row, 1)[0]
    if k < 0 or k >= t.v_size or force <= 0.0:
        return
    axis = axis_at(t.axes, k)
    asked = place(head.starts, (1 + head.nq + head.nv) * head.turn + 1)
    q, v = floats(asked, entry(m, COORDINATE, joint), 1)[0], floats(asked, head.nq + j.v + k, 1)[0]
    beyond, ends = field(d, BEYOND, row, 1)[0], field(m, RANGE, 2 * joint, 2)
    r = beyond - field(d, MARGIN, row, 1)[0]
    side = 1.0 if abs(q - ends[0] - beyond) < abs(ends[1] - q - beyond) else -1.0
    reference, weight = field(d, REFERENCE, 4 * row, 3), field(d, WEIGHT, row, 1)[0]
    weight /= 1.0 + weight * mobility_along(t, k)
    axis.side, axis.coordinate, axis.weight = side, entry(m, COORDINATE, joint) - j.q, weight
    axis.edge = side * q - r
    axis.stiffness, axis.resistance = weight * reference[0] * reference[2], weight * reference[1]
    axis.hold = force + axis.stiffness * r + axis.resistance * side * v + weight * side * answer[k]
    vector(t.f, t.v_size)[k] -= side * force


@lru_cache
def addresses() -> dict[str, int]:
    """Of `serve` and `press`, by their names in the head, compiled where there are joints."""
    with compiling("bodies with joints", 5):
        return {"serve": address_of(serve, SERVE, layout.KEY), "press": address_of(press, PRESS, layout.KEY)}
