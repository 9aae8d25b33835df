"""A checksum of numbers, sensitive to every bit."""

import numpy as np
from numba import types

from contactlaw.jit import jit
from contactlaw.memory import whole_at

GOLDEN, HALF = np.uint64(0x9E3779B97F4A7C15), np.uint64(32)  # 2^64 over the golden ratio; half the bits of a number


@jit
def mix(numbers, first, last, before):
    """Return the checksum of the numbers first, ..., last - 1 at an address, as an unsigned integer.

    Each number's bits are multiplied by an odd factor that depends on its place, and the products are summed: zeros add
    nothing, and no product waits for another. before: places that precede the first number at the address, so that the
    checksum of several arrays is the sum of theirs.
    """
    mixed = types.uint64(0)
    for i in range(first, last):
        bits, odd = types.uint64(whole_at(types.uint64(numbers), i)), types.uint64(before + i) * GOLDEN
        mixed += (bits ^ (bits >> HALF)) * (odd ^ (odd >> HALF) | types.uint64(1))
    return mixed


@jit
def as_float(mixed):
    """Return a mixed checksum as a float that is not zero."""
    mixed = (mixed ^ (mixed >> HALF)) * GOLDEN
    return 1.0 + float(mixed >> types.uint64(12))
