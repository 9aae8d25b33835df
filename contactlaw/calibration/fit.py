"""Fit of the rebound curve to measured impacts, without those too far from it to be scatter, and the ranges it allows.

With t = V_x1/V_z1 the law gives V_x2/V_z1 = (mu/kappa) psi_2(psi_1 = kappa t/mu, chi = kappa c/2), c = m_N/m_T. All
velocities have errors, those before the impact too; a residual has the variance of all of them, propagated along the
curve (effective variance). The curve is not monotonic; it does not depend on kappa where everything slides, nor on mu
where everything sticks. So fits start from every local minimum of a map of the cost. Places are (ln mu, ln kappa),
shape (..., 2).

A 95 % range tells how far mu or kappa can go before even the best curve fits too badly: beyond the limit of a
likelihood ratio if errors are given, of an F test (Student's t squared) if they are estimated from the scatter. Unknown
errors may differ between impacts: if those that determine a parameter scatter more, they determine its range. The
allowed region need not be connected, so the whole map is searched.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import ndimage, optimize, stats

from contactlaw.calibration.curve import Curve, curve, distances, sliding_from
from contactlaw.calibration.table import Array, Impacts, Mask

KAPPA_RANGE = (0.3, 2.0)  # range of the search; G*/E* of elastic materials is 2/3 to 4/3
FRICTION_GRID = np.geomspace(0.4, 25.0, 64)  # in units of the greatest impulse ratio
STARTS = 5  # local minima from which a fit starts, at most
LEAST_SCATTER = 1e-9  # relative error of a velocity by rounding, for synthetic impacts exactly on the curve
SAME = 2.0  # impacts at angles that scatter by less than this multiple of their errors count as one


@dataclass(frozen=True, eq=False)
class Problem:
    """A table of impacts, and the curve to be fitted."""

    impacts: Impacts
    curve: Curve
    grid: Array  # places of the map, shape (m, k, 2); k = 1: kappa is held
    column: int  # index of the given kappa on the map

    @property
    def fitted(self) -> int:
        """Number of fitted parameters."""
        return 1 if self.grid.shape[1] == 1 else 2

    @property
    def least_scale(self) -> float:
        """Lower bound on the scale of residuals over deviations: 1 with given errors, else rounding."""
        return 1.0 if self.impacts.known_errors else LEAST_SCATTER * float(self.impacts.velocities[0].mean())

    def residuals(self, place: Array) -> Array:
        """V_x2 less the curve, and its standard deviation [m/s], shape (2, ..., n)."""
        rows, own = np.ascontiguousarray(place.reshape(-1, 2)), self.impacts.own_restitution
        ends = sliding_from(np.exp(rows[:, 1]), self.curve.mass_ratio, self.curve.restitution)
        return distances(rows, ends, self._rows, own, *self.curve).reshape(2, *place.shape[:-1], -1)

    @cached_property
    def _rows(self) -> Array:
        return np.concatenate([self.impacts.velocities, self.impacts.errors]).T.copy()

    def scaled(self, place: Array) -> Array:
        """Residuals over their deviations, shape (..., n)."""
        return np.divide(*self.residuals(place))

    def terms(self, place: Array) -> Array:
        """Terms whose squares sum to the cost, shape (..., n or 2 n).

        With given errors the cost is -2 ln(likelihood) up to a constant; without, n ln(cost) is.
        """
        residual, deviation = self.residuals(place)
        if not self.impacts.known_errors:
            return residual / deviation * np.exp(np.mean(np.log(deviation), axis=-1, keepdims=True))
        volume = np.sqrt(2.0 * np.log(np.maximum(deviation / self.impacts.errors[3], 1.0)))
        return np.concatenate([residual / deviation, volume], axis=-1)

    def cost(self, place: Array) -> Array:
        """Sum of the squared `terms`, shape (...)."""
        return np.sum(self.terms(place) ** 2, axis=-1)

    @cached_property
    def map(self) -> tuple[Array, Array]:
        """Places of the grid, those of low cost moved to the least within their cells, (m, k, 2); and costs, (m, k).

        Impacts at one angle fit all along a line of places, and small errors make it narrower than the cells.
        """
        places, cost = self.grid.copy(), np.stack([self.cost(row) for row in self.grid])  # all at once takes memory
        low, nearby = cost <= ndimage.minimum_filter1d(cost, 3, axis=0), np.array([1e-5, 0.0])
        best, (first, second, last) = places[low], self.grid[[0, 1, -1], 0, 0]
        reach = 0.5 * (second - first)
        least, most = np.maximum(best[:, 0] - reach, first), np.minimum(best[:, 0] + reach, last)
        for _ in range(2):  # Gauss-Newton along ln mu
            now = self.scaled(best)
            slope = (self.scaled(best + nearby) - now) / nearby[0]
            move = np.sum(now * slope, axis=-1) / np.maximum(np.sum(slope**2, axis=-1), 1e-300)
            best[:, 0] = np.clip(best[:, 0] - move, least, most)
        new = self.cost(best)
        places[low] = np.where((new < cost[low])[:, None], best, places[low])
        cost[low] = np.minimum(new, cost[low])
        return places, cost

    def starts(self) -> list[Array]:
        """Return the best place at the given kappa, and the best local minima of the map, shape (2,) each."""
        places, cost = self.map
        low = cost <= ndimage.minimum_filter(cost, 3) * (1.0 + 1e-9)
        labels = np.array(ndimage.label(low, np.ones((3, 3)))[0])  # type: ignore[index]
        cells = ndimage.minimum_position(cost, labels, range(1, int(labels.max()) + 1))
        given = int(np.argmin(cost[:, self.column])), self.column
        return [places[cell] for cell in dict.fromkeys((given, *sorted(cells, key=lambda cell: cost[cell])[:STARTS]))]

    def solve(self, start: Array, scale: float | None = None) -> tuple[Array, int]:
        """Return the place of the least squares from one start, and the number of parameters that residuals feel there.

        scale: residuals beyond 1.345 times this have a linear cost (Huber); None: all have a quadratic one.
        """
        held, edges = start[self.fitted :], self.grid[[0, -1], [0, -1], : self.fitted]
        terms, loss = (self.terms, "linear") if scale is None else (self.scaled, "huber")
        near = 1.5e-8 * np.eye(3, 2, -1)[: self.fitted + 1]
        unit = float(np.linalg.norm(terms(start))) or 1.0  # for gtol: scipy divides by a gradient that is exactly zero

        def slopes(free: Array) -> Array:
            at, *beside = terms(np.append(free, held) + near) / unit  # at once, which takes little longer than one
            return (np.array(beside) - at).T / near.max()

        found = optimize.least_squares(
            lambda free: terms(np.append(free, held)) / unit, np.clip(start[: self.fitted], *edges), loss=loss,
            bounds=edges + [[-1e-9], [1e-9]], f_scale=1.345 * (scale or 1.0) / unit, xtol=1e-9, ftol=1e-10,
            gtol=np.finfo(float).eps, jac=slopes,  # type: ignore[arg-type]
        )  # fmt: skip
        felt = np.abs(found.jac).max(axis=0)
        return np.append(found.x, held), int(np.count_nonzero(felt > 1e-5 * felt.max()))


def problem_of(impacts: Impacts, restitution: float, kappa: float, *, hold: bool) -> Problem:
    """Return the problem of a table in which some impact lost tangential velocity; kappa is the start, or held."""
    low, high = (0.9 * kappa, 1.1 * kappa) if hold else KAPPA_RANGE
    law = curve(max(round(restitution, 2), 0.01), impacts.mass_ratio, low, high)
    kappas = np.array([kappa]) if hold else np.geomspace(low, high, 25)
    frictions = FRICTION_GRID * float(impacts.impulse_ratio[0].max())
    grid = np.log(np.stack(np.meshgrid(frictions, kappas, indexing="ij"), axis=-1))
    return Problem(impacts, law, grid, int(np.argmin(np.abs(kappas - kappa))))


SPARE, ONE_IN = 6, 5  # least number of impacts less parameters for a search; at most one in five is an outlier
CHANCE = 0.025  # probability that the farthest impact of a table lies so far by chance


def far_limit(freedom: int) -> float:
    """Limit in standard deviations that one impact exceeds by chance in a few of a hundred tables."""
    return max(4.0 * (1.0 + 3.0 / max(freedom, 1)), float(stats.norm.isf(0.5 * CHANCE / max(freedom, 1))))


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
        places = np.concatenate([within[problem.cost(within) <= most], problem.map[0][problem.map[1] <= most]])
        allowed.append(places)
        low, high = places[np.argmin(places[:, axis])], places[np.argmax(places[:, axis])]
        ranges[axis] = np.exp([_end(problem, most, low, axis, -1), _end(problem, most, high, axis, 1)])
    if felt == 2 and np.abs(best[1] - problem.grid[0, [0, -1], 1]).min() < 1e-6:
        ranges[0] = 0.0, np.inf  # a better curve may lie beyond the map
    return Evidence(used, np.exp(best), misfit, freedom, scatter, reach, ranges, np.exp(np.concatenate(allowed)))


def _end(problem: Problem, most: float, place: Array, axis: int, side: int) -> float:
    """End of the range of one parameter: where its profile, followed from a place to one side, reaches the cost `most`.

    axis, side: along ln mu (0) or ln kappa (1), down (-1) or up (1). Returns that logarithm; -inf or inf where the map
    ends first.
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


def evidence_of(whole: Problem) -> Evidence:
    """Fit of a table and the values that it allows, from the mean impact if all are at one angle.

    The errors of V_x1 then move no V_x2, as they would along a curve: the scatter speaks for a flat curve, and so for
    places that may be far from the truth.
    """
    evidence = evaluate(whole)
    impacts = whole.impacts.chosen(evidence.used)
    if impacts.size == 1 or not np.isfinite(evidence.reach):
        return evidence
    (z1, x1, z2, x2), errors = impacts.velocities, impacts.errors * evidence.reach / NORMAL
    side, t = np.where(x1 < 0.0, -1.0, 1.0), np.abs(x1) / z1
    if np.mean(((t - t.mean()) * z1) ** 2 / (errors[1] ** 2 + (t * errors[0]) ** 2)) > SAME**2:
        return evidence
    velocities = np.mean([z1, side * x1, z2, side * x2], axis=1, keepdims=True)
    deviations = np.sqrt(np.mean(errors**2, axis=1, keepdims=True) / impacts.size)
    one = replace(impacts, velocities=velocities, errors=deviations, known_errors=True)
    mean = evaluate(replace(whole, impacts=one))
    return replace(evidence, best=mean.best, ranges=mean.ranges, allowed=mean.allowed)
