"""One step of a world: the sequence that engines and `World` share.

begin         what the step starts from; the list of near pairs where bodies have gone far
look_ahead    when could the next pair close, how long is the shortest impact that is going on
activate      what is closed or could close in a window of that length; the islands that it makes
integrate     each island through the window
...           from window to window; where nothing is closed, to the next touch at once
fly           all bodies to the end of the step
"""

from __future__ import annotations

from contactlaw.jit import jit, jit_inside
from contactlaw.memory import whole_at
from contactlaw.world.bodies.motion import closing_at, fly, is_static, settle, update_momentum
from contactlaw.world.contacts.pace import LEAST_STEP, stays_closed
from contactlaw.world.contacts.touch import release, release_if_put_deeper, update_geometry, update_initial_overlap
from contactlaw.world.data.access import body_at, contact_at, guard_at, near_at, shape_at, tree_at
from contactlaw.world.data.call import address, call_on_world, call_step, error_pending, ready
from contactlaw.world.data.demand import LAST, STEP
from contactlaw.world.data.records import ASKED, BOUNDED, MEASURED, NEVER, PARTED, PASSES, STAYS, TANGENT, TWIST_ALWAYS
from contactlaw.world.data.vec import load, store
from contactlaw.world.island import integrate
from contactlaw.world.near.guards import fastest, is_guarded, outgrown, part_at_start
from contactlaw.world.near.listing import count_slots, list_near, strayed
from contactlaw.world.shapes.geometry import meet_near
from contactlaw.world.sleep import is_disturbed, wake, wake_body
from contactlaw.world.window import activate, link, look_ahead, next_impact

PRESSED, FIXED, GROWS = range(3)  # what `step_once` is to do
AT_THE_END = 1e-6  # of an impact: one that begins so shortly before the end of a step begins in the next
REMNANT = 0.01  # of a window: what would be left of the step after it is taken into it
SHORTEST = 1e-6  # of a step, a window at least


@jit
def step(world, dt, count):
    """Move a world by a number of steps of dt [s]; stops before a step for which there may not be room enough,
    and where an exception waits.

    world: array of one `records.WORLD`, with the addresses of its arrays. Between two steps anybody may change
    positions, velocities and accelerations. Returns how many steps were made.
    """
    w = world[0]
    for i in range(count):
        if not (ready(w, STEP) and call_step(address(w, STEP), w, dt, GROWS)):
            return i
        if error_pending(w.demand):
            return i + 1
    return count


def step_once(w, dt, what):
    """Move a world by one step; PRESSED: `find_pressed` instead; GROWS: there can be more room for it.

    Returns False if there may have to be. One function for all, as they have much in common that is compiled once then.
    """
    if what == PRESSED:
        find_pressed(w)
        return True
    begin(w, dt)
    full = 2 * w.nears > w.near_room or 2 * w.guard_count > w.guard_room or 2 * w.spares < w.contact_room
    if what == GROWS and (full or w.lost > 0):
        w.stale = 1
        return False
    finish(w, dt)
    return True


@jit_inside
def find_pressed(w):
    """Which bodies are pressed: they have closed contacts, or were put into others.

    Before a step, open pairs of trees that may pass by come to know their gap and how fast it closes.
    """
    some = False
    for i in range(w.body_count):
        b = body_at(w.bodies, i)
        b.pressed = 0
        some = some or b.placed != 0 or b.tree != 0
    if w.stale != 0 or (some and outgrown(w, -NEVER, 2.0 * w.step)):
        list_near(w)
    for k in range(w.guard_count if some else 0):
        part_at_start(w, guard_at(w.guards, k))
    for closed in (1, 0):
        for k in range(w.nears):
            p = near_at(w.near, k)
            a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
            if closed * p.closed * (a.placed + b.placed) != 0:
                release_if_put_deeper(w, p)
            pressed = p.closed != 0
            if pressed != closed:
                continue
            known = True
            if not pressed and (asked(a) or asked(b)):
                p.closing_bound = fastest(w, p, a, b)
                known = is_known(w, p, a, b)
            if not known:
                overlap, n, arm_a, arm_b = meet_near(w, p, a, b)
                p.gap = -overlap
                p.closing = closing_at(a, arm_a, b, arm_b, n)
                p.checked = MEASURED
                pressed = overlap > 0.0
            if pressed:
                press(a)
                press(b)


@jit_inside
def is_known(w, p, a, b):
    """Whether the last step has left an open pair with a gap, and with a speed or so far apart that it needs none."""
    if is_guarded(w, p, 0.0, 2.0 * w.step * p.closing_bound):
        p.gap, p.checked = p.listed_gap - guard_at(w.guards, p.guard).moved, BOUNDED
        return True
    if p.guard >= 0 and guard_at(w.guards, p.guard).separation > 0.0:
        p.gap, p.checked = guard_at(w.guards, p.guard).separation, BOUNDED
        return True
    if a.placed != 0 or b.placed != 0 or p.checked > BOUNDED:
        return False
    return p.checked == MEASURED or p.gap > 2.0 * w.step * p.closing_bound


