"""Forces and moments of a contact: the calls of laws, dashpots for persistent contacts, slopes, stored energy."""

from math import copysign, sqrt

from contactlaw import losses
from contactlaw.jit import jit_inline, jit_module
from contactlaw.laws import rolling, torsion
from contactlaw.laws.creep import strained
from contactlaw.laws.ellipse import elongation
from contactlaw.laws.hertz import BY_ITSELF, elastic_force
from contactlaw.laws.record import LASTING, OPEN, SPUN, ask_energy, ask_stiffness
from contactlaw.laws.slip import AT_LIMIT, stuck_stiffness
from contactlaw.laws.step import ask, press
from contactlaw.world.bodies.motion import spin_change
from contactlaw.world.data.access import body_at, pair_at
from contactlaw.world.data.call import address, call_spin, ready
from contactlaw.world.data.demand import SPIN
from contactlaw.world.data.materials import law_numbers, law_of, memory_of, speed_numbers
from contactlaw.world.data.records import NEVER, TWIST_ALWAYS, TWIST_LATER
from contactlaw.world.data.saved import KNOWN_NUMBERS, restore_contact
from contactlaw.world.data.vec import ZERO, add, axpy, cross, dot, load, scale, sub

PROBE = 1e-4  # displacement for the slopes of a law by finite differences, over the overlap
DAMPING = 0.3  # damping ratio of the tangential dashpot, see `has_dashpot`
BRAKING = 0.1  # share of a contact's creep by which dashpots may slow it, see `rolls_fast`
PARALLEL = 1e-9  # sine of the angle between slip velocity and friction force up to which they count as parallel
TORSION_EVERY = 8  # substeps between updates of torsion in crowds and trees
# [rad] of a torsional oscillation for which its moment may be held: with a critical dashpot this is stable to 0.8, and
# with nine contacts around a ball to 0.3
TORSION_PHASE = 0.3
TORSION_WAY = 0.3  # contact radii by which a contact may roll meanwhile: its creep is then right to 0.3
FULL = 1.0 - 1e-3  # share of mu P from which a friction force counts as the limit
ROUNDING = 1e-12  # twist about the normal that counts as zero, over the rotations of both bodies


@jit_inline
def advance_contact(w, c, slot, moved, slide, dt, motion):
    """Update the forces and the torsional moment of the closed contact in a slot for its present overlap.

    moved: displacement of A over B in this substep along both tangents [m], and rotation about the normal [rad]; slide:
    their rates [m/s, rad/s]. dt: length of the substep [s]; zero: an implicit step, in which a contact that is not new
    is taken as persistent. motion: as for `hertz.normal_force`. Returns the normal force [N], negative where it has
    ended as the damper would pull.
    """
    t, law = c.touch, law_of(w, pair_at(w.pairs, c.pair))
    memory = memory_of(w, slot)
    if t.state != OPEN and law.speeds != 0.0 and (dt == 0.0 or t.course == LASTING or is_quasi_static(c, 1.0)):
        losses.read_friction(t, speed_numbers(w, pair_at(w.pairs, c.pair)), sqrt(slide[0] ** 2 + slide[1] ** 2))
    du, dv, angle = moved
    c.torsion.passed[0] += c.passed[0]
    c.torsion.passed[1] += c.passed[1]
    spins = (angle != 0.0 or c.pending_twist != 0.0 or c.torsion.span > 0.0) and t.mu > 0.0
    waits = False  # of its twist
    if spins:
        c.pending_twist += angle
        waits = w.twists == TWIST_LATER and t.state != OPEN and t.state != SPUN and c.coasted_from == 0.0
        # nor does a twist wait by which the contact slips: friction, which that lowers, would act in full meanwhile
        waits = waits and not twist_slips(t, c.pending_twist) and not rolls_far(c)
        waits = waits and TORSION_EVERY * dt < torsion_time(w, c)
        if waits and c.twist_overlap == 0.0:
            c.twist_overlap = t.before
    own, numbers = w.memory + 8 * w.memory_size * slot, w.numbers + 8 * pair_at(w.pairs, c.pair).numbers
    pressed = press(t, law, dt, motion)
    damped = has_dashpot(w, c)
    if spins and not waits and ready(w, SPIN):
        inertia = 1.0 / spin_mobility(w, c, load(c.normal)) if damped else 0.0
        turned = c.pending_twist, c.twist_overlap if c.twist_overlap > 0.0 else t.before
        call_spin(address(w, SPIN), c, own, numbers, moved, turned, dt, w.twists == TWIST_ALWAYS, (slide[2], inertia))
        c.pending_twist, c.twist_overlap = 0.0, 0.0
    else:
        if not spins and (c.passed[0] != 0.0 or c.passed[1] != 0.0):
            du, dv, _ = strained(c.torsion, t, law.g_t, moved, c.passed[2], False)
        ask(t, law, law_numbers(w, pair_at(w.pairs, c.pair)), memory, du, dv, dt)
    if damped:
        add_dashpot(w, c, slide[0], slide[1], min(motion[3], 1.0), (motion[1] - 1.0) * dt)
    return pressed


