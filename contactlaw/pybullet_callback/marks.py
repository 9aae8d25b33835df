"""Marks on bodies by which a callback knows them again: PyBullet gives the id of a removed body to the next one."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import count

import pybullet as p

from contactlaw.pybullet_callback.shapes import BASE

_NAMES = count()


class Marks:
    """User data entries of one callback's bodies."""

    def __init__(self, client: int) -> None:
        self._client = client
        self._name = f"contactlaw {next(_NAMES)}"
        self._marked: set[int] = set()

    def put(self, bodies: Iterable[int]) -> None:
        """Mark bodies."""
        new = set(bodies) - self._marked
        for body in new:
            p.addUserData(body, self._name, "", physicsClientId=self._client)
        self._marked |= new

    def take(self, body: int) -> None:
        """Take the mark off a body, which may be gone."""
        if self.is_there(body):
            p.removeUserData(p.getUserDataId(body, self._name, BASE, BASE, self._client), self._client)
        self._marked.discard(body)

    def is_there(self, body: int) -> bool:
        """Whether the body still is the one that was marked."""
        return p.getUserDataId(body, self._name, BASE, BASE, self._client) >= 0

    def check(self, body: int) -> None:
        """Raise ValueError where it is not."""
        if not self.is_there(body):
            raise ValueError(
                f"body {body}: removed, or no longer the one that a contact was added for; call remove_contact before "
                "removing a body"
            )
