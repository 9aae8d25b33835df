"""Forces on the joints of a tree that follow the motion within a step: springs, servos, limits, equality constraints.

A spring of stiffness k along a row J adds J^T k J to the stiffness K, by which forces fall with the displacement since
the start of a step: held from there, they would give (k/m) h^2/2 of the energy in each step of h [s] of a contact that
lasts. So do springs of joints, and servos, actuators whose force falls with the length of what they move; springs of
tendons only under Runge-Kutta. As a tendon turns, its force changes in ways that J does not tell: otherwise velocities
follow what changes by more than K says from step to step, see `follow_pulls`.

Limits and dry friction of joints and tendons act in the world as in the engine, see `trees.limits`. If their forces
were held constant, they would go on against a joint that a contact has turned back within the step, and would yield to
an impact on a joint at its stop. Limits that may be reached within the step, of which the engine has no row yet, are
there too.

Equality constraints (welds, connects, joints) are soft too: the force along row J is D (a_ref - J a), with a_ref = -B J
v - K I r. Within the step they act as in the engine. With

    E = J^T D J        and        J^T D (B + h/2 K I) J        added to the damping

the force is the engine's at the accelerations and velocities for which the engine found it, and answers to changes of
both like a mass and a damper. r changes by h/2 J v in the mean over a step h. If the force were held constant, a weld
would go on pushing a light hand with 20 times its weight after a contact has stopped the hand.

The integrator `discrete` evaluates limits and equalities at the end of its step, v + h a and r + h (v + h a), and has
D (1 + h B + h^2 K I) in place of D (MuJoCo documentation, Computation, "Numerical integration").
"""

from math import inf

from numba import types

from contactlaw.jit import jit, jit_module
from contactlaw.memory import doubles_at, load_int, whole_at
from contactlaw.mujoco_plugin import layout
from contactlaw.mujoco_plugin.block import entries, entry, floats, gather, last_state, places_in, spring_at
from contactlaw.mujoco_plugin.layout import data_at, model_at
from contactlaw.world.data.access import axis_at, limit_at
from contactlaw.world.data.quaternion import load4, rotation_vector
from contactlaw.world.data.tree import BALL, SPARE_LIMITS
from contactlaw.world.data.vec import norm, scale, store
from contactlaw.world.trees.dynamics import add_square, pull, row_of, solve
from contactlaw.world.trees.kinematics import displace, is_pressed, vector
from contactlaw.world.trees.limits import find, sticks
from contactlaw.world.trees.mobility import clear, copy

ALWAYS = -1e3  # [m] or [rad], distance of dry friction
EXACT = 1e-9  # relative difference of forces that counts as rounding
FOLLOWS = 10.0  # steps in which a damped servo moves to where it pulls; those that take longer are no springs


def read_limits(head, j, t):
    """Read active limits and friction of a tree; a: its accelerations at the start of the step, but for contacts.

    The engine's forces of limits answer to contacts; those without are found from these.
    """
    d, n, ahead = data_at(head.data, 0), t.v_size, steps_ahead(head)
    f, moved, q = vector(t.f, n), vector(t.room, n), vector(t.q, t.q_size)
    clear(moved)
    if head.start != last_state(head):  # Runge-Kutta evaluates them last near the end of its step
        gather(head, places_in(head, last_state(head))[0], j.q, q)
        displace(t, moved)
        copy(vector(t.start, t.q_size), q)
    for i in range(d.ne, d.ne + d.nf + d.nl):
        span = read_constraint(head, j, t, i, False)
        if add_limit(t, span, doubles_at(d.efc_pos)[i] - doubles_at(d.efc_margin)[i]):
            limit, reference = limit_at(t.limits, t.limited - 1), floats(d.efc_KBIP, 4 * i, 3)
            slopes = slopes_ahead(doubles_at(d.efc_D)[i], reference[1], reference[0] * reference[2], ahead)
            limit.mass, limit.resistance, limit.stiffness = slopes
            limit.force = doubles_at(d.efc_force)[i]
            for k in range(limit.first, limit.end):
                f[k] -= limit.force * vector(t.x, n)[k]
            if i < d.ne + d.nf:  # without stiffness
                limit.gap, limit.friction = ALWAYS, doubles_at(d.efc_frictionloss)[i]
                if is_pressed(t) and sticks(limit):  # without the answer to accelerations, which contacts change
                    most = limit.friction
                    limit.force = min(max(-limit.resistance * along_row(t, t.v), -most), most)
            limit.pushes = 1 if limit.force > 0.0 and limit.friction == 0.0 else 0
    if t.limited > 0:
        find(t, vector(t.a, n), 1.0, 0.0, False)
    foresee_limits(head, j, t)


