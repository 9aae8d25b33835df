"""The contacts of the PyBullet callback: one handle each, over one pair of bodies or many."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pybullet as p
from numpy.typing import NDArray

from contactlaw.pair import ContactPair
from contactlaw.pybullet_callback.shapes import Key, Side
from contactlaw.world.records import CLOSED
from contactlaw.world.sets import Sets

Array = NDArray[np.float64]
MANY = 10_000


@dataclass
class ContactState:
    """A contact at the end of the step, and what it has given within the step.

    Attributes:
        a, b: Body and link of both sides.
        touching: Whether the bodies touch at any time within the step.
        overlap: [m].
        normal_force: [N], >= 0.
        tangential_force: On A, world frame [N], shape (3,).
        impulse: On A over the step, world frame [N s], shape (3,).
        force: The mean of the step, impulse over time step [N], shape (3,).
        history: A copy of what the law remembers; where a capsule lies on two places, of the deeper one, and the
            forces are sums.
    """

    a: Key
    b: Key
    touching: bool = False
    overlap: float = 0.0
    normal_force: float = 0.0
    tangential_force: Array = field(default_factory=lambda: np.zeros(3))
    impulse: Array = field(default_factory=lambda: np.zeros(3))
    force: Array = field(default_factory=lambda: np.zeros(3))
    history: Array = field(default_factory=lambda: np.zeros(0))

    def enter(self, c: Any, memory: Array, sign: float, asleep: bool, dt: float) -> None:
        """Enter a contact of the world; sign: -1.0 where its A is this one's b, else 1.0."""
        own = c["touch"]["force"] if c["phase"] == CLOSED else 0.0
        overlap = max(float(c["touch"]["overlap"]), 0.0) if c["phase"] == CLOSED else 0.0
        self.touching = True
        self.impulse += sign * (dt * c["force"] if asleep else c["impulse"] - c["earlier"])
        self.tangential_force += sign * (c["force"] - own * c["normal"])
        self.normal_force += float(own)
        self.force = self.impulse / dt if dt > 0.0 else self.force
        if overlap >= self.overlap:
            self.overlap, self.history = overlap, memory.copy()


@dataclass(eq=False)
class Contact:
    """The law between bodies of two sets.

    Attributes:
        pair: As the user gave it.
        substeps: Least number in a contact.
        sides: Of both sets, by their keys.
        sets: Who may touch whom, by their keys.
        rounding: Radius of edges [m]; None: see `world.shapes.ROUNDING`.
        silent: Those for which Bullet's own response is off.
        told: Which two have been warned of, and what.
    """

    pair: ContactPair
    substeps: int
    sides: dict[Key, Side]
    sets: Sets
    rounding: float | None = None
    silent: dict[tuple[Key, Key], None] = field(default_factory=dict)
    told: set[tuple[Key, Key, str]] = field(default_factory=set)

    @property
    def many(self) -> bool:
        """Whether there are so many pairs that Bullet is told of each only when the two come near each other."""
        return len(self.sets.ones) * len(self.sets.twos) > MANY

    def silence(self, client: int, pairs: Iterable[tuple[Key, Key]]) -> None:
        """Turn Bullet's own response off."""
        for one, two in pairs:
            if (one, two) not in self.silent:
                p.setCollisionFilterPair(one[0], two[0], one[1], two[1], 0, client)
                self.silent[one, two] = None

    @property
    def bodies(self) -> set[int]:
        """Ids of all."""
        return {body for body, _ in self.sides}
