"""Geoms as shapes of a world: which can touch, by the law or natively, and what the engine takes for their bounds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from contactlaw.world.near.sets import Sets

Bits = tuple[int, int]
UNMEASURED = ("sdf",)
FLAT = "plane", "hfield"  # which only what is round meets


def type_of(number: int) -> str:
    """The type of a geom, as MJCF has it."""
    return mujoco.mjtGeom(number).name.removeprefix("mjGEOM_").lower()


@dataclass(frozen=True)
class Shape:
    """A geom's type and sizes, as MJCF has them."""

    name: str
    type: str
    size: NDArray[np.float64]

    @property
    def is_spherical(self) -> bool:
        """A ball, if need be as an ellipsoid."""
        return self.type == "sphere" or (self.type == "ellipsoid" and bool(np.ptp(self.size) == 0.0))

    @property
    def bound(self) -> float:
        """Radius of a sphere around it [m], as MuJoCo has it; infinite of planes, height fields and meshes."""
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
    def kind(self) -> tuple[str, bool]:
        """All that decides whether it can be measured and served, and its radius read."""
        return self.type, self.is_spherical

    @property
    def label(self) -> str:
        """For messages."""
        return f"{self.type} {self.name!r}"


def shape_of(geom: mujoco.MjsGeom) -> Shape:
    """Of a geom of a specification."""
    return Shape(geom.name, type_of(geom.type), np.array(geom.size))


def why_not_served(one: Shape, two: Shape) -> str | None:
    """Why the law cannot have the contact of two shapes; None: it can."""
    for shape in (one, two):
        if shape.type in UNMEASURED:
            return (
                f"{shape.label}: MuJoCo computes no reliable distance to it, and bodies would fall through; a plane, "
                "height field, sphere, capsule, ellipsoid, cylinder, box or convex mesh will do"
            )
    if one.type in FLAT and two.type in FLAT:
        return f"{one.label} on {two.label}: planes and height fields do not touch each other; a box will do for one"
    return None


def check_served(sets: Sets, shapes: Mapping[Any, Shape]) -> None:
    """Refuse geoms whose contacts the law cannot have.

    Raises:
        ValueError: There are such; the message names them.
    """
    for one, two in sets.by_kinds(lambda geom: shapes[geom].kind):
        why = why_not_served(shapes[one], shapes[two])
        if why:
            raise ValueError(why)


def native_margin(one: Shape, two: Shape) -> tuple[float, float]:
    """Margin and gap [m] of an explicit pair by which the engine never makes a contact.

    Its bounding spheres are compared by squares: only a sum of exactly zero rejects all; planes are compared signed.
    Convex bodies that pass are taken to touch whatever the margin. A mesh has its bound once compiled: it passes, and
    the gap excludes what is found from the constraints.
    """
    bounds = [shape.bound for shape in (one, two)]
    if max(bounds) < inf:
        return -sum(bounds), 0.0
    return -1e6, 0.0 if "plane" in (one.type, two.type) else 1e6


def touch(one: Bits, two: Bits) -> bool:
    """Whether geoms with this contype and conaffinity touch natively."""
    return bool(one[0] & two[1] or two[0] & one[1])
