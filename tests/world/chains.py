"""Bodies in a row with hinges between them, on a fixed base or a free one: a tree that does not branch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from numpy.typing import ArrayLike

from contactlaw import checks
from contactlaw.world.trees.description import Joint, Part, Tree


@dataclass(frozen=True)
class Link:
    """A body of a chain. Its axes are those of the body before it where its hinge's angle is zero.

    Attributes:
        mass: [kg].
        inertia: About the centre of mass, along its axes, which are principal ones [kg m^2]: one number or three.
        hinge: Where its hinge is, from its centre of mass along its axes [m].
        axis: Of the hinge, a unit vector along the same.
        anchor: Where the hinge is on the body before, from its centre of mass along its axes; of the first: in the
            world [m].
    """

    mass: float
    inertia: ArrayLike
    hinge: ArrayLike = (0.0, 0.0, 0.0)
    axis: ArrayLike = (0.0, 1.0, 0.0)
    anchor: ArrayLike = (0.0, 0.0, 0.0)


class Chain(Tree):
    """Bodies in a row with hinges between them.

    Its coordinates are the hinges' angles [rad] in their order. On a free base, the first body, which then has no
    hinge, position [m] and quaternion, scalar first, come before them; and before the hinges' rates [rad/s] the
    velocity of its centre of mass [m/s] and its spin along its own axes [rad/s].

    Args:
        links: The bodies, the base first.
        free: Whether nothing holds the first one.
    """

    def __init__(self, links: Sequence[Link], free: bool = False) -> None:
        if not links:
            raise ValueError("links: is empty; give at least one body")
        parts = []
        for number, link in enumerate(links):
            hinge = checks.vector("hinge", link.hinge)
            joint = Joint("free") if free and number == 0 else Joint("hinge", hinge, link.axis)
            position = checks.vector("anchor", link.anchor) - hinge
            parts.append(Part(link.mass, link.inertia, (joint,), number - 1, position))
        super().__init__(parts)
        self.links, self.free = list(links), free
