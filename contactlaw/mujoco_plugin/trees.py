"""Kinematic trees: read from mjData into the world, and written back.

Forces. All forces on the joints are those that the engine had in its step (applied, springs, actuators, limits, other
constraints) without the force given for contacts. They are constant within the step, except those of limits and
equalities, and except damping: f + D (v - v_f), where D = df/dv is the engine's own derivative of passive and actuator
forces, and v_f the velocities that it last evaluated forces at (under Runge-Kutta near the end of the step). `free`
tells how velocities are read and written. Here too the half step uses the acceleration of the tree at rest alone: with
the centripetal terms energy would be gained, and damping may be stiff.

A spring of stiffness k along a row J adds h/2 J^T k J to the damping, as its mean force in a step of h [s] is that at
the mean of both ends: the force of the start, held, would give (k/m) h^2/2 of the energy in each step of a contact that
lasts. So do springs of joints and tendons, and servos, actuators whose force falls with the length of what they move.

Joint limits that the engine has found active are soft, and act in the world as in the engine. The force of such a
constraint is f = D (a_ref - a), never less than zero, with a_ref = -B dr/dt - K I r, where r < 0 is the distance of the
joint beyond its limit and a the acceleration of r (MuJoCo documentation, Computation, "Constraint model"). Since a =
a_0 + A f, A = (M^-1)_kk, it changes by -D/(1 + D A) (K I dr + B d(dr/dt) + da_0). If the force were held constant, it
would go on against a joint that a contact has turned back within the step, and would yield to an impact on a joint at
its stop. A limit that becomes active after a contact acts from the engine's next step on, as in the engine.

Equality constraints (welds, connects, joints) are soft too: the force along row J is D (a_ref - J a), with a_ref = -B J
v - K I r. Within the step they act as in the engine. With

    E = J^T D J        and        J^T D (B + h/2 K I) J        added to the damping

the force is the engine's at the accelerations and velocities for which the engine found it, and answers to changes of
both like a mass and a damper. r changes by h/2 J v in the mean over a step h. If the force were held constant, a weld
would go on pushing a light hand with 20 times its weight after a contact has stopped the hand.

Trees that an equality joins are one system, and one tree of the world; those on a moving mocap body are left apart.
"""

from functools import lru_cache
from typing import Any

from numba import types

from contactlaw.jit import address_of, compiling
from contactlaw.memory import caller, doubles_at, whole_at
from contactlaw.mujoco_plugin import layout
from contactlaw.mujoco_plugin.block import entry, floats, head_at, jointed_at, last_state, number, shifted, spring_at
from contactlaw.mujoco_plugin.layout import data_at, jit, model_at
from contactlaw.mujoco_plugin.notices import TOWED, report_once
from contactlaw.world.bodies.motion import is_static
from contactlaw.world.data.access import axis_at, body_at, joint_at, link_at, near_at, tree_at, world_at
from contactlaw.world.data.call import BODY_TYPE, VECTOR, call_on_tree, call_with_body
from contactlaw.world.data.records import ASKED, DENIED, PASSES, PLACED, SLIDE
from contactlaw.world.data.vec import add, cross, dot, load, norm, store, sub
from contactlaw.world.near.passing import find_passing
from contactlaw.world.state import forget_motion_of
from contactlaw.world.trees.dynamics import mobility_along, solve_ld, solve_lt
from contactlaw.world.trees.kinematics import spread_velocity, vector
from contactlaw.world.trees.mobility import clear, copy, leave_placed

FIND, MOVE, READ, WRITE = range(4)
"""Stages of a step, see `serve`."""

SLEEPS = 3  # value of `JOINTED.there` beside `records.ASKED` and `records.PASSES`
# [rad] in a step, beyond which the engine's own flight is not relied on: an arm driven at random gains 7 % of its
# energy in such a step of it (xarm7, in the mean), 2 % below 0.5 rad; with 2 or 4 rad it ran away
STABLE_TURN = 1.0
LOST = 100.0  # [m] or [rad], 16 revolutions, in a step: velocities of a tree that is lost

