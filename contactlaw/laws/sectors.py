"""A contact that slips and spins at once: rings of sectors, each with a traction and Coulomb's limit of its own.

Where a body spins about the normal a place slips by (w_x - theta y, w_y + theta x): a ring slips first on the side
where slide and spin add. So each ring has sectors of a force g_k, in units in which the ring has their mean,

    g_k = f + s e_k + rest        e_k: along the spin        |g_k| <= mu P of the ring, slip along g_k

The response to f is that of the line of springs, the response to the swirl s that of Lubkin's, both by Abel's transform
from the place x on the line, in cells that end at c_i, to rings that end there too (Popov & Hess 2015, section 17):

    f = B q              B_ji = H_i(c_(j-1)) - H_i(c_j)      H_i(r) = h(c_i) - h(c_(i-1))      h(x) = 2 sqrt(x^2 - r^2)
    rho s = B_t theta    likewise                                    h(x) = 8/3 sqrt(x^2 - r^2) (2 x^2 + r^2)

rho: moment of a ring on its limit over its force. The energies of both kinds of springs make the compliances between
rings; the rest answers to its own ring, as stiff as f. With slip along the tractions at the end of a step, these make
a convex function least (Kalker 1990, section 4.3), which is found ring by ring from the edge inwards (Gauss-Seidel).
A contact that slips as a whole for long has the force and moment of `torsion.limit_point`: what few sectors miss of it,
up to 0.04 mu P, is put right on the way of one elastic displacement.
"""

from __future__ import annotations

from math import copysign, sqrt

import numpy as np

from contactlaw.jit import jit, jit_of_sums
from contactlaw.laws.record import SPRUNG
from contactlaw.laws.slip import carried
from contactlaw.laws.torsion import FULL, limit_point

RINGS, SECTORS = 10, 3
NUMBERS = 2 * RINGS * SECTORS  # of a contact
LEAST_SPIN = 0.02  # sigma, see `validation.reference.grid`, from which on psi_2 would be off by 2e-3 without sectors
ENOUGH, MOST_SWEEPS = 1e-2, 30  # of what a step adds to the forces, what the last sweep may change

RIMS, LINE = np.arange(RINGS + 1) / RINGS, (np.arange(RINGS) + 0.5) / RINGS
# Those of a ring lie nearly between those of the next, or so few would slip more easily one way than another.
ANGLES = 2.0 * np.pi / SECTORS * (np.arange(SECTORS) + 0.4 * np.arange(RINGS)[:, None])
ALONG = np.stack([-np.sin(ANGLES), np.cos(ANGLES)])


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
    return moments / forces * (3.0 * np.pi / 16.0 * forces.sum() / moments.sum())


ARMS = _arms()
SLIDE, SWIRL = _abel(False), np.ascontiguousarray(_abel(True) / ARMS[:, None])
GIVE = _compliance(SLIDE, np.full(RINGS, 2.0 / RINGS))  # times G*
GIVE_SWIRL = _compliance(SWIRL, 16.0 / 3.0 * np.diff(RIMS**3))  # times G_t
OWN, OWN_SWIRL = np.diag(GIVE).copy(), np.diag(GIVE_SWIRL).copy()


@jit
def advance(contact, state, memory, modulus, moved):
    """Tangential force and moment of a contact after a step, for the normal forces that it has.

    contact: `laws.record.CONTACT`. state: `torsion.TORSION`. memory: g, shape (2, RINGS, SECTORS), over the span [N/m].
    modulus: G_t [Pa]. moved: du, dv [m], angle [rad].
    """
    du, dv, angle = moved
    if state.span == 0.0:
        state.span = sqrt(contact.radius * contact.reach)
    span, radius, full = state.span, sqrt(contact.radius * contact.overlap), contact.friction * contact.elastic
    limit, added = np.empty(RINGS), np.empty((2, RINGS))
    load = fit(contact, span, limit, added, full / span)
    way = add(memory, added, contact.g_star * du, contact.g_star * dv, modulus * span * angle)
    slips = give_way(memory, limit, contact.g_star / modulus, ENOUGH * way)
    f, g, m = resultant(memory, load, radius / span)
    known = (0.0, 0.0, 0.0)
    if slips and way > 0.0 and 2.0 * radius > span:
        known = missed(limit, load, (du, dv, span * angle), radius / span)
    for k in range(3):
        state.missed[k] += way / (way + load) * (known[k] - state.missed[k])
    f, g, m = f + state.missed[0], g + state.missed[1], m + state.missed[2]
    full /= max(sqrt(f * f + g * g), 1.0)
    contact.f, contact.g = carried(contact, full * f, full * g)
    state.moment = FULL * contact.friction * min(contact.force, contact.elastic) * radius * min(max(m, -1.0), 1.0)
    slide, swirl = energies(memory)
    state.stored = 0.5 * span * (slide / contact.g_star + swirl / modulus)


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
            memory[0, j, k] += du + ds * ALONG[0, j, k]
            memory[1, j, k] += dv + ds * ALONG[1, j, k]
    return way


