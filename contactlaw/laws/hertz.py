"""Normal force: Hertz (1882) or a linear spring, with the damper of Tsuji, Tanaka & Ishida (1992).

    P = k delta^(3/2) + sqrt(5) zeta sqrt(m k) delta^(1/4) d(delta)/dt        k = 4/3 E* sqrt(R)
    P = k delta + 2 zeta sqrt(m k) d(delta)/dt                                k = m (pi/T_Hertz)^2 at the touch

and P = 0 where these are negative.
"""

from math import sqrt

from contactlaw.jit import jit_inline, jit_module

HERTZ_DURATION = 2.9432751843247047  # T v/delta_max = 4/5 sqrt(pi) Gamma(2/5)/Gamma(9/10); Johnson (1985) section 11.4
# (m/k) (pi/T_Hertz)^2/sqrt(delta_max): it depends on neither mass nor speed
LINEAR_STIFFNESS = 0.8 * (3.141592653589793 / HERTZ_DURATION) ** 2

BY_ITSELF = 0.0, 1.0, 0.0, 1.0  # `motion` of `normal_force` where nothing else pushes on the bodies
# Share of the overlap that the spring has at least where neighbours pull the bodies apart at the touch: its force, by
# which `ratio` divides, stays positive
LEAST_DEPTH = 0.5


def hertz_stiffness(pair):
    """k = 4/3 E* sqrt(R) [N/m^1.5]. pair: `record.PAIR`, or `record.CONTACT`, whose radius may differ."""
    return 4.0 / 3.0 * pair.e_star * sqrt(pair.radius)


def greatest_overlap(k, m, overlap, closing):
    """Greatest overlap [m] that an undamped contact of this overlap [m] and closing speed [m/s] will reach."""
    return (overlap * overlap * sqrt(overlap) + 1.25 * m * closing * closing / k) ** 0.4


def stiffness_foreseen(contact, linear, deepest):
    """Stiffness k of the normal spring: linear, for the greatest overlap foreseen [m], [N/m]; else Hertz [N/m^1.5]."""
    k = hertz_stiffness(contact)
    return LINEAR_STIFFNESS * k * sqrt(deepest) if linear else k


def elastic_force(contact, linear, overlap):
    """Elastic normal force [N] at an overlap > 0 [m]."""
    return contact.stiffness * overlap if linear else contact.stiffness * overlap * sqrt(overlap)


def damping_of(contact, linear, stiffness):
    """Damping coefficient [N s/m] of the damper on a spring whose force over its overlap is this stiffness [N/m]."""
    return contact.zeta * sqrt((4.0 if linear else 5.0) * contact.mass * stiffness)


def normal_force(contact, pair, dt, motion=BY_ITSELF):
    """Normal force [N] and its ratio to the elastic one; both are negative where the damper would pull.

    The closing speed is that of half a step before the overlap was reached (leapfrog). The damper acts on the speed at
    the overlap, closing + dt/2 (free - P/m). The equation is solved for P, so that the step is stable for any damping.

    dt: length of the step [s]; zero: `closing` is the speed at the overlap. motion: closing acceleration [m/s^2] due to
    all forces other than this normal force, gravity for example, without which the damper would carry part of the load
    of a contact at rest; number n of dampers that share the mass; overlap [m] that the elastic force has besides;
    factor of the damper.

    If n dampers act on one mass and each is solved as if it were alone, they overshoot together once n of them are too
    strong for the step, and oscillate from step to step. So each is solved with an n-th of the mass for what its force
    differs from that of the last step with the elastic force of this. Where a factor w below 1 tells how they share it,
    their forces change together as those of 1/w^2 alike: more would delay what they do in an impact.
    """
    free, count, deeper, weight = motion
    linear = pair.linear != 0.0
    foreseen = contact.force - contact.elastic
    stiffness, deeper = contact.stiffness, max(deeper, (LEAST_DEPTH - 1.0) * contact.overlap)
    if not linear:
        stiffness *= sqrt(contact.overlap)
        deeper *= 1.5  # the first term of the series
    contact.elastic = elastic = stiffness * (contact.overlap + deeper)
    if contact.zeta == 0.0:
        return elastic, 1.0
    mobility = dt / contact.mass
    count = 1.0 / (weight * weight) if weight < 1.0 else 1.0 * count
    damping = weight * damping_of(contact, linear, stiffness)
    closing = contact.closing + 0.5 * (dt * free + (count - 1.0) * mobility * (foreseen + elastic))
    pressed = elastic + damping * closing
    share = 1.0 + 0.5 * count * damping * mobility
    return pressed / share, pressed / (share * elastic)  # two quotients that do not wait for each other


jit_module(__name__, jit_inline)
