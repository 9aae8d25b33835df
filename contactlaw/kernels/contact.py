"""One contact advanced by one step: the ladder of laws with explicit history.

Sources: Hertz (1882) and Tsuji, Tanaka & Ishida (1992) for the normal force; Mindlin & Deresiewicz (1953) for the
single springs; Popov & Hess, Method of Dimensionality Reduction (2015), and Lyashenko & Popov (2015) for microslip.
"""

from __future__ import annotations

from math import sqrt

from contactlaw.jit import jit
from contactlaw.kernels.microslip import microslip_in_plane, microslip_on_line, regrid, spread

# Law codes. The order is the ladder's; `contactlaw.laws` names them.
COULOMB, LINEAR_SPRING, MINDLIN, MINDLIN_RESCALED, MICROSLIP = 0, 1, 2, 3, 4

# Parameters of a contact: a float64 array, the microslip nodes (n abscissae on [0, 1], n weights) after the named ones.
# DURATION: contact duration times speed over the undamped greatest overlap. AXIS: normal of the plane of motion where
# PLANAR (three components).
E_STAR, G_STAR, RADIUS, FRICTION, STATIC_FRICTION, ZETA, DURATION, LAW, NODES, PLANAR, AXIS = range(11)
PARAMETERS = 13

# History of a contact: a float64 array, the tractions (and, with static friction, a slip flag each) after the header.
PHASE = 0  # OPEN, SLIDING since the touch, or SPRUNG: some part of the contact has stuck
OVERLAP = 1  # [m]
MASS = 2  # normal effective mass when the bodies touched [kg]
TANGENTIAL_MASS = 3  # the tangential one [kg]
SCALE = 4  # microslip: contact radius that the nodes span [m]; linear_spring: its normal stiffness [N/m]
NORMAL = 5  # normal force [N]
RATIO = 6  # of the tangential force over that of the springs, see `carried`
TANGENTIAL = 7  # tangential force, two components [N]
COURSE = 9  # of the damped normal motion: PRESSED, then EXPANDING, then, if the bodies do not part, LASTING
TANGENT = 10  # first tangent vector, world frame; the second is n x t
DIRECTION = 13  # normal n, world frame
HEADER = 16
OPEN, SLIDING, SPRUNG = 0.0, 1.0, 2.0
PRESSED, EXPANDING, LASTING = 0.0, 1.0, 2.0

PLANE_SLACK = 1e-6  # sine of the angle that a contact normal may make with its plane of motion
# Steps per contact, times sqrt(chi): twice those at which a stuck contact, a leapfrog of frequency sqrt(2 chi), grows.
STABLE_STEPS = 4.5
STRAIGHT = 1e-6  # sine of the angle to which a slide may turn in a step and still count as straight
MARGIN = 1.02  # of the nodes over the greatest contact radius foreseen: the steps' own error must not outgrow them

RESCALED = 1.0 / 3.0  # of the fall of P in a shrinking contact, what `mindlin_rescaled` gives up: (da/a)/(dP/P)

HERTZ_DURATION = 2.9432751843247047  # T v/delta_max = 4/5 sqrt(pi) Gamma(2/5)/Gamma(9/10); Johnson (1985) section 11.4
# which makes k_N = m (pi/T_Hertz)^2 equal to this times k sqrt(delta_max): no mass, no speed
LINEAR_STIFFNESS = 0.8 * (3.141592653589793 / HERTZ_DURATION) ** 2


@jit
def hertz_stiffness(p):
    """k = 4/3 E* sqrt(R) [N/m^1.5]."""
    return 4.0 / 3.0 * p[E_STAR] * sqrt(p[RADIUS])


@jit
def greatest_overlap(k, m, overlap, closing):
    """Overlap [m] at which an undamped contact that now has this overlap and closing speed will stop."""
    return (overlap * overlap * sqrt(overlap) + 1.25 * m * closing * closing / k) ** 0.4


@jit
def time_scale(p, mass, overlap, closing, push):
    """Duration [s] of an impact of this overlap (zero or more) and closing speed; push: closing acceleration [m/s^2].

    A contact that is pressed together, by gravity say, is as fast as its overlap at rest makes it, however slowly it
    began.
    """
    k = hertz_stiffness(p)
    square = closing * closing + 0.8 * k * overlap * overlap * sqrt(overlap) / mass
    if push > 0.0:
        square += 2.0 * push * (mass * push / k) ** (2.0 / 3.0)
    if square == 0.0:
        return 1e300
    return p[DURATION] * (1.25 * mass * square / k) ** 0.4 / sqrt(square)


