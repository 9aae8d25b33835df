"""One step of a world: the sequence that engines' adapters and `World` share.

begin                 prepare the step; list near pairs anew if bodies may have left their margins
predict_all           times of impact
take_implicit_steps   islands of persistent contacts go to the end of the step at once (`implicit`)
plan_window           length of the next window from the shortest impact that is going on
activate              pairs that are closed, or that could close in the window
list_islands          bodies that these pairs join
integrate             each island through the window
...                   from window to window; where nothing is closed, straight to the next impact
fly                   all bodies to the end of the step
"""

from contactlaw.jit import jit_module
from contactlaw.memory import whole_at
from contactlaw.world import window
from contactlaw.world.bodies.motion import fly, is_static, settle, update_momentum, wake_body
from contactlaw.world.contacts.meeting import place_along
from contactlaw.world.contacts.pace import LEAST_STEP, resting_duration, stays_closed, update_masses
from contactlaw.world.contacts.touch import has_parted, nears_in_use, release, update_geometry, update_initial_overlap
from contactlaw.world.data.access import body_at, contact_at, guard_at, near_at, shape_at, tree_at
from contactlaw.world.data.call import address, call_on_world, call_step, error_pending, ready
from contactlaw.world.data.demand import IMPLICIT, STEP
from contactlaw.world.data.kinds import TANGENT
from contactlaw.world.data.records import AGED, NEVER, PARTED, PUT, TWIST_ALWAYS
from contactlaw.world.data.tree import PASSES
from contactlaw.world.data.vec import load, store
from contactlaw.world.island import integrate
from contactlaw.world.near.guards import any_guard_exceeded, has_shapes, surface_speed
from contactlaw.world.near.listing import list_near, list_parts_anew, may_leave_margin, travelled, way_ahead
from contactlaw.world.near.passing import deny_late, find_pressed
from contactlaw.world.shapes.geometry import forget_place
from contactlaw.world.sleep import is_disturbed, wake

# of the smallest radius of a body: how far it may move in steps that are made as one. Of 2000 balls in flight 0.1 lists
# no more pairs than single steps do; without a limit steps of 0.2 ms took nine times as long
FAR = 0.1
FIND_PRESSED, FIXED_ROOM, GROWING_ROOM = range(3)  # tasks of `step_once`
LATE_IMPACT = 1e-6  # durations of an impact: one that begins within this of the end of the step is left to the next
REMAINDER = 0.01  # of a window: it is extended to the end of the step if no more than this would be left
SHORTEST = 1e-6  # of a step: least length of a window


def step(world, dt, count):
    """Move a world by up to `count` steps of dt [s]; return how many were made.

    It stops before a step for which the arrays may be too small, and after one in which an exception was kept or a body
    was lost.

    world: array of one `records.WORLD`, with the addresses of its arrays. Between two calls the user may change
    positions, velocities and accelerations.
    """
    w, made = world[0], 0
    while made < count:
        w.together = steps_together(w, dt, count - made)
        if not (ready(w, STEP) and call_step(address(w, STEP), w, w.together * dt, GROWING_ROOM)):
            break
        made += w.together
        if error_pending(w.demand) or w.lost_body > 0:
            break
    for slot in range(w.slots):  # `release` has looked at those that are free
        c = contact_at(w.contacts, slot)
        w.deepest = max(w.deepest, c.deepest / c.touch.radius)
    return made


def steps_together(w, dt, left):
    """Return how many of the steps of dt [s] that are left are made as one; the last is made alone, for readings.

    In a crowd of persistent contacts steps shorter than an impact are joined up to a window in which no body moves far:
    near pairs stay few. Steps remain single where they set accuracy: of few contacts, of trees, of bodies that tumble.
    """
    shortest, length, _ = window.plan_window(w)
    time = length if dt <= shortest < length else 0.0
    for i in range(w.body_count if time > 0.0 else 0):
        b = body_at(w.bodies, i)
        if b.tree != 0 or b.isotropic == 0:
            return 1
        if b.size > 0.0 and b.inverse_mass != 0.0:
            time = min(time, FAR * b.size / surface_speed(b, time))
    return max(int(min(time / dt, left - 1.0)), 1)


