"""Laws of the pairs of materials of a world: their numbers, and the history that they keep of a contact."""

from math import isnan

from numba import carray  # pyright: ignore[reportPrivateImportUsage]

from contactlaw.jit import jit_module
from contactlaw.laws.record import PAIR_SIZE, law_at
from contactlaw.memory import doubles_at


def memory_of(w, slot):
    """Return the history that the law keeps of the contact in a slot, shape (size,)."""
    return carray(doubles_at(w.memory + 8 * w.memory_size * slot), w.memory_size)


def law_of(w, pair):
    """Return the parameters of a pair of materials that all laws share."""
    return law_at(w.numbers + 8 * pair.numbers, 0)


def friction_of(pair, a, b):
    """Return the friction coefficient of a pair of materials for shapes a and b.

    If the pair has none: that of the shape with the higher priority, the greater one if both have the same. Of these
    even a frictionless one counts beside one that is not.
    """
    if not isnan(pair.friction):
        return pair.friction
    if a.priority == b.priority:
        return 0.0 if a.frictionless + b.frictionless == 2 else max(a.friction, b.friction)
    first = a if a.priority > b.priority else b
    return 0.0 if first.frictionless != 0 else first.friction


def law_numbers(w, pair):
    """Return the law's own parameters of a pair."""
    return carray(doubles_at(w.numbers + 8 * (pair.numbers + PAIR_SIZE)), 1)


def speed_numbers(w, pair):
    """Return the parameters of `losses` of a pair that has them."""
    return carray(doubles_at(w.numbers + 8 * (pair.numbers + int(law_of(w, pair).speeds))), 1)


jit_module(__name__)
