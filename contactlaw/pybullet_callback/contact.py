"""The contacts of the PyBullet callback: one handle each, over one pair of bodies or many."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field, replace
from math import inf

import numpy as np
from numpy.typing import NDArray

from contactlaw.kernels.contact import DIRECTION, HEADER, NORMAL, OVERLAP, TANGENT, TANGENTIAL
from contactlaw.kernels.scene import GIVEN, HISTORY
from contactlaw.kernels.touch import slots
from contactlaw.pair import DEEPEST, ContactPair, ContactWarning
from contactlaw.pybullet_callback.shapes import Key, Side
from contactlaw.pybullet_callback.tables import (
    TOLD_BEGUN,
    TOLD_DEEPEST,
    TOLD_DRAG,
    TOLD_FASTEST,
    TOLD_STRONGEST,
    TOLD_TOUCHING,
    TOLD_WORK,
)

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ContactState:
    """A contact as the last call foresees it for the end of the step, and what it has given within the step.

    Attributes:
        touching: Whether the bodies touch at any time within the step.
        overlap: [m].
        normal_force: [N], >= 0.
        tangential_force: On A, world frame [N], shape (3,).
        impulse: On A over the step, world frame [N s], shape (3,); a part of it acts in the next step.
        force: The mean of the step, impulse over time step [N], shape (3,).
        history: A copy of what the law remembers, as `contactlaw.kernels.contact` lays it out; where a capsule lies on
            two places, of the deeper one, and the forces are sums.
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
        shortest_contact: Duration of the fastest contact over the time step; inf: none yet.
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

    def add(self, told: list[float], dt: float) -> None:
        """Enter a step of one contact, as `tables` lays it out."""
        self.impacts += int(told[TOLD_BEGUN])
        self.greatest_overlap = max(self.greatest_overlap, told[TOLD_DEEPEST])
        self.greatest_force = max(self.greatest_force, told[TOLD_STRONGEST])
        self.time_in_contact += told[TOLD_TOUCHING]
        if told[TOLD_TOUCHING] > 0.0 and 0.0 < told[TOLD_FASTEST] < 1e300:
            self.shortest_contact = min(self.shortest_contact, told[TOLD_FASTEST] / dt)
        self.normal_loss += told[TOLD_WORK]
        self.tangential_loss += told[TOLD_DRAG]


@dataclass(eq=False)
class Couple:
    """Two bodies that may touch.

    Attributes:
        a, b: As the user gave them.
        radius: Effective [m].
        flipped: Whether the kernels see them the other way round.
        deep: Overlap [m] to warn of; inf: has been warned of.
        gave_up: Whether a step has run out of substeps.
    """

    a: Side
    b: Side
    radius: float
    flipped: bool = field(init=False)
    deep: float = field(init=False)
    gave_up: bool = False

    def __post_init__(self) -> None:
        self.flipped = self.b.rank < self.a.rank
        self.deep = DEEPEST * self.radius

    @property
    def sides(self) -> tuple[Side, Side]:
        """Both, the rounder first."""
        return (self.b, self.a) if self.flipped else (self.a, self.b)

    @property
    def slots(self) -> int:
        """How many places they may touch at."""
        one, two = self.sides
        return 1 if self.measured else int(slots(one.kind, two.kind))

    @property
    def measured(self) -> bool:
        """Whether PyBullet must measure their distance."""
        one, two = self.sides
        return one.rank > 1 or two.shape not in ("sphere", "capsule", "box", "plane")

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
    """

    pair: ContactPair
    substeps: int
    couples: list[Couple]
    ledger: Ledger | None

    def parameters(self, radius: float) -> Array:
        """For the kernels, with an effective radius [m]."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ContactWarning)  # of coupling: said when the user made the pair
            return replace(self.pair, radius=radius).parameters(radius)

    @property
    def history_size(self) -> int:
        """Numbers in the history of one contact."""
        return HEADER + self.pair.memory_size


def state_of(couple: Couple, contact: Contact, records: Array, dt: float) -> ContactState:
    """What the records of a couple, one or none for each of its slots, say."""
    impulse, tangential, normal, deepest = np.zeros(3), np.zeros(3), 0.0, 0.0
    history = np.zeros(contact.history_size)
    sign = -1.0 if couple.flipped else 1.0
    for record in records:
        h = record[HISTORY : HISTORY + history.size]
        t, n = h[TANGENT : TANGENT + 3], h[DIRECTION : DIRECTION + 3]
        impulse += sign * record[GIVEN : GIVEN + 3]
        tangential -= sign * (h[TANGENTIAL] * t + h[TANGENTIAL + 1] * np.cross(n, t))
        normal += float(h[NORMAL])
        if h[OVERLAP] >= deepest:
            deepest, history = float(h[OVERLAP]), h.copy()
    force = impulse / dt if dt > 0.0 else np.zeros(3)
    return ContactState(
        len(records) > 0, deepest, normal, tangential, impulse, force, history, couple.a.key, couple.b.key
    )
