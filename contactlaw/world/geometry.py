"""Where two shapes are nearest: overlap, normal and the point of contact of round shapes with all others."""

from __future__ import annotations

from math import sqrt

from contactlaw.jit import jit_inside
from contactlaw.world.call import ask_deepest, ask_meeting, ask_radius
from contactlaw.world.core import deepest_on_line, nearest_on_core
from contactlaw.world.curvature import radius_between, rim, side_at
from contactlaw.world.records import BOX, DISC, EDGE, PLANE, SEGMENT, SIDE, SPHERE
from contactlaw.world.segments import CROWN, nearest_on_segments
from contactlaw.world.vec import add, axpy, dot, load, norm, scale, sub, to_world


@jit_inside
def centre(s, b):
    """Of a shape, or point of a plane: from its body's centre of mass [m]."""
    if b.oriented == 0:
        return 0.0, 0.0, 0.0
    return to_world(b.axes, load(s.at))


@jit_inside
def meet(sa, a, sb, b):
    """Overlap [m], normal from B to A, and the arms of the point of contact from both centres of mass.

    The forces on both bodies act at one point, on the line of centres, so that they have no moment together: the point
    divides the distance of two round shapes as their radii do; on a plane or a core, a box or a cylinder, it is the
    sphere's lowest. A core or a segment is met by the sphere around the nearest point of A's middle line, and a disc
    meets what it meets by the sphere around its deepest point.
    """
    if sa.meet != 0 or sb.meet != 0:
        o = ask_meeting(sa.meet if sa.meet != 0 else sb.meet, sa, a, sb, b)
        return o[0], (o[1], o[2], o[3]), (o[4], o[5], o[6]), (o[7], o[8], o[9])
    if sb.kind < PLANE and sb.kind != SPHERE:
        return meet_long(sa, a, sb, b)
    from_a, from_b = centre(sa, a), centre(sb, b)
    d = add(sub(load(a.position), load(b.position)), sub(from_a, from_b))
    if sb.kind == SPHERE:
        return round_on_round(sa.radius, from_a, sb.radius, from_b, d)
    n, radius = to_world(b.axes, load(sb.normal)), sa.radius
    if sa.kind == DISC:
        x, y, z, radius = ask_deepest(sa.deepest, sa, a, sb, b, d)
        d, from_a = add(d, (x, y, z)), add(from_a, (x, y, z))
    arm = axpy(-radius, n, from_a)
    return radius - dot(d, n), n, arm, add(arm, sub(load(a.position), load(b.position)))


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
def meet_long(sa, a, sb, b):
    """`meet` of a shape with a segment or a core."""
    from_a, from_b = centre(sa, a), centre(sb, b)
    d = add(sub(load(a.position), load(b.position)), sub(from_a, from_b))
    if sb.kind == SEGMENT:
        u, v = half_axis(sa, a), half_axis(sb, b)
        s, t = nearest_on_segments(d, u, sa.radius, v, sb.radius)
        d = sub(axpy(s, u, d), scale(t, v))
        radius_a, radius_b = sa.radius * (1.0 - CROWN * s * s), sb.radius * (1.0 - CROWN * t * t)
        return round_on_round(radius_a, axpy(s, u, from_a), radius_b, axpy(t, v, from_b), d)
    radius, rounding = sa.radius, sb.radius if sa.kind >= EDGE else 0.0
    if sa.kind == SEGMENT or sa.kind == EDGE:
        u = half_axis(sa, a)
        s, radius = deepest_on_line(d, u, rounding, (sa, a, sb, b))
        d, from_a = axpy(s, u, d), axpy(s, u, from_a)
    elif sa.kind == DISC or sa.kind == SIDE:
        x, y, z, radius = ask_deepest(sa.deepest, sa, a, sb, b, d)
        d, from_a = add(d, (x, y, z)), add(from_a, (x, y, z))
    far, n = nearest_on_core(d, sb, b, rounding)
    arm = axpy(-radius, n, from_a)
    return radius - far, n, arm, add(arm, sub(load(a.position), load(b.position)))


@jit_inside
def effective_radius(sa, a, sb, b):
    """R [m] where two shapes are nearest, 1/R = 1/R_A + 1/R_B of spheres, and the longer axis, see `curvature`.

    Boxes count as flat.
    """
    if sa.meet != 0 or sb.meet != 0 or (sb.curve != 0 and sa.kind < DISC):
        o = ask_radius(sa.curve if sa.meet != 0 else sb.curve, sa, a, sb, b)
        return o[0], (o[1], o[2], o[3])
    if sa.kind == DISC:
        return rim(sa, a)
    if sa.kind == SIDE:
        along, axis = dot(load(sa.half), load(sa.normal)), (0.0, 0.0, 1.0)
        across = sqrt(dot(load(sa.half), load(sa.half)) - along * along)
        one = 0.0, 1.0 / (sa.radius + across), to_world(a.axes, load(sa.normal))
        return radius_between(one, (0.0, 1.0 / sb.half[0], to_world(b.axes, to_world(sb.axes, axis))))
    if sb.kind >= BOX:
        return sa.radius, (0.0, 0.0, 0.0)
    if sb.kind != SEGMENT:
        return sa.radius * sb.radius / (sa.radius + sb.radius), (0.0, 0.0, 0.0)
    u, v = half_axis(sa, a), half_axis(sb, b)
    d = add(sub(load(a.position), load(b.position)), sub(centre(sa, a), centre(sb, b)))
    s, t = nearest_on_segments(d, u, sa.radius, v, sb.radius)
    return radius_between(side_at(sa, u, s, CROWN), side_at(sb, v, t, CROWN))
