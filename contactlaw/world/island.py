"""The bodies and contacts of one island through one window: fly to the first touch, step while anything is closed.

A substep is a leapfrog: all bodies drift, then each contact looks where its bodies are and asks its law, then all
bodies are kicked. The force at the end of a window is where the next one begins.
"""

from __future__ import annotations

from math import ceil, floor, nan

from contactlaw.jit import jit_inside
from contactlaw.memory import set_whole, whole_at
from contactlaw.world.bodies.bounds import time_to_close
from contactlaw.world.bodies.motion import closing_at, drift, fly, greatest_closing, settle, turn_rate
from contactlaw.world.contacts.pace import add_square_rate, longest_substep, radius_of, touch_duration
from contactlaw.world.contacts.touch import TOUCHING, advance, apply_force, begin_contact, end_contact, measure
from contactlaw.world.data.access import body_at, contact_at, law_of, near_at, pair_at, tree_at
from contactlaw.world.data.call import address, call_coast, call_start_coasting, call_stop_coasting, ready
from contactlaw.world.data.demand import COAST, START_COASTING, STOP_COASTING
from contactlaw.world.data.records import NEVER, TWIST_ALWAYS, TWIST_LATER, TWIST_NOW
from contactlaw.world.data.vec import load, norm, store
from contactlaw.world.near.guards import keep_gap, known_gap, over_plane
from contactlaw.world.near.time_of_impact import predict
from contactlaw.world.shapes.geometry import meet_near
from contactlaw.world.sleep import fall_asleep

AHEAD = 2.0  # strides of both that two surfaces may come nearer by in a substep; substeps that a touch is seen before
BLOCK = 16  # substeps of one length; then the paces are looked at anew
LEAST_CHANGE = 0.75  # of the length of substeps: within it they stay as they are, for the leapfrog's symmetry
ELASTIC = 60.0  # substeps of an elastic impact in a crowd, at least: a column of 20 keeps its energy to 1e-3
LEAST_COASTED = 3.5  # substeps, fewer of which are not worth it
SHORTEST = 1e-6  # of a substep, a remainder that is none; of a window, a substep at least
LOST = 1e10  # [m/s] at which a body is lost: a velocity that engines take for a fault, too
JOINTED = 4.0  # times fewer substeps has a damped impact of bodies that joints hold: 25 for 100, psi_2 right to 1e-3
TWISTS = 8  # substeps in which contacts that are no few are twisted once: torsion is a hundred times slower
TRIES = 30  # steps of conservative advancement on the way to a touch; after them it is stepped towards
STRIDE = 0.02  # [rad] that a body may turn in such a step: what turns past another may graze it in between
AT_ONCE = 1e-6  # of a window: time in which two shapes that touch would close


@jit_inside
def integrate(w, root, now, until):
    """Move an island from one time of the step to another [s].

    With a body that is lost all of it is nowhere: an engine finds a state that is no number, and says so.
    """
    bodies, pairs = members(w, root)
    t = now
    while t < until:
        t = approach(w, bodies, pairs, t, until)
        if until - t > SHORTEST * (until - now):
            t = run(w, bodies, pairs, t, now, until)
            if lost(w, bodies, until - now):
                for i in range(bodies):
                    b = body_at(w.bodies, whole_at(w.island_bodies, i))
                    b.time, b.done = w.step, 1
                    store(b.position, (nan, nan, nan))
                return
        elif t < until:  # a touch at the end: a substep so short would tell nothing of its speed
            t = until
            for i in range(bodies):
                fly(body_at(w.bodies, whole_at(w.island_bodies, i)), until)
    for i in range(bodies):
        b = body_at(w.bodies, whole_at(w.island_bodies, i))
        b.time = until
        b.changed = 1
    fall_asleep(w, bodies, pairs)


@jit_inside
def members(w, root):
    """List the bodies and the near pairs of an island; returns how many."""
    bodies, pairs = 0, 0
    i = root
    while i >= 0:
        if body_at(w.bodies, i).still == 0:
            set_whole(w.island_bodies, bodies, i)
            bodies += 1
        i = body_at(w.bodies, i).link
    k = body_at(w.bodies, root).head
    while k >= 0:
        set_whole(w.island_pairs, pairs, k)
        pairs += 1
        k = near_at(w.near, k).link
    return bodies, pairs


@jit_inside
def approach(w, bodies, pairs, t, until):
    """While nothing is closed, fly all bodies together until the first two touch; returns when they do [s]."""
    soon = AT_ONCE * (until - t)
    for number in range(TRIES):
        closed, first = False, NEVER
        for i in range(pairs):
            p = near_at(w.near, whole_at(w.island_pairs, i))
            if p.closed == 0:
                if number == 0 or p.toi <= t + soon:  # who flies does what was foreseen
                    foresee(w, p, t)
                first = min(first, p.toi)
                touches = p.toi <= t + soon and p.gap <= TOUCHING * radius_of(w, p)
                if touches and begin_contact(w, whole_at(w.island_pairs, i), -p.gap):
                    closed = True
            else:
                closed = True
        if closed:
            return t
        t = min(max(first, t + 1e-6 * soon), until)
        for i in range(bodies):
            fly(body_at(w.bodies, whole_at(w.island_bodies, i)), t)
        if t == until:
            return t
    return t


