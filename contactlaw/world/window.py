"""Which pairs are stepped in a window of time, and which islands they join bodies into.

A window is as long as the shortest impact that is going on, so that little else happens in it. In a crowd of persistent
contacts some impact is always going on; windows are longer there, because each begins and ends with an evaluation of
all laws. A pair is active in a window if it is closed, or can close in it by the present motion or after impacts. All
other bodies fly, in closed form, when they are next needed.
"""

from math import sqrt

from contactlaw.jit import jit_module
from contactlaw.laws.record import LASTING
from contactlaw.memory import set_whole, whole_at
from contactlaw.world.bodies.bounds import is_idle, time_to_close
from contactlaw.world.bodies.motion import fly, mobility_bound
from contactlaw.world.contacts.pace import closing_speed, contact_duration, touch_duration
from contactlaw.world.contacts.touch import nears_in_use
from contactlaw.world.data.access import body_at, contact_at, near_at, shape_at, tree_at
from contactlaw.world.data.call import call_with_body
from contactlaw.world.data.records import FRESH, NEVER, STRIKES
from contactlaw.world.data.vec import load, norm, sub
from contactlaw.world.near import guards
from contactlaw.world.near.listing import list_near, may_leave_margin
from contactlaw.world.near.time_of_impact import find_gap, predict
from contactlaw.world.shapes.geometry import meet_near

DELTA_V_MARGIN = 1.5  # margin on the change of velocity by impacts, over that of an elastic impact of free bodies
CROWD_WINDOW = 24.0  # durations of the shortest impact in a window where more than `WORLD.crowd` contacts persist
EARLY = 0.1  # durations of the impact: a window may begin so long before a touch; the first substep begins at that
NOTABLE = 1.1  # a bound on a change of velocity that has grown by a smaller factor is not passed on
FAR = 40.0  # margins: a body that can travel so far in a window reaches every near body, as these are within four


def predict_all(w, now, step, pairs=-1):
    """Predict the times of impact of open pairs; return the next one [s], or NEVER, and how many are within the step.

    now: time of the step [s]; step: its length [s]. A pair is predicted anew if the velocity of one of its bodies has
    changed or its time of impact has come. Pairs within the step are listed in `island_pairs`. pairs: how many the last
    call listed, which alone matter while all fly, or -1: all near pairs. What has stopped for one of those, as trees
    do, is predicted anew in all of them, so that it does not soon stop for the next.
    """
    first, within = NEVER, 0
    for i in range(w.nears if pairs < 0 else pairs):
        k = i if pairs < 0 else whole_at(w.island_pairs, i)
        p = near_at(w.near, k)
        a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
        if p.closed != 0 or is_left_out(a, b):
            continue
        here = pairs >= 0 and p.checked != now and guards.time_of(a, b) == now
        if here or a.changed != 0 or b.changed != 0 or p.toi <= now:
            if remains_open(w, p, now, step, 0.0):
                p.toi, p.checked = NEVER, -1.0
            else:
                predict(w, p, max(a.time if a.still == 0 else 0.0, b.time if b.still == 0 else 0.0))
                if p.toi <= now:
                    predict(w, p, now)
        if p.toi < step:
            first = min(first, p.toi)
            set_whole(w.island_pairs, within, k)
            within += 1
    for n in range(w.near_body_count):
        body_at(w.bodies, whole_at(w.near_bodies, n)).changed = 0
    return first, within


def remains_open(w, p, now, until, more):
    """Return whether a near pair is known to stay open until a time of the step [s], if its gap closes by `more` [m].

    If the list must not show its age, a pair in doubt is measured at the start of the step: then what is known since an
    earlier step only saves this.
    """
    if p.guard >= 0 and w.age != 0 and now == 0.0 and guards.known_gap(w, p, until) <= more:
        overlap, _, _, _ = meet_near(w, p, body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b))
        p.gap = -overlap
        guards.raise_listed_gap(w, p, 0.0)
    return guards.known_gap(w, p, until) > more


def plan_window(w):
    """Return the shortest duration of an impact that is going on and the next window [s]; NEVER: no pair is closed.

    Also whether shorter impacts may throw bodies far within the window: in crowds, or if the shortest is an idle one.
    """
    shortest, persistent, idle = NEVER, 0, False
    for k in range(nears_in_use(w)):
        p = near_at(w.near, k)
        a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
        if p.closed != 0 and not is_left_out(a, b):
            c = contact_at(w.contacts, p.slot)
            persistent += 1 if c.touch.course == LASTING else 0
            duration = contact_duration(w, c, a, b)
            if duration < shortest:
                idle = is_idle(a, b, c.touch.overlap, closing_speed(c, a, b), w.step, c.touch.radius)
            shortest = min(shortest, duration)
    crowd = persistent > w.crowd
    return shortest, CROWD_WINDOW * shortest if crowd else shortest, idle or crowd


def is_left_out(a, b):
    """Return whether nothing happens to a pair: its bodies stand still, or the step of one of them is over."""
    return (a.still != 0 and b.still != 0) or a.done != 0 or b.done != 0


