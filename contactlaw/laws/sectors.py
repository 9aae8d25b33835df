"""A contact that slips and spins at once: rings of sectors, each with a traction and Coulomb's limit of its own.

Where a body spins about the normal a place slips by (w_x - theta y, w_y + theta x): a ring slips first on the side
where slide and spin add. So each ring has sectors of a force g_k at angles phi_k, in units in which the ring has their
mean; as functions of phi these have the components

    g = f + s e_s + r e_r + p e_p + q e_q + rest        |g_k| <= mu P of the ring, slip along g_k
    e_s = (-sin, cos), the swirl        e_r = (cos, sin)        e_p = (cos, -sin)        e_q = (sin, cos)

The response to f is that of the line of springs, the response to s that of Lubkin's, both by Abel's transform from the
place x on the line, in cells that end at c_i, to rings that end there too (Popov & Hess 2015, section 17):

    f = B q              B_ji = H_i(c_(j-1)) - H_i(c_j)      H_i(r) = h(c_i) - h(c_(i-1))      h(x) = 2 sqrt(x^2 - r^2)
    rho s = B_t theta    likewise                                    h(x) = 8/3 sqrt(x^2 - r^2) (2 x^2 + r^2)

rho: moment of a ring on its limit over its force. The energies of both kinds of springs make the compliances between
rings, A. Cerruti's kernel is [1 - nu k k/k^2]/(G k) for waves k; so what varies as sin and cos answers like the swirl,
1/G, times 1 - nu for e_r, where tractions lie along k, and 1 - nu/2 for e_p and e_q, half along it. The rest answers to
its own ring, 2.1/(1 - nu) times as much as e_p does to its own: that is fitted, psi_2 to the grid's.

A step would displace the tractions g_0 to g* if all stuck; they become g on the limits, by the slip A (g* - g), which
lies along each sector's mean of before and after, or, where it has just come to its limit, along its end. The work of
the mean force, less what is stored anew, is

    D = (g_0 + g) . A (g* - g)/2,        zero on the ball with the diameter from -g_0 to g*, positive inside.

Limits are convex and symmetric. So if none falls D >= 0 for exact slip along the end: -g_0 is allowed as well. What few
sweeps (Gauss-Seidel, from the edge inwards) leave of D < 0 is put right by going towards -g_0 until D = 0: then no step
gives energy, however large, nor does one that changes the load alone, for what a limit takes from its traction is lost.
Where load and place change at once the mean force is not quite the work's, by the square of the step: Coulomb's is not.
A contact that slips as a whole for long has the force and moment of `torsion.limit_point`: what few sectors miss of it,
up to 0.03 mu P, is held by a spring beside them, put right on the way of one elastic displacement as far as D allows.
"""

from __future__ import annotations

from math import copysign, sqrt

import numpy as np

from contactlaw.jit import jit, jit_inline, jit_of_sums
from contactlaw.laws.record import SPRUNG
from contactlaw.laws.slip import carried
from contactlaw.laws.torsion import FULL, limit_point

RINGS, SECTORS = 10, 4
NUMBERS = 2 * RINGS * SECTORS  # of a contact
LEAST_SPIN = 0.02  # sigma, see `validation.reference.grid`, from which on psi_2 would be off by 2e-3 without sectors
REST = 4.2  # fitted to the grid with nu = 0 and 0.28
BESIDE = 0.05  # of the stuck stiffness that the whole span would have, that of the spring for what sectors miss
ENOUGH, MOST_SWEEPS = 2e-2, 6  # of what a step adds to the forces, what the last sweep may change
NEAR = 0.8  # of the limit squared: such a traction counts as on its limit at the start of the step

RIMS, LINE = np.arange(RINGS + 1) / RINGS, (np.arange(RINGS) + 0.5) / RINGS
# Those of a ring lie nearly between those of the next, or so few would slip more easily one way than another.
ANGLES = 2.0 * np.pi / SECTORS * (np.arange(SECTORS) + 0.4 * np.arange(RINGS)[:, None])
C, S, ONE, NONE = np.cos(ANGLES), np.sin(ANGLES), np.ones_like(ANGLES), np.zeros_like(ANGLES)
# Of each ring, both components of all six parts at its sectors: f, f, s, r, p, q.
PARTS = np.array([(ONE, NONE), (NONE, ONE), (-S, C), (C, S), (C, -S), (S, C)]).transpose(2, 0, 1, 3).copy()


