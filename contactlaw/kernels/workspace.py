"""Scratch memory for one step of all contacts, lent by the engine's adapter.

Arrays that numba makes count their references with atomic instructions, for every row or slice that is looked at: half
the time of a step with one contact. What is cut from memory that comes as a plain pointer has no count. Whoever lends
the memory clears it before a step; what does not fit into it is made as usual.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import carray, types  # pyright: ignore[reportPrivateImportUsage]
from numba.extending import overload

from contactlaw.jit import jit
from contactlaw.memory import doubles_at

USED = 0  # how many of its numbers are in use, this one among them


def bare(values: Any) -> Any:
    """The same numbers (n,) without a count of references; the caller keeps them alive."""
    return values


@overload(bare)
def _bare(values: Any) -> Any:
    def look(values: Any) -> Any:
        return carray(doubles_at(types.uintp(values.ctypes.data)), values.size)

    return look


@jit
def clear(work_out):
    """Begin a step."""
    work_out[USED] = 1.0


@jit
def numbers(work_io, count):
    """Numbers (count,) that hold anything."""
    start = int(work_io[USED])
    end = start + count
    if end > work_io.size:
        return np.empty(count)
    work_io[USED] = end
    return work_io[start:end]


@jit
def zeros(work_io, count):
    """Numbers (count,) that are zero."""
    out = numbers(work_io, count)
    for i in range(count):
        out[i] = 0.0
    return out


@jit
def table(work_io, rows, columns):
    """A table that holds anything."""
    return numbers(work_io, rows * columns).reshape((rows, columns))


@jit
def zero_table(work_io, rows, columns):
    """A table of zeros."""
    return zeros(work_io, rows * columns).reshape((rows, columns))


@jit
def wholes(work_io, count):
    """Whole numbers (count,) that hold anything."""
    return numbers(work_io, count).view(np.int64)
