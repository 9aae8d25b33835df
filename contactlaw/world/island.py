"""Integration of one island through one window: free flight to the first touch, substeps while any contact is closed.

Substeps are those of the leapfrog in `contactlaw.world`. The force at the end of a window begins the next window.
"""

from math import ceil, floor, nan

from contactlaw.jit import jit_inline, jit_module
from contactlaw.memory import set_whole, whole_at
from contactlaw.world.bodies.bounds import time_to_close
from contactlaw.world.bodies.motion import acceleration_of, closing_at, drift, fly, greatest_closing, settle, turn_rate
from contactlaw.world.contacts import pace
from contactlaw.world.contacts.force import TORSION_EVERY
from contactlaw.world.contacts.leapfrog import clear_push, press_spring, push_by_coasting
from contactlaw.world.contacts.meeting import radius_of
from contactlaw.world.contacts.substep import TOUCHING, advance, apply_force, kick_pair, measure
from contactlaw.world.contacts.touch import begin_contact, end_contact
from contactlaw.world.data.access import body_at, coasting_at, contact_at, near_at
from contactlaw.world.data.call import address, call_coast, call_start_coasting, ready
from contactlaw.world.data.demand import COAST, START_COASTING
from contactlaw.world.data.records import NEVER, TWIST_ALWAYS, TWIST_LATER, TWIST_NOW
from contactlaw.world.data.vec import load, norm, store, sub
from contactlaw.world.near.guards import gap_bound, raise_listed_gap
from contactlaw.world.near.listing import may_leave_margin
from contactlaw.world.near.time_of_impact import predict
from contactlaw.world.shapes.geometry import meet_near, takes_known_gap
from contactlaw.world.sleep import fall_asleep
from contactlaw.world.window import list_bodies, list_pairs

BLOCK = 16  # substeps between two reviews of their length
LOOKAHEAD = 2.0  # substeps within which an open pair must be able to close for its gap to be measured
LEAST_CHANGE = 0.75  # ratio of lengths from which substeps change; equal ones keep the leapfrog's symmetry
# Ratio from which substeps lengthen where contacts coast: the shortest impact of a heap soon is another one. 1.33 takes
# 8 % more substeps of contacts. Where impacts are single ones, as in a billiard break, 1.1 would double the error
GROWTH = 1.1
COAST_EVERY = 2  # substeps between two looks which contacts can coast
SHORTEST = 1e-6  # of a window, the least substep; of a substep, the least remainder that becomes a substep
LOST_SPEED = 1e10  # [m/s] of a surface; engines, too, take such a velocity for a fault
MAX_ADVANCES = 30  # steps of conservative advancement towards a touch; then substeps take over
MAX_TURN = 0.02  # [rad] in a substep while nothing is closed: a body that turns past another may graze it in between
IMMEDIATE = 1e-6  # of the time left of a window: shapes in contact close within it


def integrate(w, root, now, until):
    """Integrate an island through a window, from a time of the step to another [s]; return the time that it got to.

    That is earlier only if a loose body, see `window.join_loose`, may leave its margin before. If a body is lost, the
    positions of all bodies of the island become NaN, which engines detect and report; the first such body of a step is
    noted in `w`.
    """
    bodies, t = list_bodies(w, root), now
    while t < until:
        pairs = list_pairs(w, root)
        t = fly_to_touch(w, bodies, pairs, t, now, until)
        if until - t > SHORTEST * (until - now):
            t = take_substeps(w, root, (bodies, pairs), t, now, until)
            first = lost_body(w, bodies, until - now)
            if first > 0:
                w.lost_body = first if w.lost_body == 0 else w.lost_body
                for i in range(bodies):
                    b = body_at(w.bodies, whole_at(w.island_bodies, i))
                    b.time, b.done = w.step, 1
                    store(b.position, (nan, nan, nan))
                return until
            if root == w.loose and leaves_margins(w, bodies, until - t):
                until = t
        elif t < until:  # a touch at the end: over so short a substep rounding would hide its speed
            t = until
            for i in range(bodies):
                fly(body_at(w.bodies, whole_at(w.island_bodies, i)), until)
    for i in range(bodies):
        b = body_at(w.bodies, whole_at(w.island_bodies, i))
        b.time = until
        b.changed = 1
    fall_asleep(w, bodies, list_pairs(w, root))
    return until


