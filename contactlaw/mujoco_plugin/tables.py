"""The block of a model as tables, and what the engine and the state of a step put into them."""

from __future__ import annotations

from numba import carray, types  # pyright: ignore[reportPrivateImportUsage]

from contactlaw.jit import jit_for
from contactlaw.kernels.contact import DIRECTION, MASS, TANGENT, TANGENTIAL_MASS
from contactlaw.kernels.scene import (
    BODY,
    FORESEEN,
    HISTORY,
    KEY,
    MOST_SLOTS,
    PAIR,
    SLOTS,
)
from contactlaw.kernels.scene import (
    SHAPES as SHAPE_FACTS,
)
from contactlaw.kernels.subcycle import NEVER
from contactlaw.kernels.touch import (
    AXES,
)
from contactlaw.laws.record import OPEN, SLIDING, SPRUNG, contact_of
from contactlaw.memory import call_report, doubles_at, load_double, load_pointer
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
LARGEST = 1e30  # of what a record may hold, in SI units: its powers are still numbers
SKEW = 1e-6  # by which the axes of a record's frame may fail to be units at right angles

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
def report(instances, instance, code, value, head):
    """Tell Python, the first time."""
    if int(instances[instance, b.REPORTED]) & code == 0:
        instances[instance, b.REPORTED] += code
        call_report(types.uintp(head[b.REPORT]), int(instances[instance, b.NUMBER]), code, value)


@jit
def gather(d, pairs, head, instances, records_out):
    """The sound records of all instances in one table; returns how many there are. Pairs are numbered through."""
    count = 0
    state = load_pointer(d + types.uintp(STATE_AT))
    for i in range(instances.shape[0]):
        instance = instances[i]
        own = state + types.uintp(8 * int(instance[b.STATE]))
        size, first = int(instance[b.RECORD_SIZE]), instance[b.FIRST_PAIR]
        at = b.LEDGER_STATE + (b.LEDGER_SIZE if instance[b.HAS_LEDGER] != 0.0 else 0)
        says, key, dropped = load_double(own), -1.0, 0
        for k in range(room_taken(says, instance[b.ROOM])):
            record = carray(doubles_at(own + types.uintp(8 * (at + k * size))), size)
            if is_sound(record, key, first, instance[b.LAST_PAIR], pairs):
                key = record[KEY]
                records_out[count, :size] = record
                records_out[count, KEY] += MOST_SLOTS * first
                count += 1
            else:
                dropped += 1
        if dropped > 0 or not 0.0 <= says <= instance[b.ROOM]:
            report(instances, i, b.DAMAGED, float(dropped), head)
    return count


@jit
def room_taken(says, room):
    """How many records to look at where the state says that there are so many: all, if that cannot be."""
    return int(says) if 0.0 <= says <= room else int(room)


@jit
def is_sound(record, before, first, last, pairs):
    """Whether a record can be one that a step of this model has left; before: the key of the one before it.

    first, last: pairs of the instance, the one after. The state is open to everybody, and may be another model's, noise
    or NaN: what it says must neither lead out of the tables nor be beyond what can be computed with.
    """
    key = record[KEY]
    if not (before < key < MOST_SLOTS * (last - first)) or key != int(key):
        return False
    if int(key) % MOST_SLOTS >= pairs[int(first) + int(key) // MOST_SLOTS, SLOTS]:
        return False
    for i in range(record.size):
        if i in (HISTORY + MASS, HISTORY + TANGENTIAL_MASS):  # what cannot move has a mass near the greatest number
            most = NEVER
        elif i in (FORESEEN, FORESEEN + 1) and record[i] == NEVER:
            continue
        else:
            most = LARGEST
        if not abs(record[i]) <= most:
            return False
    normal, tangent, across = 0.0, 0.0, 0.0
    for i in range(3):
        normal += record[HISTORY + DIRECTION + i] ** 2
        tangent += record[HISTORY + TANGENT + i] ** 2
        across += record[HISTORY + DIRECTION + i] * record[HISTORY + TANGENT + i]
    contact = contact_of(record[HISTORY:])
    if contact.state == OPEN and normal == 0.0 and tangent == 0.0:  # it came and went within the step
        return True
    if not (abs(normal - 1.0) < SKEW and abs(tangent - 1.0) < SKEW and abs(across) < SKEW):
        return False
    if contact.state == OPEN:
        return True
    if contact.state != SLIDING and contact.state != SPRUNG:
        return False
    known = min(contact.e_star, contact.g_star, contact.radius, contact.stiffness)
    return min(known, contact.overlap, contact.mass, contact.tangential_mass) > 0.0 and contact.force >= 0.0


@jit
def count_records(d, instances):
    """How many records all instances may have, sound or not."""
    count = 0
    state = load_pointer(d + types.uintp(STATE_AT))
    for i in range(instances.shape[0]):
        says = load_double(state + types.uintp(8 * int(instances[i, b.STATE])))
        count += room_taken(says, instances[i, b.ROOM])
    return count
