"""Free flight: nothing remembered and nothing near, told from a few numbers."""

from __future__ import annotations

from math import sqrt

from numba import carray, types  # pyright: ignore[reportPrivateImportUsage]

from contactlaw.jit import jit_for
from contactlaw.kernels.meeting import SAFETY
from contactlaw.kernels.scene import BODY_OF, BOUND, PAIR
from contactlaw.kernels.scene import (
    SHAPES as SHAPE_FACTS,
)
from contactlaw.kernels.touch import (
    BALL,
    KIND,
    PLANE,
)
from contactlaw.memory import doubles_at, load_double, load_pointer
from contactlaw.mujoco_plugin import block as b
from contactlaw.mujoco_plugin import layout

STATE_AT = layout.DATA["plugin_state"]
XPOS_AT = layout.DATA["geom_xpos"]
XMAT_AT = layout.DATA["geom_xmat"]
CVEL_AT = layout.DATA["cvel"]
COM_AT = layout.DATA["subtree_com"]
GRAVITY_AT = layout.GRAVITY
FEW_PAIRS = 4

jit = jit_for(layout.KEY)


@jit
def fall_of(m, dt):
    """What gravity adds to the way of a step [m], velocities being half a step old."""
    g = carray(doubles_at(m + types.uintp(GRAVITY_AT)), 3)
    return dt * dt * sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2])


@jit
def far_apart(m, d, block, head, dt):
    """Whether nothing is remembered and no pair can touch in this step, as far as a few numbers tell.

    Free flight reads these and nothing else; for many pairs the tables are the faster way.
    """
    pairs, fall = int(head[b.PAIRS]), fall_of(m, dt)
    if pairs > FEW_PAIRS:
        return False
    state = load_pointer(d + types.uintp(STATE_AT))
    for i in range(int(head[b.INSTANCES])):
        own = block + types.uintp(8 * (int(head[b.INSTANCES_AT]) + b.INSTANCE * i + b.STATE))
        if load_double(state + types.uintp(8 * int(load_double(own)))) != 0.0:
            return False
    for i in range(pairs):
        pair = block + types.uintp(8 * (int(head[b.PAIRS_AT]) + PAIR * i))
        one, two = int(load_double(pair)), int(load_double(pair + types.uintp(8)))
        reach = SAFETY * 2.0 * (way_of(d, block, head, one, dt) + way_of(d, block, head, two, dt) + fall)
        if gap_between(d, block, head, one, two) <= reach:
            return False
    return True


@jit
def entry(block, head, table_at, width, index, column):
    """One entry of a table of the block."""
    return load_double(block + types.uintp(8 * (int(head[table_at]) + width * index + column)))


@jit
def way_of(d, block, head, shape, dt):
    """How far a geom's surface goes in a step at most [m], but for what accelerates it."""
    body = int(entry(block, head, b.SHAPES_AT, SHAPE_FACTS, shape, BODY_OF))
    if body == 0:
        return 0.0
    number = int(entry(block, head, b.BODIES_AT, b.BODY_FACTS, body, b.BODY_ID))
    root = int(entry(block, head, b.BODIES_AT, b.BODY_FACTS, body, b.ROOT))
    geom = int(entry(block, head, b.GEOMS_AT, 1, shape, 0))
    c = load_pointer(d + types.uintp(CVEL_AT)) + types.uintp(48 * number)
    place = load_pointer(d + types.uintp(XPOS_AT)) + types.uintp(24 * geom)
    com = load_pointer(d + types.uintp(COM_AT)) + types.uintp(24 * root)
    spin, speed, arm = 0.0, 0.0, 0.0
    for i in range(3):
        at = types.uintp(8 * i)
        spin += load_double(c + at) ** 2
        speed += load_double(c + types.uintp(24) + at) ** 2
        arm += (load_double(place + at) - load_double(com + at)) ** 2
    if entry(block, head, b.SHAPES_AT, SHAPE_FACTS, shape, KIND) != BALL:
        arm = 2.0 * arm + 2.0 * entry(block, head, b.SHAPES_AT, SHAPE_FACTS, shape, BOUND) ** 2
    return dt * (sqrt(speed) + sqrt(spin * arm))


@jit
def gap_between(d, block, head, one, two):
    """Distance [m] of two geoms, or less."""
    a, c = int(entry(block, head, b.GEOMS_AT, 1, one, 0)), int(entry(block, head, b.GEOMS_AT, 1, two, 0))
    places = load_pointer(d + types.uintp(XPOS_AT))
    p, q = places + types.uintp(24 * a), places + types.uintp(24 * c)
    x = load_double(p) - load_double(q)
    y = load_double(p + types.uintp(8)) - load_double(q + types.uintp(8))
    z = load_double(p + types.uintp(16)) - load_double(q + types.uintp(16))
    bound = entry(block, head, b.SHAPES_AT, SHAPE_FACTS, one, BOUND)
    if entry(block, head, b.SHAPES_AT, SHAPE_FACTS, two, KIND) == PLANE:
        frame = load_pointer(d + types.uintp(XMAT_AT)) + types.uintp(72 * c)
        x *= load_double(frame + types.uintp(16))
        y *= load_double(frame + types.uintp(40))
        z *= load_double(frame + types.uintp(64))
        return x + y + z - bound
    return sqrt(x * x + y * y + z * z) - bound - entry(block, head, b.SHAPES_AT, SHAPE_FACTS, two, BOUND)
