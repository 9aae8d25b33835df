"""What the compiled callbacks notice: edits of the model, and what they report to Python.

All numbers of the model that the world of an `MjData` was made from (masses, inertia, armature, sizes, places,
friction) are copied, and compared bit by bit in each step; in every fourth step, and at its end, while no contact is
possible or all contacts sleep. The heights of height fields, which may be a million, are compared only where an episode
begins: at time zero, and after a reset or a state that was set.

Each report is given once for each plugin instance of a compiled model. The codes are bits of `reported`, the word in
which the blocks of all `MjData` of a model note what has been reported of an instance.
"""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numba import types
from numpy.typing import NDArray

from contactlaw.jit import jit_module
from contactlaw.memory import caller, same_wholes, set_whole, whole_at
from contactlaw.mujoco_plugin import layout
from contactlaw.mujoco_plugin.block import checksums, shifted
from contactlaw.mujoco_plugin.layout import data_at
from contactlaw.world.contacts.touch import nears_in_use
from contactlaw.world.data.access import contact_at, near_at, world_at
from contactlaw.world.data.call import error_pending, raise_later
from contactlaw.world.readout import DOUBTFUL, DOUBTS, PUT_IN, doubt_value, doubts_of

FULL, LEFT_OUT, DAMAGED, SWITCHED_OFF, UNSAVED, EDITED, TOWED, SLEEPS = (1 << bit for bit in range(len(DOUBTS), 12))
READERS = 1 << 12  # those of `instances.unserved_readers`

TEXTS = DOUBTFUL | {
    EDITED: "the model has been edited, and the law keeps the old values: ",
    PUT_IN: f"{DOUBTFUL[PUT_IN]}; overlaps='keep' presses them together",
    DAMAGED: "the law's part of plugin_state was not written by a step of this model (it is of another model, or "
    "damaged); contacts start anew",
    SWITCHED_OFF: "disableflags: spring and damper are both disabled, and with them all passive forces: "
    "the law's contacts are off",
    SLEEPS: "enableflags: sleep is turned off, as what the engine puts to sleep would not wake when the law strikes "
    "it; what rests by the law sleeps anyway",
    UNSAVED: "plugin_state has no room for {:.0f} of the contacts: they start anew when this state is restored",
    TOWED: "body {} carries others by joints and moves with a mocap body: contacts do not know its velocity; give "
    "it a free joint, and weld it to the mocap body by an equality",
    FULL: "more contacts at once than the {:.0f} that there is room for: the others are ignored",
    LEFT_OUT: "more pairs of near shapes than the {:.0f} that there is room for: it may pass through others, and "
    "these through each other; shorten the step",
}
"""Warnings by code; {} stands for the value of the report."""

call_report: Any = caller(types.void(*(types.int64, types.int64, types.float64, types.int64, types.int64)))
"""Call void (*function)(int64 block, int64 code, double value, int64 geom_a, int64 geom_b) at an address."""

_REPORTED: dict[int, dict[tuple[int, int], NDArray[np.int64]]] = {}  # by address of a model; living mjData have these

OF_BODIES = ("body_pos", "body_quat", "body_ipos", "body_iquat", "body_mass", "body_inertia")
BITS = "geom_contype", "geom_conaffinity"
OF_GEOMS = ("geom_type", *BITS, "geom_size", "geom_pos", "geom_quat", "geom_friction", "geom_condim", "geom_priority")
OF_FIELDS = ("hfield_size", "hfield_data")
OF_ALL = ("jnt_pos", "jnt_axis", "dof_armature", "dof_damping", "qpos0", "tendon_armature", "hfield_size")
if "actuator_armature" in (layout.structure("mjModel").names or ()):  # from 3.7
    OF_ALL = (*OF_ALL, "actuator_armature")
MAX_GAP = 32  # doubles between two ranges that are compared as one: quicker than to begin another range


def reported_of(view: Any, count: int) -> NDArray[np.int64]:
    """Return the codes reported of each of `count` instances of a model, which all its `MjData` share."""
    known = _REPORTED.setdefault(view.address, {})
    return known.setdefault((view.signature, count), np.zeros(count, np.int64))


def forget_reports(address: int) -> None:
    """Forget what was reported of a model at an address: a new one is compiled there."""
    for codes in _REPORTED.get(address, {}).values():
        codes[:] = 0


def report_once(head, code, value, instance=0, a=-1, b=-1):
    """Report a code and a value of two geoms of an instance, or of the model, unless the instance has that reported."""
    said = whole_at(head.reported, instance)
    if said & code == 0 and not error_pending(world_at(head.world, 0).demand):
        set_whole(head.reported, instance, said | code)
        send_report(head, code, value, a, b)


