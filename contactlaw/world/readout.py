"""Contacts, energy and momentum of a world."""

from typing import NamedTuple

import numpy as np

from contactlaw.jit import jit
from contactlaw.world.contacts.force import stored_energy
from contactlaw.world.data.access import contact_at
from contactlaw.world.data.records import AXIS, CLOSED, FREE, Array, Arrays
from contactlaw.world.trees.coordinates import numbers

READOUT = np.dtype([
    ("shapes", "i8", 2), ("bodies", "i8", 2), ("closed", "?"), ("overlap", "f8"), ("point", "f8", 3),
    ("normal", "f8", 3), ("force", "f8", 3), ("moment", "f8"), ("impulse", "f8", 3),
    ("normal_work", "f8"), ("friction_work", "f8"), ("deepest", "f8"), ("strongest", "f8"), ("duration", "f8"),
    ("touches", "i8"),
])  # fmt: skip


class Energy(NamedTuple):
    """Energy of a world [J]: kinetic, gravitational, and elastic in contacts."""

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
    out["shapes"] = np.stack([rows["shape_a"], rows["shape_b"]], 1)
    out["bodies"] = np.stack([rows["body_a"], rows["body_b"]], 1) - 1
    out["closed"] = rows["phase"] == CLOSED
    out["overlap"] = np.maximum(rows["touch"]["overlap"], 0.0) * out["closed"]
    out["point"] = world.bodies["position"][rows["body_a"]] + rows["arm_a"]
    out["force"] = rows["force"]
    out["moment"] = -rows["torsion"]["moment"]
    for name in ("normal", "impulse", "normal_work", "friction_work", "deepest", "strongest", "duration", "touches"):
        out[name] = rows[name]
    return out


def mean_impulses(bodies: Array, rows: Array, dt: float) -> Array:
    """Return the impulses on A of contacts over the last step dt [N s], shape (n, 3); one that sleeps keeps its force.

    bodies, rows: records of all bodies, and of the contacts.
    """
    sleeps = (bodies["asleep"][rows["body_a"]] != 0) | (bodies["asleep"][rows["body_b"]] != 0)
    return np.where(sleeps[..., None], dt * rows["force"], rows["impulse"] - rows["earlier"])


def energy(world: Arrays) -> Energy:
    """Return the energy of a world; the potential one is zero at the origin."""
    pull = world.bodies["acceleration"].copy()
    for tree in world.trees:
        pull[tree["first"] : tree["first"] + tree["count"]] = tree["gravity"]
    massive = world.bodies["inverse_mass"] > 0.0
    b, pull = world.bodies[massive], pull[massive]
    mass = 1.0 / b["inverse_mass"]
    axes = b["axes"].reshape(-1, 3, 3)
    spin = np.einsum("nij,ni->nj", axes, b["spin"])
    kinetic = 0.5 * mass @ (b["velocity"] ** 2).sum(1) + 0.5 * (spin**2 / b["inverse_inertia"]).sum()
    for number in range(world.trees.size):
        armature = numbers(world, number, "axes").view(AXIS)["armature"]
        kinetic += 0.5 * armature @ numbers(world, number, "v") ** 2
    potential = -mass @ (b["position"] * pull).sum(1)
    return Energy(float(kinetic), float(potential), float(_elastic(world.bound().world)))


@jit
def _elastic(world):
    """Return the elastic energy [J] of all closed contacts."""
    w, out = world[0], 0.0
    for slot in range(w.contact_room):
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
