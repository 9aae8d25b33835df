"""Broad phase: which shapes are near each other, found by grids of several widths and kept for several steps.

Each body has a margin [m] by which its surface may travel, rotation included. Two shapes are near if their margins
overlap. Near pairs are listed anew once a body could leave its margin. The spheres around all shapes but planes are
sorted into cells as wide as the spheres with their margins, rounded up to a power of two. A shape is compared with
those in cells of its own width and wider. The list is sorted by shapes, so that sums over it do not depend on when it
was made.
"""

from math import ceil, floor, log2, sqrt

from numba import types

from contactlaw.jit import jit_module
from contactlaw.memory import doubles_at, set_whole, whole_at
from contactlaw.world.bodies.motion import wake_body
from contactlaw.world.contacts.touch import begin_contact, end_contact, release
from contactlaw.world.data.access import body_at, contact_at, guard_at, near_at, shape_at
from contactlaw.world.data.kinds import BOX, END, PARTS, PLANE, TANGENT
from contactlaw.world.data.records import CLOSED, FREE, NEVER, PARTED, WIDE
from contactlaw.world.data.vec import ZERO, add, dot, load, norm, store, sub
from contactlaw.world.near.guards import EXCEEDED, SLACK, has_shapes, separate, surface_speed
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
FEW = 256  # whole shapes: so many are compared with all others sooner than sorted into a grid


def is_part(s):
    """Return whether a shape is a part of another one, or a further place on a height field."""
    return s.kind in PARTS or s.place > 0


def travelled(b):
    """Return how far [m] any point of a body's shapes may have moved since near pairs were listed."""
    return norm(sub(load(b.position), load(b.listed_position))) + b.turned * b.reach


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
    have_parts, few = wholes < w.shape_count and cores >= 0, w.whole_count <= FEW
    steps = TREE_MARGIN_STEPS if 2 * jointed > wholes > MANY + ends else MARGIN_STEPS
    lasts = PARTS_MARGIN_STEPS if have_parts else steps * max(sqrt(wholes) / w.body_count, 1.0)
    lasts = MARGIN_STEPS if w.brief == WIDE else min(lasts, BRIEF_STEPS) if w.brief != 0 else lasts
    left_out, w.left_out = w.left_out, 0
    link_contacts(w)
    list_within(w, lasts if w.body_count <= MANY_BODIES else 1.0, few)
    if w.left_out > 0:
        w.left_out = 0
        list_within(w, 1.0, few)
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
    sort_near(w, w.cells)
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


def list_within(w, steps, few):
    """List the shapes that are near within margins for a number of steps; few: see `list_few`."""
    smallest = set_margins(w, steps * w.step)
    w.nears, w.guard_count = 0, 0
    if few:
        list_few(w)
        return
    shapes = w.shape_count
    # `WORLD.grid`: first shape of each cell; then of each shape the next one in its cell, level, contacts, cell's key
    cells = w.cells
    for i in range(cells):
        set_whole(w.grid, i, -1)
    levels, moving = 0, 0  # bits: those that have shapes, and shapes of bodies that contacts can move
    for i in range(w.whole_count):
        s = shape_at(w.shapes, i)
        if s.kind < PLANE and not is_part(s):
            wide = 2.0 * (bounding_radius(s) + body_at(w.bodies, s.body).margin)
            level = max(ceil(log2(wide / smallest) - 1e-9), 0)  # cells of level 0 are as wide as the smallest shape
            levels |= 1 << level
            moving |= 0 if body_at(w.bodies, s.body).inverse_mass == 0.0 else 1 << level
            set_whole(w.grid, cells + shapes + i, level)
            x, y, z = cell_of(w, i, smallest * 2.0**level)
            key = key_of(x, y, z, level)
            cell = hash_of(key, cells)
            set_whole(w.grid, cells + 3 * shapes + i, key)
            set_whole(w.grid, cells + i, whole_at(w.grid, cell))
            set_whole(w.grid, cell, i)
    for i in range(w.whole_count):
        s = shape_at(w.shapes, i)
        if is_part(s):
            continue
        if s.kind == TANGENT:
            list_pair(w, s.partner, i)
            continue
        if s.kind >= PLANE:
            for j in range(w.whole_count):
                if shape_at(w.shapes, j).kind < PLANE and not is_part(shape_at(w.shapes, j)):
                    list_pair(w, max(i, j), min(i, j))
            continue
        own = whole_at(w.grid, cells + shapes + i)
        partners = moving if body_at(w.bodies, s.body).inverse_mass == 0.0 else levels
        for level in range(own, 63):
            if partners >> level == 0:
                break
            if (partners >> level) & 1:
                list_around(w, i, level, smallest * 2.0**level, cells)


