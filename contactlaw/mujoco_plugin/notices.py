"""What the compiled callbacks notice is told to Python, once for each contact of a model and mjData.

Whether a user has changed the model since the law read it, too: masses, inertia, armature, sizes, places, friction. All
that an mjData has been made of is kept and compared bit by bit in each step; while all fly apart or sleep in each
fourth, and as that ends.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numba import types
from numpy.typing import NDArray

from contactlaw.memory import caller, set_whole, whole_at
from contactlaw.mujoco_plugin import layout
from contactlaw.mujoco_plugin.block import place
from contactlaw.mujoco_plugin.layout import jit
from contactlaw.pair import DEEPEST
from contactlaw.world.data.access import contact_at, near_at, pair_at, world_at
from contactlaw.world.data.call import error_pending, raise_later
from contactlaw.world.shapes.curvature import radius_is_clear

DEEP, BUILT, FULL, DAMAGED, UNCLEAR_RADIUS, SWITCHED_OFF, UNSAVED, EDITED, TOWED = (1 << bit for bit in range(9))
OF_BODIES = ("body_pos", "body_quat", "body_ipos", "body_iquat", "body_mass", "body_inertia")
BITS = "geom_contype", "geom_conaffinity"
OF_GEOMS = (*BITS, "geom_size", "geom_pos", "geom_quat", "geom_friction")
OF_ALL = ("jnt_pos", "jnt_axis", "dof_armature", "dof_damping")
BETWEEN = 32  # numbers between two runs, in less time than another run takes

call_report: Any = caller(types.void(types.int64, types.int64, types.float64))
"""Call void (*function)(int64 block, int64 code, double value) at an address."""


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
    if said & code == 0 and not error_pending(world_at(head.world, 0).demand):
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
    """Tell of overlaps beyond Hertz or taken off, of radii that are not clear, of contacts without room."""
    for k in range(w.nears):
        p = near_at(w.near, k)
        if p.slot < 0:
            continue
        c = contact_at(w.contacts, p.slot)
        if c.deepest > DEEPEST * c.touch.radius:
            notice_of(head, c, DEEP, c.deepest / c.touch.radius)
        if c.initial_overlap > 0.0:
            notice_of(head, c, BUILT, c.initial_overlap / c.touch.radius)
        if pair_at(w.pairs, c.pair).radius == 0.0 and not radius_is_clear(w, c):
            notice_of(head, c, UNCLEAR_RADIUS, c.touch.radius)
    if w.lost > 0:
        notice(head, FULL, float(w.contact_room))
        w.lost = 0


def seen(view: layout.ModelView, bodies: Sequence[int], geoms: Sequence[int]) -> tuple[NDArray, NDArray]:
    """Runs of numbers that the law reads of these bodies and geoms: place of the pointer to the field in the model, in
    words of eight bytes, first, count; and the numbers. What lies between two that are close in memory is among them.

    Shapes (n, 3) and (sum of counts,).
    """
    rows, values = [], [np.zeros(0)]
    places, last = layout.structure("mjModel").fields or {}, -math.inf
    for name in (*OF_BODIES, *OF_GEOMS, *OF_ALL):
        own = getattr(view, name)
        start = own.ctypes.data // 8
        for first, end in _runs(bodies if name in OF_BODIES else geoms if name in OF_GEOMS else range(len(own))):
            first, end = own[:first].nbytes // 8, -(-own[:end].nbytes // 8)
            if 0 <= start + first - last <= BETWEEN:
                rows[-1][2] += start + end - last
            else:
                rows.append([places[name][1] // 8, first, end - first])
            last = start + end
    runs = np.array(rows, np.int64).reshape(-1, 3)
    values += [layout.record_at(start, np.float64, count).copy() for start, count in _places(view.address, runs)]
    return runs, np.concatenate(values)


def _places(model: int, runs: NDArray[np.int64]) -> Iterator[tuple[int, int]]:
    """Address and count of the numbers of runs, see `seen`."""
    for pointer, first, count in runs.tolist():
        yield int(layout.record_at(model + 8 * pointer, np.int64, 1)[0]) + 8 * first, count


def take_note(head: Any) -> dict[str, list[int]]:
    """Note what the numbers are now; returns whose have changed: rows of fields of geoms."""
    view, found = layout.ModelView(int(head["model"])), dict[str, list[int]]()
    runs = layout.record_at(int(head["watch"]), np.int64, 3 * int(head["watch_count"])).reshape(-1, 3)
    kept = int(head["seen"])
    for start, count in _places(view.address, runs):
        now, was = (layout.record_at(place, np.int32, 2 * count) for place in (start, kept))
        changed = start + 4 * np.flatnonzero(now != was)
        for name in OF_GEOMS:
            own = getattr(view, name)
            rows = np.unique((changed - own.ctypes.data) // own.strides[0])
            found.setdefault(name, []).extend(rows[(rows >= 0) & (rows < len(own))].tolist())
        was[:] = now
        kept += 8 * count
    return found


def _runs(numbers: Sequence[int]) -> Iterator[tuple[int, int]]:
    """Whole numbers in order, as ranges."""
    own = np.array(numbers, np.int64)
    for run in np.split(own, np.flatnonzero(np.diff(own) != 1) + 1) if own.size else ():
        yield int(run[0]), int(run[-1]) + 1


@jit
def edited(head):
    """Whether any of them is another than it was."""
    differ, kept = 0, head.seen
    for i in range(head.watch_count):
        start = place(whole_at(head.model, whole_at(head.watch, 3 * i)), whole_at(head.watch, 3 * i + 1))
        count = whole_at(head.watch, 3 * i + 2)
        for k in range(count):
            differ |= whole_at(start, k) ^ whole_at(kept, k)
        kept = place(kept, count)
    return differ != 0
