"""Large tables: rows that hit at nearly the same angle are averaged, and the averages are fitted.

The law's V_x2/V_z1 is a function of t = V_x1/V_z1 alone, nearly straight over a thousandth of a table. There mean
velocities lie on it as single ones do, with errors smaller by the square root of their number.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import stats

from contactlaw.calibration.fit import Problem
from contactlaw.calibration.outliers import middle
from contactlaw.calibration.ranges import Evidence, weigh
from contactlaw.calibration.table import Array, Impacts, Mask

MANY, GROUPS = 4000, 1000  # rows of a table that is fitted as it is, at most; half the averages of one that is not
CHANCE = 0.025  # of a table, that its farthest row is left out though it is scatter


def evidence_of(whole: Problem) -> Evidence:
    """As `ranges.weigh`; of a large table from averages, with rows left out that lie too far from a first fit."""
    impacts = whole.impacts
    if impacts.size <= MANY:
        return weigh(whole)
    first = _averaged(whole, np.ones(impacts.size, dtype=bool))
    far = np.abs(whole.scaled(np.log(first.best)))
    used = far <= stats.norm.isf(0.5 * CHANCE / impacts.size) * middle(far, whole.fitted, whole.least_scale)
    return replace(_averaged(whole, used), used=used)


def _averaged(whole: Problem, used: Mask) -> Evidence:
    """The evidence of averages over the rows used; its `used` is that of the averages."""
    z1, x1, z2, x2 = whole.impacts.velocities
    side = np.where(x1 < 0.0, -1.0, 1.0)
    t, rank = np.abs(x1) / z1, np.empty(z1.size, dtype=np.intp)
    rank[np.argsort(t, kind="stable")] = np.arange(t.size) * GROUPS // t.size  # so that a group is small
    narrow = (GROUPS * t[used] / t.max()).astype(np.intp)  # and does not bridge a gap
    count, group = np.unique(rank[used] * (GROUPS + 1) + narrow, return_inverse=True, return_counts=True)[1:][::-1]

    def mean(row: Array) -> Array:
        return np.bincount(group, row[used]) / count

    velocities = np.stack([mean(row) for row in (z1, np.abs(x1), z2, side * x2)])
    errors = np.stack([np.sqrt(mean(row**2) / count) for row in whole.impacts.errors])
    same = whole.impacts
    averages = Impacts(velocities, errors, same.known_errors, same.mass_ratio, same.own_restitution)
    return weigh(replace(whole, impacts=averages))
