"""What the compiled callbacks notice is told to Python, once for each contact of a model and mjData."""

from __future__ import annotations

from contactlaw.memory import call_report
from contactlaw.mujoco_plugin.free import jit
from contactlaw.pair import DEEPEST
from contactlaw.world.access import contact_at, near_at, set_whole, whole_at

DEEP, FULL, DAMAGED = 1, 2, 4


@jit
def notice(head, contact, code, value):
    """Tell Python of a contact of the model, the first time."""
    said = whole_at(head.said, contact)
    if said & code == 0:
        set_whole(head.said, contact, said | code)
        call_report(head.report, contact, code, value)


@jit
def look_over(head, w):
    """Tell of overlaps beyond Hertz, and of contacts that there was no room for."""
    for k in range(w.nears):
        p = near_at(w.near, k)
        if p.slot >= 0:
            c = contact_at(w.contacts, p.slot)
            if c.deepest > DEEPEST * c.touch.radius:
                notice(head, c.pair, DEEP, c.deepest / c.touch.radius)
    if w.lost > 0:
        notice(head, 0, FULL, float(w.contact_room))
        w.lost = 0
