"""Elements of the arrays of a world, by their addresses: compiled code sees one record, `WORLD`, and what it points to.

An array that is passed on or looked into costs a count of references at run time and a second of compiling in every
function that it goes through; an address costs nothing. The arrays belong to Python (`world.arrays`), which keeps them
alive and writes their addresses into the record.
"""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
from llvmlite import ir
from numba import carray, types  # pyright: ignore[reportPrivateImportUsage]
from numba.extending import intrinsic

from contactlaw.jit import jit_inside
from contactlaw.laws.record import CONTACT_SIZE, PAIR_SIZE
from contactlaw.laws.record import PAIR as LAW
from contactlaw.laws.torsion import TORSION
from contactlaw.world.records import AXIS, BODY, CONTACT, JOINT, LINK, NEAR, PAIR, ROW, SHAPE, TREE, WORLD

KNOWN_NUMBERS = CONTACT_SIZE + TORSION.itemsize // 8 + 4  # what laws know of a contact, its first numbers
BODY_NUMBERS, CONTACT_NUMBERS = BODY.itemsize // 8, CONTACT.itemsize // 8


def element(dtype: np.dtype) -> Any:
    """A function of the address of an array of records and an index, that returns the record there."""
    kind = numba.from_dtype(dtype)
    size = dtype.itemsize

    def at(typing_context, address, index):
        def generate(context, builder, signature, arguments):
            place = builder.add(arguments[0], builder.mul(arguments[1], ir.Constant(ir.IntType(64), size)))
            return builder.inttoptr(place, context.get_value_type(kind))

        return kind(types.uint64, types.int64), generate

    return intrinsic(at)


def _whole(typing_context, address, index):
    def generate(context, builder, signature, arguments):
        start = builder.inttoptr(arguments[0], ir.IntType(64).as_pointer())
        return builder.load(builder.gep(start, [arguments[1]]))

    return types.int64(types.uint64, types.int64), generate


def _set_whole(typing_context, address, index, value):
    def generate(context, builder, signature, arguments):
        start = builder.inttoptr(arguments[0], ir.IntType(64).as_pointer())
        builder.store(arguments[2], builder.gep(start, [arguments[1]]))
        return context.get_dummy_value()

    return types.none(types.uint64, types.int64, types.int64), generate


def _numbers(typing_context, address):
    def generate(context, builder, signature, arguments):
        return builder.inttoptr(arguments[0], ir.DoubleType().as_pointer())

    return types.CPointer(types.float64)(types.uint64), generate


body_at: Any = element(BODY)
shape_at: Any = element(SHAPE)
pair_at: Any = element(PAIR)
near_at: Any = element(NEAR)
contact_at: Any = element(CONTACT)
law_at: Any = element(LAW)
tree_at: Any = element(TREE)
world_at: Any = element(WORLD)
link_at: Any = element(LINK)
joint_at: Any = element(JOINT)
axis_at: Any = element(AXIS)
row_at: Any = element(ROW)

whole_at: Any = intrinsic(_whole)
"""Element of an array of int64."""

set_whole: Any = intrinsic(_set_whole)
"""Write an element of an array of int64."""

numbers_at: Any = intrinsic(_numbers)
"""An address as a pointer to float64, for `carray`."""


@jit_inside
def copy_numbers(source, target, count):
    """Copy so many numbers from one address to another."""
    numbers, copy = carray(numbers_at(source), count), carray(numbers_at(target), count)
    for k in range(count):
        copy[k] = numbers[k]


@jit_inside
def body_aside(w, i, place):
    """A copy of a body, in one of two places."""
    copy_numbers(w.bodies + 8 * BODY_NUMBERS * i, w.aside + 8 * BODY_NUMBERS * place, BODY_NUMBERS)
    return body_at(w.aside, place)


@jit_inside
def keep_body(w, i):
    """Keep a body as it is, for `body_kept`."""
    copy_numbers(w.bodies + 8 * BODY_NUMBERS * i, w.aside + 8 * BODY_NUMBERS * (i + 2), BODY_NUMBERS)


@jit_inside
def body_kept(w, i):
    """A body as it was when it was kept."""
    return body_at(w.aside, i + 2)


@jit_inside
def bring_back_body(w, i):
    """Make a body what it was when it was kept."""
    copy_numbers(w.aside + 8 * BODY_NUMBERS * (i + 2), w.bodies + 8 * BODY_NUMBERS * i, BODY_NUMBERS)


@jit_inside
def keep_contact(w, slot):
    """Keep a contact as it is, with what its law remembers."""
    place = 8 * CONTACT_NUMBERS * slot
    copy_numbers(w.contacts + place, w.contacts_aside + place, CONTACT_NUMBERS)
    place = 8 * w.memory_size * slot
    copy_numbers(w.memory + place, w.memory_aside + place, w.memory_size)


@jit_inside
def contact_kept(w, slot):
    """A contact as it was when it was kept."""
    return contact_at(w.contacts_aside, slot)


@jit_inside
def bring_back_contact(w, slot):
    """Make a contact what it was when it was kept, but for what its law remembers."""
    place = 8 * CONTACT_NUMBERS * slot
    copy_numbers(w.contacts_aside + place, w.contacts + place, CONTACT_NUMBERS)


@jit_inside
def bring_back_touch(w, slot):
    """Make what laws know of a contact, and remember, what it was when it was kept."""
    place = 8 * CONTACT_NUMBERS * slot
    copy_numbers(w.contacts_aside + place, w.contacts + place, KNOWN_NUMBERS)
    place = 8 * w.memory_size * slot
    copy_numbers(w.memory_aside + place, w.memory + place, w.memory_size)


@jit_inside
def memory_of(w, slot):
    """What the law remembers of the contact in a slot, shape (size,)."""
    return carray(numbers_at(w.memory + 8 * w.memory_size * slot), w.memory_size)


@jit_inside
def law_of(w, pair):
    """The materials and the law of a pair, as the law reads them."""
    return law_at(w.numbers + 8 * pair.numbers, 0)


@jit_inside
def law_numbers(w, pair):
    """The law's own numbers."""
    return carray(numbers_at(w.numbers + 8 * (pair.numbers + PAIR_SIZE)), 1)


@jit_inside
def speed_numbers(w, pair):
    """What `laws.speeds` reads of a pair that has it."""
    return carray(numbers_at(w.numbers + 8 * (pair.numbers + int(law_of(w, pair).speeds))), 1)
