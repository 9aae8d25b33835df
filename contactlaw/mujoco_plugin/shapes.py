"""Geoms as shapes of a world: which can touch, and what the engine takes for their bounds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from contactlaw.world.sets import Sets

_TYPE = mujoco.mjtGeom
SPHERE, CAPSULE, PLANE, BOX, CYLINDER, ELLIPSOID, MESH = (
    int(kind) for kind in (
        _TYPE.mjGEOM_SPHERE, _TYPE.mjGEOM_CAPSULE, _TYPE.mjGEOM_PLANE, _TYPE.mjGEOM_BOX, _TYPE.mjGEOM_CYLINDER,
        _TYPE.mjGEOM_ELLIPSOID, _TYPE.mjGEOM_MESH,
    )
)  # fmt: skip
UNMEASURED = (int(_TYPE.mjGEOM_HFIELD), int(_TYPE.mjGEOM_SDF))


@dataclass(frozen=True)
class Shape:
    """A geom's type and sizes, as MuJoCo has them."""

    name: str
    type: int
    size: NDArray[np.float64]

    @property
    def is_spherical(self) -> bool:
        """A ball, if need be as an ellipsoid."""
        return self.type == SPHERE or (self.type == ELLIPSOID and bool(np.ptp(self.size) == 0.0))

    @property
    def bound(self) -> float:
        """Radius of a sphere around it [m], as MuJoCo has it; infinite of planes and meshes."""
        if self.is_spherical:
            return float(self.size[0])
        if self.type == CAPSULE:
            return float(self.size[0] + self.size[1])
        if self.type == ELLIPSOID:
            return float(self.size.max())
        if self.type == CYLINDER:
            return float(np.hypot(self.size[0], self.size[1]))
        return float(np.linalg.norm(self.size)) if self.type == BOX else inf

    @property
    def kind(self) -> tuple[int, bool]:
        """All that decides whether it can be measured and served, and its radius read."""
        return self.type, self.is_spherical

    @property
    def type_name(self) -> str:
        """As MJCF has it."""
        return _TYPE(self.type).name.removeprefix("mjGEOM_").lower()

    @property
    def label(self) -> str:
        """For messages."""
        return f"{self.type_name} {self.name!r}"


def shape_of(geom: mujoco.MjsGeom) -> Shape:
    """Of a geom of a specification."""
    return Shape(geom.name, int(geom.type), np.array(geom.size))


def why_not_served(one: Shape, two: Shape) -> str | None:
    """Why the law cannot have the contact of two shapes; None: it can."""
    for shape in (one, two):
        if shape.type in UNMEASURED:
            return (
                f"{shape.label}: MuJoCo computes no reliable distance to it, and bodies would fall through; a plane, "
                "sphere, capsule, ellipsoid, cylinder, box or convex mesh will do"
            )
    if one.type == two.type == PLANE:  # nothing round to meet by
        return f"{one.label} on {two.label}: planes do not touch each other; a box will do for one of them"
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
    return -1e6, 0.0 if PLANE in (one.type, two.type) else 1e6
