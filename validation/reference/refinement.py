"""The limit of a computation that is refined, with an estimate of what is left."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from validation.reference.normal_motion import Array


def extrapolated(run: Callable[[int], Array], least: int) -> tuple[Array, float]:
    """What a computation tends to whose error is of first order in 1/fineness.

    Args:
        run: Result for a fineness: cells or rings, and steps, all in proportion to it.
        least: The coarsest of the three that are run: least, 2 least, 4 least.

    Returns:
        The extrapolation from the finer two, and the largest change from that of the coarser two.
    """
    coarse, middle, fine = (run(least * factor) for factor in (1, 2, 4))
    value = 2.0 * fine - middle
    return value, float(np.abs(value - (2.0 * middle - coarse)).max())