def _abel(torsion):
    x2, r2 = RIMS**2, RIMS[:, None] ** 2
    h = np.sqrt(np.maximum(x2 - r2, 0.0)) * (8.0 / 3.0 * (2.0 * x2 + r2) if torsion else 2.0)
    return np.ascontiguousarray(-np.diff(np.diff(h, axis=1), axis=0))


def _compliance(surface, springs):
    line = np.linalg.inv(surface)
    return line.T @ (springs[:, None] * line)


def _arms():
    """rho over the span, from theta and q on their limits at 1 - x^2; the integral is that of `torsion`."""
    sine2, depth = np.sin(0.5 * np.pi * (np.arange(200) + 0.5) / 200) ** 2, 1.0 - LINE**2
    twists = depth / 2.0 * ((1.0 - sine2) / np.sqrt(LINE[:, None] ** 2 + depth[:, None] * sine2)).mean(1)
    moments, forces = _abel(True) @ twists, _abel(False) @ depth
    # A little less within, or what is hardly pressed would hold more than M_s.
    arms = moments / forces * (0.97 + 0.03 * LINE)
    arms[0] = 0.97 * FULL * LINE[0]
    arms *= FULL * forces.sum() / (arms @ forces)
    return arms


ARMS = _arms()
SLIDE, SWIRL = _abel(False), np.ascontiguousarray(_abel(True) / ARMS[:, None])
# Times G*, of f; times G_t, of s.
GIVE = np.stack([_compliance(SLIDE, np.full(RINGS, 2.0 / RINGS)), _compliance(SWIRL, 16.0 / 3.0 * np.diff(RIMS**3))])


@jit
def advance(contact, state, memory, modulus, moved):
    """Tangential force and moment of a contact after a step, for the normal forces that it has.

    contact: `laws.record.CONTACT`. state: `torsion.TORSION`. memory: g, shape (2, RINGS, SECTORS), over the span [N/m].
    modulus: G_t [Pa]. moved: du, dv [m], angle [rad]. Within, forces are over the span, moments over its square [N/m],
    moves times G*, and energies times 2 G* over the span.
    """
    if state.span == 0.0:
        state.span = sqrt(contact.radius * contact.reach)
    span, radius, soft = state.span, sqrt(contact.radius * contact.overlap), contact.g_star / modulus
    moves = contact.g_star * moved[0], contact.g_star * moved[1], contact.g_star * span * moved[2]
    hold = 0.5 / BESIDE, 0.5 / BESIDE, 3.0 / 16.0 * soft / BESIDE  # compliances of the spring beside
    limit, added, before, target = np.empty(RINGS), np.empty((2, RINGS)), memory.copy(), (0.0, 0.0, 0.0)
    load = fit(contact, span, limit, added, contact.friction * contact.elastic / span)
    way = add(memory, added, moves[0], moves[1], moves[2] / soft)
    slips = give_way(memory, before, limit, soft, ENOUGH * way)
    held = energy_of(state.missed, hold)
    energy = 2.0 * contact.g_star / span * state.stored - held
    f, g, m = resultant(memory)
    gain = energy + work(resultant(before), (f, g, m), moves) - stored(memory, soft)
    slips = slips and way > 0.0 and 2.0 * radius > span
    if slips:
        target = missed(limit, load, moves, radius / span)
    tried, was = np.empty(3), (state.missed[0], state.missed[1], state.missed[2])
    for k in range(3):
        tried[k] = was[k] + moves[k] / hold[k]
    back, share = min(sqrt(held / max(energy_of(tried, hold), 1e-300)), 1.0), way / (way + load)
    for attempt in range(2):
        for k in range(3):
            own = was[k] if slips and attempt == 0 else back * tried[k]
            state.missed[k] = own + share * (target[k] - own)
        u, v, w = f + state.missed[0], g + state.missed[1], m + state.missed[2]
        within, most = load / max(sqrt(u * u + v * v), load), FULL * load * radius / span
        state.missed[0], state.missed[1] = within * u - f, within * v - g
        state.missed[2] = min(max(w, -most), most) - m
        if gain + held + work(was, state.missed, moves) >= energy_of(state.missed, hold):
            break
        share = 0.0
    gain += held + work(was, state.missed, moves) - energy_of(state.missed, hold)
    if gain < 0.0 and (contact.overlap >= contact.before or way == 0.0):
        # Sectors and spring together, towards those of the start turned round or, as limits fall, towards nothing.
        turned = 1.0 if contact.overlap >= contact.before else 0.0
        memory += turned * before
        for k in range(3):
            state.missed[k] += turned * was[k]
        share = max(1.0 + gain / max(stored(memory, soft) + energy_of(state.missed, hold), 1e-300), 0.0)
        share = share if turned > 0.0 else sqrt(share)
        for k in range(3):
            state.missed[k] = share * state.missed[k] - turned * was[k]
        memory *= share
        memory -= turned * before
        f, g, m = resultant(memory)
    contact.f, contact.g = carried(contact, span * (f + state.missed[0]), span * (g + state.missed[1]))
    state.moment = span * span * (m + state.missed[2]) * min(contact.force / contact.elastic, 1.0)
    state.stored = 0.5 * span / contact.g_star * (stored(memory, soft) + energy_of(state.missed, hold))


