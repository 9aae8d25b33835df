"""Motion of a tree of bodies between contacts: in free flight, and in the substeps of a leapfrog.

    flight     Runge-Kutta steps of q' = v, v' = a(q, v), of fourth order; short ones of second order
    drift      q <- q + h v + h^2/2 a,  v <- v + h a,  all of the tree's bodies at q

Damping that the steps of a flight are too long to follow is linearly implicit: M + h/2 D replaces M. Steady velocities
remain right. In the leapfrog damping follows the implicit midpoint rule over a group of substeps of T seconds, contacts
included: with M + T/2 D in place of M, v1 - v0 = M^-1 (T (f - D (v0 + v1)/2) + p), from the middle of the group's first
drift, where its kicks begin to count, to that of the next group's. Velocities of rates r > 2/T swing about what
contacts and forces ask for; their mean does not. Where they would for long, see `dynamics`, M + s D, in the first drift
too, reduces each rate r to r/(1 + s r), with s such that no velocity loses more than half in a substep.

Springs kick in each substep of h [s], as contacts do, by the displacement u at its end, with h^2/4 K beside M. Each of
these shears (u, v), so that vibrations keep their energy, and none grows at any omega h. Beyond omega^2 h T/2 = 1, T
the step, the first half of the first substep takes K (u + h/2 v) implicitly, and vibrations decay.

In the leapfrog M and a are held for a few substeps, at their values in the middle of the kicks that end these: the
error is of second order in how far the tree moves in that time. The drift between two such groups uses the a of the
first up to its middle, then that of the second: what rests stays. The middle is predicted with the present contact
forces, as a contains centripetal terms, which jump with v.
"""

from math import ceil, sqrt

from contactlaw.jit import jit_module
from contactlaw.world.data.access import axis_at, body_at, link_at, tree_at
from contactlaw.world.data.call import call_on_tree
from contactlaw.world.data.tree import PLACED
from contactlaw.world.data.vec import add, load, norm, scale, store, sub
from contactlaw.world.trees import limits
from contactlaw.world.trees.kinematics import add_to_coordinates, response_of, spread_velocity, vector
from contactlaw.world.trees.mobility import accelerate, apply_pending, clear, copy, leave_placed, move_bodies

HOLD = 4  # substeps for which M and a are held at most
HOLD_TIME, HOLD_TURN = 2e-3, 0.02  # [s], or [rad] if that takes longer, for which they are held at most
HOLD_LIMIT = 0.1  # [rad] for which they are held at most: held longer, they drive an arm to 1e30 rad/s
HOLD_GAIN = 0.05  # of an error of rates, from one group of substeps to the next, see `predict_midpoint`
LARGEST_TURN, MOST = 0.1, 1e4  # [rad] of a Runge-Kutta step, or a substep; number of steps of a flight, at most
# [rad] the same, at most, and as a share of the turn in a step of the world: velocities of arms that are driven at
# random are then right to 1e-5 (9 flights in 10), where an engine's step has them right to 1e-2. In substeps, too: the
# error becomes 1.5 times that with 0.1 rad (of 145 steps with contacts; median 4e-5, three in four below 1.6e-3)
FAST_TURN, SHARE = 0.35, 0.1
# [rad], or lost share of a velocity, up to which a step is of second order, right to 4e-8, if it is so small a part of
# the world's
SHORT_TURN, SHORT = 0.01, 0.1
LARGEST_DECAY = 0.5  # share of a velocity lost by damping in such a step
STIFF = 4.0  # times more steps of a flight for damping at most; faster damping is implicit


def fly(b, until):
    """Move a tree to a time [s] of the step, in free flight."""
    t = tree_at(b.tree, 0)
    left = until - b.time
    longest = abs(left) / max(min(ceil(abs(left) * t.decay / LARGEST_DECAY), STIFF), 1.0)
    while left != 0.0:
        steps = max(min(ceil(abs(left) * t.change_rate / longest_turn(t)), MOST), ceil(abs(left) / longest - 1e-6))
        h = left / steps
        left = left - h if steps > 1.0 else 0.0
        if t.limited > 0:
            limits.find(t, vector(t.a, t.v_size), 1.0, 0.5 * h, False)
        more = left != 0.0 or until != t.span
        if abs(h) * max(t.change_rate, t.decay) < SHORT_TURN and abs(h) < SHORT * t.span:
            midpoint(t, h, more)
        else:
            runge_kutta(t, h, more)
    for i in range(t.count):
        b = body_at(t.bodies, i)
        b.time, b.placed = until, 0


