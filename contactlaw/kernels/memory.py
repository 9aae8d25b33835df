"""Reading memory at an address inside jitted code, for engines that hand their state over as pointers."""

from __future__ import annotations

from llvmlite import ir
from numba import types
from numba.extending import intrinsic


def _loader(number_type, bits: int | None):
    @intrinsic
    def load(typing_context, address):
        def generate(context, builder, signature, arguments):
            kind = ir.DoubleType() if bits is None else ir.IntType(bits)
            return builder.load(builder.inttoptr(arguments[0], kind.as_pointer()))

        return number_type(types.uintp), generate

    return load


load_double = _loader(types.float64, None)
load_int = _loader(types.int32, 32)
load_pointer = _loader(types.uintp, 64)


@intrinsic
def doubles_at(typing_context, address):
    """The address as a pointer to float64, for `numba.carray`."""

    def generate(context, builder, signature, arguments):
        return builder.inttoptr(arguments[0], ir.DoubleType().as_pointer())

    return types.CPointer(types.float64)(types.uintp), generate


@intrinsic
def call_report(typing_context, function, instance, code, value):
    """Call void (*function)(int64 instance, int64 code, double value) at an address."""

    def generate(context, builder, signature, arguments):
        long, double = ir.IntType(64), ir.DoubleType()
        kind = ir.FunctionType(ir.VoidType(), [long, long, double])
        builder.call(builder.inttoptr(arguments[0], kind.as_pointer()), arguments[1:])
        return context.get_dummy_value()

    return types.none(types.uintp, types.int64, types.int64, types.float64), generate
