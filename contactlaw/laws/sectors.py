"""A contact that slips and spins at once: rings of sectors, each with a traction and a Coulomb limit of its own.

If a body spins about the normal, a point slips by (w_x - theta y, w_y + theta x), so a ring slips first on the side
where sliding and spinning add. Therefore each ring is divided into sectors at angles phi_k. A sector has a force g_k;
the force of a ring is the mean over its sectors. As a function of phi the force has the components

    g = f + s e_s + r e_r + p e_p + q e_q + rest        |g_k| <= mu P of the ring, slip along g_k
    e_s = (-sin, cos), the swirl        e_r = (cos, sin)        e_p = (cos, -sin)        e_q = (sin, cos)

The response to f is that of the line of springs, the response to s that of Lubkin's. Abel's transform relates both, in
cells of the line that end at x = c_i, to rings that end at the same radii (Popov & Hess 2015, section 17):

    f = B q              B_ji = H_i(c_(j-1)) - H_i(c_j)      H_i(r) = h(c_i) - h(c_(i-1))      h(x) = 2 sqrt(x^2 - r^2)
    rho s = B_t theta    likewise                                    h(x) = 8/3 sqrt(x^2 - r^2) (2 x^2 + r^2)

rho is the moment of a ring on its limit over its force. The energies of both kinds of springs give the compliances A
between rings. Cerruti's kernel is [1 - nu k k/k^2]/(G k) for waves k. So components that vary as sin and cos respond
like the swirl, with 1/G; times 1 - nu for e_r, whose tractions are along k, and times 1 - nu/2 for e_p and e_q, half of
whose tractions are. The rest is displaced by its own ring only, by 2.1/(1 - nu) times what e_p is by its own ring; this
factor is fitted to psi_2 of the grid (`validation.reference.grid`).

If all sectors stuck, a step would change the tractions from g_0 to g*. The slip A (g* - g) reduces them to g, within
the limits.
The slip of a sector is along the mean of its tractions before and after the step, or along the traction after it if the
sector has just reached its limit. The work of the mean force, less the increase of elastic energy, is

    D = (g_0 + g) . A (g* - g)/2,        zero on the ball with the diameter from -g_0 to g*, positive inside.

Limits are convex and symmetric. So if none falls, D >= 0 for exact slip along the final traction, as -g_0 is allowed
too. The few sweeps of Gauss-Seidel, from the edge inwards, may leave D < 0. Then the tractions move towards -g_0 until
D = 0. So no step creates energy, however large; nor does a change of the load alone, since the energy that a falling
limit takes from its traction is lost. If load and displacement change together, the work of the mean force has an error
of second order in the step.
A contact that has slipped as a whole for some distance has the force and moment of `torsion.limit_point`. The few
sectors miss up to 0.03 mu P of it. A spring parallel to them carries the difference, which is approached over about one
elastic displacement, as far as D allows.
"""

from math import copysign, sqrt

import numpy as np
from numba import carray  # pyright: ignore[reportPrivateImportUsage]

from contactlaw.jit import jit, jit_inline, jit_of_sums
from contactlaw.laws import torsion
from contactlaw.laws.creep import strained
from contactlaw.laws.hertz import greatest_overlap
from contactlaw.laws.record import LASTING, OPEN, PAIR_SIZE, SPRUNG, SPUN, law_at
from contactlaw.laws.slip import carried, slipped_along_mean, span_of
from contactlaw.laws.torsion import FULL, limit_point, stuck_stiffness
from contactlaw.memory import doubles_at

RINGS, SECTORS = 10, 4
NUMBERS = 2 * RINGS * SECTORS  # numbers that a contact stores
LEAST_SPIN = 0.02  # sigma (`validation.reference.grid`) from which on psi_2 would be off by 2e-3 without sectors
REST = 4.2  # compliance of the rest, fitted to the grid with nu = 0 and 0.28
PARALLEL = 0.05  # stiffness of the parallel spring over the stuck stiffness of a contact of the whole span
TOLERANCE, MOST_SWEEPS = 2e-2, 6  # change in the last sweep, over what the step adds to the forces; most sweeps
NEAR = 0.8  # a traction whose square is above this share of the limit's counts as on the limit at the step's start