def shortest_new_impact(w, now, pairs):
    """Return whether any impact is about to begin, the duration [s] of the shortest, and what `plan_window` tells last.

    pairs: how many `predict_all` has listed. Times of impact are lower bounds: pairs of which it has come are predicted
    anew. Most are not about to touch, and cores that stay apart for a while never are. Then no window begins and no
    flight is cut, so that rounding does not depend on how often a pair is looked at.
    """
    touching, shortest, idle = False, NEVER, False
    for i in range(pairs):
        p = near_at(w.near, whole_at(w.island_pairs, i))
        if p.toi <= now:
            a, b = predict(w, p, now)
            if p.toi < NEVER and not guards.takes_known_time(w, p, now):
                duration = touch_duration(w, p, a, b, meet_near(w, p, a, b))
                if p.toi - now <= EARLY * duration:
                    if duration <= shortest:
                        idle = is_idle(a, b, max(-p.gap, 0.0), p.closing, w.step, shape_at(w.shapes, p.a).radius)
                    touching, shortest = True, min(shortest, duration)
    return touching, shortest, idle


def activate(w, now, until):
    """Activate the pairs that are closed or can close in a window; return whether a sleeping body is in one.

    now, until: start and end of the window [s].
    """
    for k in range(w.nears):
        p = near_at(w.near, k)
        left_out = is_left_out(body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b))
        p.active = STRIKES if not left_out and (p.closed != 0 or p.toi <= until) else 0
    return spread(w, now, until)


def spread(w, now, until):
    """Activate the pairs, besides those that are active, that impacts can close; return what `activate` tells.

    Bodies of active pairs fly to the start of the window and are joined into islands. An impact can throw a body
    against others, so bounds on changes of velocity spread from the pairs that are active as STRIKES along all of them,
    until no further pair can close. They spread among sleeping bodies too, as if these were awake.
    """
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
    sleeper, changed, first_pass = False, True, True
    while changed:
        changed = False
        for k in range(w.nears):
            p = near_at(w.near, k)
            a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
            if p.active != 0 and not first_pass:  # it has given its bodies all that it can, besides what it passes on
                changed = (transmits(a, b) and bound_delta_v(a, b, 0.0, enough)) or changed
                continue
            if p.active == 0:
                asleep = a.asleep != 0 and b.asleep != 0
                if is_left_out(a, b) and not (asleep and a.delta_v + b.delta_v > 0.0):
                    continue
                if p.closed == 0 and not may_close(w, p, now, until):
                    continue
                p.active = STRIKES
            fly(a, now)
            fly(b, now)
            sleeper = sleeper or a.asleep != 0 or b.asleep != 0
            speed = impact_speed(w, p, a, b, length) if p.active == STRIKES else 0.0
            changed = bound_delta_v(a, b, speed, enough) or changed
            join(w, p.body_a, p.body_b)
        first_pass = False
    return sleeper


def may_close(w, p, now, until):
    """Return whether impacts of their bodies can close an open pair in a window, by the bounds known so far."""
    a, b, length = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b), until - now
    if a.delta_v == 0.0 and b.delta_v == 0.0:
        return False
    gained = a.delta_v + b.delta_v
    if p.checked != now:
        if remains_open(w, p, now, until, length * DELTA_V_MARGIN * gained):
            return False
        if joins_nothing(w, p, a, b, length):
            return True
        find_gap(w, p, now)
    closing = max(p.closing, 0.0) + DELTA_V_MARGIN * gained
    return not time_to_close(p.gap, closing, max(p.acceleration, 0.0)) > length


def joins_nothing(w, p, a, b, length):
    """Return whether an open pair of two bodies of one tree can be active without a look at its gap.

    That is if an impact at the greatest speed that its guard knows would not raise the bounds on changes of velocity.
    As an active pair it costs next to nothing: its gap is measured once the paths of its bodies make up what the guard
    knows of it. Sets the pair's closing speed and acceleration to bounds.
    """
    if p.guard < 0 or a.tree == 0 or a.tree != b.tree:
        return False
    p.closing = guards.closing_bound(w, p, a, b)
    p.acceleration = norm(sub(load(a.acceleration), load(b.acceleration)))
    for_a, for_b = gain_bounds(a, b, impact_speed(w, p, a, b, length))
    return for_a <= a.delta_v and for_b <= b.delta_v


def is_loose(b, time):
    """Return whether impacts within a time [s] could throw a body out of its margin, against what is not listed."""
    return b.delta_v > 0.0 and may_leave_margin(b, time, DELTA_V_MARGIN * b.delta_v)


def join_loose(w, time):
    """Join the bodies that are loose in a window of a length [s] into one island; return its first body, -1: none.

    That island is integrated first, and ends the window for all when one of its bodies comes to the end of its margin.
    """
    first = -1
    for n in range(w.near_body_count):
        i = whole_at(w.near_bodies, n)
        if is_loose(body_at(w.bodies, i), time):
            first = i if first < 0 else first
            join(w, first, i)
    return root_of(w, first) if first >= 0 else -1


