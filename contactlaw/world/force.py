"""The law of a contact as the world asks it: everything that the world knows of laws is in this file."""

from __future__ import annotations

from math import sqrt

from contactlaw.jit import jit_inside
from contactlaw.laws import torsion
from contactlaw.laws.hertz import elastic_force
from contactlaw.laws.record import LASTING, OPEN, ask_energy
from contactlaw.laws.step import advance
from contactlaw.world.access import body_at, law_numbers, law_of, memory_of, pair_at
from contactlaw.world.motion import give
from contactlaw.world.vec import dot, load, sub

CALM = 0.3  # of critical damping: a dashpot across a contact that lasts, hardly moves and is damped along the normal
ROUNDING = 1e-12  # of what two bodies turn by, a twist about the normal that is none


@jit_inside
def advance_contact(w, c, slot, du, dv, angle, dt, free):
    """Advance a closed contact, in a slot, by one substep to its overlap: new are force, ratio, f, g and moment.

    du, dv [m], angle [rad]: what A has moved over B along both tangents, and turned about the normal. dt [s]. free:
    closing acceleration by all but this contact [m/s^2].
    """
    t, law = c.touch, law_of(w, pair_at(w.pairs, c.pair))
    memory = memory_of(w, slot)
    if t.state == OPEN:
        for i in range(memory.size):
            memory[i] = 0.0
    spun = (angle != 0.0 or c.torsion.span > 0.0) and law.friction > 0.0
    left = 0.0
    if spun:
        share, left = torsion.limits(c.torsion, t, law.friction, du, dv, angle)
        t.friction = share * law.friction
        left *= law.friction
    advance(t, law, law_numbers(w, pair_at(w.pairs, c.pair)), memory, free, du, dv, dt)
    if spun:
        torsion.twist(c.torsion, t, law.g_t, angle, left)
    if t.course == LASTING and t.friction > 0.0 and law.zeta > 0.0 and dt > 0.0 and hardly_moves(c, 1.0):
        calm(t, du / dt, dv / dt)
        if spun:
            n = load(c.normal)
            turn = dot(n, give(body_at(w.bodies, c.body_a), n)) + dot(n, give(body_at(w.bodies, c.body_b), n))
            torsion.damp(c.torsion, t, law.g_t, left, angle / dt, 1.0 / turn)


@jit_inside
def twisted(c, a, b):
    """Angle [rad] that A has turned over B about the normal in the last substep; zero where it is rounding alone."""
    one, other = load(a.twist), load(b.twist)
    angle = dot(sub(one, other), load(c.normal))
    if angle == 0.0 or angle * angle <= ROUNDING * ROUNDING * (dot(one, one) + dot(other, other)):
        return 0.0
    return angle


@jit_inside
def hardly_moves(c, part):
    """Whether the normal motion of a closed contact is slow beside what its load would make of it; part: of 0.3."""
    t = c.touch
    own = t.force / t.mass
    slow = t.closing * t.closing < 0.1 * part * part * own * t.overlap
    return slow and abs(c.closing_acceleration) < 0.3 * part * own


@jit_inside
def calm(t, u, v):
    """Add a dashpot across, within the cone; u, v: sliding speed [m/s]. What is stuck would swing for ever."""
    drag = 2.0 * CALM * sqrt(2.0 * t.g_star * sqrt(t.radius * t.overlap) * t.tangential_mass)
    t.f += drag * u
    t.g += drag * v
    pull, limit = sqrt(t.f * t.f + t.g * t.g), t.friction * t.force
    if pull > limit:
        t.f *= limit / pull
        t.g *= limit / pull


@jit_inside
def stored_energy(w, c, slot):
    """Elastic energy [J] of a closed contact: normal, 2/5 P delta for Hertz, of its law's springs, and torsional."""
    t, law = c.touch, law_of(w, pair_at(w.pairs, c.pair))
    if t.overlap <= 0.0 or t.state == OPEN:
        return 0.0
    linear = law.linear != 0.0
    out = (0.5 if linear else 0.4) * elastic_force(t, linear, t.overlap) * t.overlap
    if t.friction > 0.0:
        out += ask_energy(law, t, law_numbers(w, pair_at(w.pairs, c.pair)), memory_of(w, slot))
        out += torsion.stored(c.torsion, t, law.g_t)
    return out
