"""Where the shapes of a contact meet, which know their last overlap and normal, and its radius and axes there."""

from math import copysign, exp, sqrt

from contactlaw.jit import jit_inline, jit_module
from contactlaw.world.bodies.motion import max_inverse_inertia
from contactlaw.world.data.access import body_at, contact_at, near_address, near_at, pair_at, shape_at
from contactlaw.world.data.call import ask_separation
from contactlaw.world.data.kinds import BOX, DISC, EDGE, ELLIPSOID, PLANE, SEGMENT
from contactlaw.world.data.materials import law_of
from contactlaw.world.data.quaternion import rotate
from contactlaw.world.data.records import NEVER
from contactlaw.world.data.vec import ZERO, add, axpy, dot, load, norm, scale, store, sub
from contactlaw.world.shapes import geometry
from contactlaw.world.shapes.core import clip, set_back
from contactlaw.world.shapes.curvature import effective_radius, equivalent_radius, has_known_radius

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


def place_along(c, sa, a):
    """Return where a contact was last along a segment or an edge A, -1 to 1 from end to end; of other shapes zero."""
    if sa.kind != SEGMENT and sa.kind != EDGE:
        return 0.0
    u = geometry.half_axis(sa, a)
    return clip(dot(sub(load(c.arm_a), geometry.centre(sa, a)), u) / dot(u, u))


def forget_place(w, p):
    """Forget where both shapes of a pair were nearest last, but for where its contact is along a side."""
    geometry.forget_place(p)
    if p.slot >= 0:
        p.place[2] = place_along(contact_at(w.contacts, p.slot), shape_at(w.shapes, p.a), body_at(w.bodies, p.body_a))


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


def radius_of(w, p, a, b):
    """Return R [m] of a near pair where its bodies are."""
    n, arm_a, arm_b, given = ZERO, ZERO, ZERO, pair_at(w.pairs, p.pair).radius > 0.0
    if not (given or has_known_radius(shape_at(w.shapes, p.a), shape_at(w.shapes, p.b))):
        _, n, arm_a, arm_b = geometry.meet_near(w, p, a, b)
    return radius_where(w, p, a, b, n, arm_a, arm_b)[0]


def radius_where(w, p, a, b, n, arm_a, arm_b):
    """Return R [m] of a near pair where it meets, and the longer axis, see `curvature.effective_radius`.

    Contacts of a given radius are circular.
    """
    own = pair_at(w.pairs, p.pair).radius
    if own > 0.0:
        return own, (0.0, 0.0, 0.0)
    return effective_radius(shape_at(w.shapes, p.a), a, shape_at(w.shapes, p.b), b, n, arm_a, arm_b)


def longer_axis(c, way):
    """Return the direction across the normal of a vector of `radius_where`, as it was; its tangent if that is zero."""
    n, e = load(c.normal), load(c.tangent)
    across = axpy(-dot(way, n), n, way)
    size = norm(across)
    return scale(copysign(1.0 / size, dot(across, load(c.axis))), across) if size > 0.0 else e


def update_ellipse(w, c, a, b):
    """Set the longer axis of a contact where its bodies are, and the radii of rolling across and along the ellipse.

    Returns ln(q/p), see `curvature`.

    It turns with the places that touch: a coin may wobble round its rim that hardly spins. The radii R [m] are at most
    such that mu_r R <= sqrt(I/m), I: least moment of inertia. The spring k_r then oscillates at most 1.5 times as fast
    as the normal one, which substeps resolve. Where flat sides touch, R may be metres, far more than the bodies' size.
    """
    n, arm_a, arm_b = load(c.normal), load(c.arm_a), load(c.arm_b)
    radius, way = radius_where(w, near_at(w.near, c.near), a, b, n, arm_a, arm_b)
    store(c.axis, longer_axis(c, way))
    mobility = max_inverse_inertia(a) + max_inverse_inertia(b)
    most = 1.0 / (law_of(w, pair_at(w.pairs, c.pair)).rolling * sqrt(c.touch.mass * mobility) + 1e-300)
    root, oblong = 1.0, norm(way)  # of q/p
    if oblong > 0.0:
        root = exp(0.5 * oblong)
        radius /= equivalent_radius(1.0 / root, root)
    c.radii[0], c.radii[1] = min(radius / root, most), min(radius * root, most)
    return oblong


def share_of(t, sa, sb):
    """Return the share of a contact's stiffness and mass that shape A carries of it.

    Where edges or rims of two cores cross, each of both meets the other core, at one point. One that lies on a face,
    where its crown makes the radius larger than its own, does not.
    """
    crossed = (sa.kind == EDGE or sa.kind == DISC) and BOX <= sb.kind < PLANE and t.radius <= max(sa.radius, sb.radius)
    return 0.5 if crossed else 1.0


jit_module(__name__)
