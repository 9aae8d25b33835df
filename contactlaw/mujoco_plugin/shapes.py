"""Geoms as shapes: which pairs the law serves, which touch natively, and bounding spheres as the engine has them."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from contactlaw.world.near.sets import Sets

Bits = tuple[int, int]
UNSERVED = ("sdf",)  # types to which MuJoCo computes no reliable distance
FLAT = "plane", "hfield"  # types that only round shapes, or round parts of others, can touch


def type_of(number: int) -> str:
    """Return the type of a geom by MuJoCo's number, as MJCF names it."""
    return mujoco.mjtGeom(number).name.removeprefix("mjGEOM_").lower()


@dataclass(frozen=True)
class Shape:
    """Name, type and sizes of a geom, as MJCF has them."""

    name: str
    type: str
    size: NDArray[np.float64]

    @property
    def is_spherical(self) -> bool:
        """Whether it is a ball, also one written as an ellipsoid."""
        return self.type == "sphere" or (self.type == "ellipsoid" and bool(np.ptp(self.size) == 0.0))

    @property
    def bound(self) -> float:
        """Radius [m] of MuJoCo's bounding sphere; infinite for planes, height fields and meshes."""
        if self.is_spherical:
            return float(self.size[0])
        if self.type == "capsule":
            return float(self.size[0] + self.size[1])
        if self.type == "ellipsoid":
            return float(self.size.max())
        if self.type == "cylinder":
            return float(np.hypot(self.size[0], self.size[1]))
        return float(np.linalg.norm(self.size)) if self.type == "box" else inf

    @property
    def label(self) -> str:
        """Type and name, for messages."""
        return f"{self.type} {self.name!r}"


def shape_of(geom: mujoco.MjsGeom) -> Shape:
    """Return the shape of a geom of a specification."""
    return Shape(geom.name, type_of(geom.type), np.array(geom.size))


def why_not_served(one: Shape, two: Shape) -> str | None:
    """Return why the law cannot serve the contact of two shapes, or None if it can."""
    for shape in (one, two):
        if shape.type in UNSERVED:
            return (
                f"{shape.label}: MuJoCo computes no reliable distance to it, and bodies would fall through; a plane, "
                "height field, sphere, capsule, ellipsoid, cylinder, box or convex mesh will do"
            )
    if one.type in FLAT and two.type in FLAT:
        return f"{one.label} on {two.label}: planes and height fields do not touch each other; a box will do for one"
    return None


def check_served(sets: Sets, shapes: Mapping[Any, Shape]) -> None:
    """Check that the law can serve all pairs of two sets of geoms.

    Raises:
        ValueError: It cannot serve a pair; the message names the geoms.
    """
    for one, two in sets.by_kinds(lambda geom: shapes[geom].type):
        why = why_not_served(shapes[one], shapes[two])
        if why:
            raise ValueError(why)


def native_margin(one: Shape, two: Shape) -> tuple[float, float]:
    """Return margin and gap [m] of an explicit `<pair>` for which the engine never makes a contact.

    The engine compares squared distances of bounding spheres with the sum of radii and margin: only a sum of exactly
    zero rejects all. Planes are compared by signed distance. Convex shapes that pass this test are reported as touching
    whatever the margin is. A mesh has its bounding sphere only once compiled, so it passes; the gap then excludes its
    contacts from the constraints.
    """
    bounds = [shape.bound for shape in (one, two)]
    if max(bounds) < inf:
        return -sum(bounds), 0.0
    return -1e6, 0.0 if "plane" in (one.type, two.type) else 1e6


def touch(one: Bits, two: Bits) -> bool:
    """Return whether geoms with these (contype, conaffinity) touch natively."""
    return bool(one[0] & two[1] or two[0] & one[1])
