"""Force of one contact: Hertz with the damper of Tsuji et al., and microslip in the tangent plane.

Equations and sources as in `kernels.contact` and `kernels.microslip`; here the nodes are free of branches, so that
their loop runs on vectors. Everything that the world asks of a law is in this file.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from contactlaw.jit import jit, jit_of_sums

MATERIAL = np.dtype([(name, "f8") for name in ("e_star", "g_star", "friction", "zeta")])
CONTACT = np.dtype(
    (np.record, np.dtype([
        (name, "f8") for name in (
            "e_star", "g_star", "radius", "friction", "zeta",  # what it is made of
            "mass", "tangential_mass",  # effective [kg]
            "overlap", "before", "closing",  # [m] now and a substep ago, [m/s] between
            "force", "ratio", "f", "g",  # normal [N], over the elastic one, and along both tangents [N]
            "state", "course", "scale",  # `scale`: contact radius that the nodes span [m]
        )
    ]))
)  # fmt: skip

OPEN, SLIDING, SPRUNG = 0.0, 1.0, 2.0  # states: SLIDING as a whole since the touch, or SPRUNG: some of it has stuck
PRESSED, EXPANDING, LASTING = 0.0, 1.0, 2.0  # courses of the damped normal motion
MARGIN = 1.02  # of the nodes over the greatest contact radius foreseen
STRAIGHT = 1e-6  # sine of the angle to which a slide may turn in a substep and still count as straight
CALM = 0.3  # of critical damping: a dashpot across a contact that lasts and is damped along the normal


@jit
def stiffness(c):
    """k of P = k delta^1.5 [N/m^1.5] (Hertz)."""
    return 4.0 / 3.0 * c.e_star * sqrt(c.radius)


@jit
def deepest(c, closing):
    """Overlap [m] at which an undamped contact that has this closing speed [m/s] now will stop."""
    x = max(c.overlap, 0.0)
    return (x * x * sqrt(x) + 1.25 * c.mass * closing * closing / stiffness(c)) ** 0.4


@jit
def begin(c):
    """A contact that closes now."""
    c.state = OPEN
    c.course = PRESSED
    c.force = 0.0
    c.ratio = 1.0
    c.f = 0.0
    c.g = 0.0
    c.scale = 0.0


@jit
def advance_contact(c, memory, nodes, du, dv, dt, free):
    """Advance a closed contact by one substep to the overlap it has now; new are force, ratio, f, g.

    du, dv: what A has moved over B along both tangents [m]. dt [s]. free: closing acceleration by all but this
    contact [m/s^2].
    """
    overlap = c.overlap
    elastic = stiffness(c) * overlap * sqrt(overlap)
    if c.state == OPEN:
        c.scale = MARGIN * sqrt(c.radius * (max(deepest(c, c.closing), overlap)))
        for i in range(memory.shape[1]):
            memory[0, i] = 0.0
            memory[1, i] = 0.0
    force, ratio = normal_force(c, elastic, dt, free)
    if c.course == PRESSED and ratio < 1.0:
        c.course = EXPANDING
    elif c.course == EXPANDING and ratio >= 1.0:
        c.course = LASTING
    c.force = force
    if c.friction == 0.0:
        c.state = SLIDING
    elif c.state == SPRUNG or not slides_on(c, du, dv):
        stick_and_slip(c, memory, nodes, du, dv, elastic)
        if c.course == LASTING and c.zeta > 0.0 and dt > 0.0:
            calm(c, du / dt, dv / dt)
    else:
        c.ratio = ratio


@jit
def normal_force(c, elastic, dt, free):
    """P [N] and its ratio to the elastic one; the damper acts on the closing speed at the end of the substep."""
    if c.zeta == 0.0:
        return elastic, 1.0
    # c = sqrt(5) zeta sqrt(m k) delta^(1/4): Tsuji, Tanaka & Ishida (1992)
    damping = sqrt(5.0 * c.mass * stiffness(c) * sqrt(c.overlap)) * c.zeta
    force = (elastic + damping * (c.closing + 0.5 * dt * free)) / (1.0 + 0.5 * damping * dt / c.mass)
    if force <= 0.0:
        return 0.0, 0.0
    return force, force / elastic


@jit
def slides_on(c, du, dv):
    """Whether a contact that has slid as a whole since the touch still does; then f and g are those of sliding."""
    part = 1.0 if c.before >= 0.0 else c.overlap / (c.overlap - c.before)
    u, v = c.g_star * part * du, c.g_star * part * dv
    old = sqrt(c.f * c.f + c.g * c.g)
    cap = c.friction * c.e_star
    if old > 0.0:
        if abs(u * c.g - v * c.f) > STRAIGHT * old * sqrt(u * u + v * v):
            return False
        stretch = cap * max(c.before, 0.0) / old
        u += stretch * c.f
        v += stretch * c.g
    size = sqrt(u * u + v * v)
    if size == 0.0 or size < cap * c.overlap:
        return False
    c.state = SLIDING
    c.f = c.friction * c.force * u / size
    c.g = c.friction * c.force * v / size
    return True


@jit
def stick_and_slip(c, memory, nodes, du, dv, elastic):
    """The springs: displaced, capped, summed."""
    span = span_of(c)
    if c.state == SLIDING:
        spread(c, memory, nodes)
    elif c.state == SPRUNG and span != c.scale:
        regrid(c, memory, nodes, span)
    c.scale = span
    c.state = SPRUNG
    gained = c.overlap - c.before
    inverse = 1.0 / gained if gained > 0.0 else 1e300
    f, g, load = springs(
        memory, nodes, span * span / c.radius, c.overlap, inverse, c.g_star * du, c.g_star * dv, c.friction * c.e_star
    )
    share = elastic / (c.e_star * load) if load > 0.0 else 0.0
    f *= share
    g *= share
    ratio = c.force / elastic
    if c.course == LASTING:  # friction has the springs' force alone, see `kernels.contact.carried`
        pull, limit = sqrt(f * f + g * g), c.friction * c.force
        ratio = limit / pull if pull > limit else 1.0
    c.ratio = ratio
    c.f = ratio * f
    c.g = ratio * g


@jit_of_sums
def springs(memory, nodes, s2, overlap, inverse, gu, gv, cap):
    """Displace all nodes; returns the sums of both tractions and of the loads over E*. s2: span^2/R [m]."""
    pu = 0.0
    pv = 0.0
    load = 0.0
    for i in range(memory.shape[1]):
        x = nodes[0, i]
        w = nodes[1, i]
        z = max(overlap - s2 * x * x, 0.0)
        part = min(z * inverse, 1.0)  # one that comes into contact in this substep moves from that instant only
        u = memory[0, i] + part * gu
        v = memory[1, i] + part * gv
        back = min(cap * z / sqrt(u * u + v * v + 1e-300), 1.0)
        u *= back
        v *= back
        memory[0, i] = u
        memory[1, i] = v
        pu += w * u
        pv += w * v
        load += w * z
    return pu, pv, load


@jit
def calm(c, u, v):
    """Add a dashpot across, within the cone; u, v: sliding speed [m/s]."""
    drag = 2.0 * CALM * sqrt(2.0 * c.g_star * sqrt(c.radius * c.overlap) * c.tangential_mass)
    c.f += drag * u
    c.g += drag * v
    pull, limit = sqrt(c.f * c.f + c.g * c.g), c.friction * c.force
    if pull > limit:
        c.f *= limit / pull
        c.g *= limit / pull


@jit
def span_of(c):
    """Contact radius [m] for the nodes to span: the present one unless the contact outgrows it or lives far inside."""
    a2 = c.radius * c.overlap
    if a2 > c.scale * c.scale:
        return 1.25 * sqrt(a2)
    if a2 * 4.0 < c.scale * c.scale:
        far = sqrt(c.radius * deepest(c, c.closing))
        if 2.0 * far < c.scale:
            return MARGIN * far
    return c.scale


@jit
def spread(c, memory, nodes):
    """Tractions of a contact that has been sliding as a whole: all on their caps."""
    x = max(c.before, 0.0)
    share = 0.0
    if x > 0.0 and c.ratio > 0.0:
        share = 1.0 / (4.0 / 3.0 * sqrt(c.radius * x) * x * c.ratio)
    for i in range(memory.shape[1]):
        z = share * max(x - (c.scale * nodes[0, i]) ** 2 / c.radius, 0.0)
        memory[0, i] = c.f * z
        memory[1, i] = c.g * z


@jit
def regrid(c, memory, nodes, span):
    """Tractions at the nodes of another span: linear between the old ones, scaled to the old force or energy."""
    n = memory.shape[1]
    edge = sqrt(c.radius * max(c.before, 0.0)) / c.scale
    old_u, old_v = memory[0].copy(), memory[1].copy()
    both, square, energy, new_energy = 0.0, 0.0, 0.0, 0.0
    for p in range(2):
        old = old_u if p == 0 else old_v
        force, new_force = 0.0, 0.0
        for i in range(n):
            at = nodes[0, i] * span / c.scale
            value = 0.0
            if at < edge:
                j = 0
                while j < n and nodes[0, j] < min(at, edge):
                    j += 1
                right = nodes[0, j] if j < n and nodes[0, j] < edge else edge
                top = old[j] if j < n and nodes[0, j] < edge else 0.0
                value = old[0]
                if j > 0:
                    left = nodes[0, j - 1]
                    value = old[j - 1] + (top - old[j - 1]) * (at - left) / (right - left)
            memory[p, i] = value
            force += c.scale * nodes[1, i] * old[i]
            new_force += span * nodes[1, i] * value
            energy += c.scale * nodes[1, i] * old[i] * old[i]
            new_energy += span * nodes[1, i] * value * value
        both += force * new_force
        square += new_force * new_force
    share = both / square if square > 0.0 else 1.0
    if not 0.5 < share < 2.0:
        share = 1.0
    if share * share * new_energy > energy:
        share = sqrt(energy / new_energy)
    for i in range(n):
        memory[0, i] *= share
        memory[1, i] *= share


@jit
def tangential_stiffness(c):
    """k_T = 2 G* a [N/m]."""
    return 2.0 * c.g_star * sqrt(c.radius * max(c.overlap, 0.0))


@jit
def stored_energy(c, memory, nodes):
    """Elastic energy of a closed contact [J]: 2/5 P delta of Hertz, and of the springs q^2/G* on the whole line."""
    x = c.overlap
    if x <= 0.0:
        return 0.0
    out = 0.4 * stiffness(c) * x * x * sqrt(x)
    if c.state == SPRUNG:
        for i in range(memory.shape[1]):
            square = memory[0, i] * memory[0, i] + memory[1, i] * memory[1, i]
            out += c.scale * nodes[1, i] * square / c.g_star
    return out
