"""Limits of joints and tendons, and their dry friction: soft, as in MuJoCo.

A limit is a row J and a distance r, negative beyond it, that changes at the rate J v. Its force along J is (MuJoCo
documentation, Computation, "Constraint model")

    f = D (a_ref - J a)        a_ref = -B J v - K r        0 <= f

like that of a mass D on a spring and a damper, which only pushes. Dry friction (`frictionloss`) is such a row too, with
K = 0 and |f| at most the friction. J, D, B and K are those of the start of the step; r follows the displacement since
then. Rows of one tree answer each other and are found together, by Gauss-Seidel sweeps: those of each by itself would
add up to too much, and give energy. With M = L^T P L and y = L^-T J^T, an impulse along one row changes the speed along
another by y' P^-1 y; the velocities follow from the sum of impulses times y.

Dry friction keeps the engine's force until contacts kick the tree in substeps, and where it slides in implicit steps
too. There friction that sticks is such a row, without bounds: between these Newton's method would swing. Constant, it
would drive a leg that stands, as an engine's forces answer to accelerations that contacts do not let happen.

`LIMIT.force` acts in all accelerations: f at the start of the step, or in the middle of a step of a flight. In substeps
a limit gives, with the contacts, the impulse by which f differs from it; in implicit steps Newton's method solves for f
at the end of a stage. A limit that does not push resists changes by contacts only of speeds towards the stop: else its
mass would drive what has been knocked off it, and moves away.
"""

from contactlaw.jit import jit_module, jit_of_sums
from contactlaw.world.data.access import axis_at, limit_at
from contactlaw.world.trees.dynamics import row_of, solve_ld, solve_lt
from contactlaw.world.trees.kinematics import add_multiple, displace, entries, vector

SWEEPS, SETTLED = 100, 1e-3  # at most; share of its impulse by which a row may be off after the last


def along(t, i, x):
    """Return J x of a limit."""
    limit = limit_at(t.limits, i)
    return product(row_of(t, t.rows, i), x, limit.first, limit.end)


def answer(t, i, z):
    """Return the speed along a limit, y P^-1 z, by impulses whose sum times their rows y is z."""
    limit, row, y = limit_at(t.limits, i), row_of(t, t.rows, i), row_of(t, t.answers, i)
    if limit.mobility == 0.0:  # of a new factor
        for k in range(limit.end):
            y[k] = row[k] if k >= limit.first else 0.0
        solve_lt(t, y, limit.end - 1, limit.end > limit.first + 1)
        for k in range(limit.end):
            if y[k] != 0.0:
                y[k] *= axis_at(t.axes, k).root
                limit.mobility += y[k] * y[k]
    return product(y, z, 0, limit.end)


@jit_of_sums
def product(x, y, start, end):
    """Return the product of the same part of two vectors."""
    out = 0.0
    for k in entries(start, end):
        out += x[k] * y[k]
    return out


def find(t, change, time, ahead, kicks):
    """Find by how much the impulses of limits in a time [s] differ from those of their forces, and add the answers.

    change: of the velocities in that time, at the present masses. kicks: it is that by contacts and springs alone, in
    the middle of that time; the accelerations add to it. Else it is that by all accelerations, and the forces become
    those after a time `ahead` [s].
    """
    n, acting = t.v_size, False
    z, v, a = vector(t.room + 16 * n, n), vector(t.v, n), vector(t.a, n)
    displace(t, z)
    for i in range(t.limited):
        limit = limit_at(t.limits, i)
        r = limit.gap + along(t, i, z) + (ahead * along(t, i, v) if ahead > 0.0 else 0.0)
        limit.reached, limit.given = 1 if r < 0.0 else 0, 0.0
        held = limit.friction > 0.0 and limit.pushes == 0 and not kicks  # no contact has kicked the tree in this step
        limit.acting = 1 if (r < 0.0 or limit.force != 0.0) and not held else 0
        if limit.acting != 0:
            limit.rest = along(t, i, a) if kicks else 0.0
            own = along(t, i, v) - 0.5 * t.held * limit.rest
            limit.speed, limit.push = own, time * (-limit.stiffness * r - limit.resistance * own - limit.force)
            limit.gained = along(t, i, change)
            acting = True
    for k in range(n):
        z[k] = 0.0
    for _ in range(SWEEPS if acting else 0):
        changed = 0
        for i in range(t.limited):
            limit = limit_at(t.limits, i)
            if limit.acting == 0:
                continue
            gained = limit.gained + answer(t, i, z) - limit.mobility * limit.given
            if kicks and limit.pushes == 0 and limit.friction == 0.0:
                gained = min(limit.speed + gained, 0.0) - min(limit.speed, 0.0)
            due = least = time * (-limit.friction - limit.force)
            if limit.reached != 0:
                mass = limit.mass + ahead * (limit.resistance + 0.5 * ahead * limit.stiffness)
                due = (limit.push - mass * (gained + time * limit.rest)) / (1.0 + mass * limit.mobility)
                due = max(due, least)
                if limit.friction > 0.0:
                    due = min(due, time * (limit.friction - limit.force))
            more, limit.given, y = due - limit.given, due, row_of(t, t.answers, i)
            changed += 1 if abs(more) > SETTLED * abs(due + time * limit.force) else 0
            add_multiple(z, more, y, 0, limit.end if more != 0.0 else 0)
        if changed < 2:
            break
    if acting:
        for k in range(n):
            z[k] /= axis_at(t.axes, k).root
        solve_ld(t, z)
        add_multiple(change, 1.0, z, 0, n)
    for i in range(t.limited):
        limit = limit_at(t.limits, i)
        if kicks:
            limit.pushes = 1 if limit.given > -time * limit.force or limit.friction > 0.0 else 0
        else:
            limit.force += limit.given


def sticks(limit):
    """Return whether dry friction holds its joint."""
    return abs(limit.force) < limit.friction


def resist(t, force, x, rate):
    """Add to `force` by how much limits push more than `LIMIT.force` at the end of a stage of an implicit step.

    x times rate: by how much the accelerations there are less than those without contacts.
    """
    n = t.v_size
    u, v, a = vector(t.room + 16 * n, n), vector(t.v, n), vector(t.a, n)
    displace(t, u)
    for i in range(t.limited):
        limit, row = limit_at(t.limits, i), row_of(t, t.rows, i)
        r, gained = limit.gap + along(t, i, u), along(t, i, a) - rate * along(t, i, x)
        due = -limit.stiffness * r - limit.resistance * along(t, i, v) - limit.mass * gained if r < 0.0 else 0.0
        due = due if sticks(limit) else max(due, 0.0) if limit.friction == 0.0 else limit.force
        limit.given = due - limit.force
        for k in range(limit.first, limit.end):
            force[k] += row[k] * limit.given


def add_slopes(t, stage, out):
    """Add what limits that push resist by in a stage [s] of an implicit step to the matrix."""
    for i in range(t.limited):
        limit, row = limit_at(t.limits, i), row_of(t, t.rows, i)
        if sticks(limit) or (limit.friction == 0.0 and limit.given > -limit.force):
            mass = limit.mass + stage * (limit.resistance + stage * limit.stiffness)
            for k in range(limit.first, limit.end):
                for j in range(limit.first, limit.end):
                    out[k, j] += mass * row[k] * row[j]


jit_module(__name__)
