"""Where two shapes are nearest: overlap, normal and the point of contact of spheres with spheres and planes."""

from __future__ import annotations

from contactlaw.jit import jit_inside
from contactlaw.world.records import SPHERE
from contactlaw.world.vec import add, axpy, dot, load, norm, scale, sub, to_world


@jit_inside
def centre(s, b):
    """Of a sphere, or point of a plane: from its body's centre of mass [m]."""
    if b.oriented == 0:
        return 0.0, 0.0, 0.0
    return to_world(b.axes, load(s.at))


@jit_inside
def meet(sa, a, sb, b):
    """Overlap [m], normal from B to A, and the arms of the point of contact from both centres of mass.

    The forces on both bodies act at one point, on the line of centres, so that they have no moment together: the point
    divides the distance of two spheres as their radii do; on a plane it is the sphere's lowest.
    """
    from_a, from_b = centre(sa, a), centre(sb, b)
    d = add(sub(load(a.position), load(b.position)), sub(from_a, from_b))
    if sb.kind == SPHERE:
        far = norm(d)
        n = scale(1.0 / max(far, 1e-300), d)
        both = sa.radius + sb.radius
        share = far / both
        return both - far, n, axpy(-share * sa.radius, n, from_a), axpy(share * sb.radius, n, from_b)
    n = to_world(b.axes, load(sb.normal))
    arm = axpy(-sa.radius, n, from_a)
    return sa.radius - dot(d, n), n, arm, add(arm, sub(load(a.position), load(b.position)))


@jit_inside
def effective_radius(sa, sb):
    """R [m], 1/R = 1/R_A + 1/R_B."""
    return sa.radius * sb.radius / (sa.radius + sb.radius) if sb.kind == SPHERE else sa.radius