@jit
def normal_force(p, h, overlap, closing, free, dt):
    """Normal force [N] and its ratio to the undamped one.

    closing is the closing speed half a step before the overlap was reached (leapfrog). The damper acts on the speed at
    the overlap, closing + dt/2 (free - P/m), solved for P so that no damping is too strong for the step. free: closing
    acceleration [m/s^2] by all but this contact's normal force, gravity say: without it a contact at rest would lean on
    its damper.
    """
    if p[LAW] == LINEAR_SPRING:
        stiffness = h[SCALE]
        elastic = stiffness * overlap
        damping = 2.0 * p[ZETA] * sqrt(h[MASS] * stiffness)
    else:
        k = hertz_stiffness(p)
        elastic = k * overlap * sqrt(overlap)
        if p[ZETA] == 0.0:
            return elastic, 1.0
        damping = sqrt(5.0 * h[MASS] * k * sqrt(overlap)) * p[ZETA]
    force = (elastic + damping * (closing + 0.5 * dt * free)) / (1.0 + 0.5 * damping * dt / h[MASS])
    if force <= 0.0:
        return 0.0, 0.0
    return force, force / elastic


@jit
def touch(p, h_out, before, closing, mass, tangential_mass):
    """Fill the header of a contact that was open: what the rest of the contact needs from its first instant.

    before: overlap [m] that was there before the first force, below zero if the bodies were apart.
    """
    h_out[MASS] = mass
    h_out[TANGENTIAL_MASS] = tangential_mass
    k = hertz_stiffness(p)
    deepest = greatest_overlap(k, mass, max(before, 0.0), closing)
    if p[LAW] == LINEAR_SPRING:
        h_out[SCALE] = LINEAR_STIFFNESS * k * sqrt(deepest)
    else:
        h_out[SCALE] = MARGIN * sqrt(p[RADIUS] * deepest)


@jit
def step(p, h_io, overlap, before, closing, free, du, dv, dt, mass, tangential_mass):
    """Advance one contact to the overlap it has now.

    p: parameters. h_io: history. overlap, before [m]: now and at the start of the step, below zero apart. closing: mean
    closing speed over the step [m/s]. free: see `normal_force`. du, dv: tangential displacement of A relative to B over
    the step along the two tangents [m]; dv is not read where the contact is planar. dt: step [s]. mass,
    tangential_mass: effective [kg], read at a touch alone. Returns P, F along each tangent [N].
    """
    if overlap <= 0.0:
        forget(h_io)
        return 0.0, 0.0, 0.0
    if h_io[PHASE] == OPEN:
        touch(p, h_io, before, closing, mass, tangential_mass)
    elif p[LAW] == MICROSLIP:
        span = respan(p, h_io, overlap, closing)
        if span != h_io[SCALE]:
            if h_io[PHASE] == SPRUNG:
                regrid_history(p, h_io, span)
            h_io[SCALE] = span
    force, ratio = normal_force(p, h_io, overlap, closing, free, dt)
    if h_io[COURSE] == PRESSED and ratio < 1.0:
        h_io[COURSE] = EXPANDING
    elif h_io[COURSE] == EXPANDING and ratio >= 1.0:
        h_io[COURSE] = LASTING
    f, g = friction(p, h_io, overlap, before, du, dv, force, ratio, dt * dt / h_io[TANGENTIAL_MASS])
    return force, f, g


@jit
def forget(h_out):
    """An open contact remembers nothing but the frame that it was in."""
    for i in range(h_out.size):
        if i < TANGENT or i >= HEADER:
            h_out[i] = 0.0


