"""The order of the near list: by A, then by B."""

from __future__ import annotations

from contactlaw.jit import jit_inside
from contactlaw.world.access import near_at


@jit_inside
def sort_near(w):
    """Sort the shapes of near pairs, of which nothing else is known yet (Shell's method, Knuth's gaps)."""
    gap = 1
    while 3 * gap < w.nears:
        gap = 3 * gap + 1
    while gap > 0:
        for k in range(gap, w.nears):
            p = near_at(w.near, k)
            a, b = p.a, p.b
            i = k
            while i >= gap and before(a, b, near_at(w.near, i - gap)):
                set_shapes(near_at(w.near, i), near_at(w.near, i - gap).a, near_at(w.near, i - gap).b)
                i -= gap
            set_shapes(near_at(w.near, i), a, b)
        gap //= 3


@jit_inside
def before(a, b, p):
    """Whether shapes a and b come before those of a near pair."""
    return a < p.a or (a == p.a and b < p.b)


@jit_inside
def set_shapes(p, a, b):
    """Make these the shapes of a near pair."""
    p.a = a
    p.b = b
