"""A MuJoCo plugin that does nothing. What it adds to a step is what any plugin costs that is called in each."""

# The wheel describes little of what it exports.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import ctypes
from typing import Any

from numba import cfunc, types

NAME = "validation.empty"
POINTER, COUNT = types.uintp, types.int32


def _of(result: Any, function: Any, *arguments: Any) -> Any:
    return cfunc(result(*arguments))(function)


FUNCTIONS = {
    "compute": _of(types.void, lambda model, data, instance, capability: None, POINTER, POINTER, COUNT, COUNT),
    "advance": _of(types.void, lambda model, data, instance: None, POINTER, POINTER, COUNT),
    "reset": _of(types.void, lambda model, state, data, instance: None, POINTER, POINTER, POINTER, COUNT),
    "nstate": _of(COUNT, lambda model, instance: 0, POINTER, COUNT),
    "init": _of(COUNT, lambda model, data, instance: 0, POINTER, POINTER, COUNT),
}
"""The engine's hooks; two of them return how many doubles the state has, and that nothing is wrong."""
_registered: list[Any] = []  # MuJoCo keeps what it points to


def attach(spec: Any) -> None:
    """Give a model an instance of the plugin."""
    import mujoco

    from contactlaw.mujoco_plugin import layout
    from contactlaw.mujoco_plugin.plugin import Plugin

    if not _registered:
        made = Plugin()
        layout.LIBRARY.mjp_defaultPlugin(ctypes.byref(made))
        made.name = NAME.encode()
        made.capabilityflags = int(mujoco.mjtPluginCapabilityBit.mjPLUGIN_PASSIVE)
        for name, function in FUNCTIONS.items():
            setattr(made, name, function.address)
        layout.LIBRARY.mjp_registerPlugin(ctypes.byref(made))
        _registered.append(made)
    spec.activate_plugin(NAME)
    spec.add_plugin(name=NAME, plugin_name=NAME, active=True)
    body = spec.bodies[1]
    body.plugin.active, body.plugin.plugin_name, body.plugin.name = True, NAME, NAME
