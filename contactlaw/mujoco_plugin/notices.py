"""What the compiled callbacks notice is told to Python, once for each contact of a model and mjData."""

from __future__ import annotations

from contactlaw.memory import set_whole, whole_at
from contactlaw.mujoco_plugin.free import jit
from contactlaw.mujoco_plugin.memory import call_report
from contactlaw.pair import DEEPEST
from contactlaw.world.access import contact_at, near_at, pair_at, world_at
from contactlaw.world.call import raise_later, waits
from contactlaw.world.clear import is_clear

DEEP, FULL, DAMAGED, UNCLEAR_RADIUS, SWITCHED_OFF, UNSAVED, EDITED = (1 << bit for bit in range(7))


@jit
def notice(head, code, value):
    """Tell Python, the first time."""
    head.told, head.told_a, head.told_b = 0, -1, -1
    tell(head, code, value)


@jit
def notice_of(head, c, code, value):
    """Tell Python of a contact, of each instance the first time."""
    head.told, head.told_a = whole_at(head.instances, c.pair), whole_at(head.geoms, c.shape_a)
    head.told_b = whole_at(head.geoms, c.shape_b)
    tell(head, code, value)


@jit
def tell(head, code, value):
    """The same of what the head holds."""
    said = whole_at(head.said, head.told)
    if said & code == 0 and not waits(world_at(head.world, 0).demand):
        set_whole(head.said, head.told, said | code)
        tell_of(head, code, value)


@jit
def tell_of(head, code, value):
    """The same, every time."""
    table = world_at(head.world, 0).demand
    call_report(head.report, head.own, code, value)
    raise_later(table)


@jit
def look_over(head, w):
    """Tell of overlaps beyond Hertz, of radii that are not clear, and of contacts that there was no room for."""
    for k in range(w.nears):
        p = near_at(w.near, k)
        if p.slot < 0:
            continue
        c = contact_at(w.contacts, p.slot)
        if c.deepest > DEEPEST * c.touch.radius:
            notice_of(head, c, DEEP, c.deepest / c.touch.radius)
        if pair_at(w.pairs, c.pair).radius == 0.0 and not is_clear(w, c):
            notice_of(head, c, UNCLEAR_RADIUS, c.touch.radius)
    if w.lost > 0:
        notice(head, FULL, float(w.contact_room))
        w.lost = 0
