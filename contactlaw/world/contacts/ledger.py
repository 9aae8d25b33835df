"""Sums over the contacts of a pair of materials: impacts, overlap, force, time, work."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contactlaw.world.data.records import FREE, Array


@dataclass(frozen=True)
class Ledger:
    """Sums over contacts: in MuJoCo since the model was reset, in PyBullet since the contacts were added.

    Attributes:
        impacts: Number of touches.
        greatest_overlap: [m].
        greatest_force: Greatest normal force [N].
        time_in_contact: Sum over the contacts [s].
        normal_work, tangential_work: Work that the motions along and across the normal have done on the contacts [J]:
            energy lost to damping and friction, and energy stored in contacts that are still closed.
    """

    impacts: int
    greatest_overlap: float
    greatest_force: float
    time_in_contact: float
    normal_work: float
    tangential_work: float


def ledger(pairs: Array, contacts: Array, numbers: Array) -> Ledger:
    """Return the ledger of the pairs with these numbers: of their contacts that have parted, and of present ones."""
    own = pairs["ledger"][numbers]
    (touches, _, _, duration, normal, across), (_, deepest, strongest, *_) = own.sum(0), own.max(0)
    rows = contacts[(contacts["phase"] != FREE) & np.isin(contacts["pair"], numbers)]
    return Ledger(
        int(touches + rows["touches"].sum()), float(max([deepest, *rows["deepest"]])),
        float(max([strongest, *rows["strongest"]])), float(duration + rows["duration"].sum()),
        float(-normal - rows["normal_work"].sum()), float(-across - rows["friction_work"].sum()),
    )  # fmt: skip
