"""The plugin as MuJoCo calls it: registration, once a process; sizes, init and reports in Python."""

import copyreg
import ctypes
import sys
import warnings
from types import ModuleType
from typing import Any

import llvmlite.binding
import mujoco

from contactlaw.jit import CALLBACKS, INTERPRETED, SOURCE_STAMP, compiling
from contactlaw.mujoco_plugin import config, layout, notices
from contactlaw.mujoco_plugin.block import HEAD, STARTS, free
from contactlaw.mujoco_plugin.geoms import FLAT, MAX_NAMES, UNSERVED, first_of, type_of
from contactlaw.mujoco_plugin.instances import contact_instances, instances, leads, unserved_readers
from contactlaw.mujoco_plugin.layout import record_at
from contactlaw.mujoco_plugin.model import Model, check_inertias
from contactlaw.mujoco_plugin.readout import View
from contactlaw.mujoco_plugin.sensors import NUMBERS
from contactlaw.pair import ContactWarning
from contactlaw.world.data import demand
from contactlaw.world.data.records import EDITED, RESIZED

COMPILE_TIME = 30  # [s], with what both engines share
OLDEST, NEWEST = (3, 3, 6), (4, 99, 99)
_POINTER_FIELDS = (
    "nstate", "nsensordata", "init", "destroy", "copy", "reset", "compute", "advance", "visualize",
    "actuator_act_dot", "sdf_distance", "sdf_gradient", "sdf_staticdistance", "sdf_attribute", "sdf_aabb",
)  # fmt: skip
CALLED = "mjd_smooth_vel", "mj_rnePostConstraint", "mj_sensorAcc", "mj_applyFT", "mj_solveM", "mju_rayGeom"
nsensordata = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_int, ctypes.c_int)(lambda *_: NUMBERS)
REGISTERED = "_contactlaw_registered"
"""Key in sys.modules that survives a re-import of contactlaw: what has been registered."""


@ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_int)
def nstate(model: int, number: int) -> int:
    """Return the number of doubles in the state of an instance; called when a model is compiled."""
    try:
        view = layout.ModelView(model)
        notices.forget_reports(model)
        return Model(view).state_size if leads(view, number) else 0
    except BaseException:  # `init`, called next, fails in the same way and gives the reason
        return 0


@ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int)
def init(model: int, data: int, number: int) -> int:
    """Make the block of an instance; called when an mjData is made. Returns -1 on failure."""
    try:
        view = layout.ModelView(model)
        if view.opt["enableflags"] & layout.OVERRIDE and (view.pair_margin < 0.0).any():
            raise ValueError("enableflags: override must be off; it brings back contacts that pairs turn off")
        if layout.LOSES_SPIN and view.opt["integrator"] == layout.IMPLICITFAST:
            raise ValueError("integrator: implicitfast of MuJoCo 3.7 to 3.10 loses the spin of impacts; take implicit")
        if view.opt["disableflags"] & layout.NO_PASSIVE == layout.NO_PASSIVE:
            raise ValueError("disableflags: spring and damper are both disabled, and with them all passive forces")
        if int(mujoco.mjtStage.mjSTAGE_ACC) not in view.sensor_needstage:
            view.plugin[number] = layout.plugin_of(config.BLIND)[1]
        if leads(view, number):
            told = notices.reported_of(view, len(contact_instances(view)))
            for text in unserved_readers(view) if not told[0] & notices.READERS else ():
                warnings.warn(text, ContactWarning, stacklevel=1)
            told[0] |= notices.READERS
        _block_slot(data, number).value = _new_block(view, number)
    except BaseException as error:  # also an interrupt: no step may be taken without a block
        # errors cannot cross MuJoCo's C frames: the message is printed here, and MuJoCo then raises an error of its own
        print(f"contactlaw: plugin instance {number}: {str(error) or type(error).__name__}", file=sys.stderr)
        return -1
    return 0


def _block_slot(data: int, number: int) -> ctypes.c_size_t:
    """Return the word of an mjData that holds the address of an instance's block."""
    blocks = record_at(data, layout.DATA, 1)[0]["plugin_data"]
    return ctypes.c_size_t.from_address(int(blocks) + 8 * number)


def _new_block(view: layout.ModelView, number: int) -> int:
    """Make the block of an instance and return its address; zero if it does not lead."""
    if not leads(view, number):
        return 0
    check_inertias(view)
    return Model(view).block(_REPORT_ADDRESS)


