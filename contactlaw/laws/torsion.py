"""Torsion: moment about the normal of a contact that spins, and the friction that spin leaves for sliding.

A line of independent springs describes torsion alone exactly (Jaeger, Arch. Appl. Mech. 65, 1995; Popov & Hess 2015).
With 1/G_t = 1/G_A + 1/G_B and theta(x) the elastic angle of the spring at x,

    M = integral over the contact, 0 < x < a, of 16 G_t x^2 theta(x) dx
    |theta(x)| <= mu/(2 G_t) integral_x^a p(r) dr/sqrt(r^2 - x^2) = 3 mu P/(4 pi G_t a^2) [K(k) - E(k)],
    k^2 = 1 - x^2/a^2

which is Lubkin's solution (J. Appl. Mech. 18, 1951): stuck stiffness 16/3 G_t a^3, full slip M_s = 3 pi/16 mu P a.
The springs are combined into rings of fixed radii with one mean angle each. Stiffness and mean limit b of a ring are
those of its part in contact. Springs that come into contact are not twisted; those that leave it lose their energy. If
all springs of a ring slipped at once, M as a function of the angle would consist of n chords, with an error of 0.57/n^2
of M_s. So the limits of a ring's springs are distributed uniformly between b - h and b + h, with the true variance:
h = 3/(4 pi) E(k) times the spread of ln(x), in units of mu P/(G_t a^2), because dK/dk - dE/dk = k E/(1 - k^2). Twisted
from zero by beta, a ring then holds the angle

    beta up to b - h        b - (b + h - beta)^2/(4 h) up to b + h        b from there

With 16 rings M of a first twist is right to 1e-4 of M_s. A ring that has slipped in part unloads elastically to zero,
then follows the same curve in the other direction. A step starts on the curve at the angle that the ring holds, so
friction dissipates energy in any step. For a twist to and fro M is right to 6e-3.

Sliding and spinning together, with slip everywhere; the velocity v of the centre of the contact is s times omega a
(q^2 = s^2 - 1; `tests.reference.test_closed_forms` has the quadrature):

    s <= 1: F/(mu P) = 3 pi/32 (4 s - s^3)          M/(mu P a) = 3 pi/128 (8 - 8 s^2 + 3 s^4)
    s >= 1: F/(mu P) = 3/16 [(4 s - s^3) asin(1/s) + (s^2 + 2) q/s]
            M/(mu P a) = 3/64 [(8 - 8 s^2 + 3 s^4) asin(1/s) + (6 - 3 s^2) q]

With k = 1/s, a polynomial replaces the second pair, M/(mu P a) = k Q(k^2) within 1e-5. Q is fitted such that it begins
like the series and meets the first pair at k = 1; F follows from dF = -k dM (`tests.test_torsion` compares both).

This limit curve bounds all F and M, and (v, omega a) is along its normal (Goyal, Ruina & Papadopoulos, Wear 143, 1991).
So friction is reduced, for the tangential law and the rings, to the point of the curve nearest to F and M of a trial
step with little slip; inside the curve F and M are not coupled. Reduced friction dissipates energy, unless a force
reverses in the same step: its mean then returns some. So the dissipation of such a step is computed. If it is negative,
springs and rings move towards the reversed tractions of the start of the step, which are within all limits and
dissipate nothing, until the dissipation is zero.
If the rim slips by spin while F is inside the curve, this coupling misses most of the effect of spin on psi_2. So
impacts under `microslip` use `sectors` from sigma = 0.02 on.
"""

from math import copysign, pi, sqrt

import numpy as np

from contactlaw.jit import jit_inline, jit_module, jit_of_sums
from contactlaw.laws.record import LASTING, SLIDING, SPRUNG, VECTOR, ask_energy, record
from contactlaw.laws.slip import span_of
from contactlaw.laws.step import ask

RINGS = 16
EDGES = (np.arange(RINGS + 1) / RINGS) ** 0.9  # radii over the span; closer towards the rim, where slip begins
TORSION = record(
    # radius that the rings span [m], 0: no spin since the touch; moment against the spin [N m]; friction left for it
    "span", "moment", "friction",
    twists=("f8", (RINGS,)),  # elastic angles of the rings [rad]
    # way of the surfaces through the contact [m], of which its radius is kept; what was beyond, over the radius
    passed=("f8", (2,)), rolled="f8",  # at the last update, see `creep`
    stored="f8", missed=VECTOR,  # of `sectors`: elastic energy [J]; force and moment of the parallel spring
)  # fmt: skip
"""State of a contact under torsion."""

FULL = 3.0 * pi / 16.0  # M_s over mu P a
LEAST = 1e-100  # least share of friction that spin leaves for the tangential force: one without friction has no law
CURVE = (0.2, 0.0148535, -0.0024586, 0.0214635, -0.0263972, 0.013432)  # Q, lowest power first
ITERATIONS, CLOSE = 6, 5e-3  # most steps to a point of the limit curve; last step [rad], whose square is the error


