"""One contact of the PyBullet callback: what begins at a touch, and the forces of a step for all of them."""

from __future__ import annotations

import struct
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import inf, isfinite
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from contactlaw.jit import jit
from contactlaw.kernels.contact import MASS, NORMAL, PLANE_SLACK, TANGENTIAL_MASS, impact_speed, longest_step
from contactlaw.kernels.engine import contact_force
from contactlaw.pair import ContactPair, ContactWarning, rounded_down, warn_of_depth
from contactlaw.pybullet_callback.geometry import Motion, Side, check_one_end, check_smooth, mobility, velocity_at
from contactlaw.pybullet_callback.losses import CLAMP

Array = NDArray[np.float64]
Vector = tuple[float, float, float]

LOCKED = 1e300  # effective mass of what cannot slide [kg]

# A row of measurements, written with ROW and read by `advance`: number of the contact, normal and tangential effective
# mass, where the force acts between the points on A and B, gap, point on A, point on B, normal, then position, velocity
# and spin of A and of B.
ROW = struct.Struct("32d")
NUMBER, MASS_N, MASS_T, SHARE, GAP, POINT_A, POINT_B, DIRECTION = 0, 1, 2, 3, 4, 5, 8, 11
BODY_A, BODY_B = 14, 23
# A row of results: force on A [N], where it acts [m], tangential part of the force [N].
FORCE, PLACE, TANGENTIAL, RESULTS = 0, 3, 6, 9


class Point(NamedTuple):
    """The closest points of two bodies: on A, on B [m], unit vector from B to A, distance [m]."""

    on_a: Vector
    on_b: Vector
    normal: Vector
    gap: float


@dataclass(frozen=True)
class ContactState:
    """A contact after the last call.

    Attributes:
        touching: Whether the bodies overlapped.
        overlap: [m].
        normal_force: [N], >= 0.
        tangential_force: On A, world frame [N], shape (3,).
        history: A copy of what the law remembers, as `contactlaw.kernels.contact` lays it out.
    """

    touching: bool
    overlap: float
    normal_force: float
    tangential_force: Array
    history: Array


@dataclass(eq=False, slots=True)
class Contact:
    """Two bodies, the law between them, and where it stands.

    Attributes:
        a, b: The bodies.
        key_a, key_b: Body and link.
        pair: With a radius.
        by_shape: Whether the radius came from the shapes, which have it in places only.
        plane: Normal of the plane of motion, or None.
        parameters: For the kernels.
        history: What the law remembers; a view into an array of the callback.
        query: getClosestPoints of the two.
        number: Place among the contacts of the callback.
        touching: Whether they overlapped at the last call.
        tangential_force: On A [N].
        gap: At the last call [m]; inf: out of sight.
        dt: The step found short enough [s].
        masses: Normal and tangential effective mass at the touch [kg].
        share: Where the force acts, from the point on A (0) to the point on B (1). It is equal and opposite at one
            point, but the law has the lever arms of bodies that have not been pressed in, so the point is on the
            surface of the body that gives way: a ball on a fixed body keeps its radius, two alike meet half way.
        warned: Of an overlap too large for Hertz.
    """

    a: Side
    b: Side
    key_a: tuple[int, int]
    key_b: tuple[int, int]
    pair: ContactPair
    by_shape: bool
    plane: Array | None
    parameters: Array
    history: Array
    query: Callable[[], Sequence[tuple]]
    number: int = 0
    touching: bool = False
    tangential_force: Sequence[float] | Array = (0.0, 0.0, 0.0)
    gap: float = inf
    dt: float = 0.0
    masses: tuple[float, float] = (inf, inf)
    share: float = 0.5
    warned: bool = False

    def __str__(self) -> str:
        return f"{self.a} and {self.b}"

    @property
    def sides(self) -> tuple[Side, Side]:
        """Both bodies."""
        return self.a, self.b

    @property
    def radius(self) -> float:
        """Effective radius [m]."""
        assert self.pair.radius is not None
        return self.pair.radius

    def open(self) -> None:
        """The bodies have parted."""
        self.history[:] = 0.0
        self.touching, self.tangential_force = False, (0.0, 0.0, 0.0)

    def check_touch(self, client: int, point: Point, a: Motion, b: Motion, dt: float) -> None:
        """Measure the effective masses of a contact that has begun or will within this step.

        Raises:
            ValueError: The law cannot do it: step, shape or plane do not fit.
        """
        normal, middle = np.array(point.normal), 0.5 * np.add(point.on_a, point.on_b)
        if self.by_shape:
            check_smooth(self.a, point.on_a, point.normal, a)
            check_smooth(self.b, point.on_b, point.normal, b)
            self._check_ends(point, a, b)
        if self.plane is not None and abs(float(normal @ self.plane)) > PLANE_SLACK:
            raise ValueError(
                f"plane = {self.plane.tolist()}: the normal {normal.tolist()} of {self} does not lie in it"
            )
        w, share = mobility(client, self.a, self.b, middle)
        masses = self._effective_masses(w, normal)
        closing = closing_speed(point, a, b)
        # Overlap beyond what a step of the approach makes was there from the start and will push.
        overlap = -point.gap if -point.gap > 2.0 * closing * dt else 0.0
        speed = self._check_step(*masses, overlap, closing, dt)
        self.masses, self.share, self.dt = masses, share, dt
        if speed > 0.0 and not self.warned:
            self.warned = warn_of_depth(self.pair.greatest_overlap(masses[0], speed), self.radius)

    def check_on(self, point: Point, a: Motion, b: Motion, dt: float) -> None:
        """What can go wrong during a contact: a capsule that lies down, another time step."""
        if self.by_shape and (self.a.shape == "capsule" or self.b.shape == "capsule"):
            self._check_ends(point, a, b)
        if dt != self.dt:
            masses = float(self.history[MASS]), float(self.history[TANGENTIAL_MASS])
            self._check_step(*masses, -point.gap, closing_speed(point, a, b), dt)
            self.dt = dt

    def _check_ends(self, point: Point, a: Motion, b: Motion) -> None:
        check_one_end(self.a, self.b, point.gap, point.normal, a)
        check_one_end(self.b, self.a, point.gap, point.normal, b)

    def _effective_masses(self, w: Array, normal: Array) -> tuple[float, float]:
        """Normal and tangential effective mass [kg] of a mobility W [1/kg]; in space the mean of both tangents."""
        along, total = float(normal @ w @ normal), float(np.trace(w))
        if not along > 1e-12 * total:
            raise ValueError(f"{self}: neither can move along their normal {normal.tolist()}; one must")
        if self.plane is None:
            across = 0.5 * (total - along)
        else:
            tangent = np.cross(self.plane, normal)
            across = float(tangent @ w @ tangent)
        return 1.0 / along, 1.0 / across if across > 0.0 else LOCKED

    def _check_step(self, mass: float, tangential_mass: float, overlap: float, closing: float, dt: float) -> float:
        """Refuse a step too long for an impact with this overlap and closing speed; returns its speed [m/s]."""
        speed = impact_speed(self.parameters, mass, overlap, closing if overlap > 0.0 else max(closing, 0.0))
        longest = longest_step(self.parameters, mass, tangential_mass, 0.0, speed)
        if dt > longest * (1.0 + 1e-9):
            raise ValueError(
                f"fixedTimeStep = {dt:.4g} s: does not resolve the contact of {self}, which meet at {speed:.4g} m/s;"
                f" must be at most {rounded_down(longest):.3g} s (setTimeStep)"
            )
        return speed


