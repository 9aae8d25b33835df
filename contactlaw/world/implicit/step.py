"""Implicit steps of islands of persistent contacts, in which nothing strikes.

The step of an engine is far too long for the vibrations of contacts that carry a load, and these do not matter. The
velocities V of the bodies at the end of a stage of b seconds satisfy

    M (V - v) = b (M a + J^T F(X, V))        X = x + b V

with the contact forces F where the bodies are then. Two such stages, b = (1 - 1/sqrt 2) h, make a step of second order
that damps what is stiff (Alexander, SIAM J. Numer. Anal. 14 (1977), the method S2): bodies that slide or roll under a
constant load move correctly, vibrations decay. Newton's method solves a stage; it keeps the factors of its matrix while
it converges well, and each iteration conserves momentum. If it does not converge, nothing is changed.

The error of a step is of third order: where a body rocks, steps lose energy and gain as much in the other half of its
way. What the motion has lost beyond the work of contacts is a credit of the island, kept by its contacts. A step that
gains more than it is not accepted: no energy can grow beyond what was there, and friction's work is not given back.

In trees the second stage has the mass matrix, springs, gravity and centripetal terms of the place to which h/2 V would
take the tree, V the velocities of the first stage. A vibration of rate omega then keeps its energy: if V has a share c
of the acceleration times h, the map from the start to the end of the step has the determinant
1 + (omega h)^4 ((1 - 2 g)/4 - c (1 - g)/2), and c = g = b/h makes it 1. Forces of the start would add (omega h)^2/2 of
the energy in a step. One stage b = h keeps it too; it takes half the time, and serves unless a contact slides or turns.
Springs with omega h > 2, for which both are unstable, act by where they are at the end of a stage, as limits do, and
decay.
"""

from math import isfinite, sqrt

from contactlaw.jit import jit_module
from contactlaw.memory import copy_wholes, whole_at
from contactlaw.world import window
from contactlaw.world.bodies.motion import angular_momentum, settle, spin_rate, update_momentum
from contactlaw.world.contacts.leapfrog import UNKNOWN
from contactlaw.world.contacts.meeting import forget_place
from contactlaw.world.contacts.substep import add_work, force_of
from contactlaw.world.contacts.touch import end_contact
from contactlaw.world.data.access import body_at, contact_at, near_at, row_at, tree_at
from contactlaw.world.data.call import call_with_body
from contactlaw.world.data.quaternion import conjugate, load4, product, rotation_vector, store4
from contactlaw.world.data.records import AGED, NEVER, PAUSE_LIMIT
from contactlaw.world.data.saved import restore_body, restore_contact, save_body, save_contact, saved_body
from contactlaw.world.data.vec import ZERO, add, axpy, cross, dot, load, norm, scale, store, sub
from contactlaw.world.implicit import candidates, newton
from contactlaw.world.implicit.acceptance import ENERGY_GAIN, changes_regime, energy, is_persistent, motion_of
from contactlaw.world.implicit.equations import equations_of, factorise, substitute
from contactlaw.world.sleep import fall_asleep, wake
from contactlaw.world.trees.kinematics import vector
from contactlaw.world.trees.mobility import copy

GAMMA = 1.0 - sqrt(0.5)  # length of a stage, as a share of the step
MAX_ITERATIONS = 25  # of Newton's method in a stage
# Iterations in a stage that leave more than so much of the residual; stages that reach this hardly ever converge
MAX_STALLS, STALL = 3, 0.5
CONTRACTION = 0.1  # ratio of successive residuals up to which the factors of the matrix are kept
# Share of the first residual of a stage that may be left in a steady slide, see `solve`: velocities of boxes and balls
# then differ from those by converged stages by at most 5 % of what these differ from those in short steps
LEFT = 1e-3


def take_implicit_steps(w):
    """Take islands of persistent contacts through the step, each by one implicit step.

    Returns whether bodies have moved, or near pairs were listed anew: then times of impact must be predicted again.
    """
    lists, some = w.lists, False
    for _ in range(2):
        while candidates.activate(w) and wake(w, 0.0, True):
            pass
        if w.age != AGED or not candidates.is_any_thrown(w):
            break
        window.list_anew(w, 1)
        window.predict_all(w, 0.0, w.step)
    window.list_islands(w)
    for k in range(w.islands):
        root = whole_at(w.roots, k)
        bodies = window.list_bodies(w, root)
        pairs = window.list_pairs(w, root)
        if is_due(w, bodies) and is_persistent(w, bodies, pairs) and take_step(w, bodies, pairs):
            fall_asleep(w, bodies, pairs)
            some = True
    return some or w.lists != lists