@jit_inline
def has_dashpot(w, c):
    """Return whether dashpots act along and about all axes: in quasi-static persistent contacts with a normal one.

    Without them a contact that sticks, or a body that has stopped rolling, would swing for ever. What rolls fast has
    losses of its own, see `laws.creep`, beside which they would brake it.
    """
    return c.touch.course == LASTING and c.touch.zeta > 0.0 and is_quasi_static(c, 1.0) and not rolls_fast(w, c)


@jit_inline
def rolls_fast(w, c):
    """Return whether tangential dashpots would resist the creep of a contact by more than BRAKING of what that does."""
    if c.passed[0] == 0.0 and c.passed[1] == 0.0:
        return False
    t, a, b = c.touch, body_at(w.bodies, c.body_a), body_at(w.bodies, c.body_b)
    u, v = way_through(c, sub(load(a.spin), load(b.spin)))
    most, time = BRAKING * BRAKING * t.radius * t.overlap, 4.0 * DAMPING * DAMPING * t.tangential_mass
    return (u * u + v * v) * time > most * stuck_stiffness(t)


@jit_inline
def way_through(c, turned):
    """Return by how much [m] the surfaces pass through a contact along both tangents, as A turns over B by a vector."""
    n, e, p = load(c.normal), load(c.tangent), load(c.axis)
    q = cross(n, p)
    way = axpy(c.radii[0] * dot(turned, p), q, scale(-c.radii[1] * dot(turned, q), p))
    return dot(way, e), dot(way, cross(n, e))


@jit_inline
def passed_by(c, oblong, turned):
    """Return `CONTACT.passed` as A turns over B by a vector; oblong: ln(q/p) of the contact, see `curvature`."""
    u, v = way_through(c, turned)
    square = u * u + v * v
    if oblong == 0.0 or square == 0.0:
        return u, v, 0.0
    e, p = load(c.tangent), load(c.axis)
    along = u * dot(e, p) + v * dot(cross(load(c.normal), e), p)
    return u, v, elongation(oblong) * (2.0 * along * along / square - 1.0)


@jit_inline
def twist_of(c, a, b):
    """Return the rotation [rad] of A over B about the normal in the last substep; zero if it may be rounding alone."""
    turn_a, turn_b = load(a.twist), load(b.twist)
    angle = dot(sub(turn_a, turn_b), load(c.normal))
    if angle == 0.0 or angle * angle <= ROUNDING * ROUNDING * (dot(turn_a, turn_a) + dot(turn_b, turn_b)):
        return 0.0
    return angle


@jit_inline
def spin_mobility(w, c, n):
    """Return the angular acceleration of A over B about an axis n by a moment of 1 N m [1/(kg m^2)]."""
    return dot(n, add(spin_change(body_at(w.bodies, c.body_a), n), spin_change(body_at(w.bodies, c.body_b), n)))


@jit_inline
def rolls_far(c):
    """Return whether a contact rolls further than it may while its torsional moment is held."""
    u, v, most = c.passed[0], c.passed[1], TORSION_WAY / TORSION_EVERY
    return u * u + v * v > most * most * c.touch.radius * c.touch.overlap


@jit_inline
def torsion_time(w, c):
    """Return the time [s] for which the torsional moment of a closed contact may be held; NEVER if it does not spin."""
    if c.torsion.span == 0.0:
        return NEVER
    stiffness = torsion.stuck_stiffness(law_of(w, pair_at(w.pairs, c.pair)).g_t, sqrt(c.touch.radius * c.touch.overlap))
    return TORSION_PHASE / sqrt(stiffness * spin_mobility(w, c, load(c.normal)))


