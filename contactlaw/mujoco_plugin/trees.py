"""Kinematic trees: read from mjData into the world, and written back.

Forces. All forces on the joints are those that the engine had in its step (applied, springs, actuators, limits, other
constraints) without the force given for contacts. They are constant within the step, except those in `joint_forces`,
and except damping: f + D (v - v_f), where D = df/dv is the engine's own derivative of passive and actuator forces, and
v_f the velocities that it last evaluated forces at (under Runge-Kutta near the end of the step). Damping of a servo
of one axis keeps to its range, or that of its joint, which an impact would take it far beyond. `free` tells how
velocities are read and written. Here too the half step uses the engine's acceleration, damping and servos included,
but without the centripetal terms, with which energy would be gained.
"""

from typing import Any

from numba import types

from contactlaw.jit import address_of, compiling, jit_module
from contactlaw.memory import caller, doubles_at, whole_at
from contactlaw.mujoco_plugin import joint_forces, layout
from contactlaw.mujoco_plugin.block import entry, floats, gather, head_at, jointed_at, last_state, places_in, scatter
from contactlaw.mujoco_plugin.layout import data_at, model_at
from contactlaw.mujoco_plugin.notices import TOWED, report_once
from contactlaw.world.bodies.motion import is_static
from contactlaw.world.data.access import axis_at, body_at, limit_at, near_at, tree_at, world_at
from contactlaw.world.data.call import BODY_TYPE, VECTOR, call_on_tree, call_with_body
from contactlaw.world.data.records import AGED, LATE
from contactlaw.world.data.tree import ASKED, DENIED, PASSES, PLACED
from contactlaw.world.data.vec import cross, load, norm, scale, store, sub
from contactlaw.world.near.passing import find_passing, leaves_soon, needs_list
from contactlaw.world.state import forget_motion_of
from contactlaw.world.trees.dynamics import add_impulse, solve
from contactlaw.world.trees.kinematics import is_pressed, spread_velocity, vector
from contactlaw.world.trees.limits import find
from contactlaw.world.trees.mobility import clear, copy, leave_placed

FIND, MOVE, READ, WRITE = range(4)
"""Stages of a step, see `serve`."""

SLEEPS = 3  # value of `JOINTED.there` beside `records.ASKED` and `records.PASSES`
# [rad] in a step, beyond which the engine's own flight is not relied on: an arm driven at random gains 7 % of its
# energy in such a step of it (xarm7, in the mean), 2 % below 0.5 rad; with 2 or 4 rad it ran away
STABLE_TURN = 1.0
# [m] or [rad] in a step, by the velocity at its end, and by what this has gained in it where nothing presses: such a
# tree is lost. Of arms that are driven at random and remain stable, none gains more than 4 rad
LOST, LOST_GAIN = 100.0, 10.0

SERVE = types.boolean(types.uint64, types.int64)
PRESS = types.void(types.uint64, BODY_TYPE, VECTOR, VECTOR, types.uint64)
call_trees: Any = caller(SERVE)
call_press: Any = caller(PRESS)

# D by the engine, without the derivative of the bias forces
smooth_derivative = types.ExternalFunction("mjd_smooth_vel", types.void(types.uintp, types.uintp, types.intc))


def serve(block, stage):
    """Take all trees through a stage of the step; return whether none of them was read."""
    head, unread = head_at(block, 0), True
    w = world_at(head.world, 0)
    needed = stage == FIND and ask_trees(head, w)
    for i in range(head.tree_count):
        j = jointed_at(head.trees, i)
        t = tree_at(w.trees, j.tree)
        if stage == FIND:
            find_tree(head, j, t, needed)
        elif stage == MOVE:
            move_tree(head, j, t)
        elif t.passes == PASSES:  # it has passed by everything: its end of the step is the engine's own
            j.there = PASSES
        elif stage == READ:
            if unread and model_at(head.model, 0).opt.integrator != layout.IMPLICITFAST:  # whose step has left it
                smooth_derivative(head.model, head.data, 0)
            unread = False
            read_tree(head, j, t)
        else:
            write_tree(head, j, t)
    if stage == MOVE:
        find_passing(head.world)
    return unread