@jit_inline
def work(start, end, moves):
    """Of the mean of two forces with their moments."""
    u, v, w = moves
    return (start[0] + end[0]) * u + (start[1] + end[1]) * v + (start[2] + end[2]) * w


@jit_inline
def energy_of(force, hold):
    """Of the spring beside the sectors."""
    return hold[0] * force[0] ** 2 + hold[1] * force[1] ** 2 + hold[2] * force[2] ** 2


@jit_of_sums
def fit(contact, span, limit_out, added_out, whole):
    """Limits of the rings, and what a unit of slide and of swirl adds to their forces; returns the limits' sum.

    whole: what that must be, mu P over the span [N/m]; zero where no cell's middle is in contact.
    """
    overlap, before, s2 = contact.overlap, contact.before, span * span / contact.radius
    rate = 1.0 / (overlap - before) if overlap > before else 1e300
    load = 0.0
    for j in range(RINGS):
        limit_out[j], added_out[0, j], added_out[1, j] = 0.0, 0.0, 0.0
        for i in range(j, RINGS):
            z = max(overlap - s2 * LINE[i] * LINE[i], 0.0)
            part = min(z * rate, 1.0)
            limit_out[j] += SLIDE[j, i] * z
            added_out[0, j] += SLIDE[j, i] * part
            added_out[1, j] += SWIRL[j, i] * part
        load += limit_out[j]
    share = whole / load if load > 0.0 else 0.0
    for j in range(RINGS):
        limit_out[j] *= share
    return max(share * load, 1e-300)


@jit_of_sums
def add(memory, added, gu, gv, gs):
    """Displace all sectors as if they stuck; returns how much that is, of all rings together."""
    way = 0.0
    for j in range(RINGS):
        du, dv, ds = added[0, j] * gu, added[0, j] * gv, added[1, j] * gs
        way += sqrt(du * du + dv * dv + ds * ds)
        for k in range(SECTORS):
            memory[0, j, k] += du + ds * PARTS[j, 2, 0, k]
            memory[1, j, k] += dv + ds * PARTS[j, 2, 1, k]
    return way


@jit_inline
def weights(soft):
    """Compliances of the parts and of the rest over `GIVE`; soft: G* over G_t, for one material 4/(2 - nu)."""
    radial = max(4.0 - soft, 1.0)
    return 1.0, 1.0, soft, radial, 2.0, 2.0, REST * soft / radial