def advance_from_saved(w, c, slot, moved, slide):
    """Advance a contact from the saved state of its law to its present overlap and closing speed, in an implicit step.

    moved, slide: as for `advance_contact`, from the saved state on, and at the end of the stage. Returns the tangential
    forces [N] and the moment about the normal [N m].
    """
    t = c.touch
    overlap, before, closing = t.overlap, t.before, t.closing
    restore_contact(w, slot, KNOWN_NUMBERS)
    t.overlap, t.before, t.closing = overlap, before, closing
    advance_contact(w, c, slot, moved, slide, 0.0, BY_ITSELF)
    return t.f, t.g, c.torsion.moment


def slopes(w, c, slot, moved, slide, stage):
    """Return the slopes of the forces of a contact just advanced; the caller must then advance it anew.

    These are dP by the overlap, and those of F, G [N] and M [N m] by the overlap, by both displacements [m] and by the
    angle [rad]. Rates change with displacements: by 1/stage [1/s] of theirs. moved, slide: as for `advance_from_saved`.

    A contact that has slid further than its springs yield has the friction force mu P along its displacement: its
    slopes follow without the law. Otherwise they are finite differences away from the start of the step, where a law
    bends: a contact that has turned back from its limit by less than the difference would seem to slip.
    """
    t = c.touch
    known, overlap, closing, force = (t.f, t.g, c.torsion.moment), t.overlap, t.closing, t.force
    (du, dv, angle), (u, v, spin), (f, g, _) = moved, slide, known
    way = copysign(PROBE * overlap, overlap - t.before)
    t.overlap, t.closing = overlap + way, closing + way / stage
    yielding, slid = slide_to_slip(t, t.friction), sqrt(du * du + dv * dv)
    if c.torsion.span == 0.0 and slid > yielding and slips_fully(t):
        press(t, law_of(w, pair_at(w.pairs, c.pair)), 0.0)
        t.overlap, t.closing = overlap, closing
        normal, size = (t.force - force) / way, 1.0 / sqrt(f * f + g * g + 1e-300)
        x, y, across = size * f, size * g, t.friction * force / (slid + yielding)
        limit, mixed = t.friction * normal, -across * x * y
        return normal, (limit * x, limit * y, 0.0), (across * y * y, mixed, 0.0), (mixed, across * x * x, 0.0), ZERO
    more = advance_from_saved(w, c, slot, moved, slide)
    normal, by_overlap = (t.force - force) / way, scale(1.0 / way, sub(more, known))
    t.overlap, t.closing = overlap, closing
    along, by_u, by_v, by_angle = f * du + g * dv, ZERO, ZERO, ZERO
    to_u, to_v = copysign(way, f * along), copysign(way, g * along)
    if t.friction > 0.0:
        more = advance_from_saved(w, c, slot, (du + to_u, dv, angle), (u + to_u / stage, v, spin))
        by_u = scale(1.0 / to_u, sub(more, known))
        more = advance_from_saved(w, c, slot, (du, dv + to_v, angle), (u, v + to_v / stage, spin))
        by_v = scale(1.0 / to_v, sub(more, known))
        if c.torsion.span > 0.0:
            turn = copysign(way, angle) / sqrt(t.radius * overlap)
            more = advance_from_saved(w, c, slot, (du, dv, angle + turn), (u, v, spin + turn / stage))
            by_angle = scale(1.0 / turn, sub(more, known))
    return normal, by_overlap, by_u, by_v, by_angle


def slide_to_slip(t, friction):
    """Return the displacement [m] from rest at which a contact under a constant load begins to slip as a whole.

    friction: coefficient that counts, that of the contact or what spin leaves of it.
    """
    return friction * t.e_star / t.g_star * t.overlap


@jit_inline
def twist_slips(t, angle):
    """Return whether a contact slips as a whole about its normal as it turns by an angle [rad] from rest."""
    far = slide_to_slip(t, t.friction)
    return angle * angle * t.radius * t.overlap > far * far


def slips_fully(t):
    """Return whether a contact slips as a whole: its friction force is at the limit, which may be zero."""
    return t.f * t.f + t.g * t.g >= (FULL * t.friction * t.force) ** 2


def stuck_stiffness_of(w, c):
    """Return the tangential stiffness [N/m] by the law of a contact that sticks everywhere."""
    pair = pair_at(w.pairs, c.pair)
    return ask_stiffness(law_of(w, pair), c.touch, law_numbers(w, pair))