@jit_inside
def press(b):
    """A body is pressed; its tree does not pass."""
    b.pressed = 1
    if b.tree != 0:
        tree_at(b.tree, 0).passes = STAYS


@jit_inside
def asked(b):
    """Whether a body was put where it is, or may pass by everything."""
    return b.placed != 0 or (b.tree != 0 and tree_at(b.tree, 0).passes == ASKED)


@jit_inside
def finish(w, dt):
    """Take the step that has begun."""
    now = 0.0
    while now < dt:
        if w.stale != 0:
            list_near(w)
        first, shortest, window = look_ahead(w, now, dt)
        if now == 0.0 and LEAST_STEP * shortest <= dt and some_last(w) and let_last(w):
            first, shortest, window = look_ahead(w, now, dt)
        if shortest == NEVER:
            if first >= dt:
                break
            now = max(now, first)
            window = next_impact(w, now)
            if window < NEVER and dt - now <= AT_THE_END * window:
                break
        window = max(window, SHORTEST * dt)
        until = now + window
        if not dt - until > REMNANT * window:
            until = dt
        while activate(w, now, until):
            wake(w, now)
        link(w)
        for k in range(w.islands):
            integrate(w, whole_at(w.roots, k), now, until)
        now = until
        watch(w, dt - now)
    for k in range(w.body_count):
        fly(body_at(w.bodies, k), dt)


@jit_inside
def let_last(w):
    """`implicit.step.let_last`, by address."""
    return ready(w, LAST) and call_on_world(address(w, LAST), w)


@jit_inside
def some_last(w):
    """Whether a contact does not strike, so that its island may be one that lasts."""
    for k in range(w.nears):
        p = near_at(w.near, k)
        a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
        if p.closed != 0 and (a.still == 0 or b.still == 0):
            c = contact_at(w.contacts, p.slot)
            if stays_closed(c, a, b):
                return True
    return False


@jit_inside
def begin(w, dt):
    """What a step starts from."""
    w.step = dt
    w.twists, w.rested = TWIST_ALWAYS, 1
    for i in range(w.body_count):
        b = body_at(w.bodies, i)
        passes = b.tree != 0 and tree_at(b.tree, 0).passes == PASSES
        b.time = dt if passes else 0.0
        b.changed = 1
        b.touched = 0
        b.done = 1 if passes else 0
        b.placed = 0
        store(b.shift, (0.0, 0.0, 0.0))
        store(b.twist, (0.0, 0.0, 0.0))
        if b.tree != 0 and b.member == 0 and not passes:
            tree_at(b.tree, 0).span = dt
            settle(b)
        if b.asleep != 0 and (w.edited != 0 or is_disturbed(b)):
            wake_body(b, 0.0)
            settle(b)
        update_momentum(b)
        b.still = 1 if b.asleep != 0 or is_static(b) else 0
        w.rested = min(w.rested, b.still)
        if strayed(b, dt - b.time):
            w.stale = 1
    for k in range(w.guard_count):
        g = guard_at(w.guards, k)
        g.plane_time, g.speed_time = -1.0, -1.0
    if outgrown(w, dt, 0.0):
        w.stale = 1
    count_slots(w)
    for k in range(w.nears):
        p = near_at(w.near, k)
        if body_at(w.bodies, p.body_a).done == 0 and body_at(w.bodies, p.body_b).done == 0:
            p.checked = -1.0
        if p.slot >= 0 and p.closed == 0 and not update_initial_overlap(w, p):
            release(w, p.slot)
            p.slot = -1
    for slot in range(w.slots if w.spares < w.contact_room else 0):
        c = contact_at(w.contacts, slot)
        if c.phase == PARTED and c.initial_overlap == 0.0:  # those that parted are no longer near each other
            release(w, slot)
    if w.stale != 0:
        list_near(w)
    for k in range(w.nears):
        p = near_at(w.near, k)
        if p.slot >= 0:
            c = contact_at(w.contacts, p.slot)
            store(c.earlier, load(c.impulse))
    follow_tangents(w)


@jit_inside
def follow_tangents(w):
    """Bring closed contacts along with tangent planes that have been placed anew."""
    for k in range(w.nears):
        p = near_at(w.near, k)
        if p.closed != 0 and shape_at(w.shapes, p.b).kind == TANGENT:
            update_geometry(w, contact_at(w.contacts, p.slot))


@jit_inside
def watch(w, left):
    """See whether a body could leave its margin in what is left of the step."""
    for n in range(w.near_body_count):
        b = body_at(w.bodies, whole_at(w.near_bodies, n))
        if b.changed != 0 and strayed(b, left):
            w.stale = 1
    if outgrown(w, w.step, 0.0):
        w.stale = 1
