"""Contacts that share bodies, integrated together inside one step of an engine.

Between touches the contacts drift in closed form; while any of them is closed they are stepped by a leapfrog that
resolves the fastest. The force at the end of one engine step is where the next one starts, so that contacts longer
than the step are the same leapfrog as those that come and go within it.
"""

from __future__ import annotations

from math import ceil, sqrt

from contactlaw.jit import jit
from contactlaw.kernels.contact import (
    E_STAR,
    FRICTION,
    G_STAR,
    LINEAR,
    NORMAL,
    OVERLAP,
    PHASE,
    RATIO,
    TANGENTIAL,
    ZETA,
    displace,
    forget,
    step,
    stuck_stiffness,
)
from contactlaw.kernels.rows import (
    BEGUN,
    CLOSED,
    DEEPEST,
    DRAG,
    EARLY,
    FASTEST,
    FROM,
    IMPULSE,
    LAW_AT,
    LAW_SIZE,
    LEDGER,
    MOTION,
    OVERLAP_NOW,
    PIECES,
    PUSH,
    SLID,
    SPENT,
    STRAYED,
    STRONGEST,
    TOUCHING,
    UNTIL,
    WORK,
)
from contactlaw.kernels.workspace import numbers, table
from contactlaw.laws.hertz import time_scale
from contactlaw.laws.record import OPEN, pair_of

CHUNK = 16  # substeps of one length; then the time scales are looked at again
MOST_SUBSTEPS = 50_000  # in one engine step; for what is left of it then the contacts stand, see `stand`
SWEEPS, ENOUGH = 200, 1e-12  # over the contacts that are to stand; of the speeds, what they may leave
NEVER = 1e300
# A contact with less than this share of its elastic energy in motion, and balanced as well, carries a load and swings.
SWINGING, FEWEST = 0.1, 20.0
CALM = 0.3
NO_MATTER = 1e-8  # of the friction limit: what a displacement must amount to for the law to be asked about it
# The damper sets in as the fourth root of time; of such a force the trapezoidal rule leaves out -zeta(-1/4) of a step.
STEEP = 0.3205
# zeta(-3/2, s) - zeta(-3/2) less s^(3/2), over s, in powers of s on (0, 1], to 5e-5: see `parting`.
PARTING = (-0.31173634, -0.54936033, -0.15511241, 0.01625482)


@jit
def parameters_of(row, parameters):
    """Parameters of a row's contact."""
    start = int(row[LAW_AT])
    return parameters[start : start + int(row[LAW_SIZE])]


@jit
def next_touch(overlap, closing, push):
    """Time [s] until a contact that is apart (overlap <= 0) closes, if nothing else happens."""
    if overlap == 0.0 and closing > 0.0:
        return 0.0
    square = closing * closing - 2.0 * push * overlap
    if square < 0.0:
        return NEVER
    if closing > 0.0:
        return -2.0 * overlap / (closing + sqrt(square))
    if push > 0.0:
        return (sqrt(square) - closing) / push
    return NEVER


@jit
def resume(row, p, h, own, force_out):
    """Force at the start of the step, from the history: the overlap is the engine's, the tractions are remembered."""
    overlap = row[OVERLAP_NOW]
    if overlap <= 0.0:
        forget(h)
    elif h[PHASE] == OPEN:  # put there by the user
        row[BEGUN] += 1.0
        force_out[0], force_out[1], force_out[2] = step(
            p, h, overlap, overlap, row[MOTION], 0.0, 0.0, 0.0, 0.0, mass_of(own[0]), across(own, 0.0, 0.0)
        )
    else:
        share = overlap / h[OVERLAP]
        share *= sqrt(share)
        force_out[0] = share * h[NORMAL]
        force_out[1], force_out[2] = share * h[TANGENTIAL], share * h[TANGENTIAL + 1]
        u, w = row[STRAYED], row[STRAYED + 1]
        slack = NO_MATTER * p[FRICTION] * force_out[0]
        if slack < stuck_stiffness(p, h, overlap) * sqrt(u * u + w * w) < NEVER:
            force_out[1], force_out[2] = displace(p, h, overlap, u, w, force_out[0], 0.0)