def is_due(w, bodies):
    """Return whether to try an implicit step with an island, and count down its pauses after failures to converge."""
    now = True
    for i in range(bodies):
        b = body_at(w.bodies, whole_at(w.island_bodies, i))
        if b.pause > 0:
            b.pause -= 1
            now = False
    return now


def take_step(w, bodies, pairs):
    """Take one implicit step with an island; return whether it was accepted. If not, all is as before."""
    begin_step(w, bodies, pairs)
    stages, slides = motion_of(w, bodies, pairs)
    stage = GAMMA * w.step if stages == 2 else w.step
    motion, stored, size, credit = energy(w, bodies, pairs)
    solved = solve_stages(w, bodies, pairs, stage, slides)
    accepted = solved and candidates.stayed_within(w, bodies) and not changes_regime(w, pairs)
    if accepted:
        now, stored_now, size, _ = energy(w, bodies, pairs)
        accepted = now + stored_now - motion - stored <= ENERGY_GAIN * size + credit
        credit += motion - now
    if accepted:
        add_impulses(w, pairs, stage)
        w.implicit += 1
    for i in range(bodies):
        finish_body(w, whole_at(w.island_bodies, i), solved, accepted)
    closed = 0
    for i in range(pairs):
        closed += row_at(w.rows, i).slot >= 0
        credit += finish_contact(w, row_at(w.rows, i), accepted)
    for i in range(pairs if accepted and size < NEVER else 0):
        slot = row_at(w.rows, i).slot
        if slot >= 0:
            contact_at(w.contacts, slot).credit = max(credit, 0.0) / closed
    return accepted


def solve_stages(w, bodies, pairs, stage, slides):
    """Solve one stage if `stage` [s] is the whole step, else two; return whether Newton's method converged.

    slides: as `acceptance.motion_of` returns it.
    """
    begin_stage(w, bodies, stage, 0.0)
    before = w.solved
    if not solve(w, bodies, pairs, (stage, stage), 0.0, slides):
        return False
    if stage == w.step:
        return True
    add_impulses(w, pairs, w.step - stage)
    begin_stage(w, bodies, stage, w.step - stage)
    if not slides:
        extrapolate(w, bodies, (w.step - stage) / stage)
    return solve(w, bodies, pairs, (stage, w.step), NEVER if w.solved > before else 0.0, slides)


def extrapolate(w, bodies, ratio):
    """Let velocities of free bodies change on as in the first stage, `ratio` times as much: the second begins there.

    What rolls or turns begins near where it ends. Not in a steady slide, of which one iteration of the first stage has
    left an error, nor in trees: robots would take a tenth more factorisations.
    """
    eq = equations_of(w)
    for i in range(bodies):
        b = body_at(w.bodies, whole_at(w.island_bodies, i))
        if b.tree == 0 and b.unknown >= 0:
            for j in range(b.unknown, b.unknown + 6):
                eq.velocity[j] += ratio * (eq.velocity[j] - eq.begun[j])


def finish_body(w, k, solved, accepted):
    """Leave body k as it is at the end of an accepted step, or restore it.

    Each step that was not solved is followed by a pause of about twice as many steps as the one before.
    """
    b = body_at(w.bodies, k)
    pause = 0 if solved else min(2 * b.last_pause + 1, PAUSE_LIMIT - 1)
    if accepted:
        b.time = w.step
        b.done = 1
        b.touched = 1
        b.changed = 1
        update_momentum(b)
    else:
        restore_body(w, k)
    b.pause, b.last_pause = pause, pause
    if b.tree != 0 and b.member == 0:
        if not accepted:
            t = tree_at(b.tree, 0)
            copy_wholes(t.start, t.q, t.q_size + t.v_size)
            t.stale = 1
        settle(b)


