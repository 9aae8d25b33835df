"""How the contacts of a callback stand in the tables, and their records there."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from contactlaw import checks
from contactlaw.kernels.scene import HISTORY, KEY, MOST_SLOTS
from contactlaw.kernels.touch import OTHER
from contactlaw.pybullet_callback.bodies import Bodies
from contactlaw.pybullet_callback.contact import Contact, Couple
from contactlaw.pybullet_callback.shapes import Key, Side
from contactlaw.pybullet_callback.tables import TOLD, TOLD_PAIR, WIDTH, Tables

Array = NDArray[np.float64]

SAVED = 3  # before a saved record: pair within the handle, slot, time step
PER_SHAPE, SPARE = 4, 16  # contacts at once that there is room for; more when they come


class Layout:
    """Tables for all contacts of a callback.

    Args:
        client: Physics client id.
        contacts: By handle.
        old: Whose records to take over.
        fixed_bodies_move: As for the callback.

    Attributes:
        couples: Handle, contact and couple of each pair in the tables.
        bodies: The rows of bodies.
        tables: The tables.
        plain: Whether no body has links and the kernels know all shapes.
    """

    def __init__(
        self, client: int, contacts: Mapping[int, Contact], old: Layout | None = None, *, fixed_bodies_move: bool = True
    ) -> None:
        self._client = client
        self.couples: list[tuple[int, Contact, Couple]] = []
        self._first: dict[int, int] = {}
        for handle, contact in contacts.items():
            self._first[handle] = len(self.couples)
            self.couples += [(handle, contact, couple) for couple in contact.couples]
        shapes: dict[tuple[Key, bool], Side] = {}
        for _, _, couple in self.couples:
            for which, side in enumerate(couple.sides):
                shapes[side.key, _hidden(couple, which)] = side
        self._shapes = shapes
        self.bodies = Bodies(client, dict.fromkeys(key for key, _ in shapes), fixed_bodies_move=fixed_bodies_move)
        self.plain = not self.bodies.linked and not any(couple.measured for _, _, couple in self.couples)
        self._history = max([0, *(contact.history_size for _, contact, _ in self.couples)])
        self.tables = self._build(min(PER_SHAPE * len(shapes) + SPARE, MOST_SLOTS * max(len(self.couples), 1)))
        if old is not None:
            self._take_over(old)

    def _build(self, room: int) -> Tables:
        blocks: dict[tuple[int, float], tuple[int, int]] = {}
        parts, at = [], 0
        for handle, contact, couple in self.couples:
            if (handle, couple.radius) not in blocks:
                block = contact.parameters(couple.radius)
                blocks[handle, couple.radius] = at, block.size
                parts.append(block)
                at += block.size
        tables = Tables(len(self.bodies.keys), len(self._shapes), len(self.couples), at, self._history, room)
        tables.memory[WIDTH] = self.bodies.width
        tables.parameters[:] = np.concatenate([np.empty(0), *parts])
        number = {name: i for i, name in enumerate(self._shapes)}
        for i, ((key, hidden), side) in enumerate(self._shapes.items()):
            kind = OTHER if hidden else side.kind
            tables.shapes[i] = [
                kind, *side.size, self.bodies.row[key], side.bound, *side.position, *side.rotation.ravel(),
            ]  # fmt: skip
        for i, (handle, contact, couple) in enumerate(self.couples):
            one, two = (number[side.key, _hidden(couple, which)] for which, side in enumerate(couple.sides))
            start, size = blocks[handle, couple.radius]
            by_shape = float(contact.pair.radius is None)
            tables.pairs[i] = (
                one, two, start, size, contact.substeps, float(contact.ledger is not None), couple.slots, by_shape,
                couple.deep,
            )  # fmt: skip
        self.bodies.refresh(range(len(self.bodies.keys)), tables)
        return tables

    def _take_over(self, old: Layout) -> None:
        kept = []
        for record in old.tables.records:
            pair, slot = divmod(int(record[KEY]), MOST_SLOTS)
            handle = old.couples[pair][0]
            if handle in self._first:
                record = record.copy()
                record[KEY] = MOST_SLOTS * (self._first[handle] + pair - old._first[handle]) + slot
                kept.append(record)
        self._put(kept, old.tables.records.shape[1])

    def _put(self, records: list[Array], width: int) -> None:
        while len(records) > self.tables.room:
            self.tables = self._build(2 * self.tables.room)
        self.tables.put_records(np.array(sorted(records, key=lambda row: row[KEY])).reshape(len(records), width))

    def widen(self) -> None:
        """Make room for more contacts at once; what has been read of the bodies stays."""
        old = self.tables
        self.tables = self._build(2 * old.room)
        self.tables.memory[:4] = old.memory[:4]
        self.tables.readings[:] = old.readings
        self.tables.put_records(old.records)

    def records_of(self, handle: int, number: int) -> Array:
        """The records of one pair of a handle, one for each slot that touches."""
        pairs = self.tables.records[:, KEY] // MOST_SLOTS
        return self.tables.records[pairs == self._first[handle] + number]

    def touching(self, handle: int) -> list[int]:
        """Pairs of a handle that touch, as their numbers within it."""
        pairs = np.unique(self.tables.records[:, KEY] // MOST_SLOTS).astype(int).tolist()
        return [pair - self._first[handle] for pair in pairs if self.couples[pair][0] == handle]

    def save(self, handle: int, dt: float) -> Array:
        """The records of a handle."""
        records = self.tables.records
        rows = [record for record in records if self.couples[int(record[KEY]) // MOST_SLOTS][0] == handle]
        out = np.zeros((len(rows), SAVED + self._saved_size(handle)))
        for row, record in zip(out, rows, strict=True):
            pair, slot = divmod(int(record[KEY]), MOST_SLOTS)
            row[:SAVED] = pair - self._first[handle], slot, dt
            row[SAVED:] = record[1 : 1 + row.size - SAVED]
        return out

    def _saved_size(self, handle: int) -> int:
        return HISTORY - 1 + self.couples[self._first[handle]][1].history_size

    def restore(self, saved: Mapping[int, Array]) -> float | None:
        """Put what `save` gave in the place of all records; returns the time step found there."""
        records, keys, dt = [], set(), None
        width = HISTORY + self._history
        for handle, rows in saved.items():
            rows, size = checks.finite_array(f"saved[{handle}]", rows), SAVED + self._saved_size(handle)
            if rows.ndim != 2 or rows.shape[1] != size:
                raise ValueError(f"saved[{handle}]: shape {rows.shape}; must be (n, {size})")
            couples = [couple for known, _, couple in self.couples if known == handle]
            for row in rows:
                pair, slot = row[0], row[1]
                if pair not in range(len(couples)) or slot not in range(couples[int(pair)].slots):
                    raise ValueError(f"saved[{handle}]: pair {pair:g}, slot {slot:g}; there is no such contact")
                record = np.zeros(width)
                record[KEY] = MOST_SLOTS * (self._first[handle] + pair) + slot
                record[1 : 1 + size - SAVED] = row[SAVED:]
                if record[KEY] in keys:
                    raise ValueError(f"saved[{handle}]: pair {pair:g}, slot {slot:g} twice; each may be there once")
                keys.add(record[KEY])
                records.append(record)
                dt = float(row[2])
        self._put(records, width)
        self.bodies.refresh(range(len(self.bodies.keys)), self.tables)
        return dt

    def enter(self, dt: float) -> None:
        """Enter the step in the ledgers."""
        for told in self.tables.tellings[: int(self.tables.memory[TOLD])].tolist():
            ledger = self.couples[int(told[TOLD_PAIR])][1].ledger
            if ledger is not None:
                ledger.add(told, dt)


def _hidden(couple: Couple, which: int) -> bool:
    """Whether a shape that the kernels know must be measured all the same: they know none on which it would be A."""
    return which == 0 and couple.measured
