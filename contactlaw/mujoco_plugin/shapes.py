"""Which geoms can touch, how their contact is found, and the radius of curvature there."""

# The wheel describes little of what it exports.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from dataclasses import dataclass
from math import inf

import mujoco
import numpy as np
from numpy.typing import NDArray

from contactlaw.mujoco_plugin import callbacks

_TYPE = mujoco.mjtGeom
ROUND = (int(_TYPE.mjGEOM_SPHERE), int(_TYPE.mjGEOM_CAPSULE))
FLAT = (int(_TYPE.mjGEOM_PLANE), int(_TYPE.mjGEOM_BOX))


@dataclass(frozen=True)
class Shape:
    """A geom's type and sizes, as MuJoCo has them."""

    name: str
    kind: int
    size: NDArray[np.float64]

    @property
    def is_round(self) -> bool:
        """A ball or a capsule."""
        return self.kind in ROUND

    @property
    def curvature(self) -> float:
        """1/R [1/m] of a ball, a capsule's end or a flat face."""
        return 1.0 / float(self.size[0]) if self.is_round else 0.0

    @property
    def half_length(self) -> float:
        """Half the distance between the ends of a capsule [m], 0 for a ball."""
        return float(self.size[1]) if self.kind == int(_TYPE.mjGEOM_CAPSULE) else 0.0

    @property
    def bound(self) -> float:
        """Radius of the bounding sphere of a round shape or box [m]; infinite otherwise."""
        if self.is_round:
            return float(self.size[0]) + self.half_length
        return float(np.linalg.norm(self.size)) if self.kind == int(_TYPE.mjGEOM_BOX) else inf

    @property
    def label(self) -> str:
        """For messages."""
        return f"{_TYPE(self.kind).name.removeprefix('mjGEOM_').lower()} {self.name!r}"


@dataclass(frozen=True)
class Meeting:
    """How two geoms meet: which is A, how their contact is located, and their effective radius [m]."""

    swapped: bool
    kind: int
    slots: int
    radius: float


def meeting(one: Shape, two: Shape, radius: float | None) -> Meeting:
    """How two geoms meet.

    Raises:
        ValueError: They have no clear radius of curvature where they touch and none is given.
    """
    swapped = not one.is_round and two.is_round
    a, b = (two, one) if swapped else (one, two)
    if a.is_round and (b.is_round or b.kind in FLAT):
        effective = 1.0 / (a.curvature + b.curvature) if radius is None else radius
        if b.is_round:
            bars = a.half_length > 0.0 or b.half_length > 0.0
            return Meeting(swapped, callbacks.ROUND_BARS if bars else callbacks.BALL_ON_BALL, 1, effective)
        on_plane = b.kind == int(_TYPE.mjGEOM_PLANE)
        slots = 1 if a.half_length == 0.0 else callbacks.BOTH_ENDS if on_plane else callbacks.BOTH_ENDS + 1
        return Meeting(swapped, callbacks.BALL_ON_PLANE if on_plane else callbacks.BALL_ON_BOX, slots, effective)
    if radius is None:
        raise ValueError(
            f"radius = None: {one.label} on {two.label} has no one clear radius of curvature; give the pair its "
            "effective radius [m] (clear are a sphere or a capsule's end on a plane, a box face or each other)"
        )
    return Meeting(False, callbacks.ANY_SHAPES, 1, radius)
