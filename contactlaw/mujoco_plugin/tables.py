"""The block of a model as tables, and what the engine and the state of a step put into them."""

from __future__ import annotations

from numba import carray, types  # pyright: ignore[reportPrivateImportUsage]

from contactlaw.jit import jit_for
from contactlaw.kernels.scene import (
    BODY,
    KEY,
    MOST_SLOTS,
    PAIR,
)
from contactlaw.kernels.scene import (
    SHAPES as SHAPE_FACTS,
)
from contactlaw.kernels.touch import (
    AXES,
)
from contactlaw.memory import doubles_at, load_double, load_pointer
from contactlaw.mujoco_plugin import block as b
from contactlaw.mujoco_plugin import layout
from contactlaw.mujoco_plugin.motion import (
    read_body,
)
from contactlaw.mujoco_plugin.motion import row as row_of

STATE_AT = layout.DATA["plugin_state"]
BLOCKS_AT = layout.DATA["plugin_data"]
XPOS_AT = layout.DATA["geom_xpos"]
XMAT_AT = layout.DATA["geom_xmat"]

jit = jit_for(layout.KEY)


@jit
def address_of_block(d, instance):
    """Address of the block of an instance."""
    return load_pointer(load_pointer(d + types.uintp(BLOCKS_AT)) + types.uintp(8 * instance))


@jit
def part(block, start, size):
    """Some of a block, as an array: block is its address."""
    return carray(doubles_at(block + types.uintp(8 * start)), size)


@jit
def table(block, start, rows, columns):
    """Some of a block as a table."""
    return carray(doubles_at(block + types.uintp(8 * start)), (rows, columns))


@jit
def look(m, d, block, head):
    """Fill places and bodies with what the engine has; returns the tables that all work starts from."""
    shapes = table(block, int(head[b.SHAPES_AT]), int(head[b.SHAPES]), SHAPE_FACTS)
    facts = table(block, int(head[b.BODIES_AT]), int(head[b.BODIES]), b.BODY_FACTS)
    pairs = table(block, int(head[b.PAIRS_AT]), int(head[b.PAIRS]), PAIR)
    geoms = part(block, int(head[b.GEOMS_AT]), shapes.shape[0])
    places = table(block, int(head[b.PLACES_AT]), shapes.shape[0], AXES + 9)
    bodies = table(block, int(head[b.MOTION_AT]), facts.shape[0], BODY)
    for i in range(shapes.shape[0]):
        centre, frame = row_of(d, XPOS_AT, int(geoms[i]), 3), row_of(d, XMAT_AT, int(geoms[i]), 9)
        places[i, :3] = centre
        places[i, 3:] = frame
    for i in range(1, facts.shape[0]):
        read_body(d, facts[i], bodies[i])
    return shapes, facts, pairs, geoms, places, bodies


@jit
def gather(d, block, head, instances, records_out):
    """The records of all instances in one table; returns how many there are. Pairs are numbered through."""
    count = 0
    state = load_pointer(d + types.uintp(STATE_AT))
    for i in range(instances.shape[0]):
        instance = instances[i]
        own = state + types.uintp(8 * int(instance[b.STATE]))
        size = int(instance[b.RECORD_SIZE])
        at = b.LEDGER_STATE + (b.LEDGER_SIZE if instance[b.HAS_LEDGER] != 0.0 else 0)
        for k in range(int(load_double(own))):
            records_out[count, :size] = carray(doubles_at(own + types.uintp(8 * (at + k * size))), size)
            records_out[count, KEY] += MOST_SLOTS * instance[b.FIRST_PAIR]
            count += 1
    return count


@jit
def count_records(d, instances):
    """How many records all instances have."""
    count = 0
    state = load_pointer(d + types.uintp(STATE_AT))
    for i in range(instances.shape[0]):
        count += int(load_double(state + types.uintp(8 * int(instances[i, b.STATE]))))
    return count