def begin_step(w, bodies, pairs):
    """Save the bodies and contacts at the start of the step, fill the vectors of unknowns, and begin the rows."""
    eq = equations_of(w)
    for i in range(bodies):
        k = whole_at(w.island_bodies, i)
        save_body(w, k)
        b = body_at(w.bodies, k)
        v, a = eq.begun[b.unknown :], eq.acceleration[b.unknown :]
        if b.tree != 0:
            if b.member == 0:
                t = tree_at(b.tree, 0)
                copy_wholes(t.q, t.start, t.q_size + t.v_size)  # v follows q
                copy(vector(t.v, t.v_size), v)
                copy(vector(t.a, t.v_size), a)
        elif b.unknown >= 0:
            store(v, load(b.velocity))
            store(v[3:], load(b.spin))
            store(a, load(b.acceleration))
            store(a[3:], spin_rate(b, load(b.spin)))
    copy(eq.begun[: w.unknowns], eq.velocity)
    for i in range(pairs):
        r = row_at(w.rows, i)
        r.near = whole_at(w.island_pairs, i)
        p = near_at(w.near, r.near)
        r.slot, r.fresh = p.slot if p.closed != 0 else -1, 0
        store(r.push, ZERO)
        store(r.impulse, ZERO)
        if r.slot >= 0:
            save_contact(w, r.slot)


def begin_stage(w, bodies, stage, before):
    """Set `free` and `moved` of a stage [s].

    before: time [s] for which bodies have moved with the velocities of the previous stage, under its forces. Bodies
    whose moment of inertia depends on the axis turn as their angular momentum has it: a gyroscopic moment that is held
    from the start of the step would give a top energy.
    """
    eq = equations_of(w)
    for i in range(w.unknowns):
        eq.moved[i] = before * eq.velocity[i]
        eq.free[i] = eq.begun[i] + before / stage * (eq.velocity[i] - eq.begun[i]) + stage * eq.acceleration[i]
    for i in range(bodies):
        k = whole_at(w.island_bodies, i)
        b = body_at(w.bodies, k)
        if b.tree != 0 and b.member == 0 and before > 0.0:
            t = tree_at(b.tree, 0)
            x, v = vector(t.x, t.v_size), vector(t.v, t.v_size)
            for i in range(t.v_size):
                j = b.unknown + i
                v[i], x[i] = eq.velocity[j], eq.free[j] - (before + stage) * eq.acceleration[j] - eq.begun[j]
            call_with_body(t.take_middle, b)
            for i in range(t.v_size):
                eq.free[b.unknown + i] = eq.begun[b.unknown + i] + x[i]
        if b.tree == 0 and b.unknown >= 0 and b.isotropic == 0:
            start = load(saved_body(w, k).momentum)
            gained = sub(angular_momentum(b, load(eq.velocity[b.unknown + 3 :])), start)
            own = axpy(stage, load(b.torque), axpy(before / stage, gained, start))
            store(eq.free[b.unknown + 3 :], own)


def solve(w, bodies, pairs, span, previous, slides):
    """Solve a stage for the velocities and place the bodies at its end; return whether Newton's method converged.

    span: length of the stage [s], and time of its end from the start of the step. previous: residual before; NEVER:
    begin with the factors of the first stage, 0.0: that has not factorised. Of the first of two stages only these are
    needed: the contacts are not evaluated once more if, by the contraction of the last two residuals or of new factors,
    the next one is within the tolerance.

    slides: whether this is a steady slide. The first residual is then that of vibrations about it, which the stages
    damp at a rate that is not theirs: LEFT of it may remain, and the first stage takes one iteration. No error adds up:
    an iteration conserves momentum, and takes mu times the normal impulse from the slide, as slopes of friction are mu
    times those of P. Only if overlaps are kept: what an iteration leaves grows with the square of its way, and the next
    step carries it on by the square of a stage over the vibrations' time, so that from far they would grow.
    """
    stage, time = span
    eq, stalls = equations_of(w), 0
    begun, once = 0.0, False
    for iteration in range(MAX_ITERATIONS):
        for i in range(bodies):
            place_body(w, whole_at(w.island_bodies, i), stage, time)
        newton.begin_residual(w, bodies, stage)
        moving, tolerance = iteration == 0, NEVER
        for i in range(pairs):
            moved, own = newton.evaluate_contact(w, row_at(w.rows, i), span, iteration)
            moving, tolerance = moved or moving, min(tolerance, own)
        residual = newton.residual_speed(w, bodies)
        near = tolerance >= 0.0
        if iteration == 0 and slides and near:
            begun, once = LEFT * residual, time < w.step
        if not moving or (not once and residual <= max(tolerance, begun) < NEVER):
            return True
        stalls += iteration > 0 and not residual < STALL * previous
        if stalls == MAX_STALLS:
            return False
        new = not (near and residual < CONTRACTION * previous)
        contraction = CONTRACTION if new else residual / previous
        if new:
            newton.begin_matrix(w, bodies)
            for i in range(pairs):
                newton.add_stiffness(w, row_at(w.rows, i), stage)
            factorise(w)
            w.solved += 1
        converges = once or (time < w.step and contraction * residual <= tolerance < NEVER)
        previous = residual
        substitute(w)
        total = 0.0
        for i in range(w.unknowns):
            eq.velocity[i] += eq.right[i]
            total += abs(eq.velocity[i])
        if converges or not isfinite(total):
            return isfinite(total)
    return False


