"""The world of a callback: made from its contacts, kept through changes of them, saved and restored, read out."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
import pybullet as p

from contactlaw.pybullet_callback.bodies import Bodies, mass_of
from contactlaw.pybullet_callback.contact import Contact, ContactState
from contactlaw.pybullet_callback.shapes import Key, Measured, Side, can_move
from contactlaw.pybullet_callback.trees import Tree, tied
from contactlaw.world import World
from contactlaw.world.arrays import kept, restored, with_contacts_of
from contactlaw.world.building import SUBSTEPS
from contactlaw.world.data.frames import IDENTITY
from contactlaw.world.data.records import EDITED, FREE, Array, Arrays
from contactlaw.world.near.sets import systems_of
from contactlaw.world.readout import DOUBTFUL, doubt_value, mean_impulses
from contactlaw.world.shapes.description import tangent

# state of a body of the world that is kept when contacts are added or removed
BODY_STATE = ("asleep", "held", "momentum", "position", "quaternion", "axes")


class Saved(NamedTuple):
    """State of a scene for a restart."""

    rows_of: tuple[tuple[Key, int], ...]  # those of the bodies that have shapes
    handles: tuple[int, ...]
    arrays: Arrays
    rows: np.ndarray
    jointed: list[Array]


class Scene:
    """The world of the contacts of a callback, by handle, and its `bodies` in PyBullet; moves, check: see `Bodies`.

    Of the scene before a change of the contacts, `old`, it takes over the state of contacts and bodies that remain.
    """

    def __init__(
        self, client: int, contacts: Mapping[int, Contact], old: Scene | None, moves: bool, check: Callable[[], None],
        crowd_substeps: int,
    ) -> None:  # fmt: skip
        self._client, self._contacts, self._handles = client, contacts, tuple(contacts)
        sides = {key: side for contact in contacts.values() for key, side in contact.sides.items()}
        order = dict.fromkeys([key for key in (old.shapes if old else ()) if key in sides] + list(sides))
        most = max([contact.substeps for contact in contacts.values()], default=SUBSTEPS)
        self.world = World(gravity=0.0, substeps=most, crowd_substeps=crowd_substeps)
        self.shapes: dict[Key, list[int]] = {key: [] for key in order}
        ids = dict.fromkeys(key[0] for key in order)
        jointed = [{body} for body in ids if p.getNumJoints(body, client) and can_move(client, body)]
        systems = {body: tuple(own) for body, own in systems_of([*jointed, *tied(client)]).items() if body in ids}
        made = {system: Tree(client, system) for system in systems.values()}
        trees = {body: made[system] for body, system in systems.items()}
        places = {key: trees[key[0]].place_of(key) for key in order if key[0] in trees and key in trees[key[0]].links}
        bodies = sorted((key for key in order if key not in places), key=lambda key: mass_of(key, client)[0] == 0.0)
        self._row = {key: self.world.add_body(np.inf, 1.0) for key in bodies}
        for tree in made.values():
            bodies += tree.add_to(self.world)
        self._row |= {key: trees[key[0]].first + member for key, (member, _) in places.items()}
        roundings = {key: one.rounding for one in contacts.values() if one.rounding is not None for key in one.sides}
        for key in order:
            pose = places[key][1] if key in places else IDENTITY
            for one in sides[key].pieces:
                at, turn = pose.then(one.pose)
                given = one.kind, self._row[key], np.array(one.sizes), at, turn, roundings.get(key), one.points
                self.shapes[key] += self.world.add_shape(*given)
        measured: list[Measured] = []
        for number, contact in enumerate(contacts.values()):
            self._let_touch(number, contact, measured)
        self._side_of = {shape: key for key, shapes in self.shapes.items() for shape in shapes}
        for part, owner in enumerate(self.world.owners.tolist()):
            if part != owner:
                self._side_of[part] = self._side_of[owner]
                self.shapes[self._side_of[owner]].append(part)
        self._rows_of = tuple((key, self._row[key]) for key in self.shapes)
        self.world.arrays.pairs["relaxed"] = 1
        self.bodies = Bodies(client, self.world, bodies, list(made.values()), measured, moves, check)
        if old:
            self._take_over(old)

    def _let_touch(self, number: int, contact: Contact, measured: list[Measured]) -> None:
        """Let two sets touch, by the world's pair of materials of this number.

        Each pair that PyBullet must measure has its own tangent planes.
        """
        sets, odd = contact.sets, {key for key, side in contact.sides.items() if side.measured}
        ones, twos = (
            [s for key in keys if key not in odd for s in self.shapes[key]] for keys in (sets.ones, sets.twos)
        )
        added = bool(ones and twos)
        if added:
            self.world.add_contact(ones, twos, contact.pair)
            for key, side in contact.sides.items():
                parent, every = side.parent, self._contacts.values()
                if parent in self.shapes and not any(one.sets.hold(key, parent) for one in every):
                    self.world.add_rule(self.shapes[key], self.shapes[parent])
        for two in sets.every(odd.__contains__) if odd else ():
            one, other = sorted((contact.sides[key] for key in two), key=lambda side: side.measured)
            ends, row = self.shapes[one.key][-2:], self._row[other.key]  # of a capsule without its side
            planes = [self.world._shape(tangent(row + 1, end, other.reach)) for end in ends]
            self.shapes[other.key] += planes
            if added:
                self.world.add_rule(ends, planes, number)
            else:
                self.world.add_contact(ends, planes, contact.pair)
            added = True
            measured.append(Measured(one, other, self._row[one.key], row, ends, planes))

    def _contacts_of(self, handle: int | None) -> Array:
        """Return records of contacts that are closed or parted in the last step, of one handle or (None) all."""
        records = self.bodies.arrays.contacts
        records = records[records["phase"] != FREE]
        return records if handle is None else records[records["pair"] == self._handles.index(handle)]

    def sides_of(self, record: Any) -> tuple[Contact, Side, Side, float]:
        """Return the user's contact of a contact of the world, its sides a and b, and -1.0 if b is the world's A."""
        one, two = (self._side_of[int(record[name])] for name in ("shape_a", "shape_b"))
        contact, sign = self._contacts[self._handles[record["pair"]]], 1.0
        if contact.sets.reversed(one, two):
            one, two, sign = two, one, -1.0
        return contact, contact.sides[one], contact.sides[two], sign

    def new_warnings(self) -> Iterator[str]:
        """Yield warnings about contacts that have not been given for their two sides."""
        for record in self._contacts_of(None):
            contact, one, two, _ = self.sides_of(record)
            for bit, text in DOUBTFUL.items():
                if int(record["noted"]) & bit and (one.key, two.key, text) not in contact.told:
                    contact.told.add((one.key, two.key, text))
                    yield f"{one} and {two}: {text.format(doubt_value(record, bit))}"

    def states(self, handle: int | None, *these: tuple[Key, Key]) -> list[ContactState]:
        """Return the contacts of a handle, None: of all, that touched in the last step, and those of `these` anyway."""
        out, arrays = {both: ContactState(*both) for both in these}, self.bodies.arrays
        for record in self._contacts_of(handle):
            _, one, two, sign = self.sides_of(record)
            state = out.setdefault((one.key, two.key), ContactState(one.key, two.key))
            state.add(record, mean_impulses(arrays.bodies, record, self.bodies.dt), sign, self.bodies.dt)
        return list(out.values())

    def save(self) -> Saved:
        """Return a copy of all state."""
        jointed = [one.kept.copy() for one in self.bodies.trees]
        return Saved(self._rows_of, self._handles, kept(self.bodies.arrays), self.bodies.rows.copy(), jointed)

    def restore(self, saved: Saved) -> None:
        """Set the state to a saved one; ValueError if it is not of these contacts."""
        if not isinstance(saved, Saved) or (saved.rows_of, saved.handles) != (self._rows_of, self._handles):
            raise ValueError("saved: is not what `save` gave, or contacts or masses have been added or removed since")
        bodies, arrays = self.bodies, restored(saved.arrays, self.bodies.arrays)
        bodies.rows[:] = saved.rows
        bodies.bind(arrays)
        for one, values in zip(bodies.trees, saved.jointed, strict=True):
            one.kept[...] = values

    def _take_over(self, old: Scene) -> None:
        """Take over the state of contacts and bodies that are still there."""
        mine, theirs = self.bodies.arrays, old.bodies.arrays
        both = self._contacts.keys() & old._contacts.keys()
        pairs = {old._handles.index(handle): self._handles.index(handle) for handle in both}
        for number, new in pairs.items():
            mine.pairs["ledger"][new] = theirs.pairs["ledger"][number]
        before = {one.bodies: one for one in old.bodies.trees}
        for one in self.bodies.trees:
            was = before.get(one.bodies)
            if was is not None and (was.joints, was.ties) == (one.joints, one.ties):
                one.kept[...] = was.kept
                if one.known != was.known:
                    mine.world["edited"] = EDITED
        numbers: dict[int, int] = {}
        for key, shapes in old.shapes.items():
            if key not in self.shapes:
                continue
            numbers.update(zip(shapes, self.shapes[key], strict=False))
            i, j = self._row[key], old._row[key]
            mine.bodies["pressed"][i + 1] = theirs.bodies["pressed"][j + 1]
            if i < self.bodies.singles and j < old.bodies.singles:
                self.bodies.rows[i] = old.bodies.rows[j]
                for name in BODY_STATE:
                    mine.bodies[i + 1][name] = theirs.bodies[j + 1][name]
        self.bodies.read_masses(range(self.bodies.singles))  # anew, as they may differ from those that were taken over
        self.bodies.bind(with_contacts_of(mine, theirs, numbers, pairs))