def _rebuild_block(view: layout.ModelView, data: int) -> str:
    """Make the leading block of an mjData again from the edited model; return why an edit has no effect, else ""."""
    first = contact_instances(view)[0]
    slot = _block_slot(data, first)
    old = record_at(slot.value, HEAD, 1)[0]
    changed, kinds = notices.update_watched(old), ""
    try:
        kinds = _checked_types(view, changed["geom_type"])
        made = _new_block(view, first)
    except Exception as error:
        if "plugin_state" in str(error):
            return f"{kinds}: needs more room than plugin_state has"
        named = (*notices.OF_BODIES, *notices.OF_GEOMS)
        rows = [f"{name} of {view.label(name[:4], row)}" for name in named for row in changed[name]]
        what = kinds if changed["geom_type"] else first_of(rows, MAX_NAMES)
        return f"{what}: {error}" if what else str(error)
    new = record_at(made, HEAD, 1)[0]
    before, now = map(View, (old, new))
    resized = any(changed[name] for name in ("geom_type", "geom_size", *notices.OF_FIELDS))
    now.world["edited"] = max(before.world["edited"], RESIZED if resized else EDITED)
    now.pairs["friction"] = before.pairs["friction"]  # `set_friction` may have changed it
    new["newest"] = old["newest"]  # with what is known of the step under way
    for name, count in (("recent", STARTS * (1 + view.nq + view.nv)), ("given", view.nv)):
        ctypes.memmove(int(new[name]), int(old[name]), 8 * count)
    free(slot.value)
    slot.value = made
    own = set(now.geoms.tolist())
    edited = [(name, geom) for name in notices.BITS for geom in changed[name] if geom in own]
    bits = [f"{name} = {getattr(view, name)[geom]} of geom {view.label('geom', geom)}" for name, geom in edited]
    return f"{', '.join(bits)}: the law keeps its contacts; choose geoms anew with load_model" if bits else ""


def _checked_types(view: layout.ModelView, geoms: list[int]) -> str:
    """Return a text on the present types of geoms; raise an error if the law cannot serve an edit to one of them."""
    texts = []
    for geom in geoms:
        kind, moves = type_of(int(view.geom_type[geom])), view.body_weldid[view.geom_bodyid[geom]] != 0
        bare = kind in ("mesh", "hfield") and view.geom_dataid[geom] < 0
        texts.append(f"geom_type = {kind} of geom {view.label('geom', geom)}")
        if bare or kind in UNSERVED or (kind in FLAT and moves):
            raise ValueError(f"{texts[-1]}: the law cannot follow this edit; compile the model anew")
    return ", ".join(texts)


@ctypes.CFUNCTYPE(None, ctypes.c_int64, ctypes.c_int64, ctypes.c_double, ctypes.c_int64, ctypes.c_int64)
@demand.catches
def report(address: int, code: int, value: float, *geoms: int) -> None:
    """Warn of something that a compiled callback found, see `notices`; address: of the block. geoms: -1: none."""
    head, edited = record_at(address, HEAD, 1)[0], code == notices.EDITED
    view, time = layout.ModelView(int(head["model"])), record_at(head["data"], layout.DATA, 1)[0]["time"]
    ends = [(view.label("geom", one), view.label("body", int(view.geom_bodyid[one]))) for one in geoms if one >= 0]
    where = " on ".join(f"{geom} of body {body}" for geom, body in ends) or "contacts"
    why = _rebuild_block(view, int(head["data"])) if edited else ""
    if why or not edited:
        told = view.label("body", int(value)) if code == notices.TOWED else value
        text = f"{where} at {time:.6g} s: {notices.TEXTS[code].format(told)}{why}"
        warnings.warn(text, ContactWarning, stacklevel=3)


_REPORT_ADDRESS = ctypes.cast(report, ctypes.c_void_p).value or 0


def _reduce(whole: mujoco.MjModel | mujoco.MjData) -> tuple[Any, ...]:
    """Pickle a model or an mjData such that unpickling imports this module first."""
    model = whole.model if isinstance(whole, mujoco.MjData) else whole
    if not instances(layout.ModelView(model._address)):
        return whole.__reduce_ex__(2)
    return _unpickle, (type(whole), whole.__getstate__())


