"""Properties that are taken to their ends, one at a time, in levels."""

from __future__ import annotations

from dataclasses import dataclass
from math import radians, tan
from typing import Any

import numpy as np

from validation.stability_draws import STEPS, bounces, chattering, overlapping, resting
from validation.stability_trials import Trial


@dataclass(frozen=True)
class Extreme:
    """One thing taken to its ends.

    Attributes:
        name: In words, with its unit, as a picture shows it.
        levels: Values.
        words: How they are written.
    """

    name: str
    levels: tuple[float, ...]
    words: tuple[str, ...]

    @property
    def plain(self) -> str:
        """The name where mathematics cannot be set."""
        return self.name.replace("$", "").replace("\\,", " ").replace("\\", "")


EXTREMES = {
    "poisson": Extreme("Poisson's ratio", (0.0, 0.3, 0.49, 0.4999, 0.5), ("0", "0.3", "0.49", "0.4999", "0.5")),
    "friction": Extreme("friction", (0.0, 1e-6, 1e-3, 1.0, 10.0, 1e3), ("0", "1e-6", "1e-3", "1", "10", "1000")),
    "gyration": Extreme("I/(M R$^2$)", (1.0, 2.0 / 3.0, 0.1, 1e-2, 1e-4), ("1", "2/3", "0.1", "0.01", "1e-4")),
    "psi_1": Extreme(r"$\psi_1$", (1e-6, 1e-3, 1.0, 30.0, 1e3), ("1e-6", "1e-3", "1", "30", "1000")),
    "ratio": Extreme("mass ratio", (1e-6, 1e-3, 1.0, 1e3, 1e6), ("1e-6", "1e-3", "1", "1e3", "1e6")),
    "speed": Extreme("speed [m/s]", (1e-6, 1e-3, 0.1, 10.0, 100.0), ("1e-6", "1e-3", "0.1", "10", "100")),
    "angle": Extreme("from normal [°]", (45.0, 80.0, 89.0, 89.9, 89.99), ("45", "80", "89", "89.9", "89.99")),
    "overlap": Extreme("overlap/R at start", (1e-8, 1e-6, 1e-4, 1e-2, 0.1), ("1e-8", "1e-6", "1e-4", "0.01", "0.1")),
    "rest": Extreme(r"rest, $\omega\,dt$", (0.01, 0.3, 3.0, 30.0, 1e3), ("0.01", "0.3", "3", "30", "1000")),
    "chatter": Extreme("impacts a step", (0.01, 0.1, 1.0, 10.0, 100.0), ("0.01", "0.1", "1", "10", "100")),
}  # fmt: skip


def extreme(name: str, level: int, number: int, count: int) -> Trial | None:
    """One of the trials of a level of an extreme; contacts from a thousandth of a step to hundreds of them, in turn.

    Args:
        name: Of `EXTREMES`.
        level: Number of the level.
        number: Of the trial, 0 to count - 1; even ones are elastic.
        count: Of trials.
    """
    value, seed = EXTREMES[name].levels[level], (list(EXTREMES).index(name), level, number)
    edges = np.linspace(*STEPS, (count + 1) // 2 + 1)
    steps = (float(edges[number // 2]), float(edges[number // 2 + 1]))
    e = 1.0 if number % 2 == 0 else 0.5
    if name == "rest":
        return resting(seed, value)
    if name == "chatter":
        return chattering(seed, value, e)
    if name == "overlap":
        return overlapping(seed, value, steps, e)
    given: dict[str, Any] = {"across": tan(radians(value))} if name == "angle" else {name: value}
    return bounces(seed, steps, flights=4, restitution=e, **given)
