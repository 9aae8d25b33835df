"""The puck of Maw, Barber & Fawcett (1981): a slice of a ball on an air table strikes a block of its own material.

The air table makes the motion planar and frictionless, so neither table nor gravity is simulated: three degrees of
freedom and one contact. With `table=True` both are, to show that they make no difference, and what they cost.
"""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from functools import cache, cached_property
from math import ceil, pi
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from contactlaw import MATERIALS, ContactPair, Material, checks
from sims.scene import BOUNDS, NATIVES, check_law

ENGINES = {"mujoco": "sims.puck_mujoco", "pybullet": "sims.puck_pybullet"}
LAUNCHES = ("oblique", "spin")
DEFAULT_STEPS = 200  # a contact


@dataclass(frozen=True)
class Surface:
    """What the paper measured for a puck and block of one material."""

    material: Material
    friction: float
    restitution: float


SURFACES = {
    "steel": Surface(MATERIALS["steel"], friction=0.115, restitution=0.93),
    "rubber": Surface(MATERIALS["rubber"], friction=2.4, restitution=0.86),
}


@dataclass(frozen=True)
class Puck:
    """One throw.

    Attributes:
        material: "steel" or "rubber".
        psi_1: (kappa/mu) V_x/V_z1 at the contact point before the impact.
        law: As `contactlaw.laws.law_of` has it, or one of `sims.scene.NATIVES` for the engine's own contact.
        launch: "oblique": aimed, without spin; "spin": thrown straight at the block, with backspin.
        timestep: Engine step [s]; None: a 200th of the contact.
        speed: Approach speed along the normal [m/s].
        heading: Direction of the block's normal in the plane [rad].
        phase: Part of a step left between the start and the touch.
        restitution: None: as measured in the paper.
        table: Whether gravity and a frictionless table are simulated too.
    """

    material: str = "steel"
    psi_1: float = 1.2
    law: str = "microslip"
    launch: Literal["oblique", "spin"] = "oblique"
    timestep: float | None = None
    speed: float = 1.0
    heading: float = 0.0
    phase: float = 0.5
    restitution: float | None = None
    table: bool = False

    radius = 0.0508  # 4 in diameter [m]
    thickness = 0.0254  # 1 in [m]; the paper does not give it, and nothing but the contact time depends on it

    def __post_init__(self) -> None:
        checks.one_of("material", self.material, SURFACES)
        check_law(self.law)
        checks.one_of("launch", self.launch, LAUNCHES)
        for name in ("psi_1", "heading", "phase"):
            checks.finite_array(name, getattr(self, name))
        checks.positive("speed", self.speed)
        low, high = BOUNDS["psi1"]
        checks.number("psi_1", self.psi_1, f"in [{low:g}, {high:g}]", low=low, high=high)
        if self.timestep is not None:
            checks.positive("timestep", self.timestep)

    @cached_property
    def pair(self) -> ContactPair:
        """The contact; a scene without the law still has its friction and restitution."""
        surface = SURFACES[self.material]
        return ContactPair(
            surface.material,
            surface.material,
            surface.friction,
            surface.restitution if self.restitution is None else self.restitution,
            radius=self.radius,
            law="microslip" if self.law in NATIVES else self.law,
        )

    @property
    def mass(self) -> float:
        """Of the puck [kg]."""
        return (self.pair.a.density or 0.0) * pi * self.radius**2 * self.thickness

    @property
    def inertia(self) -> float:
        """About the axis across the plane [kg m^2]; K^2 = 1/2."""
        return 0.5 * self.mass * self.radius**2

    @property
    def chi(self) -> float:
        """Of the puck against the clamped block."""
        return self.pair.chi(self.mass, self.mass / 3.0)

    @cached_property
    def contact_duration(self) -> float:
        """Of the impact [s]."""
        return self.pair.contact_duration(self.mass, self.speed)

    @property
    def step(self) -> float:
        """Engine step [s]."""
        return self.contact_duration / DEFAULT_STEPS if self.timestep is None else self.timestep

    @property
    def steps(self) -> int:
        """Steps from the start until the bodies are surely apart."""
        return ceil(1.3 * self.contact_duration / self.step) + 4

    @property
    def normal(self) -> NDArray[np.float64]:
        """From the block to the puck."""
        return np.array([np.cos(self.heading), np.sin(self.heading), 0.0])

    @property
    def tangent(self) -> NDArray[np.float64]:
        """Along the face of the block."""
        return np.array([-np.sin(self.heading), np.cos(self.heading), 0.0])

    @property
    def start(self) -> NDArray[np.float64]:
        """Centre of the puck at the start [m]; the face of the block goes through the origin."""
        return (self.radius + self.phase * self.step * self.speed) * self.normal

    @property
    def start_motion(self) -> tuple[NDArray[np.float64], float]:
        """Velocity of the centre [m/s] and spin about the upward axis [rad/s] at the start."""
        sliding = self.psi_1 * self.pair.friction / self.pair.kappa * self.speed
        if self.launch == "spin":
            return -self.speed * self.normal, -sliding / self.radius
        return -self.speed * self.normal + sliding * self.tangent, 0.0

    def psi(self, velocity: NDArray[np.float64], spin: float) -> float:
        """psi of the contact point for a motion of the puck."""
        return self.pair.psi(float(velocity @ self.tangent) - spin * self.radius, self.speed)

    def energy(self, velocity: NDArray[np.float64], spin: float) -> float:
        """Kinetic energy of a motion in the plane [J]."""
        planar = velocity - velocity[2] * np.array([0.0, 0.0, 1.0])
        return 0.5 * self.mass * float(planar @ planar) + 0.5 * self.inertia * spin**2


