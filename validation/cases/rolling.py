"""A rolling ball keeps its speed; on an incline it rolls or slides with the closed-form acceleration."""

# pyright: reportAttributeAccessIssue=false
# (pyright cannot see into the mujoco module)

from __future__ import annotations

from math import atan, cos, degrees, radians, sin, tan
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from validation.ball import (
    FRICTION,
    GRAVITY,
    INTEGRATORS,
    RADIUS,
    BulletBall,
    half_step,
    mujoco_ball,
    static_overlap,
    true_velocity,
)
from validation.case import Case, Data, Limit, Outcome, Progress, Table, register
from validation.picture import STYLES, limit_line, panels

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

ANGLES = [10, 15, 20, 25, 30, 40, 50, 60]  # [degrees]
STEPS = {"mujoco": [2e-3, 1.0 / 240.0], "pybullet": [1.0 / 240.0]}  # [s]
SPEED = 1.0  # [m/s]
LONG = 60.0  # [s]
WAIT, DOWNHILL = 0.2, 1.0  # [s]: the contact takes up its load, then the acceleration is measured
LOSS, ACCELERATION, SINKING = 1e-9, 1e-3, 1e-8
LIMIT = degrees(atan(3.5 * FRICTION))


class InMujoco:
    """The ball in MuJoCo, at rest on the floor; gravity leans by an angle [degrees]."""

    def __init__(self, dt: float, angle: float, integrator: str) -> None:
        import mujoco

        self._engine = mujoco
        self._gravity = leaning(angle)
        self._model, self._data, _ = mujoco_ball(dt, "law alone", gravity=self._gravity, integrator=integrator)
        self._data.qpos[2] = RADIUS - resting(angle)

    def roll(self, speed: float) -> None:
        """Give it this speed."""
        self._data.qvel[:] = [speed, 0, 0, 0, speed / RADIUS, 0]
        self._data.qvel[:3] -= half_step(self._model)

    def step(self, count: int) -> None:
        """Go on."""
        self._engine.mj_step(self._model, self._data, count)

    def see(self) -> tuple[float, float, float]:
        """True speed of the centre and of the rim [m/s], height [m]."""
        velocity = true_velocity(self._model, self._data)
        spin = self._data.xmat[1].reshape(3, 3) @ velocity[3:]  # of a ball that turns about y alone: the same
        return float(velocity[0]), float(RADIUS * spin[1]), float(self._data.qpos[2] - RADIUS)

    def close(self) -> None:
        """Nothing to do."""


class InPybullet:
    """The ball in PyBullet; likewise."""

    def __init__(self, dt: float, angle: float, _: str) -> None:
        self._behind = 0.5 * dt * leaning(angle)
        self._ball = BulletBall(dt, "law", gravity=leaning(angle))
        self._ball.start(-resting(angle), -self._behind)

    def roll(self, speed: float) -> None:
        """Give it this speed."""
        self._ball.start(-resting(0.0), np.array([speed, 0, 0]) - self._behind, [0, speed / RADIUS, 0])

    def step(self, count: int) -> None:
        """Go on."""
        self._ball.step(count)

    def see(self) -> tuple[float, float, float]:
        """True speed of the centre and of the rim [m/s], height [m]."""
        velocity, spin = self._ball.true_motion
        return float(velocity[0]), float(RADIUS * spin[1]), self._ball.height

    def close(self) -> None:
        """Leave the client."""
        self._ball.close()


def leaning(angle: float) -> Array:
    """Gravity [m/s^2] seen from an incline that falls along x."""
    return GRAVITY * np.array([sin(radians(angle)), 0.0, -cos(radians(angle))])


def resting(angle: float) -> float:
    """Overlap at rest on the incline [m]."""
    return static_overlap() * cos(radians(angle)) ** (2.0 / 3.0)


def closed_form(angle: float) -> tuple[float, float]:
    """Acceleration of the centre and of the rim [m/s^2], from rest."""
    slope = radians(angle)
    if tan(slope) <= 3.5 * FRICTION:
        return 5.0 / 7.0 * GRAVITY * sin(slope), 5.0 / 7.0 * GRAVITY * sin(slope)
    return GRAVITY * (sin(slope) - FRICTION * cos(slope)), 2.5 * FRICTION * GRAVITY * cos(slope)


