"""Which pairs of an island need a look: in a robot most of thousands are far from closing in any substep."""

from contactlaw.jit import jit_inline
from contactlaw.memory import set_whole, whole_at
from contactlaw.world.data.access import body_at, near_at
from contactlaw.world.data.vec import load, norm

LOOKAHEAD = 2.0  # substeps within which an open pair must be able to close for its gap to be measured
WATCHED = 34.0  # substeps for which the pairs that need a look are chosen: two of `island.BLOCK`, and LOOKAHEAD


@jit_inline
def update_paths(w, bodies, longer):
    """Add what surfaces moved in a substep to their paths, and predict the next substep, `longer` times as long.

    Contacts on each body are counted anew. Returns whether a body has left the path within which pairs that are not
    watched need no look, or will leave it in the next substep.
    """
    leaves = False
    for i in range(bodies):
        b = body_at(w.bodies, whole_at(w.island_bodies, i))
        way = norm(load(b.shift)) + (b.reach * norm(load(b.twist)) if b.reach > 0.0 else 0.0)
        b.path += way
        b.next_path = longer * way
        b.pressing = 0
        leaves = leaves or b.path + (LOOKAHEAD + 1.0) * b.next_path > b.watched_path
    return leaves


def watch(w, root):
    """List only those pairs of an island that may close within the next substeps; return how many these are.

    The rest need no look while the paths of all bodies stay within those that they are expected to have after WATCHED
    substeps.
    """
    i, k, pairs = root, body_at(w.bodies, root).head, 0
    while i >= 0:
        b = body_at(w.bodies, i)
        b.watched_path = b.path + WATCHED * b.next_path
        i = b.link
    while k >= 0:
        p = near_at(w.near, k)
        a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
        path = (a.watched_path if a.still == 0 else 0.0) + (b.watched_path if b.still == 0 else 0.0)
        if p.coasts == 0 and (p.closed != 0 or path >= p.path_limit):
            set_whole(w.island_pairs, pairs, k)
            pairs += 1
        k = p.link
    return pairs
