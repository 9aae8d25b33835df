"""Which two shapes make a pair, and which are near: first as whole shapes, then as the parts by which they meet.

Corners, edges and rims lie within their core. Two cores, or a core and a plane, are separated by two parallel planes;
all parts of a shape lie behind its plane. So one product excludes most of the hundreds of parts of a hull.
"""

from contactlaw.jit import jit_module
from contactlaw.memory import whole_at
from contactlaw.world.contacts.meeting import forget_place
from contactlaw.world.data.access import body_at, contact_at, guard_at, link_at, near_at, pair_at, shape_at, tree_at
from contactlaw.world.data.kinds import BOX, CORNER, EDGE, HEIGHT_FIELD, MEETS, PLANE, SEGMENT, SIDE, SPHERE, TANGENT
from contactlaw.world.data.records import CLOSED, NEVER, WIDE
from contactlaw.world.data.vec import ZERO, add, axpy, dot, load, norm, scale, sub, to_body
from contactlaw.world.near.guards import PARTS_STEPS, SLACK, hinge_separates, new_guard, separate
from contactlaw.world.shapes import geometry
from contactlaw.world.shapes.core import clip, local
from contactlaw.world.trees.kinematics import is_free

TREE_PARTS_STEPS = 1.0  # as PARTS_STEPS, in trees, of which each window goes through all near pairs


def meets(kind_a, kind_b):
    """Return whether shapes of two kinds can touch; kind_a <= kind_b."""
    return (MEETS[kind_a] >> kind_b) & 1 != 0


def pair_of(w, i, j):
    """Return the number of the pair of materials of shape i as A and shape j as B, or parts of them; -1: none."""
    sa, sb = shape_at(w.shapes, i), shape_at(w.shapes, j)
    still = body_at(w.bodies, sa.body).inverse_mass == 0.0 and body_at(w.bodies, sb.body).inverse_mass == 0.0
    if sa.body == sb.body or still or (sb.kind == TANGENT and sb.partner != i):
        return -1
    return whole_at(w.groups, sa.group * w.group_count + sb.group)


def can_touch(w, i, j):
    """Return whether shape i as A can touch shape j as B."""
    a, b = shape_at(w.shapes, i).kind, shape_at(w.shapes, j).kind
    return a <= b and meets(a, b) and pair_of(w, i, j) >= 0


def list_pair(w, i, j):
    """List two whole shapes, or their parts, if they make a pair and are near; shape i is of no higher kind."""
    sa, sb = shape_at(w.shapes, i), shape_at(w.shapes, j)
    if (not BOX <= sa.kind < PLANE and not meets(sa.kind, sb.kind)) or pair_of(w, i, j) < 0:
        return
    a, b = body_at(w.bodies, sa.body), body_at(w.bodies, sb.body)
    margin, guard = a.margin + b.margin, -1
    if sb.kind == HEIGHT_FIELD:
        d = add(sub(load(a.position), load(b.position)), sub(geometry.centre(sa, a), geometry.centre(sb, b)))
        (x, y, z), far = local(d, sb, b), margin + geometry.bounding_radius(sa)
        d = max(abs(x) - sb.half[0], 0.0), max(abs(y) - sb.half[1], 0.0), max(z, -sb.half[2] - z, 0.0)  # outside of it
        if dot(d, d) > far * far:
            return
    if sa.kind >= BOX:
        if hinge_separates(w, i, j):  # costs less than to find where both are nearest
            return
        n, low, high = separate(w, i, j, ZERO, margin)
        k = -1 if low - high > margin else new_guard(w, i, j)
        if k >= 0:
            list_by_parts(w, k, n, low, high)
        return
    gap, places = -NEVER, geometry.places_of(sa, sb)
    if places == 0:
        return
    if sb.kind != SPHERE and sb.kind != TANGENT:
        overlap, _, _, _ = geometry.meet(sa, a, sb, b)
        gap = -overlap
    if places > 1:  # the nearest place may have been missed, which `geometry.meet_place` seeks with more care
        margin += geometry.bounding_radius(sa)
        gap = gap if gap > margin else -NEVER
    if gap > margin:
        return
    if sa.kind >= SEGMENT or (sb.kind > SEGMENT and sb.kind != PLANE and sb.kind != TANGENT):
        guard = new_guard(w, i, j)
    for place in range(places):
        add_near(w, i, j + place, guard, gap)


def list_by_parts(w, k, n, low, high):
    """List the shapes of guard k by the parts by which they meet; n, low, high: of their `separate`.

    If their gap is above a margin, no parts are listed, and the guard's limit is the gap. Of two shapes that are built
    into each other only the pair of cores is listed, which is ignored. Gaps are of now, and a guard may have counted
    motion already.
    """
    g = guard_at(w.guards, k)
    i, j = g.a, g.b
    a, b, counted = body_at(w.bodies, g.body_a), body_at(w.bodies, g.body_b), g.moved - g.lag
    steps = PARTS_STEPS if (a.tree == 0 and b.tree == 0) or w.brief == WIDE else TREE_PARTS_STEPS
    near = SLACK * (a.size + b.size) + steps * w.step * g.speed
    if is_built_in(w, i, j, dot(n, n) == 0.0):
        g.limit, g.unlisted = NEVER, 1
        add_near(w, i, j, k, NEVER)
    elif low - high > near:
        g.limit, g.unlisted = low - high + counted, 1
    else:
        g.limit, g.unlisted = near + counted, 0
        sa, sb = shape_at(w.shapes, i), shape_at(w.shapes, j)
        d = sub(load(body_at(w.bodies, sa.body).position), load(body_at(w.bodies, sb.body).position))
        list_parts(w, (i, j), n, high - dot(n, d), (k, near, counted))
        list_parts(w, (j, i), scale(-1.0, n), -low, (k, near, counted))
        if meets(sa.kind, sb.kind):
            add_near(w, i, j, k, low - high + counted)