SERVE = types.boolean(types.uint64, types.int64)
PRESS = types.void(types.uint64, BODY_TYPE, VECTOR, VECTOR, types.uint64)
call_trees: Any = caller(SERVE)
call_press: Any = caller(PRESS)

smooth_derivative = types.ExternalFunction("mjd_smooth_vel", types.void(types.uintp, types.uintp, types.intc))


def serve(block, stage):
    """Take all trees through a stage of the step; return, after READ, whether none of them was read."""
    head = head_at(block, 0)
    if stage == MOVE:
        move_trees(head)
        return False
    if stage == READ:
        return read_trees(head)
    for i in range(head.tree_count):
        j = jointed_at(head.trees, i)
        t = tree_at(world_at(head.world, 0).trees, j.tree)
        if stage == FIND:
            find_tree(head, j, t)
        else:
            write_tree(head, j, t)
    return False


@jit
def move_trees(head):
    """Move the trees that may pass to where the engine's step has taken them, and find which of them do."""
    w, d = world_at(head.world, 0), data_at(head.data, 0)
    for i in range(head.tree_count):
        j = jointed_at(head.trees, i)
        t = tree_at(w.trees, j.tree)
        turn = greatest_step(head, d.qvel, j, t)
        if turn > LOST:
            t.passes = PASSES  # the engine goes on with it by itself, without contacts, and finds it unstable
        elif turn > STABLE_TURN:
            t.passes = DENIED
        if t.passes != DENIED:
            set_bodies(head, j, t, (d.qpos, d.qvel))
            for k in range(t.count):
                b = body_at(t.bodies, k)
                b.turned += head.step_size * norm(load(b.spin))
    find_passing(head.world)


@jit
def read_trees(head):
    """Read the trees that may touch something; return whether there are none.

    All others have passed by everything, so their end of the step is the engine's own.
    """
    w, known = world_at(head.world, 0), False
    for i in range(head.tree_count):
        j = jointed_at(head.trees, i)
        t = tree_at(w.trees, j.tree)
        if t.passes == PASSES:
            j.there = PASSES
            continue
        if not known:  # D by the engine, without the derivative of the bias forces
            smooth_derivative(head.model, head.data, 0)
            known = True
        read_tree(head, j, t)
    return not known


@jit
def gather(head, source, first, target):
    """Copy numbers of the model, at an address, to those of a tree; their places begin at `first` in `head.places`."""
    for i in range(target.size):
        target[i] = number(source, whole_at(head.places, first + i))


@jit
def scatter(head, source, first, target):
    """Copy numbers of a tree to those of the model, at an address; their places begin at `first` in `head.places`."""
    for i in range(source.size):
        doubles_at(shifted(target, whole_at(head.places, first + i)))[0] = source[i]


@jit
def places_in(head, state):
    """Return the addresses of coordinates and velocities in a state at an address."""
    return shifted(state, 1), shifted(state, 1 + head.nq)


@jit
def greatest_step(head, velocities, j, t):
    """Return how far [m] or [rad] the fastest axis of a tree moves in a step, at most."""
    most = 0.0
    for i in range(t.v_size):
        most = max(most, abs(number(velocities, whole_at(head.places, j.v + i))))
    return most * head.step_size


@jit
def is_as_left(head, j, t):
    """Return whether the coordinates and velocities of a tree are still those at the end of the last step."""
    differ = 0
    for begin, first, size in ((1, j.q, t.q_size), (1 + head.nq, j.v, t.v_size)):
        for i in range(size):
            k = begin + whole_at(head.places, first + i)
            differ |= whole_at(head.start, k) ^ whole_at(head.left, k)
    return differ == 0


