"""Large tables: impacts of nearly the same angle of incidence are averaged, and the averages are fitted.

By the law V_x2/V_z1 is a function of t = V_x1/V_z1 alone, and nearly linear over a thousandth of a table. So mean
velocities obey it as single ones do, with errors that are smaller by the square root of their number.
"""

from dataclasses import replace

import numpy as np
from scipy import stats

from contactlaw.calibration.fit import Problem
from contactlaw.calibration.outliers import robust_scale
from contactlaw.calibration.ranges import Evidence, evaluate
from contactlaw.calibration.table import Array, Impacts, Mask

MANY, GROUPS = 4000, 1000  # most impacts that are fitted without averaging; half the greatest number of averages
CHANCE = 0.025  # probability that the farthest impact of a table is left out though it is scatter


def evidence_of(whole: Problem) -> Evidence:
    """`ranges.evaluate` of a table; of a large one by averages, without impacts that lie too far from a first fit."""
    impacts = whole.impacts
    if impacts.size <= MANY:
        return evaluate(whole)
    first = _averaged(whole, np.ones(impacts.size, dtype=bool))
    far = np.abs(whole.scaled(np.log(first.best)))
    used = far <= stats.norm.isf(0.5 * CHANCE / impacts.size) * robust_scale(far, whole.fitted, whole.least_scale)
    return replace(_averaged(whole, used), used=used)


def _averaged(whole: Problem, used: Mask) -> Evidence:
    """Evidence from averages over the impacts used; its `used` is a mask of the averages."""
    z1, x1, z2, x2 = whole.impacts.velocities
    side = np.where(x1 < 0.0, -1.0, 1.0)
    t, rank = np.abs(x1) / z1, np.empty(z1.size, dtype=np.intp)
    rank[np.argsort(t, kind="stable")] = np.arange(t.size) * GROUPS // t.size  # groups of few impacts
    narrow = (GROUPS * t[used] / t.max()).astype(np.intp)  # and of a narrow range of t
    count, group = np.unique(rank[used] * (GROUPS + 1) + narrow, return_inverse=True, return_counts=True)[1:][::-1]

    def mean(row: Array) -> Array:
        return np.bincount(group, row[used]) / count

    velocities = np.stack([mean(row) for row in (z1, np.abs(x1), z2, side * x2)])
    errors = np.stack([np.sqrt(mean(row**2) / count) for row in whole.impacts.errors])
    same = whole.impacts
    averages = Impacts(velocities, errors, same.known_errors, same.mass_ratio, same.own_restitution)
    return evaluate(replace(whole, impacts=averages))
