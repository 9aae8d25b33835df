"""Newton's method for a stage of an implicit step: residual and matrix, with contacts as they are where the bodies are.

J_n, J_u and J_v map the velocities of the bodies to those of A over B along a contact's normal and tangents. With its
forces P, F, G and their slopes K (`force.slopes`), an iteration for a stage of b seconds solves

    (M + b^2 [J_n K_pp J_n^T + sum over F, G of J_u (K_fu J_u^T + K_fv J_v^T - K_fp J_n^T)]) dV
        = -M (V - V_free) + b (P J_n - F J_u - G J_v)

and likewise with the moments of contacts.
"""

from math import sqrt

from contactlaw.jit import jit_module
from contactlaw.laws.rolling import stiffness
from contactlaw.memory import whole_at
from contactlaw.world.bodies.motion import angular_momentum, velocity_at
from contactlaw.world.contacts.force import advance_contact, rolling_resistance, slips_fully, slopes
from contactlaw.world.contacts.rolling import advance_rolling, moment_of, rolling_axes, rolling_dashpot
from contactlaw.world.contacts.touch import begin_contact, force_of, measure
from contactlaw.world.data.access import body_at, contact_at, near_at, pair_at, shape_at, tree_at
from contactlaw.world.data.call import call_with_body, call_with_vectors
from contactlaw.world.data.kinds import BOX, EDGE, SEGMENT
from contactlaw.world.data.materials import law_of
from contactlaw.world.data.records import NEVER
from contactlaw.world.data.saved import restore_contact, restore_history, save_contact
from contactlaw.world.data.vec import ZERO, cross, dot, load, scale, store, sub, to_body
from contactlaw.world.implicit.equations import (
    ENVELOPE,
    FREE_VELOCITY,
    JACOBIAN_N,
    JACOBIAN_SPIN,
    JACOBIAN_U,
    JACOBIAN_V,
    RIGHT_SIDE,
    VELOCITY,
    mass_address,
    mass_matrix,
    matrix,
    vector_of,
)
from contactlaw.world.near.places import takes_known_gap
from contactlaw.world.shapes.core import set_back
from contactlaw.world.shapes.geometry import centre, half_axis, meet_near
from contactlaw.world.trees.kinematics import vector

# Tolerances: how far a contact may still move between two iterations
CONVERGED = 1e-9  # of its overlap; across the normal of its slide, too
SLIDE_CONVERGED = 1e-7  # along the normal of a contact that slides as a whole: of mu times its slide
ROUNDING = 4e-15  # of the positions of its bodies along the normal
IMPACT_SQUARED = 10.8  # duration of an impact squared, times force / (overlap * mass); islands sleep by motion in that
INSIDE = 1.0 - 1e-9  # of a half length, and of the cosine of a normal to a face's: within them a side lies on the face


def begin_residual(w, bodies, stage):
    """Write the residual of a stage [s] without contacts: M (V_free - V), and damping in trees; also the M of trees."""
    m, right = mass_matrix(w), vector_of(w, RIGHT_SIDE)
    velocity, free = vector_of(w, VELOCITY), vector_of(w, FREE_VELOCITY)
    for k in range(bodies):
        b = body_at(w.bodies, whole_at(w.island_bodies, k))
        count, o = velocity_count(b), b.unknown
        if count == 0 or (b.tree != 0 and b.member != 0):
            continue
        if b.tree == 0:
            store(right[o:], scale(1.0 / b.inverse_mass, sub(load(free[o:]), load(velocity[o:]))))
            store(right[o + 3 :], angular_momentum(b, sub(load(free[o + 3 :]), load(velocity[o + 3 :]))))
            continue
        t = tree_at(b.tree, 0)
        t.weights, t.stride, t.stage = mass_address(w, o), w.unknown_room, stage
        for i in range(o, o + count):
            for j in range(o, o + count):
                m[i, j] = 0.0
        call_with_body(t.write_masses, b)
        for i in range(o, o + count):
            total = 0.0
            for j in range(o, o + count):
                total += m[i, j] * (free[j] - velocity[j])
            right[i] = total
        call_with_body(t.add_damping, b)
        x = vector(t.x, count)
        for i in range(count):
            right[o + i] += stage * x[i]


def begin_matrix(w, bodies):
    """Set H to the mass matrix M, and the envelope to that of M."""
    h, m, first = matrix(w), mass_matrix(w), vector_of(w, ENVELOPE)
    for k in range(bodies):
        b = body_at(w.bodies, whole_at(w.island_bodies, k))
        if b.tree != 0 and b.member != 0:
            continue
        o = b.unknown
        for i in range(o, o + velocity_count(b)):
            first[i] = o
            for j in range(w.unknowns):
                h[i, j] = 0.0
            for j in range(o, o + velocity_count(b) if b.tree != 0 else o):
                h[i, j] = m[i, j]
        if b.tree == 0 and b.unknown >= 0:
            write_inertia(b, h)


