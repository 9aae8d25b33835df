"""Sums over the contacts of a pair of materials: impacts, overlap, force, time, work."""

from dataclasses import dataclass

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


def ledger(pairs: Array, contacts: Array, number: int) -> Ledger:
    """Return the ledger of the pair with this number: of its contacts that have parted, and of present ones."""
    touches, deepest, strongest, duration, normal, across = pairs["ledger"][number]
    rows = contacts[(contacts["phase"] != FREE) & (contacts["pair"] == number)]
    return Ledger(
        int(touches + rows["touches"].sum()), float(max([deepest, *rows["deepest"]])),
        float(max([strongest, *rows["strongest"]])), float(duration + rows["duration"].sum()),
        float(-normal - rows["normal_work"].sum()), float(-across - rows["friction_work"].sum()),
    )  # fmt: skip
