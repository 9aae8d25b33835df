"""Whether a contact's radius of curvature is clear from its shapes."""

from __future__ import annotations

from contactlaw.jit import jit_inside
from contactlaw.world.data.access import body_at, shape_at
from contactlaw.world.data.records import BOX, CORNER, EDGE, SEGMENT
from contactlaw.world.data.vec import to_body
from contactlaw.world.shapes.geometry import meet

ALONG = 1.0 - 1e-9  # cosine of the angle between a normal and the axis of a box, where it is that of a face

UNCLEAR = "touching at the edge of a box, with R = {:.3g} m taken from the ball or capsule; give the pair its radius"


@jit_inside
def is_clear(w, c):
    """Whether two shapes touch where they have one radius: not at the edge of a box, nor with a capsule's side there.

    The parts of boxes and cylinders have radii by their definition.
    """
    sa, sb = shape_at(w.shapes, c.shape_a), shape_at(w.shapes, c.shape_b)
    if sa.kind == CORNER or EDGE <= sa.kind < BOX or sb.kind != BOX:
        return True
    if sa.kind == SEGMENT:
        return False
    a, b, clear = body_at(w.bodies, c.body_a), body_at(w.bodies, c.body_b), False
    _, normal, _, _ = meet(sa, a, sb, b)  # now: the contact's may be of before the box turned
    n = to_body(b.axes, normal)
    for i in range(3):
        clear = clear or abs(n[0] * sb.axes[i] + n[1] * sb.axes[3 + i] + n[2] * sb.axes[6 + i]) > ALONG
    return clear
