"""Nearest points of swept cores by GJK: hulls with all shapes.

While two of them overlap by less than the sum of radii their cores are apart, so that the vector between the nearest
points of the cores is unique and moves continuously. Flat on flat, a hull rests on its corners and sharp edges, which
are shapes of their own; two cores meet directly in one point only where neither lie between. The same holds for a
cylinder's rims and feet.
"""

from contactlaw.world.data.call import ask_deepest
from contactlaw.world.data.kinds import BOX, DISC, EDGE, PLANE, SEGMENT
from contactlaw.world.data.vec import ZERO, add, axpy, dot, load, norm, scale, sub, to_world
from contactlaw.world.shapes.core import deepest_on_line
from contactlaw.world.shapes.geometry import BACK, centre
from contactlaw.world.shapes.gjk import nearest, seek, support
from contactlaw.world.shapes.segments import clip

DEEP = 1e-6  # of the sum of radii: distance of cores up to which they count as overlapping


def meet(sa, a, sb, b, along):
    """`geometry.meet` with a hull."""
    radius_a, radius_b, from_a, u = sa.radius, sb.radius, centre(sa, a), ZERO
    if sa.kind == DISC:
        offset, radius_a = ask_deepest(sa.deepest, sa, a, sb, b, ZERO)
        from_a = add(from_a, offset)
        v, y, _, _ = nearest(sa, a, sb, b, offset)
    elif sa.kind == SEGMENT or sa.kind == EDGE:
        u = to_world(a.axes, load(sa.half))
        at, radius_a, (v, _, _, _) = deepest_on_line(ZERO, u, 0.0, (sa, a, sb, b), along)
        y = sub(add(sub(load(a.position), load(b.position)), axpy(at, u, from_a)), v)
    else:
        v, y, _, _ = nearest(sa, a, sb, b, ZERO)
    both = radius_a + radius_b
    distance = norm(v)
    if distance > DEEP * both:
        n = scale(1.0 / distance, v)
    else:  # as between two balls at the centres; of a line at its point nearest to the other centre
        n = sub(add(load(a.position), from_a), add(load(b.position), centre(sb, b)))
        n = axpy(clip(-dot(n, u) / max(dot(u, u), 1e-300)), u, n)
        n = scale(1.0 / max(norm(n), 1e-300), n)
    overlap = both - distance
    if sa.kind >= BOX:
        overlap -= BACK * both
    arm_b = axpy(distance / both * radius_b, n, y)
    arm_a = add(arm_b, sub(load(b.position), load(a.position)))
    return overlap, n, arm_a, arm_b


def seek_nearest(sa, a, sb, b, shift, known, simplex):
    """Return `gjk.seek` of a point and a hull, for `core.excess_at`.

    That is the vector from the hull, the number of vertices of the nearest feature, its edge, and the simplex.
    """
    v, _, count, e, corners = seek(sa, a, sb, b, shift, (int(known), simplex))
    return v, float(count), e, corners


def separate(sa, a, sb, b, n):
    """Find two parallel planes that separate a core A from a plane or a core B.

    n: their normal from B to A, or zero if it is to be found. Returns the normal, zero if the cores overlap; the least
    height of A along it and the greatest of B, without the radii that sweep them, from B's centre of mass [m]; and A's
    lowest point from its own centre of mass.
    """
    if sb.kind >= PLANE:
        n = to_world(b.axes, load(sb.normal))
        high = dot(n, centre(sb, b))
    else:
        if dot(n, n) == 0.0:
            v, _, _, _ = nearest(sa, a, sb, b, ZERO)
            n = scale(1.0 / max(norm(v), 1e-300), v)
        high = dot(n, support(sb, b, n))
    lowest = support(sa, a, scale(-1.0, n))
    return n, dot(n, add(sub(load(a.position), load(b.position)), lowest)), high, lowest
