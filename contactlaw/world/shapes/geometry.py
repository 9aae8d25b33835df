"""Overlap, normal, point of contact and effective radius of two shapes: spheres and planes here, others by address."""

from contactlaw.jit import jit_module
from contactlaw.world.data.access import contact_at, field_at, near_address, near_at, shape_at
from contactlaw.world.data.call import ask_beside, ask_meet
from contactlaw.world.data.kinds import BOX, CYLINDER, DISC, EDGE, ELLIPSOID, HEIGHT_FIELD, HULL, PLANE, SEGMENT, SPHERE
from contactlaw.world.data.records import NEVER
from contactlaw.world.data.vec import ZERO, add, axpy, dot, load, norm, scale, store, sub, to_world
from contactlaw.world.shapes.core import CROWN, NO_PLACES, local

ANY = (0.0, 0.0, 1.0)  # normal of concentric shapes, which have none of their own; a zero vector has no tangents
BACK = 0.05  # of the sum of radii, by which the contact of two cores is set back behind that of corners and edges
SUNK = 0.975  # share of `max_overlap`, less what sets back, from which cores may touch: crowns shorten it
IGNORED = 1e9  # [m] initial overlap of an ignored pair, more than any shapes overlap
PLACES = 4  # contacts of one shape with a height field at once, at most: flanks of a pit between four grid points
FOLLOW, NEAREST = -1, -2  # of `height_field.meet_beside`, instead of a number of places
LOST = 1e-9  # of the radius, the gap of a contact whose place has vanished


def centre(s, b):
    """Return a shape's centre, or a plane's point, from its body's centre of mass [m], world frame."""
    if b.oriented == 0:
        return 0.0, 0.0, 0.0
    return to_world(b.axes, load(s.at))


def meet(sa, a, sb, b, last=0):
    """Return overlap [m], normal from B to A, and the arms of the point of contact from both centres of mass [m].

    last: address of their near pair, which knows where they were nearest when they were last looked at; 0: not known.

    The forces on both bodies act at one point on the line of the centres, so that their moments cancel. Between two
    round shapes the point divides the distance as the radii do; on a plane or a core (a box, cylinder or hull) it is
    the deepest point of A's sphere. That sphere is centred at the point of A's middle line nearest to B; of a disc at
    its deepest point.
    """
    if sb.kind == HEIGHT_FIELD:
        return ask_beside(sb.beside, sa, a, sb, b, NEAREST, NO_PLACES, NO_PLACES)
    where = sb.meet if sb.meet != 0 and sa.kind != ELLIPSOID else sa.meet
    if where != 0:
        return ask_meet(where, sa, a, sb, b, last)
    from_a, from_b = centre(sa, a), centre(sb, b)
    d = add(sub(load(a.position), load(b.position)), sub(from_a, from_b))
    if sb.kind == SPHERE:
        return round_on_round(sa.radius, from_a, sb.radius, from_b, d)
    n = to_world(b.axes, load(sb.normal))
    arm = axpy(-sa.radius, n, from_a)
    return sa.radius - dot(d, n), n, arm, add(arm, sub(load(a.position), load(b.position)))


def forget_place(p):
    """Let a near pair not know where its shapes were nearest; see `meet`."""
    store(p.place, ZERO)
    p.vertices = 0


def recall(last):
    """Return where the shapes of a near pair were nearest, as `note` was told; see `meet`."""
    if last == 0:
        return ZERO, 0, NO_PLACES
    p = near_at(last, 0)
    return load(p.place), p.vertices, (load(p.feature[0]), load(p.feature[1]), load(p.feature[2]))


def note(last, place, count, on_b):
    """Let a near pair know where its shapes were nearest; see `meet`.

    place: of a disc A across both axes [m], and of a line A along it, -1 to 1 from end to end. count: of the vertices
    of a hull B, 0: not known; on_b: these along its body's axes.
    """
    if last != 0:
        p = near_at(last, 0)
        store(p.place, place)
        p.vertices = count
        for i in range(3 if count > 0 else 0):
            store(p.feature[i], on_b[i])


def meet_near(w, p, a, b):
    """Return `meet` of a near pair whose bodies are given, less the overlap that counts as none.

    Open pairs of a shape and a field seek the same place: what counts as none for one of them does so for all.
    """
    sa, sb = shape_at(w.shapes, p.a), shape_at(w.shapes, p.b)
    overlap, n, arm_a, arm_b = meet_place(w, p, a, b) if p.places > 1 else meet(sa, a, sb, b, near_address(p))
    initial = p.initial_overlap
    for i in range(p.first, p.first + p.places if p.closed == 0 and p.places > 1 else p.first):
        q = near_at(w.near, i)
        initial = max(initial, q.initial_overlap if q.closed == 0 else 0.0)
    return overlap - initial, n, arm_a, arm_b


def places_of(sa, sb):
    """Return in how many places shape A may touch B, more than one of a height field.

    A ball has one where no valley is narrower than itself. A line has none where no ridge is as sharp as that its
    middle can be lower over it than both ends are, by what it is set back.
    """
    if sb.kind != HEIGHT_FIELD or sa.kind == DISC or sa.kind == ELLIPSOID:
        return 1
    field = field_at(sb.points, 0)
    if sa.kind < SEGMENT:
        return PLACES if field.valley * sa.radius > 1.0 else 1
    return PLACES if 0.5 * field.ridge * dot(load(sa.half), load(sa.half)) > CROWN * sa.radius else 0


