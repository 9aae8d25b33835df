"""Shapes added to a world from Python, and their round parts, as fields of the records `records.SHAPE`."""

from itertools import product
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from contactlaw import checks
from contactlaw.world.data import kinds
from contactlaw.world.data.frames import UNIT, matrix_of, turn_to, unit_quaternion
from contactlaw.world.data.kinds import BOX, CORNER, CYLINDER, DISC, EDGE, HEIGHT_FIELD, HULL, PLANE, SIDE
from contactlaw.world.data.records import Array
from contactlaw.world.shapes import field_surface
from contactlaw.world.shapes.core import CROWN
from contactlaw.world.shapes.geometry import PLACES
from contactlaw.world.shapes.hulls import core_of

Fields = dict[str, Any]

CORES = {BOX, CYLINDER, HULL}
FEET = 0.7  # distance of a foot from the axis, of the radius of the rim
ROUNDING = 0.1  # default radius of the edges of a box or a cylinder, of its smallest half length


class Shapes:
    """The part of `World` that adds shapes."""

    def __init__(self) -> None:
        self._frames: list[Array] = []  # of each body: quaternion of its principal axes in its own
        self._new_shapes: list[Fields] = []
        self._memberships: list[tuple[int, ...]] = []  # of each shape: the sets that it is in, 2 rule + side
        self._kinds: list[int] = []  # of each shape
        self._owners: list[int] = []  # of each shape: its own number, or that of the shape that it is a part of
        self._solids: dict[int, tuple[Fields, set[int]]] = {}  # cores, and the kinds of shapes that each has parts for
        self._regroup = False

    def add_sphere(self, body: int, radius: float, at: ArrayLike = (0.0, 0.0, 0.0)) -> int:
        """Fix a sphere to a body; returns the shape's number.

        Args:
            radius: [m].
            at: Its centre, from the centre of mass along the body's axes [m], shape (3,).
        """
        return self._shape(self._placed(kinds.SPHERE, body, at) | {"radius": checks.positive("radius", radius)})

    def add_capsule(
        self, body: int, radius: float, half_length: float, at: ArrayLike = (0.0, 0.0, 0.0),
        axis: ArrayLike = (0.0, 0.0, 1.0),
    ) -> tuple[int, int, int]:  # fmt: skip
        """Fix a capsule to a body; returns the numbers of its three shapes: its side and both ends.

        Args:
            radius: [m].
            half_length: From its middle to the centre of an end [m].
            at: Its middle, from the centre of mass along the body's axes [m], shape (3,).
            axis: Direction of its middle line along the body's axes, a unit vector.
        """
        half = checks.positive("half_length", half_length) * checks.unit_vector("axis", axis)
        own, middle = {"radius": checks.positive("radius", radius)}, checks.vector("at", at)
        side = self._placed(kinds.SEGMENT, body, middle, half=half) | own
        one, other = (self._placed(kinds.END, body, middle + s * half) | own for s in (1.0, -1.0))
        return self._shape(side), self._shape(one), self._shape(other)

    def add_box(
        self, body: int | None, half_lengths: ArrayLike, at: ArrayLike = (0.0, 0.0, 0.0),
        quaternion: ArrayLike = (1.0, 0.0, 0.0, 0.0), rounding: float | None = None,
    ) -> int:  # fmt: skip
        """Fix a box to a body, or to the world: None; returns the shape's number.

        Args:
            half_lengths: [m], shape (3,).
            at: Its centre [m], shape (3,): from the centre of mass along the body's axes, or in the world.
            quaternion: Of its own axes in the body's, scalar first, shape (4,).
            rounding: Radius of its edges [m], and so of its contacts with flat shapes, see docs/shapes.md; None: a
                tenth of the smallest half length.
        """
        half, axes = _sizes("half_lengths", half_lengths), matrix_of(unit_quaternion("quaternion", quaternion))
        return self._shape(self._placed(kinds.BOX, body, at, axes=axes) | _rounded(half, rounding))

    def add_cylinder(
        self, body: int | None, radius: float, half_length: float, at: ArrayLike = (0.0, 0.0, 0.0),
        axis: ArrayLike = (0.0, 0.0, 1.0), rounding: float | None = None,
    ) -> int:  # fmt: skip
        """Fix a cylinder to a body, or to the world: None; returns the shape's number.

        Args:
            radius: [m].
            half_length: From its middle to an end [m].
            at, rounding: As for a box.
            axis: Its axis along the body's axes, a unit vector.
        """
        axes = turn_to(checks.unit_vector("axis", axis))
        sizes = np.array([checks.positive("radius", radius), checks.positive("half_length", half_length)])
        return self._shape(self._placed(kinds.CYLINDER, body, at, axes=axes) | _rounded(sizes[[0, 0, 1]], rounding))

    def add_ellipsoid(
        self, body: int | None, half_axes: ArrayLike, at: ArrayLike = (0.0, 0.0, 0.0),
        quaternion: ArrayLike = (1.0, 0.0, 0.0, 0.0),
    ) -> int:  # fmt: skip
        """Fix an ellipsoid to a body, or to the world: None; returns the shape's number.

        Args:
            half_axes: [m], shape (3,).
            at, quaternion: As for a box.
        """
        half, axes = _sizes("half_axes", half_axes), matrix_of(unit_quaternion("quaternion", quaternion))
        return self._shape(self._placed(kinds.ELLIPSOID, body, at, axes=axes) | {"half": half})

    def add_hull(
        self, body: int | None, points: ArrayLike, rounding: float | None = None, at: ArrayLike = (0.0, 0.0, 0.0),
        quaternion: ArrayLike = (1.0, 0.0, 0.0, 0.0),
    ) -> int:  # fmt: skip
        """Fix the convex hull of points to a body, or to the world: None; returns the shape's number.

        Points that change the hull by less than 0.0039 of its size are left out, and it has a hundred vertices at most.

        Args:
            points: [m], shape (n, 3), along their own axes.
            rounding: Radius of its edges [m]; None: a tenth of the least distance of a face from its middle.
            at: Origin of the points [m], shape (3,): from the centre of mass along the body's axes, or in the world.
            quaternion: Of their axes in the body's, scalar first, shape (4,).
        """
        own = checks.finite_array("points", points)
        if own.ndim != 2 or own.shape[1] != 3:
            raise ValueError(f"points: shape {own.shape}; must be (n, 3)")
        radius = None if rounding is None else checks.positive("rounding", rounding)
        made = self._placed(kinds.HULL, body, at, axes=matrix_of(unit_quaternion("quaternion", quaternion)))
        vertices, edges, radius = core_of(own, radius)
        own = vertices @ made.pop("axes").reshape(3, 3).T
        middle = 0.5 * (own.max(0) + own.min(0))
        own -= middle
        reach = float(np.linalg.norm(own, axis=1).max()) + radius
        made |= {"radius": radius, "at": made["at"] + middle, "half": np.array([reach, 0.0, 0.0]), "vertices": own}
        return self._shape(made | {"edges": edges})

    def add_plane(self, body: int | None, point: ArrayLike, normal: ArrayLike) -> int:
        """Fix a plane, the surface of a half space, to a body, or to the world: None; returns the shape's number.

        Args:
            point: On the plane [m], shape (3,): from the centre of mass along the body's axes, or in the world.
            normal: Outward normal of the half space along the same axes, a unit vector.
        """
        p, n = checks.vector("point", point), checks.unit_vector("normal", normal)
        return self._shape(self._placed(kinds.PLANE, body, p, normal=n))

    def add_height_field(
        self, body: int | None, heights: ArrayLike, half_lengths: ArrayLike, at: ArrayLike = (0.0, 0.0, 0.0),
        quaternion: ArrayLike = (1.0, 0.0, 0.0, 0.0), base: float | None = None,
    ) -> int:  # fmt: skip
        """Fix a height field to a body, or to the world: None; returns the shape's number.

        The surface through the heights is smooth, the top of a block. Shapes touch it by the points by which they meet
        planes, and on ridges by sides of capsules and cylinders and edges of boxes and hulls.

        Args:
            heights: [m], shape (rows, columns), at least two each: rows along its y axis, columns along x.
            half_lengths: Half of its lengths along x and y [m], shape (2,).
            at, quaternion: As for a box; heights are along the third axis.
            base: Thickness of the block [m] below the lowest height, > 0; None: the smaller half length.
        """
        own, half = checks.finite_array("heights", heights), checks.finite_array("half_lengths", half_lengths)
        if own.ndim != 2 or min(own.shape) < 2:
            raise ValueError(f"heights: shape {own.shape}; must be (rows, columns), at least 2 each")
        if half.shape != (2,) or not half.min() > 0.0:
            raise ValueError(f"half_lengths = {half.tolist()}: must be two numbers > 0")
        rows, top = field_surface.table(own, half)
        axes = matrix_of(unit_quaternion("quaternion", quaternion))
        place = checks.vector("at", at) + top * axes[:, 2]
        made = self._placed(kinds.HEIGHT_FIELD, body, place, axes=axes, normal=axes[:, 2])
        below = checks.positive("base", half.min() if base is None else base) + top - own.min()
        made |= {"half": np.array([*half, below]), "heights": rows}
        number = self._shape(made)
        for place in range(1, PLACES):
            self._shape(made | {"place": place}, number)
        return number

    def add_shape(
        self, kind: str, body: int, sizes: Array, at: Array, quaternion: Array, rounding: float | None = None,
        points: Array | None = None,
    ) -> list[int]:  # fmt: skip
        """Fix a shape, given by an engine's name and sizes, to a body; returns the numbers of the shapes that it makes.

        sizes: radius, half length or half lengths [m]; of an "hfield" two half lengths and base. quaternion: of axes of
            which the third is the shape's own.
        points: of a mesh, whose hull it is, or the heights of an "hfield"; without them such kinds make no shape.
        """
        first, second, *_ = *sizes.tolist(), 0.0, 0.0
        if kind == "sphere":
            return [self.add_sphere(body, first, at)]
        axis = matrix_of(quaternion)[:, 2]
        if kind == "capsule":
            return list(self.add_capsule(body, first, second, at, axis))
        if kind == "plane":
            return [self.add_plane(body, at, axis)]
        if kind == "box":
            return [self.add_box(body, sizes, at, quaternion, rounding)]
        if kind == "cylinder":
            return [self.add_cylinder(body, first, second, at, axis, rounding)]
        if kind == "ellipsoid":
            return [self.add_ellipsoid(body, sizes, at, quaternion)]
        if kind == "hfield" and points is not None:
            return [self.add_height_field(body, points, sizes[:2], at, quaternion, sizes[2])]
        return [] if points is None else [self.add_hull(body, points, rounding, at, quaternion)]

    def _body(self, body: int) -> int:
        """Return the row of a body."""
        if checks.count("body", body, 0) >= len(self._frames):
            raise ValueError(f"body = {body}: there are {len(self._frames)} bodies, counted from 0")
        return body + 1

    def _placed(self, kind: int, body: int | None, at: ArrayLike, **own: Array) -> Fields:
        """Return the fields that place a shape on a body, or the world: None, converted to the principal axes."""
        row, turn = (0, UNIT) if body is None else (self._body(body), matrix_of(self._frames[body]).T)
        place = {"kind": kind, "body": row, "at": turn @ checks.vector("at", at)}
        return place | {name: (turn @ value).ravel() for name, value in own.items()}

    def _shape(self, fields: Fields, owner: int | None = None) -> int:
        number = len(self._kinds)
        self._new_shapes.append(fields)
        self._kinds.append(fields["kind"])
        self._owners.append(number if owner is None else owner)
        self._memberships.append(())
        self._regroup = True
        if fields["kind"] in CORES:
            self._solids[number] = fields, set()
        return number

    def _give_parts(self, ones: list[int], others: list[int]) -> None:
        """Add the parts by which the boxes, cylinders and hulls of one set meet the shapes of another."""
        met = {self._kinds[number] for number in others} if self._solids else set()
        for number in sorted(self._solids.keys() & set(ones)):
            fields, known = self._solids[number]
            had = len(parts_of(fields, known))
            known |= met
            for part in parts_of(fields, known)[had:]:
                self._shape(part, number)


