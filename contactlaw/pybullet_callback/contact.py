"""The contacts of the PyBullet callback: one handle each, over one pair of bodies or many."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from math import inf
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contactlaw.pair import ContactPair
from contactlaw.pybullet_callback.shapes import Key, Side
from contactlaw.world.records import CLOSED

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ContactState:
    """A contact at the end of the step, and what it has given within the step.

    Attributes:
        touching: Whether the bodies touch at any time within the step.
        overlap: [m].
        normal_force: [N], >= 0.
        tangential_force: On A, world frame [N], shape (3,).
        impulse: On A over the step, world frame [N s], shape (3,).
        force: The mean of the step, impulse over time step [N], shape (3,).
        history: A copy of what the law remembers; where a capsule lies on two places, of the deeper one, and the
            forces are sums.
        a, b: Body and link of both sides.
    """

    touching: bool
    overlap: float
    normal_force: float
    tangential_force: Array
    impulse: Array
    force: Array
    history: Array
    a: Key
    b: Key


@dataclass
class Ledger:
    """What the contacts of a handle have come to since they were added.

    Attributes:
        impacts: How often bodies have touched.
        greatest_overlap: [m].
        greatest_force: Normal [N].
        time_in_contact: Summed over the contacts [s].
        shortest_contact: Duration of the shortest contact that is over, over the time step; inf: none yet.
        normal_loss, tangential_loss: Work done on the contacts along the normal and across [J]: once the bodies have
            parted, energy lost; before, with what the contacts hold as springs.
    """

    impacts: int = 0
    greatest_overlap: float = 0.0
    greatest_force: float = 0.0
    time_in_contact: float = 0.0
    shortest_contact: float = inf
    normal_loss: float = 0.0
    tangential_loss: float = 0.0

    def add(self, contact: Any, dt: float) -> None:
        """Enter a contact of the world, since its touch."""
        self.impacts += int(contact["touches"])
        self.greatest_overlap = max(self.greatest_overlap, float(contact["deepest"]))
        self.greatest_force = max(self.greatest_force, float(contact["strongest"]))
        self.time_in_contact += float(contact["duration"])
        if contact["phase"] != CLOSED:
            self.shortest_contact = min(self.shortest_contact, float(contact["duration"] / contact["touches"]) / dt)
        self.normal_loss -= float(contact["normal_work"])
        self.tangential_loss -= float(contact["friction_work"])


@dataclass(eq=False)
class Couple:
    """Two bodies that may touch.

    Attributes:
        a, b: As the user gave them.
        deep: Whether a deep overlap has been warned of.
    """

    a: Side
    b: Side
    deep: bool = field(default=False)

    @property
    def ends(self) -> tuple[Side, Side]:
        """A and B."""
        return self.a, self.b

    @property
    def sides(self) -> tuple[Side, Side]:
        """Both, the rounder first."""
        return (self.b, self.a) if self.b.rank < self.a.rank else (self.a, self.b)

    @property
    def measured(self) -> bool:
        """Whether PyBullet must measure their distance."""
        return any(side.measured for side in (self.a, self.b))

    def __str__(self) -> str:
        return f"{self.a} and {self.b}"


@dataclass(eq=False)
class Contact:
    """The law between bodies of two sets.

    Attributes:
        pair: As the user gave it.
        substeps: Least number in a contact.
        couples: Who may touch whom.
        ledger: None: not asked for.
        rounding: Radius of edges [m]; None: see `world.shapes.ROUNDING`.
    """

    pair: ContactPair
    substeps: int
    couples: list[Couple]
    ledger: Ledger | None
    rounding: float | None = None


def state_of(couple: Couple, contacts: Iterable[tuple[Any, Array, float, bool]], dt: float) -> ContactState:
    """What the world's contacts of a couple say; each with what its law remembers, sign, and whether it sleeps.

    sign: 1.0 where the world's A is the couple's, else -1.0.
    """
    impulse, tangential, normal, deepest = np.zeros(3), np.zeros(3), 0.0, 0.0
    history, touching = np.zeros(0), False
    for c, memory, sign, asleep in contacts:
        touching = True
        own = c["touch"]["force"] if c["phase"] == CLOSED else 0.0
        impulse += sign * (dt * c["force"] if asleep else c["impulse"] - c["earlier"])
        tangential += sign * (c["force"] - own * c["normal"])
        normal += float(own)
        overlap = max(float(c["touch"]["overlap"]), 0.0) if c["phase"] == CLOSED else 0.0
        if overlap >= deepest:
            deepest, history = overlap, memory.copy()
    force = impulse / dt if dt > 0.0 else np.zeros(3)
    return ContactState(touching, deepest, normal, tangential, impulse, force, history, couple.a.key, couple.b.key)
