"""Contacts at rest, or rolling or sliding steadily: no small steps that would only repeat themselves.

Once nothing is left of an impact but a load, dashpots calm what still swings. What is still then stays, to the last
bit. A contact that moves on as it is, rolling or sliding or slowly loaded, takes one implicit step: the force at its
end, f', is solved for together with the displacement that it leaves:

    moved = dt v + dt^2/2 a - dt^2 W ((1/2 - BLEND) f + BLEND f')        v' = v + dt a - dt W f'

At equilibrium it changes nothing, so overlap and traction stay as they are. What still swings dies out: for a contact
infinitely stiff for the step, by 0.35 a step with this BLEND.
"""

from __future__ import annotations

from math import sqrt

from contactlaw.jit import jit
from contactlaw.kernels.contact import (
    CLOSING,
    FRICTION,
    LINEAR,
    NORMAL,
    OVERLAP,
    RATIO,
    STIFFNESS,
    TANGENTIAL,
    displace,
    forget,
    stuck_stiffness,
)
from contactlaw.kernels.rows import (
    DEEPEST,
    DRAG,
    EARLY,
    FROM,
    IMPULSE,
    MOTION,
    OVERLAP_NOW,
    PIECES,
    PUSH,
    SLID,
    STRONGEST,
    TOUCHING,
    UNTIL,
    WORK,
)
from contactlaw.kernels.subcycle import NEVER, accelerate, next_touch, parameters_of
from contactlaw.kernels.workspace import numbers

BLEND = 4.0 / 7.0
FEW = 8.0  # substeps in a step up to which a contact is integrated anyway
SWING = 4.03  # duration of an impact times the frequency of small motions at its greatest overlap
# What may still swing, in terms of the load along the normal and of the friction limit across it. Below the first the
# implicit step takes over: it dies out there, but not before growing some. Below the second, for a steel ball of 25 mm
# on a floor 1 mm/s, dashpots calm it down to the first.
QUIET, QUIET_ACROSS = 0.01, 0.03
NEARLY, NEARLY_ACROSS = 0.5, 1.0
BUSY, CALMING, RESTING = 0, 1, 2
STIFF = 1e-12  # displacements that a rigid contact allows, as a share of those without it
MOST_SWEEPS = 200
# Of overlap and force, to which they stay the same at rest: for one contact, near to rounding; in a crowd, that bears
# the rounding of all.
SAME, SAME_IN_CROWD = 1e-9, 1e-6
LASTING = 0.02  # of the latter, what the lack of balance may move a crowd in its first step
BALANCED = 4e-15  # of the force, to which forces at rest balance; what is beyond is mended, and likewise:
DRIFT = 1e-3  # of SAME, how far a step may carry
EXACT = 1e-14  # of the force, at which the sweeps over the contacts end


@jit
def how_quiet(first, last, rows, histories, parameters, start, blocks, dt, x, v, force, acceleration):
    """Whether the contacts of a group do no more than carry a steady load, RESTING, or nearly so, CALMING."""
    n = last - first
    fastest, load, answer = 0.0, 0.0, RESTING
    for i in range(n):
        load = max(load, force[i, 0])
    for i in range(n):
        if x[i] <= 0.0:
            if next_touch(x[i], v[i, 0], acceleration[i, 0]) < dt:
                return BUSY
            continue
        if force[i, 0] == 0.0:
            return BUSY
        row, own = rows[first + i], blocks[start[first + i]]
        along = swing(own, load, x[i], v[i], force[i], acceleration[i])
        across = swing_across(
            parameters_of(row, parameters), histories[first + i], own, x[i], v[i], force[i], acceleration[i], dt
        )
        if along > NEARLY or across > NEARLY_ACROSS:
            return BUSY
        if along > QUIET or across > QUIET_ACROSS:
            answer = CALMING
        fastest = max(fastest, row[PIECES] * sqrt(1.5 * own[0] * force[i, 0] / x[i]))
    return answer if fastest * dt > FEW * SWING else BUSY


@jit
def swing(own, load, x, v, force, acceleration):
    """What force the motion along the normal amounts to, as a share of the load [N]."""
    return max(abs(acceleration[0]) / (own[0] * load), abs(v[0]) / (load * sqrt(own[0] * x / (1.5 * force[0]))))


