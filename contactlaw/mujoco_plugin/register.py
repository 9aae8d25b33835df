"""Make the plugin known to MuJoCo, once for each process."""

# The wheel describes little of what it exports.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import ctypes

import llvmlite.binding
import mujoco
from numba.core import config as numba_config

from contactlaw.jit import compiling
from contactlaw.mujoco_plugin import config, layout

COMPILE_TIME = 40  # [s]
OLDEST, NEWEST = (4, 0), (4, 99)
_POINTER_FIELDS = (
    "nstate", "nsensordata", "init", "destroy", "copy", "reset", "compute", "advance", "visualize",
    "actuator_act_dot", "sdf_distance", "sdf_gradient", "sdf_staticdistance", "sdf_attribute", "sdf_aabb",
)  # fmt: skip


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
    version = tuple(int(part) for part in mujoco.__version__.split(".")[:2])
    if not OLDEST <= version <= NEWEST:
        raise ImportError(
            f"contactlaw works with MuJoCo {OLDEST[0]}.{OLDEST[1]} and later 4.x, not {mujoco.__version__}"
        )
    if numba_config.DISABLE_JIT:
        raise ImportError("contactlaw.mujoco_plugin needs compiled callbacks, and NUMBA_DISABLE_JIT is set")
    layout.check()


def register() -> _Plugin:
    """Fill the plugin's struct and register it. Returns what must live as long as the process."""
    _check_version()
    library = layout.library()
    for name in ("mj_solveM", "mj_rne", "mj_factorM", "mj_fwdActuation", "mj_applyFT", "mj_geomDistance", "mju_free"):
        llvmlite.binding.add_symbol(name, ctypes.cast(getattr(library, name), ctypes.c_void_p).value)
    with compiling("the MuJoCo plugin", COMPILE_TIME):
        from contactlaw.mujoco_plugin import callbacks, instance  # compiled against the symbols just added

    plugin = _Plugin()
    library.mjp_defaultPlugin(ctypes.byref(plugin))
    keys = (ctypes.c_char_p * len(config.KEYS))(*(key.encode() for key in config.KEYS))
    plugin.name = config.PLUGIN_NAME.encode()
    plugin.nattribute, plugin.attributes = len(keys), keys
    plugin.capabilityflags = int(mujoco.mjtPluginCapabilityBit.mjPLUGIN_PASSIVE)
    plugin.nstate = ctypes.cast(instance.nstate, ctypes.c_void_p)
    plugin.init = ctypes.cast(instance.init, ctypes.c_void_p)
    plugin.compute, plugin.advance = callbacks.compute, callbacks.advance
    plugin.reset, plugin.destroy = callbacks.reset, callbacks.destroy
    library.mjp_registerPlugin(ctypes.byref(plugin))
    # mjData may be freed, and models made, until the very end of the process: nothing of this may go before.
    for kept in (plugin, keys, instance.nstate, instance.init, instance.report):
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(kept))
    return plugin
