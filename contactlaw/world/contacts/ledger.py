"""What contacts have done, as the adapters tell it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contactlaw.world.data.records import FREE, Array


@dataclass(frozen=True)
class Ledger:
    """What contacts have done: in MuJoCo since the model was reset, in PyBullet since they were added.

    Attributes:
        impacts: Touches begun.
        greatest_overlap: [m].
        greatest_force: Normal [N].
        time_in_contact: Summed over the contacts [s].
        normal_work, tangential_work: Work that the motions along and across the normal have done on the contacts [J]:
            lost to damping and friction, but for what is stored in contacts that still touch.
    """

    impacts: int
    greatest_overlap: float
    greatest_force: float
    time_in_contact: float
    normal_work: float
    tangential_work: float


def ledger(pairs: Array, contacts: Array, numbers: Array) -> Ledger:
    """That of some pairs of a world, by their numbers: of contacts that have parted, and of those that there are."""
    own = pairs["ledger"][numbers]
    (touches, _, _, duration, normal, across), (_, deepest, strongest, *_) = own.sum(0), own.max(0)
    rows = contacts[(contacts["phase"] != FREE) & np.isin(contacts["pair"], numbers)]
    return Ledger(
        int(touches + rows["touches"].sum()), float(max([deepest, *rows["deepest"]])),
        float(max([strongest, *rows["strongest"]])), float(duration + rows["duration"].sum()),
        float(-normal - rows["normal_work"].sum()), float(-across - rows["friction_work"].sum()),
    )  # fmt: skip
