"""Constraints of `createConstraint`, which join bodies of PyBullet to one system that contacts push as a whole."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import pybullet as p

from contactlaw.pybullet_callback.shapes import BASE, MULTIBODY, Key, can_move
from contactlaw.pybullet_callback.tree_hooks import EXACT


class Tie(NamedTuple):
    """A constraint as PyBullet has it: id, kind, two links, a slide's axis, a place on each, ratio of a gear."""

    number: int
    kind: int
    links: tuple[Key, Key]
    axis: tuple[float, ...]
    places: tuple[Any, Any]
    ratio: float

    def force_left(self, client: int) -> float:
        """Return its greatest force [N] less that of the last step; 0 if it gave all."""
        most = p.getConstraintInfo(self.number, client)[10]
        left = most - max(map(abs, p.getConstraintState(self.number, client)))
        return left if left > EXACT * most else 0.0


def numbers_of(client: int) -> list[int]:
    """Return the ids of all constraints; those of new ones are new."""
    return [p.getConstraintUniqueId(k, client) for k in range(p.getNumConstraints(client))]


def ties_of(client: int) -> list[Tie]:
    """Return all constraints."""
    infos: list[Any] = [(number, p.getConstraintInfo(number, client)) for number in numbers_of(client)]
    return [Tie(number, one[4], (one[:2], one[2:4]), one[5], one[6:8], one[11]) for number, one in infos]


def tied(client: int) -> Iterator[set[int]]:
    """Yield the bodies that each constraint joins, but for those that cannot move."""
    for one in ties_of(client):
        bodies = {body for body, _ in one.links if body >= 0}
        yield {b for b in bodies if p.getDynamicsInfo(b, BASE, client)[10] == MULTIBODY and can_move(client, b)}