@jit
def friction(p, h_io, overlap, before, du, dv, force, ratio, mobility):
    """Tangential force [N] for a given normal force; brings the history up to now.

    before: overlap at the start of the step, negative if the bodies were apart. ratio: normal force over the elastic
    one; kept is that of `carried`. mobility: dt^2/m_T [m/N], what `coulomb` needs to stop a sliding contact and no
    more (0: no inertia).
    """
    f, g = 0.0, 0.0
    if p[PLANAR] != 0.0:
        dv = 0.0
    slid = h_io[PHASE] == SLIDING
    if p[LAW] == COULOMB:
        h_io[PHASE] = SLIDING
        slide = sqrt(du * du + dv * dv)
        if slide > 0.0:
            held = slide <= p[STATIC_FRICTION] * force * mobility
            pull = slide / mobility if held or slide <= p[FRICTION] * force * mobility else p[FRICTION] * force
            f, g = pull * du / slide, pull * dv / slide
    elif h_io[PHASE] != SPRUNG and slides_on(p, h_io, overlap, before, du, dv, force):
        f, g = h_io[TANGENTIAL], h_io[TANGENTIAL + 1]
    else:
        h_io[PHASE] = SPRUNG
        n = int(p[NODES])
        size = n if p[PLANAR] != 0.0 else 2 * n
        q, flags = h_io[HEADER : HEADER + size], h_io[HEADER + size :]
        if p[LAW] == MICROSLIP:
            f, g = microslip(p, h_io, q, flags, slid, overlap, before, du, dv)
        else:
            f, g = single_spring(p, h_io, q, flags, slid, overlap, before, du, dv)
        ratio = carried(p, h_io, force, ratio, sqrt(f * f + g * g))
        f *= ratio
        g *= ratio
    h_io[OVERLAP] = overlap
    h_io[NORMAL] = force
    h_io[RATIO] = ratio
    h_io[TANGENTIAL] = f
    h_io[TANGENTIAL + 1] = g
    return f, g


@jit
def carried(p, h, force, ratio, pull):
    """What of the springs' tangential force, pull [N], a contact gives; force [N], ratio: as for `friction`.

    Friction carries the same share of the damper's force as of the elastic one while bodies bounce: the whole is then
    on the friction limit where the springs are. In a contact that lasts this would not be passive: a force that is
    stuck at F and grows with the closing speed v by c F/P v does the work c F/P v w at a sliding speed w, of either
    sign, beside the damper's c v^2, and a ball wedged into a groove would begin to swing by itself. Once bodies that
    have begun to part come together again, at v = 0 and a ratio of 1, friction has the springs' force alone, within
    its limit.
    """
    if h[COURSE] != LASTING:
        return ratio
    limit = p[STATIC_FRICTION] * force
    return limit / pull if pull > limit else 1.0


@jit
def slides_on(p, h_io, overlap, before, du, dv, force):
    """Whether a contact that has slid as a whole since the touch still does; if so, its force is put in the history.

    Under gross slip all points move together (the paper's appendix), so the middle of the contact, cap mu E* delta,
    speaks for all: it slides while its displacement outruns the growth of that cap. No node is needed until it sticks,
    or until the slide turns: then the nodes near the rim turn first. A single spring on its limit says the same, as
    mu dP = 2 mu E* a d(delta) and dF = 2 G* a ds; one that is rescaled while the contact shrinks gives up a third of
    dP by itself, F da/a.
    """
    phase, mu_e = h_io[PHASE], p[FRICTION] * p[E_STAR]
    f, g = h_io[TANGENTIAL], h_io[TANGENTIAL + 1]
    part = 1.0 if before >= 0.0 else overlap / (overlap - before)
    u, v = p[G_STAR] * part * du, p[G_STAR] * part * dv
    if p[LAW] == MINDLIN_RESCALED and overlap < before:
        before += RESCALED * (overlap - before)
    old = sqrt(f * f + g * g)
    if old > 0.0:
        if abs(u * g - v * f) > STRAIGHT * old * sqrt(u * u + v * v):
            return False
        stretch = mu_e * max(before, 0.0) / old
        u += stretch * f
        v += stretch * g
    size = sqrt(u * u + v * v)
    limit = p[STATIC_FRICTION] * p[E_STAR] if phase == OPEN else mu_e
    if size == 0.0 or size < limit * overlap:
        return False
    h_io[PHASE] = SLIDING
    h_io[TANGENTIAL] = p[FRICTION] * force * u / size
    h_io[TANGENTIAL + 1] = p[FRICTION] * force * v / size
    return True


