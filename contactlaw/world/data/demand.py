"""What only some scenes come to need: called by address, and compiled when a scene first needs it.

Compiled code asks Python for it once in a process (`call.ready`). No exception can cross compiled code: what is raised
there, an interrupt too, is kept, the step goes on without what it asked for, and when it returns, it is raised. The
main thread does so, in a pending call of the interpreter, the way of signals, for which compiled code must ask
(`call.raise_later`): one that Python asked for would be made at once. It calls PyObject_IsTrue of `KEPT`, which raises.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext
from ctypes import CFUNCTYPE, c_int64, c_void_p, cast, pythonapi
from typing import Any

import numpy as np

from contactlaw.jit import address_of, compiling

STEP, LAST, SPIN, ALONG, READ, SLEEP, LAND, COAST, SET_OUT, ROLL, ASK, WAITS, LATER, TRUTH, KEEPER = range(15)
"""What `supply` makes; what asks for them; whether something waits to be raised; Py_AddPendingCall, PyObject_IsTrue and
`KEPT`."""

TABLE = np.zeros(KEEPER + 1, np.uint64)
"""Addresses of these; zero: not asked for yet."""


def supply(what: int) -> int:
    """The address of one of them; the modules need this one."""
    from contactlaw.world import sleep, state, step
    from contactlaw.world.contacts import coasting, elliptic, rolling, spinning
    from contactlaw.world.data import call
    from contactlaw.world.implicit import step as lasting

    made: dict[int, tuple[str, int, list[Any]]] = {  # by what is asked for, which comes last: all of it is there then
        STEP: ("", 0, [(STEP, step.step_once, call.A_STEP)]),
        READ: ("states that are set back", 2, [(READ, state.read_at, call.A_READ)]),
        LAST: ("contacts that last", 8, [(LAST, lasting.let_last, call.ON_WORLD)]),
        ALONG: ("elliptic contacts", 2, [(ALONG, elliptic.advance, call.ALONG)]),
        SLEEP: ("bodies that fall asleep", 1, [(SLEEP, sleep.settle_down, call.ON_ISLAND)]),
        ROLL: ("rolling resistance", 1, [(ROLL, rolling.advance_rolling, call.ROLLS)]),
        SPIN: ("contacts that spin", 4, [(SPIN, spinning.spin, call.SPIN)]),
        SET_OUT: ("contacts that hardly change", 2, [
            (LAND, coasting.land, call.LANDS), (COAST, coasting.coast, call.COASTS),
            (SET_OUT, coasting.set_out, call.SETS_OUT),
        ]),
    }  # fmt: skip
    if TABLE[what] == 0:
        name, seconds, parts = made[what]
        with compiling(name, seconds) if name else nullcontext():
            for place, function, signature in parts:
                TABLE[place] = address_of(getattr(function, "py_func", function), signature)
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
