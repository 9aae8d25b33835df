"""Whether a user has changed the model since the law read it: masses, inertia, armature, sizes, places, friction.

What an mjData's world was made of is kept and compared bit by bit in each step, at a tenth of a nanosecond a number.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numba import types
from numpy.typing import NDArray

from contactlaw.memory import load_pointer, whole_at
from contactlaw.mujoco_plugin import layout
from contactlaw.mujoco_plugin.free import jit
from contactlaw.mujoco_plugin.memory import place

OF_BODIES = ("body_mass", "body_inertia", "body_pos", "body_quat", "body_ipos", "body_iquat")
OF_GEOMS = ("geom_size", "geom_pos", "geom_quat", "geom_friction")
OF_ALL = ("jnt_pos", "jnt_axis", "dof_armature", "dof_damping")


def seen(view: layout.ModelView, bodies: Sequence[int], geoms: Sequence[int]) -> tuple[NDArray, NDArray]:
    """Runs of numbers that the law reads of these bodies and geoms: offset of the field, first, count; and the numbers.

    Shapes (n, 3) and (sum of counts,).
    """
    rows, values = [], [np.zeros(0)]
    for name in (*OF_BODIES, *OF_GEOMS, *OF_ALL):
        own = getattr(view, name)
        for first, last in _runs(bodies if name in OF_BODIES else geoms if name in OF_GEOMS else range(len(own))):
            rows.append((layout.MODEL[name], own[:first].size, own[first:last].size))
            values.append(own[first:last].ravel())
    return np.array(rows, np.int64).reshape(-1, 3), np.concatenate(values)


def _runs(numbers: Sequence[int]) -> Iterator[tuple[int, int]]:
    """Whole numbers in order, as ranges."""
    own = np.array(numbers, np.int64)
    for run in np.split(own, np.flatnonzero(np.diff(own) != 1) + 1) if own.size else ():
        yield int(run[0]), int(run[-1]) + 1


@jit
def edited(m, head):
    """Whether any of them is another than it was."""
    differ, kept = 0, head.seen
    for i in range(head.watch_count):
        start = place(load_pointer(m + types.uintp(whole_at(head.watch, 3 * i))), whole_at(head.watch, 3 * i + 1))
        count = whole_at(head.watch, 3 * i + 2)
        for k in range(count):
            differ |= whole_at(start, k) ^ whole_at(kept, k)
        kept = place(kept, count)
    return differ != 0