RIMS, LINE = np.arange(RINGS + 1) / RINGS, (np.arange(RINGS) + 0.5) / RINGS
# Sectors of a ring lie nearly between those of the next, or four of them would slip more easily in some directions.
ANGLES = 2.0 * np.pi / SECTORS * (np.arange(SECTORS) + 0.4 * np.arange(RINGS)[:, None])
C, S, ONE, NONE = np.cos(ANGLES), np.sin(ANGLES), np.ones_like(ANGLES), np.zeros_like(ANGLES)
# PARTS[ring, part, :, sector]: both components of the parts f_x, f_y, e_s, e_r, e_p, e_q.
PARTS = np.array([(ONE, NONE), (NONE, ONE), (-S, C), (C, S), (C, -S), (S, C)]).transpose(2, 0, 1, 3).copy()


def _abel(torsion):
    """Abel's transform from cells of the line to rings: B_t of torsion, or B."""
    x2, r2 = RIMS**2, RIMS[:, None] ** 2
    h = np.sqrt(np.maximum(x2 - r2, 0.0)) * (8.0 / 3.0 * (2.0 * x2 + r2) if torsion else 2.0)
    return np.ascontiguousarray(-np.diff(np.diff(h, axis=1), axis=0))


def _arms():
    """Lever arms rho of the rings over the span, from the limits of theta and q of a contact with p = 1 - x^2."""
    sine2, depth = np.sin(0.5 * np.pi * (np.arange(200) + 0.5) / 200) ** 2, 1.0 - LINE**2
    twists = depth / 2.0 * ((1.0 - sine2) / np.sqrt(LINE[:, None] ** 2 + depth[:, None] * sine2)).mean(1)
    moments, forces = _abel(True) @ twists, _abel(False) @ depth
    # Slightly reduced towards the centre, or a contact that is small beside the span would hold more than M_s.
    arms = moments / forces * (0.97 + 0.03 * LINE)
    arms[0] = 0.97 * FULL * LINE[0]
    arms *= FULL * forces.sum() / (arms @ forces)
    return arms


ARMS = _arms()
SLIDE, SWIRL = _abel(False), np.ascontiguousarray(_abel(True) / ARMS[:, None])
# Compliances between rings: of f, times G*; of s, times G_t. Their forces are those of the line's springs, transformed.
LINES, SPRINGS = np.linalg.inv([SLIDE, SWIRL]), np.stack([np.full(RINGS, 2.0 / RINGS), 16.0 / 3.0 * np.diff(RIMS**3)])
COMPLIANCE = LINES.transpose(0, 2, 1) @ (SPRINGS[:, :, None] * LINES)


@jit
def advance(contact, state, memory, modulus, moved):
    """Update tangential force and moment of a contact by a step, for its present normal forces.

    state: `torsion.TORSION`. memory: g over the span [N/m], (2, RINGS, SECTORS). modulus: G_t [Pa]. moved: displacement
    du, dv [m] and angle [rad]. Inside, forces are over the span and moments over its square [N/m], displacements times
    G*, and energies times 2 G* over the span.
    """
    if state.span == 0.0:
        state.span = sqrt(contact.radius * contact.reach)
    span, radius, soft = state.span, sqrt(contact.radius * contact.overlap), contact.g_star / modulus
    moves = contact.g_star * moved[0], contact.g_star * moved[1], contact.g_star * span * moved[2]
    hold = 0.5 / PARALLEL, 0.5 / PARALLEL, 3.0 / 16.0 * soft / PARALLEL  # compliances of the parallel spring
    limit, added, before, target = np.empty(RINGS), np.empty((2, RINGS)), memory.copy(), (0.0, 0.0, 0.0)
    load = fit(contact, span, limit, added, contact.friction * contact.elastic / span)
    way = add(memory, added, moves[0], moves[1], moves[2] / soft)
    slips = let_slip(memory, before, limit, soft, TOLERANCE * way)
    held = energy_of(state.missed, hold)
    energy = 2.0 * contact.g_star / span * state.stored - held
    elastic = stored(memory, soft)
    gain = energy + work(resultant(before), resultant(memory), moves) - elastic
    if gain < 0.0:
        gain = pull_back(memory, before, limit, soft, (gain, energy, moves))
        elastic = stored(memory, soft)
    f, g, m = resultant(memory)
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
    if gain < 0.0 and contact.overlap >= contact.before:
        # The contact's limit has reduced the parallel spring. Move sectors and spring together; no limit falls.
        memory += before
        for k in range(3):
            state.missed[k] += was[k]
        share = max(1.0 + gain / (stored(memory, soft) + energy_of(state.missed, hold)), 0.0)
        for k in range(3):
            state.missed[k] = share * state.missed[k] - was[k]
        memory *= share
        memory -= before
        elastic, (f, g, m) = stored(memory, soft), resultant(memory)
    contact.f, contact.g = carried(contact, span * (f + state.missed[0]), span * (g + state.missed[1]))
    state.moment = span * span * (m + state.missed[2]) * contact.ratio
    state.stored = 0.5 * span / contact.g_star * (elastic + energy_of(state.missed, hold))


