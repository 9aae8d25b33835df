"""Corrections that make the leapfrog of contacts exact to high order: where springs act, and both ends of an impact.

Leapfrog steps of h follow x'' + h^2/12 x'''' = F/m. If the force F(y) is that of the place y = x + h^2/12 x'', then
y'' = F(y)/m up to h^4 (Numerov 1924; with x'' by the forces at x, as here: Takahashi & Imada 1984). x and y are the
same before and after an impact. Where bodies touch several others, x'' is by all of their springs.

A damper acts with the mean velocity of two steps, y' (1 - h^2 k/(12 m)) for a spring k, while the spring lags behind y
by h^2/12 of the acceleration by the damper: both errors cancel.

At both ends of an impact the force grows as a power p of time, and the first or last point of its sum lies s substeps,
0 < s <= 1, inside the impact. The sum then exceeds the integral by zeta(-p, s) times the force after one substep
(Euler-Maclaurin with Hurwitz's zeta function). The force at the first or last point is s^p times that, so that its
weight, one substep, must change by -zeta(-p, s)/s^p substeps. p = 3/2 for the elastic force of Hertz, 1/4 for its
damper at the touch; for a linear spring 1 and 0.
"""

from math import sqrt

from contactlaw.jit import jit_inline, jit_module
from contactlaw.laws.hertz import elastic_force
from contactlaw.laws.record import OPEN
from contactlaw.world.bodies.motion import load_at, spin_change, turning_of
from contactlaw.world.data.access import body_at, coasting_at, pair_at, tree_at
from contactlaw.world.data.materials import law_of
from contactlaw.world.data.vec import ZERO, add, axpy, cross, dot, load, norm, scale, store, sub

SHARE = 1.0 / 12.0  # of h^2 x''
MOST = 1e6  # of U over U_i: beyond, the damper of a contact is next to nothing beside those of others
UNKNOWN = -1e300  # value of `CONTACT.neighbours` where the substep before has not found it
AT_ONE = 1.0 / 12.0, 0.025485202  # -zeta(-p, 1) of elastic forces, linear and of Hertz
# (zeta(-3/2, 1 + s) - zeta(-3/2))/s and zeta(-1/4, 1 + s) in powers of s on (0, 1], to 4e-5 and 1e-4
ELASTIC_END = (-0.31178923, -0.5489945, -0.15573116, 0.01654819)
DAMPED_END = (-0.32035357, -0.86369735, -0.16467251, 0.02834923)


def is_rigid(b):
    """Return whether a body answers to forces by itself: one without joints, or the only one of a tree that is free."""
    return b.tree == 0 or (tree_at(b.tree, 0).rigid != 0 and tree_at(b.tree, 0).limited == 0)


def clear_push(b):
    """Set what pushes a body to its loads besides contacts, which are counted anew."""
    b.pressing = 0
    store(b.push, load(b.acceleration))
    if b.oriented != 0:
        store(b.twisting, turning_of(b))
        store(b.storing, ZERO)
        store(b.storing_turn, ZERO)


def add_push(b, arm, force, overlap):
    """Add a spring's force [N] on a body at an arm [m] to those of this substep; arms of round bodies are along it."""
    if b.inverse_mass == 0.0:
        return
    store(b.push, axpy(b.inverse_mass, force, load(b.push)))
    if b.oriented != 0:
        turn = spin_change(b, cross(arm, force))
        store(b.twisting, add(load(b.twisting), turn))
        store(b.storing, axpy(overlap * b.inverse_mass, force, load(b.storing)))
        store(b.storing_turn, axpy(overlap, turn, load(b.storing_turn)))


def push_at(b, arm):
    """Return the acceleration [m/s^2] by loads and springs of a body's point at an arm [m]."""
    if b.inverse_mass == 0.0:
        return ZERO
    return load(b.push) if b.oriented == 0 else add(load(b.push), cross(load(b.twisting), arm))


def storing_at(b, arm, overlap):
    """Return the share of springs in that, each times its overlap [m]; a ball's are all taken to have this overlap."""
    if b.inverse_mass == 0.0:
        return ZERO
    if b.oriented == 0:
        return scale(overlap, sub(load(b.push), load(b.acceleration)))
    return add(load(b.storing), cross(load(b.storing_turn), arm))


def press_spring(w, c, a, b):
    """Set the force of a contact's spring where its bodies are, add it to what pushes them, and count it there.

    Bodies on joints answer to it with all of their tree: their contacts know their own springs only.
    """
    t, n, linear = c.touch, load(c.normal), law_of(w, pair_at(w.pairs, c.pair)).linear != 0.0
    c.spring = 0.0
    if t.overlap > 0.0 and not (linear and t.state == OPEN):  # whose stiffness is known after the touch
        c.spring = elastic_force(t, linear, t.overlap)
    a.pressing += 1
    b.pressing += 1
    if is_rigid(a) and is_rigid(b):
        add_push(a, load(c.arm_a), scale(c.spring, n), t.overlap)
        add_push(b, load(c.arm_b), scale(-c.spring, n), t.overlap)


