"""95 % ranges of mu and kappa: how far each can go before even the best curve fits too badly.

The limit is that of a likelihood ratio if errors are given, and of an F test (Student's t squared) if they are
estimated from the scatter. Unknown errors may differ between impacts: if those that determine a parameter scatter more,
they determine its range. The allowed region need not be connected, so the whole map is searched.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy import optimize, stats

from contactlaw.calibration.fit import Problem, inliers, robust_scale
from contactlaw.calibration.table import Array, Impacts, Mask

WIDEST = 2.5  # a parameter whose 95 % range spans more than this factor is not determined
LEAST_FREEDOM = 2  # degrees of freedom below which the scatter does not give the errors
NORMAL = float(stats.norm.ppf(0.975))
WINDOW = 0.2  # greatest step in a logarithm between points of a profile
FIRST_STEP, LAST_STEP = 0.01, 0.15  # steps along a profile, in the logarithm


def widening(misfit: float, freedom: int, known: bool) -> tuple[float, float] | None:
    """Return the factor from the assumed errors to the actual ones, and the 95 % quantile that goes with it.

    Given errors are widened to the scatter only if that exceeds them beyond chance. The quantile is then Student's, as
    it is if errors are not given. None: errors are unknown and cannot be estimated.
    """
    if known and (freedom < 1 or misfit <= stats.chi2.ppf(0.975, freedom)):
        return 1.0, NORMAL
    return None if freedom < 1 else (float(np.sqrt(misfit / freedom)), float(stats.t.ppf(0.975, freedom)))


@dataclass(frozen=True, eq=False)
class Evidence:
    """Fit of a table and the values that it allows."""

    used: Mask  # of the impacts used, shape (n,)
    best: Array  # mu and kappa of the best fit, shape (2,)
    misfit: float  # chi^2 of the best fit with the given errors; in (m/s)^2 if none are given
    freedom: int  # number of impacts less parameters on which the residuals depend
    scatter: float | None  # factor from the assumed errors to those that the residuals indicate; None: not known
    reach: float  # 95 % of the errors lie within this multiple of the assumed errors; inf: not known
    ranges: Array  # least and greatest mu and kappa allowed at 95 %, shape (2, 2); 0 and inf where the map ends first
    allowed: Array  # mu and kappa of places within the range, shape (m, 2)

    def determined(self, which: int) -> bool:
        """Whether the range of mu (0) or kappa (1) is closed and narrow."""
        low, high = self.ranges[which]
        return bool(high <= WIDEST * low)


def unequal(problem: Problem, place: Array, freedom: int) -> Array:
    """95 % reach for each parameter, shape (fitted,), if the errors differ between impacts.

    The variance of a parameter follows from the residual of each impact, divided by 1 - h for its leverage h (HC3:
    MacKinnon & White, J. Econometrics 29 (1985) 305). The degrees of freedom of Student's t are one less than the
    effective number of impacts that determine the parameter, (sum of a^2)^2/(sum of a^4) (after Bell & McCaffrey,
    Survey Methodology 28 (2002) 169).
    """
    units = np.eye(2)[: problem.fitted]
    slopes = np.stack([(problem.scaled(place + 1e-5 * u) - problem.scaled(place - 1e-5 * u)) / 2e-5 for u in units], 1)
    pull = np.linalg.pinv(slopes, rcond=1e-6)
    kept_back = np.maximum(1.0 - np.einsum("ij,ji->i", slopes, pull), 1e-3)
    own = np.maximum(np.sum(pull**2, axis=1), 1e-300)
    spread = np.sum((pull * problem.scaled(place) / kept_back) ** 2, axis=1) / own
    tell = np.clip(own**2 / np.maximum(np.sum(pull**4, axis=1), 1e-300) - 1.0, 1.0, freedom)
    return np.sqrt(spread) * stats.t.ppf(0.975, tell)


def evaluate(whole: Problem) -> Evidence:
    """Fit a table, find allowed places, and follow the profile of each parameter from the outermost to its ends."""
    used = inliers(whole)
    problem = whole if used.all() else replace(whole, impacts=whole.impacts.chosen(used))
    n, known = problem.impacts.size, problem.impacts.known_errors
    fits = sorted((problem.solve(start) for start in problem.starts()), key=lambda fit: problem.cost(fit[0]))
    best, felt = fits[0]
    misfit, freedom = float(np.sum(problem.scaled(best) ** 2)), n - felt
    if not known:
        misfit = max(misfit, n * problem.least_scale**2)
    wider = widening(misfit, freedom, known)
    if wider is None or (not known and freedom < LEAST_FREEDOM):
        open_range = np.array([[0.0, np.inf], [0.0, np.inf]])
        return Evidence(used, np.exp(best), misfit, freedom, None, np.inf, open_range, np.empty((0, 2)))
    scatter, quantile = wider
    reach = scatter * quantile
    least = float(problem.cost(best))
    reaches = np.full(problem.fitted, reach) if known else np.maximum(unequal(problem, best, freedom), reach)
    limits = least + reaches**2 * (1.0 if known else max(least, n * problem.least_scale**2) / misfit)
    within = np.array([place for place, _ in fits])
    ranges, allowed = np.exp(np.stack([best, best], axis=1)), []
    for axis, most in enumerate(limits.tolist()):
        places = np.concatenate([within[problem.cost(within) <= most], problem.grid[problem.map <= most]])
        allowed.append(places)
        low, high = places[np.argmin(places[:, axis])], places[np.argmax(places[:, axis])]
        ranges[axis] = np.exp([_end(problem, most, low, axis, -1), _end(problem, most, high, axis, 1)])
    if felt == 2 and np.abs(best[1] - problem.grid[0, [0, -1], 1]).min() < 1e-6:
        ranges[0] = 0.0, np.inf  # a better curve may lie beyond the map
    return Evidence(used, np.exp(best), misfit, freedom, scatter, reach, ranges, np.exp(np.concatenate(allowed)))


def _end(problem: Problem, most: float, place: Array, axis: int, side: int) -> float:
    """End of the range of one parameter: where its profile, followed from a place to one side, reaches the cost `most`.

    Args:
        problem: The impacts.
        most: Greatest cost allowed.
        place: An allowed place, shape (2,).
        axis, side: Along ln mu (0) or ln kappa (1), down (-1) or up (1).

    Returns:
        ln mu or ln kappa; -inf or inf where the map ends first.
    """
    first, last, other = problem.grid[0, 0], problem.grid[-1, -1], 1 - axis
    across = np.eye(2)[other]

    def on(value: float) -> Array:
        """Best place nearby with this value of the parameter."""
        new = np.where(np.arange(2) == axis, value, place)
        if problem.fitted == 1:
            return new
        window = np.clip(place[other] + [-WINDOW, WINDOW], first[other], last[other]) - place[other]
        shift = optimize.fminbound(lambda shift: float(problem.cost(new + shift * across)), *window)
        return min(new + shift * across, new, key=problem.cost)

    step, edge = FIRST_STEP, (first if side < 0 else last)[axis]
    while abs(edge - place[axis]) > 1e-6:
        value = place[axis] + side * min(step, abs(edge - place[axis]))
        new = on(value)
        if problem.cost(new) > most:
            return float(optimize.brentq(lambda x: problem.cost(on(x)) - most, place[axis], value, xtol=1e-6))  # type: ignore[arg-type]
        place, step = new, min(2.0 * step, LAST_STEP)
    return side * np.inf


MANY, GROUPS = 4000, 1000  # most impacts that are fitted without averaging; half the greatest number of averages
CHANCE = 0.025  # probability that the farthest impact of a table is left out though it is scatter


def evidence_of(whole: Problem) -> Evidence:
    """`evaluate` of a table; of a large one by averages, without impacts that lie too far from a first fit.

    By the law V_x2/V_z1 is a function of t = V_x1/V_z1 alone, and nearly linear over a thousandth of a table. So mean
    velocities obey it as single ones do, with errors that are smaller by the square root of their number.
    """
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