def parts_of(core: Fields, others: set[int]) -> list[Fields]:
    """Return the round parts by which a box, cylinder or hull meets flat shapes.

    others: kinds of the shapes that it may meet. Edges are rounded with the core's radius r, and all parts lie within
    the core. On a plane a box needs its CORNERs alone, spheres inscribed in its corners. With other cores and height
    fields it needs its EDGEs too: these are crowned, and set back by a hundredth of r, so that corners carry where they
    can. A cylinder rests on its rims, DISCs that reach to its side, and on four small feet an end, which leave the
    ground once the rim is lower by some hundredths of r. A hull has the same parts as a box.
    """
    flat, cores = others & {PLANE, HEIGHT_FIELD, *CORES}, others & CORES
    if not flat:
        return []
    lined = cores | (others & {HEIGHT_FIELD})
    base, r, half, at = {"body": core["body"], "radius": core["radius"]}, core["radius"], core["half"], core["at"]
    if core["kind"] == HULL:
        corners = at + core["vertices"]
        edges = [(0.5 * (corners[i] + corners[j]), 0.5 * (corners[j] - corners[i])) for i, j in core["edges"]]
    elif core["kind"] == BOX:
        own, h, ends = core["axes"].reshape(3, 3), half - r, np.array(list(product((-1.0, 1.0), repeat=3)))
        middles = ((i, m) for i in range(3) for m in ends[ends[:, i] < 0.0] * (np.arange(3) != i))
        corners = [at + own @ (h * end) for end in ends]
        edges = [(at + own @ (h * m), own[:, i] * h[i]) for i, m in middles]
    else:
        x, y, axis = core["axes"].reshape(3, 3).T
        radius, up, round_ = half[0] - r * (1.0 - 2.0 * CROWN), (half[2] - r) * axis, base | {"normal": axis}
        out = []
        for one in (up, -up):
            out.append(round_ | {"kind": DISC, "at": at + one, "half": radius * x})
            feet = (way * side for side in (x, y) for way in (FEET * radius, -FEET * radius))
            out += [base | {"kind": CORNER, "at": at + one + foot} for foot in feet]
        if lined & {CYLINDER, HEIGHT_FIELD}:
            out.append(round_ | {"kind": SIDE, "at": at, "half": radius * x + up})
        return out
    out = [base | {"kind": CORNER, "at": corner} for corner in corners]
    return out + [base | {"kind": EDGE, "at": middle, "half": u} for middle, u in (edges if lined else ())]


def _sizes(name: str, value: ArrayLike) -> Array:
    """Return three lengths [m], checked to be > 0."""
    half = checks.vector(name, value)
    if not half.min() > 0.0:
        raise ValueError(f"{name} = {half.tolist()}: must be > 0")
    return half


def _rounded(half: Array, rounding: float | None) -> Fields:
    """Return fields of a box or cylinder of these half lengths [m] with rounded edges."""
    least = float(half.min())
    radius = ROUNDING * least if rounding is None else checks.positive("rounding", rounding)
    if radius > 0.5 * least:
        raise ValueError(f"rounding = {radius}: must be at most half of the smallest half length, {0.5 * least}")
    return {"half": half, "radius": radius}


def tangent(row: int, partner: int, reach: float) -> Fields:
    """Return the fields of a plane that is placed before each step; only shape `partner`, a sphere or an end, meets it.

    reach: greatest distance of its point from the body's centre of mass [m]. Until the plane is placed (`at`, `normal`)
    it is too far away for any contact.
    """
    return {"kind": kinds.TANGENT, "body": row, "partner": partner, "radius": reach,
            "normal": np.array([0.0, 0.0, 1.0]), "at": np.array([0.0, 0.0, -1e6])}  # fmt: skip
