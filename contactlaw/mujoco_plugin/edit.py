"""What a user changes of a model or its contacts while it runs."""

# The wheel describes little of what it exports.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import mujoco
import numpy as np

from contactlaw import checks
from contactlaw.laws.record import PAIR as LAW_PAIR
from contactlaw.mujoco_plugin.instance import renew
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
    world = record_at(int(head["world"]), WORLD, 1)[0]
    pairs = record_at(int(world["pairs"]), PAIR, int(world["pair_count"]))
    of_instance = record_at(int(head["instances"]), np.dtype(np.int64), pairs.size) == number
    for first in pairs["numbers"][of_instance]:
        record_at(int(world["numbers"]) + 8 * int(first), LAW_PAIR, 1)["friction"] = mu
    contacts = record_at(int(world["contacts"]), CONTACT, int(world["contact_room"]))
    contacts["touch"]["friction"][of_instance[contacts["pair"]]] = mu
    record_at(int(world["bodies"]), BODY, int(world["body_count"]))["held"] = np.nan  # who sleeps looks again


def reread(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Take masses, inertia, armature, sizes and places of geoms and bodies from the model as it is now.

    The law reads a model when an `MjData` is made. Where a user changes it later (domain randomisation), this must be
    called, after mj_setConst, for each `MjData`; contacts go on as they are, frictions are those of the model again.

    Raises:
        ValueError: The law cannot serve what the model is now; `data` is as it was.
    """
    renew(model._address, data._address)
