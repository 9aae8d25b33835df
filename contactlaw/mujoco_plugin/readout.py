"""What the contacts of a running model do: forces, and an account of what they have done."""

# The wheel describes little of what it exports.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from contactlaw.jit import jit
from contactlaw.mujoco_plugin import layout
from contactlaw.mujoco_plugin.block import HEAD, PUSH, TOKEN
from contactlaw.mujoco_plugin.members import Member, members
from contactlaw.mujoco_plugin.sets import Sets
from contactlaw.world.access import world_at
from contactlaw.world.records import BODY, CLOSED, CONTACT, FREE, PAIR, WORLD
from contactlaw.world.state import read

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ContactState:
    """A contact after the last step.

    Attributes:
        geom1, geom2: Ids of the geoms.
        touching: Whether they touch at the end of the step; if not, they did within it.
        overlap: At the end of the step [m].
        normal: From geom2 to geom1, unit vector, shape (3,).
        normal_force: At the end of the step [N].
        tangential_force: On geom1 at the end of the step, world frame [N], shape (3,).
        impulse: On geom1 over the last step, world frame [N s], shape (3,).
        force: Its mean over the step [N], shape (3,): what a force sensor would read.
    """

    geom1: int
    geom2: int
    touching: bool
    overlap: float
    normal: Array
    normal_force: float
    tangential_force: Array
    impulse: Array
    force: Array


@dataclass(frozen=True)
class Ledger:
    """What the contacts of an instance have done since the model was reset.

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


def contacts_of(model: mujoco.MjModel, data: mujoco.MjData, name: str) -> list[ContactState]:
    """The contacts of an instance that touch or touched in the last step.

    MuJoCo's own readings (`data.contact`, `mj_contactForce`, touch sensors) do not have them: they hold what its
    constraint solver does. What has been set to another state since the last step knows of those that touch alone.

    Args:
        model, data: The compiled model and its state.
        name: Of the plugin instance, as `add_contact` returned it or the XML has it.

    Raises:
        ValueError: The model has no such contact.
    """
    number, world = _world(model, data, name)
    dt = float(model.opt.timestep)
    out = []
    rows = world.contacts[(world.contacts["phase"] != FREE) & (world.instances[world.contacts["pair"]] == number)]
    for row in rows[np.lexsort((rows["shape_b"], rows["shape_a"]))]:
        one, two = (int(world.geoms[row[shape]]) for shape in ("shape_a", "shape_b"))
        sign, normal = 1.0, row["normal"].copy()
        if world.sets.reversed(one, two):
            one, two, sign = two, one, -1.0
        sleeps = world.asleep[row["body_a"]] or world.asleep[row["body_b"]]
        impulse = sign * (dt * row["force"] if sleeps else row["impulse"] - row["earlier"])
        across = row["force"] - (row["force"] @ normal) * normal
        touching = bool(row["phase"] == CLOSED)
        out.append(
            ContactState(
                one, two, touching, float(row["touch"]["overlap"]), sign * normal,
                float(row["touch"]["force"]), sign * across, impulse, impulse / dt,
            )
        )  # fmt: skip
    return out


def ledger_of(model: mujoco.MjModel, data: mujoco.MjData, name: str) -> Ledger:
    """The account of an instance; arguments and errors as for `contacts_of`."""
    number, world = _world(model, data, name)
    own = world.ledgers[world.instances == number]
    (touches, _, _, duration, normal, across), (_, deepest, strongest, *_) = own.sum(0), own.max(0)
    rows = world.contacts[(world.contacts["phase"] != FREE) & (world.instances[world.contacts["pair"]] == number)]
    return Ledger(
        int(touches + rows["touches"].sum()), float(max([deepest, *rows["deepest"]])),
        float(max([strongest, *rows["strongest"]])), float(duration + rows["duration"].sum()),
        float(-normal - rows["normal_work"].sum()), float(-across - rows["friction_work"].sum()),
    )  # fmt: skip


@jit
def _take_over(address, row):
    """Bring a world to a state that its own last step did not leave."""
    read(world_at(address, 0), row)


class _View:
    """The world of an mjData; sets: the geoms of one instance that may touch."""

    def __init__(self, head: Any, sets: Sets) -> None:
        self.sets = sets
        world = _at(int(head["world"]), WORLD, 1)[0]
        self.contacts = _at(int(world["contacts"]), CONTACT, int(world["contact_room"]))
        self.asleep = _at(int(world["bodies"]), BODY, int(world["body_count"]))["asleep"]
        self.ledgers = _at(int(world["pairs"]), PAIR, int(world["pair_count"]))["ledger"]
        self.instances = _at(int(head["instances"]), np.dtype(np.int64), len(self.ledgers))
        self.geoms = _at(int(head["geoms"]), np.dtype(np.int64), int(world["shape_count"]))


def _at(address: int, dtype: np.dtype, count: int) -> NDArray[Any]:
    size = dtype.itemsize * count
    return np.ctypeslib.as_array((ctypes.c_uint8 * size).from_address(address)).view(dtype)


def _world(model: mujoco.MjModel, data: mujoco.MjData, name: str) -> tuple[int, _View]:
    """Which contact of the model an instance is, and the world."""
    if data.signature != model.signature:
        raise ValueError("data: is of another model")
    known = members(layout.ModelView(model._address))
    number = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_PLUGIN, name)
    if number not in known:
        raise ValueError(f"name = {name!r}: must be the name of a plugin instance of the model")
    head = _at(int(data.plugin_data[known[0]]), HEAD, 1)[0]
    start = int(head["state"])
    state = data.plugin_state[start : start + int(head["own_size"])]
    if state[TOKEN] != head["token"]:
        _take_over(head["world"], state[PUSH + int(head["nv"]) :])
        head["token"] = state[TOKEN]
    return known.index(number), _View(head, Member(layout.ModelView(model._address), number).sets)
