"""Newton's method for a stage of an implicit step: residual and matrix, with contacts as they are where the bodies are.

J_n, J_u and J_v map the velocities of the bodies to those of A over B along a contact's normal and tangents. With its
forces P, F, G and their slopes K (`force.slopes`), an iteration for a stage of b seconds solves

    (M + b^2 [J_n K_pp J_n^T + sum over F, G of J_u (K_fu J_u^T + K_fv J_v^T - K_fp J_n^T)]) dV
        = -M (V - V_free) + b (P J_n - F J_u - G J_v)

and likewise with the moments of contacts.
"""

from math import isfinite, sqrt

from contactlaw.jit import jit_inline, jit_module
from contactlaw.laws.hertz import BY_ITSELF
from contactlaw.laws.rolling import stiffness
from contactlaw.memory import whole_at
from contactlaw.world.bodies.motion import angular_momentum, closing_at, spin_change, velocity_at
from contactlaw.world.contacts import force
from contactlaw.world.contacts.substep import force_of, measure
from contactlaw.world.contacts.touch import begin_contact
from contactlaw.world.data.access import body_at, contact_at, near_at, pair_at, shape_at, tree_at
from contactlaw.world.data.call import call_with_body, call_with_vectors
from contactlaw.world.data.kinds import BOX, EDGE, SEGMENT
from contactlaw.world.data.materials import law_of
from contactlaw.world.data.records import NEVER
from contactlaw.world.data.saved import restore_contact, save_contact
from contactlaw.world.data.vec import ZERO, cross, dot, load, norm, scale, store, sub, to_body
from contactlaw.world.implicit.equations import equations_of
from contactlaw.world.shapes.core import set_back
from contactlaw.world.shapes.geometry import centre, half_axis, meet_near, takes_known_gap
from contactlaw.world.trees.dynamics import inertia
from contactlaw.world.trees.kinematics import entries, vector
from contactlaw.world.trees.mobility import clear, copy

# Tolerances: how far a contact may still move between two iterations
CONVERGED = 1e-9  # of its overlap; across the normal of its slide, too
SLIDE_CONVERGED = 1e-7  # along the normal of a contact that slides as a whole: of mu times its slide
ROUNDING = 4e-15  # of the positions of its bodies along the normal
IMPACT_SQUARED = 10.8  # duration of an impact squared, times force / (overlap * mass); islands sleep by motion in that
# Ways of a contact over its overlap at the start of the step: in the first iteration, from where the matrix of the last
# stage does not serve, and in others, from where a law is not followed, see `keep_near`
KEPT, FAR = 0.1, 0.5
INSIDE = 1.0 - 1e-9  # of a half length, and of the cosine of a normal to a face's: within them a side lies on the face


def begin_residual(w, bodies, stage):
    """Write the residual of a stage [s] without contacts: M (V_free - V), and damping in trees."""
    eq = equations_of(w)
    right, velocity, free = eq.right, eq.velocity, eq.free
    for k in range(bodies):
        b = body_at(w.bodies, whole_at(w.island_bodies, k))
        o, end = unknowns_of(b)
        if o == end or (b.tree != 0 and b.member != 0):
            continue
        if b.tree == 0:
            store(right[o:], scale(1.0 / b.inverse_mass, sub(load(free[o:]), load(velocity[o:]))))
            own, spin = load(free[o + 3 :]), load(velocity[o + 3 :])
            if b.isotropic != 0:
                store(right[o + 3 :], angular_momentum(b, sub(own, spin)))
            else:
                store(right[o + 3 :], sub(own, angular_momentum(b, spin)))
            continue
        t = tree_at(b.tree, 0)
        t.weights, t.stage = eq.diagonal[o:].ctypes.data, stage
        x = vector(t.x, t.v_size)
        for i in range(o, end):
            x[i - o] = free[i] - velocity[i]
        call_with_body(t.balance, b)
        copy(x, right[o:])


def residual_speed(w, bodies):
    """Return the greatest change of velocity that the residual momentum causes [m/s], that of spin [rad/s] added.

    In a tree: the greatest ratio of a residual to its entry of `diagonal`. NEVER if a force is not finite.
    """
    eq = equations_of(w)
    right = eq.right
    most, total = 0.0, 0.0  # the maximum alone would not show what is not finite
    for k in range(bodies):
        b = body_at(w.bodies, whole_at(w.island_bodies, k))
        o, change = b.unknown, 0.0
        if o >= 0 and b.tree == 0:
            change = b.inverse_mass * norm(load(right[o:])) + norm(spin_change(b, load(right[o + 3 :])))
        elif o >= 0 and b.member == 0:
            for i in range(o, o + tree_at(b.tree, 0).v_size):
                change, total = max(change, abs(right[i]) / eq.diagonal[i]), total + right[i]
        most, total = max(most, change), total + change
    return most if isfinite(total) else NEVER


