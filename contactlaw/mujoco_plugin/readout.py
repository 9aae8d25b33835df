"""Readout of a running model: contact forces, ledgers, wrenches on bodies, overlaps; and a change of friction."""

import ctypes
from dataclasses import dataclass
from typing import Any
from weakref import WeakKeyDictionary

import mujoco
import numpy as np

from contactlaw import checks
from contactlaw.losses import OverSpeed
from contactlaw.mujoco_plugin import layout
from contactlaw.mujoco_plugin.block import HEAD
from contactlaw.mujoco_plugin.geoms import offer
from contactlaw.mujoco_plugin.instances import ContactInstance, contact_instances
from contactlaw.mujoco_plugin.layout import record_at
from contactlaw.world.data.records import BODY, CLOSED, CONTACT, FREE, PAIR, SHAPE, WORLD, Array
from contactlaw.world.readout import Ledger, ledger, mean_impulses, moments

_LOOK = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int)
Overlap = tuple[int, int, float]
STUCK, SLIDING = 0.01, 1e-6  # tangential force over mu P: below the first; above 1 less the second


@dataclass(frozen=True, eq=False)
class ContactState:
    """A contact after the last step.

    Attributes:
        geom1, geom2: Ids of the geoms.
        touching: Whether they touch at the end of the step; if not, they touched within it.
        overlap: At the end of the step [m].
        normal: Unit vector from geom2 to geom1, shape (3,).
        normal_force: At the end of the step [N].
        tangential_force: On geom1 at the end of the step, world frame [N], shape (3,).
        impulse: On geom1 over the last step, world frame [N s], shape (3,).
        force: Mean force over the step, impulse over time step [N], shape (3,): the reading of a force sensor.
        point: Point of contact, world frame [m], shape (3,).
        contact_radius: Radius of the contact patch, sqrt(R overlap) [m].
        slip: Of the patch at the end of the step: "stuck" (tangential force below 1 % of mu P), "partly", "sliding".
        stick_radius: Radius of the region that sticks [m], a (1 - F/(mu P))^(1/3) after Cattaneo and Mindlin for a
            force that has grown in one direction; after other histories the region is larger.
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
    point: Array
    contact_radius: float
    slip: str
    stick_radius: float


def instances_of(model: mujoco.MjModel) -> list[str]:
    """Return the names of the contacts in a compiled model, for `contacts_of` and `ledger_of`."""
    return [one.name for one in _contacts(model)]


def contacts_of(model: mujoco.MjModel, data: mujoco.MjData, name: str | None = None) -> list[ContactState]:
    """Return the contacts of the law, or of one plugin instance, that touch or touched in the last step.

    MuJoCo's own readings (`data.contact`, `mj_contactForce`) do not include them, as they come from its constraint
    solver. After a state has been set, only contacts that touch in it are known.

    Args:
        model, data: The compiled model and its state.
        name: Name of the plugin instance, as `add_contact` returned it or the XML has it; None: all, one after another.

    Raises:
        ValueError: The model has no such contact.
    """
    world, known = view_of(model, data), _contacts(model)
    rows, out, dt = world.contacts[world.contacts["phase"] != FREE], list[ContactState](), float(model.opt.timestep)
    rows = rows if name is None else rows[rows["pair"] == _number_of(model, name)]
    if not rows.size:
        return out
    rows = rows[np.lexsort((rows["shape_b"], rows["shape_a"], rows["pair"]))]
    points, impulses = world.bodies["position"][rows["body_a"]] + rows["arm_a"], mean_impulses(world.bodies, rows, dt)
    for row, impulse, point in zip(rows, impulses, points, strict=True):
        one, two = (int(world.geoms[row[shape]]) for shape in ("shape_a", "shape_b"))
        sign, normal, touch = 1.0, row["normal"].copy(), row["touch"]
        if known[row["pair"]].sets.reversed(one, two):
            one, two, sign = two, one, -1.0
        across = row["force"] - (row["force"] @ normal) * normal
        radius = float(np.sqrt(max(touch["radius"] * touch["overlap"], 0.0)))
        most = float(touch["friction"] * touch["force"])
        share = min(float(np.linalg.norm(across)) / most, 1.0) if most > 0.0 else 1.0
        out.append(
            ContactState(
                one, two, bool(row["phase"] == CLOSED), float(touch["overlap"]), sign * normal, float(touch["force"]),
                sign * across, sign * impulse, sign * impulse / dt, point, radius,
                "stuck" if share < STUCK else "partly" if share < 1.0 - SLIDING else "sliding",
                radius * float(1.0 - share) ** (1.0 / 3.0),
            )
        )  # fmt: skip
    return out


def ledger_of(model: mujoco.MjModel, data: mujoco.MjData, name: str) -> Ledger:
    """Return the ledger of an instance; arguments and errors as for `contacts_of`."""
    world = view_of(model, data)
    return ledger(world.pairs, world.contacts, _number_of(model, name))


def contact_wrenches(model: mujoco.MjModel, data: mujoco.MjData) -> Array:
    """Return the mean wrench of the law's contacts on each body over the last step, as in `data.cfrc_ext`.

    Shape (nbody, 6): moment [N m], then force [N], along the world's axes, about the centre of mass of the kinematic
    tree (`data.subtree_com[model.body_rootid]`); zero for the world. Observations that use `cfrc_ext`, which has the
    engine's own contacts and applied forces, need the sum of both.
    """
    world, out = view_of(model, data), np.zeros((model.nbody, 6))
    rows = world.contacts[world.contacts["phase"] != FREE]
    geoms, centres = world.geoms[rows["shape_a"]], world.centres[rows["shape_a"]]
    turns = data.geom_xmat[geoms].reshape(-1, 3, 3)
    points = data.geom_xpos[geoms] + np.einsum("nij,nj->ni", turns, centres) + rows["arm_a"]  # when subtree_com was so
    forces = mean_impulses(world.bodies, rows, model.opt.timestep) / model.opt.timestep
    for shape, sign in (("shape_a", 1.0), ("shape_b", -1.0)):
        bodies = model.geom_bodyid[world.geoms[rows[shape]]]
        arms = points - data.subtree_com[model.body_rootid[bodies]]
        np.add.at(out, bodies, sign * np.hstack([np.cross(arms, forces) + moments(rows), forces]))
    out[0] = 0.0
    return out


_CONTACTS: WeakKeyDictionary[mujoco.MjModel, list[ContactInstance]] = WeakKeyDictionary()


def _contacts(model: mujoco.MjModel, *states: mujoco.MjData) -> list[ContactInstance]:
    """Return the contacts of a model, which stay the same and are found once."""
    view = layout.view_of(model, *states)
    if model not in _CONTACTS:
        _CONTACTS[model] = [ContactInstance(view, number) for number in contact_instances(view)]
    return _CONTACTS[model]


class View:
    """Arrays of the world of an mjData; head: of its block. data: the owner, which must live as long as the arrays."""

    def __init__(self, head: Any, data: Any = None) -> None:
        self.world: Any = record_at(head["world"], WORLD, 1)[0] if head["world"] else np.zeros(1, WORLD)[0]
        self.data, world = data, self.world
        self.contacts = record_at(world["contacts"], CONTACT, world["contact_room"])
        self.bodies = record_at(world["bodies"], BODY, world["body_count"])
        self.pairs = record_at(world["pairs"], PAIR, world["pair_count"])
        self.shapes = record_at(world["shapes"], SHAPE, world["shape_count"])
        count = int(world["group_count"])
        self.groups = record_at(world["groups"], np.int64, count * count).reshape(count, count)
        self.geoms = record_at(head["geoms"], np.int64, world["shape_count"])
        self.centres = record_at(head["centres"], np.float64, 3 * world["shape_count"]).reshape(-1, 3)


def _number_of(model: mujoco.MjModel, name: Any) -> int:
    """Return the number of a contact and of its pair."""
    there = instances_of(model)
    if not isinstance(name, str) or name not in there:
        nearest = offer(str(name), there)
        raise ValueError(f"name = {name!r}: must be the name of a plugin instance of the model; {nearest}")
    return there.index(name)


def view_of(model: mujoco.MjModel, data: mujoco.MjData) -> View:
    """Return the view of an mjData, after its world has been brought to `data.plugin_state` if that was set."""
    known = _contacts(model, data)
    if not known:
        return View(np.zeros(1, HEAD)[0])
    from contactlaw.mujoco_plugin import callbacks  # which can be compiled only once the plugin is registered

    _LOOK(callbacks.ADDRESSES["look"])(model._address, data._address, known[0].number)
    head = record_at(data.plugin_data[known[0].number], HEAD, 1)[0]
    head["calm"] = 0  # the caller may change something, such as friction
    return View(head, data)


def set_friction(model: mujoco.MjModel, data: mujoco.MjData, name: str, friction: float) -> None:
    """Set the friction coefficient of the contacts of an instance, from the next step on.

    This `MjData` alone keeps it, through resets and restored states; copies and new ones have the model's coefficient.

    Args:
        model, data, name: As for `contacts_of`, but one instance.
        friction: Coefficient, >= 0.

    Raises:
        ValueError: A value outside what is allowed, no such instance, or one whose friction depends on speed.
    """
    mu = checks.not_negative("friction", friction)
    world, number = view_of(model, data), _number_of(model, name)
    if isinstance(_contacts(model)[number].contact.pair.friction, OverSpeed):
        raise ValueError(f"name = {name!r}: its friction is a curve over speed; must be of a pair with a number")
    world.pairs["friction"][number] = mu
    for own in ("friction", "mu"):  # the first is what spin leaves of the second
        world.contacts["touch"][own][world.contacts["pair"] == number] = mu
    world.bodies["held"] = np.nan  # sleeping bodies check again whether they may sleep


def overlaps_of(model: mujoco.MjModel, data: mujoco.MjData) -> list[Overlap]:
    """Return the geoms of the law that overlap in `data`: (id, id, depth [m]), deepest first.

    An environment that draws initial positions until `data.ncon` is zero does not see these contacts. After `data.qpos`
    has been set, call mj_kinematics (or mj_forward) first.
    """
    world, out = view_of(model, data), list[Overlap]()
    geoms, first = np.unique(world.geoms, return_index=True)
    shapes = world.shapes[first]
    reach = np.where(model.geom_rbound > 0.0, model.geom_rbound, np.inf)[geoms]  # planes have none
    places = data.geom_xpos[geoms]
    for i, geom in enumerate(geoms.tolist()):
        near = np.linalg.norm(places - places[i], axis=1) < reach + reach[i]
        near &= (world.groups[shapes["group"][i], shapes["group"]] >= 0) & (shapes["body"] != shapes["body"][i])
        near[:i] = False
        for two in geoms[near].tolist():
            out.append((geom, two, -mujoco.mj_geomDistance(model, data, geom, two, 0.0, None)))
    return sorted((entry for entry in out if entry[2] > 0.0), key=lambda entry: (-entry[2], entry[:2]))
