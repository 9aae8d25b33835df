"""Broad phase: which shapes are near each other, by grids of several widths, kept for as long as nobody went far.

Every body has a margin by which its surface may travel, turning included. Two shapes are near if their margins meet;
the list is made anew when a body could use its margin up. All shapes but planes lie, as the spheres around them, in
cells as wide as they are with their margins, to the next power of two; each looks into cells of its own width and
wider. The list is in the order of its shapes, so that sums over it do not depend on when it was made.
"""

from __future__ import annotations

from math import ceil, floor, log2, sqrt

from numba import types

from contactlaw.jit import jit_inside
from contactlaw.memory import set_whole, whole_at
from contactlaw.world.access import body_at, contact_at, near_at, shape_at
from contactlaw.world.call import ask_over_face
from contactlaw.world.geometry import OF_FACE, asked_of, centre, half_axis, meet
from contactlaw.world.motion import jerk
from contactlaw.world.order import sort_near
from contactlaw.world.records import (
    BOX,
    CLOSED,
    CYLINDER,
    DISC,
    EDGE,
    ELLIPSOID,
    FREE,
    HULL,
    NEVER,
    PARTED,
    PLANE,
    SEGMENT,
    SIDE,
    SPHERE,
    TANGENT,
)
from contactlaw.world.touch import release
from contactlaw.world.vec import add, dot, load, norm, store, sub, to_body

SLACK = 0.2  # of a body's smallest radius: its margin besides what its speed asks for
STEPS = 4.0  # steps that the margin is to last at the speed there is; longer where few bodies have many shapes, for it
# is these that a list costs, and bodies that are near are looked at in each window
MANY = 256  # bodies: among more it lasts one step, for in each step many windows go through the list, but impacts too


@jit_inside
def strayed(b, left):
    """Whether a body may leave its margin within a time [s]."""
    if b.size == 0.0 and b.reach == 0.0:  # it has no shapes
        return False
    return way_of(b, left) > b.margin


@jit_inside
def way_of(b, left):
    """How far [m] a point of a body can be within a time [s], at most, from where the list of near pairs found it."""
    way = norm(sub(load(b.position), load(b.mark))) + b.turned * b.reach
    return way if b.still != 0 else way + left * surface_speed(b, left)


@jit_inside
def surface_speed(b, time):
    """Speed [m/s] of a body's shapes within a time [s], at most."""
    gained = time * (norm(load(b.acceleration)) + b.reach * norm(load(b.turning)) + time * jerk(b, b.reach))
    return norm(load(b.velocity)) + norm(load(b.spin)) * b.reach + gained


@jit_inside
def list_near(w):
    """Make the list of near pairs anew; contacts keep what they remember.

    If there is not room for all that are near within margins for several steps, it lasts one step.
    """
    lost, heads = w.lost, w.cells + 2 * w.shape_count
    list_within(w, STEPS * max(sqrt(w.shape_count) / w.body_count, 1.0) if w.body_count <= MANY else 1.0)
    if w.lost > lost:
        w.lost = lost
        list_within(w, 1.0)
    keep_contacts(w, heads)
    sort_near(w, w.cells)
    for k in range(w.nears):
        enter(w, k, heads)
    list_bodies(w)
    for slot in range(w.slots):
        c = contact_at(w.contacts, slot)
        if c.near < 0 and (c.phase == CLOSED or (c.phase == PARTED and c.built > 0.0)):
            release(w, slot)
    w.lists += 1
    w.stale = 0


@jit_inside
def list_within(w, steps):
    """List the shapes that are within margins for so many steps."""
    smallest = mark(w, steps * w.step)
    shapes = w.shape_count
    cells = w.cells  # first in the grid's room: heads of the cells' lists; of each shape: next, level, contacts, cell
    for i in range(cells):
        set_whole(w.grid, i, -1)
    w.nears = 0
    levels = 0
    for i in range(shapes):
        if shape_at(w.shapes, i).kind < PLANE:
            level = level_of(w, i, smallest)
            levels |= 1 << level
            set_whole(w.grid, cells + shapes + i, level)
            x, y, z = cell_of(w, i, smallest * 2.0**level)
            key = key_of(x, y, z, level)
            cell = hashed(key, cells)
            set_whole(w.grid, cells + 3 * shapes + i, key)
            set_whole(w.grid, cells + i, whole_at(w.grid, cell))
            set_whole(w.grid, cell, i)
    for i in range(shapes):
        s = shape_at(w.shapes, i)
        if s.kind == TANGENT:
            consider(w, s.partner, i)
            continue
        if s.kind == PLANE:
            for j in range(shapes):
                if shape_at(w.shapes, j).kind <= ELLIPSOID:
                    consider(w, j, i)
            continue
        own = whole_at(w.grid, cells + shapes + i)
        for level in range(own, 63):
            if levels >> level == 0:
                break
            if (levels >> level) & 1:
                around(w, i, level, smallest * 2.0**level, cells)


