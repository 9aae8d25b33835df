"""The equations of an implicit step: masses, and contacts as they are where the bodies have been put.

With J_n, J_u, J_v the velocities of A over B along a contact's normal and tangents, by those of the bodies, its forces
P, F, G and their slopes K (`force.slopes`), a step of Newton's method for a stage of b seconds is

    (M + b^2 [J_n K_pp J_n^T + sum over F, G of J_u (K_fu J_u^T + K_fv J_v^T - K_fp J_n^T)]) dV
        = -M (V - V_free) + b (P J_n - F J_u - G J_v)
"""

from __future__ import annotations

from math import sqrt

from contactlaw.jit import jit_inside
from contactlaw.laws.rolling import stiffness
from contactlaw.memory import whole_at
from contactlaw.world.bodies.motion import velocity_at
from contactlaw.world.contacts.force import advance_from_saved, rolling_resistance, slips_fully, slopes
from contactlaw.world.contacts.rolling import advance_rolling, moment_of, rolling_axes, rolling_dashpot
from contactlaw.world.contacts.touch import begin_contact, force_of, measure
from contactlaw.world.data.access import (
    body_at,
    contact_at,
    law_of,
    near_at,
    pair_at,
    restore_contact,
    save_contact,
    shape_at,
    tree_at,
)
from contactlaw.world.data.call import call_with_body, call_with_vectors
from contactlaw.world.data.records import BOX, EDGE, NEVER, SEGMENT
from contactlaw.world.data.vec import ZERO, add, cross, dot, load, scale, store, sub, to_body
from contactlaw.world.implicit.equations import (
    FIRST,
    FREE,
    NORMAL,
    RIGHT,
    SIDE_U,
    SIDE_V,
    TURN,
    VELOCITY,
    masses,
    matrix,
    part,
)
from contactlaw.world.shapes.core import CROWN
from contactlaw.world.shapes.geometry import centre, half_axis, meet_near
from contactlaw.world.trees.kinematics import vector

FOUND = 1e-9  # of its overlap, and across of its slide too, that a contact may still move
SLID = 1e-7  # the same along the normal, where it slides as a whole, of mu times its slide: of what friction takes
SQUARE = 10.8  # times overlap * mass / force, the square of an impact's time: who sleeps hardly moves in that
INNER = 1.0 - 1e-9  # of the cosine of a normal to a face's, and of a half length, from where it is none of the end's
ROUNDING = 4e-15  # of a place along the normal, the same


@jit_inside
def begin_equations(w, bodies, stage):
    """Masses and moments of inertia, and the momenta that bodies have too little."""
    m, right = masses(w), part(w, RIGHT)
    velocity, free = part(w, VELOCITY), part(w, FREE)
    for k in range(bodies):
        b = body_at(w.bodies, whole_at(w.island_bodies, k))
        count, o = freedoms(b), b.unknown
        if b.tree != 0:
            if b.member != 0:
                continue
            t = tree_at(b.tree, 0)
            place = o + w.unknown_room * (w.unknown_room + 11 + o)
            t.weights, t.stride, t.stage = w.equations + 8 * place, w.unknown_room, stage
        for i in range(o, o + count):
            right[i] = 0.0
            for j in range(o, o + count):
                m[i, j] = 0.0
        if b.tree != 0:
            call_with_body(tree_at(b.tree, 0).write_masses, b)
        elif count > 0:
            weigh(b, m)
        for i in range(o, o + count):
            for j in range(o, o + count):
                right[i] += m[i, j] * (free[j] - velocity[j])
        if b.tree != 0:
            call_with_body(tree_at(b.tree, 0).add_damping, b)
            x = vector(tree_at(b.tree, 0).x, count)
            for i in range(count):
                right[o + i] += stage * x[i]


@jit_inside
def begin_matrix(w, bodies):
    """H without contacts."""
    h, m, first = matrix(w), masses(w), part(w, FIRST)
    for k in range(bodies):
        b = body_at(w.bodies, whole_at(w.island_bodies, k))
        if b.tree != 0 and b.member != 0:
            continue
        o = b.unknown
        for i in range(o, o + freedoms(b)):
            first[i] = o
            for j in range(w.unknowns):
                h[i, j] = 0.0
            for j in range(o, o + freedoms(b)):
                h[i, j] = m[i, j]


@jit_inside
def freedoms(b):
    """How many velocities are those of a body, or of its tree."""
    if b.unknown < 0:
        return 0
    return 6 if b.tree == 0 else tree_at(b.tree, 0).v_size


