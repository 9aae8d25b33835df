"""Contacts of a world, their ledger and what is doubtful about them; energy and momentum."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from contactlaw.jit import jit
from contactlaw.pair import DEEPEST, FOUND_IN, PASSING, TOO_DEEP
from contactlaw.world.contacts.force import stored_energy
from contactlaw.world.contacts.substep import TOUCHING
from contactlaw.world.data.access import contact_at, pair_at
from contactlaw.world.data.records import CLOSED, FREE, Array, Arrays
from contactlaw.world.data.tree import AXIS
from contactlaw.world.shapes.curvature import UNCLEAR, radius_is_clear
from contactlaw.world.shapes.geometry import IGNORED
from contactlaw.world.trees.tree_records import numbers

READOUT = np.dtype([
    ("shapes", "i8", 2), ("bodies", "i8", 2), ("closed", "?"), ("overlap", "f8"), ("point", "f8", 3),
    ("normal", "f8", 3), ("force", "f8", 3), ("moment", "f8", 3), ("impulse", "f8", 3),
    ("normal_work", "f8"), ("friction_work", "f8"), ("deepest", "f8"), ("strongest", "f8"), ("duration", "f8"),
    ("touches", "i8"),
])  # fmt: skip


class Energy(NamedTuple):
    """Energy of a world [J]: kinetic, gravitational, and elastic in contacts as the last step has left them."""

    kinetic: float
    potential: float
    elastic: float

    @property
    def total(self) -> float:
        """Sum of all [J]."""
        return self.kinetic + self.potential + self.elastic


def contacts(world: Arrays) -> Array:
    """Return the contacts that are closed or were in the last step, one row each."""
    rows = world.contacts[world.contacts["phase"] != FREE]
    out = np.zeros(rows.size, READOUT)
    for k, side in enumerate("ab"):
        out["shapes"][:, k], out["bodies"][:, k] = rows[f"shape_{side}"], rows[f"body_{side}"] - 1
    out["closed"] = rows["phase"] == CLOSED
    out["overlap"] = np.maximum(rows["touch"]["overlap"], 0.0) * out["closed"]
    out["point"] = world.bodies["position"][rows["body_a"]] + rows["arm_a"]
    out["force"], out["moment"] = rows["force"], moments(rows)
    for name in ("normal", "impulse", "normal_work", "friction_work", "deepest", "strongest", "duration", "touches"):
        out[name] = rows[name]
    return out


def moments(rows: Array) -> Array:
    """Return the moments of contacts on A [N m], shape (n, 3): torsion and rolling resistance; rows: their records."""
    about = rows["torsion"]["moment"], *rows["bending"].T  # the normal and both axes of the ellipse
    axes = rows["normal"], rows["axis"], np.cross(rows["normal"], rows["axis"])
    return -np.einsum("kn,knj->nj", about, axes)


def mean_impulses(bodies: Array, rows: Array, dt: float) -> Array:
    """Return the impulses on A of contacts over the last step dt [N s], shape (n, 3); one that sleeps keeps its force.

    bodies, rows: records of all bodies, and of the contacts.
    """
    sleeps = (bodies["asleep"][rows["body_a"]] != 0) | (bodies["asleep"][rows["body_b"]] != 0)
    return np.where(sleeps[..., None], dt * rows["force"], rows["impulse"] - rows["earlier"])


def energy(world: Arrays, gravity: Array) -> Energy:
    """Return the energy of a world whose arrays are bound; the potential one is zero at the origin."""
    b = world.bodies[world.bodies["inverse_mass"] > 0.0]
    mass = 1.0 / b["inverse_mass"]
    axes = b["axes"].reshape(-1, 3, 3)
    spin = np.einsum("nij,ni->nj", axes, b["spin"])
    kinetic = 0.5 * mass @ (b["velocity"] ** 2).sum(1) + 0.5 * (spin**2 / b["inverse_inertia"]).sum()
    for number in range(world.trees.size):
        armature = numbers(world, number, "axes").view(AXIS)["armature"]
        kinetic += 0.5 * armature @ numbers(world, number, "v") ** 2
    potential = -mass @ (b["position"] @ gravity)
    return Energy(float(kinetic), float(potential), float(_elastic(world.world)))


@jit
def _elastic(world):
    """Return the elastic energy [J] of all closed contacts."""
    w, out = world[0], 0.0
    for slot in range(w.slots):
        c = contact_at(w.contacts, slot)
        if c.phase == CLOSED:
            out += stored_energy(w, c, slot)
    return out


def momentum(world: Arrays) -> tuple[Array, Array]:
    """Return linear [N s] and angular [N m s] momentum, about the origin, of all bodies of finite mass."""
    b = world.bodies[world.bodies["inverse_mass"] > 0.0]
    linear = b["velocity"] / b["inverse_mass"][:, None]
    axes = b["axes"].reshape(-1, 3, 3)
    along = np.einsum("nij,ni->nj", axes, b["spin"]) / b["inverse_inertia"]
    own = np.einsum("nij,nj->ni", axes, along)
    return linear.sum(0), (np.cross(b["position"], linear) + own).sum(0)


@dataclass(frozen=True)
class Ledger:
    """Sums over contacts: in MuJoCo since the model was reset, else since the contacts were added.

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
    """Return the ledger of the pair of materials with this number: of contacts that have parted, and present ones."""
    touches, deepest, strongest, duration, normal, across = pairs["ledger"][number]
    rows = contacts[(contacts["phase"] != FREE) & (contacts["pair"] == number)]
    return Ledger(
        int(touches + rows["touches"].sum()), float(max([deepest, *rows["deepest"]])),
        float(max([strongest, *rows["strongest"]])), float(duration + rows["duration"].sum()),
        float(-normal - rows["normal_work"].sum()), float(-across - rows["friction_work"].sum()),
    )  # fmt: skip


DEEP, PUT_IN, UNCLEAR_RADIUS, PASSES_THROUGH = DOUBTS = 1, 2, 4, 8
DOUBTFUL = {DEEP: TOO_DEEP, PUT_IN: FOUND_IN, UNCLEAR_RADIUS: UNCLEAR, PASSES_THROUGH: PASSING}
"""Warnings; {} stands for `doubt_value`."""


@jit
def doubts_of(w, c):
    """Return the bits of what is doubtful about a contact: an overlap too deep for Hertz, one taken off, its radius."""
    bits = DEEP if c.deepest > DEEPEST * c.touch.radius else 0
    if c.initial_overlap > TOUCHING * c.touch.radius and c.appeared == 0:
        bits |= PUT_IN if c.initial_overlap < IGNORED else PASSES_THROUGH
    given = pair_at(w.pairs, c.pair).radius > 0.0
    return bits if given or radius_is_clear(w, c) else bits | UNCLEAR_RADIUS


@jit
def doubt_value(c, bit):
    """Return the number that the warning of a doubt gives."""
    radius = c["touch"]["radius"]
    return radius if bit == UNCLEAR_RADIUS else (c["deepest"] if bit == DEEP else c["initial_overlap"]) / radius
