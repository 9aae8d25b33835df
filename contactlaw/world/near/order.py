"""The order of the near list: by shape A, then by shape B."""

from contactlaw.jit import jit_inside
from contactlaw.memory import set_whole, whole_at
from contactlaw.world.data.access import near_at


@jit_inside
def sort_near(w, counts):
    """Sort near pairs of which only shapes, guard and gap are set: by counting for A, by insertion for B.

    counts: where `WORLD.grid` has room for one number for each shape.
    """
    for i in range(w.shape_count):
        set_whole(w.grid, counts + i, 0)
    for k in range(w.nears):
        place = counts + near_at(w.near, k).a
        set_whole(w.grid, place, whole_at(w.grid, place) + 1)
    first = 0
    for i in range(w.shape_count):
        count = whole_at(w.grid, counts + i)
        set_whole(w.grid, counts + i, first)
        first += count
    for k in range(w.nears):  # fields that are not set yet take the sorted shapes, guards and gaps
        p = near_at(w.near, k)
        i = whole_at(w.grid, counts + p.a)
        set_whole(w.grid, counts + p.a, i + 1)
        q = near_at(w.near, i)
        q.body_a, q.body_b, q.pair, q.gap = p.a, p.b, p.guard, p.listed_gap
    for k in range(w.nears):
        p = near_at(w.near, k)
        a, b, guard, listed = p.body_a, p.body_b, p.pair, p.gap
        i = k
        while i > 0 and near_at(w.near, i - 1).a == a and near_at(w.near, i - 1).b > b:
            before, q = near_at(w.near, i - 1), near_at(w.near, i)
            q.a, q.b, q.guard, q.listed_gap = a, before.b, before.guard, before.listed_gap
            i -= 1
        q = near_at(w.near, i)
        q.a, q.b, q.guard, q.listed_gap = a, b, guard, listed