@register
class Rolling(Case):
    """A steel ball on a level and on a steep floor."""

    name = "rolling"
    place = 44
    title = "Rolling and sliding"
    claim = (
        "At the engines' own steps a ball that rolls on the floor keeps its speed for a minute, and on an incline it "
        f"rolls below {LIMIT:.0f} degrees (tan = 7/2 mu) and slides above, as the closed form has it, while its height "
        "does not move."
    )
    caption = (
        "Left: acceleration of the centre (filled) and of the rim (open) on an incline, MuJoCo at 2 ms; lines: closed "
        "form. Right: relative error of both, all engines and steps; none is drawn below 1e-16."
    )
    needs = ("mujoco", "pybullet")

    def run(self, quick: bool, progress: Progress) -> Outcome:
        """Level, then inclines."""
        kinds = [("mujoco", dt, name) for dt in STEPS["mujoco"] for name in INTEGRATORS]
        kinds += [("pybullet", dt, "") for dt in STEPS["pybullet"]]
        seconds = 6.0 if quick else LONG
        angles = ANGLES[::3] if quick else ANGLES
        level: list[Data] = []
        slopes: list[Data] = []
        problems: list[str] = []
        for number, (engine, dt, integrator) in enumerate(kinds):
            make: Any = InMujoco if engine == "mujoco" else InPybullet
            label = {"engine": engine, "step": dt, "integrator": integrator}
            level.append(label | _level(make(dt, 0.0, integrator), dt, seconds))
            slopes += [label | {"angle": angle} | _slope(make(dt, angle, integrator), dt, angle) for angle in angles]
            progress((number + 1) / len(kinds))
        limits = []
        for engine in STEPS:
            flat = [one for one in level if one["engine"] == engine]
            steep = [one for one in slopes if one["engine"] == engine]
            limits += [
                Limit(f"loss of speed rolling {seconds:g} s, {engine}", LOSS, max(abs(one["loss"]) for one in flat)),
                Limit(f"error of the acceleration, {engine}", ACCELERATION, max(one["error"] for one in steep)),
                Limit(f"change of height over the overlap, {engine}", SINKING,
                      max(one["sinking"] for one in flat + steep)),
            ]  # fmt: skip
        return Outcome(limits, {"level": level, "slopes": slopes, "seconds": seconds}, problems)

    def table(self, data: Data) -> Table:
        """Level rows, and the worst incline of each."""
        table = Table(["engine, step", "loss of speed", "slip left [m/s]", "largest error on inclines", "at [degrees]",
                       "change of height / overlap"])  # fmt: skip
        for flat in data["level"]:
            same = [one for one in data["slopes"] if all(one[k] == flat[k] for k in ("engine", "step", "integrator"))]
            worst = max(same, key=lambda one: one["error"])
            table.rows.append(
                [f"{flat['engine']}, {1e3 * flat['step']:.3g} ms {flat['integrator']}", f"{flat['loss']:.1e}",
                 f"{flat['slip']:.1e}", f"{worst['error']:.1e}", f"{worst['angle']}",
                 f"{max(one['sinking'] for one in [flat, *same]):.1e}"]
            )  # fmt: skip
        return table

    def draw(self, data: Data) -> Figure:
        """Accelerations and their errors."""
        figure, (left, right) = panels(2)
        fine = np.linspace(0.0, 65.0, 200)
        lines = np.array([closed_form(angle) for angle in fine])
        left.plot(fine, lines[:, 0], color="black", linewidth=0.9)
        left.plot(fine, lines[:, 1], color="black", linewidth=0.9, linestyle="--")
        first = [one for one in data["slopes"] if one["step"] == 2e-3 and one["integrator"] == "Euler"]
        left.plot([one["angle"] for one in first], [one["centre"] for one in first], "o", color="black", label="centre")
        left.plot([one["angle"] for one in first], [one["rim"] for one in first], "s", color="black", fillstyle="none",
                  label="rim")  # fmt: skip
        left.set(xlabel="incline [degrees]", ylabel="acceleration [m/s$^2$]")
        left.legend()
        kinds = [("mujoco", 2e-3, "Euler"), ("mujoco", STEPS["mujoco"][1], "Euler"), ("mujoco", 2e-3, "RK4"),
                 ("pybullet", STEPS["pybullet"][0], "")]  # fmt: skip
        for style, (engine, dt, name) in zip(STYLES, kinds, strict=False):
            own = [one for one in data["slopes"]
                   if (one["engine"], one["integrator"]) == (engine, name)
                   and abs(one["step"] - dt) < 1e-6]  # fmt: skip
            right.semilogy([one["angle"] for one in own], [max(one["error"], 1e-16) for one in own], **style,
                           label=f"{engine}, {1e3 * dt:.3g} ms {name}")  # fmt: skip
        limit_line(right, ACCELERATION, "asked")
        right.set(xlabel="incline [degrees]", ylabel="relative error [-]")
        right.legend(fontsize=8)
        return figure


def _level(ball: Any, dt: float, seconds: float) -> Data:
    try:
        ball.roll(SPEED)
        heights, count = [], round(seconds / dt / 200.0)
        for _ in range(200):
            ball.step(count)
            heights.append(ball.see()[2])
        centre, rim, _ = ball.see()
    finally:
        ball.close()
    return {"loss": 1.0 - centre / SPEED, "slip": abs(centre - rim),
            "sinking": float(np.ptp(heights)) / static_overlap()}  # fmt: skip


def _slope(ball: Any, dt: float, angle: float) -> Data:
    """From rest: after a while the differences of speeds over time."""
    try:
        ball.step(round(WAIT / dt))
        first = ball.see()
        heights, count = [], round(DOWNHILL / dt / 20.0)
        for _ in range(20):
            ball.step(count)
            heights.append(ball.see()[2])
        last = ball.see()
    finally:
        ball.close()
    centre, rim = ((last[i] - first[i]) / (20 * count * dt) for i in range(2))
    error = max(abs(one / asked - 1.0) for one, asked in zip((centre, rim), closed_form(angle), strict=True))
    return {"centre": centre, "rim": rim, "error": error, "sinking": float(np.ptp(heights)) / resting(angle)}
