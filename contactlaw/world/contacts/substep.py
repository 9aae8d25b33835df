"""A closed contact through a substep: its overlap, frame, force and work, and the impulses on its bodies."""

from contactlaw.jit import jit_inline, jit_module
from contactlaw.laws.record import LASTING
from contactlaw.world.bodies.motion import kick, moved_at
from contactlaw.world.contacts import force, leapfrog
from contactlaw.world.contacts.meeting import meet_closed, update_ellipse
from contactlaw.world.contacts.pace import MASS_TURN, update_masses
from contactlaw.world.data.access import body_at, near_at, pair_at
from contactlaw.world.data.call import address, call_roll, ready
from contactlaw.world.data.demand import ROLL
from contactlaw.world.data.materials import law_of
from contactlaw.world.data.quaternion import rotate
from contactlaw.world.data.vec import ZERO, add, axpy, cross, dot, load, norm, scale, store, sub

# [rad] up to which the tangent turns by the first term of the series x, and is normalised by that of a root: its square
# is then 1 - 3/4 x^4
SMALL_TURN = 1e-3
# least s of `leapfrog.single_end` as a damped force ends: the correction is at most 3.7 substeps of the force before it
SUDDEN = 0.02
# share of a substep for which an impact may have been under way and yet begins at its end: what `leapfrog` adds for a
# damper grows out of a force that is nearly zero there, and is lost if the step ends with this substep
BARELY = 1e-3
JUMP_SHARE = 0.1  # of a way, by which an overlap may grow more than by the motion along the normal; see `jump_of`
TOUCHING = 1e-10  # overlap or gap that counts as zero, over the effective radius


def turn_frame(c, n, twist):
    """Turn a contact's frame to normal n: the tangent turns with it without twist, then by `twist` [rad] about it."""
    old = load(c.normal)
    if twist == 0.0 and n == old:
        return
    e = load(c.tangent)
    e = axpy(-dot(e, n) / max(1.0 + dot(n, old), 1e-300), add(n, old), e)
    e = axpy(twist, cross(n, e), e) if abs(twist) < SMALL_TURN else rotate(scale(twist, n), e)
    e = axpy(-dot(e, n), n, e)
    store(c.tangent, scale(1.5 - 0.5 * dot(e, e), e))
    store(c.normal, n)


def is_placed(w, a, b):
    """Return whether the overlap of two bodies may be as the user has made it since the last step."""
    return a.placed + b.placed != 0 or w.edited != 0


def jump_of(c, overlap, normals, moved, way):
    """Return by how much [m] the overlap has grown without motion, where a contact jumps to another place.

    That counts as initial overlap: the elastic energy, which depends on the rest alone, grows by no more than the work
    of the motion. The overlap of a place that lasts grows by the motion along a normal between its last and its new
    one, up to errors of third order in `moved` [m], the motion of the points that touched, and `way`, of the centres.
    """
    jump = overlap - c.initial_overlap - max(c.touch.overlap, 0.0) + min(dot(moved, normals[0]), dot(moved, normals[1]))
    if jump <= TOUCHING * c.touch.radius:
        return 0.0
    return jump if jump > JUMP_SHARE * (norm(moved) + norm(way)) else 0.0


def measure(w, c, a, b):
    """Update overlap, frame, arms and displacement of a contact after its bodies have moved.

    Callers do so with all contacts before they `advance` one: each would wait for the divisions of the law before it.
    """
    overlap, n, arm_a, arm_b = meet_closed(w, c, a, b)
    t, old = c.touch, load(c.normal)
    mean_a, mean_b = scale(0.5, add(arm_a, load(c.arm_a))), scale(0.5, add(arm_b, load(c.arm_b)))
    moved = sub(moved_at(a, mean_a), moved_at(b, mean_b))
    turn_frame(c, n, 0.5 * dot(add(load(a.twist), load(b.twist)), n))
    store(c.arm_a, arm_a)
    store(c.arm_b, arm_b)
    if n != old and dot(n, old) < 1.0 - 0.5 * MASS_TURN * MASS_TURN:
        update_masses(c, a, b)
    e = load(c.tangent)
    f = cross(n, e)
    store(c.moved, (dot(moved, e), dot(moved, f), force.twist_of(c, a, b)))
    jump = jump_of(c, overlap, (old, n), moved, sub(load(a.shift), load(b.shift)))
    if jump > 0.0 and not is_placed(w, a, b):
        c.initial_overlap, c.appeared = c.initial_overlap + jump, 1
    near_at(w.near, c.near).initial_overlap = c.initial_overlap
    resists, rolled = law_of(w, pair_at(w.pairs, c.pair)).rolling != 0.0, sub(load(a.twist), load(b.twist))
    creeps = c.torsion.span > 0.0 or c.moved[2] != 0.0 or (t.course == LASTING and rolled != ZERO)
    oblong = update_ellipse(w, c, a, b) if resists or creeps else 0.0
    if resists:
        axis = load(c.axis)
        c.rolled[0], c.rolled[1] = dot(rolled, axis), dot(rolled, cross(n, axis))
    store(c.passed, force.passed_by(c, oblong, rolled) if creeps and t.mu > 0.0 else ZERO)
    t.before = t.overlap
    t.overlap = overlap - c.initial_overlap


