"""A rolling ball keeps its speed; on an incline it rolls or slides with the closed-form acceleration."""

from functools import partial
from math import atan, cos, degrees, radians, sin

import numpy as np

from sims.worlds import World
from validation import ball
from validation.case import Array, Case, Data, Limit, Outcome, worst

ANGLES = [10, 15, 20, 25, 30, 40, 50, 60]  # [degrees]
KINDS = [("mujoco", dt, name) for dt in (2e-3, 1.0 / 240.0) for name in ball.INTEGRATORS]
KINDS += [("pybullet", 1.0 / 240.0, "")]
"""Engine, step [s], integrator."""
SPEED = 1.0  # [m/s]
LONG = 60.0  # [s]
WAIT, DOWNHILL = 0.2, 1.0  # [s]: the contact takes up its load, then the acceleration is measured
LOSS, ACCELERATION, SINKING = 1e-9, 1e-3, 1e-8
LIMIT = degrees(atan(3.5 * ball.FRICTION))


def made(engine: str, dt: float, integrator: str, angle: float) -> World:
    """World of the ball on a floor inclined by an angle [degrees], downhill along x."""
    gravity = ball.GRAVITY * np.array([sin(radians(angle)), 0.0, -cos(radians(angle))])
    return ball.ball_world(engine, dt, ball.steel_pair(), gravity, integrator=integrator or "Euler")


def resting(angle: float) -> float:
    """Overlap at rest on the incline [m]."""
    return ball.static_overlap() * cos(radians(angle)) ** (2.0 / 3.0)


class Rolling(Case):
    """A steel ball on a level and on a steep floor."""

    place = 44
    title = "Rolling and sliding"
    claim = (
        "At the engines' own steps a ball that rolls on the floor keeps its speed for a minute. On an incline it "
        f"rolls below {LIMIT:.0f} degrees (tan = 7/2 mu) and slides above, by the closed form, and its height over the "
        "incline does not change."
    )

    def run(self, quick: bool) -> Outcome:
        seconds = 6.0 if quick else LONG
        angles = ANGLES[::3] if quick else ANGLES
        level: list[Data] = []
        slopes: list[Data] = []
        for engine, dt, integrator in KINDS:
            label, own = {"engine": engine, "step": dt, "integrator": integrator}, partial(made, engine, dt, integrator)
            level.append(label | _level(own(0.0), seconds))
            slopes += [label | {"angle": angle} | _slope(own(angle), angle) for angle in angles]
        limits = [
            Limit(f"{what}, {engine}", asked, worst(runs, key, engine=engine))
            for engine in ("mujoco", "pybullet")
            for what, asked, key, runs in (
                (f"loss of speed rolling {seconds:g} s", LOSS, "loss", level),
                ("error of the acceleration", ACCELERATION, "error", slopes),
                ("change of height over the overlap", SINKING, "sinking", level + slopes),
            )
        ]
        return Outcome(limits, {"level": level, "slopes": slopes, "seconds": seconds})


def _watched(world: World, seconds: float, looks: int) -> tuple[Array, Array, float]:
    """Speeds of centre and rim [m/s] at the start and end, change of height [m], and the time, in whole looks."""
    count = round(seconds / world.timestep / looks)

    def speeds() -> Array:
        state = world.read()
        return np.array([state.velocity[0, 0], ball.RADIUS * state.spin[0, 1]])

    first, heights = speeds(), []
    for _ in range(looks):
        world.step(count)
        heights.append(world.place()[2])
    last = speeds()
    world.close()
    return last, (last - first) / (looks * count * world.timestep), float(np.ptp(heights))


def _level(world: World, seconds: float) -> Data:
    world.start(ball.at(-resting(0.0), [SPEED, 0.0, 0.0], [0.0, SPEED / ball.RADIUS, 0.0]))
    last, _, moved = _watched(world, seconds, 200)
    return {"loss": float(np.abs(1.0 - last / SPEED).max()), "sinking": moved / ball.static_overlap()}


def _slope(world: World, angle: float) -> Data:
    """Accelerations from rest, as differences of speeds over time after a while."""
    from sims.scenes.incline import acceleration

    world.start(ball.at(-resting(angle)))
    world.step(round(WAIT / world.timestep))
    _, found, moved = _watched(world, DOWNHILL, 20)
    error = float(np.abs(found / np.array(acceleration(radians(angle), ball.FRICTION)) - 1.0).max())
    return {"error": error, "sinking": moved / resting(angle)}
