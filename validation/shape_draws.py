"""Random drops of random shapes: what is drawn, and the bodies that it makes."""

from dataclasses import dataclass
from functools import cached_property
from math import pi
from typing import Any

import numpy as np

from contactlaw import MATERIALS, ContactPair, Material
from contactlaw.world.data.frames import matrix_of
from validation.case import Array

KINDS = ("sphere", "capsule", "box", "cylinder", "ellipsoid", "hull")
MADE_OF = tuple(MATERIALS[name] for name in ("steel", "rubber", "wood"))
SIZES = 0.005, 0.05  # [m], half lengths and radii
STEPS = (5e-4, 1e-3, 2e-3, 5e-3, 1e-2)  # [s]
INTEGRATORS = ("Euler", "RK4", "implicit", "implicitfast")
FEET = 0.3  # of the smallest half length, radius of ball feet
ROLLING = 0.05  # coefficient of rolling resistance, without which what is round rolls on
WALL = 0.25  # [m], of the pit
GRAVITY = 9.81


@dataclass(frozen=True, eq=False)
class Thing:
    """A body of one shape, its principal axes along its own.

    Attributes:
        kind: One of `KINDS`, or "feet": a box that touches by balls in its corners.
        size: Half lengths or half axes (3,); radius and half length; radius [m].
        material, mass, moments: Steel, rubber or wood; [kg], and about its axes [kg m^2], shape (3,).
        place, turn, velocity, spin: At the start; spin in the world [m], [m/s], [rad/s].
        points: Of a hull, from the centre of mass [m], shape (n, 3).
    """

    kind: str
    size: Array
    material: Material
    mass: float
    moments: Array
    place: Array
    turn: Array
    velocity: Array
    spin: Array
    points: Array

    def reach(self, direction: Array) -> float:
        """How far it reaches from its centre along a unit vector in its own axes, edges being rounded [m]."""
        s, along = self.size, abs(float(direction[2]))
        across = float(np.hypot(direction[0], direction[1]))
        if self.kind == "sphere":
            return float(s[0])
        if self.kind == "capsule":
            return float(s[0] + s[1] * along)
        if self.kind == "ellipsoid":
            return float(np.linalg.norm(s * direction))
        r = self.least
        if self.kind == "cylinder":
            return float((s[0] - r) * across + (s[1] - r) * along) + r
        return float((self.core[0] @ direction).max() if self.kind == "hull" else np.abs(direction) @ (s - r)) + r

    def energy(self, place: Array, rotation: Array, velocity: Array, spin: Array) -> tuple[float, float]:
        """Of the motion of its centre, and of its spin and its height [J]."""
        own = rotation.T @ spin
        turning = 0.5 * self.moments @ own**2 + self.mass * GRAVITY * place[2]
        return float(0.5 * self.mass * velocity @ velocity), float(turning)

    @cached_property
    def core(self) -> tuple[Array, float]:
        """Of a hull: vertices of its core [m], shape (n, 3), and the radius that sweeps it."""
        from contactlaw.world.shapes.hulls import core_of

        vertices, _, radius = core_of(self.points)
        return vertices, radius

    @property
    def least(self) -> float:
        """Smallest radius [m] that it touches with, about: of what is flat that of its edges."""
        s = float(self.size.min())
        if self.kind == "ellipsoid":
            return s * s / float(self.size.max())
        if self.kind == "hull":
            return self.core[1]
        if self.kind in ("sphere", "capsule"):
            return float(self.size[0])
        return (FEET if self.kind == "feet" else 0.1) * s


@dataclass(frozen=True, eq=False)
class Drop:
    """Things that fall into a pit, on a plane (flat) or a box, drawn from a seed: engine's step [s], MuJoCo's
    integrator, friction and restitution of all contacts."""

    seed: int
    things: tuple[Thing, ...]
    flat: bool
    step: float
    integrator: str
    friction: float
    restitution: float

    def pair(self, one: Material, two: Material) -> ContactPair:
        """The contact of two materials."""
        return ContactPair(one, two, self.friction, self.restitution, rolling_resistance=ROLLING)

    @property
    def energy(self) -> float:
        """At the start, over lying on the floor [J]."""
        return sum(sum(t.energy(t.place, matrix_of(t.turn), t.velocity, t.spin)) for t in self.things)

    def deepest(self) -> float:
        """Overlap [m] in which all the energy is held by the softest contact: P = k delta^1.5."""
        others = MATERIALS["steel"], *(thing.material for thing in self.things)
        softest = min(self.pair(one.material, two).effective_modulus for one in self.things for two in others)
        k = 4.0 / 3.0 * softest * np.sqrt(min(thing.least for thing in self.things) / 2.0)
        return float((2.5 * self.energy / k) ** 0.4)

    def __str__(self) -> str:
        what = ", ".join(f"{t.kind} {t.material.name} {1e3 * t.size.min():.2g}-{1e3 * t.size.max():.2g} mm"
                         for t in self.things)  # fmt: skip
        return (f"{self.seed}: {what} on a {'plane' if self.flat else 'box'}, step {1e3 * self.step:g} ms "
                f"{self.integrator}, mu {self.friction:.2f}, e {self.restitution:.2f}")  # fmt: skip


