"""A ball that bounces under gravity: it keeps its energy, or comes to rest at its static overlap and stays."""

# pyright: reportAttributeAccessIssue=false
# (pyright cannot see into the mujoco module)

from __future__ import annotations

from itertools import groupby
from math import sqrt
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from validation.ball import (
    GRAVITY,
    INTEGRATORS,
    RADIUS,
    BulletBall,
    half_step,
    mujoco_ball,
    static_overlap,
    steel_pair,
    true_velocity,
)
from validation.case import Case, Data, Limit, Outcome, Progress, Table, register
from validation.picture import STYLES, limit_line, panels

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

DROP = 0.05  # [m]
ENERGY = 1e-3
OVERLAP = 1e-8
LATE = 1.05
DOWN = np.array([0.0, 0.0, -GRAVITY])
ELASTIC = {
    "mujoco": {1.0 / 60.0: 10.0, 1.0 / 240.0: 10.0, 2e-3: 10.0, 1e-3: 10.0, 1e-4: 10.0, 1e-5: 10.0, 1e-6: 2.0},
    "pybullet": {1.0 / 60.0: 10.0, 1.0 / 240.0: 10.0, 1e-3: 10.0, 1e-4: 5.0, 1e-5: 1.0},
}
"""Step [s] and how long the run is [s]."""
RESTS = {"mujoco": [2e-3, 1.0 / 240.0], "pybullet": [1.0 / 240.0]}  # [s]
RESTITUTIONS = [0.9, 0.5]
LONG, SETTLED = 60.0, 5.0  # [s]: how long it lies, and from when on its motion counts


