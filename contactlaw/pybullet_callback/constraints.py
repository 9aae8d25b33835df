"""Constraints of `createConstraint`, which join bodies of PyBullet to one system that contacts push as a whole."""

from collections.abc import Iterable
from typing import Any, NamedTuple

import pybullet as p

from contactlaw.pybullet_callback.shapes import MULTIBODY, Key, can_move

FULL = 1.0 - 1e-9  # share of its greatest force at which a constraint counts as at that limit


class Tie(NamedTuple):
    """A constraint as PyBullet has it: id, kind, two links, a slide's axis, a place on each, ratio of a gear."""

    number: int
    kind: int
    links: tuple[Key, Key]
    axis: tuple[float, ...]
    places: tuple[Any, Any]
    ratio: float

    def is_slack(self, client: int) -> bool:
        """Return whether it gave its greatest force in the last step."""
        most = FULL * p.getConstraintInfo(self.number, client)[10]
        return any(abs(force) >= most for force in p.getConstraintState(self.number, client))


def numbers_of(client: int) -> list[int]:
    """Return the ids of all constraints; those of new ones are new."""
    return [p.getConstraintUniqueId(k, client) for k in range(p.getNumConstraints(client))]


def ties_of(client: int, bodies: Iterable[int] | None = None) -> list[Tie]:
    """Return the constraints of some bodies, None: all."""
    infos = ((number, p.getConstraintInfo(number, client)) for number in numbers_of(client))
    every = (Tie(number, info[4], (info[:2], info[2:4]), info[5], info[6:8], info[11]) for number, info in infos)  # type: ignore[arg-type]
    return [one for one in every if bodies is None or not {body for body, _ in one.links}.isdisjoint(bodies)]


def systems_of(client: int, bodies: Iterable[int]) -> dict[int, list[int]]:
    """Return the bodies that constraints make one system with each of some bodies, as far as they can move."""
    systems: dict[int, set[int]] = {}
    for one in ties_of(client):
        movable = {body for body, _ in one.links if body >= 0 and is_multibody(body, client) and can_move(client, body)}
        whole = movable.union(*(systems.get(body, ()) for body in movable))
        systems |= dict.fromkeys(whole, whole)
    return {body: sorted(systems[body]) for body in bodies if body in systems}


def is_multibody(body: int, client: int) -> bool:
    """Return whether it is the kind of body whose mass and joints PyBullet tells."""
    return p.getDynamicsInfo(body, -1, client)[10] == MULTIBODY
