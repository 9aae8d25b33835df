"""Functions of shapes that are called by address, so that they are compiled only where a scene has such shapes."""

from collections.abc import Callable
from typing import Any

import numpy as np

from contactlaw.jit import address_of
from contactlaw.world.data import call, kinds
from contactlaw.world.data.records import SWEPT, Array
from contactlaw.world.shapes import convex, core, disc, ellipsoid, height_field, swept

Functions = dict[str, Callable[..., Any]]
TABLE = np.zeros(1, SWEPT)
CALLERS: dict[str, Any] = {
    "meet": call.ask_meeting, "curve": call.ask_radius, "separation": call.ask_separation, "nearest": call.ask_nearest,
    "deepest": call.ask_deepest, "beside": call.ask_beside, "predict": call.ask_time, "over_face": call.ask_over_face,
}  # fmt: skip
OF_SWEPT: Functions = {
    "meet": swept.meet, "curve": swept.radius, "predict": swept.predict_side, "over_face": core.lies_over_face,
}  # fmt: skip
BY_KIND: dict[int, Functions] = {
    kinds.DISC: {"deepest": disc.deepest},
    kinds.SIDE: {"deepest": disc.deepest},
    kinds.ELLIPSOID: {"meet": ellipsoid.meet, "curve": ellipsoid.radius, "separation": ellipsoid.separate},
    kinds.BOX: {"separation": convex.separate},
    kinds.CYLINDER: {"curve": disc.radius, "separation": convex.separate},
    kinds.HULL: {
        "meet": convex.meet, "curve": convex.radius, "nearest": convex.seek_nearest, "separation": convex.separate,
    },
    kinds.HEIGHT_FIELD: {
        "meet": height_field.meet, "curve": height_field.radius, "beside": height_field.meet_beside,
        "deepest": height_field.ridge,
    },
}  # fmt: skip
"""Functions by the field of `records.SHAPE` (`OF_SWEPT`: of `records.SWEPT`) that has their address."""


def write_addresses(shapes_out: Array) -> None:
    """Write the addresses of the functions that shapes need into their records."""
    for kind, functions in BY_KIND.items():
        own = shapes_out["kind"] == kind
        for name, function in functions.items() if own.any() else ():
            shapes_out[name][own] = address_of(function, CALLERS[name])
    own = (shapes_out["kind"] >= kinds.SEGMENT) & (shapes_out["kind"] < kinds.PLANE)
    for name, function in OF_SWEPT.items() if own.any() else ():
        TABLE[name] = address_of(function, CALLERS[name])
        shapes_out["swept"][own] = TABLE.ctypes.data