@jit_inside
def list_bodies(w):
    """List the bodies that are near something, or of a tree: no other one is struck until the next list."""
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


@jit_inside
def mark(w, time):
    """Give all bodies new margins for a time [s], where they are; returns the width [m] of the smallest shape with its
    margin.

    A body that is behind in time makes up for it out of its margin, which is for some steps. To move it here would
    make its motion, by rounding, one of margins.
    """
    total = 0.0
    for i in range(w.body_count):
        b = body_at(w.bodies, i)
        store(b.mark, load(b.position))
        b.turned = 0.0
        b.margin = 0.0 if b.still != 0 else time * surface_speed(b, time)
        total += b.margin
    struck = total / w.body_count if w.body_count > MANY else 0.0
    for i in range(w.body_count):
        b = body_at(w.bodies, i)
        b.margin += SLACK * b.size + (0.0 if b.inverse_mass == 0.0 else struck)
    smallest = NEVER
    for i in range(w.shape_count):
        s = shape_at(w.shapes, i)
        if s.kind < PLANE:
            smallest = min(smallest, 2.0 * (size(s) + body_at(w.bodies, s.body).margin))
    return smallest


@jit_inside
def size(s):
    """Radius [m] of the sphere around a shape that is not a plane."""
    if s.kind < SEGMENT:
        return s.radius
    return (s.radius if s.kind < BOX else 0.0) + norm(load(s.half))


@jit_inside
def keep_contacts(w, heads):
    """String up the contacts of each shape that is their A, from the heads on in the grid's room."""
    for i in range(w.shape_count):
        set_whole(w.grid, heads + i, -1)
    count_slots(w)
    for slot in range(w.slots):
        c = contact_at(w.contacts, slot)
        if c.phase != FREE:
            c.near = -1
            c.link = whole_at(w.grid, heads + c.shape_a)
            set_whole(w.grid, heads + c.shape_a, slot)


@jit_inside
def count_slots(w):
    """Note how many slots have been in use, before some are given back: those given back last are used first."""
    w.slots = max(w.slots, w.contact_room - w.spares)


@jit_inside
def level_of(w, i, smallest):
    """Level of the grid that a shape lies in."""
    s = shape_at(w.shapes, i)
    return max(ceil(log2((size(s) + body_at(w.bodies, s.body).margin) * 2.0 / smallest) - 1e-9), 0)


@jit_inside
def cell_of(w, i, width):
    """Indices of the cell that a shape's centre lies in."""
    b = body_at(w.bodies, shape_at(w.shapes, i).body)
    at = add(load(b.position), centre(shape_at(w.shapes, i), b))
    return floor(at[0] / width), floor(at[1] / width), floor(at[2] / width)


@jit_inside
def key_of(x, y, z, level):
    """A number of a cell, that of no other within a million cells' widths."""
    return ((x & 0xFFFFF) << 40 | (y & 0xFFFFF) << 20 | (z & 0xFFFFF)) ^ level * 0x1357 << 44


@jit_inside
def hashed(key, cells):
    """Place of a cell in a table whose size is a power of two."""
    return int((types.uint64(key) * types.uint64(0x9E3779B97F4A7C15)) >> types.uint64(32)) & (cells - 1)