def add_limit(t, span, gap):
    """Add a limit that does not push, along entries of x; return whether it is one.

    span: its first entry and that after the last. gap: where the engine is. t.room: by how far its places lie ahead.
    """
    x, row, moved, (first, end) = vector(t.x, t.v_size), row_of(t, t.rows, t.limited), vector(t.room, t.v_size), span
    if end == first or t.limited == 2 * t.v_size + SPARE_LIMITS:
        return False
    for k in range(first, end):
        row[k] = x[k]
        gap -= x[k] * moved[k]
    limit = limit_at(t.limits, t.limited)
    limit.first, limit.end, limit.gap, limit.mobility = first, end, gap, 0.0
    limit.force, limit.friction, limit.pushes = 0.0, 0.0, 0
    t.limited += 1
    return True


def foresee_limits(head, j, t):
    """Add the nearer limits of joints and tendons where the engine has found none: they may be reached in the step."""
    m, d, state, x = model_at(head.model, 0), data_at(head.data, 0), last_state(head), vector(t.x, t.v_size)
    if m.opt.disableflags & layout.NO_LIMIT != 0:
        return
    for k in range(t.v_size):
        v = whole_at(head.places, j.v + k)
        one = entry(m.dof_jntid, v)
        if is_set(m.jnt_limited, one) and v == entry(m.jnt_dofadr, one):
            q, ends, end, x[k] = 1 + entry(m.jnt_qposadr, one), floats(m.jnt_range, 2 * one, 2), k + 1, 1.0
            at, low, high = doubles_at(state)[q], ends[0], ends[1]
            if entry(m.jnt_type, one) == BALL:
                turn = rotation_vector(load4(floats(state, q, 4)))
                at, low, high = norm(turn), -inf, max(low, high)
                end = k + 3 if at > 0.0 else k  # at rest it has no direction of its limit yet
                store(x[k:], scale(1.0 / max(at, layout.MINVAL), turn))
            addresses = m.jnt_margin, m.jnt_solref, m.jnt_solimp
            foresee(head, t, (k, end), (at - low, high - at), addresses, one, doubles_at(m.dof_invweight0)[v])
    for one in range(m.ntendon):
        if is_set(m.tendon_limited, one):
            span = read_tendon(head, j, t, one, False)
            at, ends = doubles_at(d.ten_length)[one], floats(m.tendon_range, 2 * one, 2)
            addresses, weights = (m.tendon_margin, m.tendon_solref_lim, m.tendon_solimp_lim), m.tendon_invweight0
            foresee(head, t, span, (at - ends[0], ends[1] - at), addresses, one, doubles_at(weights)[one])


def foresee(head, t, span, gaps, addresses, one, inverse_mass):
    """Add the nearer of two limits along x as beyond the width of its `solimp`, where it then soon is.

    See MuJoCo documentation, Modeling, "Solver parameters". span: of x, see `add_limit`. addresses: of the model's
    margins, `solref` and `solimp`; one: its own there.
    """
    x, gap, flags = vector(t.x, t.v_size), min(gaps[0], gaps[1]), model_at(head.model, 0).opt.disableflags
    for k in range(span[0], span[1] if gaps[1] <= gaps[0] else span[0]):
        x[k] = -x[k]
    gap -= doubles_at(addresses[0])[one]
    if gap < 0.0 or not add_limit(t, span, gap):
        return
    first, second = doubles_at(addresses[1])[layout.REF * one], doubles_at(addresses[1])[layout.REF * one + 1]
    impedance = doubles_at(addresses[2])[layout.IMP * one + 1]
    impedance = min(max(impedance, layout.LEAST_IMPEDANCE), layout.MOST_IMPEDANCE)
    stiffness, damping = -first / impedance, -second / impedance
    if first > 0.0:
        first = max(first, 0.0 if flags & layout.REF_UNSAFE else 2.0 * head.step_size)
        stiffness, damping = 1.0 / (impedance * first * first * second * second), 2.0 / (impedance * first)
    limit, mass = limit_at(t.limits, t.limited - 1), impedance / ((1.0 - impedance) * max(inverse_mass, layout.MINVAL))
    limit.mass, limit.resistance, limit.stiffness = slopes_ahead(mass, damping, stiffness, steps_ahead(head))