def _unpickle(kind: type, state: bytes) -> mujoco.MjModel | mujoco.MjData:
    """Restore a model or an mjData; an mjData gets new blocks, as the pickled addresses belong to another one."""
    whole = kind.__new__(kind)  # type: ignore[call-overload]
    whole.__setstate__(state)
    if isinstance(whole, mujoco.MjData):
        view = layout.ModelView(whole.model._address)
        for number in instances(view):
            _block_slot(whole._address, number).value = _new_block(view, number)
    return whole


for _kind in (mujoco.MjModel, mujoco.MjData):
    copyreg.pickle(_kind, _reduce)  # type: ignore[arg-type]


class Plugin(ctypes.Structure):
    """mjpPlugin of mjplugin.h."""

    _fields_ = [
        ("name", ctypes.c_char_p), ("nattribute", ctypes.c_int), ("attributes", ctypes.POINTER(ctypes.c_char_p)),
        ("capabilityflags", ctypes.c_int), ("needstage", ctypes.c_int),
        *((name, ctypes.c_void_p) for name in _POINTER_FIELDS),
    ]  # fmt: skip


def register() -> None:
    """Register the plugin, or take over what this process has registered before.

    MuJoCo accepts one plugin of a name and ends the process at a second one, and living mjData call the compiled
    callbacks of the first. So these stay; only the Python functions are replaced by those of this import.
    """
    version = tuple(int(part) for part in mujoco.__version__.split(".")[:3])
    if not OLDEST <= version <= NEWEST:
        raise ImportError(
            f"contactlaw works with MuJoCo {'.'.join(map(str, OLDEST))} to {NEWEST[0]}.x, not {mujoco.__version__}"
        )
    if INTERPRETED:
        raise ImportError("contactlaw.mujoco_plugin needs compiled callbacks, and NUMBA_DISABLE_JIT is set")
    layout.check()
    stamp = SOURCE_STAMP + layout.KEY  # key of the compiled callbacks and of their records in memory
    there = [address for name in (config.PLUGIN_NAME, config.BLIND) if (address := layout.plugin_of(name)[0])]
    if there and getattr(sys.modules.get(REGISTERED), "stamp", None) != stamp:
        raise ImportError(
            f"the plugin {config.PLUGIN_NAME} is registered in this process already, by another version of contactlaw; "
            "MuJoCo takes each plugin once: start a new process"
        )
    plugins = [Plugin.from_address(address) for address in there] or _new_plugins()
    for plugin in plugins:
        for name, function in (("nstate", nstate), ("nsensordata", nsensordata), ("init", init)):
            setattr(plugin, name, ctypes.cast(function, ctypes.c_void_p))
    _keep_alive(nstate, nsensordata, init, report, *demand.KEEP_ALIVE)
    if not there:
        for plugin in plugins:
            layout.LIBRARY.mjp_registerPlugin(ctypes.byref(plugin))
        sys.modules[REGISTERED] = known = ModuleType(REGISTERED, "What contactlaw has registered with MuJoCo.")
        known.stamp = stamp


def _new_plugins() -> list[Plugin]:
    """Return the plugin's structs, with sensors and without, complete but for the Python functions."""
    for function in (*(getattr(layout.LIBRARY, name) for name in CALLED), ctypes.pythonapi.PyMem_RawFree):
        llvmlite.binding.add_symbol(function.__name__, ctypes.cast(function, ctypes.c_void_p).value)
    with compiling("the MuJoCo plugin", COMPILE_TIME):
        from contactlaw.mujoco_plugin import callbacks  # its compilation needs the symbols just added

    plugins, passive = [Plugin(), Plugin()], int(mujoco.mjtPluginCapabilityBit.mjPLUGIN_PASSIVE)
    keys = (ctypes.c_char_p * len(config.KEYS))(*(key.encode() for key in config.KEYS))
    for plugin, name, sensor in zip(plugins, (config.PLUGIN_NAME, config.BLIND), (layout.SENSOR, 0), strict=True):
        layout.LIBRARY.mjp_defaultPlugin(ctypes.byref(plugin))
        plugin.name = name.encode()
        plugin.nattribute, plugin.attributes = len(keys), keys
        plugin.capabilityflags, plugin.needstage = passive | sensor, int(mujoco.mjtStage.mjSTAGE_ACC)
        for called in ("compute", "advance", "reset", "destroy"):
            setattr(plugin, called, callbacks.ADDRESSES[called])
    _keep_alive(plugins, keys, CALLBACKS)
    return plugins


def _keep_alive(*things: object) -> None:
    """Keep objects alive until the process ends: mjData may be freed, and models made, until then."""
    for thing in things:
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(thing))