@jit_inline
def work(start, end, moves):
    """Work of the mean of two forces with their moments, in the units of `advance`."""
    u, v, w = moves
    return (start[0] + end[0]) * u + (start[1] + end[1]) * v + (start[2] + end[2]) * w


@jit_inline
def energy_of(force, hold):
    """Elastic energy of the parallel spring. hold: its compliances."""
    return hold[0] * force[0] ** 2 + hold[1] * force[1] ** 2 + hold[2] * force[2] ** 2


@jit_of_sums
def fit(contact, span, limit_out, added_out, whole):
    """Compute the limits of the rings, and their forces under unit displacement and unit twist; return the limits' sum.

    whole: mu P over the span [N/m], to which they are scaled. A cell is in contact if its middle is; the innermost one
    has at least the mean depth of a contact that ends within it, which else would have no friction.
    """
    overlap, before, s2 = contact.overlap, contact.before, span * span / contact.radius
    centre = 2.0 / 3.0 * overlap * min(RINGS * sqrt(overlap / s2), 1.0)
    rate = 1.0 / (overlap - before) if overlap > before else 1e300
    load = 0.0
    for j in range(RINGS):
        limit_out[j], added_out[0, j], added_out[1, j] = 0.0, 0.0, 0.0
        for i in range(j, RINGS):
            z = max(overlap - s2 * LINE[i] * LINE[i], centre if i == 0 else 0.0)
            part = min(z * rate, 1.0)
            limit_out[j] += SLIDE[j, i] * z
            added_out[0, j] += SLIDE[j, i] * part
            added_out[1, j] += SWIRL[j, i] * part
        load += limit_out[j]
    for j in range(RINGS):
        limit_out[j] *= whole / load
    return max(whole, 1e-300)


@jit_of_sums
def add(memory, added, gu, gv, gs):
    """Displace all sectors as if they stuck; return the sum of the changes of the rings' forces."""
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
    """Factors on `COMPLIANCE` for the six parts and the rest. soft: G*/G_t, 4/(2 - nu) for equal materials."""
    radial = max(4.0 - soft, 1.0)
    return 1.0, 1.0, soft, radial, 2.0, 2.0, REST * soft / radial