def step_once(w, dt, task):
    """Do one task: FIND_PRESSED calls `find_pressed`; FIXED_ROOM and GROWING_ROOM move the world by one step of dt [s].

    With GROWING_ROOM it returns False instead of making the step if the arrays of near pairs, guards or contacts are
    more than half full, or were too small: the caller enlarges them first. One function has the three tasks, so that
    their common code is compiled once.
    """
    w.step = dt
    if task == FIND_PRESSED:
        find_pressed(w)
        return True
    begin(w)
    full = 2 * w.nears > w.near_room or 2 * w.guard_count > w.guard_room or 2 * w.spares < w.contact_room
    if task == GROWING_ROOM and (full or w.lost + w.left_out > 0):
        w.stale = 1
        return False
    finish(w)
    return True


def finish(w):
    """Integrate from window to window to the end of the step that `begin` has prepared.

    A list of an earlier step serves while nothing that it holds can strike. What it has left out cannot: what remains
    of both margins is more than the sum of both ways, see `listing.may_leave_margin`.
    """
    now, dt = 0.0, w.step
    while now < dt:
        if w.stale != 0:
            list_near(w)
            deny_late(w, dt - now)
        first, pairs = window.predict_all(w, now, dt)
        if now == 0.0 and w.together == 1 and take_implicit_steps(w):
            first, pairs = window.predict_all(w, now, dt)
        shortest, length, watched = window.plan_window(w)
        if now == 0.0 and min(first, shortest) == NEVER:  # implicit steps alone: the next list may last
            w.age = min(w.age, AGED)
        elif w.age == AGED and min(first, shortest) < NEVER:
            window.list_anew(w, 1)
            first, pairs = window.predict_all(w, now, dt)
        if shortest == NEVER:
            touching = False
            while first < dt and not touching:
                now = max(now, first)
                touching, length, watched = window.shortest_new_impact(w, now, pairs)
                if not touching:
                    first, pairs = window.predict_all(w, now, dt, pairs)
            if not touching or (length < NEVER and dt - now <= LATE_IMPACT * length):
                break
        length = max(length, SHORTEST * dt)
        until = now + length
        if not dt - until > REMAINDER * length:
            until = dt
        while window.activate(w, now, until) and wake(w, now, False):
            pass
        window.list_islands(w, window.join_loose(w, until - now) if watched else -1)
        for k in range(w.islands):
            until = integrate(w, whole_at(w.roots, k), now, until)
        now = until
        check_margins(w, dt - now)
    for k in range(w.body_count):
        b = body_at(w.bodies, k)
        fly(b, dt)
        b.placed = 0
    w.edited = 0


def take_implicit_steps(w):
    """Call `implicit.step.take_implicit_steps`; return whether it has changed bodies, or near pairs.

    Only if a moving body has contacts that cannot part, see `pace.stays_closed`, for one of which the step is long. One
    that can part keeps its body, or all of a tree, from it: then the gaps around it need not be found.
    """
    for n in range(w.near_body_count):
        body_at(w.bodies, whole_at(w.near_bodies, n)).active = 0
    for order in range(2):
        for k in range(nears_in_use(w)):
            p = near_at(w.near, k)
            a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
            if p.closed == 0 or window.is_left_out(a, b):
                continue
            c = contact_at(w.contacts, p.slot)
            first_a, first_b = body_at(w.bodies, p.body_a - a.member), body_at(w.bodies, p.body_b - b.member)
            if order == 0 and not stays_closed(c, a, b):
                first_a.active, first_b.active = 1 - a.still, 1 - b.still
            if order == 1 and first_a.active + first_b.active == 0 and LEAST_STEP * resting_duration(w, c) <= w.step:
                return ready(w, IMPLICIT) and call_on_world(address(w, IMPLICIT), w)
    return False


