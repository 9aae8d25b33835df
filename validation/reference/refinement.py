"""A path as its solvers take it; a figure for arrays; the limit of a computation that is refined, with an estimate of
what is left."""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from validation.reference.normal_motion import Array


def sampled(approach: ArrayLike, displacement: ArrayLike) -> tuple[Array, Array]:
    """Contact radius and displacement along a path of overlaps (n,) and displacements (n, m)."""
    return np.sqrt(np.maximum(np.array(approach, dtype=float), 0.0)), np.array(displacement, dtype=float)


def broadcast(one: Callable[..., float], *given: ArrayLike) -> float | Array:
    """A function of numbers, of arrays that broadcast; a float for scalars."""
    result = np.vectorize(one, otypes=[float])(*given)
    return float(result) if result.ndim == 0 else result


def extrapolated(run: Callable[[int], Array], least: int) -> tuple[Array, float]:
    """What a computation tends to whose error is of first order in 1/fineness (cells or rings, and steps alike).

    Of least, 2 least and 4 least: the extrapolation from the finer two, and its largest change from the coarser two's.
    """
    coarse, middle, fine = (run(least * factor) for factor in (1, 2, 4))
    value = 2.0 * fine - middle
    return value, float(np.abs(value - (2.0 * middle - coarse)).max())
