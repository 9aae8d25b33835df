"""Geoms as shapes of a world: which can touch, and the radius of curvature there."""

# The wheel describes little of what it exports.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from dataclasses import dataclass
from math import inf

import mujoco
import numpy as np
from numpy.typing import NDArray

from contactlaw.world.shapes import ROUNDING

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
    def is_round(self) -> bool:
        """A ball or a capsule."""
        return self.is_spherical or self.type == CAPSULE

    @property
    def is_spherical(self) -> bool:
        """A ball, if need be as an ellipsoid."""
        return self.type == SPHERE or (self.type == ELLIPSOID and bool(np.ptp(self.size) == 0.0))

    @property
    def is_flat(self) -> bool:
        """A plane, or what meets one with corners or a rim: a box or a cylinder."""
        return self.type in (PLANE, BOX, CYLINDER)

    @property
    def is_convex(self) -> bool:
        """An ellipsoid, or a mesh, which is its convex hull."""
        return self.type in (MESH, ELLIPSOID) and not self.is_spherical

    @property
    def has_closed_form(self) -> bool:
        """Whether the world knows it."""
        return self.is_round or self.is_flat or self.is_convex

    @property
    def curvature(self) -> float:
        """1/R [1/m] of a ball, a capsule's end or a flat face."""
        return 1.0 / float(self.size[0]) if self.is_round else 0.0

    @property
    def bound(self) -> float:
        """Radius of a sphere around a round shape, a box or a cylinder [m]; infinite otherwise."""
        if self.is_spherical:
            return float(self.size[0])
        if self.type == CAPSULE:
            return float(self.size[0] + self.size[1])
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


def effective_radius(one: Shape, two: Shape, radius: float | None) -> float:
    """Effective radius [m] of a contact: as given, or from the shapes; of flat ones that of their edges by default.

    Raises:
        ValueError: They have no clear radius of curvature where they touch and none is given.
    """
    if radius is not None:
        return radius
    if one.is_convex or two.is_convex:
        return inf  # found at the touch
    if one.is_flat and two.is_flat:
        return ROUNDING * min(float(shape.size[shape.size > 0.0].min()) for shape in (one, two) if shape.type != PLANE)
    if (one.is_round or two.is_round) and all(shape.has_closed_form and shape.type != CYLINDER for shape in (one, two)):
        return 1.0 / (one.curvature + two.curvature)
    raise ValueError(
        f"radius = None: {one.label} on {two.label} has no one clear radius of curvature; give the pair its effective "
        "radius [m] (clear are a sphere or a capsule's end on a plane, a box face or each other)"
    )


SERVED = (
    "the law serves spheres (ellipsoids of one radius too) on any shape, and capsules, boxes, cylinders, meshes and "
    "ellipsoids on planes, spheres and each other, but for cylinders on the last two; let this pair keep the engine's "
    "own contact, or put such shapes in its place"
)


def check_served(one: Shape, two: Shape, free: bool = False) -> None:
    """Refuse two shapes that do not touch as a ball does, in one point each, whatever radius they are given.

    Boxes and cylinders have round parts for what is flat; a face or an edge that the engine measures would be taken for
    a ball and sink in, or be thrown up by forces at one corner that the others do not know of. free: whether one of
    them is free to turn every way; a capsule then strikes what the engine measures with one end after the other, and at
    a time only one is seen.

    Raises:
        ValueError: They are such.
    """
    both = {one.type, two.type}
    if (one.is_convex or two.is_convex) and one.has_closed_form and two.has_closed_form and CYLINDER not in both:
        return
    if one.is_spherical or two.is_spherical or (one.is_round and two.is_round):
        return
    if one.is_flat and two.is_flat and not one.type == two.type == PLANE:
        return
    if one.is_round or two.is_round:
        other = two if one.is_round else one
        if other.is_flat or not free:
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


def why_not_served(one: Shape, two: Shape, radius: float | None, free: bool) -> str | None:
    """Why the law cannot have the contact of two shapes; None: it can. Arguments as above."""
    try:
        check_measurable(one)
        check_measurable(two)
        check_served(one, two, free)
        if one.size.any() and two.size.any():  # a mesh has its sizes once compiled
            effective_radius(one, two, radius)
    except ValueError as error:
        return str(error)
    return None


def native_margin(one: Shape, two: Shape) -> float:
    """Margin, to be negated, of an explicit pair that the engine's bounding test always rejects."""
    bounds = [shape.bound for shape in (one, two)]
    # Bounding spheres are compared by squares: only a sum of exactly zero rejects all. Planes are compared signed.
    return sum(bounds) if max(bounds) < inf else 1e6
