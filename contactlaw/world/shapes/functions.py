"""Functions of shapes that are called by address, so that they are compiled only where a scene has such shapes."""

from collections.abc import Callable
from typing import Any

from contactlaw.jit import address_of
from contactlaw.world.data import call, kinds
from contactlaw.world.data.records import Array
from contactlaw.world.shapes import curvature, disc, ellipsoid, gjk, height_field, swept

WIDE = {"predict": swept.predict_side}
FUNCTIONS: dict[int, dict[str, Callable[..., Any]]] = {
    kinds.SEGMENT: WIDE | {"meet": swept.meet, "curve": curvature.of_line},
    kinds.EDGE: WIDE | {"curve": curvature.of_line},
    kinds.DISC: WIDE | {"meet": swept.meet, "curve": curvature.of_rim, "deepest": disc.deepest},
    kinds.SIDE: WIDE | {"curve": curvature.of_line, "deepest": disc.deepest},
    kinds.ELLIPSOID: WIDE | {
        "meet": ellipsoid.meet, "curve": curvature.of_ellipsoid, "separation": ellipsoid.separate,
    },
    kinds.BOX: WIDE | {"meet": swept.meet, "curve": curvature.of_box, "separation": gjk.separate},
    kinds.CYLINDER: WIDE | {"meet": swept.meet, "curve": curvature.of_cylinder, "separation": gjk.separate},
    kinds.HULL: WIDE | {
        "meet": gjk.meet, "curve": curvature.of_hull, "nearest": gjk.nearest, "separation": gjk.separate,
    },
    kinds.HEIGHT_FIELD: {"curve": curvature.of_field, "beside": height_field.meet_beside},
}  # fmt: skip
"""Functions of each kind by the field of `records.SHAPE` that has their address; balls and planes need none."""


def write_addresses(shapes_out: Array) -> None:
    """Write the addresses of the functions that shapes need into their records."""
    for kind, functions in FUNCTIONS.items():
        own = shapes_out["kind"] == kind
        for name, function in functions.items() if own.any() else ():
            shapes_out[name][own] = address_of(function, getattr(call, f"ask_{name}"))
