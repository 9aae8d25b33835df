"""Make the plugin known to MuJoCo, once for each process."""

from __future__ import annotations

import ctypes
import sys
from types import ModuleType

import llvmlite.binding
import mujoco
from numba.core import config as numba_config

from contactlaw import jit
from contactlaw.mujoco_plugin import config, layout
from contactlaw.mujoco_plugin.layout import SENSOR_SYMBOLS
from contactlaw.world import demand

COMPILE_TIME = 15  # [s]
OLDEST, NEWEST = (3, 3, 6), (4, 99, 99)
_POINTER_FIELDS = (
    "nstate", "nsensordata", "init", "destroy", "copy", "reset", "compute", "advance", "visualize",
    "actuator_act_dot", "sdf_distance", "sdf_gradient", "sdf_staticdistance", "sdf_attribute", "sdf_aabb",
)  # fmt: skip
REGISTERED = (
    "_contactlaw_registered"  # in sys.modules: what has been registered, also where contactlaw is imported anew
)


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


def _check_version() -> None:
    version = tuple(int(part) for part in mujoco.__version__.split(".")[:3])
    if not OLDEST <= version <= NEWEST:
        raise ImportError(
            f"contactlaw works with MuJoCo {'.'.join(map(str, OLDEST))} to {NEWEST[0]}.x, not {mujoco.__version__}"
        )
    if numba_config.DISABLE_JIT:
        raise ImportError("contactlaw.mujoco_plugin needs compiled callbacks, and NUMBA_DISABLE_JIT is set")
    layout.check()


def register() -> None:
    """Fill the plugins' structs and register them, or take over what this process has registered before.

    MuJoCo takes one plugin of a name and ends the process at a second, and mjData that live on call the first one's
    compiled callbacks. These stay, therefore; only what MuJoCo asks of Python goes over to the modules of now.

    Raises:
        ImportError: Another MuJoCo than this works with, or another version of the plugin is registered already.
    """
    _check_version()
    there = [address for name in (config.PLUGIN_NAME, config.BLIND) if (address := layout.plugin_of(name)[0])]
    plugins = _again(there) if there else _first()
    from contactlaw.mujoco_plugin import instance

    for plugin in plugins:
        plugin.nstate = ctypes.cast(instance.nstate, ctypes.c_void_p)
        plugin.init = ctypes.cast(instance.init, ctypes.c_void_p)
        plugin.nsensordata = ctypes.cast(instance.nsensordata, ctypes.c_void_p)
    _keep(instance.nstate, instance.init, instance.nsensordata, instance.report, *demand.LASTS)
    if not there:
        for plugin in plugins:
            layout.LIBRARY.mjp_registerPlugin(ctypes.byref(plugin))
        sys.modules[REGISTERED] = known = ModuleType(REGISTERED, "What contactlaw has registered with MuJoCo.")
        known.stamp = _stamp()


def _stamp() -> str:
    """What compiled callbacks and the memory that they work on depend on."""
    return jit.SOURCE_STAMP + layout.KEY


def _first() -> list[_Plugin]:
    """The structs of the plugin with sensors and without, but for what MuJoCo asks of Python."""
    functions = [getattr(layout.LIBRARY, name) for name in ("mjd_smooth_vel", *SENSOR_SYMBOLS)]
    for function in (*functions, ctypes.pythonapi.PyMem_RawFree):
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


def _again(addresses: list[int]) -> list[_Plugin]:
    """The plugins as they stand in MuJoCo's own table."""
    known = sys.modules.get(REGISTERED)
    if getattr(known, "stamp", None) != _stamp():
        raise ImportError(
            f"the plugin {config.PLUGIN_NAME} is registered in this process already, by another version of contactlaw; "
            "MuJoCo takes each plugin once: start a new process"
        )
    return [_Plugin.from_address(address) for address in addresses]


def _keep(*things: object) -> None:
    """Let things live to the very end of the process: until then mjData may be freed, and models made."""
    for thing in things:
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(thing))