@register
class Bouncing(Case):
    """A steel ball dropped from 50 mm."""

    name = "bouncing"
    place = 43
    title = "Bouncing and coming to rest"
    claim = (
        "An elastic ball dropped from 50 mm keeps bouncing to the same height within 0.001 of its energy, at any "
        "engine step; one with restitution comes to rest at the overlap that carries its weight, and stays there for a "
        "minute without drift."
    )
    caption = (
        "Left: energy at the top of each bounce, over the first, less 1. It is taken with the true velocity: a "
        "semi-implicit engine keeps the velocity of half a step before, so half a step of gravity is added; with it "
        "the flight itself is exact. Right: height of the ball with restitution 0.9 over its place at rest (2 ms); "
        "below the dotted line the ball lies."
    )
    needs = ("mujoco", "pybullet")

    def run(self, quick: bool, progress: Progress) -> Outcome:
        """Elastic runs at every step, then rest."""
        data: Data = {"elastic": [], "rest": [], "fall": {}}
        problems: list[str] = []
        runs = [
            (engine, dt, max(seconds * (0.1 if quick and dt < 2e-3 else 0.5 if quick else 1.0), 0.5))
            for engine, steps in ELASTIC.items()
            for dt, seconds in steps.items()
        ]
        for number, (engine, dt, seconds) in enumerate(runs):
            tops = (tops_in_mujoco if engine == "mujoco" else tops_in_pybullet)(dt, seconds)
            if tops.size == 0 or not np.isfinite(tops).all():
                problems.append(f"{engine}, {dt:g} s: no bounce or not finite")
                tops = np.full(1, np.nan)
            data["elastic"].append(
                {"engine": engine, "step": dt, "seconds": seconds, "bounces": tops.size,
                 "largest": float(np.abs(tops).max()), "gain": float(tops.max()), "tops": tops}
            )  # fmt: skip
            progress(0.7 * (number + 1) / len(runs))
        kinds = [("mujoco", dt, name) for dt in RESTS["mujoco"] for name in INTEGRATORS]
        kinds += [("pybullet", dt, "") for dt in RESTS["pybullet"]]
        seconds = 10.0 if quick else LONG
        for e in RESTITUTIONS:
            for engine, dt, integrator in kinds:
                rest = _lie(*(mujoco_scene if engine == "mujoco" else bullet_scene)(dt, e, integrator), seconds, dt, e)
                height = rest.pop("height")
                data["rest"].append({"engine": engine, "step": dt, "integrator": integrator, "e": e, **rest})
                if engine == "mujoco" and e == 0.9 and integrator == "Euler" and dt == 2e-3:
                    some = slice(0, int(4.0 / dt), 8)
                    data["fall"] = {"time": dt * np.arange(1, height.size + 1)[some],
                                    "height": height[some] + static_overlap()}  # fmt: skip
        limits = [
            Limit(f"energy of the elastic ball, {engine}, any step", ENERGY,
                  max(run["largest"] for run in data["elastic"] if run["engine"] == engine))
            for engine in ELASTIC
        ]  # fmt: skip
        for engine in RESTS:
            own = [rest for rest in data["rest"] if rest["engine"] == engine]
            limits += [
                Limit(f"overlap at rest, {engine}", OVERLAP, max(rest["overlap_error"] for rest in own)),
                Limit(f"jitter of height over the overlap, {engine}", OVERLAP, max(rest["jitter"] for rest in own)),
                Limit(f"time to come to rest over the closed form, {engine}", LATE, max(rest["time"] for rest in own)),
                Limit(f"drift along the floor, {engine}", 1e-9, max(rest["drift"] for rest in own), "m"),
            ]
        return Outcome(limits, data, problems)

    def table(self, data: Data) -> Table:
        """Elastic, then rest."""
        table = Table(["engine, step", "run", "bounces", "largest change of energy", "error of overlap",
                       "jitter / overlap", "drift [m]", "time to rest over closed form"])  # fmt: skip
        for run in data["elastic"]:
            table.rows.append(
                [f"{run['engine']}, {1e3 * run['step']:.4g} ms", f"e = 1, {run['seconds']:g} s", str(run["bounces"]),
                 f"{run['largest']:.1e}", "", "", "", ""]
            )  # fmt: skip
        for rest in data["rest"]:
            table.rows.append(
                [f"{rest['engine']}, {1e3 * rest['step']:.4g} ms {rest['integrator']}", f"e = {rest['e']:g}, at rest",
                 "", "", f"{rest['overlap_error']:.1e}", f"{rest['jitter']:.1e}", f"{rest['drift']:.1e}",
                 f"{rest['time']:.3f}"]
            )  # fmt: skip
        return table

    def draw(self, data: Data) -> Figure:
        """Energy over bounces, and the fall to rest."""
        figure, (left, right) = panels(2)
        mujoco = [run for run in data["elastic"] if run["engine"] == "mujoco" and run["step"] != 1e-3]
        for style, run in zip(STYLES, mujoco, strict=False):
            tops = np.array(run["tops"])
            left.plot(np.arange(1, tops.size + 1), tops, **style, markevery=8, label=f"{1e3 * run['step']:.4g} ms")
        limit_line(left, ENERGY, "asked")
        limit_line(left, -ENERGY, "asked")
        left.set(xlabel="bounce [-]", ylabel="energy over the first, less 1 [-]", title="elastic, MuJoCo")
        left.set_ylim(-1.6 * ENERGY, 1.2 * ENERGY)
        left.legend(fontsize=8, ncols=3, loc="lower left")
        fall = data["fall"]
        right.semilogy(fall["time"], np.maximum(np.abs(fall["height"]), 1e-18), color="black", linewidth=0.8)
        right.axhline(static_overlap(), color="black", linewidth=0.8, linestyle=":")
        right.set(xlabel="time [s]", ylabel="height over the place at rest [m]", title="restitution 0.9, 2 ms, MuJoCo")
        return figure


