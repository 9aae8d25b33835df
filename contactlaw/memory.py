"""Memory and functions at addresses, for compiled code: of engines that hand their state over, and of worlds.

An array that is passed on or looked into costs a count of references at run time and a second of compiling in every
function that it goes through; an address costs nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from inspect import Parameter, Signature
from typing import Any

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

_WHOLE = ir.IntType(64)


def built(signature: Any, build: Callable[..., Any]) -> Any:
    """What compiled code calls with arguments of a numba signature, made by `build(context, builder, _, values)`."""

    def typing(*_: Any) -> Any:
        return signature, build

    names = "typing_context", *(f"value_{i}" for i in range(len(signature.args)))
    parameters = [Parameter(name, Parameter.POSITIONAL_OR_KEYWORD) for name in names]
    typing.__signature__ = Signature(parameters)  # type: ignore[attr-defined]
    return intrinsic(typing)


def caller(signature: Any) -> Any:
    """What calls a C function of a numba signature: with its address, then its arguments."""

    def build(context: Any, builder: Any, _: Any, values: Any) -> Any:
        nothing = signature.return_type == types.void
        result = ir.VoidType() if nothing else context.get_value_type(signature.return_type)
        kind = ir.FunctionType(result, [context.get_value_type(one) for one in signature.args])
        out = builder.call(builder.inttoptr(values[0], kind.as_pointer()), values[1:])
        return context.get_dummy_value() if nothing else out

    return built(signature.return_type(types.uint64, *signature.args), build)


def element(dtype: np.dtype) -> Any:
    """A function of the address of an array of records and an index, that returns the record there."""
    kind = numba.from_dtype(dtype)

    def build(context: Any, builder: Any, _: Any, values: Any) -> Any:
        place = builder.add(values[0], builder.mul(values[1], ir.Constant(_WHOLE, dtype.itemsize)))
        return builder.inttoptr(place, context.get_value_type(kind))

    return built(kind(types.uint64, types.int64), build)


def _pointer(builder: Any, values: Any, kind: Any = _WHOLE) -> Any:
    return builder.inttoptr(values[0], kind.as_pointer())


def _store_whole(context: Any, builder: Any, _: Any, values: Any) -> Any:
    builder.store(values[2], builder.gep(_pointer(builder, values), [values[1]]))
    return context.get_dummy_value()


load_int: Any = built(types.int32(types.uint64), lambda _, b, __, values: b.load(_pointer(b, values, ir.IntType(32))))
"""The C int at an address."""

doubles_at: Any = built(
    types.CPointer(types.float64)(types.uint64), lambda _, b, __, values: _pointer(b, values, ir.DoubleType())
)
"""An address as a pointer to float64."""

whole_at: Any = built(
    types.int64(types.uint64, types.int64), lambda _, b, __, values: b.load(b.gep(_pointer(b, values), [values[1]]))
)
"""Element of an array of int64, by its address."""

set_whole: Any = built(types.none(types.uint64, types.int64, types.int64), _store_whole)
"""Write an element of an array of int64."""
