"""Functions that only some scenes need: compiled when a scene first needs them, and called by address.

Compiled code asks Python to compile them (`call.ready`). No exception can cross compiled code. One that is raised
there, an interrupt too, is kept; the step goes on without the function asked for, and the exception is raised when the
step returns. For that, compiled code schedules a pending call of the interpreter, as signals do, by which the main
thread calls PyObject_IsTrue of `PENDING_ERROR`, which raises. (A pending call scheduled from Python would run at once.)
"""

from collections.abc import Callable
from contextlib import nullcontext
from ctypes import CFUNCTYPE, c_int64, c_void_p, cast, pythonapi
from typing import Any

import numpy as np

from contactlaw.jit import address_of, compiling
from contactlaw.laws.record import record

STEP, IMPLICIT, SPIN, READ, SLEEP, COAST, START_COASTING, ROLL = range(8)  # functions that `supply` makes
DEMAND = record(
    functions=("u8", (8,)),  # addresses of these; zero: not compiled yet
    supply="u8", pending="u8",  # address of `_supply`; 1: an exception is pending
    add_call="u8", is_true="u8", error="u8",  # addresses of Py_AddPendingCall, PyObject_IsTrue and `PENDING_ERROR`
)  # fmt: skip
TABLE = np.zeros(1, DEMAND)
"""What compiled code calls, one for all worlds."""


def supply(what: int) -> int:
    """Compile one of the functions if that is to be done; returns its address."""
    # these modules import this one
    from contactlaw.laws import sectors
    from contactlaw.world import sleep, state, step
    from contactlaw.world.contacts import coasting, force
    from contactlaw.world.data import call
    from contactlaw.world.implicit import step as implicit_step

    # what is announced, compile time [s], function, caller
    made: dict[int, tuple[str, int, Any, Any]] = {
        STEP: ("", 0, step.step_once, call.call_step),
        READ: ("states that are set back", 2, state.read, call.call_read),
        IMPLICIT: ("persistent contacts", 8, implicit_step.take_implicit_steps, call.call_on_world),
        SLEEP: ("bodies that fall asleep", 1, sleep.sleep_if_balanced, call.call_on_island),
        ROLL: ("rolling resistance", 1, force.advance_rolling, call.call_roll),
        SPIN: ("contacts that spin", 4, sectors.advance_spinning, call.call_spin),
        COAST: ("contacts that hardly change", 2, coasting.advance_coasting, call.call_coast),
        START_COASTING: ("contacts that hardly change", 2, coasting.start_coasting, call.call_start_coasting),
    }
    if what == START_COASTING:  # none may start without the other; both are announced by one line
        supply(COAST)
    functions = TABLE["functions"][0]
    if functions[what] == 0:
        name, seconds, function, caller = made[what]
        with compiling(name, seconds) if name else nullcontext():
            functions[what] = address_of(function, caller)
    return int(functions[what])


class _PendingError:
    """The first exception that has not been raised yet."""

    error: BaseException | None = None

    def __bool__(self) -> bool:
        """Raise it; False: there is none."""
        error, self.error, TABLE["pending"] = self.error, None, 0
        if error:
            raise error
        return False


def catches(function: Callable[..., object]) -> Callable[..., None]:
    """Decorate a Python function that compiled code calls: exceptions are kept."""

    def call(*values: Any) -> None:
        try:
            function(*values)
        except BaseException as error:
            PENDING_ERROR.error, TABLE["pending"] = PENDING_ERROR.error or error, 1

    return call


@CFUNCTYPE(None, c_int64)
@catches
def _supply(what: int) -> None:
    supply(what)


PENDING_ERROR = _PendingError()
KEEP_ALIVE = TABLE, PENDING_ERROR, _supply
"""Objects that engines must keep alive, as they may step worlds to the end of the process."""

_functions = {"supply": _supply, "add_call": pythonapi.Py_AddPendingCall, "is_true": pythonapi.PyObject_IsTrue}
for _name, _function in _functions.items():
    TABLE[_name] = cast(_function, c_void_p).value or 0
TABLE["error"] = id(PENDING_ERROR)