def velocity_count(b):
    """Return how many unknowns are those of a body, or of its tree."""
    if b.unknown < 0:
        return 0
    return 6 if b.tree == 0 else tree_at(b.tree, 0).v_size


def write_inertia(b, h):
    """Write the mass and the moments of inertia of a free body into H."""
    axes, o = b.axes, b.unknown
    inertia = 1.0 / b.inverse_inertia[0], 1.0 / b.inverse_inertia[1], 1.0 / b.inverse_inertia[2]
    for i in range(3):
        h[o + i, o + i] = 1.0 / b.inverse_mass
        own = inertia[0] * axes[3 * i], inertia[1] * axes[3 * i + 1], inertia[2] * axes[3 * i + 2]
        for j in range(3):
            h[o + 3 + i, o + 3 + j] = own[0] * axes[3 * j] + own[1] * axes[3 * j + 1] + own[2] * axes[3 * j + 2]


def rounding_scale(n, b):
    """Return the size [m] of the position's terms along n, whose rounding enters the overlap of a body's contacts."""
    return abs(n[0] * b.position[0]) + abs(n[1] * b.position[1]) + abs(n[2] * b.position[2])


def evaluate_contact(w, r, stage, again):
    """Evaluate the contact of a row at the bodies' places, and add its impulse over a stage [s] to the residual.

    again: whether it has been evaluated since it was saved. An open pair that overlaps there is closed. Returns whether
    the contact has moved by more than its tolerance since the last iteration, and the residual [m/s] of such a motion.
    """
    p = near_at(w.near, r.near)
    a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
    if r.slot < 0:
        if p.checked == 0.0 and p.gap > a.path + b.path:  # by the gap at the start of the step
            return False, NEVER
        if p.places > 1 and takes_known_gap(w, p, -1.0):
            return False, NEVER
        overlap, _, _, _ = meet_near(w, p, a, b)
        if overlap <= 0.0 or not begin_contact(w, r.near, min(-p.gap, 0.0)):
            return False, NEVER
        r.slot, r.fresh = p.slot, 1
        save_contact(w, r.slot)
    if again:
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
    rounding = ROUNDING * (rounding_scale(n, a) + rounding_scale(n, b))
    if t.overlap <= 0.0:  # opened by this iteration, so not converged unless it hardly moves
        t.force, t.f, t.g = 0.0, 0.0, 0.0
        return along > rounding - CONVERGED * t.overlap, NEVER
    if again:
        restore_history(w, r.slot)
    advance_contact(w, c, r.slot, load(c.moved), slide, 0.0, (0.0, 1.0, 0.0))
    law = law_of(w, pair_at(w.pairs, c.pair))
    if law.rolling != 0.0:
        turning = sub(load(a.spin), load(b.spin))
        advance_rolling(w, c, (dot(turning, e), dot(turning, f)))
    impulse, moment = scale(stage, force_of(c)), scale(stage, moment_of(c))
    add_generalised_force(a, impulse, sub(cross(arm_a, impulse), moment), vector_of(w, RIGHT_SIDE))
    add_generalised_force(b, scale(-1.0, impulse), sub(moment, cross(arm_b, impulse)), vector_of(w, RIGHT_SIDE))
    pace = min(stage * stage * t.force / (IMPACT_SQUARED * t.overlap * t.mass), 1.0)
    slid = stage * sqrt(slide[0] * slide[0] + slide[1] * slide[1])
    taken = min(t.friction * slid, t.overlap) if slips_fully(t) else 0.0
    tolerance = CONVERGED * pace * t.overlap + SLIDE_CONVERGED * taken
    moving = not (along <= tolerance + rounding and across <= tolerance + rounding + CONVERGED * slid)  # NaN has moved
    return moving, (tolerance + pace * rounding) / stage  # motion along a slow contact leaves less than itself


