"""Broad phase: which shapes are near each other, found by a sweep along one axis and kept for several steps.

Each body has a margin [m] by which its surface may travel, rotation included. Two shapes are near if their margins
overlap. Near pairs are listed anew once a body could leave its margin. The spheres around all shapes, with their
margins, are sorted by where they begin along one axis; each is compared with those that begin before it ends (sweep and
prune, Cohen and others 1995). Those of planes have no end. The list is sorted by shapes, so that sums over it do not
depend on when it was made.
"""

from math import sqrt

from contactlaw.jit import jit_module
from contactlaw.memory import doubles_at, set_whole, whole_at
from contactlaw.world.bodies.motion import wake_body
from contactlaw.world.contacts.touch import begin_contact, end_contact, release
from contactlaw.world.data.access import body_at, contact_at, guard_at, near_at, shape_at
from contactlaw.world.data.kinds import BOX, END, PARTS, PLANE, SEGMENT, TANGENT
from contactlaw.world.data.records import CLOSED, FREE, NEVER, PARTED, WIDE
from contactlaw.world.data.vec import ZERO, add, dot, load, norm, store, sub
from contactlaw.world.near.guards import EXCEEDED, KEPT, SLACK, has_shapes, separate, surface_speed
from contactlaw.world.near.pairing import complete_near, list_by_parts, list_pair
from contactlaw.world.shapes.geometry import bounding_radius, centre, meet

# Steps that margins last at present speeds. More where few bodies have many shapes: the cost of listing grows with the
# shapes, that of going through the list in each window with the bodies.
MARGIN_STEPS = 4.0
TREE_MARGIN_STEPS = 2.0  # the same where most of many shapes belong to trees: their speed bounds are wide
PARTS_MARGIN_STEPS = 16.0  # the same where most shapes have parts: guards tell cheaply which of these are near
BRIEF_STEPS = 1.0  # the same where a list serves for one step, see `WORLD.brief`
# Bodies among which margins last one step: each step has many windows, and each goes through the list. These margins
# allow for impacts too, see `set_margins`.
MANY_BODIES = 256
MANY = 50  # whole shapes besides ends of capsules
SHRINK = 1.3  # factor of the gaps of a comb sort (Lacey & Box, Byte 16 (1991) 315)


def is_part(s):
    """Return whether a shape is a part of another one, or a further place on a height field."""
    return s.kind in PARTS or s.place > 0


def travelled(b):
    """Return how far [m] any point of a body's shapes may have moved since near pairs were listed."""
    return norm(sub(load(b.position), load(b.listed_position))) + b.turned * b.reach


def way_ahead(b, left):
    """Return how far [m] the surface of a body may move in a time [s], and some more that contacts may move it by."""
    return KEPT * b.size + (0.0 if b.still != 0 else left * surface_speed(b, left))


def may_leave_margin(b, left, gained=0.0):
    """Return whether a body may leave its margin within a time [s]; gained: speed [m/s] that impacts may give it."""
    if not has_shapes(b):
        return False
    return travelled(b) + (0.0 if b.still != 0 else left * (surface_speed(b, left) + gained)) > b.margin


def list_near(w):
    """List near pairs anew; contacts keep their state.

    The margins are for several steps, or for one step if the arrays are too small for that many near pairs.
    """
    wholes, ends, cores, jointed = 0, 0, 0, 0  # cores: by how many they outnumber round shapes; jointed: those of trees
    for i in range(w.whole_count):
        s = shape_at(w.shapes, i)
        wholes += 0 if is_part(s) else 1
        jointed += 1 if not is_part(s) and body_at(w.bodies, s.body).tree != 0 else 0
        ends += 1 if s.kind == END else 0
        if not is_part(s) and s.kind != END and s.kind < PLANE:
            cores += 1 if s.kind >= BOX else -1
    have_parts = wholes < w.shape_count and cores >= 0
    steps = TREE_MARGIN_STEPS if 2 * jointed > wholes > MANY + ends else MARGIN_STEPS
    lasts = PARTS_MARGIN_STEPS if have_parts else steps * max(sqrt(wholes) / w.body_count, 1.0)
    lasts = MARGIN_STEPS if w.brief == WIDE else min(lasts, BRIEF_STEPS) if w.brief != 0 else lasts
    left_out, w.left_out = w.left_out, 0
    link_contacts(w)
    list_within(w, lasts if w.body_count <= MANY_BODIES else 1.0)
    if w.left_out > 0:
        w.left_out = 0
        list_within(w, 1.0)
    w.left_out = max(w.left_out, left_out)
    complete_list(w)
    w.lists += 1
    w.stale = 0