@jit
def accelerate(first, last, rows, start, index, blocks, force, out):
    """Accelerations (n, 3) of the contacts first to last - 1 under their forces (n, 3) and all else."""
    for i in range(last - first):
        row = rows[first + i]
        x, y, z = row[PUSH], row[PUSH + 1], row[PUSH + 2]
        for k in range(start[first + i], start[first + i + 1]):
            f, b = force[index[k] - first], blocks[k]
            x -= b[0] * f[0] + b[1] * f[1] + b[2] * f[2]
            y -= b[3] * f[0] + b[4] * f[1] + b[5] * f[2]
            z -= b[6] * f[0] + b[7] * f[1] + b[8] * f[2]
        out[i, 0], out[i, 1], out[i, 2] = x, y, z


@jit
def substep(first, last, rows, parameters, blocks, start, x, v, force, acceleration, left):
    """Longest substep [s] that resolves the fastest contact that is closed, and how long it may be kept up.

    left: of the engine step [s]. A contact that closes in between ends what can be kept up; one that closes within the
    next substep counts as closed.
    """
    shortest, horizon = NEVER, left
    for i in range(last - first):
        wait = next_touch(x[i], v[i, 0], acceleration[i, 0]) if x[i] <= 0.0 else 0.0
        if wait >= horizon:
            continue
        row, own = rows[first + i], blocks[start[first + i]]
        p = parameters_of(row, parameters)
        scale = time_scale(pair_of(p), 1.0 / own[0], max(x[i], 0.0), v[i, 0], acceleration[i, 0] + own[0] * force[i, 0])
        # A stuck contact swings sqrt(2 chi) times as fast sideways as it does along the normal.
        chi = 0.5 * p[G_STAR] / p[E_STAR] * max(own[4], own[8]) / own[0]
        pieces = row[PIECES]
        give = own[0] * force[i, 0]
        if (
            x[i] > 0.0
            and v[i, 0] * v[i, 0] < SWINGING * give * x[i]
            and abs(acceleration[i, 0]) < give * sqrt(SWINGING)
        ):
            pieces = max(0.25 * pieces, FEWEST)
        h = scale / (pieces * max(1.0, sqrt(0.5 * chi)))
        if wait > h:
            horizon = wait
            continue
        shortest = min(shortest, h)
        if row[LEDGER] != 0.0:
            row[FASTEST] = min(row[FASTEST], scale)
    return shortest, horizon