def move_tree(head, j, t):
    """Move a tree that may pass to where the engine's step has taken it."""
    d, (turn, gain) = data_at(head.data, 0), turns(head, j, t)
    if turn > LOST or (t.passes == ASKED and gain > LOST_GAIN):
        t.passes = PASSES  # the engine goes on with it by itself, without contacts, and finds it unstable
    if t.passes != DENIED:
        set_bodies(head, j, t, (d.qpos, d.qvel))
        for k in range(t.count):
            b = body_at(t.bodies, k)
            b.turned += head.step_size * norm(load(b.spin))
    elif turn <= STABLE_TURN and body_at(t.bodies, 0).asleep == 0:
        world_at(head.world, 0).age = AGED  # how it moves depends on what is near: lists show no age unless it whirls


def whirls(head, j, t):
    """Return whether a tree turns so fast that the world must move it, though not so fast that it is lost."""
    turn, gain = turns(head, j, t)
    return STABLE_TURN < turn <= LOST and gain <= LOST_GAIN


def turns(head, j, t):
    """Return how far [m] or [rad] an axis of a tree moves in the engine's step, and by what it gains in it."""
    turn, gain, after = 0.0, 0.0, doubles_at(data_at(head.data, 0).qvel)
    before, pushed = doubles_at(places_in(head, head.start)[1]), is_pushed(head, j, t)
    for k in range(t.v_size):
        place = whole_at(head.places, j.v + k)
        # the engine's step has held the push of contacts: in an impact what that does is no motion
        v = before[place] if pushed else after[place]
        turn, gain = max(turn, head.step_size * abs(v)), max(gain, head.step_size * abs(v - before[place]))
    return turn, gain


def is_as_left(head, j, t):
    """Return whether the coordinates and velocities of a tree are still those at the end of the last step."""
    differ = 0
    for begin, first, size in ((1, j.q, t.q_size), (1 + head.nq, j.v, t.v_size)):
        for i in range(size):
            k = begin + whole_at(head.places, first + i)
            differ |= whole_at(head.start, k) ^ whole_at(head.left, k)
    return differ == 0


def ask_trees(head, w):
    """Ask trees whether they pass by everything, unless contacts push them; return whether near pairs must be known.

    If so, what is listed near a body that moves decides which trees pass: it is listed for this step. It decides how a
    step is made, too, where other bodies are beside a tree: then lists must show no age.
    """
    if head.free_count + head.mocap_count > 0:
        w.age = AGED
    for i in range(head.tree_count):
        j = jointed_at(head.trees, i)
        t = tree_at(w.trees, j.tree)
        placed = 0 if head.known != 0 or is_as_left(head, j, t) else 1
        for k in range(t.count):
            b = body_at(t.bodies, k)
            b.placed = placed
            if t.passes == PASSES and leaves_soon(b, head.step_size):
                w.stale = 1
        w.stale = max(w.stale, placed)
        decided = body_at(t.bodies, 0).asleep != 0 or w.denied == LATE or is_pushed(head, j, t)
        t.passes = DENIED if decided or whirls(head, j, t) else ASKED
    needed = needs_list(w)
    for i in range(w.body_count if needed else 0):
        b = body_at(w.bodies, i)
        if b.tree == 0 and b.asleep == 0 and not is_static(b):
            w.stale, w.brief = 1, 1
    return needed