@jit
def swing_across(p, h, own, x, v, force, acceleration, dt):
    """The same across the normal, as a share of the friction limit; none where it slides and will go on sliding."""
    limit, give = p[FRICTION] * force[0], max(own[4], own[8])
    if limit == 0.0 or give == 0.0:
        return 0.0
    pull, speed = sqrt(force[1] ** 2 + force[2] ** 2), sqrt(v[1] ** 2 + v[2] ** 2)
    change = sqrt(acceleration[1] ** 2 + acceleration[2] ** 2)
    slides = pull >= (1.0 - 1e-9) * limit and speed > 2.0 * dt * (change + give * limit)
    if slides and force[1] * v[1] + force[2] * v[2] >= (1.0 - 1e-9) * pull * speed:
        return 0.0
    stiffness = stuck_stiffness(p, h, x)
    if stiffness > NEVER:
        return change / (give * limit)
    return max(change / (give * limit), speed / (limit * sqrt(give / stiffness)))


@jit
def is_still(first, last, rows, histories, start, index, blocks, dt, x, v, force_io, acceleration_io):
    """Whether nothing in a quiet group moves or pulls but by rounding; then the forces are those remembered.

    Overlaps are differences of places and known to some 1e-10 of themselves: forces that follow every such change
    would never balance. Those remembered do.
    """
    same = SAME if last == first + 1 else SAME_IN_CROWD
    for i in range(last - first):
        if x[i] > 0.0:
            h = histories[first + i]
            force_io[i, 0], force_io[i, 1], force_io[i, 2] = h[NORMAL], h[TANGENTIAL], h[TANGENTIAL + 1]
            if abs(x[i] - h[OVERLAP]) > same * x[i] or abs(h[RATIO] - 1.0) > same:
                return False
    accelerate(first, last, rows, start, index, blocks, force_io, acceleration_io)
    for i in range(last - first):
        if x[i] > 0.0:
            give = blocks[start[first + i], 0] * force_io[i, 0]
            for j in range(3):
                pull = abs(acceleration_io[i, j])
                if abs(dt * v[i, j]) > same * x[i] or pull > same * give:
                    return False
                if last > first + 1 and dt * dt * pull > LASTING * same * x[i]:
                    return False
    return True


@jit
def stay(first, last, rows, histories, start, blocks, dt, x, v, force, acceleration):
    """Hold a still group where it is: not a bit is to change until something moves.

    What the force of one contact lacks of balance, and what is left of its motion, is mended. A crowd is left to drift
    until it is no longer still, and then calmed anew.
    """
    alone = last == first + 1
    for i in range(last - first):
        if x[i] <= 0.0:
            continue
        row, h = rows[first + i], histories[first + i]
        row[DEEPEST], row[TOUCHING], row[STRONGEST] = x[i], dt, force[i, 0]
        at = start[first + i]
        own = blocks[at]
        slack, slow = BALANCED * own[0] * force[i, 0], DRIFT * SAME * x[i] / dt
        for j in range(3):
            lack, stop = acceleration[i, j], v[i, j]
            pull = force[i, j]
            if alone and abs(lack) > slack and own[4 * j] > 0.0:
                pull += lack / own[4 * j]
                h[NORMAL if j == 0 else TANGENTIAL + j - 1] = pull
            row[IMPULSE + j], row[EARLY + j] = dt * pull, 0.5 * dt * pull
            if alone and abs(stop) > slow and own[4 * j] > 0.0:
                row[IMPULSE + j] += stop / own[4 * j]