def solid(points: Array, density: float) -> tuple[Array, float, Array]:
    """Points from the centre of mass along principal axes [m], mass [kg], moments [kg m^2] of their hull."""
    from contactlaw.world.shapes.hulls import convex_hull

    vertices, faces = convex_hull(points, fine=1e-6, most=1000)
    volume, centre, second = 0.0, np.zeros(3), np.zeros((3, 3))
    for corners in vertices[faces]:
        part, total = np.linalg.det(corners) / 6.0, corners.sum(0)
        volume += part
        centre += part * total / 4.0
        second += part / 20.0 * (np.outer(total, total) + corners.T @ corners)
    centre /= volume
    second -= volume * np.outer(centre, centre)
    moments, axes = np.linalg.eigh(density * (np.trace(second) * np.eye(3) - second))
    axes[:, 2] *= np.sign(np.linalg.det(axes))
    return (vertices - centre) @ axes, density * volume, moments


def body_of(kind: str, size: Array, density: float, points: Array) -> tuple[float, Array, Array]:
    """Mass [kg], moments [kg m^2] and points [m] of a homogeneous solid."""
    if kind == "hull":
        own, mass, moments = solid(points, density)
        return mass, moments, own
    if kind in ("box", "ellipsoid", "feet"):
        volume, share = (4.0 / 3.0 * pi, 0.2) if kind == "ellipsoid" else (8.0, 1.0 / 3.0)
        mass = density * volume * float(np.prod(size))
        return mass, share * mass * (size @ size - size * size), points
    r = float(size[0])
    if kind == "sphere":
        mass = density * 4.0 / 3.0 * pi * r**3
        return mass, np.full(3, 0.4 * mass * r * r), points
    h = float(size[1])
    rod = density * 2.0 * pi * r * r * h
    across, along = rod * (r * r / 4.0 + h * h / 3.0), 0.5 * rod * r * r
    if kind == "cylinder":
        return rod, np.array([across, across, along]), points
    caps = density * 4.0 / 3.0 * pi * r**3
    across += caps * (0.4 * r * r + h * h + 0.75 * h * r)
    return rod + caps, np.array([across, across, along + 0.4 * caps * r * r]), points


def draw_thing(rng: Any, kinds: tuple[str, ...], sizes: tuple[float, float], place: Any) -> Thing:
    """A thing of random kind, material and sizes [m], thrown from a place."""
    kind = str(rng.choice(kinds))
    count = {"sphere": 1, "capsule": 2, "cylinder": 2}.get(kind, 3)
    size = np.exp(rng.uniform(*np.log(sizes), count))
    material = MADE_OF[rng.integers(3)]
    points = np.zeros((0, 3))
    if kind == "hull":
        way = rng.normal(size=(int(rng.integers(5, 25)), 3))
        points = way / np.linalg.norm(way, axis=1)[:, None] * size
    mass, moments, points = body_of(kind, size, float(material.density or 0.0), points)
    upright = rng.random() < 0.3  # lands flat, or nearly
    turn = np.array([1.0, *(0.02 * rng.normal(size=3) * (rng.random() < 0.5))]) if upright else rng.normal(size=4)
    velocity = np.array([*(0.3 * rng.normal(size=2)), 0.3 * rng.normal()])
    spin = float(rng.choice((0, 5, 30))) * rng.normal(size=3)
    turn = turn / np.linalg.norm(turn)
    return Thing(kind, size, material, mass, moments, np.array(place, float), turn, velocity, spin, points)


def draw(seed: int, kinds: tuple[str, ...] = KINDS) -> Drop:
    """A drop; what is drawn follows from the seed alone."""
    rng = np.random.default_rng((2601, seed))
    count = 1 if rng.random() < 0.6 else 2
    places = [(*(0.05 * rng.normal(size=2)).clip(-0.1, 0.1), 0.12 + 0.2 * k) for k in range(count)]
    things = tuple(draw_thing(rng, kinds, SIZES, place) for place in places)
    return Drop(seed, things, bool(rng.random() < 0.6), float(rng.choice(STEPS)), str(rng.choice(INTEGRATORS)),
                float(rng.uniform(0.0, 0.8)), float(rng.uniform(0.3, 0.9)))  # fmt: skip


def draw_heap(seed: int) -> Drop:
    """Six to twelve things of sizes 1 to 10 that fall onto each other, boxes on ball feet among them."""
    rng = np.random.default_rng((1401, seed))
    count = int(rng.integers(6, 13))
    things = tuple(draw_thing(rng, (*KINDS, "feet"), (0.004, 0.04), (*rng.uniform(-0.04, 0.04, 2), 0.08 + 0.09 * k))
                   for k in range(count))  # fmt: skip
    return Drop(seed, things, bool(rng.random() < 0.6), float(rng.choice(STEPS[:4])), "Euler",
                float(rng.uniform(0.1, 0.8)), float(rng.uniform(0.3, 0.9)))  # fmt: skip


WALLS = [(np.array([0.0, 0.0, 0.0]) - WALL * inward, inward) for inward in
         (np.array([s * (axis == 0), s * (axis == 1), 0.0]) for axis in (0, 1) for s in (1.0, -1.0))]  # fmt: skip
