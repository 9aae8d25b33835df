"""The law of a contact as the world asks it: everything that the world knows of laws is in this file."""

from __future__ import annotations

from math import isfinite, sqrt

from contactlaw.jit import jit_inside
from contactlaw.laws.hertz import elastic_force
from contactlaw.laws.record import LASTING, OPEN, ask_energy, ask_stiffness
from contactlaw.laws.step import advance
from contactlaw.world.access import bring_back_touch, law_numbers, law_of, memory_of, pair_at

PROBE = 1e-4  # of an overlap, a displacement that finds the slope of a law
CALM = 0.3  # of critical damping: a dashpot across a contact that lasts, hardly moves and is damped along the normal


@jit_inside
def advance_contact(w, c, slot, du, dv, dt, free):
    """Advance a closed contact, in a slot, by one substep to the overlap it has now: new are force, ratio, f, g.

    du, dv: what A has moved over B along both tangents [m]. dt [s]. free: closing acceleration by all but this
    contact [m/s^2].
    """
    t, law = c.touch, law_of(w, pair_at(w.pairs, c.pair))
    memory = memory_of(w, slot)
    if t.state == OPEN:
        for i in range(memory.size):
            memory[i] = 0.0
    advance(t, law, law_numbers(w, pair_at(w.pairs, c.pair)), memory, free, du, dv, dt)
    if t.course == LASTING and t.friction > 0.0 and law.zeta > 0.0 and dt > 0.0 and hardly_moves(c, 1.0):
        calm(t, du / dt, dv / dt)


@jit_inside
def ask_at(w, c, slot, moved, slide):
    """Advance a contact from where it was kept to the overlap and the closing speed that it has at the end of a stage.

    moved: what A has moved over B along both tangents [m]; slide: its speed then [m/s]. Returns its tangential forces.
    """
    t, law = c.touch, law_of(w, pair_at(w.pairs, c.pair))
    overlap, before, closing = t.overlap, t.before, t.closing
    bring_back_touch(w, slot)
    t.overlap, t.before, t.closing = overlap, before, closing
    memory = memory_of(w, slot)
    if t.state == OPEN:
        for i in range(memory.size):
            memory[i] = 0.0
    advance(t, law, law_numbers(w, pair_at(w.pairs, c.pair)), memory, 0.0, moved[0], moved[1], 0.0)
    if t.course == LASTING and t.friction > 0.0:
        calm(t, slide[0], slide[1])
    return t.f, t.g


@jit_inside
def slopes(w, c, slot, moved, slide, stage):
    """By how much the forces of a contact that has been asked change [N/m]; it is left to be asked again.

    Returns d P, d F and d G by the overlap, which the closing speed follows within a stage of so many seconds, and d F
    and d G by both displacements, which the slide follows.
    """
    t = c.touch
    f, g, overlap, closing, force, way = t.f, t.g, t.overlap, t.closing, t.force, PROBE * t.overlap
    (du, dv), (u, v), more = moved, slide, way / stage
    t.overlap, t.closing = overlap + way, closing + more
    fp, gp = ask_at(w, c, slot, moved, slide)
    normal = (t.force - force) / way
    t.overlap, t.closing = overlap, closing
    fu, gu, fv, gv = f, g, f, g
    if t.friction > 0.0:
        fu, gu = ask_at(w, c, slot, (du + way, dv), (u + more, v))
        fv, gv = ask_at(w, c, slot, (du, dv + way), (u, v + more))
    across = (fp - f) / way, (gp - g) / way
    return (normal, *across, (fu - f) / way, (gu - g) / way, (fv - f) / way, (gv - g) / way)


@jit_inside
def rigid(w, c):
    """Whether the law of a contact has no springs across it."""
    pair = pair_at(w.pairs, c.pair)
    return c.touch.friction > 0.0 and not isfinite(ask_stiffness(law_of(w, pair), c.touch, law_numbers(w, pair)))


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
    """Elastic energy [J] of a closed contact: of its normal force, 2/5 P delta for Hertz, and of its law's springs."""
    t, law = c.touch, law_of(w, pair_at(w.pairs, c.pair))
    if t.overlap <= 0.0 or t.state == OPEN:
        return 0.0
    linear = law.linear != 0.0
    out = (0.5 if linear else 0.4) * elastic_force(t, linear, t.overlap) * t.overlap
    if t.friction > 0.0:
        out += ask_energy(law, t, law_numbers(w, pair_at(w.pairs, c.pair)), memory_of(w, slot))
    return out
