"""The law of a contact as the world asks it: everything that the world knows of laws is in this file."""

from __future__ import annotations

from math import isfinite, sqrt

from contactlaw.jit import jit_inside
from contactlaw.laws import rolling, speeds, torsion
from contactlaw.laws.hertz import elastic_force
from contactlaw.laws.record import LASTING, OPEN, PAIR_SIZE, SPUN, ask_energy, ask_stiffness
from contactlaw.laws.step import ask, press
from contactlaw.world.bodies.motion import max_inverse_inertia, spin_change
from contactlaw.world.data.access import (
    body_at,
    law_numbers,
    law_of,
    memory_of,
    pair_at,
    restore_law_state,
    speed_numbers,
)
from contactlaw.world.data.call import address, call_along, call_spin, ready
from contactlaw.world.data.demand import ALONG, SPIN
from contactlaw.world.data.records import TWIST_ALWAYS, TWIST_LATER
from contactlaw.world.data.vec import dot, load, sub

PROBE = 1e-4  # of an overlap, a displacement that finds the slope of a law
CALM = 0.3  # of critical damping: a dashpot across a contact that lasts, hardly moves and is damped along the normal
FULL = 1.0 - 1e-3  # of mu P, a friction force that is all of it
ROUNDING = 1e-12  # of what two bodies turn by, a twist about the normal that is none


@jit_inside
def advance_contact(w, c, slot, moved, slide, dt, free):
    """Advance a closed contact, in a slot, by one substep to the overlap it has now: new are its forces and its moment.

    moved: what A has moved over B along both tangents [m], and turned about the normal [rad]; slide: how fast. dt [s];
    zero: at the end of a stage of an implicit step, so that a contact which is no new one lasts.
    free: closing acceleration by all but this contact [m/s^2].
    """
    t, law = c.touch, law_of(w, pair_at(w.pairs, c.pair))
    memory = memory_of(w, slot)
    if t.state == OPEN:
        for i in range(memory.size):
            memory[i] = 0.0
    elif law.speeds != 0.0 and (dt == 0.0 or t.course == LASTING or is_quasi_static(c, 1.0)):
        speeds.read_friction(t, speed_numbers(w, pair_at(w.pairs, c.pair)), sqrt(slide[0] ** 2 + slide[1] ** 2))
    du, dv, angle = moved
    spun = (angle != 0.0 or c.torsion.span > 0.0) and t.mu > 0.0
    if spun:
        c.pending_twist += angle
        if w.twists == TWIST_LATER and t.state != OPEN and t.state != SPUN:
            c.twist_overlap = c.twist_overlap if c.twist_overlap > 0.0 else t.before
            spun = False
    own, numbers = w.memory + 8 * w.memory_size * slot, w.numbers + 8 * pair_at(w.pairs, c.pair).numbers
    press(t, law, free, dt)
    damped = has_dashpot(c)
    if spun and ready(w, SPIN):
        inertia = 0.0
        if damped:
            n = load(c.normal)
            turn = dot(n, spin_change(body_at(w.bodies, c.body_a), n))
            turn += dot(n, spin_change(body_at(w.bodies, c.body_b), n))
            inertia = 1.0 / turn
        since = c.twist_overlap if c.twist_overlap > 0.0 else t.before
        turned, dashpot = (du, dv, c.pending_twist), (slide[2], inertia)
        call_spin(address(w, SPIN), c, own, numbers, turned, since, dt, w.twists == TWIST_ALWAYS, dashpot)
        c.pending_twist, c.twist_overlap = 0.0, 0.0
    else:
        ask(t, law, law_numbers(w, pair_at(w.pairs, c.pair)), memory, du, dv, dt)
    if t.skew != 0.0 and t.state != SPUN and ready(w, ALONG):
        call_along(address(w, ALONG), c, numbers + 8 * PAIR_SIZE, own, law.vectors, du, dv)
    if damped:
        add_dashpot(t, slide[0], slide[1])


@jit_inside
def has_dashpot(c):
    """Whether a contact lasts, hardly moves and is damped, and so is across: what is stuck would swing for ever."""
    t = c.touch
    return t.course == LASTING and t.friction > 0.0 and t.zeta > 0.0 and is_quasi_static(c, 1.0)


@jit_inside
def twist_of(c, a, b):
    """Angle [rad] that A has turned over B about the normal in the last substep; zero where it is rounding alone."""
    one, other = load(a.twist), load(b.twist)
    angle = dot(sub(one, other), load(c.normal))
    if angle == 0.0 or angle * angle <= ROUNDING * ROUNDING * (dot(one, one) + dot(other, other)):
        return 0.0
    return angle


@jit_inside
def advance_from_saved(w, c, slot, moved, slide):
    """Advance a contact from where it was kept to the overlap and the closing speed that it has at the end of a stage.

    moved, slide: as above, since it was kept, and at the end. Returns its tangential forces [N] and its moment [N m].
    """
    t = c.touch
    overlap, before, closing = t.overlap, t.before, t.closing
    restore_law_state(w, slot)
    t.overlap, t.before, t.closing = overlap, before, closing
    advance_contact(w, c, slot, moved, slide, 0.0, 0.0)
    return t.f, t.g, c.torsion.moment