def list_parts_anew(w):
    """List the near parts anew of shapes whose guard is EXCEEDED; other near pairs stay listed.

    Bodies that turn against each other leave the limits of their guards in most steps, but hardly ever their margins.
    """
    left_out, w.left_out, kept = w.left_out, 0, 0
    link_contacts(w)
    for k in range(w.nears):
        p = near_at(w.near, k)
        if p.guard < 0 or guard_at(w.guards, p.guard).limit != EXCEEDED:
            q = near_at(w.near, kept)
            q.a, q.b, q.guard, q.listed_gap = p.a, p.b, p.guard, p.listed_gap
            kept += 1
    w.nears = kept
    for k in range(w.guard_count):
        g = guard_at(w.guards, k)
        if g.limit == EXCEEDED:
            n, low, high = separate(w, g.a, g.b, ZERO)
            list_by_parts(w, k, n, low, high)
    full, w.left_out = w.left_out > 0, left_out
    if full:  # margins for several steps take too much room
        list_near(w)
    else:
        complete_list(w)


def complete_list(w):
    """Sort near pairs, of which only shapes, guard and gap are set, and link contacts to them."""
    sort_near(w, w.shape_count)
    for k in range(w.nears):
        complete_near(w, k)
        p = near_at(w.near, k)
        if p.slot < 0 and p.guard >= 0 and guard_at(w.guards, p.guard).unlisted != 0:  # shapes built into each other
            a, b = body_at(w.bodies, p.body_a), body_at(w.bodies, p.body_b)
            overlap, _, _, _ = meet(shape_at(w.shapes, p.a), a, shape_at(w.shapes, p.b), b)
            if begin_contact(w, k, overlap):
                end_contact(p, contact_at(w.contacts, p.slot))
    list_near_bodies(w)
    for slot in range(w.slots):
        c = contact_at(w.contacts, slot)
        if c.near < 0 and (c.phase == CLOSED or (c.phase == PARTED and c.initial_overlap > 0.0)):
            for k in (c.body_a, c.body_b):  # one was placed elsewhere, or they no longer touch by rule
                if body_at(w.bodies, k).asleep != 0:
                    wake_body(body_at(w.bodies, k), 0.0)
            release(w, slot)


def list_within(w, steps):
    """List the shapes that are near within margins for a number of steps.

    `WORLD.sweep`, by shapes: first contacts, see `link_contacts`; of each sphere where it begins, its centre, radius
    with margin, and shape. Spheres that stand still are left out where none that moves is.
    """
    set_margins(w, steps * w.step)
    w.nears, w.guard_count = 0, 0
    n, count, axis = w.shape_count, 0, 0
    low, high = moving_box(w)
    for k in range(1, 3):
        axis = k if high[k] - low[k] > high[axis] - low[axis] else axis
    begin, x, y, z, r, numbers = n, 2 * n, 3 * n, 4 * n, 5 * n, 6 * n
    spheres = doubles_at(w.sweep)
    for i in range(w.whole_count):
        s = shape_at(w.shapes, i)
        if s.kind == TANGENT:
            list_pair(w, s.partner, i)
        elif s.kind != END and not is_part(s):
            at, radius = sphere_of(w, s)
            meets = True  # not if it is lost, at NaN
            for k in range(3):
                meets = meets and at[k] - radius <= high[k] and at[k] + radius >= low[k]
            spheres[begin + count] = at[axis] - radius
            set_whole(w.sweep, numbers + count, i)
            count += 1 if meets else 0
    sort(spheres, begin, w.sweep, numbers, count)
    for k in range(count):
        at, spheres[r + k] = sphere_of(w, shape_at(w.shapes, whole_at(w.sweep, numbers + k)))
        spheres[x + k], spheres[y + k], spheres[z + k] = at
    for k in range(count):
        i, own, at = whole_at(w.sweep, numbers + k), spheres[r + k], (spheres[x + k], spheres[y + k], spheres[z + k])
        end, j = at[axis] + own, k + 1
        while j < count and spheres[begin + j] <= end:
            far, d = own + spheres[r + j], sub(at, (spheres[x + j], spheres[y + j], spheres[z + j]))
            if dot(d, d) <= far * far:
                other = whole_at(w.sweep, numbers + j)
                list_spheres(w, max(i, other), min(i, other))
            j += 1


def list_spheres(w, i, j):
    """List two whole shapes whose spheres overlap, and a capsule's ends, which follow its side, with what is flat."""
    if shape_at(w.shapes, i).kind > shape_at(w.shapes, j).kind:
        i, j = j, i
    both = shape_at(w.shapes, i).kind == SEGMENT and shape_at(w.shapes, j).kind >= BOX
    for k in range(3 if both else 1):
        list_pair(w, i + k, j)


