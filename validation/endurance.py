"""A ball that bounces to rest and is kicked, again and again, without an engine: memory stays what it is."""

from pathlib import Path
from typing import Any

import numpy as np

from contactlaw import ContactPair
from validation.ball import DOWN, FLOOR, RADIUS, STEEL, balls_world

HEIGHT, KICKS = 0.05, 200  # [m]; in a run


def resident() -> float:
    """Memory [MB] of this process that is in use."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4096 / 2**20


def endure(steps: int) -> dict[str, Any]:
    """So many steps; memory [MB] before and after."""
    place, rng = [0.0, 0.0, RADIUS + HEIGHT], np.random.default_rng(0)
    pair = ContactPair(STEEL, STEEL, 0.2, 0.7)
    world = balls_world("none", 2e-3, pair, place, planes=[FLOOR], gravity=DOWN).world  # type: ignore[attr-defined]
    world.step(2000)
    before = resident()
    for _ in range(KICKS):
        up = np.sqrt(2.0 * 9.81 * HEIGHT) * rng.uniform(0.1, 0.9)
        world.place(0, velocity=[*(0.05 * rng.normal(size=2)), up])
        world.step(steps // KICKS)
    return {"engine": "none", "steps": steps, "before": before, "after": resident()}
