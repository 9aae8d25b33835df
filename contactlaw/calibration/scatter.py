"""How large scatter may be by chance: Student's quantile, given errors against the scatter, and outliers."""

from __future__ import annotations

import numpy as np

STUDENT = (12.71, 4.30, 3.18, 2.78, 2.57, 2.45, 2.36, 2.31)  # two-sided 95 % by degrees of freedom, 1 to 8
NORMAL = 1.96  # the same for errors that are known


def far_limit(freedom: int) -> float:
    """Standard deviations beyond which one of some twenty impacts lies by chance in a few of a hundred tables."""
    return 4.0 * (1.0 + 3.0 / max(freedom, 1))


def quantile(freedom: int) -> float:
    """Student's two-sided 95 % quantile for degrees of freedom >= 1, within 1 %."""
    return STUDENT[freedom - 1] if freedom <= len(STUDENT) else 1.96 + 2.6 / freedom


def widening(misfit: float, freedom: int, known: bool) -> float | None:
    """Factor from the errors as they are held to those that count; None: unknown errors and nothing to tell them by.

    Given errors are widened to the scatter only where that is beyond chance (two standard deviations of chi^2).
    """
    if not known:
        return float(np.sqrt(misfit / freedom)) if freedom > 0 else None
    if freedom > 0 and misfit / freedom > 1.0 + 2.0 * np.sqrt(2.0 / freedom):
        return float(np.sqrt(misfit / freedom))
    return 1.0