@dataclass(frozen=True)
class Outcome:
    """What an engine made of a throw."""

    velocity: NDArray[np.float64]
    spin: float
    wall_time: float


class Simulate(Protocol):
    """`simulate` of `sims.puck_mujoco` and `sims.puck_pybullet`."""

    def __call__(self, puck: Puck) -> Outcome:
        """Throw the puck."""
        ...


@dataclass(frozen=True)
class Result:
    """A throw measured; the fields of `python -m sims puck --json`. Times in s."""

    engine: str
    law: str
    material: str
    mu: float
    chi: float
    restitution: float
    timestep: float
    contact_duration: float
    steps: int
    psi1: float
    psi2: float
    psi2_reference: float
    energy_ratio: float
    wall_time: float

    @property
    def error(self) -> float:
        """psi2 less the reference."""
        return self.psi2 - self.psi2_reference

    def check(self) -> None:
        """What must hold of this scene; the rungs below microslip are only asked to be sane.

        Raises:
            AssertionError: It does not hold.
        """
        assert np.isfinite(self.psi2), f"psi2 = {self.psi2}"
        if self.law not in ("mindlin", *NATIVES):
            assert self.energy_ratio <= 1.001, f"energy ratio {self.energy_ratio}"
        if self.law == "microslip":
            assert abs(self.error) <= 4e-3, f"psi2 off by {self.error} at {self.timestep} s"


def run(puck: Puck, engine: str) -> Result:
    """Throw the puck in an engine and measure it at the contact point."""
    checks.one_of("engine", engine, ENGINES)
    simulate: Simulate = importlib.import_module(ENGINES[engine]).simulate
    velocity, spin = puck.start_motion
    outcome = simulate(puck)
    psi_1 = puck.psi(velocity, spin)
    return Result(
        engine=engine,
        law=puck.law,
        material=puck.material,
        mu=puck.pair.friction,
        chi=puck.chi,
        restitution=puck.pair.restitution,
        timestep=puck.step,
        contact_duration=puck.contact_duration,
        steps=puck.steps,
        psi1=psi_1,
        psi2=puck.psi(outcome.velocity, outcome.spin),
        psi2_reference=reference(round(psi_1, 12), puck.chi, puck.pair.restitution),
        energy_ratio=puck.energy(outcome.velocity, outcome.spin) / puck.energy(velocity, spin),
        wall_time=outcome.wall_time,
    )


@cache
def reference(psi_1: float, chi: float, restitution: float) -> float:
    """psi_2 of the annulus solver, extrapolated; its own error is below 1e-4 at the chi of pucks."""
    from validation.reference.annulus import rebound_extrapolated

    return rebound_extrapolated(psi_1, chi, restitution)[0]


def as_json(result: Result) -> dict[str, Any]:
    """The result as plain values."""
    return {key: getattr(result, key) for key in result.__dataclass_fields__}
