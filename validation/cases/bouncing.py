"""A ball that bounces under gravity: it keeps its energy, or comes to rest at its static overlap and stays."""

from itertools import groupby, product
from math import sqrt

import numpy as np

from validation.ball import DOWN, GRAVITY, INTEGRATORS, RADIUS, Array, at, ball_world, static_overlap, steel_pair
from validation.case import Case, Data, Limit, Outcome, worst

DROP = 0.05  # [m]
ENERGY = 1e-3
OVERLAP = 1e-8
LATE = 1.05
ELASTIC = {
    "mujoco": {1.0 / 60.0: 10.0, 1.0 / 240.0: 10.0, 2e-3: 10.0, 1e-3: 10.0, 1e-4: 10.0, 1e-5: 10.0, 1e-6: 2.0},
    "pybullet": {1.0 / 60.0: 10.0, 1.0 / 240.0: 10.0, 1e-3: 10.0, 1e-4: 5.0, 1e-5: 1.0},
}
"""Step [s] and how long the run is [s]."""
RESTS = {"mujoco": [2e-3, 1.0 / 240.0], "pybullet": [1.0 / 240.0]}  # [s]
RESTITUTIONS = [0.9, 0.5]
LONG, SETTLED = 60.0, 5.0  # [s]: how long it lies, and from when on its motion counts


class Bouncing(Case):
    """An elastic ball dropped from 50 mm keeps its energy to 0.001 over its bounces, at any engine step. A ball with
    restitution below 1 comes to rest at the overlap that carries its weight, and stays there for a minute without
    drift.
    """

    place = 43
    title = "Bouncing and coming to rest"

    def run(self, quick: bool) -> Outcome:
        data: Data = {"elastic": [], "rest": []}
        problems: list[str] = []
        runs = [(engine, dt, seconds) for engine, steps in ELASTIC.items() for dt, seconds in steps.items()]
        for engine, dt, whole in runs:
            seconds = max(whole * (0.1 if quick and dt < 2e-3 else 0.5 if quick else 1.0), 0.5)
            tops = _tops(engine, dt, seconds)
            if tops.size == 0:
                problems.append(f"{engine}, {dt:g} s: no bounce")
                continue
            data["elastic"].append({"engine": engine, "step": dt, "seconds": seconds, "bounces": tops.size,
                                    "largest": float(np.abs(tops).max())})  # fmt: skip
        kinds = [("mujoco", dt, name) for dt in RESTS["mujoco"] for name in INTEGRATORS]
        kinds += [("pybullet", dt, "Euler") for dt in RESTS["pybullet"]]
        for e, (engine, dt, integrator) in product(RESTITUTIONS, kinds):
            rest = _lie(engine, dt, integrator, e, 10.0 if quick else LONG)
            data["rest"].append({"engine": engine, "step": dt, "integrator": integrator, "e": e, **rest})
        limits = [Limit(f"energy of the elastic ball, {engine}, any step", ENERGY,
                        worst(data["elastic"], "largest", engine=engine)) for engine in ELASTIC]  # fmt: skip
        limits += [
            Limit(f"{what}, {engine}", asked, worst(data["rest"], key, engine=engine), unit)
            for engine in RESTS
            for what, key, asked, unit in (
                ("overlap at rest", "overlap_error", OVERLAP, ""),
                ("jitter of height over the overlap", "jitter", OVERLAP, ""),
                ("time to come to rest over the closed form", "time", LATE, ""),
                ("drift along the floor", "drift", 1e-9, "m"),
            )
        ]
        return Outcome(limits, data, problems)


def _tops(engine: str, dt: float, seconds: float) -> Array:
    """Energy of each flight over the first, less 1, read near the top."""
    world, more = ball_world(engine, dt, steel_pair(restitution=1.0), DOWN), max(1, round(2e-3 / dt))
    world.start(at(DROP))

    def look() -> tuple[float, float]:
        world.step(more)
        state = world.read()
        return state.position[0, 2] - RADIUS, state.velocity[0, 2]

    flights = groupby((look() for _ in range(round(seconds / (more * dt)))), key=lambda seen: seen[0] > 0.1 * DROP)
    out = []
    for flying, seen in flights:
        if flying:
            height, speed = max(seen)
            out.append((0.5 * speed * speed + GRAVITY * height) / (GRAVITY * DROP) - 1.0)
    world.close()
    return np.array(out[1:])


def _lie(engine: str, dt: float, integrator: str, e: float, seconds: float) -> Data:
    """Drop a ball until it rests: if each bounce is e times as fast, after (1 + e)/(1 - e) times the first fall."""
    world = ball_world(engine, dt, steel_pair(restitution=e), DOWN, integrator=integrator)
    world.start(at(DROP))
    seen = np.empty((round(seconds / dt), 3))
    for row in seen:
        world.step()
        row[:] = world.place()
    world.close()
    height, rest = seen[:, 2] - RADIUS, seen[round(SETTLED / dt) :]
    overlap, last = RADIUS - rest[:, 2], int(np.flatnonzero(height > static_overlap())[-1])
    return {
        "overlap_error": float(np.abs(overlap / static_overlap() - 1.0).max()),
        "jitter": float(np.ptp(overlap) / static_overlap()),
        "drift": float(np.hypot(*(rest[:, :2] - rest[0, :2]).T).max()),
        "time": (last + 1) * dt / ((1.0 + e) / (1.0 - e) * sqrt(2.0 * DROP / GRAVITY)),
    }
