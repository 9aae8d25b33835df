"""The world that the contacts of a callback make: its bodies, shapes and pairs, and what is exchanged with PyBullet."""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
import pybullet as p

from contactlaw.pybullet_callback.contact import Contact, Couple
from contactlaw.pybullet_callback.exchange import HEAD, JOB, MOTION, ROW, compare, hand_back, press, receive, steady
from contactlaw.pybullet_callback.measure import Measured
from contactlaw.pybullet_callback.shapes import BASE, Key
from contactlaw.world import World
from contactlaw.world.arrays import with_more_room
from contactlaw.world.frames import ALIKE
from contactlaw.world.records import BOX, CLOSED, FREE, SEGMENT, Arrays
from contactlaw.world.shapes import tangent
from contactlaw.world.step import step

PACKED, NUMBERS = struct.Struct(f"{MOTION.itemsize // 8}d"), struct.Struct(f"{JOB}d")
GRAVITY, DT, WHOLE = struct.Struct("3d"), struct.Struct("d"), struct.Struct("q")
BEFORE, AFTER = (int(ROW.fields[name][1]) for name in ("before", "after"))  # type: ignore[index]
GRAVITY_AT, DT_AT, STRANGE_AT, PUSHED_AT = (
    int(HEAD.fields[name][1])
    for name in ("gravity", "dt", "strange", "pushed")  # type: ignore[index]
)
CROWD_SUBSTEPS = 60
NEW = 2.0
NEAR_EDGE = 0.99  # of half a box's length


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
        sides = {side.key: side for contact in contacts.values() for c in contact.couples for side in c.ends}
        before = old.keys if old else []
        self.keys = [key for key in before if key in sides] + [key for key in sides if key not in before]
        self.row = {key: row for row, key in enumerate(self.keys)}
        most = max([contact.substeps for contact in contacts.values()], default=100)
        self.world = World(0.0, substeps=most, crowd_substeps=min(most, CROWD_SUBSTEPS), stillness=1e-9)
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

    def weigh(self, rows: Iterable[int] | None = None) -> None:
        """Read masses and inertias, of all bodies or some."""
        there = {p.getBodyUniqueId(i, self._client) for i in range(p.getNumBodies(self._client))}
        for k in range(len(self.keys)) if rows is None else rows:
            body, link = self.keys[k]
            info = p.getDynamicsInfo(body, link, self._client) if body in there else [0.0, 0.0, (0.0, 0.0, 0.0)]
            row, own, moments = self.rows[k], self.arrays.bodies[k + 1], np.array(info[2])
            row["mass"], row["inertia"] = info[0], moments
            moves = info[0] > 0.0
            own["inverse_mass"] = 1.0 / info[0] if moves else 0.0
            own["inverse_inertia"] = np.divide(1.0, moments, np.zeros(3), where=moves & (moments > 0.0))
            own["isotropic"] = np.ptp(moments) <= ALIKE * moments.max()
            own["oriented"] |= 1 - own["isotropic"]

    def set_gravity(self, x: float, y: float, z: float) -> None:
        """Gravity [m/s^2] of the step that begins."""
        GRAVITY.pack_into(self.head, GRAVITY_AT, x, y, z)

    def receive(self, dt: float) -> int:
        """Read all bodies, at the start of a step; returns how many must be put elsewhere first."""
        DT.pack_into(self.head, DT_AT, dt)
        self._read(BEFORE)
        number = receive(self.head)
        if number < 0:
            self._refuse()
        if WHOLE.unpack_from(self.head, STRANGE_AT)[0]:
            self.step(0.0)  # who is near whom
            press(self.head)
        for one in self.measured:
            one.place(self._client, self.arrays, dt)
        return number

    def steady(self) -> None:
        """Make jobs of what pressed on bodies in the last step."""
        steady(self.head)

    def compare(self) -> None:
        """Read all bodies after Bullet's step, and what accelerations it gave them."""
        self._read(AFTER)
        if compare(self.head) < 0:
            self._refuse()

    def hand_back(self, *, stepped: bool) -> int:
        """Make jobs of what the world's step came to; returns how many bodies must be put elsewhere."""
        return hand_back(self.head, int(stepped))

    def _read(self, offset: int) -> None:
        """Where bodies are and how they move, into the rows."""
        client, buffer, pack = self._client, self.rows, PACKED.pack_into
        pose, velocity, at = p.getBasePositionAndOrientation, p.getBaseVelocity, offset
        for body, _ in self.keys:
            (x, q), (v, w) = pose(body, client), velocity(body, client)
            pack(buffer, at, *x, *q, *v, *w)
            at += ROW.itemsize

    def _refuse(self) -> None:
        body, link = self.keys[int(self.head["bad"][0])]
        name = f"body {body}" if link == BASE else f"body {body} link {link}"
        raise ValueError(f"{name}: its position, velocity, or gravity is not finite")

    def pushes(self) -> Iterator[tuple]:
        """Row, force, torque, and where."""
        for i in range(WHOLE.unpack_from(self.head, PUSHED_AT)[0]):
            job = NUMBERS.unpack_from(self.jobs, i * NUMBERS.size)
            yield int(job[0]), *job[1:10]

    def places(self, number: int) -> Iterator[tuple]:
        """Row, position, quaternion, velocity and spin."""
        for i in range(number):
            job = NUMBERS.unpack_from(self.jobs, i * NUMBERS.size)
            yield int(job[0]), job[1:4], job[4:8], job[8:11], job[11:14]

    def step(self, dt: float) -> None:
        """Move the world."""
        while step(self.state, dt, 1) == 0:
            seen = self.seen
            self._bind(with_more_room(self.arrays))
            self.seen[: seen.size] = seen

    def contacts(self, handle: int | None = None, closed: bool | None = None) -> Iterator[tuple[Couple, Any]]:
        """Those closed now, or parted in the last step, of one handle or all, with their couples."""
        records = self.arrays.contacts
        for slot in np.flatnonzero(records["phase"] != FREE):
            record = records[slot]
            own, couple = self.couples[frozenset((int(record["body_a"]) - 1, int(record["body_b"]) - 1))]
            if handle in (None, own) and closed in (None, bool(record["phase"] == CLOSED)):
                yield couple, record

    def fresh(self) -> Iterator[tuple[Couple, Any]]:
        """Contacts that are new; masses of their bodies are read again."""
        for slot in np.flatnonzero(self.seen == NEW):
            self.seen[slot] = 1.0
            record = self.arrays.contacts[slot]
            rows = int(record["body_a"]) - 1, int(record["body_b"]) - 1
            self.weigh(rows)
            yield self.couples[frozenset(rows)][1], record

    def check_place(self, couple: Couple, record: Any) -> None:
        """Raise ValueError where two bodies touch with something that has no radius of its own, nor the pair one."""
        if self.arrays.pairs["radius"][record["pair"]] > 0.0:
            return
        side = edge = False
        for end in ("a", "b"):
            body, shape = self.arrays.bodies[record[f"body_{end}"]], self.arrays.shapes[record[f"shape_{end}"]]
            axes = body["axes"].reshape(3, 3)
            if shape["kind"] == SEGMENT:
                along = (record[f"arm_{end}"] @ axes - shape["at"]) @ shape["half"]
                side = side or abs(along) < shape["half"] @ shape["half"]
            if shape["kind"] == BOX:
                own = axes @ shape["axes"].reshape(3, 3)
                place = np.abs((record[f"arm_{end}"] - axes @ shape["at"]) @ own)
                edge = np.abs(record["normal"] @ own).max() < 1.0 - 1e-9 and sum(place > NEAR_EDGE * shape["half"]) > 1
        if not edge and not side:
            return
        long = [side for side in couple.ends if side.shape == ("box" if edge else "capsule")]
        bad = next((side for side in long if side is couple.sides[1]), long[0])
        other = couple.b if bad is couple.a else couple.a
        where, smooth = ("edge", "faces") if edge else ("side", "ends")
        raise ValueError(
            f"radius = None: {bad} touches with the {where} of its {bad.shape}, with {other}; only the {smooth} have "
            "a radius of their own, elsewhere give the pair an effective radius [m]"
        )

    def touching(self, handle: int) -> dict[Couple, list[Any]]:
        """Contacts of a handle by couples, as `contact.state_of` wants them."""
        out: dict[Couple, list[Any]] = {}
        records, bodies = self.arrays.contacts, self.arrays.bodies
        for couple, record in self.contacts(handle):
            slot = (record.__array_interface__["data"][0] - records.ctypes.data) // records.itemsize
            sign = 1.0 if self.keys[int(record["body_a"]) - 1] == couple.a.key else -1.0
            asleep = bool(bodies["asleep"][record["body_a"]] or bodies["asleep"][record["body_b"]])
            out.setdefault(couple, []).append((record, self.arrays.memory[slot], sign, asleep))
        return out

    def save(self) -> Saved:
        """A copy of all that is remembered."""
        return Saved(tuple(self.keys), tuple(self.handles), self.world.save(), self.rows.copy(), self.seen.copy())

    def restore(self, saved: Saved) -> None:
        """Go back to it."""
        if not isinstance(saved, Saved) or saved.keys != tuple(self.keys) or saved.handles != tuple(self.handles):
            raise ValueError("saved: is not what `save` gave, or contacts have been added or removed since")
        self.rows[:] = saved.rows
        self._bind(Arrays(*(array.copy() for array in saved.arrays)))
        self.seen[:] = saved.seen

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
