"""Detection of edits: whether the user has changed the model since the law read it.

All numbers of the model that the world of an `MjData` was made from (masses, inertia, armature, sizes, places,
friction) are copied, and compared bit by bit in each step; in every fourth step, and at its end, while no contact is
possible or all contacts sleep. The heights of height fields, which may be a million, are compared only where an episode
begins: at time zero, and after a reset or a state that was set.
"""

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contactlaw.jit import jit
from contactlaw.memory import same_wholes, whole_at
from contactlaw.mujoco_plugin import layout
from contactlaw.mujoco_plugin.block import checksums, shifted
from contactlaw.mujoco_plugin.layout import data_at

OF_BODIES = ("body_pos", "body_quat", "body_ipos", "body_iquat", "body_mass", "body_inertia")
BITS = "geom_contype", "geom_conaffinity"
OF_GEOMS = ("geom_type", *BITS, "geom_size", "geom_pos", "geom_quat", "geom_friction")
OF_FIELDS = ("hfield_size", "hfield_data")
OF_ALL = ("jnt_pos", "jnt_axis", "dof_armature", "dof_damping", OF_FIELDS[0])
MAX_GAP = 32  # doubles between two ranges that are compared as one: quicker than to begin another range


def watched_ranges(view: layout.ModelView, bodies: Sequence[int], geoms: Sequence[int]) -> tuple[NDArray, NDArray]:
    """Return the ranges of doubles that the law reads of these bodies and geoms, shape (n, 3), and a copy of them.

    A range is: offset of the pointer to the field in mjModel, in words of eight bytes; first double; count. Ranges that
    are close in memory are merged, with what lies between them. The last one is that of the heights.
    """
    rows, values = [], [np.zeros(0)]
    offsets, last = layout.structure("mjModel").fields or {}, -math.inf
    for name in (*OF_BODIES, *OF_GEOMS, *OF_ALL):
        own = getattr(view, name)
        start = own.ctypes.data // 8
        for first, end in _runs_of(bodies if name in OF_BODIES else geoms if name in OF_GEOMS else range(len(own))):
            first, end = own[:first].nbytes // 8, -(-own[:end].nbytes // 8)
            if 0 <= start + first - last <= MAX_GAP:
                rows[-1][2] += start + end - last
            else:
                rows.append([offsets[name][1] // 8, first, end - first])
            last = start + end
    if view.nhfielddata:
        rows.append([offsets[OF_FIELDS[1]][1] // 8, 0, -(-view.hfield_data.nbytes // 8)])
    ranges = np.array(rows, np.int64).reshape(-1, 3)
    values += [layout.record_at(start, np.float64, count).copy() for start, count in _resolved(view.address, ranges)]
    return ranges, np.concatenate(values)


def _resolved(model: int, ranges: NDArray[np.int64]) -> Iterator[tuple[int, int]]:
    """Yield address and count of each range of `watched_ranges`."""
    for pointer, first, count in ranges.tolist():
        yield int(layout.record_at(model + 8 * pointer, np.int64, 1)[0]) + 8 * first, count


def update_watched(head: Any) -> dict[str, list[int]]:
    """Copy the watched numbers of a model again; return the changed rows of each field of geoms and height fields."""
    view, found = layout.ModelView(int(head["model"])), dict[str, list[int]]()
    ranges = layout.record_at(int(head["ranges"]), np.int64, 3 * int(head["range_count"])).reshape(-1, 3)
    kept = int(head["watched"])
    for start, count in _resolved(view.address, ranges):
        now, was = (layout.record_at(place, np.int32, 2 * count) for place in (start, kept))
        changed = start + 4 * np.flatnonzero(now != was)
        for name in (*OF_GEOMS, *OF_FIELDS):
            own = getattr(view, name)
            rows = np.unique((changed - own.ctypes.data) // own.strides[0]) if own.size else changed[:0]
            found.setdefault(name, []).extend(rows[(rows >= 0) & (rows < len(own))].tolist())
        was[:] = now
        kept += 8 * count
    return found


def _runs_of(numbers: Sequence[int]) -> Iterator[tuple[int, int]]:
    """Yield the runs of consecutive integers in a sorted sequence, as (first, end)."""
    own = np.array(numbers, np.int64)
    for run in np.split(own, np.flatnonzero(np.diff(own) != 1) + 1) if own.size else ():
        yield int(run[0]), int(run[-1]) + 1


@jit
def is_edited(head):
    """Return whether any watched number differs from its copy; heights count where an episode begins."""
    goes_on = data_at(head.data, 0).time != 0.0 and checksums(head).token == head.token
    kept = head.watched
    for i in range(head.range_count - head.height_ranges if goes_on else head.range_count):
        start = shifted(whole_at(head.model, whole_at(head.ranges, 3 * i)), whole_at(head.ranges, 3 * i + 1))
        count = whole_at(head.ranges, 3 * i + 2)
        if not same_wholes(start, kept, count):
            return True
        kept = shifted(kept, count)
    return False