def steps_ahead(head):
    """Return how long [s] after the start of its step the engine evaluates limits and equalities."""
    return head.step_size if model_at(head.model, 0).opt.integrator == layout.DISCRETE else 0.0


def slopes_ahead(weight, damping, stiffness, ahead):
    """Return by how much the force D (-B J v - K r - J a) of a soft constraint falls with J a, with J v and with r.

    weight, damping, stiffness: D, B, K; ahead: time [s] after the start of the step at which the engine evaluates it.
    """
    mass = weight / (1.0 + ahead * (damping + ahead * stiffness))
    return mass, mass * damping, mass * stiffness


def read_springs(head, j, t):
    """Read springs, servos and their inertia, and set f to the force at the step's start: Runge-Kutta leaves its end's.

    A servo whose force, or that on its joint, is at its limit or zero is none: no position moves it, or it is disabled.
    Nor is one so damped that it takes FOLLOWS steps to where it pulls. The force of damping ends where ranges do.
    """
    m, d, x = model_at(head.model, 0), data_at(head.data, 0), vector(t.x, t.v_size)
    damping, springs = vector(t.d, (t.v_size, t.v_size)), vector(t.springs, (t.v_size, t.v_size))
    on = m.opt.disableflags & layout.NO_SPRING == 0
    for k in range(t.v_size if on else 0):
        joint = entry(m.dof_jntid, whole_at(head.places, j.v + k))
        springs[k, k] += doubles_at(m.jnt_stiffness)[joint]
    for i in range(j.first_spring, j.first_spring + j.spring_count):
        s = spring_at(head.springs, i)
        if s.armature > 0.0:
            read_arms(head, j, t, s)
            add_square(t, t.e, s.armature)
        if s.tendon != 0 and head.lag == 0.0 and on:
            length, slack = doubles_at(d.ten_length)[s.row], floats(m.tendon_lengthspring, 2 * s.row, 2)
            stiffness = doubles_at(m.tendon_stiffness)[s.row]
            if stiffness > 0.0 and not slack[0] <= length <= slack[1]:
                read_arms(head, j, t, s)
                add_square(t, t.springs, stiffness)
        if s.servo < 0:
            continue
        force = doubles_at(d.actuator_force)[s.row]
        slopes, (low, high) = floats(m.actuator_biasprm, layout.BIAS * s.servo, 3), range_of(m, s)
        if at_limit(force, (low, high)) or not is_on(m, s):
            continue
        read_arms(head, j, t, s)
        stiffness = -slopes[1]
        if slopes[2] < 0.0 and entry(d.moment_rownnz, s.row) == 1:
            bound_damping(t, -slopes[2], low - force, high - force)
        if force == 0.0 or not stiffness > 0.0:
            continue
        moves = False
        for k in range(t.v_size):
            if x[k] != 0.0:
                v = whole_at(head.places, j.v + k)
                if at_limit(doubles_at(d.qfrc_actuator)[v], range_on(m, v)):
                    x[k] = 0.0
                moves = moves or FOLLOWS * head.step_size * stiffness * x[k] * x[k] > damping[k, k]
        if moves:
            add_square(t, t.springs, stiffness)
    for k in range(t.v_size):
        t.sprung = 1 if springs[k, k] != 0.0 else t.sprung
        axis, v = axis_at(t.axes, k), whole_at(head.places, j.v + k)
        (low, high), force = range_on(m, v), doubles_at(d.qfrc_actuator)[v]
        axis.slope = 0.0 if at_limit(force, (low, high)) else axis.slope  # the engine leaves it out of D
        axis.least, axis.most = max(axis.least, min(low - force, 0.0)), min(axis.most, max(high - force, 0.0))
    if head.start != last_state(head):
        gather(head, places_in(head, last_state(head))[0], j.q, vector(t.q, t.q_size))
        pull(t, -1.0, vector(t.f, t.v_size), x)
        gather(head, places_in(head, head.start)[0], j.q, vector(t.q, t.q_size))


