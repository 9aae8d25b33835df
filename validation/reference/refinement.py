"""Finer samples of a path; the limit of a computation that is refined, with an estimate of what is left."""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from validation.reference.normal_motion import Array


def sampled(approach: ArrayLike, displacement: ArrayLike, substeps: int) -> tuple[Array, Array]:
    """Contact radius and displacement along a path of overlaps (n,) and displacements (n, m), sampled more finely."""
    depth, moved = np.array(approach, dtype=float), np.array(displacement, dtype=float)
    given = np.arange(depth.size)
    fine = np.linspace(0.0, depth.size - 1.0, (depth.size - 1) * substeps + 1)
    path = np.stack([np.interp(fine, given, one) for one in moved.T], 1)
    return np.sqrt(np.maximum(np.interp(fine, given, depth), 0.0)), path


def extrapolated(run: Callable[[int], Array], least: int) -> tuple[Array, float]:
    """What a computation tends to whose error is of first order in 1/fineness (cells or rings, and steps alike).

    Of least, 2 least and 4 least: the extrapolation from the finer two, and its largest change from the coarser two's.
    """
    coarse, middle, fine = (run(least * factor) for factor in (1, 2, 4))
    value = 2.0 * fine - middle
    return value, float(np.abs(value - (2.0 * middle - coarse)).max())
