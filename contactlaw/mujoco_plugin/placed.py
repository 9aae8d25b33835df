"""Bodies that the user places: where mjData has them."""

from __future__ import annotations

from contactlaw.mujoco_plugin import layout
from contactlaw.mujoco_plugin.free import jit
from contactlaw.mujoco_plugin.memory import field
from contactlaw.world.access import body_at
from contactlaw.world.motion import set_axes
from contactlaw.world.vec import load, store

XPOS, XQUAT = layout.DATA["xpos"], layout.DATA["xquat"]


@jit
def read_placed(d, w, p):
    """Where such a body is; one that has been turned makes the list of near pairs anew."""
    b = body_at(w.bodies, p.body)
    q = field(d, XQUAT, 4 * p.id, 4)
    store(b.position, load(field(d, XPOS, 3 * p.id, 3)))
    for i in range(4):
        if b.quaternion[i] != q[i]:
            w.stale = 1
        b.quaternion[i] = q[i]
    set_axes(b)