def tops_in_mujoco(dt: float, seconds: float) -> Array:
    """Energy at the top of each bounce over the first, less 1."""
    import mujoco

    model, data, name = mujoco_ball(dt, "law alone", steel_pair(restitution=1.0), gravity=DOWN)
    start = int(model.plugin_stateadr[mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_PLUGIN, name)])
    data.qpos[2], data.qvel[:3] = RADIUS + DROP, -half_step(model)
    more = max(1, round(2e-3 / dt))

    def look() -> tuple[bool, float, float]:
        mujoco.mj_step(model, data, more)
        return data.plugin_state[start] == 0.0, data.qpos[2] - RADIUS, data.qvel[2] + half_step(model)[2]

    return _tops(look, round(seconds / (more * dt)))


def tops_in_pybullet(dt: float, seconds: float) -> Array:
    """The same in PyBullet."""
    ball = BulletBall(dt, "law", steel_pair(restitution=1.0), gravity=DOWN)
    more = max(1, round(2e-3 / dt))
    ball.start(DROP, -0.5 * dt * DOWN)

    def look() -> tuple[bool, float, float]:
        ball.step(more)
        height = ball.height
        return height > 0.1 * DROP, height, float(ball.motion[0][2] + 0.5 * dt * DOWN[2])

    try:
        return _tops(look, round(seconds / (more * dt)))
    finally:
        ball.close()


def _tops(look: Any, count: int) -> Array:
    """One value for each flight: the energy is the same all along it, so that nearest to the top will do."""
    flights = groupby((look() for _ in range(count)), key=lambda seen: seen[0] and seen[1] > 0.1 * DROP)
    out = []
    for flying, seen in flights:
        if flying:
            _, height, speed = max(seen, key=lambda one: one[1])
            out.append((0.5 * speed * speed + GRAVITY * height) / (GRAVITY * DROP) - 1.0)
    return np.array(out[1:])


def mujoco_scene(dt: float, e: float, integrator: str) -> tuple[Any, Any]:
    """How to step and what to read."""
    import mujoco

    model, data, _ = mujoco_ball(dt, "law alone", steel_pair(restitution=e), gravity=DOWN, integrator=integrator)
    data.qpos[2], data.qvel[:3] = RADIUS + DROP, -half_step(model)

    def look() -> tuple[float, float, float, float]:
        mujoco.mj_step(model, data)
        x, y, z = data.qpos[:3]
        return x, y, z - RADIUS, data.qpos[3]

    return look, lambda: float(np.abs(true_velocity(model, data)).max())


def bullet_scene(dt: float, e: float, _: str) -> tuple[Any, Any]:
    """The same in PyBullet."""
    ball = BulletBall(dt, "law", steel_pair(restitution=e), gravity=DOWN)
    ball.start(DROP, -0.5 * dt * DOWN)

    def look() -> tuple[float, float, float, float]:
        ball.step(1)
        (x, y, z), turn = ball.engine.getBasePositionAndOrientation(ball.ball, ball.client)
        return x, y, z - RADIUS, turn[3]

    return look, lambda: float(np.abs(np.concatenate(ball.true_motion)).max())


def _lie(look: Any, speed: Any, seconds: float, dt: float, e: float) -> Data:
    """Drop, and watch it lie. A ball whose bounces are each e times as fast rests after (1 + e)/(1 - e) falls."""
    seen = np.array([look() for _ in range(round(seconds / dt))])
    rest = seen[round(SETTLED / dt) :]
    overlap = -rest[:, 2]
    last = int(np.flatnonzero(seen[:, 2] > static_overlap())[-1])
    return {
        "height": seen[:, 2],
        "overlap_error": float(np.abs(overlap / static_overlap() - 1.0).max()),
        "jitter": float(np.ptp(overlap) / static_overlap()),
        "drift": float(np.hypot(*(rest[:, :2] - rest[0, :2]).T).max()),
        "turned": float(np.abs(rest[:, 3] - rest[0, 3]).max()),
        "speed": speed(),
        "time": (last + 1) * dt / ((1.0 + e) / (1.0 - e) * sqrt(2.0 * DROP / GRAVITY)),
    }
