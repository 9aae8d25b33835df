"""The rebound curve laid through measured impacts: least squares, and a map of how well any other answer would do.

With t = V_x/V_z1 before the impact, the law gives V_x2/V_z1 = (mu/kappa) psi_2(psi_1 = kappa t/mu, chi = kappa c/2),
c = m_N/m_T (1 + 1/K^2 for a body on a fixed one). Unknown are mu and kappa; all velocities have errors, those before
too, so that each impact is weighed by the error of its residual along the curve (effective variance).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from contactlaw.impact import rebound

Array = NDArray[np.float64]

LAW, STEPS = (
    "microslip node_count=32",
    256,
)  # one resolution for every chi, lest the curve jump where the default changes
KAPPA_RANGE = (0.3, 2.0)  # where kappa is sought; G*/E* of elastic materials is 2/3 to 4/3
KAPPA_GRID = np.geomspace(*KAPPA_RANGE, 25)
FRICTION_GRID = np.geomspace(0.4, 25.0, 84)  # in units of the greatest impulse ratio
PSI_STEP, RATIO_STEP, RESTITUTION_STEP = 0.02, 0.01, 0.01  # of the slopes
HUBER = 1.345  # residuals beyond this many deviations pull with constant force
ITERATIONS = 60
CLOSE, ROUGHLY = 1e-7, 1e-4  # a step in the logarithms, or a relative gain in the misfit, too small to go on for


@dataclass(frozen=True, eq=False)
class Impacts:
    """A checked table of impacts.

    Attributes:
        normal_before, tangential_before, normal_after, tangential_after: V_z1, V_x1, V_z2, V_x2 [m/s], shape (n,).
        errors: Their standard deviations in this order [m/s], shape (4, n); all 1 where they are not known.
        known_errors: Whether they are.
        mass_ratio: m_N/m_T.
        own_restitution: Whether V_z2 was measured, so that each impact's own normal impulse counts.
    """

    normal_before: Array
    tangential_before: Array
    normal_after: Array
    tangential_after: Array
    errors: Array
    known_errors: bool
    mass_ratio: float
    own_restitution: bool

    def chosen(self, used: NDArray[np.bool_]) -> Impacts:
        """The impacts that are used, shape (n,)."""
        return replace(
            self,
            normal_before=self.normal_before[used],
            tangential_before=self.tangential_before[used],
            normal_after=self.normal_after[used],
            tangential_after=self.tangential_after[used],
            errors=self.errors[:, used],
        )

    @property
    def incidence(self) -> Array:
        """t = V_x1/V_z1, shape (n,)."""
        return self.tangential_before / self.normal_before

    @property
    def impulse_ratio(self) -> Array:
        """Tangential over normal impulse: the paper's eq. (6) with V_z1 + V_z2 for 2 V_z1; mu where all slides."""
        normal = self.mass_ratio * (self.normal_before + self.normal_after)
        return np.sign(self.tangential_before) * (self.tangential_before - self.tangential_after) / normal

    @property
    def impulse_ratio_error(self) -> Array:
        """Standard deviation of `impulse_ratio` in the units of the errors, shape (n,)."""
        z1, x1, z2, x2 = self.errors
        normal = self.mass_ratio * (self.normal_before + self.normal_after)
        along = (x1**2 + x2**2) / normal**2
        across = (self.impulse_ratio / (self.normal_before + self.normal_after)) ** 2 * (z1**2 + z2**2)
        return np.sqrt(along + across)


@dataclass(frozen=True, eq=False)
class Solution:
    """One set of parameters and how the impacts lie about its curve.

    Attributes:
        friction, stiffness_ratio: mu and kappa.
        residual: V_x2 less the curve [m/s], shape (n,).
        deviation: Standard deviation of the residual, in the units of the errors, shape (n,).
        slopes: d(residual)/d(ln mu, ln kappa) over the deviation, shape (n, 2).
    """

    friction: float
    stiffness_ratio: float
    residual: Array
    deviation: Array
    slopes: Array

    def misfit(self, used: NDArray[np.bool_]) -> float:
        """Sum of (residual/deviation)^2."""
        return float(np.sum((self.residual[used] / self.deviation[used]) ** 2))

    def volume(self, used: NDArray[np.bool_]) -> float:
        """Sum of ln(deviation^2): the part of the likelihood that keeps a curve from hiding in wide errors."""
        return float(np.sum(2.0 * np.log(self.deviation[used])))