def fly_to_touch(w, bodies, pairs, t, now, until):
    """Fly all bodies together from t [s] until a pair is closed, or to `until`; return that time [s].

    now: start of the window [s], for which times of impact are known.
    """
    soon = IMMEDIATE * (until - t)
    begin, end = 0, pairs
    for number in range(MAX_ADVANCES):
        closed, first, left = False, NEVER, pairs
        for i in range(begin, end):
            k = whole_at(w.island_pairs, i)
            p = near_at(w.near, k)
            if p.closed == 0:
                a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
                new = t > now or a.changed != 0 or b.changed != 0  # velocities changed; or one body has been woken
                # in free flight a prediction holds
                if (p.toi <= t + soon or (number == 0 and (new or p.toi < until))) and p.checked != t:
                    predict(w, p, t)
                first = min(first, p.toi)
                touches = p.toi <= t + soon and p.gap <= TOUCHING * radius_of(w, p, a, b)
                if touches and begin_contact(w, k, -p.gap):
                    closed = True
                if p.toi < until:  # the others stay apart in this flight
                    set_whole(w.island_pairs, left, k)
                    left += 1
            else:
                closed = True
        if closed:
            return t
        begin, end = pairs, left
        t = min(max(first, t + 1e-6 * soon), until)
        for i in range(bodies):
            fly(body_at(w.bodies, whole_at(w.island_bodies, i)), t)
        if t == until:
            return t
    return t


def first_substeps(w, pairs, t, now, until):
    """Return the lengths [s] of the first substep from t [s] on, and of those that follow.

    The whole window is divided into equal substeps, so that windows of equal length have equal substeps. If t, when a
    pair touches, is between two of them, the first substep is the remainder, while there is hardly any force.
    """
    whole = until - now
    for i in range(pairs):
        p = near_at(w.near, whole_at(w.island_pairs, i))
        a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
        p.path_limit = a.path + b.path + (gap_bound(w, p, a, b)[0] if p.closed == 0 else 0.0)
    h = substep_length(w, pairs, 0, t)
    if h > until - t and until == w.step:  # a touch shortly before the step's end: the impact continues in the next
        whole = w.step
    h = whole / ceil(whole / max(previous_length(w, pairs, h), SHORTEST * (until - now)) - 1e-9)
    count = floor((until - t) / h + 1e-9)
    first = until - t - count * h
    return h if count > 0.0 and first < SHORTEST * h else first, h


def take_substeps(w, root, listed, t, now, until):
    """Step an island from t [s] until none of its pairs is closed, or to `until`; return that time [s].

    listed: how many bodies and pairs of the island are in the lists. now: start of the window [s]. Contacts that hardly
    change may coast. Every BLOCK substeps, and where a contact closes that needs shorter ones, the length of substeps
    is reviewed.
    """
    (bodies, pairs), shortest = listed, SHORTEST * (until - now)
    h, next_h = first_substeps(w, pairs, t, now, until)
    for i in range(pairs):
        p = near_at(w.near, whole_at(w.island_pairs, i))
        if p.closed != 0:
            a, b, c = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b), contact_at(w.contacts, p.slot)
            apply_force(c, a, b, 0.5 * h)
            c.later = 0.5 * h
    coasting = 0  # contacts that coast; their pairs are not in the list
    since_review, going, closed = 0, True, 0
    joints = False
    for i in range(bodies):
        joints = joints or pace.is_jointed(body_at(w.bodies, whole_at(w.island_bodies, i)))
    while going:
        since_review += 1
        left = until - t - h
        is_last = left < 0.5 * next_h
        t = until if is_last else t + h
        w.twists = TWIST_ALWAYS
        if joints or closed > w.crowd:
            w.twists = TWIST_NOW if is_last or since_review % TORSION_EVERY == 0 else TWIST_LATER
        drift_together(w, bodies, h, max(next_h / h, 1.0))
        push_by_coasting(w, coasting)
        acting, closed, shorter = evaluate_contacts(w, pairs, (h, next_h), closed <= w.crowd)
        closed += coasting
        going = closed > 0 and not is_last
        soon = shorter < (NEVER if closed <= w.crowd else LEAST_CHANGE * next_h)
        review = going and (soon or since_review == BLOCK)
        if not going:
            next_h = 0.0
        if review:
            target = max(min(substep_length(w, pairs, coasting, t), left), shortest)
            going = lost_body(w, bodies, until - now) == 0
            if not may_keep(target, next_h) or (coasting > 0 and target > GROWTH * next_h):
                next_h = left / ceil(left / target - 1e-9)
            if root == w.loose and leaves_margins(w, bodies, min(2.0 * BLOCK * next_h, left)):
                going, next_h = False, 0.0
            since_review = 0
        for i in range(w.near_room, w.near_room + acting):
            p = near_at(w.near, whole_at(w.island_pairs, i))
            c = contact_at(w.contacts, p.slot)
            kick_pair(c, body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b), (h, next_h))
            if c.touch.overlap <= 0.0:
                end_contact(p, c)
        w.kicks += closed
        # contacts may coast on, unless their laws are needed: as the length of substeps changes, and in the last one
        may_coast = going and next_h == h and until - t > 1.5 * h and closed > w.crowd
        if coasting > 0:
            kept = call_coast(address(w, COAST), w, pairs, coasting, (h, next_h), may_coast)
            pairs, coasting = pairs + coasting - kept, kept
        if may_coast and since_review % COAST_EVERY == 1 and ready(w, START_COASTING):
            more = call_start_coasting(address(w, START_COASTING), w, pairs, coasting, h)
            pairs, coasting = pairs + coasting - more, more
        h = next_h
    w.twists = TWIST_ALWAYS
    for i in range(bodies):
        b = body_at(w.bodies, whole_at(w.island_bodies, i))
        b.time = w.step if t == w.step else b.time
        if b.member == 0:
            settle(b)
    return t