@jit
def find_tree(head, j, t):
    """Find where a tree is at the start of the step; it passes by everything until something says otherwise."""
    w, d = world_at(head.world, 0), data_at(head.data, 0)
    if j.base != 0:
        store(t.base, load(floats(d.xpos, 3 * j.base, 3)))
        copy(floats(d.xquat, 4 * j.base, 4), t.base_turn)
        if not is_static(body_at(w.bodies, t.hangs_on)):
            report_towed(head, w, j, t)
    placed = not is_as_left(head, j, t)
    for i in range(t.count):
        body_at(t.bodies, i).placed = 1 if placed else 0
    if placed:
        w.stale = 1
    t.passes = DENIED if body_at(t.bodies, 0).asleep != 0 else ASKED
    if w.stale != 0 or j.there != (SLEEPS if t.passes == DENIED else PASSES):  # stale: the motion may be forgotten
        for i in range(t.count):
            forget_motion_of(body_at(t.bodies, i))
        set_bodies(head, j, t, places_in(head, head.start))
    j.there = SLEEPS if t.passes == DENIED else ASKED


@jit
def report_towed(head, w, j, t):
    """Report a tree on a moving mocap body, if anything is near: its contacts do not know the velocity of that body."""
    for k in range(w.nears):
        p, own = near_at(w.near, k), body_at(t.bodies, 0).tree
        if own == body_at(w.bodies, p.body_a).tree or own == body_at(w.bodies, p.body_b).tree:
            report_once(head, TOWED, float(j.base))


@jit
def set_bodies(head, j, t, state):
    """Set positions and velocities of the bodies of a tree; state: addresses of coordinates and velocities."""
    gather(head, state[0], j.q, vector(t.start, t.q_size))
    gather(head, state[1], j.v, vector(t.v, t.v_size))
    clear(vector(t.x, t.v_size))
    call_with_body(t.move_from_start, body_at(t.bodies, 0))


@jit
def read_tree(head, j, t):
    """Read coordinates and velocities at the start of the step, and the forces besides contacts."""
    m, d, n = model_at(head.model, 0), data_at(head.data, 0), t.v_size
    f, v, damping, springs = vector(t.f, n), vector(t.v, n), vector(t.d, (n, n)), vector(t.springs, (n, n))
    coordinates, velocities = places_in(head, head.start)
    store(t.gravity, load(head.gravity))
    t.coupled = 0
    gather(head, coordinates, j.q, vector(t.q, t.q_size))
    gather(head, places_in(head, last_state(head))[1], j.v, vector(t.v_f, n))
    for i in range(n):
        k, axis = whole_at(head.places, j.v + i), axis_at(t.axes, i)
        f[i] = number(d.qfrc_smooth, k) + number(d.qfrc_bias, k)
        f[i] = f[i] + (number(d.qfrc_constraint, k) - number(head.given, k))
        axis.side = 0.0
        entries, other, carrier = entry(m.D_rowadr, k) + entry(m.D_diag, k), i, i
        for p in range(axis.depth, -1, -1):  # the engine keeps the entries of the axes that carry this one
            damping[i, p], springs[i, p] = 0.0, 0.0
            if other == carrier:
                damping[i, p] = -number(d.qDeriv, entries)
                if other != i and damping[i, p] != 0.0:
                    t.coupled = 1
                entries, carrier = entries - 1, axis_at(t.axes, carrier).carrier
            other = axis_at(t.axes, other).parent
    clear(v)
    read_equalities(head, j, t)
    t.stale, t.span = 1, head.step_size
    asleep = body_at(t.bodies, 0).asleep != 0
    leads = head.lag > 0.0 and not (is_pressed(t) or asleep)
    if (d.nl > 0 or leads) and not asleep:
        clear(vector(t.x, n))
        call_on_tree(t.move, t)
        t.stale = PLACED
    if d.nl > 0:
        if not asleep:
            rest_accelerations(t, 0.0)
        read_limits(head, j, t)
    a = rest_accelerations(t, head.step_size) if leads else vector(t.a, n)
    gather(head, velocities, j.v, v)
    read_springs(head, j, t)
    for i in range(n if leads else 0):
        v[i] += head.lag * a[i]  # the velocities at the time of the coordinates
    leave_placed(t)


@jit
def rest_accelerations(t, step):
    """Return the accelerations of the engine's step [s] for a tree whose velocities have been set to zero.

    Euler's method damps implicitly: (M + h D) a = f. With M alone, a joint that stiff damping holds would move off.
    """
    spread_velocity(t)
    t.lag = step
    call_on_tree(t.accelerate, t)
    t.lag = 0.0
    leave_placed(t)
    return vector(t.a, t.v_size)