def send_report(head, code, value, a=-1, b=-1):
    """Call Python with a code, a value, and the geoms that it is about; -1: the model as a whole."""
    table = world_at(head.world, 0).demand
    call_report(head.report, head.address, code, value, a, b)
    raise_later(table)


def report_contacts(head, w):
    """Report what is doubtful about contacts, and contacts without room."""
    for k in range(nears_in_use(w)):
        p = near_at(w.near, k)
        if p.slot >= 0:
            c = contact_at(w.contacts, p.slot)
            bits, a, b = doubts_of(w, c), whole_at(head.geoms, c.shape_a), whole_at(head.geoms, c.shape_b)
            for bit in DOUBTS:
                if bits & bit != 0:
                    report_once(head, bit, doubt_value(c, bit), c.pair, a, b)
    if w.lost > 0:
        report_once(head, FULL, float(w.contact_room))
    if w.left_out > 0:
        report_once(head, LEFT_OUT, float(w.near_room), 0, whole_at(head.geoms, w.left_out - 1))
    w.lost, w.left_out = 0, 0


def watched_ranges(view: layout.ModelView, bodies: Sequence[int], geoms: Sequence[int]) -> tuple[NDArray, NDArray]:
    """Return the ranges of doubles that the law reads of these bodies and geoms, shape (n, 3), and a copy of them.

    A range is: offset of the pointer to the field in mjModel, in words of eight bytes; first double; count. Ranges that
    are close in memory are merged, with what lies between them. The last one is that of the heights.
    """
    offsets, parts = layout.structure("mjModel").fields or {}, []  # pointer, address of the field, first and last word
    for name in (*OF_BODIES, *OF_GEOMS, *OF_ALL):
        own = getattr(view, name)
        rows = np.array(bodies if name in OF_BODIES else geoms if name in OF_GEOMS else range(len(own)), np.int64)
        ends = rows * own.strides[0] // 8, ((rows + 1) * own.strides[0] - 1) // 8
        parts.append(np.broadcast_arrays(offsets[name][1] // 8, own.ctypes.data // 8, *ends))
    pointer, field, first, last = np.hstack(parts)
    gap = (field + first)[1:] - (field + last)[:-1]  # 0: both are in one word
    cuts = np.flatnonzero((gap < 0) | (gap > MAX_GAP)) + 1
    begins, ends = np.append(0, cuts), np.append(cuts - 1, -1)
    heights = offsets["hfield_data"][1] // 8, 0, -(-view.hfield_data.nbytes // 8)
    counts = (field + last)[ends] + 1 - (field + first)[begins]
    ranges = np.concatenate([np.stack([pointer[begins], first[begins], counts], axis=1), [heights]])
    values = [layout.record_at(start, np.float64, count).copy() for start, count in _resolved(view.address, ranges)]
    return ranges, np.concatenate(values)


def _resolved(model: int, ranges: NDArray[np.int64]) -> Iterator[tuple[int, int]]:
    """Yield address and count of each range of `watched_ranges`."""
    for pointer, first, count in ranges.tolist():
        yield int(layout.record_at(model + 8 * pointer, np.int64, 1)[0]) + 8 * first, count


def update_watched(head: Any) -> dict[str, list[int]]:
    """Copy the watched numbers of a model again; return the changed rows of fields of bodies, geoms, height fields."""
    view, kept, places = layout.ModelView(int(head["model"])), int(head["watched"]), list[NDArray[np.int64]]()
    ranges = layout.record_at(int(head["ranges"]), np.int64, 3 * int(head["range_count"])).reshape(-1, 3)
    for start, count in _resolved(view.address, ranges):
        now, was = (layout.record_at(place, np.int32, 2 * count) for place in (start, kept))
        places.append(start + 4 * np.flatnonzero(now != was))
        was[:] = now
        kept += 8 * count
    changed, found = np.concatenate(places), dict[str, list[int]]()
    for name in (*OF_BODIES, *OF_GEOMS, *OF_FIELDS):
        own = getattr(view, name)
        rows = np.unique((changed - own.ctypes.data) // own.strides[0])
        found[name] = rows[(rows >= 0) & (rows < len(own))].tolist()
    return found


def is_edited(head):
    """Return whether any watched number differs from its copy; heights count where an episode begins."""
    goes_on = data_at(head.data, 0).time != 0.0 and checksums(head).token == head.token
    kept = head.watched
    for i in range(head.range_count - 1 if goes_on else head.range_count):
        start = shifted(whole_at(head.model, whole_at(head.ranges, 3 * i)), whole_at(head.ranges, 3 * i + 1))
        count = whole_at(head.ranges, 3 * i + 2)
        if not same_wholes(start, kept, count):
            return True
        kept = shifted(kept, count)
    return False


jit_module(__name__)