@jit_inside
def slopes(w, c, slot, moved, slide, stage):
    """By how much the forces of a contact that has been asked change [N/m]; it is left to be asked again.

    Returns d P, d F and d G by the overlap, which the closing speed follows within a stage of so many seconds, d F and
    d G by both displacements, which the slide follows, and that of the moment by the angle [N m].

    What has slid as a whole by more than its springs give way has mu P along its displacement: no law is asked then.
    """
    t = c.touch
    f, g, m, overlap, closing, force = t.f, t.g, c.torsion.moment, t.overlap, t.closing, t.force
    way = PROBE * overlap
    more, (du, dv, angle), (u, v, spin) = way / stage, moved, slide
    t.overlap, t.closing = overlap + way, closing + more
    far, gone = slide_to_slip(t), sqrt(du * du + dv * dv)
    if c.torsion.span == 0.0 and gone > far and slips_fully(t):
        press(t, law_of(w, pair_at(w.pairs, c.pair)), 0.0, 0.0)
        t.overlap, t.closing = overlap, closing
        normal, one = (t.force - force) / way, 1.0 / sqrt(f * f + g * g)
        x, y, turned = one * f, one * g, t.friction * force / (gone + far)
        limit = t.friction * normal
        return normal, limit * x, limit * y, turned * y * y, -turned * x * y, -turned * x * y, turned * x * x, 0.0
    fp, gp, _ = advance_from_saved(w, c, slot, moved, slide)
    normal = (t.force - force) / way
    t.overlap, t.closing = overlap, closing
    fu, gu, fv, gv, turn = f, g, f, g, 0.0
    if t.friction > 0.0:
        fu, gu, _ = advance_from_saved(w, c, slot, (du + way, dv, angle), (u + more, v, spin))
        fv, gv, _ = advance_from_saved(w, c, slot, (du, dv + way, angle), (u, v + more, spin))
        if c.torsion.span > 0.0:
            radius = sqrt(t.radius * overlap)
            _, _, turned = advance_from_saved(w, c, slot, (du, dv, angle + way / radius), (u, v, spin + more / radius))
            turn = max(turned - m, 0.0) * radius / way
    across = (fp - f) / way, (gp - g) / way
    return (normal, *across, (fu - f) / way, (gu - g) / way, (fv - f) / way, (gv - g) / way, turn)


@jit_inside
def slide_to_slip(t):
    """How far [m] what sticks slides until all of it slips."""
    return t.friction * t.e_star / t.g_star * t.overlap


@jit_inside
def slips_fully(t):
    """Whether a contact slides as a whole: its friction force is all that it can be."""
    return t.f * t.f + t.g * t.g > (FULL * t.friction * t.force) ** 2


@jit_inside
def has_rigid_friction(w, c):
    """Whether the law of a contact has no springs across it."""
    pair = pair_at(w.pairs, c.pair)
    return c.touch.friction > 0.0 and not isfinite(ask_stiffness(law_of(w, pair), c.touch, law_numbers(w, pair)))


@jit_inside
def is_quasi_static(c, part):
    """Whether the normal motion of a closed contact is slow beside what its load would make of it; part: of 0.3."""
    t = c.touch
    own = t.force / t.mass
    slow = t.closing * t.closing < 0.1 * part * part * own * t.overlap
    return slow and abs(c.closing_acceleration) < 0.3 * part * own


@jit_inside
def dashpot_of(t):
    """Of the dashpot across [N s/m]."""
    return 2.0 * CALM * sqrt(2.0 * t.g_star * sqrt(t.radius * t.overlap) * t.tangential_mass)


@jit_inside
def add_dashpot(t, u, v):
    """Add a dashpot across, within the cone; u, v: sliding speed [m/s]."""
    drag = dashpot_of(t)
    t.f += drag * u
    t.g += drag * v
    pull, limit = sqrt(t.f * t.f + t.g * t.g), t.friction * t.force
    if pull > limit:
        t.f *= limit / pull
        t.g *= limit / pull


@jit_inside
def stored_energy(w, c, slot):
    """Elastic energy [J] of a closed contact: 2/5 P delta of Hertz, and those of its law's springs and of torsion."""
    t, law = c.touch, law_of(w, pair_at(w.pairs, c.pair))
    if t.overlap <= 0.0 or t.state == OPEN:
        return 0.0
    linear = law.linear != 0.0
    out = (0.5 if linear else 0.4) * elastic_force(t, linear, t.overlap) * t.overlap
    if t.state == SPUN:
        out += c.torsion.stored
    elif t.friction > 0.0:
        out += ask_energy(law, t, law_numbers(w, pair_at(w.pairs, c.pair)), memory_of(w, slot))
        out += torsion.stored(c.torsion, t, law.g_t)
    if law.rolling > 0.0:
        out += rolling.stored(c.bend, t, rolling_resistance(w, c))
    return out


@jit_inside
def rolling_resistance(w, c):
    """Coefficient of rolling resistance of a contact: its pair's, or less, so that mu_r R <= 1/sqrt(m/I).

    I: the least moment of inertia. The spring k_r then turns bodies at 1.5 times the rate of the normal one at most,
    which substeps follow. R is metres where flat sides touch, far more than what rolls there is wide.
    """
    light = max_inverse_inertia(body_at(w.bodies, c.body_a)) + max_inverse_inertia(body_at(w.bodies, c.body_b))
    own = law_of(w, pair_at(w.pairs, c.pair)).rolling
    return own / max(1.0, own * c.touch.radius * sqrt(c.touch.mass * light))
