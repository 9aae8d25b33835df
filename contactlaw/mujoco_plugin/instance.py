"""A plugin instance comes to life: what MuJoCo asks of Python when a model is compiled and when an mjData is made."""

from __future__ import annotations

import copyreg
import ctypes
import sys
import warnings
from typing import Any

import mujoco
import numpy as np

from contactlaw.mujoco_plugin import config, layout, notices
from contactlaw.mujoco_plugin.block import HEAD, STARTS
from contactlaw.mujoco_plugin.layout import record_at
from contactlaw.mujoco_plugin.members import instances, left_out, members
from contactlaw.mujoco_plugin.model import Model
from contactlaw.mujoco_plugin.readout import View
from contactlaw.mujoco_plugin.sensors import NUMBERS
from contactlaw.pair import FOUND_IN, TOO_DEEP, ContactWarning
from contactlaw.world.clear import UNCLEAR
from contactlaw.world.demand import keeps
from contactlaw.world.records import EDITED, RESIZED, WORLD

allocate, free = ctypes.pythonapi.PyMem_RawCalloc, ctypes.pythonapi.PyMem_RawFree
allocate.argtypes, allocate.restype = [ctypes.c_size_t, ctypes.c_size_t], ctypes.c_void_p
free.argtypes, free.restype = [ctypes.c_void_p], None


def _complain(number: int, error: BaseException) -> None:
    """Errors cannot cross MuJoCo's C frames: the message goes out here, and MuJoCo then fails by itself."""
    print(f"contactlaw: plugin instance {number}: {str(error) or type(error).__name__}", file=sys.stderr)


@ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_int)
def nstate(model: int, number: int) -> int:
    """Size of the state of an instance, called when a model is compiled."""
    try:
        view = layout.ModelView(model)
        return Model(view).state_size if [number] == members(view)[:1] else 0
    except BaseException:  # `init` comes next, fails in the same way and says why
        return 0


@ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_int, ctypes.c_int)
def nsensordata(model: int, number: int, sensor: int) -> int:
    """How many numbers a sensor has."""
    return NUMBERS


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
        if int(mujoco.mjtStage.mjSTAGE_ACC) not in view.sensor_needstage:
            view.plugin[number] = layout.plugin_of(config.BLIND)[1]
        if [number] == members(view)[:1]:
            for text in left_out(view):
                warnings.warn(text, ContactWarning, stacklevel=1)  # by default once, whoever makes an mjData
        _place(data, number).value = _block(view, [number] == members(view)[:1])
    except BaseException as error:  # an interrupt too: without a block no step may be taken
        _complain(number, error)
        return -1
    return 0


def _place(data: int, number: int) -> ctypes.c_size_t:
    """Where an mjData keeps the address of an instance's block."""
    blocks = record_at(data, layout.DATA, 1)[0]["plugin_data"]
    return ctypes.c_size_t.from_address(int(blocks) + 8 * number)


def _block(view: layout.ModelView, leads: bool) -> int:
    """Address of a new block.

    Raises:
        ValueError: The law cannot serve the model.
    """
    made = Model(view) if leads else None
    if made:
        made.check()
    size = made.block_size() if made else HEAD.itemsize
    memory = allocate(1, size)
    if made:
        made.fill(np.ctypeslib.as_array((ctypes.c_uint8 * size).from_address(memory)), _REPORT_ADDRESS)
    return int(memory)


def _renew(model: int, data: int) -> str:
    """Make the leading block of an mjData anew, of the model as it is now; returns what it does not heed, and why."""
    view = layout.ModelView(model)
    place = _place(data, members(view)[0])
    old = record_at(place.value, HEAD, 1)[0]
    changed = notices.take_note(old)
    try:
        made = _block(view, True)
    except Exception as error:
        return str(error)
    new = record_at(made, HEAD, 1)[0]
    before, now = (record_at(int(head["world"]), WORLD, 1) for head in (old, new))
    now["edited"] = max(before["edited"][0], RESIZED if changed["geom_size"] else EDITED)
    View(new).give_frictions(View(old).frictions)
    new["turn"] = old["turn"]  # and what is known of the step that is under way
    nv, states = int(old["nv"]), STARTS * (1 + int(old["nq"]) + int(old["nv"]))
    for name, count in (("starts", states), ("given", nv)):
        ctypes.memmove(int(new[name]), int(old[name]), 8 * count)
    free(place.value)
    place.value = made
    geoms = View(new).geoms.tolist()
    bits = [
        f"{name} = {getattr(view, name)[geom]} of geom {_name(view, _GEOM, geom)}"
        for name in notices.BITS
        for geom in changed[name]
        if geom in geoms
    ]
    return f"{', '.join(bits)}: no contact ends by it; choose who touches anew by load_model" if bits else ""


