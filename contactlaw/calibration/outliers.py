"""Outliers: impacts that lie farther from the curve than scatter explains."""

from dataclasses import replace

import numpy as np

from contactlaw.calibration.fit import Problem
from contactlaw.calibration.table import Array, Mask

SPARE, ONE_IN = 6, 5  # least number of impacts less parameters for a search; at most one in five is an outlier


def far_limit(freedom: int) -> float:
    """Limit in standard deviations that, of some twenty impacts, one exceeds by chance in a few of a hundred tables."""
    return 4.0 * (1.0 + 3.0 / max(freedom, 1))


def robust_scale(scaled: Array, fitted: int, least: float) -> float:
    """Robust standard deviation, from the median of absolute values, but at least `least`."""
    return max(1.4826 * float(np.median(np.abs(scaled))) * (scaled.size / max(scaled.size - fitted, 1)) ** 0.5, least)


def inliers(problem: Problem) -> Mask:
    """Return the mask of impacts that are not outliers, shape (n,).

    Suspects lie more than 3 robust standard deviations from a robust fit, and are at most one impact in five. They are
    outliers if they also lie too far from the fit without them.
    """
    n = problem.impacts.size
    if n < SPARE + problem.fitted:
        return np.ones(n, dtype=bool)

    def scale(place: Array) -> float:
        return robust_scale(problem.scaled(place), problem.fitted, problem.least_scale)

    rough = [problem.solve(start, scale(start))[0] for start in problem.starts()]
    best = min((problem.solve(place, scale(place))[0] for place in rough), key=scale)
    far = np.abs(problem.scaled(best))
    suspects = (far > 3.0 * scale(best)) & (far >= np.sort(far)[-(n // ONE_IN)])
    if not suspects.any():
        return ~suspects
    clean = replace(problem, impacts=problem.impacts.chosen(~suspects))
    place, freedom = clean.solve(best)[0], int(n - suspects.sum()) - problem.fitted
    spread = max(float(np.sum(clean.scaled(place) ** 2) / freedom) ** 0.5, problem.least_scale)
    return ~suspects | (np.abs(problem.scaled(place)) <= far_limit(freedom) * spread)