def find_tree(head, j, t, needed):
    """Find where a tree is at the start of the step, if that is needed: what sleeps and wakes is met as it is here."""
    w, d = world_at(head.world, 0), data_at(head.data, 0)
    store(t.gravity, load(head.gravity))
    if j.base != 0:
        store(t.base, load(floats(d.xpos, 3 * j.base, 3)))
        copy(floats(d.xquat, 4 * j.base, 4), t.base_turn)
        if not is_static(body_at(w.bodies, t.hangs_on)):
            for k in range(w.nears):
                p, own = near_at(w.near, k), body_at(t.bodies, 0).tree
                if own == body_at(w.bodies, p.body_a).tree or own == body_at(w.bodies, p.body_b).tree:
                    report_once(head, TOWED, float(j.base))
    asleep = body_at(t.bodies, 0).asleep != 0
    known = SLEEPS if asleep else PASSES
    if (needed or asleep) and (w.stale != 0 or j.there != known):  # stale: the motion may be forgotten
        for i in range(t.count):
            forget_motion_of(body_at(t.bodies, i))
        coordinates, velocities = places_in(head, head.start)
        set_bodies(head, j, t, (coordinates, d.qvel))
        for i in range(t.count):
            b = body_at(t.bodies, i)
            store(b.acceleration, load(b.velocity))
            store(b.turning, load(b.spin))
        gather(head, velocities, j.v, vector(t.v, t.v_size))
        spread_velocity(t)
        for i in range(t.count):  # in the mean of the step, which damps joints; they may press it on what it lies on
            b, rate = body_at(t.bodies, i), 1.0 / head.step_size
            store(b.acceleration, scale(rate, sub(load(b.acceleration), load(b.velocity))))
            store(b.turning, scale(rate, sub(load(b.turning), load(b.spin))))
    j.there = SLEEPS if asleep else ASKED


def is_pushed(head, j, t):
    """Return whether the engine's step has moved a tree by the push of contacts."""
    pushed = False
    for k in range(t.v_size):
        pushed = pushed or doubles_at(head.given)[whole_at(head.places, j.v + k)] != 0.0
    return pushed


def set_bodies(head, j, t, state):
    """Set positions and velocities of the bodies of a tree; state: addresses of coordinates and velocities."""
    gather(head, state[0], j.q, vector(t.start, t.q_size))
    gather(head, state[1], j.v, vector(t.v, t.v_size))
    clear(vector(t.x, t.v_size))
    call_with_body(t.move_from_start, body_at(t.bodies, 0))


def read_tree(head, j, t):
    """Read coordinates and velocities at the start of the step, and the forces besides contacts."""
    m, d, n = model_at(head.model, 0), data_at(head.data, 0), t.v_size
    f, v, damping, springs = vector(t.f, n), vector(t.v, n), vector(t.d, (n, n)), vector(t.springs, (n, n))
    coordinates, velocities = places_in(head, head.start)
    t.coupled, t.followed, t.sprung, t.limited = 0, 0, 0, 0
    gather(head, coordinates, j.q, vector(t.q, t.q_size))
    copy(vector(t.q, t.q_size), vector(t.start, t.q_size))
    gather(head, places_in(head, last_state(head))[1], j.v, vector(t.v_f, n))
    for i in range(n):
        k = whole_at(head.places, j.v + i)
        f[i] = doubles_at(d.qfrc_smooth)[k] + doubles_at(d.qfrc_bias)[k]
        f[i] = f[i] + (doubles_at(d.qfrc_constraint)[k] - doubles_at(head.given)[k])
        axis_at(t.axes, i).slope, axis_at(t.axes, i).least, axis_at(t.axes, i).most = 0.0, 0.0, 0.0
        clear(springs[i])
        clear(damping[i])
        entries, carrier = entry(m.D_rowadr, k) + entry(m.D_diag, k), i
        while carrier >= 0:  # the engine keeps the entries of the axes that carry this one, which have earlier rows
            value = -doubles_at(d.qDeriv)[entries]
            damping[i, carrier], damping[carrier, i] = value, value
            t.coupled = 1 if carrier != i and value != 0.0 else t.coupled
            entries, carrier = entries - 1, axis_at(t.axes, carrier).carrier
    clear(v)
    joint_forces.read_equalities(head, j, t)
    joint_forces.read_springs(head, j, t)
    t.stale, t.span, stops = 1, head.step_size, d.nl > 0  # dry friction keeps the engine's force, whatever a is
    asleep = body_at(t.bodies, 0).asleep != 0
    pressed, lags, tendons = is_pressed(t), head.lag > 0.0 and not asleep, m.ntendon != 0
    leads, follows = lags and not pressed, lags and pressed and tendons and body_at(t.bodies, 0).placed == 0
    if (stops or leads or follows) and not asleep:
        clear(vector(t.x, n))
        call_on_tree(t.move, t)
        t.stale = PLACED
    if stops and asleep:  # contacts balance all other forces
        gather(head, head.given, j.v, vector(t.a, n))
        solve(t, vector(t.a, n))
        for i in range(n):
            vector(t.a, n)[i] *= -1.0
    elif not asleep:
        gather(head, velocities, j.v, v)
        if stops:
            spread_velocity(t)
            call_on_tree(t.accelerate, t)
    joint_forces.read_limits(head, j, t)
    change, a = joint_forces.change_of_pulls(head, j, t) if tendons else vector(t.room, n), vector(t.a, n)
    for i in range(n if follows else 0):
        t.followed = 1 if change[i] != 0.0 else t.followed
    if leads or t.followed != 0:
        a = accelerations(head, j, t, velocities, head.step_size)
    gather(head, velocities, j.v, v)
    if t.followed != 0:
        joint_forces.follow_pulls(head, t, change)
    for i in range(n if leads else 0):
        v[i] += head.lag * a[i]  # the velocities at the time of the coordinates
    leave_placed(t)