@jit_of_sums
def let_slip(memory, before, limit, soft, tolerance):
    """Let sectors slip until a sweep changes less than `tolerance`; return whether all slip. before: at the start."""
    lost, parts, trial = np.zeros((2, RINGS, SECTORS)), np.zeros((6, RINGS)), np.empty((2, SECTORS))
    slips, weight = True, weights(soft)
    for _ in range(MOST_SWEEPS):
        change, slips = 0.0, True
        for i in range(RINGS - 1, -1, -1):
            own = weight[6] * COMPLIANCE[1, i, i]
            one = 1.0 / max(COMPLIANCE[0, i, i], own, soft * COMPLIANCE[1, i, i])
            rest = one * own
            for k in range(SECTORS):
                trial[0, k] = memory[0, i, k] - (1.0 - rest) * lost[0, i, k]
                trial[1, k] = memory[1, i, k] - (1.0 - rest) * lost[1, i, k]
            for m in range(6):
                slip = 0.0
                for j in range(RINGS):
                    slip += COMPLIANCE[min(m // 2, 1), i, j] * parts[m, j]
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
                lost[0, i, k], lost[1, i, k] = memory[0, i, k] - x, memory[1, i, k] - y
            for m in range(6):
                t = 0.0
                for k in range(SECTORS):
                    t += lost[0, i, k] * PARTS[i, m, 0, k] + lost[1, i, k] * PARTS[i, m, 1, k]
                t /= SECTORS
                change += abs(t - parts[m, i])
                parts[m, i] = t
        if change <= tolerance:
            break
    memory -= lost
    return slips


@jit_inline
def returned(x, y, u, v, most, over):
    """Return a traction (x, y) to its limit. (u, v): at the start. most: limit squared. over: x^2 + y^2 - most."""
    square = u * u + v * v
    if square > NEAR * most and over < 0.6 * most:
        onto = sqrt(most / square)
        u, v = onto * u, onto * v
        along = most + x * u + y * v
        if along > 1.5 * most:
            return slipped_along_mean(x, y, u, v, along, over)
    back = sqrt(most / (most + over))
    return back * x, back * y


@jit
def pull_back(memory, before, limit, soft, known):
    """Move tractions with D < 0 towards the reversed ones of the start, until D = 0; limits may have fallen since.

    known: 2 D, the elastic energy before, and the displacements. Returns 2 D, negative only if no state on the way has
    D = 0.
    """
    gain, energy, moves = known
    start = resultant(before)
    for i in range(RINGS):
        for k in range(SECTORS):
            x, y = before[0, i, k], before[1, i, k]
            back = min(limit[i] / sqrt(x * x + y * y + 1e-300), 1.0)
            before[0, i, k], before[1, i, k] = back * x, back * y
    memory += before
    f, g, m = resultant(before)
    least = energy + work(start, (-f, -g, -m), moves) - stored(before, soft)
    bend = max(stored(memory, soft), 1e-300)  # 0 if no ring is in contact any more
    rise = gain - least + bend
    share = (rise + sqrt(max(rise * rise + 4.0 * bend * least, 0.0))) / (2.0 * bend)
    share = min(max(share, 0.0), 1.0)
    memory *= share
    memory -= before
    return least + share * (rise - share * bend)


@jit_of_sums
def resultant(tractions):
    """Force along both tangents, and moment, of all sectors."""
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
    """Force and moment of full slip by `torsion.limit_point`, less those of the sectors; radius: over the span."""
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
    """Elastic energy of the sectors."""
    parts, weight, energy = np.zeros((6, RINGS)), weights(soft), 0.0
    for i in range(RINGS):
        own = weight[6] * COMPLIANCE[1, i, i]
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
                energy += weight[m] * COMPLIANCE[min(m // 2, 1), i, j] * parts[m, i] * parts[m, j]
    return energy


@jit
def hand_over(contact, state, memory, modulus):
    """Return a contact from sectors to its law and to `torsion`, with the same force and moment, as if it had stuck.

    memory: vectors of the law, flat, in place of the sectors' tractions.
    """
    count, radius = memory.size // 2, sqrt(contact.radius * max(contact.before, 0.0))
    held = 1.0 / (2.0 * radius * contact.ratio) if radius * contact.ratio > 0.0 else 0.0
    memory[:count], memory[count:] = held * contact.f, held * contact.g
    # as the forces, the twists are those without the damper's share: 2 held radius is 1 over the ratio
    state.twists[:] = 2.0 * held * radius * state.moment / stuck_stiffness(modulus, radius) if radius > 0.0 else 0.0
    contact.state, contact.scale = SPRUNG, state.span


def advance_spinning(c, memory, numbers, moved, turned, dt, roomy, dashpot):
    """Update force and moment of contact c of a world that spins, after its normal force; called by address.

    Where its law allows, sectors follow a contact from its touch, until it is a persistent contact or the span of its
    rings no longer fits. memory, numbers: addresses of the law's history and of the pair's numbers. moved, turned, dt:
    as for `torsion.advance`. roomy: whether sectors may begin. dashpot: spin of A over B [rad/s] and effective moment
    of inertia [kg m^2], of a critical dashpot about the normal; inertia 0: none.
    """
    t, pair, law = c.touch, law_at(numbers, 0), carray(doubles_at(numbers + 8 * PAIR_SIZE), 1)
    own = carray(doubles_at(memory), 2 * int(pair.vectors))
    if t.state == OPEN and roomy and pair.sectors > 0.0:
        deepest = greatest_overlap(t.stiffness, t.mass, max(t.before, 0.0), t.closing)
        sigma = t.g_star * abs(moved[2]) * sqrt(t.radius * deepest) / (t.mu * t.e_star * (t.overlap - t.before))
        if sigma > LEAST_SPIN:
            t.state = SPUN
    elif t.state == SPUN and (t.course == LASTING or span_of(t, c.torsion.span) != c.torsion.span):
        hand_over(t, c.torsion, own, pair.g_t)
    left = t.mu
    if t.state == SPUN:
        advance(t, c.torsion, carray(doubles_at(memory), (2, RINGS, SECTORS)), pair.g_t, moved)
    else:
        strain = strained(c.torsion, t, pair.g_t, (moved[0], moved[1], turned[0]), c.passed[2], True)
        if c.torsion.rolled > 0.0:
            moved, turned = strain, (strain[2], turned[1])
        left = torsion.advance(c.torsion, t, pair, law, own, moved, turned, dt)
    c.torsion.friction, (rate, inertia) = left, dashpot
    if inertia > 0.0:  # within the limit of the moment
        radius = sqrt(t.radius * t.overlap)
        most, drag = FULL * left * t.force * radius, 2.0 * sqrt(stuck_stiffness(pair.g_t, radius) * inertia)
        c.torsion.moment = min(max(c.torsion.moment + drag * rate, -most), most)
