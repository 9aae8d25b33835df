"""Marks on bodies by which a callback knows them again: PyBullet gives the id of a removed body to the next one."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from itertools import count

import pybullet as p

_NAMES = count()


class Marks:
    """User data entries of one callback's bodies.

    Attributes:
        bodies: Those that have one, or had when it was put, and its id.
        text: What is in the entries.
        first: Reads the first body's: another one after resetSimulation, and cheap enough for each step.
    """

    def __init__(self, client: int) -> None:
        self._client = client
        self._name = f"contactlaw {next(_NAMES)}"
        self.text = self._name.encode()
        self.bodies: dict[int, int] = {}

    def put(self, bodies: Iterable[int]) -> None:
        """Mark bodies."""
        for body in set(bodies) - self.bodies.keys():
            self.bodies[body] = p.addUserData(body, self._name, self._name, physicsClientId=self._client)
        self._look_at_first()

    def take(self, body: int) -> None:
        """Take the mark off a body, which may be gone."""
        if self.is_there(body):
            p.removeUserData(self.bodies[body], self._client)
        self.bodies.pop(body, None)
        self._look_at_first()

    def is_there(self, body: int) -> bool:
        """Whether the body still is the one that was marked."""
        return body in self.bodies and p.getUserData(self.bodies[body], self._client) == self.text

    def _look_at_first(self) -> None:
        self.first = partial(p.getUserData, next(iter(self.bodies.values()), -1), self._client)

    def check(self) -> None:
        """Raise ValueError where one is not."""
        for body in (body for body in sorted(self.bodies) if not self.is_there(body)):
            raise ValueError(
                f"body {body}: removed, or no longer the one that a contact was added for (resetSimulation removes "
                "all); call remove_contact before removing a body, or remove_all, and add what there is"
            )
