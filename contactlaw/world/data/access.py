"""Records in the arrays of a world, by address: compiled code gets one record, `WORLD`, and reads all else through it.

Python owns the arrays (`world.arrays`), keeps them alive and writes their addresses into the record.
"""

from math import isnan
from typing import Any

from numba import carray  # pyright: ignore[reportPrivateImportUsage]

from contactlaw.jit import jit_inside
from contactlaw.laws.record import CONTACT_SIZE, PAIR_SIZE
from contactlaw.laws.record import PAIR as LAW
from contactlaw.laws.torsion import TORSION
from contactlaw.memory import doubles_at, element
from contactlaw.world.data import records

KNOWN_NUMBERS = CONTACT_SIZE + TORSION.itemsize // 8 + 4  # the first fields of a contact, the state of its laws
BODY_NUMBERS, CONTACT_NUMBERS = records.BODY.itemsize // 8, records.CONTACT.itemsize // 8

body_at: Any = element(records.BODY)
shape_at: Any = element(records.SHAPE)
pair_at: Any = element(records.PAIR)
guard_at: Any = element(records.GUARD)
near_at: Any = element(records.NEAR)
contact_at: Any = element(records.CONTACT)
law_at: Any = element(LAW)
tree_at: Any = element(records.TREE)
world_at: Any = element(records.WORLD)
link_at: Any = element(records.LINK)
joint_at: Any = element(records.JOINT)
axis_at: Any = element(records.AXIS)
row_at: Any = element(records.ROW)
coasting_at: Any = element(records.COASTING)


@jit_inside
def copy_numbers(source, target, count):
    """Copy `count` numbers from one address to another."""
    numbers, copy = carray(doubles_at(source), count), carray(doubles_at(target), count)
    for k in range(count):
        copy[k] = numbers[k]


@jit_inside
def body_address(bodies, i):
    """Return the address of body i of those at an address."""
    return bodies + 8 * BODY_NUMBERS * i


@jit_inside
def scratch_body(w, i, place):
    """Copy body i to one of the two scratch places; returns the copy."""
    copy_numbers(body_address(w.bodies, i), body_address(w.saved_bodies, place), BODY_NUMBERS)
    return body_at(w.saved_bodies, place)


@jit_inside
def save_body(w, i):
    """Save a copy of body i, for `saved_body` and `restore_body`."""
    copy_numbers(body_address(w.bodies, i), body_address(w.saved_bodies, i + 2), BODY_NUMBERS)


@jit_inside
def saved_body(w, i):
    """Return body i as it was saved."""
    return body_at(w.saved_bodies, i + 2)


@jit_inside
def restore_body(w, i):
    """Set body i back to its saved copy."""
    copy_numbers(body_address(w.saved_bodies, i + 2), body_address(w.bodies, i), BODY_NUMBERS)


@jit_inside
def save_contact(w, slot):
    """Save a copy of the contact in a slot, and of its law's history."""
    place = 8 * CONTACT_NUMBERS * slot
    copy_numbers(w.contacts + place, w.saved_contacts + place, CONTACT_NUMBERS)
    place = 8 * w.memory_size * slot
    copy_numbers(w.memory + place, w.saved_memory + place, w.memory_size)


@jit_inside
def saved_contact(w, slot):
    """Return the contact in a slot as it was saved."""
    return contact_at(w.saved_contacts, slot)


@jit_inside
def restore_contact(w, slot):
    """Set a contact back to its saved copy; its law's history stays as it is."""
    place = 8 * CONTACT_NUMBERS * slot
    copy_numbers(w.saved_contacts + place, w.contacts + place, CONTACT_NUMBERS)


@jit_inside
def restore_law_state(w, slot):
    """Set the state of a contact's laws, and their history, back to the saved copy."""
    place = 8 * CONTACT_NUMBERS * slot
    copy_numbers(w.saved_contacts + place, w.contacts + place, KNOWN_NUMBERS)
    restore_history(w, slot)


@jit_inside
def restore_history(w, slot):
    """Set the history of a contact's law back to the saved copy."""
    place = 8 * w.memory_size * slot
    copy_numbers(w.saved_memory + place, w.memory + place, w.memory_size)


@jit_inside
def memory_of(w, slot):
    """Return the history that the law keeps of the contact in a slot, shape (size,)."""
    return carray(doubles_at(w.memory + 8 * w.memory_size * slot), w.memory_size)


@jit_inside
def law_of(w, pair):
    """Return the parameters of a pair of materials that all laws share."""
    return law_at(w.numbers + 8 * pair.numbers, 0)


@jit_inside
def friction_of(pair, a, b):
    """Return the friction coefficient of a pair of materials for shapes a and b.

    If the pair has none: that of the shape with the higher priority, the greater one if both have the same.
    """
    if not isnan(pair.friction):
        return pair.friction
    if a.priority == b.priority:
        return max(a.friction, b.friction)
    return a.friction if a.priority > b.priority else b.friction


@jit_inside
def law_numbers(w, pair):
    """Return the law's own parameters of a pair."""
    return carray(doubles_at(w.numbers + 8 * (pair.numbers + PAIR_SIZE)), 1)


@jit_inside
def speed_numbers(w, pair):
    """Return the parameters of `laws.speeds` of a pair that has them."""
    return carray(doubles_at(w.numbers + 8 * (pair.numbers + int(law_of(w, pair).speeds))), 1)