def is_built_in(w, i, j, overlap):
    """Return whether two cores count as built into each other, so that they do not touch until they have parted.

    They belong to one mechanism, a tree with what it hangs on and carries, and their cores overlapped when they were
    first looked at: no motion has brought them there, and there is no normal along which they could push. overlap:
    whether the cores overlap now.
    """
    sa, sb = shape_at(w.shapes, i), shape_at(w.shapes, j)
    if sb.kind >= PLANE or not meets(sa.kind, sb.kind):
        return False
    own, other = body_at(w.bodies, sa.body).tree, body_at(w.bodies, sb.body).tree
    if (own == 0 or own != other) and root_of(w, sa.body) != root_of(w, sb.body):
        return False
    slot = slot_of(w, i, j)
    if slot >= 0:
        return geometry.is_ignored(contact_at(w.contacts, slot))
    return overlap and pair_at(w.pairs, pair_of(w, i, j)).relaxed != 0


def root_of(w, i):
    """Return the first body of the mechanism of body i: of its tree, or what carries that, unless by a free joint."""
    b = body_at(w.bodies, i)
    if b.tree == 0:
        return i
    t, k = tree_at(b.tree, 0), b.member
    while link_at(t.links, k).parent >= 0:
        k = link_at(t.links, k).parent
    return t.first + k if is_free(t, link_at(t.links, k)) else t.hangs_on


def slot_of(w, i, j):
    """Return the slot of the contact of shapes i as A and j as B, or -1; see `listing.link_contacts`."""
    slot = whole_at(w.sweep, i)
    while slot >= 0 and contact_at(w.contacts, slot).shape_b != j:
        slot = contact_at(w.contacts, slot).link
    return slot


def list_parts(w, shapes, n, top, listing):
    """List the parts of the first of two shapes that are near the second.

    n, top: normal of the plane that the second shape lies behind, and its height [m] over the first one's centre of
    mass. listing: number of the guard; gap [m] up to which parts are near; motion [m] that it has counted. All parts at
    the top of a large floor are near that plane, so parts that are far from the sphere around the second shape are left
    out too.
    """
    (i, j), (guard, margin, counted) = shapes, listing
    other, body = shape_at(w.shapes, j), body_at(w.bodies, shape_at(w.shapes, i).body)
    to, far, n = ZERO, NEVER, to_body(body.axes, n)
    if other.kind < PLANE:
        b = body_at(w.bodies, other.body)
        to = add(sub(load(b.position), load(body.position)), geometry.centre(other, b))
        far = margin + geometry.bounding_radius(other)
    k = shape_at(w.shapes, i).next
    while k != 0:
        s = shape_at(w.shapes, k)
        gap = dot(n, load(s.at)) - s.radius - top
        if s.kind != CORNER:
            gap -= abs(dot(n, load(s.half))) if s.kind == EDGE else norm(load(s.half))
        twice = s.kind == SIDE and s.body < other.body  # two sides meet once
        if gap <= margin and meets(s.kind, other.kind) and not twice:
            d, u = sub(to, geometry.centre(s, body)), geometry.half_axis(s, body)
            if s.kind == EDGE:
                d, u = axpy(-clip(dot(d, u) / dot(u, u)), u, d), ZERO
            near = norm(d) - s.radius - norm(u) <= far
            if near and geometry.lies_over_face(s, body, other, body_at(w.bodies, other.body), margin):
                near = slot_of(w, k, j) >= 0  # it touched as it hung over the border: its energy must come back
            for place in range(geometry.places_of(s, other) if near else 0):
                add_near(w, k, j + place, guard, gap + counted)
        k = s.next


def add_near(w, i, j, guard, gap):
    """Add two shapes to the near list. guard: number of theirs, -1: none; gap: lower bound on theirs [m]."""
    if w.nears == w.near_room:
        w.left_out = 1 + i
        return
    p = near_at(w.near, w.nears)
    p.a, p.b, p.guard, p.listed_gap = i, j, guard, gap
    w.nears += 1


def complete_near(w, k):
    """Set the other fields of near pair k, whose shapes, guard and gap are known; link it to its contact, if any.

    Not to one of another pair of materials, whose law has another history: a later rule holds from then on.
    """
    p = near_at(w.near, k)
    p.body_a, p.body_b = shape_at(w.shapes, p.a).body, shape_at(w.shapes, p.b).body
    p.pair = pair_of(w, p.a, p.b)
    sb = shape_at(w.shapes, p.b)
    p.first, p.places = k - sb.place, geometry.places_of(shape_at(w.shapes, p.a), sb)
    p.slot, p.closed, p.active, p.initial_overlap, p.checked = -1, 0, 0, 0.0, -1.0
    p.toi, p.path_limit, p.gap, p.closing, p.acceleration, p.closing_bound = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    slot = slot_of(w, p.a, p.b)
    if slot >= 0 and contact_at(w.contacts, slot).pair == p.pair:
        c = contact_at(w.contacts, slot)
        p.slot, p.initial_overlap = slot, c.initial_overlap
        p.listed_gap = NEVER if geometry.is_ignored(p) else p.listed_gap
        p.closed = 1 if c.phase == CLOSED else 0
        c.near = k
    forget_place(w, p)


jit_module(__name__)