def advance(w, c, slot, span):
    """Update the force and the end weight of the contact in a slot, after `measure`.

    span: lengths [s] of this substep and of the next. The work of the last kick goes on in this substep.
    """
    h, following = span
    t, moved = c.touch, load(c.moved)
    a, b = body_at(w.bodies, c.body_a), body_at(w.bodies, c.body_b)
    before, overlap = t.before, t.overlap
    pushed = t.force, t.f, t.g
    add_work(c, c.later / h, pushed)
    c.end_weight, c.later = 0.0, 0.0
    law = law_of(w, pair_at(w.pairs, c.pair))
    linear = law.linear != 0.0
    if before < 0.0 < overlap < BARELY * (overlap - before):
        return
    if overlap <= 0.0:
        if before > 0.0 and t.zeta == 0.0 and c.interval > 0.0:
            c.end_weight = leapfrog.elastic_end(before / (before - overlap), linear)
            store(c.force, force_of(c))
        return
    closing = (overlap - before) * (1.0 / h)  # products by quotients that are known before the overlap is
    own = t.force / t.mass
    if c.interval > 0.0:
        c.closing_acceleration = (closing - t.closing) * (2.0 / (h + c.interval))
    else:
        c.closing_acceleration = -dot(sub(load(a.acceleration), load(b.acceleration)), load(c.normal)) - own
    t.closing = closing
    opening = t.force == 0.0 and c.interval == 0.0
    total = moved
    if c.coasted_from > 0.0:
        total, t.before = add(moved, load(c.coasted)), c.coasted_from
        t.f, t.g = c.coasted_f, c.coasted_g
    others = leapfrog.closing_by_others(c, a, b)
    count = leapfrog.side_by_side(a, b)
    weight = leapfrog.damper_weight(c, a, b, count) if t.zeta > 0.0 and count > 1 else 1.0
    motion = others, count, leapfrog.SHARE * h * h * (others - c.spring / t.mass), weight
    pressed = force.advance_contact(w, c, slot, total, scale(1.0 / h, moved), h, motion)
    c.coasted_from, t.before = 0.0, before
    if opening:
        inside = min(overlap / (overlap - min(before, 0.0)), 1.0)
        spacing = max(following, inside * h)  # of the points of the sum that begins here
        inside *= h / spacing
        end = leapfrog.elastic_end(inside, linear)
        if t.zeta > 0.0 and t.ratio > 1.0:
            single = leapfrog.single_end(inside, linear) / t.ratio
            end = leapfrog.damped_end(inside, linear) * (1.0 - 1.0 / t.ratio) + single
        time, most = spacing * (1.0 + end), max(closing, 0.0) * t.mass * weight * weight
        if time * (t.force - t.elastic) > most:  # by a damper alone bodies stop, and do not turn back
            part, time = max(t.elastic, most / h) / t.force, h
            t.force, t.f, t.g = part * t.force, part * t.f, part * t.g
        c.end_weight = (time - 0.5 * (h + following)) / h
    if pressed < 0.0 and own > 0.0:  # the force has ended within the substep
        weight = leapfrog.single_end(max(pushed[0] / (pushed[0] - pressed), SUDDEN), True)
        store(c.force, in_frame(c, *pushed))  # at its present arms it would turn round bodies in its earlier direction
        apply_force(c, a, b, weight * h)
        add_work(c, weight, pushed)
    store(c.force, force_of(c))
    c.interval = h
    if law.rolling != 0.0 and ready(w, ROLL):
        call_roll(address(w, ROLL), w, c, (c.rolled[0] / h, c.rolled[1] / h))
    c.deepest = max(c.deepest, overlap)
    c.strongest = max(c.strongest, t.force)
    if t.force > 0.0:
        c.duration += h


def kick_pair(c, a, b, span):
    """Kick both bodies of a contact at the end of a substep.

    The force acts for half of this substep and half of the next, of lengths `span` [s], and for what `leapfrog` adds;
    where the shapes no longer overlap for that alone. Half of a kick works at the speed before it, half at that after,
    in the next substep: so the sum of all work is what bodies gain.
    """
    (h, next_h), t = span, c.touch
    time = c.end_weight * h + (0.5 * (h + next_h) if t.overlap > 0.0 else 0.0)
    c.later = 0.5 * time if next_h > 0.0 and t.overlap > 0.0 else 0.0
    add_work(c, (time - c.later) / h, (t.force, t.f, t.g))
    apply_force(c, a, b, time)


def add_work(c, share, pushed):
    """Add the work of a share of a contact's force and moments in the last substep to its ledger.

    pushed: P, and friction along both tangents on B [N].
    """
    p, f, g = pushed
    du, dv, angle = load(c.moved)
    c.normal_work -= share * p * (c.touch.overlap - c.touch.before)
    c.friction_work -= share * (f * du + g * dv + c.torsion.moment * angle)
    c.friction_work -= share * (c.bending[0] * c.rolled[0] + c.bending[1] * c.rolled[1])


def force_of(c):
    """Return the force on A [N], in the contact's present frame."""
    return in_frame(c, c.touch.force, c.touch.f, c.touch.g)


def in_frame(c, p, f, g):
    """Return the force on A [N] of which a contact has these components: P, and friction along both tangents on B."""
    n, e = load(c.normal), load(c.tangent)
    return axpy(p, n, axpy(-f, e, scale(-g, cross(n, e))))


def apply_force(c, a, b, time):
    """Apply the force and moment of a contact to both bodies for a time [s], equal and opposite, at one point."""
    impulse = scale(time, load(c.force))
    a.touched = 1
    b.touched = 1
    about_a, about_b = cross(load(c.arm_a), impulse), cross(impulse, load(c.arm_b))
    if c.torsion.moment != 0.0 or c.bending[0] != 0.0 or c.bending[1] != 0.0:
        moment = scale(time, force.moment_of(c))
        about_a, about_b = sub(about_a, moment), add(about_b, moment)
    kick(a, impulse, about_a)
    kick(b, scale(-1.0, impulse), about_b)
    store(c.impulse, add(load(c.impulse), impulse))


jit_module(__name__, jit_inline)
