"""Access to memory and calls of functions by address, in compiled code.

An array costs reference counting at run time, and a second of compilation in every function that it is passed to; an
address costs nothing. The state of engines and of worlds is therefore read and written by address.
"""

import ctypes
from collections.abc import Callable
from inspect import Parameter, Signature
from typing import Any

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic
from numpy.typing import NDArray

from contactlaw.jit import INTERPRETED

_INT64 = ir.IntType(64)


def _intrinsic_of(signature: Any, build: Callable[..., Any]) -> Any:
    """Return a numba intrinsic of a signature whose LLVM code `build(context, builder, _, values)` makes."""

    def typing(*_: Any) -> Any:
        return signature, build

    names = "typing_context", *(f"value_{i}" for i in range(len(signature.args)))
    parameters = [Parameter(name, Parameter.POSITIONAL_OR_KEYWORD) for name in names]
    typing.__signature__ = Signature(parameters)  # type: ignore[attr-defined]
    return intrinsic(typing)


def caller(signature: Any) -> Any:
    """Return an intrinsic that calls a C function of a numba signature; its arguments are the address, then those.

    `jit.address_of` gives addresses of functions of that signature.
    """

    if INTERPRETED:
        return lambda address, *values: PYTHON_FUNCTIONS[int(address)](*values)

    def build(context: Any, builder: Any, _: Any, values: Any) -> Any:
        nothing = signature.return_type == types.void
        result = ir.VoidType() if nothing else context.get_value_type(signature.return_type)
        kind = ir.FunctionType(result, [context.get_value_type(one) for one in signature.args])
        out = builder.call(builder.inttoptr(values[0], kind.as_pointer()), values[1:])
        return context.get_dummy_value() if nothing else out

    out = _intrinsic_of(signature.return_type(types.uint64, *signature.args), build)
    out.signature = signature
    return out


PYTHON_FUNCTIONS: list[Callable[..., Any]] = []
"""Without the compiler: what `caller` calls, by an index in place of the address."""


def address_of_python(function: Callable[..., Any], numbers: np.dtype) -> int:
    """Return the index of a Python function whose second argument, the address of a record, it takes as the record."""
    law_at = element(numbers)
    PYTHON_FUNCTIONS.append(lambda first, address, *more: function(first, law_at(address, 0), *more))
    return len(PYTHON_FUNCTIONS) - 1


def record_at(address: Any, kind: Any, count: Any) -> NDArray[Any]:
    """Return a view of records or numbers at an address."""
    size = np.dtype(kind).itemsize * int(count)
    whole: Any = (ctypes.c_uint8 * size).from_address(int(address)) if size else bytearray()
    return np.frombuffer(whole, kind)


def element(dtype: np.dtype) -> Any:
    """Return an intrinsic that takes the address of an array of records and an index, and returns that record."""
    if INTERPRETED:
        kind: Any = np.dtype((np.record, dtype))
        return lambda address, i: record_at(int(address) + i * dtype.itemsize, kind, 1)[0]
    kind = numba.from_dtype(dtype)

    def build(context: Any, builder: Any, _: Any, values: Any) -> Any:
        place = builder.add(values[0], builder.mul(values[1], ir.Constant(_INT64, dtype.itemsize)))
        return builder.inttoptr(place, context.get_value_type(kind))

    return _intrinsic_of(kind(types.uint64, types.int64), build)


def address_in(dtype: np.dtype) -> Any:
    """Return an intrinsic that takes such a record and returns its address."""
    signature = types.uint64(numba.from_dtype(dtype))
    return _intrinsic_of(signature, lambda _, builder, __, values: builder.ptrtoint(values[0], _INT64))


def _pointer(builder: Any, values: Any, kind: Any = _INT64) -> Any:
    return builder.inttoptr(values[0], kind.as_pointer())


def _load_int64(_: Any, builder: Any, __: Any, values: Any) -> Any:
    return builder.load(builder.gep(_pointer(builder, values), [values[1]]))


def _store_int64(context: Any, builder: Any, _: Any, values: Any) -> Any:
    builder.store(values[2], builder.gep(_pointer(builder, values), [values[1]]))
    return context.get_dummy_value()


def _copy_wholes(context: Any, builder: Any, _: Any, values: Any) -> Any:
    source, target = _pointer(builder, values), _pointer(builder, values[1:])
    cgutils.raw_memmove(builder, target, source, values[2], 8)
    return context.get_dummy_value()


def _same_wholes(_: Any, builder: Any, __: Any, values: Any) -> Any:
    places = [_pointer(builder, values[i:], ir.IntType(8)) for i in range(2)]
    kind = ir.FunctionType(ir.IntType(32), [places[0].type, places[1].type, _INT64])
    compare = cgutils.get_or_insert_function(builder.module, kind, "memcmp")
    differ = builder.call(compare, [*places, builder.mul(values[2], ir.Constant(_INT64, 8))])
    return builder.icmp_signed("==", differ, ir.Constant(ir.IntType(32), 0))


load_int: Any = _intrinsic_of(
    types.int32(types.uint64), lambda _, b, __, values: b.load(_pointer(b, values, ir.IntType(32)))
)
"""Return the C int at an address."""

doubles_at: Any = (
    (lambda address: ctypes.cast(int(address), ctypes.POINTER(ctypes.c_double)))
    if INTERPRETED
    else _intrinsic_of(
        types.CPointer(types.float64)(types.uint64), lambda _, b, __, values: _pointer(b, values, ir.DoubleType())
    )
)
"""Convert an address to a pointer to float64."""

whole_at: Any = _intrinsic_of(types.int64(types.uint64, types.int64), _load_int64)
"""Return an element of an array of int64; arguments: address, index."""

place_at: Any = _intrinsic_of(types.uint64(types.uint64, types.int64), _load_int64)
"""`whole_at` of places that count from zero: as an index an unsigned one need not be looked at for its sign."""

set_whole: Any = _intrinsic_of(types.none(types.uint64, types.int64, types.int64), _store_int64)
"""Write an element of an array of int64; arguments: address, index, value."""

copy_wholes: Any = _intrinsic_of(types.none(types.uint64, types.uint64, types.int64), _copy_wholes)
"""Copy numbers of eight bytes; arguments: addresses of source and target, count."""

same_wholes: Any = _intrinsic_of(types.boolean(types.uint64, types.uint64, types.int64), _same_wholes)
"""Return whether numbers of eight bytes at two addresses are the same to the bit; arguments: addresses, count."""