@jit
def is_pressed(t):
    """Return whether a contact presses a body of a tree."""
    pressed = False
    for i in range(t.count):
        pressed = pressed or body_at(t.bodies, i).pressed != 0
    return pressed


@jit
def write_tree(head, j, t):
    """Write a tree to mjData if a contact has touched it, a limit is active or it sleeps."""
    n, touched, asleep = t.v_size, False, body_at(t.bodies, 0).asleep != 0
    for i in range(t.count):
        touched = touched or body_at(t.bodies, i).touched != 0
    for k in range(n):
        touched = touched or axis_at(t.axes, k).side != 0.0
    if not (touched or asleep):
        return
    d, v = data_at(head.data, 0), vector(t.v, n)
    scatter(head, vector(t.q, t.q_size), j.q, d.qpos)
    if asleep:
        clear(v)
    scatter(head, v, j.v, d.qvel)
    if head.lag > 0.0 and not (asleep or is_pressed(t)):
        move_springs(head, j, t)
        clear(v)
        a = rest_accelerations(t, head.step_size)
        gather(head, d.qvel, j.v, v)
        for i in range(n):
            doubles_at(shifted(d.qvel, whole_at(head.places, j.v + i)))[0] -= head.lag * a[i]


@jit
def move_springs(head, j, t):
    """Set the forces of springs and servos to those at the end of the step, and leave them out of D.

    So the engine evaluates them; what turns by a quaternion counts as turned by its velocity.
    """
    n, q, x = t.v_size, vector(t.q, t.q_size), vector(t.x, t.v_size)
    f, v, v_f = vector(t.f, n), vector(t.v, n), vector(t.v_f, n)
    damping, springs = vector(t.d, (n, n)), vector(t.springs, (n, n))
    before, start = vector(t.room, t.q_size), places_in(head, head.start)
    gather(head, start[0], j.q, before)
    for k in range(n):
        x[k] = v_f[k] - 2.0 * v[k]
    for i in range(t.joint_count):
        joint = joint_at(t.joints, i)
        if joint.kind >= SLIDE:
            k = joint.first_q
            x[joint.first_axis] = v_f[joint.first_axis] - 2.0 / head.step_size * (q[k] - before[k])
    for k in range(n):
        i, p = k, axis_at(t.axes, k).depth
        while i >= 0:
            spring = springs[k, p]
            f[k] += spring * x[i]
            f[i] += spring * x[k] if i != k else 0.0
            damping[k, p] -= spring
            i, p = axis_at(t.axes, i).parent, p - 1


def press(block, b, arm, force, push):
    """Add a force on a body of a tree [N], at an arm [m] from its centre of mass, to the generalised force."""
    head, t, first = head_at(block, 0), tree_at(b.tree, 0), 0
    for i in range(head.tree_count):
        j = jointed_at(head.trees, i)
        if tree_at(world_at(head.world, 0).trees, j.tree).bodies == t.bodies:
            first = j.v
    link = link_at(t.links, b.member)
    moment, push_io = cross(add(sub(load(b.position), load(t.origin)), arm), force), floats(push, 0, head.nv)
    k = link.first_axis + link.axes - 1
    while k >= 0:
        axis = axis_at(t.axes, k)
        push_io[whole_at(head.places, first + k)] += dot(load(axis.spin), moment) + dot(load(axis.velocity), force)
        k = axis.carrier


