"""Round shapes on others that the world has no closed form for: the engine's narrow phase says where they are nearest.

The other shape is a plane of its body, through the point that is nearest to the sphere and across the way there. A
convex body lies behind this plane: no touch comes sooner, and the plane is placed anew whenever the world looks ahead,
so that the sphere meets the body where it is. A capsule is the sphere around the nearest point of its middle line.
"""

from __future__ import annotations

from functools import lru_cache

from numba import types

from contactlaw.jit import address_of
from contactlaw.mujoco_plugin import layout
from contactlaw.mujoco_plugin.block import head_at, probe_at
from contactlaw.mujoco_plugin.free import jit
from contactlaw.mujoco_plugin.memory import field, floats
from contactlaw.world.access import body_at, shape_at, world_at
from contactlaw.world.call import PROBE
from contactlaw.world.motion import fly
from contactlaw.world.vec import add, axpy, cross, dot, load, norm, scale, store, sub, tangent, to_body, to_world

XPOS, XMAT = layout.DATA["geom_xpos"], layout.DATA["geom_xmat"]
FAR = 1e6  # [m]; how far the engine is asked to look

geom_distance = types.ExternalFunction(
    "mj_geomDistance", types.float64(types.uintp, types.uintp, types.intc, types.intc, types.float64, types.uintp)
)


def probe(host, now):
    """Place all such planes where the bodies are at a time [s] of the step; host: address of the block."""
    head = head_at(host, 0)
    w = world_at(head.world, 0)
    for i in range(head.probe_count):
        place(w, head, probe_at(head.probes, i), now)


@jit
def place(w, head, p, now):
    """Place one plane; where the engine finds no distance, beyond what the sphere may reach."""
    s, t = shape_at(w.shapes, p.sphere), shape_at(w.shapes, p.plane)
    a, b = body_at(w.bodies, s.body), body_at(w.bodies, t.body)
    fly(a, now)
    fly(b, now)
    middle = add(load(a.position), to_world(a.axes, load(p.middle)))
    own = add(load(b.position), to_world(b.axes, load(p.at)))
    half = to_world(a.axes, load(p.line))
    store(field(head.data, XPOS, 3 * p.geom_a, 3), middle)
    store(field(head.data, XPOS, 3 * p.geom_b, 3), own)
    point_along(field(head.data, XMAT, 9 * p.geom_a, 9), half)
    turn(head, p, b)
    ends = head.ends
    gap = geom_distance(
        types.uintp(head.model),
        types.uintp(head.data),
        int(p.geom_a),
        int(p.geom_b),
        FAR,
        types.uintp(ends.ctypes.data),
    )
    foot = (ends[3], ends[4], ends[5])
    if dot(half, half) > 0.0:
        along = max(min(dot(sub(foot, middle), half) / dot(half, half), 1.0), -1.0)
        store(s.at, axpy(along, load(p.line), load(p.middle)))
        middle = axpy(along, half, middle)
    # from the middle, not from the other end: where the two surfaces touch, these are one point
    way = sub(middle, foot)
    if gap == 0.0 or gap >= FAR or norm(way) == 0.0:
        foot, way = own, sub(middle, own)
    store(t.normal, to_body(b.axes, scale(1.0 / max(norm(way), 1e-300), way)))
    store(t.at, to_body(b.axes, sub(foot, load(b.position))))


@jit
def point_along(frame_out, half):
    """Turn a geom so that its third axis is that of a capsule; how a sphere is turned makes no difference."""
    if dot(half, half) > 0.0:
        e = scale(1.0 / norm(half), half)
        u = tangent(e)
        v = cross(e, u)
        for i in range(3):
            frame_out[3 * i], frame_out[3 * i + 1], frame_out[3 * i + 2] = u[i], v[i], e[i]


@jit
def turn(head, p, b):
    """Tell the engine how the other shape is turned."""
    frame = field(head.data, XMAT, 9 * p.geom_b, 9)
    for i in range(3):
        for j in range(3):
            frame[3 * i + j] = 0.0
            for k in range(3):
                frame[3 * i + j] += b.axes[3 * i + k] * p.frame[3 * k + j]


@jit
def exchange(head, back):
    """Exchange where the engine has these geoms with what was noted, or back: the last one first, as one may be in
    several probes."""
    kept, n = floats(head.kept, 0, 24 * head.probe_count), head.probe_count
    for i in range(n):
        k = n - 1 - i if back else i
        p, at = probe_at(head.probes, k), 24 * k
        at = swap(field(head.data, XPOS, 3 * p.geom_a, 3), kept, at)
        at = swap(field(head.data, XPOS, 3 * p.geom_b, 3), kept, at)
        at = swap(field(head.data, XMAT, 9 * p.geom_a, 9), kept, at)
        at = swap(field(head.data, XMAT, 9 * p.geom_b, 9), kept, at)


@jit
def swap(here, kept, at):
    """Exchange numbers; returns the place behind them."""
    for i in range(here.size):
        here[i], kept[at + i] = kept[at + i], here[i]
    return at + here.size


@lru_cache
def address_of_probe() -> int:
    """Address of `probe`, compiled where there are such shapes."""
    return address_of(probe, PROBE, layout.KEY)
