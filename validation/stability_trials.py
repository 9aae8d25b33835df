"""What is thrown at a law to see whether it holds: balls on planes, and the energy that they have."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import pi, sqrt
from typing import Any

import numpy as np

from contactlaw import ContactPair, Material
from contactlaw.laws import Law
from contactlaw.laws.hertz import LINEAR_STIFFNESS
from validation.case import Array

RADIUS, DENSITY = 0.01, 7800.0  # [m], [kg/m^3]
MASS = 4.0 / 3.0 * pi * RADIUS**3 * DENSITY  # [kg]
SOLID = 0.4  # I/(M R^2) of a solid ball
LIVELY = 3.0  # what a light ball between two heavy ones may gain in speed
FLOOR = ((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))  # a point [m] and the normal


@dataclass(frozen=True, eq=False)
class Trial:
    """Balls of one radius and one material on planes.

    Attributes:
        made: Of every contact: modulus [Pa], poisson, friction, restitution.
        step, duration, contact: Engine step, length of the run, and how long a contact lasts, about [s].
        places, velocities, spins: At the start and all at one time, world frame, shape (n, 3).
        masses, gyration: [kg], shape (n,), and I/(M R^2) of every ball.
        gravity, datum: [m/s^2], shape (3,), and places that potential energy is counted from, shape (n, 3).
        planes: Points [m] and unit normals.
        rests, seed: Whether the balls are to come to rest; that it was drawn from.
    """

    made: Mapping[str, float]
    step: float
    duration: float
    contact: float
    places: Array
    velocities: Array
    spins: Array
    masses: Array = field(default_factory=lambda: np.array([MASS]))
    gyration: float = SOLID
    gravity: Array = field(default_factory=lambda: np.zeros(3))
    datum: Array = field(default_factory=lambda: np.array([[0.0, 0.0, RADIUS]]))
    planes: tuple[Any, ...] = (FLOOR,)
    rests: bool = False
    seed: tuple[int, ...] = ()

    def pair(self, law: str | Law = "microslip") -> ContactPair:
        """The contact of any two."""
        return pair_of(self.made, law)

    @property
    def inertias(self) -> Array:
        """[kg m^2], shape (n,)."""
        return self.gyration * self.masses * RADIUS**2

    def gaps(self, places: Array) -> Array:
        """Between the surfaces of every couple [m], less than zero where they overlap: planes first."""
        out = [(places - point) @ np.array(normal) - RADIUS for point, normal in self.planes]
        first, second = np.triu_indices(len(self.masses), 1)
        return np.concatenate([*out, np.linalg.norm(places[first] - places[second], axis=1) - 2.0 * RADIUS])

    def kinetic(self, velocities: Array, spins: Array) -> float:
        """[J]."""
        return float(0.5 * self.masses @ (velocities**2).sum(axis=1) + 0.5 * self.inertias @ (spins**2).sum(axis=1))

    def potential(self, places: Array) -> float:
        """Of gravity [J]."""
        return -float(self.masses @ ((places - self.datum) @ self.gravity))

    def first_energy(self, law: str = "microslip") -> float:
        """At the start [J], with what contacts by a law hold that overlap then."""
        k = 4.0 / 3.0 * self.pair().effective_modulus * sqrt(RADIUS)
        part = 0.5 * LINEAR_STIFFNESS if law == "linear_spring" else 0.4
        held = part * k * float((np.maximum(-self.gaps(self.places), 0.0) ** 2.5).sum())
        return self.kinetic(self.velocities, self.spins) + self.potential(self.places) + held

    @property
    def acceleration(self) -> float:
        """What an impact within one step may take [m/s^2] or [rad/s^2], about."""
        speed = max(np.abs(self.velocities).max(), RADIUS * np.abs(self.spins).max())
        ratio = self.masses.max() / self.masses.min()
        return float(2.0 * min(ratio, LIVELY) * speed / (RADIUS * self.gyration * max(self.step, 0.1 * self.contact)))

    def __str__(self) -> str:
        made = ", ".join(f"{name} {value:.4g}" for name, value in self.made.items())
        ratio = f", mass ratio {self.masses.max() / self.masses.min():.3g}" if len(self.masses) > 1 else ""
        seed = ".".join(map(str, self.seed))
        return f"{made}{ratio}, step {self.step:.3g} s, {self.contact / self.step:.3g} steps a contact, seed {seed}"


def pair_of(made: Mapping[str, float], law: str | Law = "microslip") -> ContactPair:
    """The contact of two things made so."""
    material = Material(made["modulus"], made["poisson"], DENSITY)
    return ContactPair(material, material, made["friction"], made["restitution"], radius=RADIUS, law=law)