def takes_known_gap(w, p, now):
    """Return whether an earlier open pair of the same shape and field seeks the same place, see `meet_place`.

    If so, sets what that pair knows. now: time of the step [s] at which its gap must have been found; -1: at any.
    """
    for i in range(p.first, p.first + p.places):
        q = near_at(w.near, i)
        if q.closed == 0:
            if q.b == p.b or (now >= 0.0 and q.checked != now):
                return False
            p.toi, p.gap, p.closing, p.acceleration = q.toi, q.gap, q.closing, q.acceleration
            p.checked, p.path_limit, p.listed_gap = q.checked, q.path_limit, q.listed_gap
            return True
    return False


def meet_place(w, p, a, b):
    """Return `meet` of a shape that may touch a height field in several places.

    A closed pair has its own, which it follows; an open one has the nearest place that no other pair of both has.
    """
    sa, sb, held = shape_at(w.shapes, p.a), shape_at(w.shapes, p.b), 0
    one, two, three = (ZERO, ZERO), (ZERO, ZERO), (ZERO, ZERO)
    for i in range(p.first, p.first + p.places):
        q = near_at(w.near, i)
        if q.closed != 0 and (p.closed == 0 or q.b == p.b):
            c = contact_at(w.contacts, q.slot)
            one, two, three, held = (load(c.arm_a), load(c.normal)), one, two, held + 1
    held = FOLLOW if p.closed != 0 else held
    return ask_beside(sb.beside, sa, a, sb, b, held, (one[0], two[0], three[0]), (one[1], two[1], three[1]))


def bounding_radius(s):
    """Return the radius [m] of the sphere around a shape that is not a plane."""
    if s.kind < SEGMENT:
        return s.radius
    return (s.radius if s.kind < BOX else 0.0) + norm(load(s.half))


def max_overlap(sa, sb):
    """Return the overlap [m] beyond which a pair has no unique normal and no depth that changes continuously.

    That is where the core of a hull overlaps the other shape's; the core of a box or cylinder that of a shape other
    than a sphere, or the centre of an ellipsoid; and where an ellipsoid overlaps another one, or a hull, by their least
    radii.
    """
    if sb.kind < ELLIPSOID or sb.kind >= PLANE or (sa.kind < SEGMENT and sb.kind != HULL):
        return NEVER
    core = sb.kind == BOX or sb.kind == CYLINDER
    if core and sa.kind == ELLIPSOID:
        return max(sa.half[0], sa.half[1], sa.half[2]) + sb.radius
    return overlap_of_cores(sa, sb)


def overlap_of_cores(sa, sb):
    """Return the overlap [m] at which the swept cores touch, or the inscribed balls of least radius of ellipsoids."""
    core = sb.kind == BOX or sb.kind == CYLINDER
    return least_radius(sa) + (0.0 if core and sa.kind == SEGMENT else least_radius(sb))


def least_radius(s):
    """Return the least radius of curvature [m] of a round shape or an ellipsoid, or the radius that sweeps a core."""
    h = s.half
    return min(h[0], h[1], h[2]) ** 2 / max(h[0], h[1], h[2]) if s.kind == ELLIPSOID else s.radius


def is_ignored(p):
    """Return whether a pair, or its contact, is ignored until its shapes part: all its overlap counts as none."""
    return p.initial_overlap >= IGNORED


def set_initial_overlap(w, p, overlap):
    """Let `overlap` [m] of a pair count as none, or all overlap if it is too deep for a contact; returns the result."""
    most = max_overlap(shape_at(w.shapes, p.a), shape_at(w.shapes, p.b))
    p.initial_overlap = IGNORED if overlap >= SUNK * (1.0 - BACK) * most else overlap
    return p.initial_overlap


def round_on_round(radius_a, from_a, radius_b, from_b, d):
    """Return `meet` of two spheres; d: from the centre of B to that of A."""
    distance = norm(d)
    n = scale(1.0 / distance, d) if distance > 1e-300 else ANY
    both = radius_a + radius_b
    share = distance / both
    return both - distance, n, axpy(-share * radius_a, n, from_a), axpy(share * radius_b, n, from_b)


def half_axis(s, b):
    """Return a segment's half axis, or the vector from a disc's middle to its rim, world frame [m]; of balls zero."""
    return to_world(b.axes, load(s.half))


def lies_over_face(sa, a, sb, b, margin):
    """Return whether A is an edge that lies wholly over one face of a box B, by `margin` [m] inside the face's border.

    The edge's ends, where the corners are, are then as deep or deeper: the edge itself never touches.
    """
    if sa.kind != EDGE or sb.kind != BOX:
        return False
    d = add(sub(load(a.position), load(b.position)), sub(centre(sa, a), centre(sb, b)))
    p, q, beyond, over = local(d, sb, b), local(half_axis(sa, a), sb, b), 0, 0
    for i in range(3):
        if abs(p[i]) + abs(q[i]) + margin <= sb.half[i] - sb.radius:
            over += 1
        elif abs(p[i]) - abs(q[i]) >= sb.half[i] - 2.0 * sb.radius:
            beyond += 1
    return over == 2 and beyond == 1


jit_module(__name__)