@jit
def read_limits(head, j, t):
    """Read the active joint limits of a tree; the other forces of the step are known."""
    m, d, n = model_at(head.model, 0), data_at(head.data, 0), t.v_size
    first = d.ne + d.nf
    answer, factor = vector(t.room, n), vector(t.factor, (n, n))
    gather(head, head.given, j.v, answer)
    solve_lt(t, factor, answer, n - 1, True)
    solve_ld(t, factor, answer)
    for row in range(first, first + d.nl):
        joint, force = entry(d.efc_id, row), number(d.efc_force, row)
        if entry(d.efc_type, row) != layout.JOINT_LIMIT or entry(m.jnt_type, joint) < SLIDE or force <= 0.0:
            continue
        place, coordinate = entry(m.jnt_dofadr, joint), entry(m.jnt_qposadr, joint)
        if whole_at(head.places, head.nv + place) != j.tree:
            continue
        k = whole_at(head.places, place)
        axis, ends, reference = axis_at(t.axes, k), floats(m.jnt_range, 2 * joint, 2), floats(d.efc_KBIP, 4 * row, 3)
        q, v = number(last_state(head), 1 + coordinate), number(last_state(head), 1 + head.nq + place)
        beyond, weight = number(d.efc_pos, row), number(d.efc_D, row)
        r = beyond - number(d.efc_margin, row)
        side = 1.0 if abs(q - ends[0] - beyond) < abs(ends[1] - q - beyond) else -1.0
        weight /= 1.0 + weight * mobility_along(t, k)
        axis.side, axis.weight = side, weight
        axis.edge = side * q - r
        axis.stiffness, axis.resistance = weight * reference[0] * reference[2], weight * reference[1]
        axis.hold = force + axis.stiffness * r + axis.resistance * side * v + weight * side * answer[k]
        vector(t.f, n)[k] -= side * force


@jit
def read_springs(head, j, t):
    """Add springs and servos to f, D and the part of D that is theirs; v: velocities at the start of the step.

    A servo whose force, or that on its joint, is at its limit or zero is none: no position moves it, or it is disabled.
    """
    m, d, x = model_at(head.model, 0), data_at(head.data, 0), vector(t.x, t.v_size)
    if m.opt.disableflags & layout.NO_SPRING == 0:
        for k in range(t.v_size):
            stiffness = number(m.jnt_stiffness, entry(m.dof_jntid, whole_at(head.places, j.v + k)))
            if stiffness > 0.0:
                clear(x)
                x[k] = 1.0
                add_spring(head, t, k, stiffness)
    for i in range(j.first_spring, j.first_spring + j.spring_count):
        s = spring_at(head.springs, i)
        if s.actuator < 0:
            read_tendon(head, j, t, s.row)
            continue
        force, stiffness = number(d.actuator_force, s.row), -number(m.actuator_biasprm, layout.BIAS * s.actuator + 1)
        if force == 0.0 or not stiffness > 0.0 or at_limit(force, floats(m.actuator_forcerange, 2 * s.actuator, 2)):
            continue
        first, count = entry(d.moment_rowadr, s.row), entry(d.moment_rownnz, s.row)
        last = read_row(head, j, t, floats(d.actuator_moment, first, count), entries(d.moment_colind, first))
        k = last
        while k >= 0:
            v = whole_at(head.places, j.v + k)
            limits = floats(m.jnt_actfrcrange, 2 * entry(m.dof_jntid, v), 2)
            if at_limit(number(d.qfrc_actuator, v), limits):
                x[k] = 0.0
            k = axis_at(t.axes, k).parent
        add_spring(head, t, last, stiffness)


@jit
def at_limit(force, ends):
    """Return whether a force is at an end of its range; a range without width is none."""
    return ends[0] < ends[1] and not ends[0] < force < ends[1]


@jit
def add_spring(head, t, last, stiffness):
    """Add a spring along the row x, whose last axis is given, to f, D and `springs`."""
    n, step = t.v_size, head.step_size
    f, v, x = vector(t.f, n), vector(t.v, n), vector(t.x, n)
    damping, springs = vector(t.d, (n, n)), vector(t.springs, (n, n))
    ahead = 0.5 if head.start == last_state(head) else -0.5  # steps from where forces were evaluated to the middle
    speed, k = 0.0, last
    while k >= 0:
        speed += x[k] * v[k]
        k = axis_at(t.axes, k).parent
    k = last
    while k >= 0:
        p, other, pull = axis_at(t.axes, k).depth, k, step * stiffness * x[k]
        f[k] -= ahead * pull * speed
        while other >= 0 and pull != 0.0:
            part = 0.5 * pull * x[other]
            springs[k, p] += part
            damping[k, p] += part
            t.coupled = 1 if other != k and part != 0.0 else t.coupled
            p, other = p - 1, axis_at(t.axes, other).parent
        k = axis_at(t.axes, k).parent


