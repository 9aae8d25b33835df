"""The microslip law in closed form for motion along a line: all springs at once, as a play operator with moving ends.

By the method of dimensionality reduction (Popov & Hess 2015) the contact is a line of springs |x| <= a. The spring at
x comes into contact at the overlap y = x^2/R. Let s be the tangential displacement and u = q/G* the deflection of a
spring, both in units of sigma = mu E*/G*, so that they are lengths like delta. Let v = s - u be the position of the
spring's foot. Coulomb's limit |q| <= mu p(x) reads |u| <= delta - y, or

    s - delta + y <= v(y) <= s + delta - y                       0 <= y <= delta

and v is constant unless an end of this window pushes it: a play operator (Krasnosel'skii & Pokrovskii, Systems with
Hysteresis, 1989) whose ends move with s and delta. A spring that comes into contact has no deflection, v = s; neither
has the spring at the rim.

Let s and delta run straight from one state to another. Then both ends move the same way, or apart, or the windows are
nested. In each case the new v is the old v clamped to the *last* window; springs that came into contact on the way
start with v = s of that instant. Substeps are not needed: the result is exact for a piece of any length.

The slope dv/dy always lies in [-1, 1]: springs that come into contact without slip have |ds| <= d(delta), the ends of
the window have slopes +-1, and a clamp preserves the bound. Hence the distances of v from both ends decrease with y,
and a clamp changes only an outer part y > y*. So v is piecewise linear; its breakpoints are kept on a stack, from the
centre to the rim. A straight piece of path changes the stack as follows, with ds relative to v at the rim:

    delta falls         the stack is first cut at the new delta
    |ds| <= d(delta)    nothing slips; a piece of slope ds/d(delta) is added
    otherwise           slip in the direction e = +-1 from the rim down to y*, where the clamp s - e (delta - y) meets
                        v: the pieces outside y* are removed, and a piece of slope e is added

A piece of path adds at most one entry, so n of them need at most n + 1 rows, the centre's included. Each entry is
removed at most once, so the work is O(1) a piece on average. If the clamp does not meet v, the whole contact slides,
and s is redefined such that v(0) = 0. Otherwise v(0) does not change; hence |s| <= delta at all times, and long slides
lose no digits.

With w = sqrt(y), dx = sqrt(R) dw, force and elastic energy are polynomials of w on every piece,

    F = 2 mu E* sqrt(R) (s w - I)                     energy = G* sigma^2 sqrt(R) (s^2 w - 2 s I + J)

where I and J are the integrals of v dw and v^2 dw from the centre to the rim, kept at every breakpoint. (Gross slip:
s w - I = 2/3 delta^1.5, F = 4/3 mu E* sqrt(R) delta^1.5 = mu P.)
"""

from math import sqrt

import numpy as np

from contactlaw.jit import jit_module
from contactlaw.laws.hertz import hertz_stiffness
from contactlaw.laws.record import pair_of, record

PIECE = np.dtype((np.record, record("end", "root", "place", "origin", "slope", "integral", "squares")))
"""A row of the stack, a piece v = origin + slope y: its outer end y and w = sqrt(y), with v (place), I and J there."""


def new_stack(pieces):
    """Return an empty stack for a path of that many straight pieces; row 0 is the centre of the contact."""
    return np.zeros(pieces + 1, PIECE)


def put(stack_io, top, end, root, place, origin, slope):
    """Write the piece v = origin + slope y, which begins at the end of the previous row, into row top."""
    one, before = stack_io[top], stack_io[top - 1]
    inner = before.end
    width, product = root - before.root, root * before.root
    cubic = (end + product + inner) / 3.0  # (w^3 - w_0^3)/3 over the width w - w_0
    fifth = (end * (end + product + inner) + inner * (product + inner)) / 5.0
    one.end, one.root, one.place, one.origin, one.slope = end, root, place, origin, slope
    one.integral = before.integral + width * (origin + slope * cubic)
    one.squares = before.squares + width * (origin * (origin + 2.0 * slope * cubic) + slope * slope * fifth)


