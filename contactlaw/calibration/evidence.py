"""The fit to a table of impacts, its rivals, and the range of friction and stiffness ratio that the table allows.

A covariance knows only the neighbourhood of one solution. The curve psi_2(psi_1) turns back on itself, so that one
impact may fit two values of mu, and it does not feel kappa where everything slides, nor mu where everything sticks. The
misfit is therefore mapped over all mu and kappa, and what the map allows decides whether a value is given at all.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contactlaw.calibration import impact_fit as law
from contactlaw.calibration.impact_fit import Array, Impacts, Solution
from contactlaw.calibration.scatter import NORMAL, far_limit, quantile, widening

Mask = NDArray[np.bool_]
Place = tuple[float, float]
"""mu, kappa."""

WIDEST = 2.5  # a 95 % range that spans more than this factor determines nothing
LEAST_SCATTER = 1e-9  # of a velocity, relative: rounding, where synthetic impacts lie exactly on the curve
ENOUGH = 6  # impacts more than parameters from which on one can be told to be too far off
FEW_OF = 5  # at most every fifth
LEAST_FREEDOM = 2  # degrees of freedom below which scatter does not tell the errors
HOPELESS = 2.5  # a start at which the middle residuals are so many e-folds larger than at a solution leads to no rival
SURE = 2.0  # times the reach of 95 %: where any rival must lie near too, or there is no value
SAME = 0.1  # solutions nearer than this in both logarithms are one
FEW, SHARP = 6, 0.07  # fewer impacts, or larger errors of the logarithms: valleys, narrower than the map, are followed


def sliding_friction(impacts: Impacts, restitution: float, kappa: float) -> float:
    """The paper's procedure: mean mu of the impacts that slide at that mu, found by turns.

    Args:
        impacts: n impacts.
        restitution: e.
        kappa: Stiffness ratio that decides, with mu, what slides.

    Returns:
        mu; the greatest impulse ratio if none slides.
    """
    ratio, weight = impacts.impulse_ratio, impacts.impulse_ratio_error**-2.0
    mu, end = float(ratio.max()), float(law.sliding_from(kappa, impacts.mass_ratio, restitution))
    slides = np.zeros(ratio.size, dtype=bool)
    for _ in range(30):
        now = kappa / mu * np.abs(impacts.incidence) >= end
        mean = float(np.sum((weight * ratio)[now]) / np.sum(weight[now])) if now.any() else 0.0
        if mean <= 0.0 or (now == slides).all():
            break
        slides, mu = now, mean
    return mu


@dataclass(frozen=True, eq=False)
class Problem:
    """What is asked of a table.

    Attributes:
        impacts: The impacts, n of them.
        restitution: e of the curve.
        start: kappa to start from, or the known one.
        fitted: 1: mu alone; 2: mu and kappa.
    """

    impacts: Impacts
    restitution: float
    start: float
    fitted: int

    @property
    def kappas(self) -> Array:
        """kappa of the map."""
        return law.KAPPA_GRID if self.fitted == 2 else np.array([self.start])

    @property
    def frictions(self) -> Array:
        """mu of the map."""
        return law.FRICTION_GRID * float(self.impacts.impulse_ratio.max())

    @property
    def size(self) -> int:
        """Number of impacts."""
        return self.impacts.normal_before.size

    @property
    def least(self) -> float:
        """Misfit that rounding alone makes."""
        return float(np.sum((LEAST_SCATTER * self.impacts.normal_before / self.impacts.errors[3]) ** 2))

    def chosen(self, used: Mask) -> Problem:
        """The same of some of the impacts."""
        return Problem(self.impacts.chosen(used), self.restitution, self.start, self.fitted)

    def map(self) -> tuple[Array, Array]:
        """Misfit and volume over mu and kappa."""
        return law.misfit_map(self.impacts, self.restitution, self.frictions, self.kappas)

    def badness(self, misfit: Array, volume: Array) -> Array:
        """-2 ln(likelihood) but for a constant; with unknown errors at their likeliest size."""
        if self.impacts.known_errors:
            return misfit + volume
        return self.size * np.log(np.maximum(misfit, self.least)) + volume

    def solve(
        self, start: Place, used: Mask | None = None, *, robust: bool = False, free: tuple[bool, bool] | None = None
    ) -> Solution:
        """Least squares from one start."""
        counted = np.ones(self.size, dtype=bool) if used is None else used
        fitted = (True, self.fitted == 2) if free is None else free
        return law.least_squares(self.impacts, self.restitution, start, free=fitted, used=counted, robust=robust)

    def solutions(self, starts: Iterable[Place], *, robust: bool = False) -> list[Solution]:
        """Different solutions from these starts."""
        found: list[Solution] = []
        for start in starts:
            known = (np.log([one.friction / start[0], one.stiffness_ratio / start[1]]) for one in found)
            if any(np.abs(distance).max() < SAME for distance in known):
                continue
            if found and self._at(start) > min(self.middle(one) for one in found) + HOPELESS:
                continue
            found.append(self.solve(start, robust=robust))
        return found

    def middle(self, solution: Solution) -> float:
        """Logarithm of the scale of the middle residuals, which outliers do not move."""
        scale = law.robust_scale(solution.residual / solution.deviation, self.fitted)
        floor = max(1.0 if self.impacts.known_errors else 0.0, float(np.sqrt(self.least / self.size)))
        return float(np.log(max(scale, floor)) + np.mean(np.log(solution.deviation)))

    def _at(self, place: Place) -> float:
        return self.middle(law.evaluate(self.impacts, self.restitution, *place))


def hollows(ground: Array, problem: Problem, most: int = 3) -> list[Place]:
    """The lowest places of a map, shape (m, k), that lie below all their neighbours; best first."""
    fenced = np.pad(ground, 1, constant_values=np.inf)
    rows, columns = ground.shape
    around = [fenced[1 + i : 1 + i + rows, 1 + j : 1 + j + columns] for i in (-1, 0, 1) for j in (-1, 0, 1)]
    cells = np.argwhere(ground <= np.min(around, axis=0)).tolist()
    cells.sort(key=lambda cell: ground[tuple(cell)])
    return [(float(problem.frictions[i]), float(problem.kappas[j])) for i, j in cells[:most]]


def without_outliers(problem: Problem, starts: list[Place]) -> tuple[Mask, Place]:
    """Impacts but for those that scatter cannot explain, shape (n,), and where a fit to the others may start.

    Suspects lie 3 scales of the middle residuals from a robust fit, and are at most every fifth impact; they are left
    out for good if they also lie too far from the fit without them.
    """
    n, everything = problem.size, np.ones(problem.size, dtype=bool)
    if n < ENOUGH + problem.fitted:
        return everything, starts[0]
    floor = max(1.0 if problem.impacts.known_errors else 0.0, float(np.sqrt(problem.least / n)))
    rough = problem.solutions(starts, robust=True)
    best = min(rough, key=problem.middle)
    place, scaled = (best.friction, best.stiffness_ratio), np.abs(best.residual / best.deviation)
    farthest = np.sort(scaled)[-(n // FEW_OF)]
    suspects = (scaled > 3.0 * max(law.robust_scale(scaled, problem.fitted), floor)) & (scaled >= farthest)
    if not suspects.any():
        return everything, place
    clean = problem.solve(place, ~suspects)
    freedom = int(n - suspects.sum()) - problem.fitted
    spread = max(float(np.sqrt(clean.misfit(~suspects) / freedom)), floor)
    return ~suspects | (np.abs(clean.residual / clean.deviation) <= far_limit(freedom) * spread), place


@dataclass(frozen=True, eq=False)
class Evidence:
    """What a table allows.

    Attributes:
        problem: The impacts that are used.
        used: Which of the table these are.
        best: The solution.
        widening: Factor from the errors as held to those that count (`scatter.widening`); None: not known.
        freedom: Degrees of freedom.
        reach: 95 % quantile in units of the errors that count.
        ranges: Least and greatest mu and kappa allowed at 95 %, shape (2, 2); 0 and inf where the map ends first.
        beyond: The same for `SURE` times the reach.
        errors: Standard deviations of ln mu and ln kappa about the best, shape (2,); inf: no impact feels it.
        allowed: mu and kappa of all places within the range, shape (m, 2).
    """

    problem: Problem
    used: Mask
    best: Solution
    widening: float | None
    freedom: int
    reach: float
    ranges: Array
    beyond: Array
    errors: Array
    allowed: Array

    def determined(self, which: int) -> bool:
        """Whether the range of mu (0) or kappa (1) is closed and narrow."""
        if self.widening is None or not np.isfinite(self.errors[which]):
            return False
        (low, high), (lowest, highest) = self.ranges[which], self.beyond[which]
        return bool(high <= WIDEST * low and highest <= WIDEST**2 * lowest)

    def uncertainty(self, which: int) -> float:
        """Standard uncertainty of mu (0) or kappa (1); with the other one not determined, from the range."""
        value = (self.best.friction, self.best.stiffness_ratio)[which]
        local = float(value * self.errors[which]) * self.reach / NORMAL
        if self.determined(1 - which):
            return local
        low, high = self.ranges[which]
        return max(local, float(0.5 * (high - low)) / NORMAL)


def weigh(whole: Problem) -> Evidence:
    """Fit a table in which some impact lost tangential velocity, and find what else it allows."""
    misfit, volume = whole.map()
    first = (sliding_friction(whole.impacts, whole.restitution, whole.start), whole.start)
    starts = [first, *hollows(whole.badness(misfit, volume), whole)]
    used, place = without_outliers(whole, starts)
    problem = whole if used.all() else whole.chosen(used)
    if not used.all():
        misfit, volume = problem.map()
        starts = hollows(problem.badness(misfit, volume), problem)
    found = problem.solutions([place, *starts])
    freedom, best, wider, errors = _best(problem, found)
    if problem.size < FEW or not (errors < SHARP).all():
        found += _along_valleys(problem, problem.badness(misfit, volume))
        freedom, best, wider, errors = _best(problem, found)
    parts = _parts(problem, found)
    least = max(float(parts[0][best]), problem.least)
    if wider is None:
        ranges = np.array([[0.0, np.inf], [0.0, np.inf]])
        return Evidence(problem, used, found[best], None, freedom, NORMAL, ranges, ranges, errors, np.empty((0, 2)))
    reach = quantile(freedom) if not problem.impacts.known_errors or wider > 1.0 else NORMAL

    def within(misfit: Array, volume: Array, reach: float) -> Mask:
        """Whether a misfit lies within the reach of the best, in units of the errors that count."""
        spread = volume - parts[1][best]
        if problem.impacts.known_errors:
            return (misfit - least) / wider**2 + spread <= reach**2
        return freedom * (np.maximum(misfit, least) / least * np.exp(spread / problem.size) - 1.0) <= reach**2

    mu, kappa = np.meshgrid(problem.frictions, problem.kappas, indexing="ij")
    places = np.array([(one.friction, one.stiffness_ratio) for one in found])

    def allowed_in(reach: float) -> tuple[Array, Array]:
        cells = within(misfit, volume, reach)
        allowed = np.concatenate(
            [np.column_stack([mu[cells], kappa[cells]]), places[within(parts[0], parts[1], reach)]]
        )
        return allowed, _ranges(problem, allowed, found[best], np.where(np.isfinite(errors), reach * errors, 0.0))

    allowed, ranges = allowed_in(reach)
    _, beyond = allowed_in(SURE * reach)
    return Evidence(problem, used, found[best], wider, freedom, reach, ranges, beyond, errors, allowed)


def _parts(problem: Problem, found: list[Solution]) -> Array:
    """Misfit and volume of solutions, shape (2, m)."""
    everything = np.ones(problem.size, dtype=bool)
    return np.array([[one.misfit(everything), one.volume(everything)] for one in found]).T


def _best(problem: Problem, found: list[Solution]) -> tuple[int, int, float | None, Array]:
    """Degrees of freedom, place of the best solution, its `widening`, and standard deviations of ln mu and ln kappa."""
    parts, freedom = _parts(problem, found), problem.size - problem.fitted
    best = int(np.argmin(problem.badness(*parts)))
    wider = widening(max(float(parts[0][best]), problem.least), freedom, problem.impacts.known_errors)
    if freedom < LEAST_FREEDOM and not problem.impacts.known_errors:
        wider = None
    errors = _log_errors(found[best].slopes[:, : problem.fitted]) * (wider or np.inf)
    return freedom, best, wider, np.append(errors, 0.0)[:2]


def _along_valleys(problem: Problem, ground: Array) -> list[Solution]:
    """Solutions for mu at every other kappa of the map, and for kappa at every fourth mu."""
    found = []
    for column in range(0, problem.kappas.size, 2):
        places = hollows(ground[:, column : column + 1], problem)
        found += [problem.solve((mu, float(problem.kappas[column])), free=(True, False)) for mu, _ in places]
    if problem.fitted == 2:
        rows = [*range(0, problem.frictions.size, 4), problem.frictions.size - 1]
        for row in rows:
            places = hollows(ground[row : row + 1], problem)
            found += [problem.solve((float(problem.frictions[row]), kappa), free=(False, True)) for _, kappa in places]
    return found


def _ranges(problem: Problem, allowed: Array, best: Solution, near: Array) -> Array:
    """Ends of the allowed places and of the neighbourhood of the best, shape (2, 2); 0 and inf beyond the map."""
    centre, near = np.log([best.friction, best.stiffness_ratio]), np.minimum(near, 50.0)
    low = np.minimum(allowed.min(axis=0, initial=np.inf), np.exp(centre - near))
    high = np.maximum(allowed.max(axis=0, initial=0.0), np.exp(centre + near))
    if problem.fitted == 1:
        return np.array([[low[0], high[0] if high[0] < problem.frictions[-1] else np.inf], [problem.start] * 2])
    ends = np.array([problem.frictions[[0, -1]], problem.kappas[[0, -1]]])
    return np.column_stack(
        [np.where(low <= ends[:, 0] * (1 + 1e-9), 0.0, low), np.where(high >= ends[:, 1] * (1 - 1e-9), np.inf, high)]
    )


def _log_errors(slopes: Array) -> Array:
    """Standard deviations of the logarithms from the Jacobian; inf for one that no impact feels."""
    normal = slopes.T @ slopes
    size = np.sqrt(np.diag(normal))
    out, felt = np.full(size.size, np.inf), size > 1e-9 * max(float(size.max()), 1e-300)
    scaled = normal[np.ix_(felt, felt)] / np.outer(size[felt], size[felt])
    if felt.any() and np.linalg.cond(scaled) < 1e12:
        out[felt] = np.sqrt(np.diag(np.linalg.inv(scaled))) / size[felt]
    return out
