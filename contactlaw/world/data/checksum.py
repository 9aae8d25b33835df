"""A number that tells some numbers from others, bit by bit."""

from __future__ import annotations

import numpy as np
from numba import types

from contactlaw.jit import jit_inside
from contactlaw.memory import whole_at

GOLDEN, HALF = np.uint64(0x9E3779B97F4A7C15), np.uint64(32)  # 2^64 over the golden ratio; bits of half a number


@jit_inside
def mix(numbers, first, last, before):
    """A sum of products with odd numbers, each of its place: zeros add nothing, and no product waits for another.

    before: how many places come before the first number at the address.
    """
    mixed = types.uint64(0)
    for i in range(first, last):
        bits, odd = types.uint64(whole_at(types.uint64(numbers), i)), types.uint64(before + i) * GOLDEN
        mixed += (bits ^ (bits >> HALF)) * (odd ^ (odd >> HALF) | types.uint64(1))
    return mixed


@jit_inside
def one_of(mixed):
    """A check sum that is mixed as a number that is not zero."""
    mixed = (mixed ^ (mixed >> HALF)) * GOLDEN
    return 1.0 + float(mixed >> types.uint64(12))