def advance(stack_io, top, s, overlap, root):
    """Follow a straight piece of path to the displacement s and an overlap > 0; return the new top and s.

    top: row of the rim; 0: the contact was open, and s counts from the touch. root: square root of the overlap.
    """
    if stack_io[top].end > overlap:
        while stack_io[top - 1].end >= overlap:
            top -= 1
        origin, slope = stack_io[top].origin, stack_io[top].slope
        put(stack_io, top, overlap, root, origin + slope * overlap, origin, slope)
    rise, growth = s - stack_io[top].place, overlap - stack_io[top].end
    if abs(rise) <= growth:
        if growth > 0.0:
            slope = rise / growth
            top += 1
            put(stack_io, top, overlap, root, s, s - slope * overlap, slope)
        return top, s
    sense = 1.0 if rise > 0.0 else -1.0
    origin = s - sense * overlap
    while top > 0:
        inner = top - 1
        spare = sense * (stack_io[inner].place - origin) - stack_io[inner].end  # distance to slip at the inner end
        turn = 1.0 - sense * stack_io[top].slope
        if spare > 0.0 and turn > 0.0:
            end = stack_io[inner].end + spare / turn
            if end < stack_io[top].end:
                own, slope = stack_io[top].origin, stack_io[top].slope
                put(stack_io, top, end, sqrt(end), own + slope * end, own, slope)
            put(stack_io, top + 1, overlap, root, s, origin, sense)
            return top + 1, s
        top = inner
    put(stack_io, 1, overlap, root, sense * overlap, 0.0, sense)
    return 1, sense * overlap


def spring_sum(stack, top, s):
    """Integral of s - v over w [m^1.5], F/(2 mu E* sqrt(R))."""
    return s * stack[top].root - stack[top].integral


def stored(stack, top, s):
    """Integral of (s - v)^2 over w [m^2.5], energy over G* sigma^2 sqrt(R)."""
    return max(s * (s * stack[top].root - 2.0 * stack[top].integral) + stack[top].squares, 0.0)


def force_along_path(p, approach, displacement, normal_out, tangential_out):
    """Exact forces [N] along straight segments of overlap and displacement (n,) [m], from zero overlap, for mu > 0.

    p: numbers of the pair (`ContactPair.parameters`).
    """
    pair = pair_of(p)
    k, mu = hertz_stiffness(pair), pair.friction
    scale = pair.g_star / (mu * pair.e_star)
    stack = new_stack(approach.size)
    top, s, before, place = 0, 0.0, min(approach[0], 0.0), displacement[0]
    for j in range(approach.size):
        overlap = approach[j]
        if overlap <= 0.0:
            top = 0
            normal_out[j] = 0.0
            tangential_out[j] = 0.0
        else:
            slide = scale * (displacement[j] - place)
            if before < 0.0:
                slide *= overlap / (overlap - before)
            root = sqrt(overlap)
            top, s = advance(stack, top, s + slide if top > 0 else slide, overlap, root)
            normal_out[j] = k * overlap * root
            tangential_out[j] = 1.5 * mu * k * spring_sum(stack, top, s)
        before, place = overlap, displacement[j]


def impact(motion, chi, unit, speed, track_out):
    """Scaled sliding speed psi_2 after one impact with mu > 0, by integration of psi' = -2 chi F/mu.

    motion: `normal_motion.Motion`. speed: psi_1, in the unit of speed mu V_z1/kappa. unit: units of force [N], energy
    [J] and speed [m/s] for track_out, an array of `normal_motion.TRACK`, (steps + 1,).
    """
    steps = motion.delta.size - 1
    force, energy, rate = unit
    psi, after = speed, speed
    share, pull, work, elastic = min(psi, 1.0), 0.0, 0.0, 0.0
    stack = new_stack(steps)
    top, s, slide = 0, 0.0, 0.0
    for k in range(steps + 1):
        last = pull
        if 0 < k < steps:
            delta, root = motion.delta[k], motion.root[k]
            top, s = advance(stack, top, s + slide, delta, root)
            share = 1.5 / (root * delta) * spring_sum(stack, top, s)
            pull, elastic = share * motion.force[k], 0.75 * stored(stack, top, s)
        elif k == steps:
            pull, elastic = 0.0, 0.0
        before = after
        work += 0.5 * (last + pull) * slide
        psi -= 2.0 * chi * share * motion.drop[k]
        slide = psi * motion.step[k]
        after = psi
        now = 0.5 * (before + after) if 0 < k < steps else before if k == 0 else after
        one = track_out[k]
        one.force, one.stored, one.work, one.speed = force * pull, energy * elastic, energy * work, rate * now
    return after


jit_module(__name__)