@jit_inside
def around(w, i, level, width, cells):
    """Consider a shape with all of a level in the cells around it; those of its own level once."""
    shapes = w.shape_count
    same = whole_at(w.grid, cells + shapes + i) == level
    x, y, z = cell_of(w, i, width)
    for n in range(13 if same else 0, 27):  # of two cells of one level one looks into the other
        key = key_of(x + n // 9 - 1, y + n // 3 % 3 - 1, z + n % 3 - 1, level)
        j = whole_at(w.grid, hashed(key, cells))
        while j >= 0:
            if whole_at(w.grid, cells + 3 * shapes + j) == key and (j < i or n != 13 or not same):
                consider(w, max(i, j), min(i, j))
            j = whole_at(w.grid, cells + j)


@jit_inside
def meets(kind_a, kind_b):
    """Whether shapes of two kinds can touch; kind_a <= kind_b."""
    if kind_a == SPHERE:
        return kind_b in (SPHERE, SEGMENT) or kind_b >= ELLIPSOID
    if kind_a < SEGMENT:
        return kind_b >= BOX
    if kind_a == SEGMENT:
        return kind_b == SEGMENT or ELLIPSOID <= kind_b <= HULL
    if kind_a == EDGE:
        return BOX <= kind_b <= HULL
    if kind_a == DISC:
        return BOX <= kind_b <= PLANE
    if kind_a == SIDE:
        return kind_b == CYLINDER
    if kind_a == ELLIPSOID:
        return kind_b <= PLANE
    return kind_b == HULL and kind_a != CYLINDER


@jit_inside
def pair_of(w, i, j):
    """Number of the pair that shape i as A makes with shape j as B, or -1."""
    sa, sb = shape_at(w.shapes, i), shape_at(w.shapes, j)
    if sa.kind > sb.kind or not meets(sa.kind, sb.kind) or (sb.kind == TANGENT and sb.partner != i):
        return -1
    still = body_at(w.bodies, sa.body).inverse_mass == 0.0 and body_at(w.bodies, sb.body).inverse_mass == 0.0
    if sa.body == sb.body or still or (sa.kind == SIDE and sa.body < sb.body):  # two sides meet once
        return -1
    return whole_at(w.groups, sa.group * w.group_count + sb.group)


@jit_inside
def consider(w, i, j):
    """List two shapes if they make a pair and are near."""
    if shape_at(w.shapes, i).kind > shape_at(w.shapes, j).kind:
        i, j = j, i
    if pair_of(w, i, j) < 0:
        return
    sa, sb = shape_at(w.shapes, i), shape_at(w.shapes, j)
    a, b = body_at(w.bodies, sa.body), body_at(w.bodies, sb.body)
    margin = a.margin + b.margin
    if sb.kind < PLANE:
        d = add(sub(load(a.position), load(b.position)), sub(centre(sa, a), centre(sb, b)))
        far = margin + size(sa) + size(sb)
        if dot(d, d) > far * far:
            return
        if sb.kind == HULL and beside(d, sa, a, sb, b, margin):
            return
        over = asked_of(sa, sb, OF_FACE) if sa.kind == EDGE and sb.kind == BOX else types.uint64(0)
        if over != 0 and ask_over_face(over, d, half_axis(sa, a), margin, sb, b):
            return
    overlap = 0.0
    if sb.kind != SPHERE and sb.kind != TANGENT:
        overlap, _, _, _ = meet(sa, a, sb, b)
        if overlap < -margin:
            return
    if w.nears == w.near_room:
        w.lost += 1
        return
    p = near_at(w.near, w.nears)
    p.a, p.b = i, j
    p.listed = -overlap if sa.kind >= SEGMENT or ELLIPSOID <= sb.kind <= HULL else 0.0
    w.nears += 1


@jit_inside
def beside(d, sa, a, sb, b, margin):
    """Whether a shape is further than a margin [m] from the box around a hull B, along one of that one's axes.

    d: from B's centre to A's. Hulls have hundreds of parts, of which most are told apart so, without a search.
    """
    p, u, reach = to_body(b.axes, d), (0.0, 0.0, 0.0), size(sa)
    if sa.kind == EDGE or sa.kind == SEGMENT:
        u, reach = to_body(b.axes, half_axis(sa, a)), sa.radius
    most = 0.0
    for i in range(3):
        most = max(most, abs(p[i]) - abs(u[i]) - sb.axes[i])
    return most > reach + margin


@jit_inside
def enter(w, k, heads):
    """Begin the record of a near pair that knows its shapes, and hook it to its contact, if there is one."""
    p = near_at(w.near, k)
    p.body_a, p.body_b = shape_at(w.shapes, p.a).body, shape_at(w.shapes, p.b).body
    p.pair = pair_of(w, p.a, p.b)
    p.slot = -1
    p.built = 0.0
    p.closed = 0
    p.active = 0
    p.toi = 0.0
    p.seen = -1.0
    slot = whole_at(w.grid, heads + p.a)
    while slot >= 0:
        c = contact_at(w.contacts, slot)
        if c.shape_b == p.b:
            p.slot, p.built = slot, c.built
            p.closed = 1 if c.phase == CLOSED else 0
            c.near = k
        slot = c.link