def sliding_from(stiffness_ratio: float | Array, mass_ratio: float, restitution: float) -> float | Array:
    """psi_1 from which an impact slides throughout: max(1, 2 chi (1 + e) - e); the paper has 4 chi - 1, at e = 1."""
    return np.maximum(1.0, stiffness_ratio * mass_ratio * (1.0 + restitution) - restitution)


def evaluate(impacts: Impacts, restitution: float, friction: float, stiffness_ratio: float) -> Solution:
    """The impacts about the curve of these parameters.

    Args:
        impacts: n impacts.
        restitution: e of the curve, in (0, 1]; an impact's own V_z2/V_z1 counts through the slope.
        friction, stiffness_ratio: mu and kappa, > 0.
    """
    psi, chi = stiffness_ratio / friction * impacts.incidence, 0.5 * stiffness_ratio * impacts.mass_ratio
    low, high = restitution - min(RESTITUTION_STEP, 0.5 * restitution), min(1.0, restitution + RESTITUTION_STEP)
    h, k = PSI_STEP, RATIO_STEP
    angles = np.stack([psi, psi - h, psi + h, psi, psi, psi, psi])
    chis = chi * np.array([1.0, 1.0, 1.0, 1.0 - k, 1.0 + k, 1.0, 1.0])[:, None]
    bounces = np.array([restitution] * 5 + [low, high])[:, None]
    values = np.asarray(rebound(angles, chis, LAW, bounces, steps=STEPS))
    at, by_psi = values[0], (values[2] - values[1]) / (2.0 * h)
    by_ln_chi, by_restitution = (values[4] - values[3]) / (2.0 * k), (values[6] - values[5]) / (high - low)
    unit = friction / stiffness_ratio
    residual, deviation = _residuals(impacts, restitution, unit * at, by_psi, unit * by_restitution)
    by_logs = unit * np.stack([at - psi * by_psi, psi * by_psi - at + by_ln_chi], axis=-1)
    slopes = -(impacts.normal_before / deviation)[:, None] * by_logs
    return Solution(friction, stiffness_ratio, residual, deviation, slopes)


def _residuals(
    impacts: Impacts, restitution: float, value: Array, slope: Array, by_restitution: Array
) -> tuple[Array, Array]:
    """Residuals [m/s] and their deviations, shape (..., n).

    Args:
        impacts: n impacts.
        restitution: e of the curve.
        value, slope: V_x2/V_z1 of the curve and its slope over t.
        by_restitution: Its slope over e.
    """
    own = by_restitution if impacts.own_restitution else np.zeros_like(value)
    z1, z2 = impacts.normal_before, impacts.normal_after
    residual = impacts.tangential_after - z1 * value - own * (z2 - restitution * z1)
    s_z1, s_x1, s_z2, s_x2 = impacts.errors
    by_z1 = -(value - impacts.incidence * slope) + own * restitution
    return residual, np.sqrt(s_x2**2 + (slope * s_x1) ** 2 + (by_z1 * s_z1) ** 2 + (own * s_z2) ** 2)


