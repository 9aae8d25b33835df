"""Bodies that no contact has touched in a step: they end it where the engine's own step has put them, if they can.

A free body that no contact has touched has flown exactly. Engines turn a body once a step, and leave one that turns by
0.6 rad some 1e-3 of its size beside that. If it is inside another body there, the next step would give it the energy of
an overlap that no motion has made. Such a body ends the step where its exact flight takes it.

A tree that has passed by all shapes need not be integrated by the world. The gap of each near pair is known at both
ends of the step, and so is its closing speed. If a gap closes at first and opens later, it is at least as wide as where
the tangents of both ends meet, as the distance of convex shapes is convex. It may be narrower by DIP_SHARE of the
change of the closing speed, times the step. This does not show a point at an arm r that turns by an angle theta and
closes equally fast at both ends: it leaves its chord by CUBIC r theta^3 at most. So in a step in which a body turns by
MAX_PASSING_TURN, a graze shallower than 0.8 % of r may be missed. A pair that a plane fixed to B separates at both ends
needs no look; there the speed along its normal counts, so that neighbours in an arm, which turn fast and hardly close,
pass by each other.
"""

from math import sqrt

from contactlaw.jit import jit_module
from contactlaw.world.bodies.bounds import IDLE, motion_against
from contactlaw.world.bodies.motion import closing_at, is_static, load_at, set_axes
from contactlaw.world.contacts.touch import release_if_put_deeper
from contactlaw.world.data.access import body_at, contact_at, guard_at, near_at, shape_at, tree_at, world_at
from contactlaw.world.data.kinds import BOX
from contactlaw.world.data.quaternion import store4
from contactlaw.world.data.records import BOUNDED, CERTAIN, CLOSED, LATE, MEASURED, NEVER, UNLISTED
from contactlaw.world.data.saved import restore_body, save_body
from contactlaw.world.data.tree import ASKED, DENIED, PASSES
from contactlaw.world.data.vec import ZERO, cross, dot, load, norm, store, sub, to_body, to_world
from contactlaw.world.near import guards
from contactlaw.world.near.listing import list_near, may_leave_margin, travelled
from contactlaw.world.shapes.geometry import meet_near

MAX_PASSING_TURN = 1.0  # [rad] by which a body may turn against another in a step for its path to count as known
CUBIC = sqrt(3.0) / 216.0  # of h^3 f''', by which f leaves its chord over h where it closes equally fast at both ends
DIP_SHARE = 0.125  # of step times change of closing speed, by which a gap may dip: as a parabola below its chord
FOLLOWS = 2  # value of `BODY.done`: where the engine has the body


def find_pressed(w):
    """Set `pressed` of all bodies that have a closed contact, or that the user has moved into or onto another body.

    For adapters, between two steps. Open pairs of trees that may pass by everything get the gap and the closing speed
    that `find_passing` starts from.
    """
    placed, gaps_needed = False, False
    for i in range(w.body_count):
        b = body_at(w.bodies, i)
        b.pressed = 0
        placed = placed or b.placed != 0
        if b.inverse_mass == 0.0 and not is_static(b) and may_leave_margin(b, w.step):
            w.stale = 1
    if (w.stale != 0 and needs_list(w)) or (placed and guards.any_guard_exceeded(w, -NEVER, 2.0 * w.step)):
        list_near(w)
    for k in range(w.nears if placed else 0):
        p = near_at(w.near, k)
        if p.closed != 0 and body_at(w.bodies, p.body_a).placed + body_at(w.bodies, p.body_b).placed != 0:
            release_if_put_deeper(w, p)
    for slot in range(w.slots if w.spares < w.contact_room else 0):
        c = contact_at(w.contacts, slot)
        if c.phase == CLOSED:
            mark_pressed(body_at(w.bodies, c.body_a))
            mark_pressed(body_at(w.bodies, c.body_b))
    for i in range(w.body_count):  # after closed pairs: a tree that is pressed needs no gaps
        gaps_needed = gaps_needed or needs_gap(body_at(w.bodies, i))
    for k in range(w.guard_count if gaps_needed else 0):
        g = guard_at(w.guards, k)
        if not placed:
            guards.update_guard(w, g, 2.0 * w.step)
        if needs_gap(body_at(w.bodies, g.body_a)) or needs_gap(body_at(w.bodies, g.body_b)):
            separate_at_start(w, g)
    while gaps_needed:
        gaps_needed = False
        for k in range(w.nears):
            p = near_at(w.near, k)
            a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
            if p.closed != 0 or a.pressed + b.pressed == 2 or not (needs_gap(a) or needs_gap(b)):
                continue
            p.closing_bound = guards.closing_bound(w, p, a, b)
            if not gap_suffices(w, p, a, b):
                overlap, n, arm_a, arm_b = meet_near(w, p, a, b)
                p.gap = -overlap
                p.closing = closing_at(a, arm_a, b, arm_b, n)
                p.checked = MEASURED
                slight = IDLE * max(a.size, b.size)
                if overlap > slight or (
                    overlap >= -slight and is_laid_on(w, (a, arm_a), (b, arm_b), n, p.closing, slight)
                ):
                    gaps_needed = placed  # others may lie on what is pressed now
                    mark_pressed(a)
                    mark_pressed(b)


