"""The contacts of a callback: one handle for a pair of bodies or two sets, and which pairs of them may touch.

Bullet's own response is off for just these pairs, by a rule for each, or, for sets of thousands, by collision groups
and masks of zero, which cost one call a body. Bodies have tags, as PyBullet gives the id of a removed body to the next.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import partial
from itertools import count, cycle
from typing import Any

import numpy as np
import pybullet as p

from contactlaw.pair import ContactPair
from contactlaw.pybullet_callback.shapes import Key, Side, can_move, check_served
from contactlaw.world.data.records import CLOSED, Array
from contactlaw.world.near.sets import Sets

_NAMES = count()
RULES = "contactlaw rules"  # entry of a body with pairs that have kept a rule from a contact that was removed
NOTHING, MOVING, FIXED = (0, 0), (1, -1), (2, ~2)  # group and mask of no body; Bullet's own, of what moves or does not


@dataclass
class ContactState:
    """A contact at the end of the step, and its impulse within the step; sums where shapes touch at several places.

    Attributes:
        a, b: Body and link of both sides.
        touching: Whether the bodies touched at any time within the step.
        overlap: The deepest [m].
        normal_force: [N], >= 0.
        tangential_force: On A, world frame [N], shape (3,).
        impulse: On A over the step, world frame [N s], shape (3,).
        force: Mean over the step, impulse over time step [N], shape (3,).
    """

    a: Key
    b: Key
    touching: bool = False
    overlap: float = 0.0
    normal_force: float = 0.0
    tangential_force: Array = field(default_factory=lambda: np.zeros(3))
    impulse: Array = field(default_factory=lambda: np.zeros(3))
    force: Array = field(default_factory=lambda: np.zeros(3))

    def add(self, c: Any, impulse: Array, sign: float, dt: float) -> None:
        """Add a contact of the world with its impulse in the step dt [s]; sign: -1.0 if its A is this contact's b."""
        self.touching = True
        self.impulse += sign * impulse
        self.force = self.impulse / dt if dt > 0.0 else self.force
        own = c["touch"]["force"] if c["phase"] == CLOSED else 0.0
        self.tangential_force += sign * (c["force"] - own * c["normal"])
        self.normal_force += float(own)
        if c["phase"] == CLOSED:
            self.overlap = max(self.overlap, float(c["touch"]["overlap"]))


@dataclass(eq=False)
class Contact:
    """The law between bodies of two sets; what one handle stands for."""

    pair: ContactPair  # as the user gave it
    substeps: int  # least number in a contact
    sides: dict[Key, Side]  # shapes of both sets by body and link
    sets: Sets  # which of them may touch, by body and link
    fixed: set[int]  # bodies that cannot move
    rounding: float | None = None  # radius of edges [m]; None: see `world.shapes.description.ROUNDING`
    others: bool = True  # its bodies touch all others by Bullet's own response
    # bodies whose pairs have a rule; rules go before masks, and can be changed but not removed
    ruled: set[int] = field(default_factory=set)
    told: set[tuple[Key, Key, str]] = field(default_factory=set)  # pairs that have been warned of, and the text

    def find_fixed(self, client: int) -> None:
        """Find anew which bodies cannot move: one that has been given a mass may touch others that cannot."""
        changed = _fixed(client, self.bodies) ^ self.fixed
        self.fixed ^= changed
        self.ruled |= changed  # Bullet gives a body its own group when it gets a mass
        self.set_rules(client, False, changed)
        if not self.others:
            self.set_masks(client, False, self.sides)

    def set_rules(self, client: int, enabled: bool, among: set[int], there: set[int] | None = None) -> None:
        """Enable or disable Bullet's own response of pairs with a body of `among`, as far as both bodies are there."""
        for one, two in self.sets.every(lambda key: key[0] in among):
            if there is None or (one[0] in there and two[0] in there):
                p.setCollisionFilterPair(one[0], two[0], one[1], two[1], int(enabled), client)

    def set_masks(self, client: int, enabled: bool, keys: Iterable[Key]) -> None:
        """Let some of its bodies and links touch nothing by Bullet, or all that Bullet lets them touch by default."""
        for key in keys:
            own = FIXED if p.getDynamicsInfo(*key, client)[0] == 0.0 else MOVING
            p.setCollisionFilterGroupMask(*key, *(own if enabled else NOTHING), client)

    @property
    def bodies(self) -> set[int]:
        """Ids of all bodies."""
        return {body for body, _ in self.sides}