def moving_box(w):
    """Return the least and the greatest coordinates of the spheres of all that contacts can move."""
    low, high = (NEVER, NEVER, NEVER), (-NEVER, -NEVER, -NEVER)
    for i in range(w.whole_count):
        s = shape_at(w.shapes, i)
        if body_at(w.bodies, s.body).inverse_mass != 0.0 and s.kind != END and not is_part(s):
            (x, y, z), r = sphere_of(w, s)
            if x + y + z - r < NEVER:  # it is not lost
                low = min(low[0], x - r), min(low[1], y - r), min(low[2], z - r)
                high = max(high[0], x + r), max(high[1], y + r), max(high[2], z + r)
    return low, high


def sphere_of(w, s):
    """Return the centre of the sphere around a whole shape, and its radius with the margin; of a plane without end."""
    b = body_at(w.bodies, s.body)
    radius = NEVER if s.kind >= PLANE else bounding_radius(s)
    return add(load(b.position), centre(s, b)), b.margin + radius


def sort(keys, first, numbers, start, count):
    """Sort `count` keys from the first one on, and the whole numbers that belong to them, by a comb sort."""
    gap, swapped = count, True
    while gap > 1 or swapped:
        gap, swapped = max(int(gap / SHRINK), 1), False
        for i in range(count - gap):
            if keys[first + i] > keys[first + i + gap]:
                keys[first + i], keys[first + i + gap] = keys[first + i + gap], keys[first + i]
                own, other = whole_at(numbers, start + i), whole_at(numbers, start + i + gap)
                set_whole(numbers, start + i, other)
                set_whole(numbers, start + i + gap, own)
                swapped = True


def list_near_bodies(w):
    """List the bodies that are in a near pair or in a tree: no other body can be struck until the next list."""
    for i in range(w.body_count):
        body_at(w.bodies, i).active = 0
    for k in range(w.nears):
        p = near_at(w.near, k)
        body_at(w.bodies, p.body_a).active = 1
        body_at(w.bodies, p.body_b).active = 1
    w.near_body_count = 0
    for i in range(w.body_count):
        if body_at(w.bodies, i).active != 0 or body_at(w.bodies, i).tree != 0:
            set_whole(w.near_bodies, w.near_body_count, i)
            w.near_body_count += 1


def set_margins(w, time):
    """Set the margins of all bodies for a time [s] at their speed bounds within a step, from their present positions.

    A body that is behind in time is not moved first, as its rounding would then depend on margins. The motion that it
    has to make up for uses part of its margin.
    """
    total = 0.0
    for i in range(w.body_count):
        b = body_at(w.bodies, i)
        store(b.listed_position, load(b.position))
        b.turned = 0.0
        b.margin = 0.0 if b.still != 0 else time * surface_speed(b, w.step)
        total += b.margin if b.margin < NEVER else 0.0  # of a body that is lost
    impact_margin = total / w.body_count if w.body_count > MANY_BODIES else 0.0
    for i in range(w.body_count):
        b = body_at(w.bodies, i)
        b.margin += SLACK * b.size + (0.0 if b.inverse_mass == 0.0 else impact_margin)


def link_contacts(w):
    """Link the contacts of each shape A into a list; see `pairing.slot_of`."""
    for i in range(w.shape_count):
        set_whole(w.sweep, i, -1)
    for slot in range(w.slots):
        c = contact_at(w.contacts, slot)
        if c.phase != FREE:
            c.near = -1
            c.link = whole_at(w.sweep, c.shape_a)
            set_whole(w.sweep, c.shape_a, slot)


def sort_near(w, counts):
    """Sort near pairs of which only shapes, guard and gap are set: by counting for B, then for A, in that order.

    counts: where `WORLD.sweep` has room for one number for each shape.
    """
    for by_a in range(2):
        for i in range(w.shape_count):
            set_whole(w.sweep, counts + i, 0)
        for k in range(w.nears):
            p = near_at(w.near, k)
            place = counts + (p.a if by_a != 0 else p.b)
            set_whole(w.sweep, place, whole_at(w.sweep, place) + 1)
        first = 0
        for i in range(w.shape_count):
            count = whole_at(w.sweep, counts + i)
            set_whole(w.sweep, counts + i, first)
            first += count
        for k in range(w.nears):  # fields that are not set yet take the sorted shapes, guards and gaps
            p = near_at(w.near, k)
            place = counts + (p.a if by_a != 0 else p.b)
            q = near_at(w.near, whole_at(w.sweep, place))
            set_whole(w.sweep, place, whole_at(w.sweep, place) + 1)
            q.body_a, q.body_b, q.pair, q.gap = p.a, p.b, p.guard, p.listed_gap
        for k in range(w.nears):
            p = near_at(w.near, k)
            p.a, p.b, p.guard, p.listed_gap = p.body_a, p.body_b, p.pair, p.gap


jit_module(__name__)