def place_body(w, k, stage, time):
    """Place body k where its velocity takes it by the end of the stage, `time` [s] after the start of the step."""
    b, start = body_at(w.bodies, k), saved_body(w, k)
    eq = equations_of(w)
    velocity, before = eq.velocity[b.unknown :], eq.moved[b.unknown :]
    if b.tree != 0:
        if b.member == 0:
            t = tree_at(b.tree, 0)
            v, x = vector(t.v, t.v_size), vector(t.x, t.v_size)
            for i in range(t.v_size):
                v[i] = velocity[i]
                x[i] = before[i] + stage * v[i]
            call_with_body(t.move_from_start, b)
        store(b.shift, sub(load(b.position), load(start.position)))
        store(b.twist, rotation_vector(product(load4(b.quaternion), conjugate(load4(start.quaternion)))))
        turned = norm(load(b.twist))
        b.turned, b.path = start.turned + turned, norm(load(b.shift)) + turned * b.reach
        return
    if b.unknown >= 0:
        store(b.velocity, load(velocity))
        store(b.spin, load(velocity[3:]))
        store(b.shift, axpy(stage, load(velocity), load(before)))
        store(b.twist, axpy(stage, load(velocity[3:]), load(before[3:])))
    else:
        store(b.shift, scale(time, load(b.velocity)))
        store(b.twist, scale(time, load(b.spin)))
    b.path = norm(load(b.shift)) + norm(load(b.twist)) * b.reach
    store(b.position, add(load(start.position), load(b.shift)))
    store4(b.quaternion, load4(start.quaternion))
    b.turned = start.turned
    store(b.pending_turn, load(b.twist))
    settle(b)


def add_impulses(w, pairs, time):
    """Add the impulses of contact forces that act for a time [s] to the rows."""
    for i in range(pairs):
        r = row_at(w.rows, i)
        if r.slot >= 0:
            c = contact_at(w.contacts, r.slot)
            store(r.push, axpy(time * c.touch.force, load(c.normal), load(r.push)))
            store(r.impulse, axpy(time, force_of(c), load(r.impulse)))


def finish_contact(w, r, accepted):
    """Leave the contact of a row as it is at the end of an accepted step, or restore it; return its work [J]."""
    p = near_at(w.near, r.near)
    if not accepted:
        if r.slot >= 0:
            restore_contact(w, r.slot)
        forget_place(w, p)
    if r.slot < 0:
        return 0.0
    c = contact_at(w.contacts, r.slot)
    t, before = c.touch, c.normal_work + c.friction_work
    if accepted:
        n, e = load(c.normal), load(c.tangent)
        push = scale(1.0 / w.step, load(r.push))  # means: by forces at the end, a load that shifts would work too much
        pull = axpy(-1.0 / w.step, load(r.impulse), push)  # what pushed before the normal turned is not friction
        add_work(c, 1.0, (dot(push, n), dot(pull, e), dot(pull, cross(n, e))))
        store(c.impulse, add(load(c.impulse), load(r.impulse)))
        store(c.force, force_of(c))
        t.closing = (t.overlap - t.before) / w.step
        c.interval, c.closing_acceleration, c.end_weight, c.neighbours = w.step, 0.0, 0.0, UNKNOWN
        c.deepest = max(c.deepest, t.overlap)
        c.strongest = max(c.strongest, t.force)
        c.duration += w.step
    if t.overlap <= 0.0 or (r.fresh != 0 and not accepted):
        c.touches -= r.fresh
        end_contact(p, c)
    return c.normal_work + c.friction_work - before


jit_module(__name__)