@jit
def subcycle(
    first, last, rows, histories, parameters, start, index, blocks, dt, calming, x, v, force, acceleration, work_io
):  # fmt: skip
    """Integrate the contacts first to last - 1 of one group over an engine step of dt [s].

    rows: as in `kernels.rows`; the results are written there. histories: a row each, brought up to the end of the step.
    start, index, blocks: J M^-1 J^T by rows of 3 x 3 blocks, that of a contact with itself first. calming: let dashpots
    help contacts that carry a load to rest. x, v, force, acceleration: overlaps (n) and motions (n, 3) at the start;
    written.
    """
    n = last - first
    moved = numbers(work_io, 3)
    now, taken = 0.0, 0
    while now < dt and taken < MOST_SUBSTEPS:
        closed = False
        for i in range(n):
            closed = closed or x[i] > 0.0
        if not closed:
            soonest, which = dt - now, -1
            for i in range(n):
                wait = next_touch(x[i], v[i, 0], acceleration[i, 0])
                if wait < soonest:
                    soonest, which = wait, i
            drift(first, rows, x, v, acceleration, soonest)
            if which < 0:  # now + (dt - now) may be rounded to less
                now = dt
                break
            now += soonest
            x[which] = 0.0
        h, horizon = substep(first, last, rows, parameters, blocks, start, x, v, force, acceleration, dt - now)
        pieces = ceil(min(horizon / h, 1e9))
        end = dt if horizon == dt - now else now + horizon
        h = horizon / pieces
        count = min(pieces, CHUNK)
        weigh(first, rows, force, 0.5 * h, 1.0 - now / dt)
        for i in range(n):
            for j in range(3):
                v[i, j] += 0.5 * h * acceleration[i, j]
        for s in range(count):
            now = end if s + 1 == pieces else now + h
            closed, opened = False, False
            for i in range(n):
                row, own, history = rows[first + i], blocks[start[first + i]], histories[first + i]
                p, before = parameters_of(row, parameters), x[i]
                for j in range(3):
                    moved[j] = h * v[i, j]
                x[i] += moved[0]
                row[SLID] += moved[1]
                row[SLID + 1] += moved[2]
                if x[i] <= 0.0 and before <= 0.0:
                    continue
                was_open = history[PHASE] == OPEN
                old_p, old_f, old_g = force[i, 0], force[i, 1], force[i, 2]
                mass, tangential_mass = 0.0, 0.0  # of the touch
                if was_open:
                    mass, tangential_mass = mass_of(own[0]), across(own, moved[1], moved[2])
                force[i, 0], force[i, 1], force[i, 2] = step(
                    p, history, x[i], before, v[i, 0], acceleration[i, 0] + own[0] * old_p,
                    moved[1], moved[2], h, mass, tangential_mass,
                )  # fmt: skip
                if x[i] <= 0.0 and before > 0.0 and p[ZETA] == 0.0:
                    force[i, 0], force[i, 1], force[i, 2] = old_p, old_f, old_g
                    share = parting(p, before / (before - x[i]), h)
                    strike(first, i, share, 1.0 - now / dt, rows, start, index, blocks, force, v)
                    force[i, 0], force[i, 1], force[i, 2] = 0.0, 0.0, 0.0
                if calming and x[i] > 0.0:
                    calm(p, history, own, x[i], v[i], force[i])
                closed = closed or x[i] > 0.0
                opened = opened or was_open
                if was_open and x[i] > 0.0:
                    row[BEGUN] += 1.0
                    row[CLOSED] = dt - now + h
                    if before == 0.0 and history[RATIO] > 1.0:
                        share = STEEP * h * (1.0 - 1.0 / history[RATIO])
                        strike(first, i, share, 1.0 - now / dt, rows, start, index, blocks, force, v)
                row[DEEPEST] = max(row[DEEPEST], x[i])
                row[FROM], row[UNTIL] = min(row[FROM], now - h), now
                if row[LEDGER] != 0.0:
                    row[STRONGEST] = max(row[STRONGEST], force[i, 0])
                    row[TOUCHING] += h
                    row[WORK] += 0.5 * (old_p + force[i, 0]) * moved[0]
                    row[DRAG] += 0.5 * ((old_f + force[i, 1]) * moved[1] + (old_g + force[i, 2]) * moved[2])
            accelerate(first, last, rows, start, index, blocks, force, acceleration)
            taken += 1
            done = s + 1 == count or not closed or (opened and n > 1)
            weight = 0.5 * h if done else h
            weigh(first, rows, force, weight, 1.0 - now / dt)
            for i in range(n):
                for j in range(3):
                    v[i, j] += weight * acceleration[i, j]
            if done:
                break
    if now < dt:
        for i in range(n):
            row = rows[first + i]
            row[SPENT], row[FROM], row[UNTIL] = 1.0, min(row[FROM], now), dt
        stand(first, last, rows, parameters, start, index, blocks, dt - now, 1.0 - now / dt, v, force, work_io)


@jit
def parting(p, s, h):
    """Time [s] by which the force of an elastic contact, of its last moment, acted too long or too short.

    A contact opens s substeps of h [s] after that moment. Near its ends P goes with time to the power 3/2, and of such
    a force a sum over steps that end s of a step before the end is too much by zeta(-3/2, s) P(h) h (Euler-Maclaurin,
    Hurwitz's zeta function). Contacts begin at the start of a substep, where that is zeta(-3/2, 1) P(h) h. With the
    difference taken back an impact is as symmetric in time as the leapfrog within it, and the energy that it would gain
    or lose, 1e-5 at 100 substeps, is a thousand times less. For a linear spring it is zeta(-1, s).
    """
    if p[LINEAR] != 0.0:
        return -0.5 * h * (1.0 - s)
    rest = PARTING[0] + s * (PARTING[1] + s * (PARTING[2] + s * PARTING[3]))
    return -h * (1.0 + rest / sqrt(s))


@jit
def calm(p, h, own, x, v, force_io):
    """Add dashpots to the force of a contact, within its friction limit: CALM of critical damping."""
    if force_io[0] == 0.0:
        return
    force_io[0] = max(force_io[0] + 2.0 * CALM * sqrt(1.5 * force_io[0] / (x * own[0])) * v[0], 0.0)
    give, stiffness = max(own[4], own[8]), stuck_stiffness(p, h, x)
    if stiffness > NEVER or give == 0.0:
        return
    drag = 2.0 * CALM * sqrt(stiffness / give)
    f, g = force_io[1] + drag * v[1], force_io[2] + drag * v[2]
    pull, limit = sqrt(f * f + g * g), p[FRICTION] * force_io[0]
    share = limit / pull if pull > limit else 1.0
    force_io[1], force_io[2] = share * f, share * g