@jit_of_sums
def give_way(memory, limit, soft, enough):
    """Let sectors slip until all are within their limits; returns whether all slip. soft: G* over G_t."""
    gave, mean = np.zeros((2, RINGS, SECTORS)), np.zeros((3, RINGS))  # of the tractions, by slip
    slips = True
    for _ in range(MOST_SWEEPS):
        change, slips = 0.0, True
        for i in range(RINGS - 1, -1, -1):
            u, v, s = 0.0, 0.0, 0.0
            for j in range(RINGS):
                u += GIVE[i, j] * mean[0, j]
                v += GIVE[i, j] * mean[1, j]
                s += GIVE_SWIRL[i, j] * mean[2, j]
            one = 1.0 / max(OWN[i], soft * OWN_SWIRL[i])
            rest = one * OWN[i]
            u, v, s = one * u - rest * mean[0, i], one * v - rest * mean[1, i], one * soft * s - rest * mean[2, i]
            most, sum_u, sum_v, sum_s = limit[i] * limit[i], 0.0, 0.0, 0.0
            for k in range(SECTORS):
                ex, ey = ALONG[0, i, k], ALONG[1, i, k]
                x = memory[0, i, k] - (1.0 - rest) * gave[0, i, k] + u + s * ex
                y = memory[1, i, k] - (1.0 - rest) * gave[1, i, k] + v + s * ey
                square = x * x + y * y
                slips = slips and square >= most
                back = limit[i] / sqrt(square) if square > most else 1.0
                x, y = memory[0, i, k] - back * x, memory[1, i, k] - back * y
                gave[0, i, k], gave[1, i, k] = x, y
                sum_u += x
                sum_v += y
                sum_s += x * ex + y * ey
            sum_u, sum_v, sum_s = sum_u / SECTORS, sum_v / SECTORS, sum_s / SECTORS
            change += abs(sum_u - mean[0, i]) + abs(sum_v - mean[1, i]) + abs(sum_s - mean[2, i])
            mean[0, i], mean[1, i], mean[2, i] = sum_u, sum_v, sum_s
        if change <= enough:
            break
    memory -= gave
    return slips


@jit_of_sums
def resultant(memory, load, radius):
    """F/(mu P) along both tangents, and M/M_s; load: the limits' sum. radius: of the contact, over the span."""
    f, g, m = 0.0, 0.0, 0.0
    for j in range(RINGS):
        for k in range(SECTORS):
            x, y = memory[0, j, k], memory[1, j, k]
            f += x
            g += y
            m += ARMS[j] * (x * ALONG[0, j, k] + y * ALONG[1, j, k])
    one = 1.0 / (SECTORS * load)
    return one * f, one * g, one * m / (FULL * radius)


@jit
def missed(limit, load, moved, radius):
    """What sectors miss of `resultant`, see there, if they slip as the rigid motion says.

    moved: du, dv, and by the spin at the span [m].
    """
    u, v, w = moved
    tractions = np.empty((2, RINGS, SECTORS))
    for j in range(RINGS):
        for k in range(SECTORS):
            x, y = u + w * ARMS[j] * ALONG[0, j, k], v + w * ARMS[j] * ALONG[1, j, k]
            one = limit[j] / sqrt(x * x + y * y + 1e-300)
            tractions[0, j, k], tractions[1, j, k] = one * x, one * y
    f, g, m = resultant(tractions, load, radius)
    slide, turn = sqrt(u * u + v * v), abs(w) * radius
    one = 1.0 / max(sqrt(slide * slide + turn * turn), 1e-300)
    force, moment, _ = limit_point(one * slide, one * turn)
    force /= max(slide, 1e-300)
    return force * u - f, force * v - g, copysign(moment / FULL, w) - m


@jit_of_sums
def energies(memory):
    """Elastic energy of f with the rest, times 2 G* over the span, and of s, times 2 G_t over it."""
    mean, energy, swirl = np.zeros((3, RINGS)), 0.0, 0.0
    for i in range(RINGS):
        for k in range(SECTORS):
            x, y = memory[0, i, k] / SECTORS, memory[1, i, k] / SECTORS
            mean[0, i] += x
            mean[1, i] += y
            mean[2, i] += x * ALONG[0, i, k] + y * ALONG[1, i, k]
            energy += OWN[i] * SECTORS * (x * x + y * y)
        energy -= OWN[i] * (mean[0, i] ** 2 + mean[1, i] ** 2 + mean[2, i] ** 2)
    for i in range(RINGS):
        for j in range(RINGS):
            energy += GIVE[i, j] * (mean[0, i] * mean[0, j] + mean[1, i] * mean[1, j])
            swirl += GIVE_SWIRL[i, j] * mean[2, i] * mean[2, j]
    return energy, swirl


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
