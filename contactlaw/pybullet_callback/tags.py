"""Tags by which a callback recognises its bodies: PyBullet gives the id of a removed body to the next one."""

from collections.abc import Iterable
from functools import partial
from itertools import count

import pybullet as p

_NAMES = count()
RULES = "contactlaw rules"  # entry of a body with pairs that have kept a rule from a contact that was removed


class Tags:
    """User data entries on the bodies of one callback.

    Attributes:
        bodies: Id of the entry by body.
        text: Content of the entries.
        first: Reads the entry of the first body, after `check`: another content after resetSimulation; cheap enough for
            each step.
    """

    def __init__(self, client: int) -> None:
        self._client, self._name = client, f"contactlaw {next(_NAMES)}"
        self.text = self._name.encode()
        self.bodies: dict[int, int] = {}

    def add(self, bodies: Iterable[int]) -> None:
        """Tag bodies."""
        for body in set(bodies) - self.bodies.keys():
            self.bodies[body] = p.addUserData(body, self._name, self._name, physicsClientId=self._client)

    def remove(self, body: int) -> None:
        """Remove the tag of a body, which may have been removed itself."""
        if self.is_there(body):
            p.removeUserData(self.bodies[body], self._client)
        self.bodies.pop(body, None)

    def is_there(self, body: int) -> bool:
        """Return whether a body is still the one that was tagged."""
        return body in self.bodies and p.getUserData(self.bodies[body], self._client) == self.text

    def note_rules(self, bodies: set[int]) -> None:
        """Note that pairs of bodies keep rules of setCollisionFilterPair, which can be changed but not removed."""
        for body in bodies:
            p.addUserData(body, RULES, RULES, physicsClientId=self._client)

    def has_rules(self, body: int) -> bool:
        """Return whether `note_rules` has noted a body."""
        return p.getUserDataId(body, RULES, physicsClientId=self._client) >= 0

    def check(self) -> None:
        """Check that all bodies are there, and set `first`; ValueError if one is not."""
        for body in (body for body in sorted(self.bodies) if not self.is_there(body)):
            raise ValueError(
                f"body {body}: removed, or no longer the one that a contact was added for (resetSimulation removes "
                "all); call remove_contact before removing a body, or remove_all, and add what there is"
            )
        self.first = partial(p.getUserData, next(iter(self.bodies.values()), -1), self._client)