def is_laid_on(w, a, b, n, closing, slight):
    """Return whether the user has put a body on another, without a speed against it: then it rests, and does not fly.

    What acts on them must bring them together by more than `slight` [m] in a step. What is pressed already does not set
    out. a, b: bodies, and their arms to where they meet; n: normal from B to A.
    """
    if a[0].placed + b[0].placed == 0 or w.step * closing > slight:
        return False
    pull_a, pull_b = (load_at(*a) if a[0].pressed == 0 else ZERO), (load_at(*b) if b[0].pressed == 0 else ZERO)
    return w.step * (closing + 0.5 * w.step * dot(sub(pull_b, pull_a), n)) > slight


def gap_suffices(w, p, a, b):
    """Return whether the gap of an open pair need not be measured: the last step has, or a lower bound will do.

    Sets the pair's gap to the lower bound that its guard knows, where there is one.
    """
    slight = IDLE * max(a.size, b.size)  # neighbours must not differ by rounding
    way, known = 2.0 * w.step * p.closing_bound + slight, guards.known_gap(w, p, 0.0)
    if known <= way and p.guard >= 0 and guard_at(w.guards, p.guard).separation > slight:
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


def needs_list(w):
    """Return whether near pairs must be listed before the step if they are stale; else `begin` lists them."""
    needed = w.nears == 0 or w.edited != 0
    for i in range(w.body_count):
        needed = needed or needs_gap(body_at(w.bodies, i))
    return needed


def needs_gap(b):
    """Return whether the user has moved a body, or whether its tree may pass by everything."""
    return b.placed != 0 or (b.tree != 0 and tree_at(b.tree, 0).passes == ASKED)


def leaves_soon(b, step):
    """Return whether a body may leave its margin within two steps [s] at its present velocity."""
    return guards.has_shapes(b) and travelled(b) + 2.0 * step * guards.surface_speed(b, 0.0) > b.margin


