"""Rows of balls in touch, as in Newton's cradle: contacts that share balls are integrated together."""

from dataclasses import replace
from itertools import product

import numpy as np

from contactlaw import ContactPair
from validation.ball import INTEGRATORS, MASS, RADIUS, STEEL, Array, balls_world, where
from validation.case import Case, Data, Limit, Outcome, Progress, Table, register, told, worst

COUNTS = [3, 4, 5]
GAP = 1e-4  # [m]
SPEED = 1.0  # [m/s]
STEPS = {"mujoco": [2e-3, 1e-4], "pybullet": [1.0 / 240.0, 1e-4]}  # [s]
ASKED = 5e-3  # of the speed
LONG = 0.02  # [s]
PAIR = ContactPair(STEEL, STEEL, friction=0.115, restitution=1.0)


@register
class Cradle(Case):
    """When one ball strikes a row that touches, all contacts act at once and the velocities after depend on how the
    forces share; at the engine's own step, far longer than the whole event, they are those of a finely integrated chain
    of Hertz springs. With 0.1 mm between, only the last ball flies off.
    """

    place = 45
    title = "A row of balls in touch"
    needs = ("mujoco", "pybullet", "scipy")

    def run(self, quick: bool, progress: Progress) -> Outcome:
        from sims.scenes.cradle import hertz_chain

        runs: list[Data] = []
        chains = {}
        for count in told(COUNTS[:1] if quick else COUNTS, progress):
            chain = chains[str(count)] = hertz_chain(replace(PAIR, radius=0.5 * RADIUS), MASS, count, 1, SPEED, 0.0)
            away = np.zeros(count)
            away[-1] = SPEED
            for (gap, truth), (engine, dt, integrator) in product(((0.0, chain), (GAP, away)), _kinds()):
                after = _after(engine, dt, integrator, count, gap)
                runs.append({"balls": count, "gap": gap, "engine": engine, "step": dt, "integrator": integrator,
                             "velocity": after, "error": float(np.abs(after - truth).max()) / SPEED})  # fmt: skip
        limits = [
            Limit(f"error of the velocities over the speed, {engine}, {'in touch' if gap == 0.0 else 'apart'}", ASKED,
                  worst(runs, "error", engine=engine, gap=gap))
            for engine, gap in product(STEPS, (0.0, GAP))
        ]  # fmt: skip
        return Outcome(limits, {"chain": chains, "runs": runs})

    def table(self, data: Data) -> Table:
        table = Table("balls | gap [mm] | engine, step | velocities after [m/s] | error")
        for count, chain in data["chain"].items():
            table.add(f"{count} | 0 | Hertz chain | {_words(chain)}")
            for run in (run for run in data["runs"] if run["balls"] == int(count)):
                velocities = _words(run["velocity"])
                table.add(f"{count} | {1e3 * run['gap']:g} | {where(run)} | {velocities} | {{error:.1e}}", run)
        return table


def _kinds() -> list[tuple[str, float, str]]:
    first, *finer = STEPS["mujoco"]
    kinds = [("mujoco", first, name) for name in INTEGRATORS] + [("mujoco", dt, "Euler") for dt in finer]
    return kinds + [("pybullet", dt, "") for dt in STEPS["pybullet"]]


def _after(engine: str, dt: float, integrator: str, count: int, gap: float) -> Array:
    """Velocities along the row after the impact [m/s]."""
    places, velocities = np.zeros((count, 3)), np.zeros((count, 3))
    places[:, 0] = np.arange(count) * (2.0 * RADIUS + gap)
    velocities[0, 0] = SPEED
    if gap == 0.0:  # begins in the middle of a step
        places[0, 0] -= 0.37 * dt * SPEED
    world = balls_world(engine, dt, PAIR, places, velocities, integrator=integrator or "Euler")
    world.start()
    world.step(round(LONG / dt) + 2)
    after = world.read().velocity
    world.close()
    return after[:, 0]


def _words(velocities: list[float]) -> str:
    return ", ".join(f"{value:.4f}" for value in velocities)