@jit
def stand(first, last, rows, parameters, start, index, blocks, time, left, v_io, impulse_out, work_io):
    """Bring contacts to a stand for the rest of an engine step, time [s], that there are no substeps for.

    As rigid bodies without bounce: impulses within the friction cones that leave nothing closing, at once for the
    motion there is, and as a steady force for what else pushes. Energy is lost, never gained. left: as for `weigh`.
    v_io: speeds (n, 3). impulse_out: room (n, 3).
    """
    n, given = last - first, table(work_io, last - first, 3)
    for turn in range(2):
        share = left if turn == 0 else 0.5 * left
        for i in range(n):
            for j in range(3):
                given[i, j] = 0.0
                if turn == 1:
                    v_io[i, j] += time * rows[first + i, PUSH + j]
        for _ in range(SWEEPS):
            change, size = 0.0, 0.0
            for i in range(n):
                own, p = blocks[start[first + i]], parameters_of(rows[first + i], parameters)
                pull, total = impulse_out[i], given[i]
                pull[0] = max(v_io[i, 0] / max(own[0], 1e-300), -total[0])
                limit = p[FRICTION] * (total[0] + pull[0])
                f = total[1] + (v_io[i, 1] / own[4] if own[4] > 0.0 else 0.0)
                g = total[2] + (v_io[i, 2] / own[8] if own[8] > 0.0 else 0.0)
                both = sqrt(f * f + g * g)
                cut = limit / both if both > limit else 1.0
                pull[1], pull[2] = cut * f - total[1], cut * g - total[2]
                for j in range(3):
                    total[j] += pull[j]
                    change, size = max(change, abs(pull[j])), max(size, abs(total[j]))
                strike(first, i, 1.0, share, rows, start, index, blocks, impulse_out, v_io)
            if change <= ENOUGH * size:
                break


@jit
def strike(first, i, weight, left, rows, start, index, blocks, force, v):
    """Give one contact an impulse more, its force times a weight [s], now; left: as for `weigh`."""
    row = rows[first + i]
    for j in range(3):
        row[IMPULSE + j] += weight * force[i, j]
        row[EARLY + j] += weight * left * force[i, j]
    for k in range(start[first + i], start[first + i + 1]):
        other, b = v[index[k] - first], blocks[k]
        for j in range(3):  # the block of the other with this one is the transpose
            other[j] -= weight * (b[j] * force[i, 0] + b[3 + j] * force[i, 1] + b[6 + j] * force[i, 2])


@jit
def mass_of(mobility):
    """Effective mass [kg] of a mobility [1/kg]; what cannot move has no finite one."""
    return 1.0 / max(mobility, 1e-300)


@jit
def across(block, u, w):
    """Tangential effective mass [kg] along a displacement; without one, of the mean of both directions."""
    square = u * u + w * w
    if square == 0.0:
        return mass_of(0.5 * (block[4] + block[8]))
    return mass_of((u * u * block[4] + u * w * (block[5] + block[7]) + w * w * block[8]) / square)


@jit
def drift(first, rows, x, v, acceleration, time):
    """Let all contacts move on without forces of theirs."""
    for i in range(x.size):
        row = rows[first + i]
        x[i] += time * (v[i, 0] + 0.5 * time * acceleration[i, 0])
        row[SLID] += time * (v[i, 1] + 0.5 * time * acceleration[i, 1])
        row[SLID + 1] += time * (v[i, 2] + 0.5 * time * acceleration[i, 2])
        for j in range(3):
            v[i, j] += time * acceleration[i, j]


@jit
def weigh(first, rows, force, weight, left):
    """Add the forces (n, 3) times a weight [s] to the impulses; left: share of the engine step that is left."""
    for i in range(force.shape[0]):
        row = rows[first + i]
        for j in range(3):
            row[IMPULSE + j] += weight * force[i, j]
            row[EARLY + j] += weight * left * force[i, j]
