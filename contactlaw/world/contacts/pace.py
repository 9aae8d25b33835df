"""How fast contacts go: when an open one could close, and how long a substep of a closed one may be."""

from __future__ import annotations

from math import sqrt

from contactlaw.jit import jit_inside
from contactlaw.laws.hertz import hertz_stiffness
from contactlaw.world.bodies.motion import (
    closing_at,
    decay,
    mobility_between,
)
from contactlaw.world.contacts.force import is_quasi_static
from contactlaw.world.data.access import body_at, contact_at, law_of, pair_at, shape_at
from contactlaw.world.data.records import NEVER
from contactlaw.world.data.vec import cross, dot, load, norm, sub
from contactlaw.world.shapes.geometry import effective_radius, meet_near

FEW = 4.0  # of the substeps of an impact, those of a contact that hardly moves
LEAST_STEP = 1.0 / 3.0  # durations of an impact that a step has at least for contacts to be lasting ones in it
SLOWED, FOLLOWED = 0.5, 4.0  # of a velocity, by damping in joints within a substep; times fewer, for that, at most
MASS_TURN = 0.1  # [rad] by which a normal may turn before masses are looked at again
STEADY, FEWEST = 1e-2, 8.0  # a contact that moves by less than so much of that; its substeps, of stability alone
ALIKE = 4.0  # contacts side by side, as the feet of a box, for which these do: h omega is 1 then, of 2 where it ends


@jit_inside
def impact_duration(k, duration, mass, overlap, closing, push):
    """Duration [s] of an impact of this overlap (zero or more) and closing speed; push: closing acceleration.

    k: of P = k delta^1.5. duration: of an impact, times speed, over the greatest overlap. A contact that is pressed
    together is as fast as its overlap at rest makes it, however slowly it began.
    """
    square = closing * closing + 0.8 * k * overlap * overlap * sqrt(overlap) / mass
    if push > 0.0:
        square += 2.0 * push * (mass * push / k) ** (2.0 / 3.0)
    if square == 0.0:
        return NEVER
    return duration * (1.25 * mass * square / k) ** 0.4 / sqrt(square)


@jit_inside
def radius_of(w, p):
    """Effective radius [m] of a near pair, where its bodies are."""
    return ellipse_of(w, p)[0]


@jit_inside
def ellipse_of(w, p):
    """The same, and the longer axis, see `geometry.effective_radius`; a radius that is given is that of a circle."""
    own = pair_at(w.pairs, p.pair).radius
    if own > 0.0:
        return own, (0.0, 0.0, 0.0)
    sa, sb = shape_at(w.shapes, p.a), shape_at(w.shapes, p.b)
    return effective_radius(sa, body_at(w.bodies, p.body_a), sb, body_at(w.bodies, p.body_b))


@jit_inside
def touch_duration(w, p):
    """Duration [s] of the impact that two near shapes are about to have."""
    a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
    _, n, arm_a, arm_b = meet_near(w, p, a, b)
    mass = 1.0 / mobility_between(a, arm_a, b, arm_b, n)
    push = max(p.acceleration, 0.0)
    closing = sqrt(max(p.closing, 0.0) ** 2 + 2.0 * push * max(p.gap, 0.0))
    law = law_of(w, pair_at(w.pairs, p.pair))
    k = 4.0 / 3.0 * law.e_star * sqrt(radius_of(w, p))
    return impact_duration(k, law.duration, mass, max(-p.gap, 0.0), closing, push)


@jit_inside
def contact_duration(w, c, a, b):
    """Duration [s] of the impact that a closed contact is in."""
    t = c.touch
    pull = sub(load(a.acceleration), load(b.acceleration))
    duration = law_of(w, pair_at(w.pairs, c.pair)).duration
    return impact_duration(
        hertz_stiffness(t), duration, t.mass, max(t.overlap, 0.0), closing_speed(c, a, b), norm(pull)
    )