@jit_inside
def run(w, bodies, pairs, t, now, until):
    """Step an island until nothing of it is closed, or to the end of the window; returns when [s].

    The window is a whole number of substeps, so that those of windows of one length are alike. What is left of it from
    a touch on is not: the first substep is the remainder, as long as there is hardly any force.
    """
    whole, shortest = until - now, SHORTEST * (until - now)
    for i in range(pairs):
        near_at(w.near, whole_at(w.island_pairs, i)).path_limit = 0.0
    h = length(w, pairs, t)
    if h > until - t and until == w.step:  # a touch shortly before the end of a step: the next one goes on with it
        whole = w.step
    h = whole / ceil(whole / max(kept(w, pairs, h), shortest) - 1e-9)
    count = floor((until - t) / h + 1e-9)
    following = h
    h = until - t - count * h
    if count > 0.0 and h < SHORTEST * following:
        h = following
    for i in range(pairs):
        p = near_at(w.near, whole_at(w.island_pairs, i))
        if p.closed != 0:
            a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
            apply_force(contact_at(w.contacts, p.slot), a, b, 0.5 * h)
    done, going, closed, rest, stirred, spacing = 0, True, 0, pairs, False, h
    joints = False
    for i in range(bodies):
        joints = joints or jointed(body_at(w.bodies, whole_at(w.island_bodies, i)))
    while going:
        done += 1
        left = until - t - h
        last = left < 0.5 * following
        t = until if last else t + h
        for i in range(bodies):
            drift(body_at(w.bodies, whole_at(w.island_bodies, i)), h)
        if rest < pairs and (stirred or last or done == BLOCK or h != spacing):
            call_stop_coasting(address(w, STOP_COASTING), w, pairs - rest)
            rest = pairs
        w.twists = TWIST_ALWAYS
        if joints or closed > w.crowd:
            w.twists = TWIST_NOW if last or done % TWISTS == 0 else TWIST_LATER
        travel(w, bodies, max(following / h, 1.0))
        closed, news = forces(w, rest, (h, following), closed <= w.crowd)
        closed += pairs - rest
        going = closed > 0 and not last
        if not going:
            following = 0.0
        anew = going and news < (NEVER if closed <= w.crowd else LEAST_CHANGE * following)
        if anew or (going and done == BLOCK):
            target = max(min(length(w, pairs, t), left), shortest)
            going = not lost(w, bodies, whole)
            if not alike(target, following):
                following = left / ceil(left / target - 1e-9)
            done = 0
        for i in range(rest):
            p = near_at(w.near, whole_at(w.island_pairs, i))
            if p.closed == 0:
                continue
            c = contact_at(w.contacts, p.slot)
            a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
            if c.touch.overlap > 0.0:
                apply_force(c, a, b, 0.5 * (h + following) + c.end_weight * h)
            else:
                apply_force(c, a, b, c.end_weight * h)
                end_contact(p, c)
        stirred = anew
        if rest < pairs:
            stirred = call_coast(address(w, COAST), w, pairs - rest, (h, 0.5 * (h + following))) or anew
        w.kicks += closed
        if rest == pairs and done <= 1 and following == h and closed > w.crowd:
            count = min(BLOCK, (until - t) / h)
            if count > LEAST_COASTED and ready(w, START_COASTING):
                rest, spacing = call_start_coasting(address(w, START_COASTING), w, pairs, h, count), h
        h = following
    w.twists = TWIST_ALWAYS
    for i in range(bodies):
        settle(body_at(w.bodies, whole_at(w.island_bodies, i)))
    return t


@jit_inside
def travel(w, bodies, longer):
    """Note how far surfaces went in a substep, and may go in the next one, which is so many times longer.

    Who presses on them is counted anew.
    """
    for i in range(bodies):
        b = body_at(w.bodies, whole_at(w.island_bodies, i))
        way = norm(load(b.shift)) + (b.reach * norm(load(b.twist)) if b.reach > 0.0 else 0.0)
        b.path += way
        b.next_path = longer * way
        b.pressing = 0


@jit_inside
def lost(w, bodies, time):
    """Whether the surface of a body of an island has gone nowhere, or further than it can in a time [s]."""
    out = False
    for i in range(bodies):
        out = out or not body_at(w.bodies, whole_at(w.island_bodies, i)).path < LOST * time
    return out


