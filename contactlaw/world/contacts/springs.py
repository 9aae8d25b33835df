"""Where the springs of contacts act in a substep, so that leapfrog steps are exact to the fourth order.

Leapfrog steps of h follow x'' + h^2/12 x'''' = F/m. If the force F(y) is that of the place y = x + h^2/12 x'', then
y'' = F(y)/m up to h^4 (Numerov 1924; with x'' by the forces at x, as here: Takahashi & Imada 1984). x and y are the
same before and after an impact. Where bodies touch several others, x'' is by all of their springs.

A damper acts with the mean velocity of two steps, y' (1 - h^2 k/(12 m)) for a spring k, while the spring lags behind y
by h^2/12 of the acceleration by the damper: both errors cancel.
"""

from contactlaw.jit import jit_inline, jit_module
from contactlaw.laws.hertz import elastic_force
from contactlaw.laws.record import OPEN
from contactlaw.world.bodies.motion import spin_change
from contactlaw.world.data.access import body_at, coasting_at
from contactlaw.world.data.vec import ZERO, add, axpy, cross, dot, load, scale, store, sub

SHARE = 1.0 / 12.0  # of h^2 x''
UNKNOWN = -1e300  # value of `CONTACT.neighbours` where the substep before has not found it


def clear_push(b):
    """Set what pushes a body to its loads besides contacts."""
    store(b.push, load(b.acceleration))
    if b.oriented != 0:
        store(b.twisting, spin_change(b, load(b.torque)))


def add_push(b, arm, force):
    """Add a spring's force [N] on a body at an arm [m] to those of this substep; arms of round bodies are along it."""
    if b.inverse_mass == 0.0:
        return
    store(b.push, axpy(b.inverse_mass, force, load(b.push)))
    if b.oriented != 0:
        store(b.twisting, add(load(b.twisting), spin_change(b, cross(arm, force))))


def push_at(b, arm):
    """Return the acceleration [m/s^2] by loads and springs of a body's point at an arm [m]."""
    if b.inverse_mass == 0.0:
        return ZERO
    return load(b.push) if b.oriented == 0 else add(load(b.push), cross(load(b.twisting), arm))


def press_spring(c, a, b, linear):
    """Set the force of a contact's spring where its bodies are, and add it to what pushes them.

    Bodies of trees answer to it with all of the tree: their contacts know their own springs only.
    """
    t, n = c.touch, load(c.normal)
    c.spring = 0.0
    if t.overlap > 0.0 and not (linear and t.state == OPEN):  # whose stiffness is known after the touch
        c.spring = elastic_force(t, linear, t.overlap)
    if a.tree == 0 and b.tree == 0:
        add_push(a, load(c.arm_a), scale(c.spring, n))
        add_push(b, load(c.arm_b), scale(-c.spring, n))


def push_by_coasting(w, coasting):
    """Add the forces of coasting contacts, at the end of the substep before, to what pushes their bodies."""
    for i in range(coasting):
        r = coasting_at(w.coasting, i)
        add_push(body_at(r.body_a, 0), ZERO, scale(r.force, load(r.normal)))
        add_push(body_at(r.body_b, 0), ZERO, scale(-r.force, load(r.normal)))


def closing_by_others(c, a, b):
    """Return the closing acceleration [m/s^2] of a contact by all but itself, at the end of a substep.

    That is the mean one of the last two substeps, at their middle, and what other springs have changed since.
    """
    t = c.touch
    out = c.closing_acceleration + t.force / t.mass
    if a.tree == 0 and b.tree == 0:
        pushes = sub(push_at(a, load(c.arm_a)), push_at(b, load(c.arm_b)))
        springs = c.spring / t.mass - dot(pushes, load(c.normal))
        if c.interval == 0.0:
            out = springs
        elif c.neighbours > UNKNOWN:
            out += springs - c.neighbours
        c.neighbours = springs
    return out


jit_module(__name__, jit_inline)