@jit_inline
def inner_share(s):
    """Share of M_s carried by the springs inside x = s a, 64/pi^2 integral_0^s t^2 [K - E] dt: a fit within 4e-5."""
    fit = 5.4986 + s * (-28.5592 + s * (102.3440 + s * (-222.5125 + s * (281.0245 + s * (-189.2718 + s * 52.4591)))))
    return s * s * s * (1.0 + (1.0 - s) * (3.0 + (1.0 - s) * fit))


@jit_inline
def spread(inner, outer):
    """h of a ring between two radii over a, times 256/(9 pi): in units of the angle of a stuck contact under M_s."""
    ratio, middle = (outer - inner) / (outer + inner), 0.5 * (outer + inner)
    # A fit to the spread of ln(x) with the weight x^2 dx, times a fit to E(k).
    return 2.1615 * ratio * (1.0 - 0.423 * ratio * ratio) * (1.0 + middle * (0.2736 + 0.2972 * middle))


def advance(state, contact, pair, law, memory, moved, turned, dt):
    """Update force and moment of a contact that slides and spins; return the friction that is left for the moment.

    state: `TORSION`. contact: with the normal forces of this step. pair, law, memory, dt: as for `record.ask_force`.
    moved: displacement du, dv [m] and rotation [rad] of A relative to B over this step, which gives the limits; turned:
    rotation that the rings have not followed yet, this step's included, and overlap [m] where it began.
    """
    angle, since = turned
    left = limits(state, contact, *moved)
    own, twists, span = memory[: 2 * int(pair.vectors)], state.twists[:], state.span
    was, angles, f, g, m, gain = own, twists, contact.f, contact.g, state.moment, 0.0
    lowered = left[0] * left[1] < 1.0 and contact.state >= SPRUNG
    if lowered and contact.overlap >= contact.before:
        was, angles = own.copy(), twists.copy()
        gain = ask_energy(pair, contact, law, memory) + stored(state, contact, pair.g_t)
    contact.friction = left[0] * contact.mu
    ask(contact, pair, law, memory, moved[0], moved[1], dt)
    before, contact.before = contact.before, since
    twist(state, contact, pair.g_t, angle, left[1] * contact.mu)
    contact.before = before
    if lowered and contact.overlap >= before and contact.state >= SPRUNG and state.span == span:
        gain -= ask_energy(pair, contact, law, memory) + stored(state, contact, pair.g_t)
        gain += 0.5 * ((f + contact.f) * moved[0] + (g + contact.g) * moved[1] + (m + state.moment) * angle)
        if gain < 0.0:  # move towards the reversed tractions of the start of the step
            own += was
            twists += angles
            both = ask_energy(pair, contact, law, memory) + stored(state, contact, pair.g_t)
            part = max(1.0 + gain / max(both, 1e-300), 0.0)
            own *= part
            own -= was
            twists *= part
            twists -= angles
            contact.f, contact.g = part * (contact.f + f) - f, part * (contact.g + g) - g
            state.moment = part * (state.moment + m) - m
    return left[1] * contact.mu


@jit_inline
def stuck_stiffness(modulus, radius):
    """Stiffness 16/3 G_t a^3 [N m/rad] of a contact of radius a [m] that sticks everywhere."""
    return 16.0 / 3.0 * modulus * radius**3


def twist(state, contact, modulus, angle, friction):
    """Update the moment of a contact twisted by an angle [rad]. modulus: G_t [Pa]; friction: left for the moment.

    It carries the damper's force as the tangential force does, see `slip.carried`.
    """
    radius = sqrt(contact.radius * contact.overlap)
    old = sqrt(contact.radius * max(contact.before, 0.0))
    follow(state, contact, old)
    if contact.before < 0.0:
        angle *= contact.overlap / (contact.overlap - contact.before)
    hold = stuck_stiffness(modulus, radius)
    load, share = contact.elastic, contact.ratio
    if contact.course == LASTING:
        load, share = min(contact.force, load), 1.0
    one, cap = 1.0 / radius, FULL * friction * load * radius
    state.moment = share * turn_rings(state, state.span * one, old * one, angle, cap / hold) * hold


@jit_of_sums
def turn_rings(state, span, old, angle, cap):
    """Twist all rings by an angle [rad]; return the moment over the contact's stiffness [rad]. cap: limit of that.

    span, old: span of the rings and previous radius of the contact, over the present radius.
    """
    moment, side, way = 0.0, copysign(1.0, angle), abs(angle)
    for i in range(RINGS):
        start, end = EDGES[i] * span, EDGES[i + 1] * span
        inner, outer = min(start, 1.0), min(end, 1.0)
        size = outer * outer * outer - inner * inner * inner
        end = min(end, old)
        was = end * end * end - start * start * start
        one = 1.0 / max(size, 1e-30)
        mean = max(cap * one * (inner_share(outer) - inner_share(inner)), 0.0)
        half = min(cap * spread(inner, outer), mean)
        held = side * one * state.twists[i] * max(min(was, size), 0.0)
        held = min(max(held, -mean), mean)
        begin, twist = max(held, 0.0), held + way
        left = mean + half - begin  # angle until the whole ring slips
        if begin > mean - half:
            left = sqrt(4.0 * half * (mean - begin))
        left = max(left - max(twist - begin, 0.0), 0.0)
        on = min(left, 2.0 * half)
        twist = min(twist, max(mean - (left - on) - on * on / max(4.0 * half, 1e-300), -held))
        state.twists[i] = side * twist
        moment += twist * size
    return side * moment