def push_by_coasting(w, coasting):
    """Add the forces of coasting contacts, at the end of the substep before, to those on their bodies; count them."""
    for i in range(coasting):
        r = coasting_at(w.coasting, i)
        a, b, n = body_at(r.body_a, 0), body_at(r.body_b, 0), load(r.normal)
        store(a.push, axpy(r.force * a.inverse_mass, n, load(a.push)))
        store(b.push, axpy(-r.force * b.inverse_mass, n, load(b.push)))
        a.pressing += 1
        b.pressing += 1


def is_turned(b):
    """Return whether contacts turn a body: one that moves and is no ball."""
    return b.oriented != 0 and b.inverse_mass != 0.0


def side_by_side(a, b):
    """Return how many contacts press the more pressed of two bodies, of those that move: their dampers share a mass."""
    return max(a.pressing if a.still == 0 else 1, b.pressing if b.still == 0 else 1, 1)


def damper_weight(c, a, b, count):
    """Return the factor of the damper of one of `count` contacts that press a body side by side.

    The damper of a single contact belongs to its effective mass m. On any spring of force F that stores U a damper of 2
    zeta F sqrt(M/(2 U)) gives a mass M the restitution of zeta: with y = sqrt(2 U/M), and a time in which y changes by
    the velocity, that is the damped oscillator (Antypov & Elliott 2011 for Hertz's). A body that lands on several
    points has the sum of their forces and of what they store; if each damper has the share of its own force, its factor
    is sqrt(M U_i/(m U)). Such a body rebounds as its pair of materials says, flat or on an edge, however unequal its
    contacts are and whenever they begin. U/M is at each contact what the body's point would be accelerated by if every
    spring had U_i for its force. M is taken as at most the mass of both bodies without their turning, which forces from
    opposite sides would exceed.

    What hardly presses would have next to no damper beside what presses hard, and rock for long under a load: U is
    taken as at most `count` U_i, or as many as springs push harder than loads. In trees, U/M over U_i is that of the
    forces, as the last substep had them, M at most m. Until springs are known, as linear ones at the touch, U is
    `count` U_i. Not for balls, whose contacts are few along one line.
    """
    t, n, arm_a, arm_b = c.touch, load(c.normal), load(c.arm_a), load(c.arm_b)
    if not is_turned(a) and not is_turned(b):
        return 1.0
    loads = sub(load_at(a, arm_a), load_at(b, arm_b))
    if is_rigid(a) and is_rigid(b):  # U_i is 0.4 times the force and the overlap, in all contacts alike
        own = c.spring * t.overlap / t.mass
        springs = dot(sub(sub(push_at(a, arm_a), push_at(b, arm_b)), loads), n)
        all_of_them = dot(sub(storing_at(a, arm_a, t.overlap), storing_at(b, arm_b, t.overlap)), n)
        least = t.mass * (a.inverse_mass + b.inverse_mass) / t.share
    else:
        own, springs, least = t.force / t.mass, -c.closing_acceleration - dot(loads, n), 1.0
        all_of_them = springs
    most, still = 1.0 * count, norm(loads)
    if springs > most * still:
        most = min(springs / still, MOST)
    return 1.0 / sqrt(min(max(all_of_them / own, least), most) if own > 0.0 else least * count)


def closing_by_others(c, a, b):
    """Return the closing acceleration [m/s^2] of a contact by all but itself, at the end of a substep.

    That is the mean one of the last two substeps, at their middle, and what other springs have changed since.
    """
    t = c.touch
    out = c.closing_acceleration + t.force / t.mass
    if is_rigid(a) and is_rigid(b):
        pushes = sub(push_at(a, load(c.arm_a)), push_at(b, load(c.arm_b)))
        springs = c.spring / t.mass - dot(pushes, load(c.normal))
        if c.interval == 0.0:
            out = springs
        elif c.neighbours > UNKNOWN:
            out += springs - c.neighbours
        c.neighbours = springs
    return out


def cubic(a, s):
    """Return the cubic polynomial of s with the coefficients a, lowest first."""
    return a[0] + s * (a[1] + s * (a[2] + s * a[3]))


def elastic_end(s, linear):
    """Return the correction [substeps] of the weight of the elastic force at the first or last point of an impact.

    That for s = 1 is left out: -(zeta(-p, s) - zeta(-p))/s^p. An impact that begins at the end of a substep needs no
    correction then and stays symmetric in time.
    """
    if linear:
        return 0.5 * (s - 1.0)
    s = max(s, 1e-6)
    return -(1.0 + cubic(ELASTIC_END, s) / sqrt(s))


def single_end(s, linear):
    """Return the whole correction [substeps], -zeta(-p, s)/s^p, of an elastic force that a damper lets end otherwise.

    With linear, also that of a damped force as it falls to zero while the shapes still overlap.
    """
    return elastic_end(s, linear) + (AT_ONE[0] / s if linear else AT_ONE[1] / (s * sqrt(s)))


def damped_end(s, linear):
    """Return the correction [substeps] of the weight of the damper's force at the first point: -zeta(-p, s)/s^p."""
    if linear:
        return s - 0.5
    s = max(s, 1e-6)
    return -(1.0 + cubic(DAMPED_END, s) / sqrt(sqrt(s)))


jit_module(__name__, jit_inline)