@jit_inline
def is_quasi_static(c, share):
    """Return whether a closed contact hardly moves along its normal: inertia matters little beside its force P.

    Closing acceleration and speed are below about 0.3 share times P/m and sqrt(P delta/m).
    """
    balanced = abs(c.closing_acceleration) * c.touch.mass < 0.3 * share * c.touch.force
    return balanced and is_slow(c, c.touch.closing, share)


@jit_inline
def is_slow(c, closing, share):
    """Return whether inertia matters little beside the force of a contact at a closing speed [m/s]."""
    return closing * closing * c.touch.mass < 0.1 * share * share * c.touch.force * c.touch.overlap


def dashpot_of(t, stiffness, time):
    """Return the coefficient of the tangential dashpot [N s/m] beside a spring of this stiffness [N/m].

    time: of a substep, times how many others share the mass [s]: together they would overshoot, see `normal_force`.
    """
    drag = 2.0 * DAMPING * sqrt(stiffness * t.tangential_mass)
    return drag / (1.0 + 0.5 * time * drag / t.tangential_mass)


def add_dashpot(w, c, u, v, weight, time):
    """Add the force of the tangential dashpot, within the friction cone; u, v: slip velocity [m/s].

    weight: factor of it, below 1 where contacts side by side share the mass, as `leapfrog.damper_weight`. time: see
    `dashpot_of`.

    In a straight slide at the limit it changes nothing, and is not computed. A law without springs, by rates alone, has
    none, as its own force would be nothing beside it; rigid friction has that of Mindlin's spring.
    """
    t = c.touch
    slides = t.f * t.f + t.g * t.g >= AT_LIMIT * (t.friction * t.force) ** 2
    if slides and abs(t.f * v - t.g * u) <= PARALLEL * (t.f * u + t.g * v):
        return
    drag = weight * dashpot_of(t, min(stuck_stiffness_of(w, c), stuck_stiffness(t)), time)
    t.f += drag * u
    t.g += drag * v
    pull, limit = sqrt(t.f * t.f + t.g * t.g), t.friction * t.force
    if pull > limit:
        t.f *= limit / pull
        t.g *= limit / pull


def stored_energy(w, c, slot):
    """Return the elastic energy [J] of a contact: normal, tangential, of torsion and of rolling resistance; open: 0."""
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
        out += rolling.stored(c.bend, t, law.rolling)
    return out


def advance_rolling(w, c, rate):
    """Update the moments of a closed contact after its forces; rate: of both angles, A over B [rad/s]."""
    t, resistance, across, along = c.touch, law_of(w, pair_at(w.pairs, c.pair)).rolling, c.radii[0], c.radii[1]
    left = rolling.roll(c.bend, t, resistance, across * c.rolled[0], along * c.rolled[1])
    drag = rolling_dashpot(w, c, resistance)
    u, v = c.bend[0] + drag * across * rate[0], c.bend[1] + drag * along * rate[1]
    share = min(resistance * t.force / sqrt(u * u + v * v + 1e-300), 1.0)
    c.bending[0], c.bending[1], c.rolled[2] = share * across * u, share * along * v, share * left


def rolling_dashpot(w, c, resistance):
    """Return the dashpot [N s/m] beside the spring of rolling resistance, critical as that of torsion; zero: none."""
    if not has_dashpot(w, c):
        return 0.0
    f = scale(c.radii[1], cross(load(c.normal), load(c.axis)))
    return 2.0 * sqrt(rolling.stiffness(c.touch, resistance) * (1.0 / spin_mobility(w, c, f)))


def rolling_axes(c):
    """Return the moments [m] of unit rolling resistance M/R along the present one and across it."""
    r, s, e = c.radii[0], c.radii[1], load(c.axis)
    u, v, f = c.bending[0] / r, c.bending[1] / s, cross(load(c.normal), e)
    size = sqrt(u * u + v * v)
    u, v = (u / size, v / size) if size > 0.0 else (1.0, 0.0)
    return axpy(r * u, e, scale(s * v, f)), axpy(-r * v, e, scale(s * u, f))


def moment_of(c):
    """Return the moment of a contact on B [N m]: torsion and rolling resistance."""
    n, e = load(c.normal), load(c.axis)
    about = scale(c.torsion.moment, n)
    bent = c.bending[0] != 0.0 or c.bending[1] != 0.0
    return axpy(c.bending[0], e, axpy(c.bending[1], cross(n, e), about)) if bent else about


jit_module(__name__)