def follow(state, contact, radius):
    """Adapt the span of the rings to the contact, whose previous radius [m] is given.

    If it changes, all rings get the same angle: of all states with the same moment, that of least energy.
    """
    span = state.span
    if span == 0.0:
        state.span = sqrt(contact.radius * max(contact.reach, contact.overlap))
        return
    state.span = span_of(contact, span)
    if state.span != span:
        mean, last = 0.0, 0.0
        for i in range(RINGS):
            end = min(EDGES[i + 1] * span, radius) ** 3
            mean += (end - last) * state.twists[i]
            last = end
        for i in range(RINGS):
            state.twists[i] = mean / last if last > 0.0 else 0.0


def stored(state, contact, modulus):
    """Elastic energy of the rings [J], the sum of 8/3 G_t (x_out^3 - x_in^3) times the square of the angle."""
    energy, last, radius = 0.0, 0.0, sqrt(contact.radius * max(contact.overlap, 0.0))
    for i in range(RINGS if state.span > 0.0 else 0):
        end = min(EDGES[i + 1] * state.span, radius) ** 3
        energy += (end - last) * state.twists[i] ** 2
        last = end
    return 8.0 / 3.0 * modulus * energy


def limits(state, contact, du, dv, angle):
    """Shares of friction that are left for the tangential force and for the moment.

    contact: with the normal forces of this step and the friction of the previous one. du, dv, angle: as for `advance`.
    """
    if contact.before <= 0.0 or contact.overlap <= 0.0 or contact.force <= 0.0:
        return 1.0, 1.0
    radius, full = sqrt(contact.radius * contact.overlap), 1.0 / (contact.mu * contact.force)
    stretch = contact.g_star * radius  # half the stuck stiffness: near the limit, much of the contact slips
    u, v = contact.f + stretch * du, contact.g + stretch * dv
    force = full * sqrt(u * u + v * v)
    moment = full * abs(state.moment / radius + stretch * radius * angle)
    if force + moment / FULL > 1.0:
        f, m, outside = nearest(force, moment)
        if outside:
            return max(f, LEAST), m / FULL
    # unless it knows the limit of its slide, a law initialises its springs by the present friction when it sticks
    keeps = contact.state == SLIDING and not (contact.course == LASTING and contact.slid_limit > 0.0)
    return contact.friction / contact.mu if keeps else 1.0, 1.0


@jit_of_sums
def nearest(force, moment):
    """Point of the limit curve nearest to a force over mu P and a moment over mu P a; whether these lie outside it."""
    v, w = force, moment * (1.0 / (FULL * FULL))  # first guess: the normal of an ellipse with the same axes
    one = 1.0 / sqrt(v * v + w * w)
    f, m, bend, turn = 0.0, 0.0, 0.0, 0.0
    for _ in range(ITERATIONS):
        v, w = one * v, one * w
        f, m, bend = limit_point(v, w)
        x, y = force - f, moment - m
        turn = (y * v - x * w) / (max(x * v + y * w, 0.0) + bend)
        if turn * turn < CLOSE * CLOSE:
            break
        v, w = max(v - turn * w, 0.0), max(w + turn * v, 0.0)
        one = 1.0 - turn * turn * (0.5 - 0.375 * turn * turn)  # 1/sqrt(1 + turn^2), to fourth order
    along = bend * turn
    f, m = f - along * (w + 0.5 * turn * v), m + along * (v - 0.5 * turn * w)
    return f, m, (force - f) * (v - turn * w) + (moment - m) * (w + turn * v) > 0.0


@jit_of_sums
def limit_point(v, w):
    """F/(mu P) and M/(mu P a) of a contact that slips everywhere, and the radius of curvature of the limit curve there.

    v, w: velocity of the centre and spin times a, both >= 0, over the root of the sum of their squares.
    """
    if w <= v:
        one = 1.0 / v
        k = w * one
        x = k * k
        a, b, c, d, e, g = CURVE
        m = k * (a + x * (b + x * (c + x * (d + x * (e + x * g)))))
        rate = a + x * (3.0 * b + x * (5.0 * c + x * (7.0 * d + x * (9.0 * e + x * 11.0 * g))))  # dm/dk
        f = 0.5 * a + x * (0.75 * b + x * (5.0 / 6.0 * c + x * (0.875 * d + x * (0.9 * e + x * (11.0 / 12.0 * g)))))
        return 1.0 - x * f, m, rate * one * one * one
    one = 1.0 / w
    s = v * one
    s2 = s * s
    slope = 3.0 * pi / 32.0 * (4.0 - 3.0 * s2)
    f, m = 3.0 * pi / 32.0 * s * (4.0 - s2), 3.0 * pi / 128.0 * (8.0 - s2 * (8.0 - 3.0 * s2))
    return f, m, slope * one * one * one


jit_module(__name__)