@jit_inline
def drift_together(w, bodies, h, longer):
    """Let all bodies drift for h [s], add what surfaces move to their paths, and predict the next substep.

    That is `longer` times as long. Contacts on each body are counted anew.
    """
    for i in range(bodies):
        b = body_at(w.bodies, whole_at(w.island_bodies, i))
        drift(b, h)  # of a tree, the first body in the list moves all
        way = norm(load(b.shift)) + (b.reach * norm(load(b.twist)) if b.reach > 0.0 else 0.0)
        b.path += way
        b.next_path = longer * way
        clear_push(b)


def leaves_margins(w, bodies, time):
    """Return whether a body of an island may leave its margin within a time [s], at its present speed."""
    leaves = False
    for i in range(bodies):
        leaves = leaves or may_leave_margin(body_at(w.bodies, whole_at(w.island_bodies, i)), time)
    return leaves


def lost_body(w, bodies, time):
    """Return the body of an island whose surface has moved furthest, faster than LOST_SPEED for a time [s], or to NaN.

    0: there is none.
    """
    out, furthest = 0, LOST_SPEED * time
    for i in range(bodies):
        k = whole_at(w.island_bodies, i)
        path = body_at(w.bodies, k).path
        if furthest == furthest and not path < furthest:
            out, furthest = k, path
    return out


@jit_inline
def evaluate_contacts(w, pairs, span, few):
    """Evaluate contacts at the end of a substep.

    Returns how many there are, which are listed in the second half of `island_pairs`, as near pairs are many more; how
    many of them stay closed; and the shortest substep [s] needed by contacts that have just closed or are about to,
    NEVER if there are none. span: lengths [s] of this substep and of the next; few: see `substeps_per_impact`.
    """
    acting, closed, shorter = 0, 0, NEVER
    for i in range(pairs):
        k = whole_at(w.island_pairs, i)
        p = near_at(w.near, k)
        a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
        if p.closed == 0:
            reach = LOOKAHEAD * (a.next_path + b.next_path)
            if a.path + b.path + reach < p.path_limit:
                continue
            shorter = min(shorter, measure_open_pair(w, k, reach, span, few))
        if p.closed != 0:
            measure(w, contact_at(w.contacts, p.slot), a, b)
            press_spring(w, contact_at(w.contacts, p.slot), a, b)
            set_whole(w.island_pairs, w.near_room + acting, k)
            acting += 1
    for i in range(w.near_room, w.near_room + acting):
        slot = near_at(w.near, whole_at(w.island_pairs, i)).slot
        c = contact_at(w.contacts, slot)
        advance(w, c, slot, span)
        if c.touch.overlap > 0.0:
            closed += 1
    return acting, closed, shorter