def accelerations(head, j, t, velocities, lag):
    """Return the accelerations of a tree at velocities, at an address, but without centripetal terms.

    lag: [s], of M + lag D. With the engine's step h this is what its step uses; v then leads by h/2 a. From velocities
    that lead by as much already, the same accelerations follow with h/2. Of springs `discrete` has h^2 K beside M.
    """
    v = vector(t.v, t.v_size)
    clear(v)
    spread_velocity(t)
    gather(head, velocities, j.v, v)
    t.lag, t.ease, t.unmoved = lag, joint_forces.steps_ahead(head), 1
    call_on_tree(t.accelerate, t)
    t.lag, t.ease, t.unmoved = 0.0, 0.0, 0
    leave_placed(t)
    return vector(t.a, t.v_size)


def write_tree(head, j, t):
    """Write a tree to mjData if a contact has touched or pushed it, or it sleeps."""
    n, touched, asleep = t.v_size, is_pushed(head, j, t), body_at(t.bodies, 0).asleep != 0
    if t.stale != 1:  # it has been awake
        j.there = ASKED
    for i in range(t.count):
        touched = touched or body_at(t.bodies, i).touched != 0
    if not (touched or asleep):
        return
    d, v = data_at(head.data, 0), vector(t.v, n)
    if model_at(head.model, 0).ntendon != 0:
        joint_forces.leave_pulls(head, j, t)
    scatter(head, vector(t.q, t.q_size), j.q, d.qpos)
    if asleep:
        clear(v)
    scatter(head, v, j.v, d.qvel)
    if head.lag > 0.0 and not (asleep or is_pressed(t)):
        while t.limited > 0 and limit_at(t.limits, t.limited - 1).gap >= 0.0:
            t.limited -= 1  # what has been reached in this step has not acted half a step ago
        a = accelerations(head, j, t, d.qvel, head.lag)
        if t.limited > 0:
            find(t, a, 1.0, 0.0, False)
        for i in range(n):
            doubles_at(d.qvel)[whole_at(head.places, j.v + i)] -= head.lag * a[i]


def press(block, b, arm, force, push):
    """Add a force on a body of a tree [N], at an arm [m] from its centre of mass, to the generalised force."""
    head, t, first = head_at(block, 0), tree_at(b.tree, 0), 0
    for i in range(head.tree_count):
        j = jointed_at(head.trees, i)
        if tree_at(world_at(head.world, 0).trees, j.tree).bodies == t.bodies:
            first = j.v
    x, push_io = vector(t.x, t.v_size), floats(push, 0, head.nv)
    k = add_impulse(t, b, force, cross(arm, force), x, 0.0)
    while k >= 0:
        push_io[whole_at(head.places, first + k)] += x[k]
        k = axis_at(t.axes, k).parent


def addresses() -> dict[str, int]:
    """Return the addresses of `serve` and `press`, by their fields in the head; compiled on first use."""
    with compiling("bodies with joints", 5):
        return {"tree_stage": address_of(serve, SERVE, layout.KEY), "tree_force": address_of(press, PRESS, layout.KEY)}


jit_module(__name__)