@jit_inside
def weigh(b, m):
    """Mass and moments of inertia of a body that is free."""
    axes, o = b.axes, b.unknown
    for i in range(3):
        m[o + i, o + i] = 1.0 / b.inverse_mass
        for j in range(3):
            for q in range(3):
                m[o + 3 + i, o + 3 + j] += axes[3 * i + q] * axes[3 * j + q] / b.inverse_inertia[q]


@jit_inside
def rounded(n, b):
    """Size [m] of the numbers whose rounding an overlap along n has from the place of a body."""
    return abs(n[0] * b.position[0]) + abs(n[1] * b.position[1]) + abs(n[2] * b.position[2])


@jit_inside
def look_at(w, r, stage):
    """Ask the law of a row where the bodies are, and enter its force; returns whether it has moved since the last look.

    The second result is a velocity [m/s] by which it may still move.
    """
    p = near_at(w.near, r.near)
    a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
    if r.slot < 0:
        overlap, _, _, _ = meet_near(w, p, a, b)
        if overlap <= 0.0 or not begin_contact(w, r.near, min(-p.gap, 0.0)):
            return False, NEVER
        r.slot, r.fresh = p.slot, 1
        save_contact(w, r.slot)
    restore_contact(w, r.slot)
    c = contact_at(w.contacts, r.slot)
    measure(w, c, a, b)
    t, n, e = c.touch, load(c.normal), load(c.tangent)
    f, arm_a, arm_b = cross(n, e), load(c.arm_a), load(c.arm_b)
    u = sub(velocity_at(a, arm_a), velocity_at(b, arm_b))
    slide = dot(u, e), dot(u, f), dot(sub(load(a.spin), load(b.spin)), n)
    along = stage * abs(dot(u, n) + r.closing)
    across = stage * sqrt((slide[0] - r.slide[0]) ** 2 + (slide[1] - r.slide[1]) ** 2)
    store(r.slide, slide)
    r.closing = -dot(u, n)
    t.closing = r.closing
    rounding = ROUNDING * (rounded(n, a) + rounded(n, b))
    if t.overlap <= 0.0:  # a contact that has just come open in the search is none that has been found
        t.force, t.f, t.g = 0.0, 0.0, 0.0
        return along > rounding - FOUND * t.overlap, NEVER
    advance_from_saved(w, c, r.slot, load(c.moved), slide)
    law = law_of(w, pair_at(w.pairs, c.pair))
    if law.rolling != 0.0:
        turning = sub(load(a.spin), load(b.spin))
        advance_rolling(w, c, (dot(turning, e), dot(turning, f)))
    impulse, moment = scale(stage, force_of(c)), scale(stage, moment_of(c))
    push(a, impulse, sub(cross(arm_a, impulse), moment), part(w, RIGHT))
    push(b, scale(-1.0, impulse), sub(moment, cross(arm_b, impulse)), part(w, RIGHT))
    pace = min(stage * stage * t.force / (SQUARE * t.overlap * t.mass), 1.0)
    slid = stage * sqrt(slide[0] * slide[0] + slide[1] * slide[1])
    taken = min(t.friction * slid, t.overlap) if slips_fully(t) else 0.0
    least = FOUND * pace * t.overlap + SLID * taken + rounding
    return not (along <= least and across <= least + FOUND * slid), least / stage  # NaN has moved


