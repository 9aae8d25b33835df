"""The world that the contacts of a callback make: its bodies, shapes and pairs, and what is exchanged with PyBullet."""

from __future__ import annotations

import struct
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np
import pybullet as p

from contactlaw.pybullet_callback.contact import Contact, Couple
from contactlaw.pybullet_callback.exchange import HEAD, JOB, MOTION, ROW, press, receive
from contactlaw.pybullet_callback.measure import Measured
from contactlaw.pybullet_callback.shapes import Key
from contactlaw.world import World
from contactlaw.world.arrays import with_more_room
from contactlaw.world.frames import ALIKE
from contactlaw.world.records import FREE, Arrays
from contactlaw.world.shapes import tangent
from contactlaw.world.step import step

PACKED = struct.Struct(f"{MOTION.itemsize // 8}d")
NUMBERS = struct.Struct(f"{JOB}d")
CROWD_SUBSTEPS = 60


class Saved(NamedTuple):
    """What a restart needs."""

    keys: tuple[Key, ...]
    handles: tuple[int, ...]
    arrays: Arrays
    rows: np.ndarray
    seen: np.ndarray


class Scene:
    """What contacts of the law look like to the world.

    Args:
        client: Physics client id.
        contacts: By handle.
        old: The scene before; what it remembers of contacts that are still there is taken over.
    """

    def __init__(self, client: int, contacts: Mapping[int, Contact], old: Scene | None = None) -> None:
        self._client, self.handles = client, list(contacts)
        sides = {side.key: side for contact in contacts.values() for side in (*contact.a, *contact.b)}
        before = old.keys if old else []
        self.keys = [key for key in before if key in sides] + [key for key in sides if key not in before]
        self.row = {key: row for row, key in enumerate(self.keys)}
        most = max([contact.substeps for contact in contacts.values()], default=100)
        self.world = World(0.0, substeps=most, crowd_substeps=min(most, CROWD_SUBSTEPS), stillness=1e-6)
        self.shapes: dict[Any, list[int]] = {}
        self.measured: list[Measured] = []
        for key in self.keys:
            self.shapes[key] = sides[key].add_to(self.world, self.world.add_body(np.inf, 1.0))
        for contact in contacts.values():
            self._let_touch(contact)
        self.couples: dict[frozenset[int], tuple[int, Couple]] = {
            frozenset((self.row[couple.a.key], self.row[couple.b.key])): (handle, couple)
            for handle, contact in contacts.items()
            for couple in contact.couples
        }
        self.rows = np.zeros(len(self.keys), ROW)
        self.jobs = np.zeros((max(len(self.keys), 1), JOB))
        self.head = np.zeros(1, HEAD)
        self.rows["left"]["position"] = np.nan
        self._bind(self.world.arrays)
        self.weigh()
        if old:
            self._take_over(old)
        self._offset = {name: int(ROW.fields[name][1]) for name in ("before", "after")}  # type: ignore[index]

    def _let_touch(self, contact: Contact) -> None:
        """Sets meet as sets; what PyBullet must measure has a plane for each sphere that may touch it."""
        plain = [couple for couple in contact.couples if not couple.measured]
        for couple in contact.couples:
            if couple.measured:
                one, other = couple.sides
                ends = self.shapes[one.key][-2:]  # of a capsule, without its side
                row = self.row[other.key]
                planes = [self.world._shape(tangent(row + 1, end, other.reach)) for end in ends]
                self.world.add_contact(ends, planes, contact.pair)
                self.measured.append(Measured(one, other, self.row[one.key], row, ends, planes))
        if plain:
            sets = ({s for couple in plain for s in self.shapes[couple.ends[end].key]} for end in (0, 1))
            self.world.add_contact(*sets, contact.pair)

    def _bind(self, arrays: Arrays) -> None:
        """Let the compiled code know where the arrays are."""
        self.world._arrays = arrays.bound()
        self.state = arrays.world
        self.seen = np.zeros(arrays.contacts.size)
        head = self.head
        head["world"], head["rows"], head["jobs"] = (a.ctypes.data for a in (self.state, self.rows, self.jobs))
        head["seen"], head["count"] = self.seen.ctypes.data, len(self.keys)

    @property
    def arrays(self) -> Arrays:
        """Those of the world."""
        return self.world.arrays

    def weigh(self) -> None:
        """Read masses and inertias."""
        there = {p.getBodyUniqueId(i, self._client) for i in range(p.getNumBodies(self._client))}
        for row, (body, link) in zip(self.rows, self.keys, strict=True):
            info = p.getDynamicsInfo(body, link, self._client) if body in there else [0.0, 0.0, (0.0, 0.0, 0.0)]
            row["mass"], row["inertia"] = info[0], info[2]
        own = self.arrays.bodies[1:]
        mass, inertia = self.rows["mass"], self.rows["inertia"]
        with np.errstate(divide="ignore"):
            own["inverse_mass"] = np.where(mass > 0.0, 1.0 / mass, 0.0)
            own["inverse_inertia"] = np.where((mass[:, None] > 0.0) & (inertia > 0.0), 1.0 / inertia, 0.0)
        own["isotropic"] = np.ptp(inertia, axis=1) <= ALIKE * inertia.max(axis=1, initial=0.0)
        own["oriented"] |= 1 - own["isotropic"]
        self.state["stale"] = 1

    def read(self, when: str, rows: Iterable[tuple[int, Key]]) -> None:
        """Where bodies are and how they move, into the rows."""
        client, buffer, pack, offset = self._client, self.rows, PACKED.pack_into, self._offset[when]
        pose, velocity, size = p.getBasePositionAndOrientation, p.getBaseVelocity, ROW.itemsize
        for row, (body, _) in rows:
            (x, q), (v, w) = pose(body, client), velocity(body, client)
            pack(buffer, size * row + offset, *x, *q, *v, *w)

    def step(self, dt: float) -> None:
        """Move the world."""
        while step(self.state, dt, 1) == 0:
            seen = self.seen
            self._bind(with_more_room(self.arrays))
            self.seen[: seen.size] = seen

    def _take_over(self, old: Scene) -> None:
        """What is remembered of contacts and bodies that are there still."""
        mine, theirs = self.arrays, old.arrays
        for key in self.keys:
            if key in old.row:
                i, j = self.row[key], old.row[key]
                self.rows[i] = old.rows[j]
                for name in ("asleep", "held", "momentum", "position", "quaternion", "axes"):
                    mine.bodies[i + 1][name] = theirs.bodies[j + 1][name]
        numbers: dict[int, int] = {}
        for key, shapes in old.shapes.items():
            if key in self.shapes:
                numbers.update(zip(shapes, self.shapes[key], strict=True))
        for slot in np.flatnonzero(theirs.contacts["phase"] != FREE):
            c = theirs.contacts[slot]
            a, b = numbers.get(int(c["shape_a"])), numbers.get(int(c["shape_b"]))
            if a is None or b is None:
                continue
            pair = mine.groups[mine.shapes["group"][a], mine.shapes["group"][b]]
            if pair < 0:
                continue
            if mine.world["spares"][0] == 0:
                mine = with_more_room(mine)
                self._bind(mine)
            mine.world["spares"] -= 1
            new = int(mine.spare[mine.world["spares"][0]])
            mine.contacts[new] = c
            own = mine.contacts[new]
            own["shape_a"], own["shape_b"], own["pair"], own["near"] = a, b, pair, -1
            own["body_a"], own["body_b"] = mine.shapes["body"][a], mine.shapes["body"][b]
            size = min(mine.memory.shape[1], theirs.memory.shape[1])
            mine.memory[new, :size] = theirs.memory[slot, :size]
            self.seen[new] = 1.0
        mine.world["stale"] = 1
