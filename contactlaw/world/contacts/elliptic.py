"""Elliptic contacts as they ask for their law, by address: most scenes have none."""

from __future__ import annotations

from collections import namedtuple

from numba import carray  # pyright: ignore[reportPrivateImportUsage]

from contactlaw.laws import ellipse
from contactlaw.memory import doubles_at

Nodes = namedtuple("Nodes", "x x2 w")


def advance(c, numbers, memory, count, du, dv):
    """See `laws.ellipse.advance`; numbers, memory: addresses of the law's and of what it remembers; count: nodes."""
    n = int(count)
    own = carray(doubles_at(numbers), 3 * n)
    ellipse.advance(c.touch, Nodes(own[:n], own[n : 2 * n], own[2 * n :]), carray(doubles_at(memory), (2, n)), du, dv)