def longest_turn(t):
    """Return how far [rad] a tree may turn in one step of a flight, or in a substep."""
    return min(max(LARGEST_TURN, SHARE * t.span * t.change_rate), FAST_TURN)


def midpoint(t, h, more):
    """Take one step of h [s] of second order, see `runge_kutta`."""
    n = t.v_size
    q, v, a = vector(t.q, t.q_size), vector(t.v, n), vector(t.a, n)
    q0, v0 = vector(t.room, t.q_size), vector(t.room + 8 * t.q_size, n)
    copy(q, q0)
    copy(v, v0)
    combine(t, 0.5 * h, v, 0.0, v)
    for k in range(n):
        v[k] += 0.5 * h * a[k]
    move_bodies(t)
    call_on_tree(t.accelerate, t)
    copy(q0, q)
    combine(t, h, v, 0.0, v)
    for k in range(n):
        v[k] = v0[k] + h * a[k]
    end_step(t, h, more)


def runge_kutta(t, h, more):
    """Take one step of h [s] of fourth order, on rotations too, from accelerations that belong to q and v.

    more: whether accelerations at its end are needed.

    The classical method, with two moves where one would not commute (Celledoni, Marthinsen & Owren 2003):
    q4 = q moved by h/2 v1, then by h (v3 - v1/2); at the end by h/12 (3 v1 + 2 v2 + 2 v3 - v4), then by
    h/12 (-v1 + 2 v2 + 2 v3 + 3 v4).
    """
    n = t.v_size
    if t.decay * abs(h) > 2.0 * LARGEST_DECAY:
        t.lag, t.ease = 0.5 * abs(h), 0.5 * abs(h)
        call_on_tree(t.accelerate, t)
    q, v, a = vector(t.q, t.q_size), vector(t.v, n), vector(t.a, n)
    rest = t.room + 8 * t.q_size
    q0, v0 = vector(t.room, t.q_size), vector(rest, n)
    middle, gained = vector(rest + 8 * n, n), vector(rest + 16 * n, n)  # v2 + v3; sum of accelerations
    copy(q, q0)
    copy(v, v0)
    clear(middle)
    copy(a, gained)
    for stage in range(3):
        last = stage == 2
        part, weight = (h, 1.0) if last else (0.5 * h, 2.0)
        copy(q0, q)
        if last:
            combine(t, 0.5 * h, v0, 0.0, v)
            add_to_coordinates(t)
        combine(t, part, v, -0.5 * h if last else 0.0, v0)
        for k in range(n):
            v[k] = v0[k] + part * a[k]
            middle[k] += 0.0 if last else v[k]
        move_bodies(t)
        call_on_tree(t.accelerate, t)
        for k in range(n):
            gained[k] += weight * a[k]
    for k in range(n):
        v[k] -= v0[k]
        middle[k] = 2.0 * middle[k] + 2.0 * v0[k] + v[k]  # v1 + 2 v2 + 2 v3 + v4; and v4 - v1 in v
    copy(q0, q)
    combine(t, h / 12.0, middle, -h / 6.0, v)
    add_to_coordinates(t)
    combine(t, h / 12.0, middle, h / 6.0, v)
    for k in range(n):
        v[k] = v0[k] + h / 6.0 * gained[k]
    t.lag, t.ease = 0.0, 0.0
    end_step(t, h, more)


def end_step(t, h, more):
    """Move a tree by x to the end of a step of h [s] of its flight; more: whether it needs accelerations there."""
    move_bodies(t)
    if more:
        accelerate(t)
    else:
        leave_placed(t)
    t.hold, t.held = 0, 0.0
    for i in range(t.count):
        b = body_at(t.bodies, i)
        b.turned += abs(h) * link_at(t.links, i).rate


def combine(t, r, a, s, b):
    """x <- r a + s b."""
    x = vector(t.x, t.v_size)
    for k in range(t.v_size):
        x[k] = r * a[k] + s * b[k]