@jit_inside
def forces(w, pairs, span, few):
    """Advance all contacts by the substep that has passed; returns how many are closed.

    The second result is the shortest substep [s] that one would have which has touched, or is about to. span: lengths
    [s] of this substep and of the next; few: see `substeps_of`. An open pair is met in the substep before it touches,
    for its gap there.
    """
    closed, news = 0, NEVER
    for i in range(pairs):
        p = near_at(w.near, whole_at(w.island_pairs, i))
        a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
        if p.closed == 0:
            near = AHEAD * (a.next_path + b.next_path)
            if a.path + b.path + near < p.path_limit:
                continue
            before = -p.gap
            gap, stride = known_gap(w, p, a, b)
            near = min(near, AHEAD * (span[1] / span[0]) * stride)
            if gap <= near:
                overlap, n, arm_a, arm_b = over_plane(w, p, a, b)
                if overlap > -near:
                    overlap, n, arm_a, arm_b = meet_near(w, p, a, b)
                gap = -overlap
                if 0.0 <= gap < AHEAD * span[1] * closing_at(a, arm_a, b, arm_b, n):
                    own = touch_duration(w, p) / substeps_of(w, p, few)
                    news = min(news, own if own < LEAST_CHANGE * span[1] else NEVER)
            p.gap = gap
            p.path_limit = gap + a.path + b.path
            keep_gap(w, p, a.time if b.still != 0 else b.time)
            if gap >= 0.0 or not begin_contact(w, whole_at(w.island_pairs, i), min(before, 0.0)):
                continue
            news = min(news, longest_substep(w, contact_at(w.contacts, p.slot), a, b, substeps_of(w, p, False)))
        measure(w, contact_at(w.contacts, p.slot), a, b)
        a.pressing += 1
        b.pressing += 1
    for i in range(pairs):
        p = near_at(w.near, whole_at(w.island_pairs, i))
        if p.closed != 0:
            c = contact_at(w.contacts, p.slot)
            advance(w, c, p.slot, span)
            if c.touch.overlap > 0.0:
                closed += 1
    return closed, news


@jit_inside
def length(w, pairs, t):
    """Length [s] that the next substeps should have, at most that of the step.

    What parts slowly falls back: who would touch within the next ones is given one of its impact. Bodies that joints
    hold go past much that they never touch: of them only those that are about to.
    """
    closed, h = 0, w.step
    for i in range(pairs):
        p = near_at(w.near, whole_at(w.island_pairs, i))
        closed += p.closed
        body_at(w.bodies, p.body_a).square_rate, body_at(w.bodies, p.body_b).square_rate = 0.0, 0.0
    for i in range(pairs):
        add_square_rate(w, near_at(w.near, whole_at(w.island_pairs, i)))
    few = closed <= w.crowd
    for i in range(pairs):
        p = near_at(w.near, whole_at(w.island_pairs, i))
        if p.closed != 0:
            a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
            h = min(h, longest_substep(w, contact_at(w.contacts, p.slot), a, b, substeps_of(w, p, few)))
    for i in range(pairs):
        p = near_at(w.near, whole_at(w.island_pairs, i))
        if p.closed == 0:
            a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
            if closed == 0:
                h = min(h, STRIDE / max(turn_rate(a), turn_rate(b), 1e-9))
            soon = (AHEAD if jointed(a) or jointed(b) else 2.0 * BLOCK) * h
            if p.path_limit - a.path - b.path <= soon * greatest_closing(a, b):
                foresee(w, p, t)
                p.path_limit = p.gap + a.path + b.path
                if time_to_close(max(p.gap, 0.0), p.closing, max(p.acceleration, 0.0)) < soon:
                    h = min(h, touch_duration(w, p) / substeps_of(w, p, few))
    return h


@jit_inside
def substeps_of(w, p, few):
    """Substeps that an impact of a pair should have; few: contacts of its island are closed.

    In a crowd, and where joints hold bodies together, what is damped forgets its errors; what is elastic adds them up.
    """
    damped = law_of(w, pair_at(w.pairs, p.pair)).zeta > 0.0
    if few:
        joints = jointed(body_at(w.bodies, p.body_a)) or jointed(body_at(w.bodies, p.body_b))
        return w.substeps / JOINTED if damped and joints else w.substeps
    return w.crowd_substeps if damped else max(w.crowd_substeps, ELASTIC)


@jit_inside
def jointed(b):
    """Whether joints hold a body to others."""
    return b.tree != 0 and tree_at(b.tree, 0).count > 1


@jit_inside
def foresee(w, p, t):
    """Look at an open pair, if nobody has at this time."""
    if p.checked != t:
        predict(w, p, body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b), t, w.step - t)


@jit_inside
def kept(w, pairs, target):
    """The length of substeps [s] that closed contacts had before the window, if it may stay; else the target."""
    last = NEVER
    for i in range(pairs):
        p = near_at(w.near, whole_at(w.island_pairs, i))
        if p.closed != 0:
            c = contact_at(w.contacts, p.slot)
            if c.touch.force > 0.0:
                last = min(last, c.interval)
    return last if alike(target, last) else target


@jit_inside
def alike(target, length):
    """Whether substeps may keep their length though they should have another."""
    return LEAST_CHANGE * length < target < length / LEAST_CHANGE