def sets_of(
    client: int, a: list[Side], b: list[Side], pair: ContactPair, others: Iterable[tuple[str, Contact]]
) -> tuple[Sets, set[int]]:
    """Return which pairs of two sets may touch, and the set of bodies that cannot move, of which no two may.

    Each of A may touch each of B, each pair once, but no link its parent. The sets follow changes of that set. others:
    the other contacts of this client, with a name for messages.
    """
    sides = {side.key: side for side in (*a, *b)}
    bodies, single = {side.body for side in sides.values()}, len(a) == 1 and len(b) == 1
    fixed = _fixed(client, bodies)
    free = {body for body in bodies - fixed if p.getNumJoints(body, client) == 0}
    if single and a[0].key == b[0].key:
        raise ValueError(f"body_b = {b[0].body}, link_b = {b[0].link}: the same as a; a contact needs two")
    if single and bodies <= fixed:
        raise ValueError(f"body_a, body_b = {a[0]}, {b[0]}: neither can move; one must")

    def allow(one: Key, two: Key) -> bool:
        joined = not single and (sides[one].parent == two or sides[two].parent == one)
        return not joined and not (one[0] in fixed and two[0] in fixed)

    sets = Sets([side.key for side in a], [side.key for side in b], lambda key: key, allow)
    for name, other in others:
        twice = sets.common(other.sets)
        if twice:
            one, two = (sides[key] for key in twice)
            raise ValueError(f"body_a, body_b = {one}, {two}: they have {name} already")
    kinds = list(sets.by_kinds(lambda key: (sides[key].shape, key[0] in free, key[0] in fixed)))
    for first, second in kinds:
        one, two = sides[first], sides[second]
        check_served(pair, one, two, one.body in free or two.body in free)
    if not kinds:
        raise ValueError("body_a, body_b: no two of them can touch; a contact needs two bodies, one that can move")
    return sets, fixed


def _fixed(client: int, bodies: set[int]) -> set[int]:
    return {body for body in bodies if not can_move(client, body)}


class Tags:
    """User data entries on the bodies of one callback.

    Attributes:
        bodies: Id of the entry by body.
        text: Content of the entries.
        entries: Calls that read the entry of one body after the other, for ever: another content after resetSimulation,
            or of a body in the place of a removed one. One of them is cheap enough for each step.
    """

    def __init__(self, client: int) -> None:
        self._client, self._name = client, f"contactlaw {next(_NAMES)}"
        self.text = self._name.encode()
        self.bodies: dict[int, int] = {}

    def add(self, bodies: Iterable[int]) -> None:
        """Tag bodies."""
        for body in set(bodies) - self.bodies.keys():
            self.bodies[body] = p.addUserData(body, self._name, self._name, physicsClientId=self._client)
        self._take_turns(self.bodies)

    def remove(self, bodies: Iterable[int]) -> None:
        """Remove the tags of bodies, which may have been removed themselves."""
        for body in bodies:
            if self.is_there(body):
                p.removeUserData(self.bodies[body], self._client)
            self.bodies.pop(body, None)
        self._take_turns(self.bodies)

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
        """Check that all bodies are there; ValueError if one is not, and then in each step until its contacts go."""
        if gone := [body for body in sorted(self.bodies) if not self.is_there(body)]:
            self._take_turns(gone)
            raise ValueError(
                f"body {gone[0]}: removed, or no longer the one that a contact was added for (resetSimulation removes "
                "all); call remove_contact before removing a body, or remove_all, and add what there is"
            )

    def _take_turns(self, bodies: Iterable[int]) -> None:
        self.entries = cycle([partial(p.getUserData, self.bodies[body], self._client) for body in bodies])
