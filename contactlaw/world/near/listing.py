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
from contactlaw.world.contacts.touch import release
from contactlaw.world.data.access import body_at, contact_at, near_at, shape_at
from contactlaw.world.data.records import CLOSED, FREE, NEVER, PARTED, PLANE, TANGENT
from contactlaw.world.data.vec import add, load, norm, store, sub
from contactlaw.world.near.guards import SLACK, surface_speed
from contactlaw.world.near.order import sort_near
from contactlaw.world.near.pairing import consider, enter, is_part, size
from contactlaw.world.shapes.geometry import centre

STEPS = 4.0  # steps that the margin is to last at the speed there is; longer where few bodies have many shapes, for it
# is these that a list costs, and bodies that are near are looked at in each window
LONG = 16.0  # the same where there are parts: guards see who of them is near, and what is near costs little then
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
    way = norm(sub(load(b.position), load(b.listed_position))) + b.turned * b.reach
    return way if b.still != 0 else way + left * surface_speed(b, left)


@jit_inside
def list_near(w):
    """Make the list of near pairs anew; contacts keep what they remember.

    If there is not room for all that are near within margins for several steps, it lasts one step.
    """
    lost, heads = w.lost, w.cells + 2 * w.shape_count
    wholes = 0
    for i in range(w.shape_count):
        wholes += 0 if is_part(shape_at(w.shapes, i)) else 1
    lasts = LONG if wholes < w.shape_count else STEPS * max(sqrt(wholes) / w.body_count, 1.0)
    list_within(w, lasts if w.body_count <= MANY else 1.0)
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
        if c.near < 0 and (c.phase == CLOSED or (c.phase == PARTED and c.initial_overlap > 0.0)):
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
    w.nears, w.guard_count, levels = 0, 0, 0
    for i in range(shapes):
        s = shape_at(w.shapes, i)
        if s.kind < PLANE and not is_part(s):
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
        if is_part(s):
            continue
        if s.kind == TANGENT:
            consider(w, s.partner, i)
            continue
        if s.kind >= PLANE:
            for j in range(shapes):
                if shape_at(w.shapes, j).kind < PLANE and not is_part(shape_at(w.shapes, j)):
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
    """Give all bodies new margins for a time [s] at the speeds that they may have within a step, where they are;
    returns the width [m] of the smallest shape with its margin.

    A body that is behind in time makes up for it out of its margin, which is for some steps. To move it here would
    make its motion, by rounding, one of margins.
    """
    total = 0.0
    for i in range(w.body_count):
        b = body_at(w.bodies, i)
        store(b.listed_position, load(b.position))
        b.turned = 0.0
        b.margin = 0.0 if b.still != 0 else time * surface_speed(b, w.step)
        total += b.margin
    struck = total / w.body_count if w.body_count > MANY else 0.0
    for i in range(w.body_count):
        b = body_at(w.bodies, i)
        b.margin += SLACK * b.size + (0.0 if b.inverse_mass == 0.0 else struck)
    smallest = NEVER
    for i in range(w.shape_count):
        s = shape_at(w.shapes, i)
        if s.kind < PLANE and not is_part(s):
            smallest = min(smallest, 2.0 * (size(s) + body_at(w.bodies, s.body).margin))
    return smallest


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
