"""Which contacts are stepped in a window of time, and which bodies they join into islands.

A window is as long as the shortest impact that is going on, so that hardly anything else happens in it. Where a crowd
of contacts lasts something always does: there it is longer, as its beginning and its end ask every law. Contacts are
taken in that are closed, or that can close within the window: by the motion there is, and by what impacts may make of
it. All other bodies fly, in closed form, when something asks for them next.
"""

from __future__ import annotations

from math import sqrt

from contactlaw.jit import jit_inside
from contactlaw.laws.record import LASTING
from contactlaw.memory import set_whole, whole_at
from contactlaw.world.bodies.bounds import time_to_close
from contactlaw.world.bodies.motion import fly, mobility_bound
from contactlaw.world.contacts.pace import closing_speed, contact_duration, touch_duration
from contactlaw.world.data.access import body_at, contact_at, near_at, scratch_body, tree_at
from contactlaw.world.data.call import call_with_body
from contactlaw.world.data.records import NEVER
from contactlaw.world.near.guards import is_guarded, keep_gap
from contactlaw.world.near.time_of_impact import predict

MARGIN = 1.5  # of what impacts may give to a body, over an elastic impact on a body that is free
LONGER = 8.0  # durations of an impact that a window has where a crowd of contacts lasts
GROWN = 1.1  # a bound that has grown by less is not handed on
FAR = 40.0  # margins of a body; what can go so far within a window meets all that is near, which lies within four


@jit_inside
def look_ahead(w, now, step):
    """Look at all open pairs whose bodies have changed course or that could close now.

    Returns when the next one could close [s], the duration [s] of the shortest impact that is going on, and how long
    the next window is to be [s].
    """
    first, shortest, lasting = NEVER, NEVER, 0
    for k in range(w.nears):
        p = near_at(w.near, k)
        a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
        if (a.still != 0 and b.still != 0) or a.done != 0 or b.done != 0:
            continue
        if p.closed != 0:
            c = contact_at(w.contacts, p.slot)
            lasting += 1 if c.touch.course == LASTING else 0
            shortest = min(shortest, contact_duration(w, c, a, b))
            continue
        if a.changed != 0 or b.changed != 0 or p.toi <= now:
            if is_guarded(w, p, step, 0.0):
                p.toi, p.checked = NEVER, -1.0
            else:
                look(w, p, now)
        if p.toi < step:
            first = min(first, p.toi)
    for n in range(w.near_body_count):
        body_at(w.bodies, whole_at(w.near_bodies, n)).changed = 0
    return first, shortest, LONGER * shortest if lasting > w.crowd else shortest


@jit_inside
def look(w, p, now):
    """Look at an open pair.

    Bodies that fly stay behind in time meanwhile, and fly in one piece: who looks at them does not change a bit of it.
    """
    predict(w, p, foreseen(w, p.body_a, now, 0), foreseen(w, p.body_b, now, 1), now, w.step - now)
    keep_gap(w, p, now)


@jit_inside
def foreseen(w, i, now, place):
    """A body as it will be, or is; a tree moves there."""
    b = body_at(w.bodies, i)
    if b.time != now and b.still == 0 and b.tree == 0:
        b = scratch_body(w, i, place)
    fly(b, now)
    return b


@jit_inside
def next_impact(w, now):
    """Duration [s] of the shortest impact that may begin now."""
    shortest = NEVER
    for k in range(w.nears):
        p = near_at(w.near, k)
        still = body_at(w.bodies, p.body_a).still != 0 and body_at(w.bodies, p.body_b).still != 0
        if p.closed == 0 and p.toi <= now and not still:
            shortest = min(shortest, touch_duration(w, p))
    return shortest


