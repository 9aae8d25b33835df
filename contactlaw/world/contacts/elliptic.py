"""The law of elliptic contacts, a function called by address: most scenes do not need it."""

from collections import namedtuple

from numba import carray  # pyright: ignore[reportPrivateImportUsage]

from contactlaw.laws import ellipse
from contactlaw.memory import doubles_at

Nodes = namedtuple("Nodes", "x x2 w")


def advance_elliptic(c, numbers, memory, count, du, dv):
    """Update the tangential force of contact c by `laws.ellipse.advance`.

    numbers, memory: addresses of the law's parameters and of its history. count: number of nodes. du, dv: displacement
    of A over B along both tangents [m].
    """
    n = int(count)
    own = carray(doubles_at(numbers), 3 * n)
    ellipse.advance(c.touch, Nodes(own[:n], own[n : 2 * n], own[2 * n :]), carray(doubles_at(memory), (2, n)), du, dv)
