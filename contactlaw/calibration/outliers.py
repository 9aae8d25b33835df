"""Impacts that lie too far from the curve to be scatter."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from contactlaw.calibration.fit import Problem
from contactlaw.calibration.table import Array, Mask

ENOUGH, FEW_OF = 6, 5  # impacts more than parameters for outliers to be looked for; at most every fifth is one


def far_limit(freedom: int) -> float:
    """Standard deviations beyond which one of some twenty impacts lies by chance in a few of a hundred tables."""
    return 4.0 * (1.0 + 3.0 / max(freedom, 1))


def middle(scaled: Array, fitted: int, least: float) -> float:
    """Standard deviation from the median of absolute values, which outliers do not move."""
    return max(1.4826 * float(np.median(np.abs(scaled))) * (scaled.size / max(scaled.size - fitted, 1)) ** 0.5, least)


def kept(problem: Problem) -> Mask:
    """Impacts but for those that scatter cannot explain, shape (n,).

    Suspects lie 3 scales of the middle residuals from a robust fit, and are at most every fifth impact; they are left
    out if they also lie too far from the fit without them.
    """
    n = problem.impacts.size
    if n < ENOUGH + problem.fitted:
        return np.ones(n, dtype=bool)

    def scale(place: Array) -> float:
        return middle(problem.scaled(place), problem.fitted, problem.least_scale)

    rough = [problem.solve(start, scale(start))[0] for start in problem.starts()]
    best = min((problem.solve(place, scale(place))[0] for place in rough), key=scale)
    far = np.abs(problem.scaled(best))
    suspects = (far > 3.0 * scale(best)) & (far >= np.sort(far)[-(n // FEW_OF)])
    if not suspects.any():
        return ~suspects
    clean = replace(problem, impacts=problem.impacts.chosen(~suspects))
    place, freedom = clean.solve(best)[0], int(n - suspects.sum()) - problem.fitted
    spread = max(float(np.sum(clean.scaled(place) ** 2) / freedom) ** 0.5, problem.least_scale)
    return ~suspects | (np.abs(problem.scaled(place)) <= far_limit(freedom) * spread)