def begin_matrix(w, bodies):
    """Set H to the mass matrix M, in trees with damping, and the envelope to that of M."""
    eq = equations_of(w)
    h = eq.h
    for k in range(bodies):
        b = body_at(w.bodies, whole_at(w.island_bodies, k))
        o, end = unknowns_of(b)
        if o == end or (b.tree != 0 and b.member != 0):
            continue
        for i in range(o, end):
            eq.first[i] = o
            clear(h[i, : w.unknowns])
        if b.tree == 0:
            i = b.inverse_inertia
            tensor = inertia(b.axes, (1.0 / i[0], 1.0 / i[1], 1.0 / i[2]))
            for j in range(3):
                h[o + j, o + j] = 1.0 / b.inverse_mass
            for j in range(9):
                h[o + 3 + j // 3, o + 3 + j % 3] = tensor[j]
        else:
            t = tree_at(b.tree, 0)
            t.weights, t.stride = h[o:, o:].ctypes.data, w.unknown_room
            call_with_body(t.write_masses, b)
            call_with_body(t.add_damping, b)


def unknowns_of(b):
    """Return the first unknown of a body, or of its tree, and that after its last one; the same if it has none."""
    count, first = 6 if b.tree == 0 else tree_at(b.tree, 0).v_size, max(b.unknown, 0)
    return first, first + (count if b.unknown >= 0 else 0)


def rounding_scale(n, b):
    """Return the size [m] of the position's terms along n, whose rounding enters the overlap of a body's contacts."""
    return abs(n[0] * b.position[0]) + abs(n[1] * b.position[1]) + abs(n[2] * b.position[2])


def keep_near(r, c, first):
    """Return whether a contact is far from where it was in the last iteration, in the first one from the step's start.

    One that sticks then has the forces of its overlap at the start, in the first iteration those of its displacement
    there too, and linear ones by what it is `beyond`, see `add_stiffness`: a first guess may press a stiff contact by
    many times its overlap, or relieve it so that it would slip. What slips from rest slips on in later iterations.
    """
    t = c.touch
    way, r.overlap = abs(t.overlap - (t.before if first else r.overlap)), t.overlap
    far = way > (KEPT if first else FAR) * t.before
    linear = far and r.fresh == 0 and c.torsion.span == 0.0 and not force.slips_fully(t)
    store(r.beyond, ZERO)
    if linear:
        r.beyond[0], t.overlap = t.overlap - t.before, t.before
    if linear and first:
        r.beyond[1], r.beyond[2] = c.moved[0], c.moved[1]
        c.moved[0], c.moved[1] = 0.0, 0.0
    return linear or (first and far)


def evaluate_contact(w, r, span, iteration):
    """Evaluate the contact of a row at the bodies' places, and add its impulse over a stage to the residual.

    span: length of the stage [s], and time of its end from the start of the step. An open pair that overlaps there is
    closed. Returns whether the contact has moved by more than its tolerance since the last iteration, and the residual
    [m/s] of such a motion; -1 if it is far, see `keep_near`.

    In the first of two stages a contact moves by b times its present rates, and an open pair closes by them, not where
    the bodies are: stiff, it would hold V along the chord of a curved path. A ball in a bowl would lose (omega h)^2 of
    its energy in a step, and a pin strike the other side of its slot.
    """
    stage, time = span
    p = near_at(w.near, r.near)
    a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
    if r.slot < 0:
        if p.checked == 0.0 and p.gap > a.path + b.path:  # by the gap at the start of the step
            return False, NEVER
        if p.places > 1 and takes_known_gap(w, p, -1.0):
            return False, NEVER
        overlap, n, arm_a, arm_b = meet_near(w, p, a, b)
        if time < w.step:
            overlap = min(overlap, stage * closing_at(a, arm_a, b, arm_b, n) - p.gap)
        if overlap <= 0.0 or not begin_contact(w, r.near, min(-p.gap, 0.0)):
            return False, NEVER
        r.slot, r.fresh = p.slot, 1
        save_contact(w, r.slot)
    if iteration > 0 or time > stage:
        restore_contact(w, r.slot)
    c = contact_at(w.contacts, r.slot)
    measure(w, c, a, b)
    t, n, e = c.touch, load(c.normal), load(c.tangent)
    f, arm_a, arm_b = cross(n, e), load(c.arm_a), load(c.arm_b)
    u, turning = sub(velocity_at(a, arm_a), velocity_at(b, arm_b)), sub(load(a.spin), load(b.spin))
    slide = dot(u, e), dot(u, f), dot(turning, n)
    along = stage * abs(dot(u, n) + r.closing)
    across = stage * sqrt((slide[0] - r.slide[0]) ** 2 + (slide[1] - r.slide[1]) ** 2)
    store(r.slide, slide)
    r.closing = t.closing = -dot(u, n)
    if time < w.step:
        t.overlap = t.before + stage * t.closing
        store(c.moved, scale(stage, slide))
    rounding = ROUNDING * (rounding_scale(n, a) + rounding_scale(n, b))
    far = keep_near(r, c, iteration == 0)
    if t.overlap <= 0.0:  # opened by this iteration, so not converged unless it hardly moves
        t.force, t.f, t.g = 0.0, 0.0, 0.0
        return along > rounding - CONVERGED * t.overlap, -1.0 if far else NEVER
    force.advance_contact(w, c, r.slot, load(c.moved), slide, 0.0, BY_ITSELF)
    if law_of(w, pair_at(w.pairs, c.pair)).rolling != 0.0:
        axis = load(c.axis)
        force.advance_rolling(w, c, (dot(turning, axis), dot(turning, cross(n, axis))))
    impulse, moment = scale(stage, force_of(c)), scale(stage, force.moment_of(c))
    about_a, about_b = sub(cross(arm_a, impulse), moment), sub(moment, cross(arm_b, impulse))
    add_opposite_forces(a, b, impulse, about_a, about_b, equations_of(w).right)
    pace = min(stage * stage * t.force / (IMPACT_SQUARED * t.overlap * t.mass), 1.0)
    slid = stage * sqrt(slide[0] * slide[0] + slide[1] * slide[1])
    taken = min(t.friction * slid, t.overlap) if force.slips_fully(t) else 0.0
    tolerance = CONVERGED * pace * t.overlap + SLIDE_CONVERGED * taken
    moving = not (along <= tolerance + rounding and across <= tolerance + rounding + CONVERGED * slid)  # NaN has moved
    if far:
        return True, -1.0
    return moving, (tolerance + pace * rounding) / stage  # motion along a slow contact leaves less than itself


def add_stiffness(w, r, stage):
    """Add the slopes of a contact's forces to H, for a stage [s]."""
    if r.slot < 0 or contact_at(w.contacts, r.slot).touch.overlap <= 0.0:
        return
    c = contact_at(w.contacts, r.slot)
    a, b = body_at(w.bodies, c.body_a), body_at(w.bodies, c.body_b)
    normal, by_overlap, along_u, along_v, about = force.slopes(w, c, r.slot, load(c.moved), load(r.slide), stage)
    n, e = load(c.normal), load(c.tangent)
    eq, (over, du, dv) = equations_of(w), load(r.beyond)
    h, first, jn, ju, jv = eq.h, eq.first, eq.along_n, eq.along_u, eq.along_v
    of_a, of_b = unknowns_of_both(a, b)
    for row, direction in ((jn, n), (ju, e), (jv, cross(n, e))):
        for start, end in (of_a, of_b):
            clear(row[start:end])
        about_a, about_b = cross(load(c.arm_a), direction), cross(direction, load(c.arm_b))
        add_opposite_forces(a, b, direction, about_a, about_b, row)
    square = stage * stage
    least, most = min(a.unknown, b.unknown), max(a.unknown, b.unknown)
    for start, end in (of_a, of_b):
        for i in entries(start, end):
            first[i] = min(first[i], least if least >= 0 else most)
            by_n = square * (normal * jn[i] - by_overlap[0] * ju[i] - by_overlap[1] * jv[i])
            by_u = square * (along_u[0] * ju[i] + along_u[1] * jv[i])
            by_v = square * (along_v[0] * ju[i] + along_v[1] * jv[i])
            eq.right[i] += (by_n * over - by_u * du - by_v * dv) / stage
            for begin, stop in (of_a, of_b):
                for j in entries(begin, stop if by_n != 0.0 or by_u != 0.0 or by_v != 0.0 else begin):
                    h[i, j] += by_n * jn[j] + by_u * ju[j] + by_v * jv[j]
    if about != ZERO:
        moments = -by_overlap[2], along_u[2], along_v[2], about[2]
        add_spin(w, a, b, n, scale(square, about), moments, square)
    add_moments(w, c, a, b, stage)


def add_spin(w, a, b, n, forces, moments, square):
    """Add to H the slopes of a contact that spins: of forces by the angle, and of the moment by all that moves.

    The rows of its Jacobian are in place. forces: by the angle, times the square of the stage; moments: along n, u, v
    and by the angle.
    """
    eq = equations_of(w)
    jn, ju, jv, jw = eq.along_n, eq.along_u, eq.along_v, eq.about
    of_a, of_b = unknowns_of_both(a, b)
    for start, end in (of_a, of_b):
        clear(jw[start:end])
    add_opposite_forces(a, b, ZERO, n, scale(-1.0, n), jw)
    for start, end in (of_a, of_b):
        for i in entries(start, end):
            by_w, own = forces[0] * ju[i] + forces[1] * jv[i], square * jw[i]
            for begin, stop in (of_a, of_b):
                for j in entries(begin, stop):
                    moved = moments[0] * jn[j] + moments[1] * ju[j] + moments[2] * jv[j] + moments[3] * jw[j]
                    eq.h[i, j] += by_w * jw[j] + own * moved


def add_moments(w, c, a, b, stage):
    """Add to H the slopes of moments by angles: rolling resistance, and a side over a face of a box; stage [s]."""
    square = stage * stage
    resistance = law_of(w, pair_at(w.pairs, c.pair)).rolling
    if resistance != 0.0:
        k = square * stiffness(c.touch, resistance) + stage * force.rolling_dashpot(w, c, resistance)
        along, across = force.rolling_axes(c)
        add_moment_stiffness(w, a, b, along, scale(k if c.rolled[2] == 1.0 else 0.0, along))
        add_moment_stiffness(w, a, b, across, scale(k * c.rolled[2], across))
    sa, sb = shape_at(w.shapes, c.shape_a), shape_at(w.shapes, c.shape_b)
    if (sa.kind == SEGMENT or sa.kind == EDGE) and sb.kind == BOX:
        u, way = crown_over_face(sa, a, sb, b, c)
        add_moment_stiffness(w, a, b, cross(load(c.normal), u), scale(square * way, cross(force_of(c), u)))


def unknowns_of_both(a, b):
    """Return `unknowns_of` two bodies; if these are of one tree, B has none."""
    of_b = unknowns_of(b)
    return unknowns_of(a), of_b if a.unknown != b.unknown else (of_b[0], of_b[0])


def add_moment_stiffness(w, a, b, axis, moment):
    """Add to H a moment on B that grows with the angle of A over B about an axis across the normal.

    moment: its slope with the angle, times b^2.
    """
    if dot(moment, moment) == 0.0:
        return
    eq = equations_of(w)
    row, column = eq.about, eq.along_n
    of_a, of_b = unknowns_of_both(a, b)
    for one, about in ((row, axis), (column, moment)):
        for start, end in (of_a, of_b):
            clear(one[start:end])
        add_opposite_forces(a, b, ZERO, about, scale(-1.0, about), one)
    for start, end in (of_a, of_b):
        for i in entries(start, end):
            for begin, stop in (of_a, of_b):
                for j in entries(begin, stop if column[i] != 0.0 else begin):
                    eq.h[i, j] += column[i] * row[j]


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


@jit_inline
def add_opposite_forces(a, b, force, about_a, about_b, row):
    """Add J^T of a force on A, the opposite one on B, and moments about their centres of mass to a row."""
    add_generalised_force(a, force, about_a, row)
    add_generalised_force(b, scale(-1.0, force), about_b, row)


@jit_inline
def add_generalised_force(b, force, moment, row):
    """Add J^T (p, m) to a row: a force p on a body and a moment m about its centre of mass."""
    o = b.unknown
    if o < 0:
        return
    if b.tree != 0:
        t = tree_at(b.tree, 0)
        x = vector(t.x, t.v_size)
        clear(x)
        call_with_vectors(t.add_force, b, force, moment)
        for i in range(t.v_size):
            row[o + i] += x[i]
        return
    for i in range(3):
        row[o + i] += force[i]
        row[o + 3 + i] += moment[i]


jit_module(__name__)
