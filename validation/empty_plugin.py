"""A MuJoCo plugin that does nothing. What it adds to a step is what any plugin costs that is called in each."""

# The wheel describes little of what it exports.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import ctypes
from typing import Any

from numba import cfunc, types

NAME = "validation.empty"
POINTER, COUNT = types.uintp, types.int32


@cfunc(types.void(POINTER, POINTER, COUNT, COUNT))
def compute(model, data, instance, capability):
    """Do nothing within the step."""


@cfunc(types.void(POINTER, POINTER, COUNT))
def advance(model, data, instance):
    """Do nothing after the step."""


@cfunc(types.void(POINTER, POINTER, POINTER, COUNT))
def reset(model, state, data, instance):
    """Do nothing at a reset."""


@cfunc(COUNT(POINTER, COUNT))
def nstate(model, instance):
    """Return the number of doubles in its state: none."""
    return 0


@cfunc(COUNT(POINTER, POINTER, COUNT))
def init(model, data, instance):
    """Return that nothing is wrong."""
    return 0


FUNCTIONS = {"compute": compute, "advance": advance, "reset": reset, "nstate": nstate, "init": init}
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
