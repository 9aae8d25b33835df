"""Where the shapes of a closed contact meet, which know their last overlap and normal."""

from contactlaw.jit import jit, jit_inline
from contactlaw.world.data.access import contact_at, near_address, near_at, shape_at
from contactlaw.world.data.call import ask_separation
from contactlaw.world.data.kinds import BOX, EDGE, ELLIPSOID, SEGMENT
from contactlaw.world.data.quaternion import rotate
from contactlaw.world.data.records import NEVER
from contactlaw.world.data.vec import add, dot, load, norm, sub
from contactlaw.world.shapes import geometry
from contactlaw.world.shapes.core import clip, set_back

SAME = 1e-3  # of the radius of shape A, up to which two places on a height field are one


@jit_inline
def meet_closed(w, c, a, b):
    """Return `geometry.meet` for a closed contact, whose last place, overlap and normal are known."""
    p, sa, sb = near_at(w.near, c.near), shape_at(w.shapes, c.shape_a), shape_at(w.shapes, c.shape_b)
    if p.places > 1:
        return meet_apart(w, p, a, b)
    found = geometry.meet(sa, a, sb, b, near_address(p))
    if sb.separation == 0 or sb.kind == ELLIPSOID or not found[0] > 0.5 * geometry.overlap_of_cores(sa, sb):
        return found
    return meet_sunk(c, sa, a, sb, b, found)


@jit
def place_along(c, sa, a):
    """Return where a contact was last along a segment or an edge A, -1 to 1 from end to end; of other shapes zero."""
    if sa.kind != SEGMENT and sa.kind != EDGE:
        return 0.0
    u = geometry.half_axis(sa, a)
    return clip(dot(sub(load(c.arm_a), geometry.centre(sa, a)), u) / dot(u, u))


@jit
def meet_sunk(c, sa, a, sb, b, found):
    """Return `geometry.meet` where cores may overlap; found: what it gives now.

    There, the normal of least depth may jump, and a jump could add energy. The last normal is kept instead, fixed to B:
    the overlap is then the height of B's highest point along it above A's lowest. This begins as the cores touch. After
    they part, the true overlap is at most that along the kept normal, so no energy is gained. Shapes that overlapped at
    first contact have no such normal: it is not used where the overlap would exceed the last one, or `max_overlap`, by
    more than the surfaces have moved.
    """
    if sa.kind == ELLIPSOID:
        most, where, swept = geometry.overlap_of_cores(sa, sb), sa.separation, sb.radius
        least = most
    else:
        most, where = geometry.max_overlap(sa, sb), sb.separation
        swept = most if sa.kind < BOX else (1.0 - geometry.BACK) * most
        if sa.kind == EDGE:
            swept -= set_back(sa, geometry.half_axis(sa, a), place_along(c, sa, a))[0]
        least = swept
    if not found[0] > geometry.SUNK * least:
        return found
    held = rotate(load(b.twist), load(c.normal))
    held, low, high, lowest = ask_separation(where, sa, a, sb, b, held, NEVER)
    deeper = high - low + swept
    if deeper > max(c.touch.overlap + c.initial_overlap, most) + a.next_path + b.next_path:
        return found
    return deeper, held, lowest, add(lowest, sub(load(a.position), load(b.position)))


@jit
def meet_apart(w, p, a, b):
    """Return `geometry.meet_place` of a closed contact; without overlap if an earlier pair has the same place.

    Two places become one where a valley hardly is narrower than a ball.
    """
    overlap, n, arm_a, arm_b = geometry.meet_place(w, p, a, b)
    radius = shape_at(w.shapes, p.a).radius
    for i in range(p.first, p.first + p.places):
        q = near_at(w.near, i)
        earlier = q.closed != 0 and q.b < p.b
        if earlier and norm(sub(arm_a, load(contact_at(w.contacts, q.slot).arm_a))) < SAME * radius:
            overlap = min(overlap, -geometry.LOST * radius)
    return overlap, n, arm_a, arm_b
