"""Elements of the arrays of a world, by their addresses: compiled code sees one record, `WORLD`, and what it points to.

The arrays belong to Python (`world.arrays`), which keeps them alive and writes their addresses into the record.
"""

from __future__ import annotations

from typing import Any

from numba import carray  # pyright: ignore[reportPrivateImportUsage]

from contactlaw.jit import jit_inside
from contactlaw.laws.record import CONTACT_SIZE, PAIR_SIZE
from contactlaw.laws.record import PAIR as LAW
from contactlaw.laws.torsion import TORSION
from contactlaw.memory import doubles_at, element
from contactlaw.world.data.records import AXIS, BODY, CONTACT, GUARD, JOINT, LINK, NEAR, PAIR, ROW, SHAPE, TREE, WORLD

KNOWN_NUMBERS = CONTACT_SIZE + TORSION.itemsize // 8 + 4  # what laws know of a contact, its first numbers
BODY_NUMBERS, CONTACT_NUMBERS = BODY.itemsize // 8, CONTACT.itemsize // 8

body_at: Any = element(BODY)
shape_at: Any = element(SHAPE)
pair_at: Any = element(PAIR)
guard_at: Any = element(GUARD)
near_at: Any = element(NEAR)
contact_at: Any = element(CONTACT)
law_at: Any = element(LAW)
tree_at: Any = element(TREE)
world_at: Any = element(WORLD)
link_at: Any = element(LINK)
joint_at: Any = element(JOINT)
axis_at: Any = element(AXIS)
row_at: Any = element(ROW)


@jit_inside
def copy_numbers(source, target, count):
    """Copy so many numbers from one address to another."""
    numbers, copy = carray(doubles_at(source), count), carray(doubles_at(target), count)
    for k in range(count):
        copy[k] = numbers[k]


@jit_inside
def scratch_body(w, i, place):
    """A copy of a body, in one of two places."""
    copy_numbers(w.bodies + 8 * BODY_NUMBERS * i, w.saved_bodies + 8 * BODY_NUMBERS * place, BODY_NUMBERS)
    return body_at(w.saved_bodies, place)


@jit_inside
def save_body(w, i):
    """Keep a body as it is, for `saved_body`."""
    copy_numbers(w.bodies + 8 * BODY_NUMBERS * i, w.saved_bodies + 8 * BODY_NUMBERS * (i + 2), BODY_NUMBERS)


@jit_inside
def saved_body(w, i):
    """A body as it was when it was kept."""
    return body_at(w.saved_bodies, i + 2)


@jit_inside
def restore_body(w, i):
    """Make a body what it was when it was kept."""
    copy_numbers(w.saved_bodies + 8 * BODY_NUMBERS * (i + 2), w.bodies + 8 * BODY_NUMBERS * i, BODY_NUMBERS)


@jit_inside
def save_contact(w, slot):
    """Keep a contact as it is, with what its law remembers."""
    place = 8 * CONTACT_NUMBERS * slot
    copy_numbers(w.contacts + place, w.saved_contacts + place, CONTACT_NUMBERS)
    place = 8 * w.memory_size * slot
    copy_numbers(w.memory + place, w.saved_memory + place, w.memory_size)


@jit_inside
def saved_contact(w, slot):
    """A contact as it was when it was kept."""
    return contact_at(w.saved_contacts, slot)


@jit_inside
def restore_contact(w, slot):
    """Make a contact what it was when it was kept, but for what its law remembers."""
    place = 8 * CONTACT_NUMBERS * slot
    copy_numbers(w.saved_contacts + place, w.contacts + place, CONTACT_NUMBERS)


@jit_inside
def restore_law_state(w, slot):
    """Make what laws know of a contact, and remember, what it was when it was kept."""
    place = 8 * CONTACT_NUMBERS * slot
    copy_numbers(w.saved_contacts + place, w.contacts + place, KNOWN_NUMBERS)
    place = 8 * w.memory_size * slot
    copy_numbers(w.saved_memory + place, w.memory + place, w.memory_size)


@jit_inside
def memory_of(w, slot):
    """What the law remembers of the contact in a slot, shape (size,)."""
    return carray(doubles_at(w.memory + 8 * w.memory_size * slot), w.memory_size)


@jit_inside
def law_of(w, pair):
    """The materials and the law of a pair, as the law reads them."""
    return law_at(w.numbers + 8 * pair.numbers, 0)


@jit_inside
def law_numbers(w, pair):
    """The law's own numbers."""
    return carray(doubles_at(w.numbers + 8 * (pair.numbers + PAIR_SIZE)), 1)


@jit_inside
def speed_numbers(w, pair):
    """What `laws.speeds` reads of a pair that has it."""
    return carray(doubles_at(w.numbers + 8 * (pair.numbers + int(law_of(w, pair).speeds))), 1)