@jit_inside
def enter(w, r, stage):
    """Enter by how much the forces of a row change."""
    if r.slot < 0:
        return
    c = contact_at(w.contacts, r.slot)
    if c.touch.overlap <= 0.0:
        return
    a, b = body_at(w.bodies, c.body_a), body_at(w.bodies, c.body_b)
    k = slopes(w, c, r.slot, load(c.moved), load(r.slide), stage)
    n, e = load(c.normal), load(c.tangent)
    f = cross(n, e)
    count_a = freedoms(a)
    count_b = freedoms(b) if a.unknown != b.unknown else 0  # they may be of one tree
    for number, direction in ((NORMAL, n), (SIDE_U, e), (SIDE_V, f), (TURN, n)):
        row = empty_row(w, number, a, b)
        if number != TURN:
            push(a, direction, cross(load(c.arm_a), direction), row)
            push(b, scale(-1.0, direction), cross(direction, load(c.arm_b)), row)
        elif k[7] != 0.0:
            push(a, ZERO, n, row)
            push(b, ZERO, scale(-1.0, n), row)
    h, first = matrix(w), part(w, FIRST)
    jn, ju, jv, js = part(w, NORMAL), part(w, SIDE_U), part(w, SIDE_V), part(w, TURN)
    square = stage * stage
    lowest = min(a.unknown if count_a > 0 else b.unknown, b.unknown if count_b > 0 else a.unknown)
    for p in range(count_a + count_b):
        i = a.unknown + p if p < count_a else b.unknown + p - count_a
        first[i] = min(first[i], lowest)
        by_n = square * (k[0] * jn[i] - k[1] * ju[i] - k[2] * jv[i])
        by_u = square * (k[3] * ju[i] + k[4] * jv[i])
        by_v = square * (k[5] * ju[i] + k[6] * jv[i])
        by_s = square * k[7] * js[i]
        for q in range(count_a + count_b):
            j = a.unknown + q if q < count_a else b.unknown + q - count_a
            h[i, j] += by_n * jn[j] + by_u * ju[j] + by_v * jv[j] + by_s * js[j]
    law = law_of(w, pair_at(w.pairs, c.pair))
    if law.rolling != 0.0:
        resistance = rolling_resistance(w, c)
        k = square * stiffness(c.touch, resistance) + stage * rolling_dashpot(w, c, resistance)
        left = c.rolled[2]
        along, across = rolling_axes(c)
        enter_turning(w, a, b, along, scale(k if left == 1.0 else 0.0, along))
        enter_turning(w, a, b, across, scale(k * left, across))
    sa, sb = shape_at(w.shapes, c.shape_a), shape_at(w.shapes, c.shape_b)
    if (sa.kind == SEGMENT or sa.kind == EDGE) and sb.kind == BOX:
        u, way = crown_over_face(sa, a, sb, b, c)
        enter_turning(w, a, b, cross(n, u), scale(square * way, cross(force_of(c), u)))


@jit_inside
def empty_row(w, number, a, b):
    """A row of a Jacobian without entries for two bodies."""
    row = part(w, number)
    for one in (a, b):
        for p in range(freedoms(one)):
            row[one.unknown + p] = 0.0
    return row


@jit_inside
def enter_turning(w, a, b, axis, moment):
    """Enter by how much a moment on B grows with the angle of A over B about an axis across the normal; times b^2."""
    if dot(moment, moment) == 0.0:
        return
    h, row, column = matrix(w), empty_row(w, TURN, a, b), empty_row(w, NORMAL, a, b)
    count_a = freedoms(a)
    count_b = freedoms(b) if a.unknown != b.unknown else 0
    for one, sign in ((a, 1.0), (b, -1.0)):
        push(one, ZERO, scale(sign, axis), row)
        push(one, ZERO, scale(sign, moment), column)
    for p in range(count_a + count_b):
        i = a.unknown + p if p < count_a else b.unknown + p - count_a
        for q in range(count_a + count_b):
            j = a.unknown + q if q < count_a else b.unknown + q - count_a
            h[i, j] += column[i] * row[j]


@jit_inside
def crown_over_face(sa, a, sb, b, c):
    """Along a side or an edge over a face of a box: a unit vector, and how far [m/rad] its contact moves as it tilts.

    That is the radius of its crown, of many metres, see `core.deepest_on_line`; zero at its ends and beside the face.
    """
    u, n = half_axis(sa, a), to_body(sb.axes, to_body(b.axes, load(c.normal)))
    square = dot(u, u)
    inside = abs(dot(sub(load(c.arm_a), centre(sa, a)), u)) < INNER * square
    flat = max(abs(n[0]), abs(n[1]), abs(n[2])) > INNER
    return scale(1.0 / sqrt(square), u), square / (2.0 * CROWN * sa.radius) if inside and flat else 0.0


@jit_inside
def push(b, force, moment, row):
    """Add J^T (p, m) to a row, of a force on a body and a moment about its centre of mass."""
    o = b.unknown
    if o < 0:
        return
    if b.tree != 0:
        t = tree_at(b.tree, 0)
        x = vector(t.x, t.v_size)
        for i in range(t.v_size):
            x[i] = 0.0
        call_with_vectors(t.add_force, b, force, moment)
        for i in range(t.v_size):
            row[o + i] += x[i]
        return
    store(row[o:], add(load(row[o:]), force))
    store(row[o + 3 :], add(load(row[o + 3 :]), moment))