def begin(w):
    """Prepare a step: bodies, guards, slots of contacts; list near pairs anew if the list is out of date."""
    w.twists, w.rested, w.lost_body = TWIST_ALWAYS, 1, 0
    for i in range(w.body_count):
        begin_body(w, body_at(w.bodies, i))
    for k in range(w.guard_count):
        guard_at(w.guards, k).found = -1.0
    exceeded = w.stale == 0 and any_guard_exceeded(w, w.step, 0.0)
    begin_pairs(w)
    if w.stale != 0:
        window.list_anew(w, w.brief)
    elif exceeded:
        list_parts_anew(w)
    for k in range(nears_in_use(w)):
        p = near_at(w.near, k)
        if p.slot >= 0:
            c = contact_at(w.contacts, p.slot)
            store(c.earlier, load(c.impulse))
            p.place[2] = place_along(c, shape_at(w.shapes, p.a), body_at(w.bodies, p.body_a))
            if p.closed != 0 and shape_at(w.shapes, p.b).kind == TANGENT:  # the engine has placed this plane anew
                update_geometry(w, c)
            if p.closed != 0 and w.edited != 0:
                update_masses(c, body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b))


def begin_body(w, b):
    """Prepare a body for a step: wake it if it is disturbed, and check that it stays in its margin.

    A tree that passes by everything is at the end of the step already.
    """
    passes = b.tree != 0 and tree_at(b.tree, 0).passes == PASSES
    b.time = w.step if passes else 0.0
    b.changed = 1
    b.touched = 0
    b.done = 1 if passes else 0
    store(b.shift, (0.0, 0.0, 0.0))
    store(b.twist, (0.0, 0.0, 0.0))
    if b.tree != 0 and b.member == 0 and not passes:
        tree_at(b.tree, 0).span = w.step
        settle(b)
    if b.asleep != 0 and (w.edited != 0 or is_disturbed(b)):
        wake_body(b, 0.0)
        settle(b)
    update_momentum(b)
    b.still = 1 if b.asleep != 0 or (is_static(b) and b.placed < PUT) else 0  # what is put somewhere may wake others
    w.rested = min(w.rested, b.still)
    b.way = way_ahead(b, w.step - b.time)
    if has_shapes(b) and travelled(b) + b.way > b.margin:
        w.stale = 1


def begin_pairs(w):
    """Discard predictions of the last step, and release slots of contacts that parted in it.

    A contact with an initial overlap keeps its slot while its shapes overlap. Pairs of trees that pass by everything
    keep the gaps found by `near.passing`.
    """
    for k in range(w.nears):  # in the order of `state.write`, which sums the same ledgers
        p = near_at(w.near, k)
        forget_place(p)
        if body_at(w.bodies, p.body_a).done == 0 and body_at(w.bodies, p.body_b).done == 0:
            p.checked = -1.0
        if has_parted(p):
            release(w, p.slot)
            p.slot = -1
    for slot in range(w.slots if w.spares < w.contact_room else 0):
        c = contact_at(w.contacts, slot)
        if c.phase == PARTED and c.initial_overlap == 0.0:  # its pair is no longer listed
            release(w, slot)
    for k in range(nears_in_use(w)):
        p = near_at(w.near, k)
        if p.slot >= 0 and p.closed == 0 and not update_initial_overlap(w, p):
            release(w, p.slot)
            p.slot = -1


def check_margins(w, left):
    """Mark the list of near pairs as out of date if a body could leave its margin in the time left of the step [s].

    If only limits of guards could be left, the parts of their shapes are listed at once.
    """
    for n in range(w.near_body_count):
        b = body_at(w.bodies, whole_at(w.near_bodies, n))
        if b.changed != 0 and b.done == 0 and may_leave_margin(b, left):
            w.stale = 1
    if any_guard_exceeded(w, w.step, 0.0):
        if left > 0.0 and w.stale == 0:
            list_parts_anew(w)
            deny_late(w, left)
        else:
            w.stale = 1


jit_module(__name__)
