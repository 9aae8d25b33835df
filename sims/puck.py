"""The puck of Maw, Barber & Fawcett (1981): a slice of a ball on an air table strikes a block of its own material.

The air table makes the motion planar and frictionless, so neither table nor gravity is simulated: three degrees of
freedom and one contact. With `table=True` both are simulated, to show that they make no difference, and what they cost.
"""

from dataclasses import dataclass, replace
from functools import cache, cached_property
from math import ceil, pi
from time import perf_counter
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from contactlaw import MATERIALS, ContactPair, Material, checks
from sims.options import of_ball
from sims.scene import ENGINES, NATIVE_DAMPED, NATIVES, Limit, Settings, check_law
from sims.worlds import World, new_world

BLOCK = (0.1, 4.0, 0.2)  # half lengths [m]; long, as fast rubber pucks travel far while they touch
OPTIONS = of_ball(0.0508, None, None)
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
        friction, restitution: None: as measured in the paper.
        radius: [m].
        told_mass: [kg]; None: that of a disc of the material.
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
    friction: float | None = None
    restitution: float | None = None
    radius: float = 0.0508  # 4 in diameter
    told_mass: float | None = None
    table: bool = False

    thickness = 0.0254  # 1 in [m]; the paper does not give it, and nothing but the contact time depends on it

    def __post_init__(self) -> None:
        checks.one_of("material", self.material, SURFACES)
        check_law(self.law)
        checks.one_of("launch", self.launch, LAUNCHES)
        for name in ("psi_1", "heading", "phase"):
            checks.finite_array(name, getattr(self, name))
        checks.positive("speed", self.speed)
        checks.number("psi_1", self.psi_1, "in [-1000, 1000]", low=-1e3, high=1e3)
        if self.timestep is not None:
            checks.positive("timestep", self.timestep)

    @cached_property
    def pair(self) -> ContactPair:
        """The contact; a scene without the law still has its friction and restitution."""
        surface = SURFACES[self.material]
        return ContactPair(
            surface.material,
            surface.material,
            surface.friction if self.friction is None else self.friction,
            surface.restitution if self.restitution is None else self.restitution,
            radius=self.radius,
            law="microslip" if self.law in NATIVES else self.law,
        )

    @property
    def mass(self) -> float:
        """[kg]."""
        return self.told_mass or (self.pair.a.density or 0.0) * pi * self.radius**2 * self.thickness

    @property
    def inertia(self) -> float:
        """About the axis across the plane [kg m^2]; K^2 = 1/2."""
        return 0.5 * self.mass * self.radius**2

    @property
    def chi(self) -> float:
        """chi of the puck against the clamped block."""
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

    def limits(self) -> list[Limit]:
        """Limits on the result; laws other than microslip are only checked for sanity."""
        out = [Limit("size of psi2", 1e3, abs(self.psi2))]
        if self.law not in ("mindlin", *NATIVES):
            out.append(Limit("energy after over before", 1.001, self.energy_ratio))
        if self.law == "microslip":
            out.append(Limit("error of psi2", 4e-3, abs(self.error)))
        return out

    def check(self) -> None:
        """Raise AssertionError where a limit is not kept."""
        for one in self.limits():
            assert one.passed, f"{one.name} = {one.reached:.3g} at steps of {self.timestep} s; allowed: {one.asked:g}"


def changes(o: Any) -> dict[str, Any]:
    """Fields of a puck that `OPTIONS` change, without those left to the material."""
    names = {name: "told_mass" if name == "mass" else name for name in OPTIONS}
    return {field: getattr(o, name) for name, field in names.items() if getattr(o, name) is not None}


def build(
    puck: Puck, settings: Settings, start: NDArray[np.float64] | None = None, block: tuple[float, ...] = BLOCK
) -> World:
    """Build the puck at its own start or another, and the block with its face through the origin."""
    velocity, spin = puck.start_motion
    gravity = (0.0, 0.0, -9.81 if puck.table else 0.0)
    world = new_world(replace(settings, law=puck.law, timestep=puck.step), gravity)
    moments = puck.inertia * np.array([0.6, 0.6, 1.0])
    world.ball("puck", puck.radius, puck.mass, puck.start if start is None else start, velocity, [0.0, 0.0, spin],
               inertia=moments, disc=0.5 * puck.thickness)  # fmt: skip
    turn = np.column_stack([puck.normal, puck.tangent, [0.0, 0.0, 1.0]])
    world.block("block", block, -block[0] * puck.normal, turn)
    world.contact("puck", "block", puck.pair, speed=puck.speed)
    if puck.table:
        world.plane("table", (0.0, 0.0, -puck.radius))
        world.contact("puck", "table", replace(puck.pair, friction=0.0))
    return world


def result_of(puck: Puck, engine: str, steps: int, after: tuple[NDArray[np.float64], float], time: float) -> Result:
    """Result of a throw from the velocity and spin after it, and its processor time [s]."""
    psi, energy = ([of(*motion) for motion in (puck.start_motion, after)] for of in (puck.psi, puck.energy))
    e = puck.pair.restitution
    return Result(
        engine=engine, law=puck.law, material=puck.material, mu=puck.pair.friction, chi=puck.chi, restitution=e,
        timestep=puck.step, contact_duration=puck.contact_duration, steps=steps, psi1=psi[0], psi2=psi[1],
        psi2_reference=reference(round(psi[0], 12), puck.chi, e), energy_ratio=energy[1] / energy[0], wall_time=time,
    )  # fmt: skip


def run(puck: Puck, engine: str) -> Result:
    """Throw the puck in an engine and measure it at the contact point."""
    checks.one_of("engine", engine, ENGINES)
    if puck.law == NATIVE_DAMPED and engine != "mujoco":
        raise ValueError(f"law = {puck.law!r}: is MuJoCo's")
    world = build(puck, Settings(engine))
    world.start()
    begin = perf_counter()
    world.step(puck.steps)
    time = perf_counter() - begin
    state = world.read()
    world.close()
    return result_of(puck, engine, puck.steps, (state.velocity[0], float(state.spin[0, 2])), time)


@cache
def reference(psi_1: float, chi: float, restitution: float) -> float:
    """psi_2 of the annulus solver, extrapolated; its own error is below 1e-4 at the chi of pucks."""
    from validation.reference.annulus import rebound_extrapolated

    return rebound_extrapolated(psi_1, chi, restitution)[0]


def as_json(result: Result) -> dict[str, Any]:
    """The result as plain values."""
    return {key: getattr(result, key) for key in result.__dataclass_fields__}