def find_passing(world):
    """Find which of the trees that are ASKED pass by everything; their bodies are at the end of the step.

    world: address of the `records.WORLD`. Near pairs must have their gaps and closing speeds at the start of the step,
    see `find_pressed`.
    Sets `denied` if the answer depends on the list of near pairs: UNLISTED if that holds too little; CERTAIN: it does
    not, as none passes, and what keeps them from it overlaps at the end.
    """
    w, unlisted, asked = world_at(world, 0), False, False
    w.denied = 0
    for i in range(w.body_count):
        b = body_at(w.bodies, i)
        b.active, asked = 0, asked or may_pass(b)
        if may_pass(b) and may_leave_margin(b, 0.0):
            unlisted = deny(w, b, i) or unlisted
    for k in range(w.guard_count):
        g = guard_at(w.guards, k)
        if not (may_pass(body_at(w.bodies, g.body_a)) or may_pass(body_at(w.bodies, g.body_b))):
            continue
        guards.update_guard(w, g, w.step)
        g.separated = 1 if stayed_separated(w, g) else 0
        way = w.step * max(g.last_speed_now, g.speed_now)
        furthest = g.moved + 0.5 * max(way - g.last_move, 0.0)  # by the triangle inequality
        if g.separated == 0 and furthest > g.limit:
            unlisted = deny(w, body_at(w.bodies, g.body_a), g.body_a) or unlisted
            unlisted = deny(w, body_at(w.bodies, g.body_b), g.body_b) or unlisted
    found, first, certain = asked, True, True
    while found:
        found = False
        for k in range(w.nears):
            p = near_at(w.near, k)
            a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
            known = end_is_known(w, a, p.body_a) and end_is_known(w, b, p.body_b)
            if not known or (first and (may_pass(a) or may_pass(b)) and may_have_touched(w, p, a, b)):
                news = deny(w, a, p.body_a)
                news = deny(w, b, p.body_b) or news
                certain = certain and (not news or (known and p.checked == MEASURED and p.gap < 0.0))
                found = found or news
        first = False
    passing, sure = False, True
    for i in range(w.body_count):
        b = body_at(w.bodies, i)
        sure = sure and end_is_known(w, b, i)
        if may_pass(b):
            tree_at(b.tree, 0).passes = PASSES
            passing = True
    if w.denied != 0 or (passing and not sure):
        w.denied = UNLISTED if unlisted else CERTAIN if certain and not passing else 1


def deny_late(w, left):
    """Set `denied` to LATE if a tree that has passed may be struck by what an impact of this step has thrown.

    For a list of near pairs that was made within the step, with a time left of it [s]. Twice the ways count, as for
    the list before the step.
    """
    for k in range(w.nears):
        p = near_at(w.near, k)
        a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
        other = b if may_pass(a) else a
        if may_pass(a) != may_pass(b) and not (other.asleep != 0 or is_static(other)):
            speed = guards.surface_speed(a, left) + guards.surface_speed(b, left)
            w.denied = LATE if p.listed_gap < 2.0 * left * speed else w.denied


def deny(w, b, i):
    """Let the tree of body i not pass, if it was asked, or let it wake; return whether that changes anything."""
    if b.asleep != 0:
        first = body_at(w.bodies, i - b.member)
        news, first.active = first.active == 0, 1
        return news
    if b.tree == 0 or tree_at(b.tree, 0).passes != ASKED:
        return False
    tree_at(b.tree, 0).passes = DENIED
    w.denied = 1
    return True


def end_is_known(w, b, i):
    """Return whether it is known where body i ends the step: where it rests, or where the engine has its tree.

    What sleeps rests unless something may wake it whose own end is not known; `active` tells.
    """
    return may_pass(b) or is_static(b) or (b.asleep != 0 and body_at(w.bodies, i - b.member).active == 0)


def may_pass(b):
    """Return whether a body belongs to a tree that may pass by everything."""
    return b.tree != 0 and tree_at(b.tree, 0).passes != DENIED


def may_have_touched(w, p, a, b):
    """Return whether a pair may have touched within the step.

    Unless a plane has separated both throughout, sets the pair's gap at the end of the step, for the next step.
    """
    speed = max(p.closing_bound, guards.closing_bound(w, p, a, b))  # at both ends
    if p.guard >= 0 and guard_at(w.guards, p.guard).separated != 0:
        return False
    known = max(guards.known_gap(w, p, 0.0), p.gap - w.step * speed)
    if speed == 0.0 or known > w.step * speed:  # shapes that lie flush on each other stay so while nothing moves
        p.gap, p.checked = known, BOUNDED
        return False
    if w.step * norm(sub(load(a.spin), load(b.spin))) > MAX_PASSING_TURN:
        return True
    before, began = p.gap, p.closing if p.checked == MEASURED else speed
    overlap, n, arm_a, arm_b = meet_near(w, p, a, b)
    now = closing_at(a, arm_a, b, arm_b, n)
    p.gap, p.closing, p.checked = -overlap, now, MEASURED
    guards.raise_listed_gap(w, p, 0.0)
    change = abs(now - began)
    closes, opens = began + 0.5 * change, 0.5 * change - now  # an engine's velocities may be half a step behind
    dip = DIP_SHARE * change + (closes * opens / (closes + opens) if closes > 0.0 and opens > 0.0 else 0.0)
    return min(before, p.gap) <= w.step * dip


