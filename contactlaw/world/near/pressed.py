"""Bodies that something presses, and the gaps of the others: what adapters ask for between two steps."""

from contactlaw.jit import jit_module
from contactlaw.world.bodies.motion import closing_at
from contactlaw.world.contacts.touch import release_if_put_deeper
from contactlaw.world.data.access import body_at, guard_at, near_at, tree_at
from contactlaw.world.data.records import ASKED, BOUNDED, DENIED, MEASURED, NEVER
from contactlaw.world.near.guards import any_guard_exceeded, closing_bound, known_gap, update_guard
from contactlaw.world.near.listing import list_near
from contactlaw.world.near.passing import separate_at_start
from contactlaw.world.shapes.geometry import meet_near


def find_pressed(w):
    """Set `pressed` of all bodies that have a closed contact, or that the user has moved into another body.

    For adapters, between two steps. Open pairs of trees that may pass by everything get the gap and the closing speed
    that `near.passing` starts from.
    """
    placed, gaps_needed = False, False
    for i in range(w.body_count):
        b = body_at(w.bodies, i)
        b.pressed = 0
        placed = placed or b.placed != 0
    if w.stale != 0 or (placed and any_guard_exceeded(w, -NEVER, 2.0 * w.step)):
        list_near(w)
    for k in range(w.nears):
        p = near_at(w.near, k)
        a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
        if p.closed != 0 and a.placed + b.placed != 0:
            release_if_put_deeper(w, p)
        if p.closed != 0:
            mark_pressed(a)
            mark_pressed(b)
    for i in range(w.body_count):  # after closed pairs: a tree that is pressed needs no gaps
        gaps_needed = gaps_needed or needs_gap(body_at(w.bodies, i))
    for k in range(w.guard_count if gaps_needed else 0):
        g = guard_at(w.guards, k)
        if g.lead == k and not placed:
            update_guard(w, g, 2.0 * w.step)
        if needs_gap(body_at(w.bodies, g.body_a)) or needs_gap(body_at(w.bodies, g.body_b)):
            separate_at_start(w, g)
    for k in range(w.nears if gaps_needed else 0):
        p = near_at(w.near, k)
        a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
        if p.closed != 0 or not (needs_gap(a) or needs_gap(b)):
            continue
        p.closing_bound = closing_bound(w, p, a, b)
        if not gap_suffices(w, p, a, b):
            overlap, n, arm_a, arm_b = meet_near(w, p, a, b)
            p.gap = -overlap
            p.closing = closing_at(a, arm_a, b, arm_b, n)
            p.checked = MEASURED
            if overlap > 0.0:
                mark_pressed(a)
                mark_pressed(b)


def gap_suffices(w, p, a, b):
    """Return whether the gap of an open pair need not be measured: the last step has, or a lower bound will do.

    Sets the pair's gap to the lower bound that its guard knows, where there is one.
    """
    way, known = 2.0 * w.step * p.closing_bound, known_gap(w, p, 0.0)
    if known <= way and p.guard >= 0 and guard_at(w.guards, p.guard).separation > 0.0:
        known = guard_at(w.guards, p.guard).separation
    elif known <= way:
        new = a.placed != 0 or b.placed != 0 or p.checked > BOUNDED
        return not new and (p.checked == MEASURED or p.gap > way)
    p.gap, p.checked = known, BOUNDED
    return True


def mark_pressed(b):
    """Mark a body as pressed; the world must then integrate its tree."""
    b.pressed = 1
    if b.tree != 0:
        tree_at(b.tree, 0).passes = DENIED


def needs_gap(b):
    """Return whether the user has moved a body, or whether its tree may pass by everything."""
    return b.placed != 0 or (b.tree != 0 and tree_at(b.tree, 0).passes == ASKED)


jit_module(__name__)
