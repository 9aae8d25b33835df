"""What a user changes of contacts while they run."""

# The wheel describes little of what it exports.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from contactlaw import checks
from contactlaw.laws.record import PAIR as LAW_PAIR
from contactlaw.mujoco_plugin.readout import record_at, world_of
from contactlaw.world.records import BODY, CONTACT, PAIR, WORLD


def set_friction(model: mujoco.MjModel, data: mujoco.MjData, name: str, friction: float) -> None:
    """Give the contacts of an instance another coefficient of friction, from the next step on.

    It is kept by this `MjData` alone, through resets and restored states; copies and new ones have that of the model.

    Args:
        model, data: The compiled model and its state.
        name: Of the plugin instance, see `instances_of`.
        friction: Coefficient, >= 0.

    Raises:
        ValueError: A value outside what is allowed, or no such instance.
    """
    mu = checks.not_negative("friction", friction)
    number, head = world_of(model, data, name)
    frictions = given_frictions(head)
    frictions[record_at(int(head["instances"]), np.dtype(np.int64), frictions.size) == number] = mu
    give_frictions(head, frictions)


def given_frictions(head: Any) -> NDArray[np.float64]:
    """Coefficients that pairs of the world of a block have been given, a view; NaN: that of the model."""
    world = record_at(int(head["world"]), WORLD, 1)[0]
    return record_at(int(head["frictions"]), np.dtype(np.float64), int(world["pair_count"]))


def give_frictions(head: Any, frictions: NDArray[np.float64]) -> None:
    """Give the pairs of the world of a block these coefficients, but for NaN."""
    world = record_at(int(head["world"]), WORLD, 1)[0]
    pairs = record_at(int(world["pairs"]), PAIR, frictions.size)
    given_frictions(head)[:] = frictions
    for pair in np.flatnonzero(~np.isnan(frictions)):
        record_at(int(world["numbers"]) + 8 * int(pairs["numbers"][pair]), LAW_PAIR, 1)["friction"] = frictions[pair]
    contacts = record_at(int(world["contacts"]), CONTACT, int(world["contact_room"]))
    own = frictions[contacts["pair"]]
    contacts["touch"]["friction"] = np.where(np.isnan(own), contacts["touch"]["friction"], own)
    record_at(int(world["bodies"]), BODY, int(world["body_count"]))["held"] = np.nan  # who sleeps looks again