def least_squares(
    impacts: Impacts,
    restitution: float,
    start: tuple[float, float],
    *,
    free: tuple[bool, bool],
    used: NDArray[np.bool_],
    robust: bool = False,
) -> Solution:
    """mu and kappa by Levenberg's and Marquardt's method in their logarithms.

    Args:
        impacts: n impacts.
        restitution: e of the curve.
        start: mu, kappa.
        free: Which of the two are fitted.
        used: Impacts that count, shape (n,).
        robust: Whether far residuals count less (Huber), by the scale of the middle ones.
    """
    now, damping, close = evaluate(impacts, restitution, *start), 1e-3, ROUGHLY if robust else CLOSE
    for _ in range(ITERATIONS):
        scaled = now.residual / now.deviation
        weight = used.astype(float)
        if robust:
            scale = robust_scale(scaled[used], sum(free))
            weight *= np.minimum(1.0, HUBER * scale / np.maximum(np.abs(scaled), 1e-300))
        uphill = float(now.slopes[:, 1] @ (weight * scaled))
        end = KAPPA_RANGE[0 if uphill > 0.0 else 1]  # where downhill leads out of the range, kappa stays
        columns = np.flatnonzero([free[0], free[1] and now.stiffness_ratio != end])
        jacobian = now.slopes[:, columns]
        gradient, normal = jacobian.T @ (weight * scaled), (jacobian.T * weight) @ jacobian
        if not (np.diag(normal) > 0.0).any():
            break
        ridge = np.diag(np.maximum(np.diag(normal), 1e-12 * np.diag(normal).max()))
        step, misfit = np.zeros(2), float(np.sum(weight * scaled**2))
        step[columns] = np.clip(-np.linalg.solve(normal + damping * ridge, gradient), -1.0, 1.0)
        ratio = float(np.clip(now.stiffness_ratio * np.exp(step[1]), *KAPPA_RANGE)) if free[1] else start[1]
        trial = evaluate(impacts, restitution, now.friction * float(np.exp(step[0])), ratio)
        gain = misfit - np.sum(weight * (trial.residual / now.deviation) ** 2)
        if gain >= 0.0:
            now, damping = trial, max(0.2 * damping, 1e-9)
        else:
            damping *= 8.0
        if np.abs(step).max() < close or -float(gradient @ step[columns]) < close * misfit or damping > 1e9:
            break
    return now


def robust_scale(scaled: Array, parameters: int) -> float:
    """Standard deviation from the median of absolute values, for residuals about a curve with fitted parameters."""
    freedom = max(scaled.size - parameters, 1)
    return float(1.4826 * np.median(np.abs(scaled)) * np.sqrt(scaled.size / freedom))


@lru_cache(maxsize=16)
def _curves(restitution: float, mass_ratio: float, kappas: tuple[float, ...]) -> tuple[Array, Array]:
    """psi_2 over psi_1 in units of `sliding_from`, at every kappa, and its slope over e."""
    grid = np.array(kappas)
    ends = np.asarray(sliding_from(grid, mass_ratio, restitution))[:, None]
    shares = np.linspace(0.0, 1.0, 81)
    chi = 0.5 * mass_ratio * grid[:, None]
    lower = restitution - min(0.05, 0.5 * restitution)
    at, below = (np.asarray(rebound(shares * ends, chi, restitution=e)) for e in (restitution, lower))
    return at, (at - below) / (restitution - lower)


def misfit_map(impacts: Impacts, restitution: float, frictions: Array, kappas: Array) -> tuple[Array, Array]:
    """`Solution.misfit` and `Solution.volume` of all impacts over a grid of mu and kappa.

    The curve is interpolated between 81 impacts, which is good to about 0.005 in psi_2: a map to find the way by.

    Args:
        impacts: n impacts.
        restitution: e of the curve.
        frictions, kappas: mu and kappa, shapes (m,) and (k,).

    Returns:
        Two arrays of shape (m, k).
    """
    e = float(np.clip(round(restitution, 2), 0.01, 1.0))
    tables = _curves(e, impacts.mass_ratio, tuple(kappas.tolist()))
    misfit, volume = np.empty((2, frictions.size, kappas.size))
    side, shares = np.sign(impacts.incidence), np.linspace(0.0, 1.0, 81)
    for column, kappa in enumerate(kappas):
        psi = kappa / frictions[:, None] * np.abs(impacts.incidence)
        end = float(sliding_from(kappa, impacts.mass_ratio, e))
        curve, by_e = (table[column] for table in tables)
        share, slides = np.minimum(psi / end, 1.0), psi >= end
        unit = frictions[:, None] / kappa
        gross = kappa * impacts.mass_ratio
        at = np.where(slides, psi - gross * (1.0 + e), np.interp(share, shares, curve))
        slope = np.where(slides, 1.0, np.interp(share, shares, np.gradient(curve, shares * end)))
        bounce = np.where(slides, -gross, np.interp(share, shares, by_e))
        residual, deviation = _residuals(impacts, e, side * unit * at, slope, side * unit * bounce)
        misfit[:, column] = np.sum((residual / deviation) ** 2, axis=-1)
        volume[:, column] = np.sum(2.0 * np.log(deviation), axis=-1)
    return misfit, volume