_TEXTS = {
    notices.EDITED: "the model has been changed, and the law goes on with what it was: ",
    notices.DEEP: TOO_DEEP,
    notices.BUILT: f"{FOUND_IN}; overlaps='keep' takes it as given",
    notices.UNCLEAR_RADIUS: UNCLEAR,
    notices.DAMAGED: "the part of plugin_state that is the law's is not what a step of this model leaves: it is of "
    "another model, or damaged; contacts start anew",
    notices.SWITCHED_OFF: "disableflags: spring and damper are both disabled, and with them all passive forces: "
    "nothing touches",
    notices.UNSAVED: "the state has no room for {:.0f} of the contacts: they begin anew where it is set back",
    notices.TOWED: "body {:.0f}, on which others hang by joints, is moved by hand: for contacts these are at rest "
    "wherever it takes them; weld it to a mocap body by an equality",
    notices.FULL: "more contacts at once than the {:.0f} there is room for: those left over are forgotten",
}


@ctypes.CFUNCTYPE(None, ctypes.c_int64, ctypes.c_int64, ctypes.c_double)
@keeps
def report(address: int, code: int, value: float) -> None:
    """Something that a compiled callback noticed, once for each instance and mjData; address: of the block."""
    head, edited = record_at(address, HEAD, 1)[0], code == notices.EDITED
    if edited:
        head["told_a"] = head["told_b"] = -1
    where = _whereabouts(head)
    why = _renew(int(head["model"]), int(head["data"])) if edited else ""
    if why or not edited:
        warnings.warn(f"{where}: {_TEXTS[code].format(value)}{why}", ContactWarning, stacklevel=3)


def _whereabouts(head: Any) -> str:
    """Which geoms a notice is of, and when."""
    time = record_at(int(head["data"]), layout.DATA, 1)[0]["time"]
    view = layout.ModelView(int(head["model"]))
    geoms = [int(head[name]) for name in ("told_a", "told_b") if head[name] >= 0]
    bodies = view.geom_bodyid
    named = [f"{_name(view, _GEOM, geom)} of body {_name(view, _BODY, int(bodies[geom]))}" for geom in geoms]
    return f"{' on '.join(named) or 'contacts'} at {time:.6g} s"


def _name(view: layout.ModelView, kind: int, number: int) -> str:
    return repr(view.name(kind, number) or number)


_GEOM, _BODY = int(mujoco.mjtObj.mjOBJ_GEOM), int(mujoco.mjtObj.mjOBJ_BODY)
_REPORT_ADDRESS = ctypes.cast(report, ctypes.c_void_p).value or 0


def _reduce(whole: mujoco.MjModel | mujoco.MjData) -> tuple[Any, ...]:
    """How a model or an mjData is pickled: what reads one with the law imports this module first."""
    model = whole.model if isinstance(whole, mujoco.MjData) else whole
    if not instances(layout.ModelView(model._address)):
        return whole.__reduce_ex__(2)
    return _read, (type(whole), whole.__getstate__())


def _read(kind: type, state: bytes) -> mujoco.MjModel | mujoco.MjData:
    """One from a pickle: MuJoCo copies the addresses of blocks, which another mjData has, or another process."""
    whole = kind.__new__(kind)  # type: ignore[call-overload]
    whole.__setstate__(state)
    if isinstance(whole, mujoco.MjData):
        view = layout.ModelView(whole.model._address)
        for number in instances(view):
            _place(whole._address, number).value = _block(view, [number] == members(view)[:1])
    return whole


for _kind in (mujoco.MjModel, mujoco.MjData):
    copyreg.pickle(_kind, _reduce)  # type: ignore[arg-type]
