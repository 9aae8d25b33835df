"""The rows of the tables that stand for bodies: what stays of them, and reading what does not."""

from __future__ import annotations

import struct
from collections.abc import Iterable

import pybullet as p

from contactlaw.pybullet_callback.mechanism import coordinates, read_motion
from contactlaw.pybullet_callback.shapes import BASE, Key
from contactlaw.pybullet_callback.tables import BODY, HEADER, POSITION, READING, Tables

ROW = struct.Struct(f"{READING}d")


class Bodies:
    """All bodies and links that have contacts.

    Attributes:
        keys: Body and link of each row.
        linked: Bodies that have links.
        width: Coordinates of the largest of them, at least 6.
    """

    def __init__(self, client: int, keys: Iterable[Key], *, fixed_bodies_move: bool = True) -> None:
        self._client = client
        self.keys = list(keys)
        self.row = {key: row for row, key in enumerate(self.keys)}
        numbers = {body: number for number, body in enumerate(dict.fromkeys(body for body, _ in self.keys))}
        self._number = numbers
        there = {p.getBodyUniqueId(i, client) for i in range(p.getNumBodies(client))}
        self._gone = numbers.keys() - there  # removed before their contacts: an error at the next step
        self.linked = {body for body in numbers if body in there and p.getNumJoints(body, client) > 0}
        self._size = {body: coordinates(client, body) for body in self.linked}
        self.width = max([6, *self._size.values()])
        moving = [
            (key, 8 * (HEADER + BODY * row + POSITION))
            for row, key in enumerate(self.keys)
            if fixed_bodies_move or not self.is_fixed(key[0])
        ]
        self._bases = [(body, at) for (body, link), at in moving if link == BASE]
        self._links = [(key, at) for key, at in moving if key[1] != BASE]
        self._still = not fixed_bodies_move

    def refresh(self, rows: Iterable[int], tables: Tables) -> bool:
        """Read masses and inertias again, and where bodies are that do not move; returns whether any has changed."""
        changed = False
        for row in rows:
            body, link = self.keys[row]
            stays = self._stays(body)
            if stays != tuple(tables.staying[row]):
                tables.staying[row] = stays
                changed = True
            if self._still and stays[0] < 0.0 and body not in self._gone:
                place = [number for part in read_motion(self._client, body, link) for number in part]
                changed = changed or place != tables.readings[row].tolist()
                tables.readings[row] = place
        return changed

    def _stays(self, body: int) -> tuple[float, ...]:
        tree = float(self._number[body])
        if body in self.linked:
            return (tree if self._size[body] else -1.0), 0.0, 0.0, 0.0, 0.0
        if body in self._gone:
            return -1.0, 0.0, 0.0, 0.0, 0.0
        info = p.getDynamicsInfo(body, BASE, self._client)
        if info[0] <= 0.0:
            return -1.0, 0.0, 0.0, 0.0, 0.0
        x, y, z = (1.0 / i if i > 0.0 else 0.0 for i in info[2])
        return tree, 1.0 / info[0], x, y, z

    def is_fixed(self, body: int) -> bool:
        """Whether nothing can move the body."""
        return self._stays(body)[0] < 0.0

    def read(self, tables: Tables) -> None:
        """Where all of them are and how they move, into the tables."""
        client, buffer, pack = self._client, tables.buffer, ROW.pack_into
        pose, velocity = p.getBasePositionAndOrientation, p.getBaseVelocity
        for body, at in self._bases:
            (x, q), (v, w) = pose(body, client), velocity(body, client)
            pack(buffer, at, *x, *q, *v, *w)
        for key, at in self._links:
            x, q, v, w = read_motion(client, *key)
            pack(buffer, at, *x, *q, *v, *w)