@jit
def settle(row, p, h, own, dt, force, work_io):
    """The implicit step of one contact that shares its bodies with no other; force: at the start of the step."""
    before = row[OVERLAP_NOW]
    free, moved, new = numbers(work_io, 3), numbers(work_io, 3), numbers(work_io, 3)
    for j in range(3):
        new[j] = force[j]
        free[j] = dt * (row[MOTION + j] + 0.5 * dt * row[PUSH + j])
        for m in range(3):
            free[j] -= dt * dt * own[3 * j + m] * (0.5 - BLEND) * force[m]
    for _ in range(MOST_SWEEPS):
        for j in range(3):
            moved[j] = free[j]
        change = solve(p, own, h, before, dt, force, moved, new)
        if change <= EXACT or (own[1] == 0.0 and own[2] == 0.0):
            break
    x = before + moved[0]
    if x <= 0.0:
        forget(h)
        for j in range(3):
            new[j] = 0.0
    elif stuck_stiffness(p, h, x) > NEVER:
        hold(h, x, new)
    else:
        # The law's own force is where the next step starts; this step gives what has been solved for, or the bodies
        # would not move as they were found to, by much more than both forces differ.
        h[OVERLAP], h[RATIO], h[CLOSING] = before, 1.0, 0.0
        displace(p, h, x, moved[1], moved[2], new[0], dt)
    row[DEEPEST], row[TOUCHING], row[STRONGEST] = max(before, x), dt, new[0]
    row[SLID], row[SLID + 1] = moved[1], moved[2]
    row[FROM], row[UNTIL] = 0.0, dt
    row[WORK] += 0.5 * (force[0] + new[0]) * moved[0]
    row[DRAG] += 0.5 * ((force[1] + new[1]) * moved[1] + (force[2] + new[2]) * moved[2])
    for j in range(3):
        row[IMPULSE + j] = dt * new[j]
        row[EARLY + j] = dt * (BLEND * new[j] + (0.5 - BLEND) * force[j])


@jit
def hold(h_out, x, force):
    """Keep the force of a rigid contact, which follows from no displacement."""
    h_out[OVERLAP], h_out[NORMAL], h_out[RATIO] = x, force[0], 1.0
    h_out[TANGENTIAL], h_out[TANGENTIAL + 1] = force[1], force[2]


@jit
def solve(p, own, h, before, dt, force, moved_io, new_io):
    """New force of one contact against its own mobility; moved_io: free displacement in, displacement out.

    Returns the change of the force over the force.
    """
    c = BLEND * dt * dt
    old_p, old_f, old_g = new_io[0], new_io[1], new_io[2]
    room = before + moved_io[0] - c * (own[1] * old_f + own[2] * old_g)
    x = normal_balance(p, h, before, room, c * own[0])
    new_io[0] = normal_load(p, h, x)
    u = moved_io[1] - c * own[3] * new_io[0]
    w = moved_io[2] - c * own[6] * new_io[0]
    limit = p[FRICTION] * new_io[0]
    f, g = force[1], force[2]
    if limit == 0.0:
        new_io[1], new_io[2] = 0.0, 0.0
    else:
        stiffness = min(stuck_stiffness(p, h, x), 1.0 / (STIFF * c * max(own[4], own[8])))
        # (1 + c W K) (u, w)' = (u, w) - c W (f, g)
        a, b, d = 1.0 + c * stiffness * own[4], c * stiffness * own[5], 1.0 + c * stiffness * own[8]
        r, s = u - c * (own[4] * f + own[5] * g), w - c * (own[7] * f + own[8] * g)
        det = a * d - b * b
        f += stiffness * (d * r - b * s) / det
        g += stiffness * (a * s - b * r) / det
        pull = sqrt(f * f + g * g)
        if pull > limit:
            f *= limit / pull
            g *= limit / pull
        new_io[1], new_io[2] = f, g
    moved_io[0] = x - before
    moved_io[1] = u - c * (own[4] * new_io[1] + own[5] * new_io[2])
    moved_io[2] = w - c * (own[7] * new_io[1] + own[8] * new_io[2])
    change = abs(new_io[0] - old_p) + abs(new_io[1] - old_f) + abs(new_io[2] - old_g)
    return change / max(new_io[0], 1e-300)


@jit
def normal_load(p, h, x):
    """Elastic normal force [N]."""
    if x <= 0.0:
        return 0.0
    return h[STIFFNESS] * x * (1.0 if p[LINEAR] != 0.0 else sqrt(x))


@jit
def normal_balance(p, h, guess, room, give):
    """Overlap x with x + give P(x) = room, by Newton's method from a guess; P is convex, so it cannot run away."""
    if room <= 0.0:
        return room
    if p[LINEAR] != 0.0:
        return room / (1.0 + give * h[STIFFNESS])
    k, x = give * h[STIFFNESS], guess
    for _ in range(50):
        root = sqrt(max(x, 0.0))
        change = (room - x - k * x * root) / (1.0 + 1.5 * k * root)
        x = max(x + change, 0.0)
        if abs(change) <= 1e-15 * room:
            break
    return x
