"""Numbers of mjModel, mjData and the block, by their addresses; sums of addresses stay whole numbers."""

from __future__ import annotations

from typing import Any

from numba import carray, types  # pyright: ignore[reportPrivateImportUsage]

from contactlaw.jit import jit_inside
from contactlaw.memory import caller, doubles_at, load_int, load_pointer


@jit_inside
def place(address, count):
    """The address of a number in an array of them."""
    return types.uintp(address) + types.uintp(8 * count)


@jit_inside
def floats(address, first, size):
    """Numbers of an array at an address, a view."""
    return carray(doubles_at(place(address, first)), size)


@jit_inside
def field(base, offset, first, size):
    """Numbers of an array that a struct points to."""
    return floats(load_pointer(types.uintp(base) + types.uintp(offset)), first, size)


@jit_inside
def entry(base, offset, i):
    """A whole number of an array of C int that a struct points to."""
    return int(load_int(load_pointer(types.uintp(base) + types.uintp(offset)) + types.uintp(4 * i)))


@jit_inside
def inside(base, offset, size):
    """Numbers in a struct."""
    return carray(doubles_at(types.uintp(base) + types.uintp(offset)), size)


call_on_world: Any = caller(types.void(types.uint64))
"""Call void (*function)(uint64 world) at an address."""

call_report: Any = caller(types.void(types.int64, types.int64, types.float64))
"""Call void (*function)(int64 who, int64 code, double value) at an address."""

call_sense: Any = caller(types.void(*4 * [types.uint64]))
"""Call void (*function)(uint64 m, uint64 d, uint64 block, uint64 mean) at an address."""