@jit_of_sums
def give_way(memory, before, limit, soft, enough):
    """Let sectors slip until all are within their limits; returns whether all slip. before: tractions at the start."""
    gave, parts, trial = np.zeros((2, RINGS, SECTORS)), np.zeros((6, RINGS)), np.empty((2, SECTORS))
    slips, weight = True, weights(soft)
    for _ in range(MOST_SWEEPS):
        change, slips = 0.0, True
        for i in range(RINGS - 1, -1, -1):
            own = weight[6] * GIVE[1, i, i]
            one = 1.0 / max(GIVE[0, i, i], own, soft * GIVE[1, i, i])
            rest = one * own
            for k in range(SECTORS):
                trial[0, k] = memory[0, i, k] - (1.0 - rest) * gave[0, i, k]
                trial[1, k] = memory[1, i, k] - (1.0 - rest) * gave[1, i, k]
            for m in range(6):
                slip = 0.0
                for j in range(RINGS):
                    slip += GIVE[min(m // 2, 1), i, j] * parts[m, j]
                slip = one * weight[m] * slip - rest * parts[m, i]
                for k in range(SECTORS):
                    trial[0, k] += slip * PARTS[i, m, 0, k]
                    trial[1, k] += slip * PARTS[i, m, 1, k]
            most = limit[i] * limit[i]
            for k in range(SECTORS):
                x, y = trial[0, k], trial[1, k]
                over = x * x + y * y - most
                slips = slips and over >= 0.0
                if over > 0.0:
                    x, y = returned(x, y, before[0, i, k], before[1, i, k], most, over)
                gave[0, i, k], gave[1, i, k] = memory[0, i, k] - x, memory[1, i, k] - y
            for m in range(6):
                t = 0.0
                for k in range(SECTORS):
                    t += gave[0, i, k] * PARTS[i, m, 0, k] + gave[1, i, k] * PARTS[i, m, 1, k]
                t /= SECTORS
                change += abs(t - parts[m, i])
                parts[m, i] = t
        if change <= enough:
            break
    memory -= gave
    return slips


@jit_inline
def returned(x, y, u, v, most, over):
    """A traction on its limit, from (x, y), outside; (u, v): at the start. most: the limit squared; over: beyond it."""
    square = u * u + v * v
    if square > NEAR * most and over < 0.6 * most:
        onto = sqrt(most / square)
        u, v = onto * u, onto * v
        along = most + x * u + y * v
        if along > 1.5 * most:
            one = 1.0 / (2.0 * along + over)
            return (2.0 * along * x - over * u) * one, (2.0 * along * y - over * v) * one
    back = sqrt(most / (most + over))
    return back * x, back * y


@jit_of_sums
def resultant(tractions):
    """Force along both tangents, and moment."""
    f, g, m = 0.0, 0.0, 0.0
    for j in range(RINGS):
        for k in range(SECTORS):
            x, y = tractions[0, j, k], tractions[1, j, k]
            f += x
            g += y
            m += ARMS[j] * (x * PARTS[j, 2, 0, k] + y * PARTS[j, 2, 1, k])
    return f / SECTORS, g / SECTORS, m / SECTORS


@jit
def missed(limit, load, moves, radius):
    """What sectors miss of `resultant` if they slip as the rigid motion says. radius: of the contact, over the span."""
    u, v, w = moves
    tractions = np.empty((2, RINGS, SECTORS))
    for j in range(RINGS):
        for k in range(SECTORS):
            x, y = u + w * ARMS[j] * PARTS[j, 2, 0, k], v + w * ARMS[j] * PARTS[j, 2, 1, k]
            one = limit[j] / sqrt(x * x + y * y + 1e-300)
            tractions[0, j, k], tractions[1, j, k] = one * x, one * y
    f, g, m = resultant(tractions)
    slide, turn = sqrt(u * u + v * v), abs(w) * radius
    one = 1.0 / max(sqrt(slide * slide + turn * turn), 1e-300)
    force, moment, _ = limit_point(one * slide, one * turn)
    force *= load / max(slide, 1e-300)
    return force * u - f, force * v - g, copysign(load * radius * moment, w) - m


@jit_of_sums
def stored(tractions, soft):
    """Elastic energy."""
    parts, weight, energy = np.zeros((6, RINGS)), weights(soft), 0.0
    for i in range(RINGS):
        own = weight[6] * GIVE[1, i, i]
        for k in range(SECTORS):
            x, y = tractions[0, i, k], tractions[1, i, k]
            energy += own / SECTORS * (x * x + y * y)
            for m in range(6):
                parts[m, i] += (x * PARTS[i, m, 0, k] + y * PARTS[i, m, 1, k]) / SECTORS
        for m in range(6):
            energy -= own * parts[m, i] ** 2
    for m in range(6):
        for i in range(RINGS):
            for j in range(RINGS):
                energy += weight[m] * GIVE[min(m // 2, 1), i, j] * parts[m, i] * parts[m, j]
    return energy


@jit
def hand_over(contact, state, memory, modulus):
    """Give force and moment to the law's own springs and to `torsion`, as a stuck contact has them: of least energy.

    memory: what the law remembers, flat, where the sectors' tractions have been.
    """
    count, radius = memory.size // 2, sqrt(contact.radius * max(contact.before, 0.0))
    held = 1.0 / (2.0 * radius * contact.ratio) if radius * contact.ratio > 0.0 else 0.0
    turned = state.moment / (16.0 / 3.0 * modulus * radius**3) if radius > 0.0 else 0.0
    for i in range(count):
        memory[i], memory[count + i] = held * contact.f, held * contact.g
    for i in range(state.twists.size):
        state.twists[i] = turned
    contact.state, contact.scale = SPRUNG, state.span