@jit
def microslip(p, h, q, flags, slid, overlap, before, du, dv):
    """The nodes of `kernels.microslip` on this history; slid: the contact was sliding as a whole until now."""
    n = int(p[NODES])
    x, w = p[PARAMETERS : PARAMETERS + n], p[PARAMETERS + n : PARAMETERS + 2 * n]
    span, planar = h[SCALE], p[PLANAR] != 0.0
    if slid:
        f, g = elastic_part(h)
        spread(p[RADIUS], span, x, before, f, g, planar, q)
    if planar:
        f = microslip_on_line(
            p[E_STAR], p[G_STAR], p[RADIUS], p[FRICTION], p[STATIC_FRICTION],
            span, x, w, overlap, before, du, q, flags,
        )  # fmt: skip
        return f, 0.0
    return microslip_in_plane(
        p[E_STAR], p[G_STAR], p[RADIUS], p[FRICTION], p[STATIC_FRICTION],
        span, x, w, overlap, before, du, dv, q, flags,
    )  # fmt: skip


@jit
def elastic_part(h):
    """Tangential force of the last step less what friction carried of the damper's force."""
    if h[RATIO] <= 0.0:
        return 0.0, 0.0
    return h[TANGENTIAL] / h[RATIO], h[TANGENTIAL + 1] / h[RATIO]


@jit
def regrid_history(p, h_io, span):
    """Let the nodes of a history span another contact radius [m]."""
    n = int(p[NODES])
    planar = p[PLANAR] != 0.0
    x, w = p[PARAMETERS : PARAMETERS + n], p[PARAMETERS + n : PARAMETERS + 2 * n]
    q = h_io[HEADER : HEADER + (n if planar else 2 * n)]
    regrid(p[RADIUS], h_io[SCALE], span, x, w, h_io[OVERLAP], planar, q)


@jit
def respan(p, h, overlap, closing):
    """Contact radius that the nodes should span: the present one unless the contact outgrows it or lives far inside.

    A contact that settles from a bounce to rest keeps few of its nodes; it is judged by the overlap it can still reach,
    so that the thin contacts at the start and end of an impact are left alone.
    """
    span = h[SCALE]
    a2 = p[RADIUS] * overlap
    if a2 > span * span:
        return 1.25 * sqrt(a2)
    if a2 * 4.0 < span * span:
        reach = sqrt(p[RADIUS] * greatest_overlap(hertz_stiffness(p), h[MASS], overlap, closing))
        if 2.0 * reach < span:
            return MARGIN * reach
    return span


@jit
def single_spring(p, h, q, flags, slid, overlap, before, du, dv):
    """One spring for the whole contact, capped by Coulomb: linear_spring, mindlin, mindlin_rescaled."""
    planar = p[PLANAR] != 0.0
    if slid:
        f, g = elastic_part(h)
    else:
        f, g = q[0], 0.0 if planar else q[1]
    part = 1.0 if before >= 0.0 else overlap / (overlap - before)
    start = max(before, 0.0)
    shrink = 1.0  # square root of a/a_old, applied half before and half after the displacement: second order
    if p[LAW] == LINEAR_SPRING:
        load = h[SCALE] * overlap
        stiffness = p[G_STAR] / p[E_STAR] * h[SCALE]
    else:
        load = hertz_stiffness(p) * overlap * sqrt(overlap)
        a, b = sqrt(p[RADIUS] * start), sqrt(p[RADIUS] * overlap)
        stiffness = 4.0 / 3.0 * p[G_STAR] * (a * a + a * b + b * b) / (a + b)  # 2 G* a averaged over the overlap
        if p[LAW] == MINDLIN_RESCALED and b < a:
            shrink = sqrt(b / a)
    f = shrink * (shrink * f + stiffness * part * du)
    if not planar:
        g = shrink * (shrink * g + stiffness * part * dv)
    total, limit = sqrt(f * f + g * g), p[FRICTION] * load
    held = limit
    if p[STATIC_FRICTION] > p[FRICTION]:
        if flags[0] == 0.0:
            held = p[STATIC_FRICTION] * load
        flags[0] = 1.0 if total > held else 0.0
    if total > held:
        f *= limit / total
        g *= limit / total
    q[0] = f
    if not planar:
        q[1] = g
    return f, g
