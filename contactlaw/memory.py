"""Reading memory at an address inside jitted code, for engines that hand their state over as pointers."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic


def _loader(number_type: Any, kind: ir.Type) -> Any:
    def load(typing_context, address):
        def generate(context, builder, signature, arguments):
            return builder.load(builder.inttoptr(arguments[0], kind.as_pointer()))

        return number_type(types.uintp), generate

    return intrinsic(load)


def _doubles_at(typing_context, address):
    def generate(context, builder, signature, arguments):
        return builder.inttoptr(arguments[0], ir.DoubleType().as_pointer())

    return types.CPointer(types.float64)(types.uintp), generate


def _call_report(typing_context, function, who, code, value):
    def generate(context, builder, signature, arguments):
        long, double = ir.IntType(64), ir.DoubleType()
        kind = ir.FunctionType(ir.VoidType(), [long, long, double])
        builder.call(builder.inttoptr(arguments[0], kind.as_pointer()), arguments[1:])
        return context.get_dummy_value()

    return types.none(types.uintp, types.int64, types.int64, types.float64), generate


load_double: Any = _loader(types.float64, ir.DoubleType())
"""The float64 at an address."""

load_int: Any = _loader(types.int32, ir.IntType(32))
"""The C int at an address."""

load_pointer: Any = _loader(types.uintp, ir.IntType(64))
"""The pointer at an address, as an address."""

doubles_at: Any = intrinsic(_doubles_at)
"""An address as a pointer to float64, for `numba.carray`."""

call_report: Any = intrinsic(_call_report)
"""Call void (*function)(int64 who, int64 code, double value) at an address."""
