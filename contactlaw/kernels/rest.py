"""Contacts at rest, or rolling or sliding steadily: one implicit step instead of hundreds of small ones.

Once nothing is left of an impact but a load that the contact carries, the step is far longer than the contact's own
time and the small steps would only repeat themselves. The force at the end of the step, f', is then solved for
together with the displacement that it leaves:

    moved = dt v + dt^2/2 a - dt^2 W ((1/2 - BLEND) f + BLEND f')        v' = v + dt a - dt W f'

At equilibrium it changes nothing, so overlap and traction stay as they are. What still swings dies out: for a contact
infinitely stiff for the step, by 0.35 a step with this BLEND.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from contactlaw.jit import jit
from contactlaw.kernels.contact import (
    COULOMB,
    FRICTION,
    LAW,
    LINEAR_SPRING,
    MICROSLIP,
    NORMAL,
    OVERLAP,
    PHASE,
    PLANAR,
    RATIO,
    SCALE,
    SPRUNG,
    TANGENTIAL,
    forget,
    friction,
    hertz_stiffness,
    regrid_history,
    respan,
)
from contactlaw.kernels.rows import (
    DEEPEST,
    EARLY,
    IMPULSE,
    MOTION,
    OVERLAP_NOW,
    PIECES,
    PUSH,
    SLID,
    STRONGEST,
    TOUCHING,
)
from contactlaw.kernels.subcycle import accelerate, next_touch, parameters_of, tangential_stiffness

BLEND = 4.0 / 7.0
FEW = 8.0  # substeps in a step up to which a contact is integrated anyway
SWING = 4.03  # duration of an impact times the frequency of small motions at its greatest overlap
# What may still swing, its energy then lost: along the normal in terms of the overlap and force at rest; across it in
# terms of the displacement and force at which the contact would slip.
QUIET, QUIET_ACROSS = 0.01, 0.03
STIFF = 1e-12  # displacements that a rigid contact allows, as a share of those without it
MOST_SWEEPS = 200
SAME = 1e-9  # of the overlap, to which it stays the same at rest
BALANCED = 4e-15  # of the force, to which forces at rest balance; what is beyond is mended, and likewise:
DRIFT = 1e-3  # of SAME, how far a step may carry
EXACT = 1e-14  # of the force, at which the sweeps over the contacts end


@jit
def is_quiet(first, last, rows, parameters, start, blocks, dt, x, v, force, acceleration):
    """Whether the contacts of a group carry a steady load and nothing else happens in this step."""
    n = last - first
    fastest = 0.0
    for i in range(n):
        if x[i] <= 0.0:
            if next_touch(x[i], v[i, 0], acceleration[i, 0]) < dt:
                return False
            continue
        row, own = rows[first + i], blocks[start[first + i]]
        p = parameters_of(row, parameters)
        if not (
            rests(own, x[i], v[i], force[i], acceleration[i])
            and holds(p, own, x[i], v[i], force[i], acceleration[i], dt)
        ):
            return False
        fastest = max(fastest, row[PIECES] * sqrt(1.5 * own[0] * force[i, 0] / x[i]))
    return fastest * dt > FEW * SWING


@jit
def rests(own, x, v, force, acceleration):
    """Whether next to nothing moves along the normal."""
    give = own[0] * force[0]
    return abs(acceleration[0]) <= QUIET * give and abs(v[0]) <= QUIET * sqrt(1.5 * give * x)


@jit
def holds(p, own, x, v, force, acceleration, dt):
    """Whether a contact sticks with little left of its swing, or slides and will go on sliding through the step."""
    limit = p[FRICTION] * force[0]
    if limit == 0.0:
        return True
    give = max(own[4], own[8])
    pull, speed = sqrt(force[1] ** 2 + force[2] ** 2), sqrt(v[1] ** 2 + v[2] ** 2)
    change = sqrt(acceleration[1] ** 2 + acceleration[2] ** 2)
    if pull >= (1.0 - 1e-9) * limit and speed > 2.0 * dt * (change + give * limit):
        return force[1] * v[1] + force[2] * v[2] >= (1.0 - 1e-9) * pull * speed
    if change > QUIET_ACROSS * give * limit:
        return False
    return p[LAW] == COULOMB or speed <= QUIET_ACROSS * limit * sqrt(give / tangential_stiffness(p, x))


@jit
def is_still(first, last, rows, histories, start, index, blocks, dt, x, v, force_io, acceleration_io):
    """Whether nothing in a quiet group moves or pulls but by rounding; then the forces are those remembered.

    Overlaps are differences of places and known to some 1e-10 of themselves: forces that follow every such change
    would never balance. Those remembered do.
    """
    for i in range(last - first):
        if x[i] > 0.0:
            h = histories[first + i]
            force_io[i, 0], force_io[i, 1], force_io[i, 2] = h[NORMAL], h[TANGENTIAL], h[TANGENTIAL + 1]
            if abs(x[i] - h[OVERLAP]) > SAME * x[i] or h[RATIO] != 1.0:
                return False
    accelerate(first, last, rows, start, index, blocks, force_io, acceleration_io)
    for i in range(last - first):
        if x[i] > 0.0:
            give = blocks[start[first + i], 0] * force_io[i, 0]
            for j in range(3):
                if abs(acceleration_io[i, j]) > SAME * give or abs(dt * v[i, j]) > SAME * x[i]:
                    return False
    return True


@jit
def stay(first, last, rows, histories, start, blocks, dt, x, v, force, acceleration):
    """Hold a still group where it is: not a bit is to change until something moves.

    What the forces lack of balance, and what is left of motion, is mended contact by contact, each by its share.
    """
    for i in range(last - first):
        if x[i] <= 0.0:
            continue
        row, h = rows[first + i], histories[first + i]
        row[DEEPEST], row[TOUCHING], row[STRONGEST] = x[i], dt, force[i, 0]
        at = start[first + i]
        own, share = blocks[at], 1.0 / (start[first + i + 1] - at)
        slack, slow = BALANCED * own[0] * force[i, 0], DRIFT * SAME * x[i] / dt
        for j in range(3):
            lack, stop = acceleration[i, j], v[i, j]
            pull = force[i, j]
            if abs(lack) > slack and own[4 * j] > 0.0:
                pull += share * lack / own[4 * j]
                h[NORMAL if j == 0 else TANGENTIAL + j - 1] = pull
            row[IMPULSE + j], row[EARLY + j] = dt * pull, 0.5 * dt * pull
            if abs(stop) > slow and own[4 * j] > 0.0:
                row[IMPULSE + j] += share * stop / own[4 * j]


@jit
def settle(first, last, rows, histories, parameters, start, index, blocks, dt, force):
    """The implicit step of the contacts first to last - 1; arguments as for `subcycle`."""
    n = last - first
    new, moved = force.copy(), np.zeros((n, 3))
    for _ in range(MOST_SWEEPS):
        worst = 0.0
        for i in range(n):
            if rows[first + i, OVERLAP_NOW] > 0.0:
                free_displacement(first, i, rows, start, index, blocks, force, new, dt, moved[i])
                p, own = parameters_of(rows[first + i], parameters), blocks[start[first + i]]
                worst = max(worst, solve(p, own, histories[first + i], rows[first + i, OVERLAP_NOW], dt, force[i],
                                         moved[i], new[i]))  # fmt: skip
        if worst <= EXACT or (n == 1 and is_apart(blocks[start[first]])):
            break
    for i in range(n):
        row, h = rows[first + i], histories[first + i]
        p = parameters_of(row, parameters)
        before = row[OVERLAP_NOW]
        x = before + moved[i, 0]
        if before <= 0.0 or x <= 0.0:
            forget(h)
            new[i] = 0.0
        else:
            if p[LAW] == MICROSLIP:
                span = respan(p, h, x, 0.0)
                if span != h[SCALE] and h[PHASE] == SPRUNG:
                    regrid_history(p, h, span)
                h[SCALE] = span
            if p[LAW] == COULOMB:
                hold(h, x, new[i])
            else:
                new[i, 1], new[i, 2] = friction(p, h, x, before, moved[i, 1], moved[i, 2], new[i, 0], 1.0, 0.0)
            row[DEEPEST], row[TOUCHING], row[STRONGEST] = max(before, x), dt, new[i, 0]
        row[SLID], row[SLID + 1] = moved[i, 1], moved[i, 2]
        for j in range(3):
            row[IMPULSE + j] = dt * new[i, j]
            row[EARLY + j] = dt * (BLEND * new[i, j] + (0.5 - BLEND) * force[i, j])


@jit
def is_apart(own):
    """Whether the motion along the normal and that across it do not answer to each other."""
    return own[1] == 0.0 and own[2] == 0.0


@jit
def hold(h_out, x, force):
    """Keep the force of a rigid contact, which follows from no displacement."""
    h_out[OVERLAP], h_out[NORMAL], h_out[RATIO] = x, force[0], 1.0
    h_out[TANGENTIAL], h_out[TANGENTIAL + 1] = force[1], force[2]


@jit
def free_displacement(first, i, rows, start, index, blocks, force, new, dt, out):
    """Displacement (3) of a contact over the step but for its own new force."""
    row = rows[first + i]
    for j in range(3):
        out[j] = dt * (row[MOTION + j] + 0.5 * dt * row[PUSH + j])
    for k in range(start[first + i], start[first + i + 1]):
        d, b = index[k] - first, blocks[k]
        mine = k == start[first + i]
        for j in range(3):
            for m in range(3):
                blend = (0.5 - BLEND) * force[d, m] + (0.0 if mine else BLEND * new[d, m])
                out[j] -= dt * dt * b[3 * j + m] * blend


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
    if p[PLANAR] != 0.0:
        w = 0.0
    if limit == 0.0:
        new_io[1], new_io[2] = 0.0, 0.0
    else:
        stiffness = 1.0 / (STIFF * c * max(own[4], own[8]))
        if p[LAW] != COULOMB:
            stiffness = min(tangential_stiffness(p, x), stiffness)
        # (1 + c W K) (u, w)' = (u, w) - c W (f, g)
        a, b, d = 1.0 + c * stiffness * own[4], c * stiffness * own[5], 1.0 + c * stiffness * own[8]
        if p[PLANAR] != 0.0:
            b, d, g = 0.0, 1.0, 0.0
        r, s = u - c * (own[4] * f + own[5] * g), w - c * (own[7] * f + own[8] * g)
        if p[PLANAR] != 0.0:
            s = 0.0
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
    if p[PLANAR] != 0.0:
        moved_io[2] = 0.0
    change = abs(new_io[0] - old_p) + abs(new_io[1] - old_f) + abs(new_io[2] - old_g)
    return change / max(new_io[0], 1e-300)


@jit
def normal_load(p, h, x):
    """Elastic normal force [N]."""
    if x <= 0.0:
        return 0.0
    return h[SCALE] * x if p[LAW] == LINEAR_SPRING else hertz_stiffness(p) * x * sqrt(x)


@jit
def normal_balance(p, h, guess, room, give):
    """Overlap x with x + give P(x) = room, by Newton's method from a guess; P is convex, so it cannot run away."""
    if room <= 0.0:
        return room
    if p[LAW] == LINEAR_SPRING:
        return room / (1.0 + give * h[SCALE])
    k, x = give * hertz_stiffness(p), guess
    for _ in range(50):
        root = sqrt(max(x, 0.0))
        change = (room - x - k * x * root) / (1.0 + 1.5 * k * root)
        x = max(x + change, 0.0)
        if abs(change) <= 1e-15 * room:
            break
    return x