def list_few(w):
    """List the shapes that are near, by comparing the spheres around them with each other; those of planes have no end.

    `WORLD.grid`: centres and radii, with margins, and numbers of flat shapes, then of round ones. Ends of capsules,
    which come last, meet flat shapes only.
    """
    spheres, y, z, r = doubles_at(w.grid), w.shape_count, w.cells, w.cells + w.shape_count
    numbers, flat, count = w.cells + 3 * w.shape_count, 0, 0
    for stage in range(3):
        for i in range(w.whole_count):
            s = shape_at(w.shapes, i)
            if is_part(s) or stage != (0 if s.kind >= BOX else 2 if s.kind == END else 1):
                continue
            if s.kind == TANGENT:
                list_pair(w, s.partner, i)
                continue
            b = body_at(w.bodies, s.body)
            at, own = add(load(b.position), centre(s, b)), b.margin + (NEVER if s.kind >= PLANE else bounding_radius(s))
            for k in range(flat if stage == 2 else count):
                far, d = own + spheres[r + k], sub(at, (spheres[k], spheres[y + k], spheres[z + k]))
                if dot(d, d) <= far * far:
                    list_pair(w, i, whole_at(w.grid, numbers + k))
            if stage < 2:
                spheres[count], spheres[y + count], spheres[z + count], spheres[r + count] = at[0], at[1], at[2], own
                set_whole(w.grid, numbers + count, i)
                count += 1
                flat += 1 - stage


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

    Returns the width [m] of the smallest shape with its margin. A body that is behind in time is not moved first, as
    its rounding would then depend on margins. The motion that it has to make up for uses part of its margin.
    """
    total = 0.0
    for i in range(w.body_count):
        b = body_at(w.bodies, i)
        store(b.listed_position, load(b.position))
        b.turned, b.guard = 0.0, -1
        b.margin = 0.0 if b.still != 0 else time * surface_speed(b, w.step)
        total += b.margin
    impact_margin = total / w.body_count if w.body_count > MANY_BODIES else 0.0
    for i in range(w.body_count):
        b = body_at(w.bodies, i)
        b.margin += SLACK * b.size + (0.0 if b.inverse_mass == 0.0 else impact_margin)
    smallest = NEVER
    for i in range(w.whole_count):
        s = shape_at(w.shapes, i)
        if s.kind < PLANE and not is_part(s):
            smallest = min(smallest, 2.0 * (bounding_radius(s) + body_at(w.bodies, s.body).margin))
    return smallest


def link_contacts(w):
    """Link the contacts of each shape A into a list; see `pairing.slot_of`."""
    heads = w.cells + 2 * w.shape_count
    for i in range(w.shape_count):
        set_whole(w.grid, heads + i, -1)
    for slot in range(w.slots):
        c = contact_at(w.contacts, slot)
        if c.phase != FREE:
            c.near = -1
            c.link = whole_at(w.grid, heads + c.shape_a)
            set_whole(w.grid, heads + c.shape_a, slot)


def cell_of(w, i, width):
    """Return the indices of the cell that contains the centre of shape i; width: of cells [m]."""
    b = body_at(w.bodies, shape_at(w.shapes, i).body)
    at = add(load(b.position), centre(shape_at(w.shapes, i), b))
    return floor(at[0] / width), floor(at[1] / width), floor(at[2] / width)


def key_of(x, y, z, level):
    """Return a number of a cell that no other cell of its level within a million cells' widths has."""
    return ((x & 0xFFFFF) << 40 | (y & 0xFFFFF) << 20 | (z & 0xFFFFF)) ^ level * 0x1357 << 44


def hash_of(key, cells):
    """Return the place of a cell in a hash table of `cells` entries, a power of two."""
    return int((types.uint64(key) * types.uint64(0x9E3779B97F4A7C15)) >> types.uint64(32)) & (cells - 1)


def list_around(w, i, level, width, cells):
    """List shape i with the near shapes of a level in the 27 cells around it; pairs of one level only once."""
    shapes, body = w.shape_count, shape_at(w.shapes, i).body
    same = whole_at(w.grid, cells + shapes + i) == level
    x, y, z = cell_of(w, i, width)
    for n in range(13 if same else 0, 27):  # 13: its own cell; of two cells of a level one is enough
        key = key_of(x + n // 9 - 1, y + n // 3 % 3 - 1, z + n % 3 - 1, level)
        j = whole_at(w.grid, hash_of(key, cells))
        while j >= 0:
            own = whole_at(w.grid, cells + 3 * shapes + j) == key and whole_at(w.grid, cells + shapes + j) == level
            if own and (j < i or n != 13 or not same) and shape_at(w.shapes, j).body != body:
                list_pair(w, max(i, j), min(i, j))
            j = whole_at(w.grid, cells + j)


def sort_near(w, counts):
    """Sort near pairs of which only shapes, guard and gap are set: by counting for B, then for A, in that order.

    counts: where `WORLD.grid` has room for one number for each shape.
    """
    for by_a in range(2):
        for i in range(w.shape_count):
            set_whole(w.grid, counts + i, 0)
        for k in range(w.nears):
            p = near_at(w.near, k)
            place = counts + (p.a if by_a != 0 else p.b)
            set_whole(w.grid, place, whole_at(w.grid, place) + 1)
        first = 0
        for i in range(w.shape_count):
            count = whole_at(w.grid, counts + i)
            set_whole(w.grid, counts + i, first)
            first += count
        for k in range(w.nears):  # fields that are not set yet take the sorted shapes, guards and gaps
            p = near_at(w.near, k)
            place = counts + (p.a if by_a != 0 else p.b)
            q = near_at(w.near, whole_at(w.grid, place))
            set_whole(w.grid, place, whole_at(w.grid, place) + 1)
            q.body_a, q.body_b, q.pair, q.gap = p.a, p.b, p.guard, p.listed_gap
        for k in range(w.nears):
            p = near_at(w.near, k)
            p.a, p.b, p.guard, p.listed_gap = p.body_a, p.body_b, p.pair, p.gap


jit_module(__name__)