@jit_inside
def activate(w, now, until):
    """Take in what is closed or can close in a window; returns whether somebody who sleeps is among them."""
    length, widest = until - now, 0.0
    for n in range(w.near_body_count):
        i = whole_at(w.near_bodies, n)
        b = body_at(w.bodies, i)
        widest = max(widest, b.margin)
        b.delta_v, b.path = 0.0, 0.0
        b.island = i - b.member  # a tree is in one island
        b.head = -1
        b.link = -1
    enough = FAR * widest / length
    sleeper = False
    found = True
    first = True
    while found:
        found = False
        for k in range(w.nears):
            p = near_at(w.near, k)
            a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
            if first:
                p.active = 0
            if (a.still != 0 and b.still != 0) or a.done != 0 or b.done != 0:
                continue
            if p.active != 0:
                if hands_on(a, b):  # or nothing of its bound has changed
                    found = bound_delta_v(w, p, a, b, length, enough) or found
                continue
            if p.closed == 0 and (not first or p.toi > until):
                if a.delta_v == 0.0 and b.delta_v == 0.0:
                    continue
                if p.checked != now:
                    kicked = length * MARGIN * (a.delta_v + b.delta_v)
                    if is_guarded(w, p, until, kicked):
                        continue
                    look(w, p, now)
                if time_to_close(p.gap, fastest_closing(p, a, b), max(p.acceleration, 0.0)) > length:
                    continue
            p.active = 1
            found = True
            fly(a, now)
            fly(b, now)
            sleeper = sleeper or a.asleep != 0 or b.asleep != 0
            bound_delta_v(w, p, a, b, length, enough)
            join(w, p.body_a, p.body_b)
        first = False
    return sleeper


@jit_inside
def bound_delta_v(w, p, a, b, length, enough):
    """How much two bodies' velocities may change by their contact, or by what the other one may be given.

    Returns whether this is clearly more than known before, and that was not enough [m/s] to meet everybody: between
    trees bounds would grow for ever.
    """
    closing, push = max(p.closing, 0.0), max(p.acceleration, 0.0)
    square = (closing + push * length) ** 2
    if p.closed != 0:
        c = contact_at(w.contacts, p.slot)
        t = c.touch
        x = max(t.overlap, 0.0)
        square = closing_speed(c, a, b) ** 2 + 0.8 * t.force * x / t.mass + (t.force * length / t.mass) ** 2
    for_a, for_b = mobility_bound(a, a.reach), mobility_bound(b, b.reach)
    both = for_a + for_b
    handed = 1.0 if hands_on(a, b) else 0.0
    for_a *= 2.0 * max(sqrt(square), handed * b.delta_v) / both
    for_b *= 2.0 * max(sqrt(square), handed * a.delta_v) / both
    more = (for_a > GROWN * a.delta_v and a.delta_v < enough) or (for_b > GROWN * b.delta_v and b.delta_v < enough)
    for one, value in ((a, for_a), (b, for_b)):
        if value > one.delta_v:
            one.delta_v = value
            if one.tree != 0:
                call_with_body(tree_at(one.tree, 0).spread_delta_v, one)
    return more


@jit_inside
def hands_on(a, b):
    """Whether what one body may be given it may hand on to another one; within a tree `spread_delta_v` has done so."""
    return (a.tree == 0 or a.tree != b.tree) and a.inverse_mass != 0.0 and b.inverse_mass != 0.0


@jit_inside
def fastest_closing(p, a, b):
    """Closing speed [m/s] of an open pair within a window, whatever impacts do, at most."""
    return max(p.closing, 0.0) + MARGIN * (a.delta_v + b.delta_v)


@jit_inside
def root_of(w, i):
    """First body of the island that a body is in."""
    b = body_at(w.bodies, i)
    while b.island != i:
        b.island = body_at(w.bodies, b.island).island
        i = b.island
        b = body_at(w.bodies, i)
    return i


@jit_inside
def join(w, i, j):
    """Make two bodies members of one island; those that nothing moves are in none."""
    if fixed(body_at(w.bodies, i)) or fixed(body_at(w.bodies, j)):
        return
    i, j = root_of(w, i), root_of(w, j)
    body_at(w.bodies, max(i, j)).island = min(i, j)


@jit_inside
def fixed(b):
    """Whether nothing can move a body."""
    return b.still != 0 and b.asleep == 0


@jit_inside
def link(w):
    """String up the near pairs and the bodies of each island."""
    w.islands = 0
    for k in range(w.nears - 1, -1, -1):
        p = near_at(w.near, k)
        if p.active == 0:
            continue
        own = p.body_a if body_at(w.bodies, p.body_a).still == 0 else p.body_b
        root = root_of(w, own)
        r = body_at(w.bodies, root)
        if r.head < 0:
            set_whole(w.roots, w.islands, root)
            w.islands += 1
        p.link = r.head
        r.head = k
    for n in range(w.near_body_count - 1, -1, -1):
        i = whole_at(w.near_bodies, n)
        root = root_of(w, i)
        if root != i and body_at(w.bodies, root).head >= 0:
            body_at(w.bodies, i).link = body_at(w.bodies, root).link
            body_at(w.bodies, root).link = i