def separate_at_start(w, g):
    """Set by how much [m] a plane separates two cores at the start of a step.

    The last plane is kept while it separates them. Where no parts are listed, it is needed only near the guard's limit.
    """
    g.separation = 0.0
    if shape_at(w.shapes, g.a).kind < BOX:
        return
    if g.unlisted != 0 and g.moved + g.lag + 2.0 * w.step * g.speed_now <= g.limit:
        return
    b = body_at(w.bodies, g.body_b)
    n, low, high = guards.separate(w, g.a, g.b, to_world(b.axes, load(g.normal)))
    if low <= high:
        n, low, high = guards.separate(w, g.a, g.b, ZERO)
    store(g.normal, to_body(b.axes, n))
    g.separation = low - high
    slide, twist = motion_against(body_at(w.bodies, g.body_a), b)
    store(g.slide, slide)
    store(g.twist, twist)


def stayed_separated(w, g):
    """Return whether that plane, fixed to B, has separated both shapes throughout a step of h seconds.

    The height of a point of A over the plane leaves its chord by at most DIP_SHARE h times the change of its speed
    along the normal n, and CUBIC h^3 times its third derivative. With s the velocity of A's centre, w its spin and L
    its reach, at the start (0) and end (1) of the step, that speed changes by at most

        |n . (s1 - s0)| + L (|n x (w1 - w0)| + h |w| |n x w1|)

    which is zero for an arm that turns about n. The third derivative is the speed times the square of the rate at which
    A turns against B. Turns of more than MAX_PASSING_TURN are not judged.
    """
    if g.separation <= 0.0:
        return False
    a, b = body_at(w.bodies, g.body_a), body_at(w.bodies, g.body_b)
    n, h = load(g.normal), w.step
    _, low, high = guards.separate(w, g.a, g.b, to_world(b.axes, n))
    slide, twist = motion_against(a, b)
    rate = max(norm(twist), norm(load(g.twist)))
    turn = h * rate
    if turn > MAX_PASSING_TURN:
        return False
    change = abs(dot(n, sub(slide, load(g.slide))))
    change += a.reach * (norm(cross(n, sub(twist, load(g.twist)))) + turn * norm(cross(n, twist)))
    speed = max(norm(slide), norm(load(g.slide))) + a.reach * rate
    return min(g.separation, low - high) > h * (DIP_SHARE * change + CUBIC * turn * turn * speed)


def may_follow(b):
    """Return whether a body is free and awake, and nothing has touched it in this step."""
    return b.tree == 0 and b.inverse_mass != 0.0 and b.touched == 0 and b.asleep == 0 and b.done == 0


def follow(w, i, position, turn):
    """Put body i where the engine's step has taken it: position [m] of its centre of mass, quaternion of its axes."""
    save_body(w, i)
    b = body_at(w.bodies, i)
    store(b.position, position)
    store4(b.quaternion, turn)
    set_axes(b)
    b.done = FOLLOWS


def part(w):
    """Put bodies that `follow` has put into others back to where they fly in the world, and mark them as touched."""
    found = True
    while found:
        found = False
        for k in range(w.nears):
            p = near_at(w.near, k)
            a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
            if (a.done == FOLLOWS or b.done == FOLLOWS) and meet_near(w, p, a, b)[0] > 0.0:
                found = True
                for i in (p.body_a, p.body_b):
                    if body_at(w.bodies, i).done == FOLLOWS:
                        restore_body(w, i)
                        body_at(w.bodies, i).touched = 1


def overlaps(w, first, count):
    """Return whether any of `count` bodies from a number on overlaps what it is near."""
    for k in range(w.nears):
        p = near_at(w.near, k)
        own = first <= p.body_a < first + count or first <= p.body_b < first + count
        if own and meet_near(w, p, body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b))[0] > 0.0:
            return True
    return False


jit_module(__name__)
