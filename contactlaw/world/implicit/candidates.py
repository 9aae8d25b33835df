"""Which pairs an implicit step looks at: those that can close in it by how far their bodies may move.

A list of near pairs holds all of these, however old it is. So a step does not depend on when pairs were listed, and is
accepted only if no body has moved further (`stayed_within`). Where something strikes, impacts may throw bodies
further: bounds on changes of velocity spread from there as in `window.activate`.
"""

from contactlaw.jit import jit_module
from contactlaw.memory import whole_at
from contactlaw.world import window
from contactlaw.world.data.access import body_at, guard_at, near_at
from contactlaw.world.data.records import NEVER, STRIKES
from contactlaw.world.implicit.acceptance import strikes
from contactlaw.world.near import guards
from contactlaw.world.shapes.geometry import meet_near


def activate(w):
    """Activate the pairs that are closed or can close in the step; return whether a sleeping body is in one."""
    for n in range(w.near_body_count):
        body_at(w.bodies, whole_at(w.near_bodies, n)).active = 0
    for k in range(w.nears):
        p = near_at(w.near, k)
        if p.closed != 0:
            body_at(w.bodies, p.body_a).active, body_at(w.bodies, p.body_b).active = 1, 1
    for k in range(w.nears):
        p = near_at(w.near, k)
        a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
        p.active = 0
        if not window.is_left_out(a, b) and (p.closed != 0 or is_within_reach(w, p, a, b)):
            p.active = STRIKES if strikes(w, p) else 1
    return window.spread(w, 0.0, w.step)


def is_within_reach(w, p, a, b):
    """Return whether an open pair can close by as far as its bodies may move in the step.

    Lower bounds on the gap depend on when the pair was listed, so they only save the measurement.
    """
    known = max(guards.known_gap(w, p, 0.0), p.gap if p.checked == 0.0 else -NEVER)
    return known <= a.way + b.way and -meet_near(w, p, a, b)[0] <= a.way + b.way


def is_any_thrown(w):
    """Return whether anything strikes: what impacts may throw can depend on which pairs are listed."""
    thrown = False
    for n in range(w.near_body_count):
        thrown = thrown or body_at(w.bodies, whole_at(w.near_bodies, n)).delta_v > 0.0
    return thrown


def stayed_within(w, bodies):
    """Return whether the bodies of an island have moved no further than what is listed allows for."""
    for i in range(bodies):
        b = body_at(w.bodies, whole_at(w.island_bodies, i))
        if b.path > b.way and guards.has_shapes(b):
            return False
    root = window.root_of(w, whole_at(w.island_bodies, 0))
    for k in range(w.guard_count):
        g = guard_at(w.guards, k)
        if root in (window.root_of(w, g.body_a), window.root_of(w, g.body_b)):
            guards.update_moved(w, g)
            if g.moved > g.limit > guards.EXCEEDED:
                return False
    return True


jit_module(__name__)
