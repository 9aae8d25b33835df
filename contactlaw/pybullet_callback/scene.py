"""The world that the contacts of a callback make: its bodies, shapes and pairs; what it remembers of contacts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from copy import deepcopy
from typing import Any, NamedTuple

import numpy as np
import pybullet as p

from contactlaw.pybullet_callback.contact import Contact, Couple
from contactlaw.pybullet_callback.linked import Linked
from contactlaw.pybullet_callback.measure import Measured
from contactlaw.pybullet_callback.shapes import Key, Side, coordinates
from contactlaw.pybullet_callback.traffic import Traffic
from contactlaw.world import World
from contactlaw.world.arrays import with_more_room
from contactlaw.world.records import BOX, CLOSED, CORNER, DISC, EDGE, FREE, SEGMENT, SIDE, Arrays
from contactlaw.world.shapes import tangent

CROWD_SUBSTEPS = 60
STILLNESS = 1e-9  # of the overlap: what rests carries its weight to that
NEW = 2.0  # in `Traffic.seen`
NEAR_EDGE = 0.99  # of half a box's length
JOINTED = (
    "left",
    "start",
    "ahead",
    "lacks",
    "force",
    "push",
    "pressed",
    "matrix",
    "own",
)  # of one with joints
OWN = ("asleep", "held", "momentum", "position", "quaternion", "axes")  # what another does in the world


class Saved(NamedTuple):
    """What a restart needs."""

    shapes: tuple[Key, ...]
    handles: tuple[int, ...]
    arrays: Arrays
    rows: np.ndarray
    seen: np.ndarray
    jointed: list[dict[str, Any]]


class Scene:
    """What contacts of the law look like to the world.

    Args:
        client: Physics client id.
        contacts: By handle.
        old: The scene before; what it remembers of contacts that are still there is taken over.
        moves: See `Traffic`.

    Attributes:
        traffic: Between it and PyBullet.
    """

    def __init__(
        self, client: int, contacts: Mapping[int, Contact], old: Scene | None = None, moves: bool = True
    ) -> None:
        self._client, self._handles = client, tuple(contacts)
        sides = {side.key: side for contact in contacts.values() for c in contact.couples for side in c.ends}
        order = [key for key in old.shapes if key in sides] if old else []
        order += [key for key in sides if key not in order]
        most = max([contact.substeps for contact in contacts.values()], default=100)
        self.world = World(0.0, substeps=most, crowd_substeps=min(most, CROWD_SUBSTEPS), stillness=STILLNESS)
        self.shapes: dict[Key, list[int]] = {}
        self._side_of: dict[int, Key] = {}
        self._row: dict[Key, int] = {}
        bodies: list[Key] = []
        linked: dict[int, Linked] = {}
        there = {p.getBodyUniqueId(i, client) for i in range(p.getNumBodies(client))}
        given = [(one.rounding, c.ends) for one in contacts.values() for c in one.couples if one.rounding is not None]
        self._roundings = {side.key: radius for radius, ends in given for side in ends}
        for key in order:
            self._add(sides[key], bodies, linked, there)
        measured: list[Measured] = []
        for contact in contacts.values():
            self._let_touch(contact, measured)
        for part, owner in enumerate(self.world.owners.tolist()):
            if part != owner:
                self._enter(self._side_of[owner], [part])
        self._couples = {
            frozenset((c.a.key, c.b.key)): (handle, c) for handle, contact in contacts.items() for c in contact.couples
        }
        self.traffic = Traffic(client, self.world, bodies, list(linked.values()), measured, moves)
        if old:
            self._take_over(old)

    def _add(self, side: Side, bodies: list[Key], linked: dict[int, Linked], there: set[int]) -> None:
        """A shape, and the body that it is on."""
        at, turn, row = np.zeros(3), np.eye(3), -1
        if side.body in there and p.getNumJoints(side.body, self._client) and coordinates(self._client, side.body):
            if side.body not in linked:
                linked[side.body] = Linked(self._client, side.body)
                linked[side.body].add_to(self.world)
                bodies += linked[side.body].keys
            if side.link in linked[side.body].links:
                member, at, turn = linked[side.body].place_of(side.link)
                row = linked[side.body].first + member
        if row < 0:
            row = self.world.add_body(np.inf, 1.0)
            bodies.append(side.key)
        self._row[side.key] = row
        self._enter(side.key, side.add_to(self.world, row, at, turn, self._roundings.get(side.key)))

    def _enter(self, key: Key, shapes: list[int]) -> None:
        self.shapes.setdefault(key, []).extend(shapes)
        self._side_of.update(dict.fromkeys(shapes, key))

    def _let_touch(self, contact: Contact, measured: list[Measured]) -> None:
        """Sets meet as sets; what PyBullet must measure has a plane for each sphere that may touch it."""
        plain = [couple for couple in contact.couples if not couple.measured]
        for couple in contact.couples:
            if couple.measured:
                one, other = couple.sides
                ends, row = self.shapes[one.key][-2:], self._row[other.key]  # of a capsule without its side
                planes = [self.world._shape(tangent(row + 1, end, other.reach)) for end in ends]
                self._enter(other.key, planes)
                self.world.add_contact(ends, planes, contact.pair)
                measured.append(Measured(one, other, self._row[one.key], row, ends, planes))
        if plain:
            first, second = ({s for couple in plain for s in self.shapes[couple.ends[end].key]} for end in (0, 1))
            self.world.add_contact(first, second, contact.pair)

    def contacts(self, handle: int | None = None, closed: bool | None = None) -> Iterator[tuple[Couple, Any]]:
        """Those closed now, or parted in the last step, of one handle or all, with their couples."""
        records = self.traffic.arrays.contacts
        for slot in np.flatnonzero(records["phase"] != FREE):
            record = records[slot]
            own, couple = self._couple_of(record)
            if handle in (None, own) and closed in (None, bool(record["phase"] == CLOSED)):
                yield couple, record

    def check_place(self, couple: Couple, record: Any) -> None:
        """Raise ValueError where two bodies touch with something that has no radius of its own, nor the pair one."""
        arrays = self.traffic.arrays
        if arrays.pairs["radius"][record["pair"]] > 0.0:
            return
        side = edge = False
        for end in ("a", "b"):
            body, shape = (
                self.traffic.arrays.bodies[record[f"body_{end}"]],
                self.traffic.arrays.shapes[record[f"shape_{end}"]],
            )
            axes = body["axes"].reshape(3, 3)
            if end == "a" and shape["kind"] in (CORNER, EDGE, DISC, SIDE):
                return
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

    def fresh(self) -> Iterator[tuple[Couple, Any]]:
        """Contacts that are new; masses of their bodies are read again."""
        traffic = self.traffic
        for slot in np.flatnonzero(traffic.seen == NEW):
            traffic.seen[slot] = 1.0
            record = traffic.arrays.contacts[slot]
            traffic.weigh((int(record["body_a"]) - 1, int(record["body_b"]) - 1))
            yield self._couple_of(record)[1], record

    def touching(self, handle: int) -> dict[Couple, list[Any]]:
        """Contacts of a handle by couples, as `contact.state_of` wants them."""
        out: dict[Couple, list[Any]] = {}
        arrays = self.traffic.arrays
        for slot in np.flatnonzero(arrays.contacts["phase"] != FREE):
            record = arrays.contacts[slot]
            own, couple = self._couple_of(record)
            if own == handle:
                sign = 1.0 if self._side_of[int(record["shape_a"])] == couple.a.key else -1.0
                asleep = bool(arrays.bodies["asleep"][[record["body_a"], record["body_b"]]].any())
                out.setdefault(couple, []).append((record, arrays.memory[slot], sign, asleep))
        return out

    def _couple_of(self, record: Any) -> tuple[int, Couple]:
        """Handle and couple of a contact."""
        return self._couples[frozenset(self._side_of[int(record[name])] for name in ("shape_a", "shape_b"))]

    def save(self) -> Saved:
        """A copy of all that is remembered."""
        traffic = self.traffic
        jointed = [deepcopy({name: getattr(one, name) for name in JOINTED}) for one in traffic.linked]
        arrays = Arrays(*(array.copy() for array in traffic.arrays))
        return Saved(tuple(self.shapes), self._handles, arrays, traffic.rows.copy(), traffic.seen.copy(), jointed)

    def restore(self, saved: Saved) -> None:
        """Go back to it."""
        if not isinstance(saved, Saved) or (saved.shapes, saved.handles) != (tuple(self.shapes), self._handles):
            raise ValueError("saved: is not what `save` gave, or contacts have been added or removed since")
        traffic = self.traffic
        traffic.rows[:] = saved.rows
        traffic.bind(Arrays(*(array.copy() for array in saved.arrays)))
        traffic.seen[:] = saved.seen
        for one, values in zip(traffic.linked, saved.jointed, strict=True):
            vars(one).update(deepcopy(values))

    def _take_over(self, old: Scene) -> None:
        """What is remembered of contacts and bodies that are there still."""
        mine, theirs = self.traffic.arrays, old.traffic.arrays
        before = {one.body: one for one in old.traffic.linked}
        for one in self.traffic.linked:
            if one.body in before and before[one.body].v_size == one.v_size:
                vars(one).update({name: getattr(before[one.body], name) for name in JOINTED})
        numbers: dict[int, int] = {}
        for key, shapes in old.shapes.items():
            if key not in self.shapes:
                continue
            numbers.update(zip(shapes, self.shapes[key], strict=False))
            i, j = self._row[key], old._row[key]
            if not self.traffic.rows["linked"][i]:
                self.traffic.rows[i] = old.traffic.rows[j]
                for name in OWN:
                    mine.bodies[i + 1][name] = theirs.bodies[j + 1][name]
        for slot in np.flatnonzero(theirs.contacts["phase"] != FREE):
            c = theirs.contacts[slot]
            a, b = numbers.get(int(c["shape_a"])), numbers.get(int(c["shape_b"]))
            pair = -1 if a is None or b is None else mine.groups[mine.shapes["group"][a], mine.shapes["group"][b]]
            if pair < 0:
                continue
            if mine.world["spares"][0] == 0:
                self.traffic.bind(with_more_room(mine))
                mine = self.traffic.arrays
            mine.world["spares"] -= 1
            new = int(mine.spare[mine.world["spares"][0]])
            own, size = mine.contacts[new : new + 1], min(mine.memory.shape[1], theirs.memory.shape[1])
            own[0], own["pair"], own["near"] = c, pair, -1
            for side, shape in (("a", a), ("b", b)):
                own[f"shape_{side}"], own[f"body_{side}"] = shape, mine.shapes["body"][shape]
            mine.memory[new, :size] = theirs.memory[slot, :size]
            self.traffic.seen[new] = 1.0
        mine.world["stale"] = 1
