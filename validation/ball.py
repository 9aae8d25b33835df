"""Steel balls over planes and in flight, which cases and tests share: worlds of them, throws, and what comes out."""

from collections.abc import Mapping
from math import ceil, log, nan, pi
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from contactlaw import MATERIALS, ContactPair
from contactlaw.laws import Law
from sims.contact_point import contact_velocity
from sims.contact_point import static_overlap as overlap_under
from sims.scene import Settings
from sims.worlds import State, Tuning, World, new_world
from validation.case import Array

RADIUS = 0.0254  # [m]
STEEL = MATERIALS["steel"]
DENSITY = float(STEEL.density or nan)
MASS = 4.0 / 3.0 * pi * RADIUS**3 * DENSITY  # [kg]
FRICTION, RESTITUTION = 0.115, 0.93  # steel, Maw, Barber & Fawcett (1981)
TANGENTIAL_MASS = MASS / 3.5  # [kg], a solid ball
GRAVITY = 9.81  # [m/s^2]
DOWN = np.array([0.0, 0.0, -GRAVITY])
FLOOR = ((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))  # a point and a normal
INTEGRATORS = ("Euler", "implicit", "implicitfast", "RK4")  # MuJoCo's
SUBSTEPS = Tuning().substeps
NO = (0.0, 0.0, 0.0)
SPEED = 1.0  # [m/s] of the impacts on the floor
INCIDENCES = [0.2, 0.6, 1.0, 1.4, 2.0, 2.7, 3.5, 4.2, 5.0, 6.0]


def steel_pair(law: str | Law = "microslip", restitution: float = RESTITUTION) -> ContactPair:
    """Steel on steel, with the radius of the ball."""
    return ContactPair(STEEL, STEEL, FRICTION, restitution, radius=RADIUS, law=law)


def balls_world(
    engine: str, dt: float, pair: ContactPair | None, places: ArrayLike, velocities: ArrayLike = NO,
    spins: ArrayLike = NO, *, radius: ArrayLike = RADIUS, density: float = DENSITY, planes: Any = (),
    gravity: ArrayLike = NO, **tuning: Any,
) -> World:  # fmt: skip
    """Solid balls that touch each other and planes by the law.

    engine: "mujoco", "pybullet" or "none"; dt [s]; pair: of every contact, None: nothing touches yet; places,
    velocities, spins: [m], [m/s], [rad/s], shape (n, 3) or (3,) for all; radius [m], one or of each; density [kg/m^3];
    planes: points [m] and unit normals; gravity [m/s^2]; tuning: as `sims.worlds.Tuning` has it.
    """
    world = new_world(Settings(engine, timestep=dt), gravity, Tuning(**tuning))
    walls = [f"plane{number}" for number in range(len(planes))]
    for name, (point, normal) in zip(walls, planes, strict=True):
        world.plane(name, point, normal)
    x = np.atleast_2d(np.asarray(places, dtype=float))
    names = [f"ball{number}" for number in range(len(x))]
    v, w = (np.broadcast_to(np.asarray(one, dtype=float), x.shape) for one in (velocities, spins))
    for name, *state, r in zip(names, x, v, w, np.broadcast_to(radius, len(x)), strict=True):
        world.ball(name, float(r), 4.0 / 3.0 * pi * float(r) ** 3 * density, *state)
    if pair is not None:
        world.contact(names, [*names, *walls] if len(names) > 1 else walls, pair)
    return world


def ball_world(engine: str, dt: float, pair: ContactPair | None, gravity: ArrayLike = NO, **tuning: Any) -> World:
    """The ball that touches the floor; a pair of None: it does not."""
    return balls_world(engine, dt, pair, [0.0, 0.0, RADIUS], planes=[FLOOR], gravity=gravity, **tuning)


def at(height: float, velocity: ArrayLike = NO, spin: ArrayLike = NO) -> tuple[ArrayLike, ArrayLike, ArrayLike]:
    """A state for `World.start`: at a height [m] over touching the floor."""
    return (0.0, 0.0, RADIUS + height), velocity, spin


def launch(speed: float, turned: float, *, spinning: bool) -> tuple[Array, Array, Array]:
    """Velocity, spin and direction of sliding of a ball that comes down at `SPEED` and whose contact point slides at a
    speed [m/s], turned from the x axis [rad], because it spins or because it moves obliquely."""
    along, down = np.array([np.cos(turned), np.sin(turned), 0.0]), np.array([0.0, 0.0, -SPEED])
    if spinning:
        return down, -speed / RADIUS * np.array([-along[1], along[0], 0.0]), along
    return down + speed * along, np.zeros(3), along


def after(state: State, along: Array) -> tuple[float, float, float]:
    """Velocity of the contact point along a direction, of the ball upwards [m/s], and its energy [J]."""
    velocity, spin = state.velocity[0], state.spin[0]
    return float(contact_velocity(velocity, spin, FLOOR[1], RADIUS) @ along), velocity[2], energy_of(velocity, spin)


def impacts(world: World, pair: ContactPair, psi_1: list[float], phases: Array, twirl: float = 0.0) -> Array:
    """Throw a ball of `ball_world` at the floor, obliquely and spinning in turn, in every direction.

    Incidences, shape (n,); phases: part of a step between start and touch, shape (m,); twirl: spin about the normal
    besides [rad/s]. Returns psi_2, restitution and energy over the first, shape (n, m, 3); NaN where the ball has not
    gone.
    """
    dt, out = world.timestep, np.empty((len(psi_1), phases.size, 3))
    count = ceil(2.0 * pair.contact_duration(MASS, SPEED) / dt) + 4
    for i, j in np.ndindex(out.shape[:2]):
        velocity, spin, along = launch(psi_1[i] * FRICTION / pair.kappa * SPEED, 2.4 * j, spinning=j % 2 == 1)
        spin[2] = twirl
        world.start(at(float(phases[j]) * dt * SPEED, velocity, spin))
        world.step(count)
        sliding, up, energy = after(state := world.read(), along)
        gone = state.position[0, 2] > RADIUS
        out[i, j] = (pair.psi(sliding, SPEED), up / SPEED, energy / energy_of(velocity, spin)) if gone else np.nan
    return out


def in_words(dt: float) -> str:
    """A step as it is written."""
    return f"1/{round(1.0 / dt)} s" if dt > 3e-3 else f"{1e3 * dt:g} ms"


def where(run: Mapping[str, Any]) -> str:
    """Engine, step and integrator of a run in words."""
    return f"{run['engine']}, {in_words(run['step'])} {run['integrator']}"


def linear_spring(duration: float, restitution: float) -> tuple[float, float]:
    """Stiffness and damping over mass [1/s^2], [1/s] of a linear contact of this duration [s] and restitution."""
    stiffness, rate = (pi / duration) ** 2, -log(restitution)
    return stiffness, 2.0 * stiffness**0.5 * rate / (rate**2 + pi**2) ** 0.5


def energy_of(velocity: Array, spin: Array) -> float:
    """Kinetic energy of the ball [J]."""
    return float(0.5 * MASS * velocity @ velocity + 0.2 * MASS * RADIUS**2 * spin @ spin)


def elastic_energy(overlap: float) -> float:
    """Elastic energy of the normal contact of the ball [J]."""
    return 8.0 / 15.0 * steel_pair().effective_modulus * RADIUS**0.5 * max(overlap, 0.0) ** 2.5


def static_overlap() -> float:
    """Of the ball that lies on the floor [m]."""
    return overlap_under(steel_pair(), MASS * GRAVITY, RADIUS)