def add_stiffness(w, r, stage):
    """Add the slopes of a contact's forces to H, for a stage [s]."""
    if r.slot < 0:
        return
    c = contact_at(w.contacts, r.slot)
    if c.touch.overlap <= 0.0:
        return
    a, b = body_at(w.bodies, c.body_a), body_at(w.bodies, c.body_b)
    k = slopes(w, c, r.slot, load(c.moved), load(r.slide), stage)
    n, e = load(c.normal), load(c.tangent)
    f = cross(n, e)
    count_a = velocity_count(a)
    count_b = velocity_count(b) if a.unknown != b.unknown else 0  # they may be of one tree
    for number, direction in ((JACOBIAN_N, n), (JACOBIAN_U, e), (JACOBIAN_V, f)):
        row = clear_row(w, number, a, b)
        add_generalised_force(a, direction, cross(load(c.arm_a), direction), row)
        add_generalised_force(b, scale(-1.0, direction), cross(direction, load(c.arm_b)), row)
    h, first = matrix(w), vector_of(w, ENVELOPE)
    jn, ju, jv = vector_of(w, JACOBIAN_N), vector_of(w, JACOBIAN_U), vector_of(w, JACOBIAN_V)
    square = stage * stage
    lowest = min(a.unknown if count_a > 0 else b.unknown, b.unknown if count_b > 0 else a.unknown)
    for p in range(count_a + count_b):
        i = index_of(a, b, count_a, p)
        first[i] = min(first[i], lowest)
        by_n = square * (k[0] * jn[i] - k[1] * ju[i] - k[2] * jv[i])
        by_u = square * (k[3] * ju[i] + k[4] * jv[i])
        by_v = square * (k[5] * ju[i] + k[6] * jv[i])
        for j in range(a.unknown, a.unknown + count_a):
            h[i, j] += by_n * jn[j] + by_u * ju[j] + by_v * jv[j]
        for j in range(b.unknown, b.unknown + count_b):
            h[i, j] += by_n * jn[j] + by_u * ju[j] + by_v * jv[j]
    if k[7] != 0.0:
        add_moment_stiffness(w, a, b, n, scale(square * k[7], n))
    add_moments(w, c, a, b, stage)


def add_moments(w, c, a, b, stage):
    """Add to H the slopes of moments by angles: rolling resistance, and a side over a face of a box; stage [s]."""
    square = stage * stage
    law = law_of(w, pair_at(w.pairs, c.pair))
    if law.rolling != 0.0:
        resistance = rolling_resistance(w, c)
        k = square * stiffness(c.touch, resistance) + stage * rolling_dashpot(w, c, resistance)
        left = c.rolled[2]
        along, across = rolling_axes(c)
        add_moment_stiffness(w, a, b, along, scale(k if left == 1.0 else 0.0, along))
        add_moment_stiffness(w, a, b, across, scale(k * left, across))
    sa, sb = shape_at(w.shapes, c.shape_a), shape_at(w.shapes, c.shape_b)
    if (sa.kind == SEGMENT or sa.kind == EDGE) and sb.kind == BOX:
        u, way = crown_over_face(sa, a, sb, b, c)
        add_moment_stiffness(w, a, b, cross(load(c.normal), u), scale(square * way, cross(force_of(c), u)))


def index_of(a, b, count_a, p):
    """Return the index of the unknown that is entry p of those of A, `count_a` in number, and then of B."""
    return a.unknown + p if p < count_a else b.unknown + p - count_a


def clear_row(w, number, a, b):
    """Return a row of a Jacobian with its entries for two bodies set to zero."""
    row = vector_of(w, number)
    for one in (a, b):
        for p in range(velocity_count(one)):
            row[one.unknown + p] = 0.0
    return row


def add_moment_stiffness(w, a, b, axis, moment):
    """Add to H a moment on B that grows with the angle of A over B about an axis across the normal.

    moment: its slope with the angle, times b^2.
    """
    if dot(moment, moment) == 0.0:
        return
    h, row, column = matrix(w), clear_row(w, JACOBIAN_SPIN, a, b), clear_row(w, JACOBIAN_N, a, b)
    count_a = velocity_count(a)
    count_b = velocity_count(b) if a.unknown != b.unknown else 0
    for one, sign in ((a, 1.0), (b, -1.0)):
        add_generalised_force(one, ZERO, scale(sign, axis), row)
        add_generalised_force(one, ZERO, scale(sign, moment), column)
    for p in range(count_a + count_b):
        i = index_of(a, b, count_a, p)
        for q in range(count_a + count_b):
            j = index_of(a, b, count_a, q)
            h[i, j] += column[i] * row[j]


def crown_over_face(sa, a, sb, b, c):
    """Return the direction of a side or an edge over a face of a box, and how far its contact moves with tilt [m/rad].

    The latter is the radius of its crown, many metres, see `core.deepest_on_line`; zero at its ends and off the face.
    """
    u, n = half_axis(sa, a), to_body(sb.axes, to_body(b.axes, load(c.normal)))
    square = dot(u, u)
    at = dot(sub(load(c.arm_a), centre(sa, a)), u) / square
    flat = max(abs(n[0]), abs(n[1]), abs(n[2])) > INSIDE
    _, _, growth = set_back(sa, u, at)
    return scale(1.0 / sqrt(square), u), square / growth if abs(at) < INSIDE and flat else 0.0


def add_generalised_force(b, force, moment, row):
    """Add J^T (p, m) to a row: a force p on a body and a moment m about its centre of mass."""
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
    for i in range(3):
        row[o + i] += force[i]
        row[o + 3 + i] += moment[i]


jit_module(__name__)
