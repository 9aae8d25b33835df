"""What the contacts of a running model do: forces, histories, ledgers, and the motion that is still owed."""

# The wheel describes little of what it exports.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from contactlaw.kernels import contact, scene
from contactlaw.laws.record import OPEN
from contactlaw.mujoco_plugin import block as b
from contactlaw.mujoco_plugin import layout
from contactlaw.mujoco_plugin.shapes import in_order
from contactlaw.mujoco_plugin.system import Member, members

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
        duration_over_step: Time scale of the fastest contact over the engine's step.
        normal_work, tangential_work: Work that the motions along and across the normal have done on the contacts [J]:
            lost to damping and friction, but for what is stored in contacts that still touch.
    """

    impacts: int
    greatest_overlap: float
    greatest_force: float
    time_in_contact: float
    duration_over_step: float
    normal_work: float
    tangential_work: float


def contacts_of(model: mujoco.MjModel, data: mujoco.MjData, name: str) -> list[ContactState]:
    """The contacts of an instance that touch or touched in the last step.

    MuJoCo's own readings (`data.contact`, `mj_contactForce`, touch sensors) do not have them: they hold what its
    constraint solver does, and the law acts before it, as a passive force.

    Args:
        model, data: The compiled model and its state.
        name: Of the plugin instance, as `add_contact` returned it or the XML has it.

    Raises:
        ValueError: The model has no such contact.
    """
    member = _member(model, name)
    out = []
    dt = float(model.opt.timestep)
    for record in _records(member, data):
        h = record[scene.HISTORY :]
        one, two = member.pairs[int(record[scene.KEY]) // scene.MOST_SLOTS]
        sign = 1.0 if in_order(member.shapes[one], member.shapes[two]) else -1.0
        normal, tangent = h[contact.DIRECTION : contact.DIRECTION + 3], h[contact.TANGENT : contact.TANGENT + 3]
        f, g = h[contact.TANGENTIAL : contact.TANGENTIAL + 2]
        impulse = sign * record[scene.GIVEN : scene.GIVEN + 3]
        out.append(
            ContactState(
                one, two, bool(h[contact.PHASE] != OPEN), float(h[contact.OVERLAP]), sign * normal,
                float(h[contact.NORMAL]), -sign * (f * tangent + g * np.cross(normal, tangent)), impulse, impulse / dt,
            )
        )  # fmt: skip
    return out


def ledger_of(model: mujoco.MjModel, data: mujoco.MjData, name: str) -> Ledger:
    """The ledger of an instance that was asked to keep one; arguments as for `contacts_of`."""
    member = _member(model, name)
    if not member.contact.ledger:
        raise ValueError(f"name = {name!r}: keeps no ledger; ask for one with add_contact(..., ledger=True)")
    state = _state(member, data)
    entries = state[b.LEDGER_STATE : b.LEDGER_STATE + b.LEDGER_SIZE]
    shortest = float(entries[b.SHORTEST])
    return Ledger(
        int(entries[b.IMPACTS]), float(entries[b.OVERLAP]), float(entries[b.FORCE]), float(entries[b.TIME]),
        shortest / float(model.opt.timestep) if shortest else np.inf, float(entries[b.NORMAL_WORK]),
        float(entries[b.TANGENTIAL_WORK]),
    )  # fmt: skip


def contact_history(model: mujoco.MjModel, data: mujoco.MjData, name: str) -> Array:
    """What the law remembers of the contacts of an instance, a view into `data.plugin_state`.

    Returns:
        Shape (n, entries), as `contactlaw.kernels.contact` lays it out (`OVERLAP`, `NORMAL`, `TANGENTIAL`, ...), for
        the n contacts there is room for; those that touch come first, the rest are zero.
    """
    member = _member(model, name)
    start = b.records_at(member.contact.ledger)
    return _state(member, data)[start:].reshape(member.room, member.record_size)[:, scene.HISTORY :]


def owed_velocity(model: mujoco.MjModel, data: mujoco.MjData) -> Array:
    """Generalized velocity (nv) that the contacts of the last step still owe.

    An impulse that falls within a step is given in two shares, so that position and momentum both are right: one in
    that step, one in the next. Between the two `data.qvel` lacks this. (It is MuJoCo's convention besides that qvel is
    the velocity half a step before qpos.) Zero in free flight and after the step that follows a contact.
    """
    total = np.zeros(model.nv)
    for number in members(layout.ModelView(model._address)):
        member = Member(layout.ModelView(model._address), number)
        for record in _records(member, data):
            owed = record[scene.OWED : scene.OWED + 3]
            pair = member.pairs[int(record[scene.KEY]) // scene.MOST_SLOTS]
            if not in_order(*(member.shapes[geom] for geom in pair)):
                pair = pair[::-1]
            for side, geom in enumerate(pair):
                turns, stays = record[scene.POINTS + 6 * side : scene.POINTS + 6 * side + 6].reshape(2, 3)
                point = data.geom_xpos[geom] + data.geom_xmat[geom].reshape(3, 3) @ turns + stays
                body = int(model.geom_bodyid[geom])
                mujoco.mj_applyFT(model, data, (1 - 2 * side) * owed, np.zeros(3), point, body, total)
    velocity = np.zeros((1, model.nv))
    mujoco.mj_solveM(model, data, velocity, total[None])
    return velocity[0]


def _member(model: mujoco.MjModel, name: str) -> Member:
    number = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_PLUGIN, name)
    view = layout.ModelView(model._address)
    if number < 0 or number not in members(view):
        raise ValueError(f"name = {name!r}: must be the name of a plugin instance of the model")
    return Member(view, number)


def _state(member: Member, data: mujoco.MjData) -> Array:
    start = int(data.model.plugin_stateadr[member.number])
    return data.plugin_state[start : start + member.state_size]


def _records(member: Member, data: mujoco.MjData) -> Array:
    """The records in the state, but for those of a damaged one that are no numbers or lead to no pair."""
    state, start = _state(member, data), b.records_at(member.contact.ledger)
    records, count = state[start:].reshape(member.room, member.record_size), state[b.COUNT]
    if not 0.0 <= count <= member.room:
        return records[:0]
    records = records[: int(count)]
    key = records[:, scene.KEY]
    return records[np.isfinite(records).all(axis=1) & (key >= 0.0) & (key < scene.MOST_SLOTS * len(member.pairs))]
