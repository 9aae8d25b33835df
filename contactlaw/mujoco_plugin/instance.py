"""The plugin as MuJoCo has it: registered once in a process; what it asks of Python for each model and each mjData."""

from __future__ import annotations

import copyreg
import ctypes
import sys
import warnings
from types import ModuleType
from typing import Any

import llvmlite.binding
import mujoco

from contactlaw import jit
from contactlaw.mujoco_plugin import config, layout, notices
from contactlaw.mujoco_plugin.block import HEAD, STARTS, allocate, free
from contactlaw.mujoco_plugin.layout import record_at
from contactlaw.mujoco_plugin.members import instances, left_out, members
from contactlaw.mujoco_plugin.model import Model
from contactlaw.mujoco_plugin.readout import View
from contactlaw.mujoco_plugin.sensors import NUMBERS
from contactlaw.pair import FOUND_IN, TOO_DEEP, ContactWarning
from contactlaw.world.data import demand
from contactlaw.world.data.records import EDITED, RESIZED, WORLD
from contactlaw.world.shapes.curvature import UNCLEAR

COMPILE_TIME = 15  # [s]
OLDEST, NEWEST = (3, 3, 6), (4, 99, 99)
_POINTER_FIELDS = (
    "nstate", "nsensordata", "init", "destroy", "copy", "reset", "compute", "advance", "visualize",
    "actuator_act_dot", "sdf_distance", "sdf_gradient", "sdf_staticdistance", "sdf_attribute", "sdf_aabb",
)  # fmt: skip
CALLED = "mjd_smooth_vel", "mj_rnePostConstraint", "mj_sensorAcc", "mj_applyFT", "mj_solveM", "mju_rayGeom"
REGISTERED = "_contactlaw_registered"
"""In sys.modules: what has been registered, also where contactlaw is imported anew."""


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
        # errors cannot cross MuJoCo's C frames: the message goes out here, and MuJoCo then fails by itself
        print(f"contactlaw: plugin instance {number}: {str(error) or type(error).__name__}", file=sys.stderr)
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
    if not leads:
        return allocate(1, HEAD.itemsize)
    made = Model(view)
    made.check()
    return made.block(_REPORT_ADDRESS)


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
        f"{name} = {getattr(view, name)[geom]} of geom {view.label('geom', geom)}"
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
@demand.catches
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
    time = record_at(head["data"], layout.DATA, 1)[0]["time"]
    view = layout.ModelView(int(head["model"]))
    named = [
        f"{view.label('geom', geom)} of body {view.label('body', int(view.geom_bodyid[geom]))}"
        for geom in (int(head["told_a"]), int(head["told_b"]))
        if geom >= 0
    ]
    return f"{' on '.join(named) or 'contacts'} at {time:.6g} s"


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


class _Plugin(ctypes.Structure):
    """mjpPlugin of mjplugin.h."""

    _fields_ = [
        ("name", ctypes.c_char_p),
        ("nattribute", ctypes.c_int),
        ("attributes", ctypes.POINTER(ctypes.c_char_p)),
        ("capabilityflags", ctypes.c_int),
        ("needstage", ctypes.c_int),
        *((name, ctypes.c_void_p) for name in _POINTER_FIELDS),
    ]


def register() -> None:
    """Fill the plugins' structs and register them, or take over what this process has registered before.

    MuJoCo takes one plugin of a name and ends the process at a second, and mjData that live on call the first one's
    compiled callbacks. These stay, therefore; only what MuJoCo asks of Python goes over to the modules of now.

    Raises:
        ImportError: Another MuJoCo than this works with, or another version of the plugin is registered already.
    """
    version = tuple(int(part) for part in mujoco.__version__.split(".")[:3])
    if not OLDEST <= version <= NEWEST:
        raise ImportError(
            f"contactlaw works with MuJoCo {'.'.join(map(str, OLDEST))} to {NEWEST[0]}.x, not {mujoco.__version__}"
        )
    if jit.INTERPRETED:
        raise ImportError("contactlaw.mujoco_plugin needs compiled callbacks, and NUMBA_DISABLE_JIT is set")
    layout.check()
    stamp = jit.SOURCE_STAMP + layout.KEY  # what compiled callbacks and the memory that they work on depend on
    there = [address for name in (config.PLUGIN_NAME, config.BLIND) if (address := layout.plugin_of(name)[0])]
    if there and getattr(sys.modules.get(REGISTERED), "stamp", None) != stamp:
        raise ImportError(
            f"the plugin {config.PLUGIN_NAME} is registered in this process already, by another version of contactlaw; "
            "MuJoCo takes each plugin once: start a new process"
        )
    plugins = [_Plugin.from_address(address) for address in there] or _first()
    for plugin in plugins:
        for name, function in (("nstate", nstate), ("nsensordata", nsensordata), ("init", init)):
            setattr(plugin, name, ctypes.cast(function, ctypes.c_void_p))
    _keep(nstate, nsensordata, init, report, *demand.KEEP_ALIVE)
    if not there:
        for plugin in plugins:
            layout.LIBRARY.mjp_registerPlugin(ctypes.byref(plugin))
        sys.modules[REGISTERED] = known = ModuleType(REGISTERED, "What contactlaw has registered with MuJoCo.")
        known.stamp = stamp


def _first() -> list[_Plugin]:
    """The structs of the plugin with sensors and without, but for what MuJoCo asks of Python."""
    for function in (*(getattr(layout.LIBRARY, name) for name in CALLED), ctypes.pythonapi.PyMem_RawFree):
        llvmlite.binding.add_symbol(function.__name__, ctypes.cast(function, ctypes.c_void_p).value)
    with jit.compiling("the MuJoCo plugin", COMPILE_TIME):
        from contactlaw.mujoco_plugin import callbacks  # compiled against the symbols just added

    plugins, passive = [_Plugin(), _Plugin()], int(mujoco.mjtPluginCapabilityBit.mjPLUGIN_PASSIVE)
    keys = (ctypes.c_char_p * len(config.KEYS))(*(key.encode() for key in config.KEYS))
    for plugin, name, sensor in zip(plugins, (config.PLUGIN_NAME, config.BLIND), (layout.SENSOR, 0), strict=True):
        layout.LIBRARY.mjp_defaultPlugin(ctypes.byref(plugin))
        plugin.name = name.encode()
        plugin.nattribute, plugin.attributes = len(keys), keys
        plugin.capabilityflags, plugin.needstage = passive | sensor, int(mujoco.mjtStage.mjSTAGE_ACC)
        plugin.compute, plugin.advance = callbacks.compute, callbacks.advance
        plugin.reset, plugin.destroy = callbacks.reset, callbacks.destroy
    _keep(plugins, keys, jit.CALLBACKS)
    return plugins


def _keep(*things: object) -> None:
    """Let things live to the very end of the process: until then mjData may be freed, and models made."""
    for thing in things:
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(thing))