def list_anew(w, brief):
    """List near pairs at the start of a step, as if all that is known of their bodies were from this step.

    brief: 1: for this step alone, see `WORLD.brief`.
    """
    w.brief = brief
    list_near(w)
    for i in range(w.body_count):
        body_at(w.bodies, i).changed = 1
    guards.any_guard_exceeded(w, w.step, 0.0)
    if w.age != 0 and brief != 0:
        w.age = FRESH


def bound_delta_v(a, b, speed, enough):
    """Raise the bounds on two bodies' changes of velocity [m/s] within a window by what their contact can do.

    Returns whether a bound has clearly grown that was still below `enough` [m/s], with which a body reaches all that is
    near; without this limit the bounds of trees could grow for ever. speed: as for `gain_bounds`.
    """
    if speed + a.delta_v + b.delta_v == 0.0:
        return False
    for_a, for_b = gain_bounds(a, b, speed)
    more = (for_a > NOTABLE * a.delta_v and a.delta_v < enough) or (for_b > NOTABLE * b.delta_v and b.delta_v < enough)
    for one, value in ((a, for_a), (b, for_b)):
        if value > one.delta_v:
            one.delta_v = value
            if one.tree != 0:
                call_with_body(tree_at(one.tree, 0).spread_delta_v, one)
    return more


def gain_bounds(a, b, speed):
    """Return how much velocity [m/s] a contact can give to each of its bodies.

    That is by an elastic impact at a closing speed [m/s], or by passing on a change that the other body may get.
    """
    for_a, for_b = mobility_bound(a, a.reach), mobility_bound(b, b.reach)
    both = for_a + for_b
    passed_on = 1.0 if transmits(a, b) else 0.0
    for_a *= 2.0 * max(speed, passed_on * b.delta_v) / both
    for_b *= 2.0 * max(speed, passed_on * a.delta_v) / both
    return for_a, for_b


def impact_speed(w, p, a, b, length):
    """Return the closing speed [m/s] whose elastic impact changes velocities as a pair does in a window, at most."""
    if p.closed != 0:
        c = contact_at(w.contacts, p.slot)
        t = c.touch
        x = max(t.overlap, 0.0)
        return sqrt(closing_speed(c, a, b) ** 2 + 0.8 * t.force * x / t.mass + (t.force * length / t.mass) ** 2)
    return max(p.closing, 0.0) + max(p.acceleration, 0.0) * length


def transmits(a, b):
    """Return whether one body can pass on to the other a change of its velocity.

    Two bodies of one tree need not: `spread_delta_v` has done that.
    """
    return (a.tree == 0 or a.tree != b.tree) and a.inverse_mass != 0.0 and b.inverse_mass != 0.0


def root_of(w, i):
    """Return the first body of the island that body i is in: union-find, halving the path."""
    b = body_at(w.bodies, i)
    while b.island != i:
        b.island = body_at(w.bodies, b.island).island
        i = b.island
        b = body_at(w.bodies, i)
    return i


def join(w, i, j):
    """Join the islands of two bodies; bodies that stand still without sleeping are in none."""
    a, b = body_at(w.bodies, i), body_at(w.bodies, j)
    if a.still > a.asleep or b.still > b.asleep:
        return
    i, j = root_of(w, i), root_of(w, j)
    body_at(w.bodies, max(i, j)).island = min(i, j)


def list_islands(w, first=-1):
    """Link the active pairs and the bodies of each island into lists, and note the islands' roots.

    first: root of an island that comes first.
    """
    w.islands, w.loose = 0, first
    for k in range(w.nears - 1, -1, -1):
        p = near_at(w.near, k)
        if p.active == 0 or (body_at(w.bodies, p.body_a).still != 0 and body_at(w.bodies, p.body_b).still != 0):
            continue
        own = p.body_a if body_at(w.bodies, p.body_a).still == 0 else p.body_b
        root = root_of(w, own)
        r = body_at(w.bodies, root)
        if r.head < 0:
            set_whole(w.roots, w.islands, root)
            w.islands += 1
        p.link = r.head
        r.head = k
    for k in range(w.islands if first >= 0 else 0):
        if whole_at(w.roots, k) == first:
            set_whole(w.roots, k, whole_at(w.roots, 0))
            set_whole(w.roots, 0, first)
    for n in range(w.near_body_count - 1, -1, -1):
        i = whole_at(w.near_bodies, n)
        root = root_of(w, i)
        if root != i and body_at(w.bodies, root).head >= 0:
            body_at(w.bodies, i).link = body_at(w.bodies, root).link
            body_at(w.bodies, root).link = i


def list_bodies(w, root):
    """List the moving bodies of an island in `w`; return how many."""
    count, i = 0, root
    while i >= 0:
        if body_at(w.bodies, i).still == 0:
            set_whole(w.island_bodies, count, i)
            count += 1
        i = body_at(w.bodies, i).link
    return count


def list_pairs(w, root):
    """List the active pairs of an island in `w`; return how many."""
    count, k = 0, body_at(w.bodies, root).head
    while k >= 0:
        set_whole(w.island_pairs, count, k)
        count += 1
        k = near_at(w.near, k).link
    return count


jit_module(__name__)