def is_on(m, s):
    """Return whether a servo acts: actuators are not disabled, nor is its group."""
    group = entry(m.actuator_group, s.servo)
    off = 0 <= group <= layout.LAST_GROUP and (m.opt.disableactuator >> group) & 1 != 0
    return m.opt.disableflags & layout.NO_ACTUATION == 0 and not off


def is_set(flags, row):
    """Return whether a flag of a row of the model is set; flags: address of an array of bytes."""
    return load_int(types.uintp(flags) + types.uintp(row)) & 255 != 0


def ends_of(flags, ranges, row):
    """Return the range of a row of the model, without end if its flag is not set."""
    ends = floats(ranges, 2 * row, 2)
    return (ends[0], ends[1]) if is_set(flags, row) else (-inf, inf)


def range_on(m, v):
    """Return the range of the force of actuators on the joint of a velocity of the model."""
    return ends_of(m.jnt_actfrclimited, m.jnt_actfrcrange, entry(m.dof_jntid, v))


def at_limit(force, ends):
    """Return whether a force is at an end of its range, but for rounding; a range without width is none."""
    return ends[0] < ends[1] and not ends[0] < (1.0 + EXACT) * force < ends[1]


def range_of(m, s):
    """Return the range of the force of a servo, within that of its tendon."""
    low, high = ends_of(m.actuator_forcelimited, m.actuator_forcerange, s.servo)
    if entry(m.actuator_trntype, s.servo) == layout.TENDON:
        ends = ends_of(m.tendon_actfrclimited, m.tendon_actfrcrange, entry(m.actuator_trnid, 2 * s.servo))
        low, high = max(low, ends[0]), min(high, ends[1])
    return low, high


def bound_damping(t, damping, low, high):
    """Note the damping of a servo of one axis, with the row x, and by how much its force can fall and rise."""
    x = vector(t.x, t.v_size)
    for k in range(t.v_size):
        if x[k] != 0.0:
            axis, one, other = axis_at(t.axes, k), x[k] * low, x[k] * high
            axis.slope, axis.least = axis.slope + damping * x[k] * x[k], axis.least + min(one, other)
            axis.most += max(one, other)


def along_row(t, address):
    """Return the product of the row x and a vector at an address."""
    x, y, out = vector(t.x, t.v_size), vector(address, t.v_size), 0.0
    for k in range(t.v_size):
        out += x[k] * y[k]
    return out


def read_arms(head, j, t, s):
    """Write the lever arms of an actuator or a tendon into x."""
    d = data_at(head.data, 0)
    if s.tendon != 0:
        read_tendon(head, j, t, s.row, True)
    else:
        first, count = entry(d.moment_rowadr, s.row), entry(d.moment_rownnz, s.row)
        read_row(head, j, t, floats(d.actuator_moment, first, count), entries(d.moment_colind, first), True)


def read_tendon_row(head, j, t, tendon, factored):
    """Write the Jacobian of a tendon into x, and return its span, see `read_row`."""
    m, d = model_at(head.model, 0), data_at(head.data, 0)
    first, count = entry(m.ten_J_rowadr, tendon), entry(m.ten_J_rownnz, tendon)
    return read_row(head, j, t, floats(d.ten_J, first, count), entries(m.ten_J_colind, first), factored)


read_tendon = jit(
    read_tendon_row
    if layout.TENDON_ROWS
    else lambda head, j, t, _, factored: read_row(head, j, t, floats(t.x, 0, 0), types.uintp(0), factored)
)


def kept_pulls(head):
    """Return the forces that are kept, shape (nv,), in the state."""
    return floats(data_at(head.data, 0).plugin_state, head.state + head.row - head.nv, head.nv)