def read_tendon_spring(head, j, t, tendon):
    """Add the spring of a tendon, unless it is slack."""
    m, d = model_at(head.model, 0), data_at(head.data, 0)
    length, slack = number(d.ten_length, tendon), floats(m.tendon_lengthspring, 2 * tendon, 2)
    stiffness = number(m.tendon_stiffness, tendon)
    if m.opt.disableflags & layout.NO_SPRING == 0 and stiffness > 0.0 and not slack[0] <= length <= slack[1]:
        first, count = entry(m.ten_J_rowadr, tendon), entry(m.ten_J_rownnz, tendon)
        last = read_row(head, j, t, floats(d.ten_J, first, count), entries(m.ten_J_colind, first))
        add_spring(head, t, last, stiffness)


read_tendon = jit(read_tendon_spring if layout.TENDON_ROWS else lambda head, j, t, tendon: None)


@jit
def entries(address, first):
    """Return the address of element `first` of an array of C int."""
    return types.uintp(address) + types.uintp(4 * first)


@jit
def read_equalities(head, j, t):
    """Read the equality constraints of a tree into E, D and f; f and D hold the other forces."""
    d, n = data_at(head.data, 0), t.v_size
    inertia, damping, row = vector(t.e, (n, n)), vector(t.d, (n, n)), vector(t.x, n)
    f, v, a = vector(t.f, n), vector(t.v_f, n), vector(t.room, n)
    gather(head, d.qacc, j.v, a)
    for k in range(n):
        clear(inertia[k])
    sparse = d.nJ != d.nefc * head.nv  # a sparse Jacobian without zeros has the order of a dense one
    for i in range(d.ne):
        first = entry(d.efc_J_rowadr, i) if sparse else i * head.nv
        values = floats(d.efc_J, first, entry(d.efc_J_rownnz, i) if sparse else head.nv)
        last = read_row(head, j, t, values, entries(d.efc_J_colind, first) if sparse else types.uintp(0))
        reference, weight = floats(d.efc_KBIP, 4 * i, 3), number(d.efc_D, i)
        spring = 0.5 * head.step_size * weight * reference[0] * reference[2]
        k, push = last, 0.0
        while k >= 0:
            push += row[k] * (weight * a[k] - spring * v[k])
            k = axis_at(t.axes, k).parent
        t.coupled, k = 1 if last >= 0 else t.coupled, last
        while k >= 0:
            f[k] += push * row[k]
            p, other = axis_at(t.axes, k).depth, k
            while other >= 0:
                inertia[k, p] += weight * row[k] * row[other]
                damping[k, p] += (weight * reference[1] + spring) * row[k] * row[other]
                p, other = p - 1, axis_at(t.axes, other).parent
            k = axis_at(t.axes, k).parent


@jit
def read_row(head, j, t, values, columns):
    """Write a row of a Jacobian of the engine into x; return its last axis, -1 if it is not of this tree.

    columns: address of the numbers of the velocities that its values belong to; 0: they are all.
    """
    x = vector(t.x, t.v_size)
    clear(x)
    last, left = -1, 0
    for i in range(values.size):
        column = entry(columns, i) if columns != types.uintp(0) else i
        if values[i] != 0.0:
            if whole_at(head.places, head.nv + column) != j.tree:
                return -1
            k = whole_at(head.places, column)
            x[k] = values[i]
            last, left = max(last, k), left + 1
    k = last
    while k >= 0:
        left -= 1 if x[k] != 0.0 else 0
        k = axis_at(t.axes, k).parent
    return last if left == 0 else -1


@lru_cache
def addresses() -> dict[str, int]:
    """Return the addresses of `serve` and `press`, by their fields in the head; compiled on first use."""
    with compiling("bodies with joints", 5):
        return {"tree_stage": address_of(serve, SERVE, layout.KEY), "tree_force": address_of(press, PRESS, layout.KEY)}
