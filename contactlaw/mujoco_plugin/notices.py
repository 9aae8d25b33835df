"""Reports from the compiled callbacks to Python, each once for each plugin instance of a compiled model.

The codes are bits of `reported`, the word in which the blocks of all `MjData` of a model note what has been reported of
an instance.
"""

from typing import Any

import numpy as np
from numba import types
from numpy.typing import NDArray

from contactlaw.jit import jit
from contactlaw.memory import caller, set_whole, whole_at
from contactlaw.world.data.access import contact_at, near_at, world_at
from contactlaw.world.data.call import error_pending, raise_later
from contactlaw.world.readout import DOUBTFUL, DOUBTS, PUT_IN, doubt_value, doubts_of

FULL, DAMAGED, SWITCHED_OFF, UNSAVED, EDITED, TOWED, SLEEPS = (1 << bit for bit in range(len(DOUBTS), 11))

TEXTS = DOUBTFUL | {
    EDITED: "the model has been edited, and the law keeps the old values: ",
    PUT_IN: f"{DOUBTFUL[PUT_IN]}; overlaps='keep' presses them together",
    DAMAGED: "the law's part of plugin_state was not written by a step of this model (it is of another model, or "
    "damaged); contacts start anew",
    SWITCHED_OFF: "disableflags: spring and damper are both disabled, and with them all passive forces: "
    "the law's contacts are off",
    SLEEPS: "enableflags: sleep is on; what the engine puts to sleep does not rest by the law",
    UNSAVED: "plugin_state has no room for {:.0f} of the contacts: they start anew when this state is restored",
    TOWED: "body {:.0f} carries others by joints and moves with a mocap body: contacts do not know its velocity; give "
    "it a free joint, and weld it to the mocap body by an equality",
    FULL: "more contacts at once than the {:.0f} that there is room for: the others are ignored",
}
"""Warnings by code; {} stands for the value of the report."""

call_report: Any = caller(types.void(*(types.int64, types.int64, types.float64, types.int64, types.int64)))
"""Call void (*function)(int64 block, int64 code, double value, int64 geom_a, int64 geom_b) at an address."""


_REPORTED: dict[int, dict[tuple[int, int], NDArray[np.int64]]] = {}  # by address of a model; living mjData have these


def reported_of(view: Any, count: int) -> NDArray[np.int64]:
    """Return the codes reported of each of `count` instances of a model, which all its `MjData` share."""
    known = _REPORTED.setdefault(view.address, {})
    return known.setdefault((view.signature, count), np.zeros(count, np.int64))


def forget_reports(address: int) -> None:
    """Forget what was reported of a model at an address: a new one is compiled there."""
    for codes in _REPORTED.get(address, {}).values():
        codes[:] = 0


@jit
def report_once(head, code, value):
    """Report something of the model as a whole, unless it has been reported."""
    report_if_new(head, 0, code, value, -1, -1)


@jit
def report_if_new(head, instance, code, value, a, b):
    """Report a code about two geoms of an instance, unless it has been reported of the instance."""
    said = whole_at(head.reported, instance)
    if said & code == 0 and not error_pending(world_at(head.world, 0).demand):
        set_whole(head.reported, instance, said | code)
        send_report(head, code, value, a, b)


@jit
def send_report(head, code, value, a, b):
    """Call Python with a code, a value, and the geoms that it is about; -1: the model as a whole."""
    table = world_at(head.world, 0).demand
    call_report(head.report, head.address, code, value, a, b)
    raise_later(table)


@jit
def report_contacts(head, w):
    """Report what is doubtful about contacts, and contacts without room."""
    for k in range(w.nears):
        p = near_at(w.near, k)
        if p.slot >= 0:
            c = contact_at(w.contacts, p.slot)
            bits, a, b = doubts_of(w, c), whole_at(head.geoms, c.shape_a), whole_at(head.geoms, c.shape_b)
            for bit in DOUBTS:
                if bits & bit != 0:
                    report_if_new(head, c.pair, bit, doubt_value(c, bit), a, b)
    if w.lost > 0:
        report_once(head, FULL, float(w.contact_room))
        w.lost = 0