def with_radius(pair: ContactPair, radius: float) -> ContactPair:
    """The pair with an effective radius [m]."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ContactWarning)  # of coupling: said when the user made the pair
        return replace(pair, radius=radius)


def closing_speed(point: Point, a: Motion, b: Motion) -> float:
    """Speed at which the bodies approach along the normal in the middle of the overlap [m/s]."""
    middle = 0.5 * np.add(point.on_a, point.on_b)
    return float(np.dot(point.normal, velocity_at(b, middle) - velocity_at(a, middle)))


@jit
def advance(count, rows, bounds, parameters, history, scratch, dt, out):
    """All contacts in touch by one step; the histories are only written if every force is finite.

    rows: measurements, shape (n, 32), count of them in use. bounds: where parameters and history of each contact start,
    shape (n + 1, 2). scratch: as history. out: results, shape (n, 9). Returns the first row whose force is not finite
    and the last of a body at the velocity clamp, -1 where there is none.
    """
    bad, clamped = -1, -1
    velocity = np.empty(3)
    for i in range(count):
        r, k = rows[i], int(rows[i, NUMBER])
        a, b, normal = r[BODY_A : BODY_A + 9], r[BODY_B : BODY_B + 9], r[DIRECTION : DIRECTION + 3]
        force, place = out[i, FORCE : FORCE + 3], out[i, PLACE : PLACE + 3]
        spin = 0.0
        for j in range(3):
            place[j] = r[POINT_A + j] + r[SHARE] * (r[POINT_B + j] - r[POINT_A + j])
            spin += 0.5 * normal[j] * (a[6 + j] + b[6 + j])
        for j in range(3):
            velocity[j] = velocity_component(a, place, j) - velocity_component(b, place, j)
        start, end = bounds[k], bounds[k + 1]
        new = scratch[start[1] : end[1]]
        contact_force(
            parameters[start[0] : end[0]], history[start[1] : end[1]], normal, velocity, spin, -r[GAP], dt,
            r[MASS_N], r[MASS_T], new, force,
        )  # fmt: skip
        for j in range(3):
            out[i, TANGENTIAL + j] = force[j] - new[NORMAL] * normal[j]
        if bad < 0 and not isfinite(force[0] + force[1] + force[2] + place[0] + place[1] + place[2]):
            bad = i
        for j in range(3, 9):
            if abs(a[j]) == CLAMP or abs(b[j]) == CLAMP:
                clamped = i
    if bad < 0:
        for i in range(count):
            k = int(rows[i, NUMBER])
            history[bounds[k, 1] : bounds[k + 1, 1]] = scratch[bounds[k, 1] : bounds[k + 1, 1]]
    return bad, clamped


@jit
def velocity_component(body, point, j):
    """Component j of the velocity of a body at a point; body: position, velocity and spin, shape (9,)."""
    k, m = (j + 1) % 3, (j + 2) % 3
    return body[3 + j] + body[6 + k] * (point[m] - body[m]) - body[6 + m] * (point[k] - body[k])