def change_of_pulls(head, j, t):
    """Return by how much forces of springs and tendons' servos, but for damping, differ from those kept; keep them."""
    m, d, n = model_at(head.model, 0), data_at(head.data, 0), t.v_size
    change, x, kept = vector(t.room, n), vector(t.x, n), kept_pulls(head)
    gather(head, d.qfrc_spring, j.v, change)
    for i in range(j.first_spring, j.first_spring + j.spring_count):
        s = spring_at(head.springs, i)
        if s.servo >= 0 and entry(m.actuator_trntype, s.servo) == layout.TENDON:
            read_arms(head, j, t, s)
            force, slopes = doubles_at(d.actuator_force)[s.row], floats(m.actuator_biasprm, layout.BIAS * s.servo, 3)
            force -= 0.0 if at_limit(force, range_of(m, s)) else slopes[2] * doubles_at(d.actuator_velocity)[s.row]
            for k in range(n):
                change[k] += force * x[k]
    for k in range(n):
        place = whole_at(head.places, j.v + k)
        force, more = change[k], change[k] - kept[place]
        change[k], kept[place] = more if abs(more) > EXACT * abs(force) else 0.0, force
    return change


def leave_pulls(head, j, t):
    """Add to the forces that are kept by how much K has changed them within the step."""
    x, kept = vector(t.x, t.v_size), kept_pulls(head)
    clear(x)
    pull(t, 1.0, x, vector(t.room, t.v_size))
    for k in range(t.v_size):
        kept[whole_at(head.places, j.v + k)] += x[k]


def follow_pulls(head, t, change):
    """Let a tree have half a step of a change of forces; its mass matrix and damping are those of the start.

    So springs of tendons act by their mean over the step (velocity Verlet): bounces without loss gain omega^2 h^2/3 of
    the energy each, steps by the forces of their start omega^2 h^2/2. An implicit step of one stage would lose all.
    """
    v = vector(t.v, t.v_size)
    solve(t, change)
    for k in range(t.v_size):
        v[k] += head.lag * change[k]


def read_equalities(head, j, t):
    """Read the equality constraints of a tree into E, D and f; f and D hold the other forces."""
    d, n = data_at(head.data, 0), t.v_size
    f, row, ahead = vector(t.f, n), vector(t.x, n), steps_ahead(head)
    gather(head, d.qacc, j.v, vector(t.room, n))
    clear(vector(t.e, n * n))
    for i in range(d.ne):
        read_constraint(head, j, t, i, True)
        reference, whole = floats(d.efc_KBIP, 4 * i, 3), doubles_at(d.efc_D)[i]
        weight, damping, stiffness = slopes_ahead(whole, reference[1], reference[0] * reference[2], ahead)
        spring = 0.5 * head.step_size * stiffness
        push = whole * along_row(t, t.room) + (ahead * stiffness - spring) * along_row(t, t.v_f)
        for k in range(n):
            f[k] += push * row[k]
        add_square(t, t.e, weight)
        add_square(t, t.d, damping + spring)


def read_constraint(head, j, t, i, factored):
    """Write row i of the engine's constraints into x, and return its span, see `read_row`."""
    d, kind = data_at(head.data, 0), model_at(head.model, 0).opt.jacobian
    sparse = kind == layout.SPARSE or (kind == layout.AUTO and head.nv >= layout.SPARSE_FROM)
    first = entry(d.efc_J_rowadr, i) if sparse else i * head.nv
    values = floats(d.efc_J, first, entry(d.efc_J_rownnz, i) if sparse else head.nv)
    return read_row(head, j, t, values, entries(d.efc_J_colind, first) if sparse else types.uintp(0), factored)


def read_row(head, j, t, values, columns, factored):
    """Write a row of a Jacobian of the engine into x; zero if it is not of this tree. Return its span, see `add_limit`.

    columns: address of the numbers of the velocities that its values belong to; 0: they are all. factored: zero also if
    it is not in one row of the tree's factor.
    """
    x = vector(t.x, t.v_size)
    clear(x)
    first, end, left = t.v_size, 0, 0
    for i in range(values.size):
        column = entry(columns, i) if columns != types.uintp(0) else i
        if values[i] != 0.0:
            if whole_at(head.places, head.nv + column) != j.tree:
                clear(x)
                return 0, 0
            k = whole_at(head.places, column)
            x[k] = values[i]
            first, end, left = min(first, k), max(end, k + 1), left + 1
    k = end - 1 if factored else -1
    while k >= 0:
        left -= 1 if x[k] != 0.0 else 0
        k = axis_at(t.axes, k).parent
    if factored and left != 0:
        clear(x)
    return min(first, end), end


jit_module(__name__)
