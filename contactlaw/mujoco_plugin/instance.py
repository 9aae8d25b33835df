"""A plugin instance comes to life: what MuJoCo asks of Python when a model is compiled and when an mjData is made."""

# The wheel describes little of what it exports.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import ctypes
import sys
import threading
import time
import warnings
from collections.abc import Iterator
from types import FrameType

import mujoco
import numpy as np

from contactlaw.mujoco_plugin import layout, notices
from contactlaw.mujoco_plugin.block import HEAD
from contactlaw.mujoco_plugin.members import LIBRARY, members
from contactlaw.mujoco_plugin.model import Model
from contactlaw.pair import DEEPEST, ContactWarning

LIBRARY.mju_malloc.argtypes = [ctypes.c_size_t]
LIBRARY.mju_malloc.restype = ctypes.c_void_p
LIBRARY.mju_free.argtypes = [ctypes.c_void_p]


def _complain(number: int, error: Exception) -> None:
    """Errors cannot cross MuJoCo's C frames: the message goes out here, and MuJoCo then fails by itself."""
    print(f"contactlaw: plugin instance {number}: {error}", file=sys.stderr)


@ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_int)
def nstate(model: int, number: int) -> int:
    """Size of the state of an instance, called when a model is compiled."""
    try:
        view = layout.ModelView(model)
        return Model(view).state_size if number == members(view)[0] else 0
    except Exception:  # `init` comes next, fails in the same way and says why
        return 0


@ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int)
def init(model: int, data: int, number: int) -> int:
    """Make the block of an instance, called when an mjData is made."""
    try:
        view = layout.ModelView(model)
        if view.option("enableflags") & layout.SLEEP:
            raise ValueError("enableflags: sleep must be off; a body that is struck by the law would not wake")
        if layout.LOSES_SPIN and view.option("integrator") == layout.IMPLICITFAST:
            raise ValueError("integrator: implicitfast of MuJoCo 3.7 to 3.10 loses the spin of impacts; take implicit")
        if view.option("disableflags") & layout.NO_PASSIVE == layout.NO_PASSIVE:
            raise ValueError("disableflags: spring and damper are both disabled, and with them all passive forces")
        _place(data, number).value = _block(view, number == members(view)[0])
    except Exception as error:
        _complain(number, error)
        return -1
    return 0


def _place(data: int, number: int) -> ctypes.c_size_t:
    """Where an mjData keeps the address of an instance's block."""
    blocks = ctypes.c_size_t.from_address(data + layout.DATA["plugin_data"]).value
    return ctypes.c_size_t.from_address(blocks + 8 * number)


def _block(view: layout.ModelView, leads: bool) -> int:
    """Address of a new block.

    Raises:
        ValueError: The law cannot serve the model.
    """
    made = Model(view) if leads else None
    if made:
        made.check()
    size = made.block_size() if made else HEAD.itemsize
    memory = LIBRARY.mju_malloc(size)
    here = np.ctypeslib.as_array((ctypes.c_uint8 * size).from_address(memory))
    here[:] = 0
    if made:
        made.fill(here, _REPORT_ADDRESS)
    return int(memory)


def renew(model: int, data: int) -> None:
    """Make the leading block of an mjData anew, of the model as it is now; errors as for `_block`."""
    view = layout.ModelView(model)
    known = members(view)
    if known:
        place, made = _place(data, known[0]), _block(view, True)
        LIBRARY.mju_free(place.value)
        place.value = made


@ctypes.CFUNCTYPE(None, ctypes.c_int64, ctypes.c_int64, ctypes.c_double)
def report(address: int, code: int, value: float) -> None:
    """Something that a compiled callback noticed, once for each instance and mjData; address: of the block."""
    if code == notices.DEEP:
        text = f"overlap over radius is {value:.2g}: beyond {DEEPEST} Hertz contact is no longer right"
    elif code == notices.UNCLEAR_RADIUS:
        text = (
            f"touching at the edge of a box, with R = {value:.3g} m taken from the ball or capsule; "
            "give the pair its radius"
        )
    elif code == notices.DAMAGED:
        text = (
            "the part of plugin_state that is the law's is not what a step of this model leaves: it is of another "
            "model, or damaged; contacts start anew"
        )
    elif code == notices.SWITCHED_OFF:
        text = "disableflags: spring and damper are both disabled, and with them all passive forces: nothing touches"
    else:
        text = f"more contacts at once than the {value:.0f} there is room for: those left over are forgotten"
    try:
        warnings.warn(f"{_whereabouts(address)}: {text}", ContactWarning, stacklevel=2)
    except ContactWarning as warning:
        _raise_in_caller(warning)


def _whereabouts(address: int) -> str:
    """Which geoms a notice is of, and when."""
    head = np.ctypeslib.as_array((ctypes.c_uint8 * HEAD.itemsize).from_address(address)).view(HEAD)[0]
    time = ctypes.c_double.from_address(int(head["data"]) + layout.DATA["time"]).value
    view = layout.ModelView(int(head["model"]))
    geoms = [int(head[name]) for name in ("told_a", "told_b") if head[name] >= 0]
    bodies = view.ints("geom_bodyid", view.size("ngeom"))
    named = [f"{_name(view, _GEOM, geom)} of body {_name(view, _BODY, int(bodies[geom]))}" for geom in geoms]
    return f"{' on '.join(named) or 'contacts'} at {time:.6g} s"


def _name(view: layout.ModelView, kind: int, number: int) -> str:
    name = (LIBRARY.mj_id2name(view.address, kind, number) or b"").decode()
    return repr(name) if name else str(number)


def _raise_in_caller(error: Exception) -> None:
    """Raise what cannot cross MuJoCo's C frames in the thread that called it, once it is out of them."""
    kind = type(type(error).__name__, (type(error),), {"__str__": lambda _: str(error)})
    known = {thread.ident for thread in threading.enumerate() if not isinstance(thread, threading._DummyThread)}
    here = threading.get_ident()
    caller = here if here in known else threading.main_thread().ident or here

    def later() -> None:
        while any(frame.f_code.co_filename == __file__ for frame in _frames(here)):
            time.sleep(1e-4)
        ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(caller), ctypes.py_object(kind))

    threading.Thread(target=later).start()


def _frames(thread: int) -> Iterator[FrameType]:
    """What a thread is in, innermost first."""
    frame = sys._current_frames().get(thread)
    while frame is not None:
        yield frame
        frame = frame.f_back


_GEOM, _BODY = int(mujoco.mjtObj.mjOBJ_GEOM), int(mujoco.mjtObj.mjOBJ_BODY)
_REPORT_ADDRESS = ctypes.cast(report, ctypes.c_void_p).value or 0
