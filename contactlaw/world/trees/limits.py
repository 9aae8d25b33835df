"""Limits of joints and tendons: soft, as in MuJoCo.

A limit is a row J and a distance r, negative beyond it, that changes at the rate J v. Its force along J is (MuJoCo
documentation, Computation, "Constraint model")

    f = max(0, D (a_ref - J a))        a_ref = -B J v - K r

like that of a mass D on a spring and a damper, which only pushes. J, D, B and K are those of the start of the step; r
follows the displacement since then. Limits of one tree answer each other and are found together, by Gauss-Seidel
sweeps: those of each by itself would add up to too much, and give energy.

`LIMIT.force` acts in all accelerations: f at the start of the step, or in the middle of a step of a flight. In substeps
a limit gives, with the contacts, the impulse by which f differs from it; in implicit steps Newton's method solves for f
at the end of a stage. A limit that does not push resists changes by contacts only of speeds towards the stop: else its
mass would drive what has been knocked off it, and moves away.
"""

from contactlaw.jit import jit_module
from contactlaw.world.data.access import limit_at
from contactlaw.world.trees.dynamics import row_of, solve_ld, solve_lt
from contactlaw.world.trees.kinematics import displace, vector

SWEEPS, SETTLED = 100, 1e-3  # at most; share of its impulse by which a limit may be off after the last


def along(t, i, x):
    """Return J x of a limit."""
    limit, row, out = limit_at(t.limits, i), row_of(t, t.rows, i), 0.0
    for k in range(limit.first, limit.end):
        out += row[k] * x[k]
    return out


def answer_to(t, i):
    """Return the change of velocities by a unit impulse along a limit, an array; found once for a factor."""
    limit, row, x = limit_at(t.limits, i), row_of(t, t.rows, i), row_of(t, t.answers, i)
    if limit.answered == 0:
        for k in range(t.v_size):
            x[k] = row[k]
        solve_lt(t, x, limit.end - 1, limit.end > limit.first + 1)
        solve_ld(t, x)
        limit.answered = 1
    return x


def find(t, change, time, ahead, kicks):
    """Find by how much the impulses of limits in a time [s] differ from those of their forces, and add the answers.

    change: of the velocities in that time, at the present masses. kicks: it is that by contacts and springs alone, in
    the middle of that time; the accelerations add to it. Else it is that by all accelerations, and the forces become
    those after a time `ahead` [s].
    """
    n = t.v_size
    u, v, a = vector(t.room + 16 * n, n), vector(t.v, n), vector(t.a, n)
    displace(t, u)
    for i in range(t.limited):
        limit, own = limit_at(t.limits, i), along(t, i, v)
        if kicks:
            own -= 0.5 * t.held * along(t, i, a)
        r = limit.gap + along(t, i, u) + ahead * own
        limit.speed, limit.push = own, time * (-limit.stiffness * r - limit.resistance * own - limit.force)
        limit.reached, limit.given = 1 if r < 0.0 else 0, 0.0
    for _ in range(SWEEPS):
        changed = 0
        for i in range(t.limited):
            limit = limit_at(t.limits, i)
            if limit.reached == 0 and limit.force == 0.0:
                continue
            gained = along(t, i, change)
            if limit.given != 0.0:
                gained -= along(t, i, answer_to(t, i)) * limit.given
            if kicks and limit.pushes == 0:
                gained = min(limit.speed + gained, 0.0) - min(limit.speed, 0.0)
            gained += time * along(t, i, a) if kicks else 0.0
            mass, least = limit.mass + ahead * (limit.resistance + 0.5 * ahead * limit.stiffness), -time * limit.force
            due = least
            if limit.reached != 0:
                due = limit.push - mass * gained
                if due > 0.0 or least < 0.0:
                    due /= 1.0 + mass * along(t, i, answer_to(t, i))
                due = max(due, least)
            more, limit.given = due - limit.given, due
            if more != 0.0:
                changed += 1 if abs(more) > SETTLED * (due - least) else 0
                x = answer_to(t, i)
                for k in range(n):
                    change[k] += more * x[k]
        if changed < 2:
            break
    for i in range(t.limited):
        limit = limit_at(t.limits, i)
        if kicks:
            limit.pushes = 1 if limit.given > -time * limit.force else 0
        else:
            limit.force += limit.given


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
        limit.given = max(due, 0.0) - limit.force
        for k in range(limit.first, limit.end):
            force[k] += row[k] * limit.given


def add_slopes(t, stage, out):
    """Add what limits that push resist by in a stage [s] of an implicit step to the matrix."""
    for i in range(t.limited):
        limit, row = limit_at(t.limits, i), row_of(t, t.rows, i)
        if limit.given > -limit.force:
            mass = limit.mass + stage * (limit.resistance + stage * limit.stiffness)
            for k in range(limit.first, limit.end):
                for j in range(limit.first, limit.end):
                    out[k, j] += mass * row[k] * row[j]


jit_module(__name__)
