"""What a step of many balls costs with the law, beside MuJoCo with the solver that is cheapest there."""

from math import ceil
from time import process_time
from typing import Any

import numpy as np

from contactlaw import ContactPair
from validation.ball import DOWN, FLOOR, STEEL, balls_world

RADIUS = 0.01  # [m]
GAP = 5.0  # radii from centre to centre
STEP = 2e-3  # [s]
ELASTIC = (2.5e4, 5.0)  # native stiffness and damping: so balls bounce
SOLVERS = ("CG", "Newton")
ARENA = 40  # bytes of MuJoCo's arena for each two balls, of which its broad phase wants many


def crowd(count: int, kind: str) -> Any:
    """Balls in a cube with gaps over a floor, in MuJoCo, by the law, the "law alone" (nothing may touch natively), or a
    native solver's name."""
    import mujoco

    across, number = ceil(count ** (1 / 3) - 1e-9), np.arange(count)
    lattice = np.stack([number % across, number // across % across, number // across**2 + 0.5], 1)
    places = RADIUS * (GAP * lattice + np.random.default_rng(0).uniform(-0.1, 0.1, lattice.shape))
    pair = None if kind in SOLVERS else ContactPair(STEEL, STEEL, friction=0.2, restitution=0.9)
    world: Any = balls_world("mujoco", STEP, pair, places, radius=RADIUS, planes=[FLOOR], gravity=DOWN,
                             collide=kind == "law")  # fmt: skip
    world.spec.memory = 50_000_000 + ARENA * count * count
    if kind in SOLVERS:
        world.native(1.0, 0.0, ELASTIC)
        world.spec.option.solver = getattr(mujoco.mjtSolver, f"mjSOL_{kind.upper()}")  # type: ignore[attr-defined]
    world.start()
    return world


def step_costs(count: int, steps: int = 100, block: int = 10) -> dict[str, float]:
    """Mean processor time of a step [s] of balls that fall and bounce from the start on, turn by turn.

    Returns that with the law, among native contacts and alone, and "native": of the solver that took less.
    """
    worlds = {kind: crowd(count, kind) for kind in ("law", "law alone", *SOLVERS)}
    times = dict.fromkeys(worlds, 0.0)
    for _ in range(steps // block):
        for kind, world in worlds.items():
            begun = process_time()
            world.step(block)
            times[kind] += process_time() - begun
    mean = {kind: time / (steps // block * block) for kind, time in times.items()}
    return {"law": mean["law"], "law alone": mean["law alone"], "native": min(mean[solver] for solver in SOLVERS)}