def measure_open_pair(w, k, reach, span, few):
    """Measure the gap of open pair k, if that may be less than `reach` [m]; close the pair if its shapes overlap.

    Returns the substep [s] that its contact needs, if it closes or is about to; else NEVER. The gap must be known in
    the substep before a pair closes, as the contact's first substep begins with it.
    """
    p = near_at(w.near, k)
    a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
    before, needed = -p.gap, NEVER
    if p.places > 1 and takes_known_gap(w, p, -1.0):
        return NEVER
    gap, last_move = gap_bound(w, p, a, b)
    reach = min(reach, LOOKAHEAD * (span[1] / span[0]) * last_move)
    if gap <= reach:
        overlap, n, arm_a, arm_b = met = meet_near(w, p, a, b)
        gap, closing = -overlap, closing_at(a, arm_a, b, arm_b, n)
        if 0.0 <= gap < LOOKAHEAD * span[1] * closing:
            p.closing, p.acceleration = closing, norm(sub(acceleration_of(a), acceleration_of(b)))
            own = pace.touch_duration(w, p, a, b, met) / pace.substeps_per_impact(w, p, few)
            needed = own if own < LEAST_CHANGE * span[1] else NEVER
    p.gap = gap
    p.path_limit = gap + a.path + b.path
    raise_listed_gap(w, p, a.time if b.still != 0 else b.time)
    if not gap >= 0.0 and begin_contact(w, k, min(before, 0.0)):
        needed = pace.longest_substep(w, contact_at(w.contacts, p.slot), a, b, pace.substeps_per_impact(w, p, False))
    return needed


def substep_length(w, pairs, coasting, t):
    """Return the length [s] that substeps from t [s] on should have; at most that of the step.

    coasting: number of contacts that coast. Open pairs count if they can close within two blocks: under a load, bodies
    that part slowly soon touch again. Bodies of trees pass many shapes without touching them, and in a crowd some pair
    always closes soon, so there they count only if they are about to close.
    """
    closed, h = coasting, w.step / w.together
    for i in range(coasting):
        h = min(h, coasting_at(w.coasting, i).pace)
    for i in range(pairs):
        p = near_at(w.near, whole_at(w.island_pairs, i))
        closed += p.closed
        body_at(w.bodies, p.body_a).square_rate, body_at(w.bodies, p.body_b).square_rate = 0.0, 0.0
    for i in range(pairs):  # before any `substep`, which needs the sums of each body
        pace.add_square_rate(w, near_at(w.near, whole_at(w.island_pairs, i)))
    few = closed <= w.crowd
    for i in range(pairs):
        p = near_at(w.near, whole_at(w.island_pairs, i))
        if p.closed != 0:
            a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
            c, substeps = contact_at(w.contacts, p.slot), pace.substeps_per_impact(w, p, few)
            h = min(h, pace.longest_substep(w, c, a, b, substeps, pairs == 1))
    for i in range(pairs):
        p = near_at(w.near, whole_at(w.island_pairs, i))
        if p.closed == 0:
            a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
            if closed == 0:
                h = min(h, MAX_TURN / max(turn_rate(a), turn_rate(b), 1e-9))
            soon = (LOOKAHEAD if not few or pace.is_jointed(a) or pace.is_jointed(b) else 2.0 * BLOCK) * h
            if p.path_limit - a.path - b.path <= soon * greatest_closing(a, b):
                if p.checked != t:
                    predict(w, p, t)
                p.path_limit = p.gap + a.path + b.path
                push = max(p.acceleration, 0.0) + pace.shared_push(a, b)
                if time_to_close(max(p.gap, 0.0), p.closing, push) < soon:
                    met = meet_near(w, p, a, b)
                    h = min(h, pace.touch_duration(w, p, a, b, met) / pace.substeps_per_impact(w, p, few))
    return h


def previous_length(w, pairs, target):
    """Return the length [s] of the closed contacts' last substeps if substeps may keep it, else the target [s]."""
    last = NEVER
    for i in range(pairs):
        p = near_at(w.near, whole_at(w.island_pairs, i))
        if p.closed != 0:
            c = contact_at(w.contacts, p.slot)
            if c.touch.force > 0.0:
                last = min(last, c.interval)
    return last if may_keep(target, last) else target


def may_keep(target, length):
    """Return whether substeps of a length [s] may keep it although the target is another."""
    return LEAST_CHANGE * length < target < length / LEAST_CHANGE


jit_module(__name__)
