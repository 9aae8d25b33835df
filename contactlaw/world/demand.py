"""What only some scenes come to need: called by address, and compiled when a scene first needs it.

Compiled code asks Python for it once in a process (`call.ready`). No exception can cross compiled code: what is raised
there, an interrupt too, is kept, the step goes on without what it asked for, and when it returns, it is raised. The
main thread does so, in a pending call of the interpreter, the way of signals, for which compiled code must ask
(`call.raise_later`): one that Python asked for would be made at once. It calls PyObject_IsTrue of `KEPT`, which raises.
"""

from __future__ import annotations

from collections.abc import Callable
from ctypes import CFUNCTYPE, c_int64, c_void_p, cast, pythonapi
from typing import Any

import numpy as np

from contactlaw.jit import compiling

STEP, LAST, SPIN, ALONG, READ, ASK, WAITS, LATER, TRUTH, KEEPER = range(10)
"""`step.step_once`, `lasting.let_last`, `spinning.spin`, `elliptic.advance`, `state.read`; what asks
for them; whether something waits to be raised; Py_AddPendingCall, PyObject_IsTrue and `KEPT`."""

TABLE = np.zeros(10, np.uint64)
"""Addresses of these; zero: not asked for yet."""


def supply(what: int) -> int:
    """The address of one of them."""
    from contactlaw.world import elliptic, lasting, spinning, state, step  # which need the records that need this

    if TABLE[what] != 0:
        return int(TABLE[what])
    if what == STEP:
        TABLE[what] = step.address_of_step()
    elif what == READ:
        with compiling("states that are set back", 2):
            TABLE[what] = state.address_of_read()
    elif what == LAST:
        with compiling("contacts that last", 8):
            TABLE[what] = lasting.address()
    elif what == ALONG:
        with compiling("elliptic contacts", 2):
            TABLE[what] = elliptic.address()
    else:
        with compiling("contacts that spin", 4):
            TABLE[SPIN] = spinning.address()
    return int(TABLE[what])


class _Kept:
    """What waits to be raised, the first that came."""

    error: BaseException | None = None

    def __bool__(self) -> bool:
        """Raises it; False: nothing waits."""
        error, self.error, TABLE[WAITS] = self.error, None, 0
        if error:
            raise error
        return False


def keeps(function: Callable[..., object]) -> Callable[..., None]:
    """Of Python that compiled code calls: what it raises is kept."""

    def call(*values: Any) -> None:
        try:
            function(*values)
        except BaseException as error:
            KEPT.error, TABLE[WAITS] = KEPT.error or error, 1

    return call


@CFUNCTYPE(None, c_int64)
@keeps
def _supply(what: int) -> None:
    supply(what)


KEPT = _Kept()
LASTS = TABLE, KEPT, _supply
"""What engines must keep alive that may call it to the end of the process."""

for _place, _function in ((ASK, _supply), (LATER, pythonapi.Py_AddPendingCall), (TRUTH, pythonapi.PyObject_IsTrue)):
    TABLE[_place] = cast(_function, c_void_p).value or 0
TABLE[KEEPER] = id(KEPT)
