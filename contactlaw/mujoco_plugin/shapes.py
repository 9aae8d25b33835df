"""Which geoms can touch, how their contact is found, and the radius of curvature there."""

# The wheel describes little of what it exports.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from dataclasses import dataclass
from math import inf

import mujoco
import numpy as np
from numpy.typing import NDArray

from contactlaw.kernels import touch

_TYPE = mujoco.mjtGeom
KINDS = {
    int(_TYPE.mjGEOM_SPHERE): touch.BALL,
    int(_TYPE.mjGEOM_CAPSULE): touch.CAPSULE,
    int(_TYPE.mjGEOM_PLANE): touch.PLANE,
    int(_TYPE.mjGEOM_BOX): touch.BOX,
}
ELLIPSOID = int(_TYPE.mjGEOM_ELLIPSOID)
UNMEASURED = (int(_TYPE.mjGEOM_HFIELD), int(_TYPE.mjGEOM_SDF))
ROUND = (touch.BALL, touch.CAPSULE)
FLAT = (touch.PLANE, touch.BOX)


@dataclass(frozen=True)
class Shape:
    """A geom's type and sizes, as MuJoCo has them."""

    name: str
    type: int
    size: NDArray[np.float64]

    @property
    def kind(self) -> float:
        """As `kernels.touch` has it."""
        return KINDS.get(self.type, touch.OTHER)

    @property
    def is_round(self) -> bool:
        """A ball or a capsule."""
        return self.kind in ROUND

    @property
    def is_spherical(self) -> bool:
        """A ball, if need be as an ellipsoid."""
        return self.kind == touch.BALL or (self.type == ELLIPSOID and bool(np.ptp(self.size) == 0.0))

    @property
    def curvature(self) -> float:
        """1/R [1/m] of a ball, a capsule's end or a flat face."""
        return 1.0 / float(self.size[0]) if self.is_round else 0.0

    @property
    def sizes(self) -> tuple[float, float, float]:
        """For `kernels.touch` [m]."""
        if self.kind == touch.BALL:
            return float(self.size[0]), 0.0, 0.0
        if self.kind == touch.CAPSULE:
            return float(self.size[0]), float(self.size[1]), 0.0
        x, y, z = (float(size) for size in self.size)
        return (x, y, z) if self.kind == touch.BOX else (0.0, 0.0, 0.0)

    @property
    def bound(self) -> float:
        """Radius of a sphere around a round shape or box [m]; infinite otherwise."""
        if self.is_round:
            return sum(self.sizes)
        return float(np.linalg.norm(self.size)) if self.kind == touch.BOX else inf

    @property
    def type_name(self) -> str:
        """As MJCF has it."""
        return _TYPE(self.type).name.removeprefix("mjGEOM_").lower()

    @property
    def label(self) -> str:
        """For messages."""
        return f"{self.type_name} {self.name!r}"


def effective_radius(one: Shape, two: Shape, radius: float | None) -> float:
    """Effective radius [m] of a contact: as given, or from the shapes.

    Raises:
        ValueError: They have no clear radius of curvature where they touch and none is given.
    """
    if radius is not None:
        return radius
    kinds = (one.kind, two.kind)
    if (one.is_round or two.is_round) and touch.OTHER not in kinds:
        return 1.0 / (one.curvature + two.curvature)
    raise ValueError(
        f"radius = None: {one.label} on {two.label} has no one clear radius of curvature; give the pair its effective "
        "radius [m] (clear are a sphere or a capsule's end on a plane, a box face or each other)"
    )


SERVED = (
    "the law serves spheres (ellipsoids of one radius too) on any shape, and capsules on planes, boxes, spheres and "
    "each other; let this pair keep the engine's own contact, or put spheres or capsules in its place"
)


def check_served(one: Shape, two: Shape, free: bool = False) -> None:
    """Refuse two shapes that do not touch as a ball does, in one point each, whatever radius they are given.

    A flat face, a cylinder or an edge would be taken for a ball and sink in, or be thrown up by forces at one corner
    that the others do not know of. free: whether one of them is free to turn every way; a capsule then strikes what the
    engine measures with one end after the other, and within a step only one is seen.

    Raises:
        ValueError: They are such.
    """
    if one.is_spherical or two.is_spherical or (one.is_round and two.is_round):
        return
    if one.is_round or two.is_round:
        other = two if one.is_round else one
        if other.kind in FLAT or not free:
            return
        raise ValueError(
            f"{one.label} on {two.label}, one of them free: a capsule that tumbles touches a {other.type_name} in more "
            f"than one point; {SERVED} (a capsule on other shapes if neither has a free joint)"
        )
    raise ValueError(f"{one.label} on {two.label}: they touch along a face or edge, not in one point; {SERVED}")


def check_measurable(shape: Shape) -> None:
    """Refuse what MuJoCo tells no distance to.

    Raises:
        ValueError: A height field or a signed distance field.
    """
    if shape.type in UNMEASURED:
        raise ValueError(
            f"{shape.label}: MuJoCo computes no reliable distance to it, and bodies would fall through; a plane, "
            "sphere, capsule, ellipsoid, cylinder, box or convex mesh will do"
        )


def in_order(one: Shape, two: Shape) -> bool:
    """Whether the first is the rounder, as `kernels.touch` wants it."""
    return one.is_round or not two.is_round


def has_closed_form(one: Shape, two: Shape) -> bool:
    """Whether `kernels.touch` can place their contact."""
    return (one.is_round or two.is_round) and touch.OTHER not in (one.kind, two.kind)
