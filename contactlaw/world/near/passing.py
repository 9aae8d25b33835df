"""Trees of bodies that an engine's own step has taken past all that they could touch: the world need not fly them.

Known of each pair of shapes are its gap at both ends of the step, and how fast it closes there. A gap that closes first
and opens then is at least where the tangents of both ends meet, as the distance of what is convex is convex; what else
may be in between is some part of what the speeds change by. These tell nothing of a point at an arm r that turns by an
angle theta and closes as fast at both ends: it is off its chord by r theta^3/(72 sqrt(3)) at most. So a graze within a
step that turns by `FURTHEST_TURN` may be missed where it is shallower than 0.8 % of r.
"""

from __future__ import annotations

from contactlaw.jit import jit_inside
from contactlaw.world.bodies.motion import closing_at, is_static
from contactlaw.world.data.access import body_at, guard_at, near_at, tree_at, world_at
from contactlaw.world.data.records import BOUNDED, MEASURED, PASSES, STAYS
from contactlaw.world.data.vec import load, norm, sub
from contactlaw.world.near.guards import fastest, follow, is_guarded, is_outgrown, keep_gap, parts_through
from contactlaw.world.shapes.geometry import meet_near

FURTHEST_TURN = 1.0  # [rad] of a body in a step that passes
DOUBT = 0.125  # of a step, times the change of a closing speed: by how much a gap may be less


@jit_inside
def find_passing(world):
    """Which trees pass of those that are asked about; their bodies are where they are at the end of the step.

    world: its address. The near pairs know gap and closing speed of the step's start, see `step.find_pressed`.
    """
    w = world_at(world, 0)
    for i in range(w.body_count):
        b = body_at(w.bodies, i)
        if passes(b):
            way = norm(sub(load(b.position), load(b.listed_position))) + b.turned * b.reach
            if way > b.margin or w.step * norm(load(b.spin)) > FURTHEST_TURN:
                tree_at(b.tree, 0).passes = STAYS
            if way + 2.0 * w.step * (norm(load(b.velocity)) + b.reach * norm(load(b.spin))) > b.margin:
                w.stale = 1
    for k in range(w.guard_count):
        g = guard_at(w.guards, k)
        before, pace = g.speed, g.speed_now
        follow(w, g, w.step)
        g.parted = 1 if parts_through(w, g, pace) else 0
        if is_outgrown(w, g, 2.0 * w.step):
            w.stale = 1
        if g.moved + w.step * max(before, g.speed) > g.limit:
            for one in (body_at(w.bodies, g.body_a), body_at(w.bodies, g.body_b)):
                if passes(one):
                    tree_at(one.tree, 0).passes = STAYS
    found = True
    first = True
    while found:
        found = False
        for k in range(w.nears):
            p = near_at(w.near, k)
            a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
            if not (passes(a) or passes(b)):
                continue
            if not (keeps(a) and keeps(b)) or (first and touches(w, p, a, b)):
                for one in (a, b):
                    if passes(one):
                        tree_at(one.tree, 0).passes = STAYS
                        found = True
        first = False
    for i in range(w.body_count):
        b = body_at(w.bodies, i)
        if passes(b):
            tree_at(b.tree, 0).passes = PASSES


@jit_inside
def passes(b):
    """Whether a body is one of a tree that may pass."""
    return b.tree != 0 and tree_at(b.tree, 0).passes != STAYS


@jit_inside
def keeps(b):
    """Whether a body is where the engine has it, or stands."""
    return is_static(b) or b.asleep != 0 or passes(b)


@jit_inside
def touches(w, p, a, b):
    """Whether a pair may have touched within the step; the next one is left with its gap."""
    speed = max(p.closing_bound, fastest(w, p, a, b))  # at both ends
    if p.guard >= 0 and guard_at(w.guards, p.guard).parted != 0:
        return False
    if is_guarded(w, p, 0.0, w.step * speed):
        p.gap, p.checked = p.listed_gap - guard_at(w.guards, p.guard).moved, BOUNDED
        return False
    if p.gap > 2.0 * w.step * speed:
        p.gap -= w.step * speed
        p.checked = BOUNDED
        return False
    before, began = p.gap, p.closing if p.checked == MEASURED else speed
    overlap, n, arm_a, arm_b = meet_near(w, p, a, b)
    now = closing_at(a, arm_a, b, arm_b, n)
    p.gap, p.closing, p.checked = -overlap, now, MEASURED
    keep_gap(w, p, 0.0)
    change = abs(now - began)
    closes, opens = began + 0.5 * change, 0.5 * change - now  # an engine's velocities may be half a step behind
    dip = DOUBT * change + (closes * opens / (closes + opens) if closes > 0.0 and opens > 0.0 else 0.0)
    return min(before, p.gap) <= w.step * dip
