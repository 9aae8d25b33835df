"""Numbers of mjModel, mjData and the block, by their addresses; sums of addresses stay whole numbers."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import carray, types  # pyright: ignore[reportPrivateImportUsage]
from numba.extending import intrinsic

from contactlaw.jit import jit_inside
from contactlaw.memory import doubles_at, load_int, load_pointer


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


def _call_on_world(typing_context, function, world):
    def generate(context, builder, signature, arguments):
        kind = ir.FunctionType(ir.VoidType(), [ir.IntType(64)])
        builder.call(builder.inttoptr(arguments[0], kind.as_pointer()), arguments[1:])
        return context.get_dummy_value()

    return types.none(types.uint64, types.uint64), generate


call_on_world: Any = intrinsic(_call_on_world)
"""Call void (*function)(uint64 world) at an address."""