def drift(b, h):
    """Move a tree for h [s] without contacts, and set `shift` and `twist` of its bodies."""
    t = tree_at(b.tree, 0)
    n = t.v_size
    if t.held == 0.0 and would_swing(t, h):  # else a, and the answer to half a kick, would turn v round within h/2
        t.lag, t.ease = stiff_lag(t, h), 0.5 * h
        accelerate(t)
    apply_pending(t, 0.5 * (t.held + h), t.held == 0.0)  # a has the springs of a first substep's start
    for i in range(t.count):
        one = body_at(t.bodies, i)
        store(one.shift, load(one.position))
        store(one.twist, load(one.spin))
    v, a, x = vector(t.v, n), vector(t.a, n), vector(t.x, n)
    before, fresh = a, t.hold == 0 or t.held != h
    if fresh:
        before = vector(t.room + 8 * (t.q_size + n), n)
        copy(a, before)
        predict_midpoint(t, h)
    t.hold -= 1
    for k in range(n):
        x[k] = h * (v[k] + 0.5 * h * before[k])
        v[k] += 0.5 * h * (before[k] + a[k])
    if fresh and t.hold == 0:  # the bodies are there
        spread_velocity(t)
    else:
        move_bodies(t)
    for k in range(n if fresh else 0):
        before[k] = 0.25 * h * h * (before[k] - a[k])  # by which x is more than the mean of both v has it
    for i in range(t.count):
        one = body_at(t.bodies, i)
        store(one.shift, sub(load(one.position), load(one.shift)))
        store(one.twist, scale(0.5 * h, add(load(one.spin), load(one.twist))))
        if fresh:
            store(one.twist, add(load(one.twist), response_of(t, i, before)[0]))
        one.turned += norm(load(one.twist))
        one.time += h
    clear(vector(t.kick_v, n))
    t.stale = PLACED


def would_swing(t, h):
    """Return whether substeps of h [s] would swing for long by damping or springs, see `dynamics`."""
    return h * t.swing > 1.0


def stiff_lag(t, h):
    """Return s [s] of M + s D, with which no velocity loses more than a share in a substep of h [s]."""
    return h / LARGEST_DECAY - 1.0 / t.decay


def predict_midpoint(t, h):
    """Find mass matrix and accelerations for the next substeps of h [s], at the middle of the kicks that end these.

    For a single substep that is where it ends: coordinates and bodies stay there. Otherwise coordinates are set back.
    Of n substeps that end the step, the last kick is a half one: their middle is n^2/(2 n - 1) h from the first.

    A contact force acts where the tree is, and M belongs to where it was a time T before or will be: torques on a link
    and on what that carries do not cancel. An error of its rate turns the link by T times that, which changes the rate
    by the angular acceleration due to contacts, times T and M_kk over its pivot. A light link that carries a heavy one
    would be unstable if M were held for long.
    """
    n = t.v_size
    rate = max(t.change_rate, 1e-9)
    longest = min(max(min(HOLD_TIME, HOLD_LIMIT / rate), HOLD_TURN / rate), 1.0 / max(t.swing, 1e-9))
    turned = 0.0
    for k in range(n):
        turned = max(turned, abs(vector(t.kick_v, n)[k]) * norm(load(axis_at(t.axes, k).spin)))
    longest = min(longest, sqrt(HOLD_GAIN * h / max(turned * t.coupling, 1e-300)))
    left = max(round((t.span - body_at(t.bodies, 0).time) / h), 1)
    t.hold = min(int(max(min(HOLD, longest / h), 1.0)), left) if t.held == h else 1
    half = h * (0.5 * (t.hold + 1) if t.hold < left else t.hold * t.hold / (2.0 * t.hold - 1.0))
    kicks, known = (half / h - 0.5, 0.5) if t.held > 0.0 else (1.0, 1.0)  # half a kick of the first substep is known
    t.held = h
    stiff = would_swing(t, h)
    t.lag, t.ease = stiff_lag(t, h) if stiff else half - 0.5 * h, 0.5 * h
    q, v, a, x = vector(t.q, t.q_size), vector(t.v, n), vector(t.a, n), vector(t.x, n)
    push, q0, v0 = vector(t.kick_v, n), vector(t.room, t.q_size), vector(t.room + 8 * t.q_size, n)
    damped = vector(t.room + 8 * (t.q_size + 2 * n), n)
    copy(q, q0)
    copy(v, v0)
    for k in range(n):
        damped[k] = v[k] + 0.5 * h * a[k]
        x[k] = half * (v[k] + 0.5 * half * a[k] + 0.5 * (kicks - known) * push[k])
        v[k] += half * a[k] + kicks * push[k]
    move_bodies(t)
    t.midway = 0 if stiff else 1
    accelerate(t)
    t.lag, t.ease, t.midway = 0.0, 0.0, 0
    if t.hold > 1:
        copy(q0, q)
    copy(v0, v)


jit_module(__name__)
