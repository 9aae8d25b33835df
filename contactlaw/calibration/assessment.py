"""From a checked table to a `Calibration`: restitution, regimes, and notes on what is and is not determined."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from scipy import optimize, stats

from contactlaw.calibration import fit, result
from contactlaw.calibration.curve import sliding_from
from contactlaw.calibration.result import Calibration, Estimate, OverSpeedFit
from contactlaw.calibration.table import Array, Impacts, Mask
from contactlaw.losses import OverSpeed, Plastic, Viscoelastic

USUAL_KAPPA = 0.85  # 2 (1 - nu)/(2 - nu) of equal materials with nu = 0.26
CLEAR = 6.0  # difference in 2 ln(likelihood) that distinguishes two laws: 20 to 1
CONSTANT = "constant"
LEAST, SPREAD = 4, 0.3  # least number of impacts and range of ln V_z1 for a dependence on speed


def assess(
    impacts: Impacts, restitution: float | None, kappa: float | None, *, hold: bool, asked: str | None
) -> Calibration:
    """Fit a checked table and assess which parameters it determines; kappa, hold, asked: as for `calibrate`."""
    bounce, law = _restitution(impacts, asked) if restitution is None else (Estimate("given", restitution), None)
    start = kappa or USUAL_KAPPA
    known = Estimate("given", start) if hold else None
    table = {"restitution": bounce, "restitution_law": law, "mass_ratio": impacts.mass_ratio,
             "before": impacts.velocities[:2], "after": impacts.velocities[2:]}  # fmt: skip
    n = impacts.size
    if impacts.impulse_ratio[0].max() <= 0.0:
        note = "no impact lost tangential velocity. Are V_x1 and V_x2 counted along the same direction?"
        return Calibration(
            friction=Estimate("not determined", note=f"Friction is not determined: {note}"),
            stiffness_ratio=known or Estimate("not determined", note="Nor is the stiffness ratio kappa."),
            sliding_friction=Estimate("not determined"), regimes=(result.UNKNOWN,) * n, residuals=np.zeros(n), **table,
        )  # fmt: skip
    whole = fit.problem_of(impacts, min(bounce.value or 1.0, 1.0), start, hold=hold)
    evidence = fit.evidence_of(whole)
    residuals, _ = whole.residuals(np.log(evidence.best))
    regimes, freedom = _regimes(impacts, evidence, whole.curve.restitution), evidence.freedom
    return Calibration(
        friction=_friction(impacts, evidence, regimes),
        stiffness_ratio=known or _stiffness(evidence, regimes),
        sliding_friction=_sliding(impacts, (np.array(regimes) == result.SLIDES) & evidence.used),
        regimes=tuple(regimes),
        outliers=tuple(np.flatnonzero(~evidence.used).tolist()),
        residuals=residuals,
        residual_rms=float(np.sqrt(np.mean(residuals[evidence.used] ** 2))),
        degrees_of_freedom=freedom,
        chi_squared=evidence.misfit / freedom if impacts.known_errors and freedom > 0 else None,
        scatter=None if impacts.known_errors else evidence.scatter,
        curve_parameters=(float(evidence.best[0]), float(evidence.best[1])),
        **table,
    )


def _mean(values: Array, errors: Array, known: bool) -> Estimate:
    """Weighted mean with its 95 % range; no range for a single value without a known error."""
    mean = float(np.average(values, weights=errors**-2.0))
    wider = fit.widening(float(np.sum(((values - mean) / errors) ** 2)), values.size - 1, known)
    if wider is None:
        return Estimate("measured", mean, note="One impact has no scatter: its error is not known.")
    reach = wider[0] * wider[1] * float(np.sum(errors**-2.0)) ** -0.5
    return Estimate("measured", mean, reach / fit.NORMAL, mean - reach, mean + reach)


def _restitution(impacts: Impacts, asked: str | None) -> tuple[Estimate, OverSpeedFit | None]:
    """Weighted mean of V_z2/V_z1, and its dependence on speed."""
    (z1, _, z2, _), (s_z1, _, s_z2, _), known = impacts.velocities, impacts.errors, impacts.known_errors
    ratio = z2 / z1
    error = np.hypot(s_z2, ratio.mean() * s_z1) / z1
    law = over_speed(z1, ratio, error if known else np.ones(ratio.size), known, asked)
    if ratio.size >= 6:
        far = np.abs(ratio - np.median(ratio)) / error
        keep = far <= fit.far_limit(ratio.size - 1) * fit.robust_scale(far, 1, 1.0 if known else 1e-9)
        ratio, error = ratio[keep], error[keep]
    mean = _mean(ratio, error, known)
    if mean.value is not None and (mean.lower or 0.0) > 1.0:
        note = f"A restitution above 1 ({mean.value:.3g}) means that something is wrong with V_z1 or V_z2."
        return replace(mean, note=note), None
    return mean, law


def over_speed(speed: Array, ratio: Array, error: Array, known: bool, asked: str | None) -> OverSpeedFit | None:
    """Choose a law for V_z2/V_z1 at approach speeds, shape (n,); None if the table shows no clear dependence.

    error: standard deviations; if not known, all equal, since speeds have relative errors. asked: name of the law that
    is wanted.
    """
    if asked == CONSTANT or (asked is None and (speed.size < LEAST or np.ptp(np.log(speed)) < SPREAD)):
        return None
    middle = float(np.exp(np.mean(np.log(speed))))
    rivals: dict[str, tuple[Callable[[float], Any], float, float]] = {  # laws of one parameter, and its range
        CONSTANT: (lambda e: e, 0.01, 1.0),
        Viscoelastic.name: (lambda e: Viscoelastic(e, middle), 0.01, 1.0),
        Plastic.name: (Plastic, 1e-6 * middle, 10.0 * float(speed.max())),
    }
    fits = {}
    for name, (of, low, high) in rivals.items():

        def misfit(x: float, of: Callable[[float], Any] = of) -> float:
            law = of(float(np.exp(x)))
            values = law(speed) if isinstance(law, OverSpeed) else law
            return float(np.sum(((ratio - values) / error) ** 2))

        grid = np.linspace(np.log(low), np.log(high), 200)
        start = int(np.argmin([misfit(x) for x in grid]))
        bounds = grid[max(start - 1, 0)], grid[min(start + 1, grid.size - 1)]
        best = float(optimize.minimize_scalar(misfit, bounds=bounds, method="bounded", options={"xatol": 1e-10}).x)  # type: ignore[union-attr]
        chi = max(misfit(best), 0.0 if known else 1e-18 * speed.size)
        fits[name] = of(float(np.exp(best))), best, chi, misfit, grid
    score = {name: chi if known else speed.size * np.log(chi) for name, (_, _, chi, _, _) in fits.items()}
    order = sorted(score, key=lambda name: score[name])
    chosen = asked or order[0]
    clear = {name: score[name] - score[chosen] for name in order}
    if asked is None and (chosen == CONSTANT or clear[CONSTANT] < CLEAR):
        return None
    law, best, chi, misfit, grid = fits[chosen]
    wider = fit.widening(chi, speed.size - 1, known)
    number = Estimate("measured", float(np.exp(best)))
    if wider is not None:
        most = chi + (wider[0] * wider[1]) ** 2
        low, high = (_end(misfit, most, best, edge) for edge in grid[[0, -1]])
        number = Estimate("measured", float(np.exp(best)), (high - low) / (2.0 * fit.NORMAL), low, high)
    rival = next((name for name in order if name != chosen and clear[name] < CLEAR), None)
    note = "" if rival is None else f"The table does not distinguish it from a {rival} restitution."
    return OverSpeedFit(law, number, note)


def _end(misfit: Callable[[float], float], most: float, best: float, edge: float) -> float:
    """Parameter between best and edge at which the misfit reaches `most`; the edge if it does not."""
    if misfit(edge) <= most:
        return float(np.exp(edge))
    return float(np.exp(optimize.brentq(lambda x: misfit(x) - most, best, edge)))  # type: ignore[arg-type]


def _regimes(impacts: Impacts, evidence: fit.Evidence, restitution: float) -> list[str]:
    """Regime of each impact at the best mu and kappa, or where all allowed values agree if one is not determined."""
    cells = evidence.best[None]
    if not (evidence.determined(0) and evidence.determined(1)):
        if evidence.scatter is None:
            return [result.UNKNOWN] * impacts.size
        cells = np.concatenate([cells, evidence.allowed])
    unit = cells[:, :1] / cells[:, 1:]  # V_x1/V_z1 over psi_1
    ends = unit * sliding_from(cells[:, 1:], impacts.mass_ratio, restitution)
    t = np.abs(impacts.velocities[1] / impacts.velocities[0])
    sure = np.select(
        [t >= ends.max(), t <= unit.min(), (t > unit.max()) & (t < ends.min())],
        [result.SLIDES, result.STICKS_FIRST, result.SLIDES_FIRST], result.UNKNOWN,
    )  # fmt: skip
    return sure.tolist()


def _sliding(impacts: Impacts, sliding: Mask) -> Estimate:
    """Mean mu of the impacts that slide throughout, as in the paper."""
    if not sliding.any():
        return Estimate("not determined", note="No impact is sure to slide throughout.")
    ratio, error = impacts.impulse_ratio
    return _mean(ratio[sliding], error[sliding], impacts.known_errors)


def _estimate(evidence: fit.Evidence, which: int, low: float, note: str) -> Estimate:
    """Estimate of mu (0) or kappa (1): the value if it is determined, else bounds and the note."""
    high = float(evidence.ranges[which][1])
    if evidence.determined(which):
        return Estimate("measured", float(evidence.best[which]), (high - low) / (2.0 * fit.NORMAL), low, high)
    return Estimate("not determined", lower=low or None, upper=high if np.isfinite(high) else None, note=note)


def _friction(impacts: Impacts, evidence: fit.Evidence, regimes: list[str]) -> Estimate:
    (low, high), (ratio, error) = evidence.ranges[0].tolist(), impacts.impulse_ratio
    why, least = "without given errors it takes two impacts more than unknowns", low
    bounds = f"Up to errors of measurement it is at least {ratio.max():.3g}, the greatest ratio of tangential to normal"
    bounds += " impulse that was seen"
    if evidence.scatter is not None:
        of_all = stats.norm.isf(fit.CHANCE / ratio.size) / fit.NORMAL  # the greatest of many is great by chance
        seen = max(float((ratio - of_all * evidence.reach * error).max()), 0.0)
        why = "the impacts fit a wide range of friction"
        if result.SLIDES not in regimes:
            why = "no impact is sure to slide throughout, and the others fit a wide range of friction"
        how = "by the fit" if low > seen else "the greatest ratio of tangential to normal impulse less its error (95 %)"
        least = low if evidence.determined(0) else max(low, seen)
        bounds = f"It is at least {least:.3g}, {how}" + (f", and at most {high:.3g}" if np.isfinite(high) else "")
    grazing = "More impacts that slide throughout (grazing ones) would tell."
    return _estimate(evidence, 0, least, f"Friction is not determined: {why}. {bounds}. {grazing}")


def _stiffness(evidence: fit.Evidence, regimes: list[str]) -> Estimate:
    low, high = evidence.ranges[1].tolist()
    why = "too few impacts that stick, or errors too large, tell values apart"
    if all(regime == result.SLIDES for regime in regimes):
        why = "every impact slides throughout, and gross slip does not depend on the tangential stiffness"
    bounds = [f"at least {low:.2g}"] * (low > 0.0) + [f"at most {high:.2g}"] * bool(np.isfinite(high))
    where = f" It is {' and '.join(bounds)}." if bounds else ""
    note = f"The stiffness ratio kappa is not determined: {why}.{where} Take it from the elastic constants."
    return _estimate(evidence, 1, low, note)
