"""Which islands may take an implicit step, and whether one that was found may stand.

See `implicit.step`: nothing strikes in them, and no contact does within the step what is a matter of when.
"""

from __future__ import annotations

from contactlaw.jit import jit_inside
from contactlaw.memory import whole_at
from contactlaw.world.bodies.bounds import time_to_close
from contactlaw.world.contacts.force import (
    has_rigid_friction,
    is_quasi_static,
    slide_to_slip,
    slips_fully,
    stored_energy,
)
from contactlaw.world.contacts.pace import radius_of, stays_closed
from contactlaw.world.contacts.touch import TOUCHING
from contactlaw.world.data.access import body_at, contact_at, near_at, row_at, saved_contact, shape_at, tree_at
from contactlaw.world.data.records import DISC, NEVER, SIDE
from contactlaw.world.data.vec import cross, dot, load, norm, sub, to_body, to_world
from contactlaw.world.shapes.core import CROWN

WHIRL = 0.01  # [rad], by which the deepest point of a disc may run round it in such a step
GAINED = 1e-6  # of its energy, what rounding and a step of second order may add to an island
LARGEST_TURN = 0.1  # [rad] of a body with shapes off its centre, in such a step


@jit_inside
def is_lasting(w, bodies, pairs):
    """Whether contacts of an island are closed, and nothing strikes within the step; numbers its unknowns."""
    unknowns = 0
    for i in range(bodies):
        b = body_at(w.bodies, whole_at(w.island_bodies, i))
        if b.oriented != 0 and norm(load(b.spin)) * w.step > LARGEST_TURN:
            return False
        b.unknown = -1
        b.active = 0
        if b.tree != 0:
            if b.member == 0:
                tree_at(b.tree, 0).unknown = unknowns
                unknowns += tree_at(b.tree, 0).v_size
            b.unknown = tree_at(b.tree, 0).unknown
        elif b.inverse_mass != 0.0:
            b.unknown = unknowns
            unknowns += 6
    w.unknowns = unknowns
    if unknowns > w.unknown_room:
        return False
    closed = 0
    for i in range(pairs):
        p = near_at(w.near, whole_at(w.island_pairs, i))
        closed += p.closed
        for k in (p.body_a, p.body_b):
            b = body_at(w.bodies, k)
            b.active = max(b.active, p.closed)
            if b.still != 0:
                b.unknown = -1
    for i in range(pairs):
        if strikes(w, near_at(w.near, whole_at(w.island_pairs, i))):
            return False
    return closed > 0


@jit_inside
def strikes(w, p):
    """Whether a pair strikes within the step, or is none that lasts."""
    a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
    if p.closed == 0:
        if p.gap < 0.0 and -p.gap > TOUCHING * radius_of(w, p):
            return True  # it is to be found so, see `touch.begin_contact`
        closing, gap, push = max(p.closing, 0.0), max(p.gap, 0.0), push_between(p, a, b)
        return time_to_close(gap, p.closing, push) < w.step and closing * closing + 2.0 * push * gap > 0.0
    c = contact_at(w.contacts, p.slot)
    if has_rigid_friction(w, c) or not stays_closed(c, a, b):
        return True
    return whirls(shape_at(w.shapes, p.a), a, load(c.normal), sub(load(a.spin), load(b.spin)), w.step)


@jit_inside
def push_between(p, a, b):
    """Closing acceleration [m/s^2] of an open pair, at most: loads do not move what is pressed against others."""
    held_a, held_b = a.active != 0 or a.still != 0, b.active != 0 or b.still != 0
    if held_a:
        return 0.0 if held_b else norm(load(b.acceleration))
    return norm(load(a.acceleration)) if held_b else max(p.acceleration, 0.0)


@jit_inside
def whirls(s, a, n, spin, time):
    """Whether the deepest point of a disc runs round it: n', see `disc`, turns in a time by more than WHIRL."""
    if s.kind != DISC and s.kind != SIDE:
        return False
    axis = to_world(a.axes, load(s.normal))
    flat = 2.0 * CROWN * s.radius / norm(load(s.half))
    return norm(cross(spin, axis)) * time > WHIRL * max(norm(cross(n, axis)), flat)


@jit_inside
def is_held(w, bodies, pairs):
    """Whether joints hold bodies of an island, and no contact of it slides as a whole: one stage then."""
    trees = 0
    for i in range(bodies):
        trees += 1 if body_at(w.bodies, whole_at(w.island_bodies, i)).tree != 0 else 0
    for i in range(pairs if trees > 0 else 0):
        p = near_at(w.near, whole_at(w.island_pairs, i))
        if p.closed != 0 and slips_fully(contact_at(w.contacts, p.slot).touch):
            return False
    return trees > 0


@jit_inside
def is_steady(w, bodies, pairs):
    """Whether no contact of an island moves along its normal as it begins the step: its forces hardly change then.

    Not with joints: what actuators and they make of free bodies is no place to look first.
    """
    for i in range(bodies):
        if body_at(w.bodies, whole_at(w.island_bodies, i)).tree != 0:
            return False
    for i in range(pairs):
        r = row_at(w.rows, i)
        if r.slot >= 0 and not is_quasi_static(contact_at(w.contacts, r.slot), 1.0):
            return False
    return True


@jit_inside
def changes(w, pairs):
    """Whether a contact parts in the step, or comes to stick that slid or spun as a whole: when that is matters."""
    for i in range(pairs):
        r = row_at(w.rows, i)
        if r.slot >= 0 and r.fresh == 0:
            c = contact_at(w.contacts, r.slot)
            start, now = saved_contact(w, r.slot).touch, c.touch
            if now.overlap <= 0.0 and start.overlap > 0.0:
                return True
            far = slide_to_slip(now)
            sticks = slips_fully(start) and (not slips_fully(now) or now.f * r.slide[0] + now.g * r.slide[1] < 0.0)
            if sticks and c.moved[0] ** 2 + c.moved[1] ** 2 > far * far:
                return True
            if c.torsion.moment * r.slide[2] < 0.0 and c.moved[2] ** 2 * now.radius * now.overlap > far * far:
                return True
    return False


@jit_inside
def energy(w, bodies, pairs):
    """Energy [J] of an island: of its motion, of its contacts, and of what loads have done since the step began.

    The second result is the sum of their sizes; infinite where joints do work, or bodies that nothing can push.
    """
    total, size = 0.0, 0.0
    for i in range(bodies):
        b = body_at(w.bodies, whole_at(w.island_bodies, i))
        if b.tree != 0 or b.unknown < 0:
            return 0.0, NEVER
        v, spin = load(b.velocity), to_body(b.axes, load(b.spin))
        motion = dot(v, v) / b.inverse_mass
        for j in range(3):
            motion += spin[j] * spin[j] / b.inverse_inertia[j]
        work = dot(load(b.acceleration), load(b.shift)) / b.inverse_mass + dot(load(b.torque), load(b.twist))
        total += 0.5 * motion - work
        size += 0.5 * motion + abs(work)
    for i in range(pairs):
        slot = row_at(w.rows, i).slot
        if slot >= 0:
            stored = stored_energy(w, contact_at(w.contacts, slot), slot)
            total, size = total + stored, size + stored
    return total, size