@jit_inside
def closing_speed(c, a, b):
    """Closing speed [m/s] of a closed contact; `touch.closing` is rounding alone if its substep was as short."""
    return closing_at(a, load(c.arm_a), b, load(c.arm_b), load(c.normal))


@jit_inside
def stays_closed(c, a, b):
    """Whether a closed contact has not the energy to part, under the load P + m a that there is, a its acceleration:

        m v^2/2 + 2/5 P delta < (P + m a) delta

    It may be as soft as it likes: what it does beside stiffer ones a step follows, or damps.
    """
    speed, t = closing_speed(c, a, b), c.touch
    if t.zeta == 0.0:
        return False
    return 0.5 * speed * speed * t.mass < (0.6 * t.force + t.mass * c.closing_acceleration) * t.overlap


@jit_inside
def longest_substep(w, c, a, b, substeps):
    """Longest substep [s] for a closed contact; substeps: of an impact."""
    t = c.touch
    law = law_of(w, pair_at(w.pairs, c.pair))
    if t.overlap > 0.0 and law.vectors > 0.0 and is_quasi_static(c, STEADY):
        substeps = FEWEST  # but where friction is rigid: what drives it then creeps by what it gains in a substep
    elif t.overlap > 0.0 and is_quasi_static(c, 1.0):
        calm = substeps if substeps > w.crowd_substeps else 0.5 * substeps  # as it is in a crowd
        substeps = max(substeps / FEW, min(calm, 20.0))
    if t.zeta > 0.0 and returns_within_step(w, c, a, b):
        substeps = min(substeps, w.crowd_substeps)
    longest = oscillation_duration(w, c, a, b) / substeps
    together = max(a.paces, b.paces)
    if together > 0.0:
        longest = min(longest, sqrt(ALIKE / together) / FEWEST)
    slowing = decay(a) + (decay(b) if b.tree != a.tree else 0.0)
    return longest if slowing * longest <= SLOWED else max(SLOWED / slowing, longest / FOLLOWED)


@jit_inside
def returns_within_step(w, c, a, b):
    """Whether what parts with all the energy of a closed contact is back within the step: then nobody sees how."""
    t, speed = c.touch, closing_speed(c, a, b)
    pull = sub(load(a.acceleration), load(b.acceleration))
    square = speed * speed + 0.8 * t.force * max(t.overlap, 0.0) / t.mass
    return 4.0 * square < w.step * w.step * dot(pull, pull)


@jit_inside
def oscillation_duration(w, c, a, b):
    """Duration [s] of the impact that a closed contact is in, or of the swing across that is faster."""
    t = c.touch
    chi = 0.5 * t.g_star / t.e_star * t.mass / t.tangential_mass
    return contact_duration(w, c, a, b) / max(1.0, sqrt(0.5 * chi))


@jit_inside
def add_pace(w, p):
    """Count a closed contact among those that may push a body side by side, as feet do.

    The square of the frequency at which springs swing a body together is at most the sum of each one's. Of those all
    around a ball few push along one line.
    """
    if p.closed != 0:
        a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
        pace = oscillation_duration(w, contact_at(w.contacts, p.slot), a, b) ** -2
        for one in (a, b):
            one.paces += pace if one.oriented != 0 and one.inverse_mass != 0.0 else 0.0


@jit_inside
def update_masses(c, a, b):
    """Effective masses [kg] along the normal and across, the mean of both tangents, as the normal is now.

    Where joints let nothing move along it the damper would be as strong as one likes, and would act as soon as the
    normal has turned by an angle x: the mass there is at most 1/x^2 times that across, which is what is taken.
    """
    n, e = load(c.normal), load(c.tangent)
    arm_a, arm_b = load(c.arm_a), load(c.arm_b)
    both = mobility_between(a, arm_a, b, arm_b, e) + mobility_between(a, arm_a, b, arm_b, cross(n, e))
    c.touch.tangential_mass = 2.0 / both
    c.touch.mass = 1.0 / max(mobility_between(a, arm_a, b, arm_b, n), 0.5 * MASS_TURN * MASS_TURN * both)
