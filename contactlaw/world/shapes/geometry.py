"""Where two shapes are nearest: overlap, normal and the point of contact of round shapes with all others."""

from __future__ import annotations

from numba import types

from contactlaw.jit import jit_inside
from contactlaw.memory import whole_at
from contactlaw.world.data.access import body_at, shape_at
from contactlaw.world.data.call import ask_deepest, ask_meeting, ask_radius
from contactlaw.world.data.records import (
    BOX,
    CORNER,
    CYLINDER,
    DISC,
    EDGE,
    ELLIPSOID,
    HULL,
    NEVER,
    PLANE,
    SEGMENT,
    SIDE,
    SPHERE,
)
from contactlaw.world.data.vec import add, axpy, dot, load, norm, scale, sub, to_body, to_world

BACK = 0.02  # of both radii, that two cores lie deeper than their corners and edges do
SUNK = 0.975  # of `max_overlap`, what crowns and BACK leave of it
IGNORED = 1e9  # [m] that count as none: more than any shapes overlap
ALIGNED = 1.0 - 1e-9  # cosine of the angle between a normal and the axis of a box, where it is that of a face

UNCLEAR = "touching at the edge of a box, with R = {:.3g} m taken from the ball or capsule; give the pair its radius"
OF_MEETING, OF_RADIUS, OF_TIME, OF_FACE = range(4)
"""Which of the addresses of `swept.TABLE`."""


@jit_inside
def centre(s, b):
    """Of a shape, or point of a plane: from its body's centre of mass [m]."""
    if b.oriented == 0:
        return 0.0, 0.0, 0.0
    return to_world(b.axes, load(s.at))


@jit_inside
def function_for(sa, sb, what):
    """Address of a function of two shapes of which one is swept, see `swept.TABLE`."""
    return types.uint64(whole_at(sb.swept if sb.swept != 0 else sa.swept, what))


@jit_inside
def meet(sa, a, sb, b):
    """Overlap [m], normal from B to A, and the arms of the point of contact from both centres of mass.

    The forces on both bodies act at one point, on the line of centres, so that they have no moment together: the point
    divides the distance of two round shapes as their radii do; on a plane or a core, a box or a cylinder, it is the
    sphere's lowest. A core or a segment is met by the sphere around the nearest point of A's middle line, and a disc
    meets what it meets by the sphere around its deepest point.
    """
    where = sa.meet if sa.meet != 0 else sb.meet
    if where == 0 and sb.kind < PLANE and sb.kind != SPHERE:
        where = function_for(sa, sb, OF_MEETING)
    if where != 0:
        return ask_meeting(where, sa, a, sb, b)
    from_a, from_b = centre(sa, a), centre(sb, b)
    d = add(sub(load(a.position), load(b.position)), sub(from_a, from_b))
    if sb.kind == SPHERE:
        return round_on_round(sa.radius, from_a, sb.radius, from_b, d)
    n, radius = to_world(b.axes, load(sb.normal)), sa.radius
    if sa.kind == DISC:
        way, radius = ask_deepest(sa.deepest, sa, a, sb, b, d)
        d, from_a = add(d, way), add(from_a, way)
    arm = axpy(-radius, n, from_a)
    return radius - dot(d, n), n, arm, add(arm, sub(load(a.position), load(b.position)))


@jit_inside
def meet_near(w, p, a, b):
    """`meet` of a near pair whose bodies are given, without the overlap that counts as none."""
    overlap, n, arm_a, arm_b = meet(shape_at(w.shapes, p.a), a, shape_at(w.shapes, p.b), b)
    return overlap - p.initial_overlap, n, arm_a, arm_b


@jit_inside
def max_overlap(sa, sb):
    """Overlap [m] beyond which there is no one normal, and no depth that changes continuously.

    So within the core of a hull; for what is not a sphere, within that of a box or a cylinder; where the middle of an
    ellipsoid is deep in one; and of an ellipsoid and another one, or a hull, at their least radii of curvature.
    """
    if sb.kind < ELLIPSOID or sb.kind >= PLANE or (sa.kind < SEGMENT and sb.kind != HULL):
        return NEVER
    core = sb.kind == BOX or sb.kind == CYLINDER
    if core and sa.kind == ELLIPSOID:
        return max(sa.half[0], sa.half[1], sa.half[2]) + sb.radius
    return overlap_of_cores(sa, sb)


@jit_inside
def overlap_of_cores(sa, sb):
    """Overlap [m] beyond which what they sweep, or the ball in an ellipsoid's tip, is in each other too."""
    core = sb.kind == BOX or sb.kind == CYLINDER
    return curl(sa) + (0.0 if core and sa.kind == SEGMENT else curl(sb))


@jit_inside
def curl(s):
    """Least radius of curvature of a round shape, of an ellipsoid, or of what sweeps a core [m]."""
    h = s.half
    return min(h[0], h[1], h[2]) ** 2 / max(h[0], h[1], h[2]) if s.kind == ELLIPSOID else s.radius


@jit_inside
def is_ignored(p):
    """Whether all overlap of a pair counts as none."""
    return p.initial_overlap >= IGNORED


@jit_inside
def set_initial_overlap(w, p, overlap):
    """Let so much overlap [m] of a pair count as none; of shapes too deep in each other all, until they part."""
    most = max_overlap(shape_at(w.shapes, p.a), shape_at(w.shapes, p.b))
    p.initial_overlap = IGNORED if overlap >= SUNK * most else overlap
    return p.initial_overlap


@jit_inside
def round_on_round(radius_a, from_a, radius_b, from_b, d):
    """`meet` of two spheres; d: from the centre of B to that of A."""
    far = norm(d)
    n = scale(1.0 / max(far, 1e-300), d)
    both = radius_a + radius_b
    share = far / both
    return both - far, n, axpy(-share * radius_a, n, from_a), axpy(share * radius_b, n, from_b)


@jit_inside
def half_axis(s, b):
    """From the middle of a segment to its end, or of a disc to its border, in the world [m]; zero for a sphere."""
    if s.kind < SEGMENT:
        return 0.0, 0.0, 0.0
    return to_world(b.axes, load(s.half))


@jit_inside
def effective_radius(sa, a, sb, b):
    """R [m] where two shapes are nearest, 1/R = 1/R_A + 1/R_B of spheres, and the longer axis, see `curvature`.

    Boxes count as flat.
    """
    where = types.uint64(0)
    if sa.meet != 0 or sb.meet != 0 or (sb.curve != 0 and sa.kind < DISC):
        where = sa.curve if sa.meet != 0 else sb.curve
    elif sb.kind == SEGMENT or sa.kind == DISC or sa.kind == SIDE:
        where = function_for(sa, sb, OF_RADIUS)
    if where != 0:
        return ask_radius(where, sa, a, sb, b)
    return sa.radius if sb.kind >= BOX else sa.radius * sb.radius / (sa.radius + sb.radius), (0.0, 0.0, 0.0)


@jit_inside
def radius_is_clear(w, c):
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
        clear = clear or abs(n[0] * sb.axes[i] + n[1] * sb.axes[3 + i] + n[2] * sb.axes[6 + i]) > ALIGNED
    return clear
