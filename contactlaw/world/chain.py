"""A model of a tree: bodies in a row with hinges between them, on a fixed base or a free one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from contactlaw import checks
from contactlaw.world.chain_model import LINK, addresses
from contactlaw.world.coordinates import numbers
from contactlaw.world.records import Arrays


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


class Chain:
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
        for link in links:
            inertia = checks.finite_array("inertia", link.inertia)
            if inertia.shape not in ((), (3,)):
                raise ValueError(f"inertia: shape {inertia.shape}; must be one number or (3,), about principal axes")
        self.links, self.free = list(links), free
        self.q_size, self.v_size = len(links) + 6 * free, len(links) + 5 * free
        self.start = np.zeros(self.q_size)
        if free:
            self.start[3] = 1.0

    def fields(self) -> dict[str, Any]:
        """Of its `records.TREE`, all but where its bodies are."""
        sizes = {"count": len(self.links), "q_size": self.q_size, "v_size": self.v_size}
        return addresses() | sizes | {"model_size": len(self.links) * LINK.itemsize // 8}

    def write(self, world: Arrays, number: int) -> None:
        """Write what the compiled model reads of the links."""
        for row, link in zip(numbers(world, number, "model").view(LINK), self.links, strict=True):
            row["anchor"], row["hinge"] = checks.vector("anchor", link.anchor), checks.vector("hinge", link.hinge)
            row["axis"] = checks.unit_vector("axis", link.axis)
