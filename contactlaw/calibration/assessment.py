"""From a checked table to a `Calibration`: restitution, regimes, and the words for what is and is not determined."""

from __future__ import annotations

import numpy as np

from contactlaw.calibration import impact_fit as law
from contactlaw.calibration.evidence import Evidence, Mask, Problem, weigh
from contactlaw.calibration.impact_fit import Array, Impacts
from contactlaw.calibration.result import SLIDES, SLIDES_FIRST, STICKS_FIRST, UNKNOWN, Calibration, Estimate
from contactlaw.calibration.scatter import NORMAL, far_limit, quantile, widening

USUAL_KAPPA = 0.85  # of like materials with nu = 0.26


def assess(impacts: Impacts, restitution: float | None, kappa: float | None, *, hold: bool) -> Calibration:
    """Fit a checked table and say what it tells.

    Args:
        impacts: n impacts.
        restitution: e where V_z2 was not measured.
        kappa: Start, or with `hold` the known value; None: `USUAL_KAPPA`.
        hold: Whether kappa is known.
    """
    bounce = _restitution(impacts) if restitution is None else Estimate("given", restitution)
    start = kappa or USUAL_KAPPA
    known = Estimate("given", start) if hold else None
    if impacts.impulse_ratio.max() <= 0.0:
        return _nothing(impacts, bounce, known)
    problem = Problem(impacts, min(bounce.value or 1.0, 1.0), start, fitted=1 if hold else 2)
    return _report(impacts, bounce, weigh(problem), known)


def _restitution(impacts: Impacts) -> Estimate:
    """Weighted mean of V_z2/V_z1, and whether it depends on speed."""
    z1, n = impacts.normal_before, impacts.normal_before.size
    ratio = impacts.normal_after / z1
    variance = (impacts.errors[2] ** 2 + (ratio.mean() * impacts.errors[0]) ** 2) / z1**2
    if n >= 6:
        far = np.abs(ratio - np.median(ratio)) / np.sqrt(variance)
        scale = max(law.robust_scale(far, 1), 1.0 if impacts.known_errors else 1e-9)
        keep = far <= far_limit(n - 1) * scale
        ratio, variance, z1 = ratio[keep], variance[keep], z1[keep]
    mean = float(np.sum(ratio / variance) / np.sum(1.0 / variance))
    freedom = ratio.size - 1
    wider = widening(float(np.sum((ratio - mean) ** 2 / variance)), freedom, impacts.known_errors)
    if wider is None:
        return Estimate("measured", mean, note="One impact has no scatter: the error of the restitution is not known.")
    reach = wider / float(np.sqrt(np.sum(1.0 / variance)))
    reach *= quantile(freedom) if wider > 1.0 or not impacts.known_errors else NORMAL
    note = _speed_note(np.log(z1), ratio - mean, variance * wider**2)
    if mean - reach > 1.0:
        note = f"A restitution above 1 ({mean:.3g}) means that something is wrong with V_z1 or V_z2."
    return Estimate("measured", mean, reach / NORMAL, mean - reach, mean + reach, note)


def _speed_note(log_speed: Array, departure: Array, variance: Array) -> str:
    """Words for a slope of e over ln V_z1 beyond three standard errors."""
    if log_speed.size < 5 or np.ptp(log_speed) < 0.1 or not (variance > 0.0).all():
        return ""
    weight = 1.0 / variance
    centred = log_speed - np.sum(weight * log_speed) / np.sum(weight)
    power = float(np.sum(weight * centred**2))
    slope, error = float(np.sum(weight * centred * departure)) / power, power**-0.5
    if abs(slope) < 3.0 * error:
        return ""
    way = "falls" if slope < 0.0 else "rises"
    return (
        f"Restitution {way} with speed, by {abs(slope) * np.log(2.0):.2g} +- {error * np.log(2.0):.1g} for twice the "
        f"approach speed; the value is that of the middle of the table."
    )


def _report(impacts: Impacts, bounce: Estimate, evidence: Evidence, known: Estimate | None) -> Calibration:
    """The evidence in numbers and words."""
    best, used = evidence.best, evidence.used
    whole = law.evaluate(impacts, evidence.problem.restitution, best.friction, best.stiffness_ratio)
    regimes, freedom = _regimes(impacts, evidence), evidence.freedom
    sliding = np.array([regime == SLIDES for regime in regimes]) & used
    return Calibration(
        restitution=bounce,
        friction=_friction(evidence, regimes),
        stiffness_ratio=known or _stiffness(evidence, regimes),
        sliding_friction=_sliding(impacts, sliding),
        regimes=tuple(regimes),
        outliers=tuple(int(index) for index in np.flatnonzero(~used)),
        before=np.stack([impacts.normal_before, impacts.tangential_before]),
        after=np.stack([impacts.normal_after, impacts.tangential_after]),
        residuals=whole.residual,
        residual_rms=float(np.sqrt(np.mean(whole.residual[used] ** 2))),
        degrees_of_freedom=freedom,
        chi_squared=whole.misfit(used) / freedom if impacts.known_errors and freedom > 0 else None,
        scatter=None if impacts.known_errors else evidence.widening,
        mass_ratio=impacts.mass_ratio,
        curve_parameters=(best.friction, best.stiffness_ratio),
    )


def _regimes(impacts: Impacts, evidence: Evidence) -> list[str]:
    """What each impact does at the best values; where one of them is not determined, only what all allowed ones say."""
    cells = np.array([[evidence.best.friction, evidence.best.stiffness_ratio]])
    if not (evidence.determined(0) and evidence.determined(1)):
        if evidence.widening is None:
            return [UNKNOWN] * impacts.normal_before.size
        cells = np.concatenate([cells, evidence.allowed])
    psi = cells[:, 1:] / cells[:, :1] * np.abs(impacts.incidence)
    ends = np.asarray(law.sliding_from(cells[:, 1:], impacts.mass_ratio, evidence.problem.restitution))
    tests = {SLIDES: psi >= ends, STICKS_FIRST: psi <= 1.0, SLIDES_FIRST: (psi > 1.0) & (psi < ends)}
    sure = {name: np.atleast_1d(test.all(axis=0)) for name, test in tests.items()}
    return [next((name for name in sure if sure[name][row]), UNKNOWN) for row in range(psi.shape[1])]


def _sliding(impacts: Impacts, sliding: Mask) -> Estimate:
    """The paper's mean mu of the impacts that slide throughout."""
    count = int(sliding.sum())
    if count == 0:
        return Estimate("not determined", note="No impact is sure to slide throughout.")
    ratio, error = impacts.impulse_ratio[sliding], impacts.impulse_ratio_error[sliding]
    mean = float(np.sum(ratio / error**2) / np.sum(error**-2.0))
    wider = widening(float(np.sum(((ratio - mean) / error) ** 2)), count - 1, impacts.known_errors)
    if wider is None:
        return Estimate("measured", mean, note="One sliding impact has no scatter to tell its error by.")
    reach = wider / float(np.sqrt(np.sum(error**-2.0)))
    reach *= quantile(count - 1) if wider > 1.0 or not impacts.known_errors else NORMAL
    return Estimate("measured", mean, reach / NORMAL, mean - reach, mean + reach)


def _friction(evidence: Evidence, regimes: list[str]) -> Estimate:
    low, high = (float(bound) for bound in evidence.ranges[0])
    if evidence.determined(0):
        return Estimate("measured", evidence.best.friction, evidence.uncertainty(0), low, high)
    impacts = evidence.problem.impacts
    grazing = "More impacts that slide throughout (grazing ones) would tell."
    if evidence.widening is None:
        note = (
            "Friction is not determined: without given errors it takes two impacts more than unknowns. Up to errors of "
            f"measurement it is at least {impacts.impulse_ratio.max():.3g}, the greatest ratio of tangential to normal "
            f"impulse that was seen. {grazing}"
        )
        return Estimate("not determined", note=note)
    error = impacts.impulse_ratio_error * evidence.widening
    seen = max(float((impacts.impulse_ratio - 2.0 * error).max()), 0.0)
    if SLIDES not in regimes:
        why = "no impact is sure to slide throughout, and the others fit a wide range of friction"
    else:
        why = "the impacts fit a wide range of friction"
    bounds = f"It is at least {max(low, seen):.3g}"
    bounds += (
        ", by the fit" if low > seen else ", the greatest ratio of tangential to normal impulse less twice its error"
    )
    if np.isfinite(high):
        bounds += f", and at most {high:.3g}"
    note = f"Friction is not determined: {why}. {bounds}. {grazing}"
    upper = high if np.isfinite(high) else None
    return Estimate("not determined", lower=max(low, seen) or None, upper=upper, note=note)


def _stiffness(evidence: Evidence, regimes: list[str]) -> Estimate:
    low, high = (float(bound) for bound in evidence.ranges[1])
    if evidence.determined(1):
        return Estimate("measured", evidence.best.stiffness_ratio, evidence.uncertainty(1), low, high)
    if all(regime == SLIDES for regime in regimes):
        why = "every impact slides throughout, and sliding does not feel the tangential stiffness, only that it slides"
    else:
        why = "too few impacts that stick, or errors too large, tell values apart"
    bounds = [f"at least {low:.2g}"] if low > 0.0 else []
    bounds += [f"at most {high:.2g}"] if np.isfinite(high) else []
    where = f" It is {' and '.join(bounds)}." if bounds else ""
    note = f"The stiffness ratio kappa is not determined: {why}.{where} Take it from the elastic constants."
    return Estimate("not determined", lower=low or None, upper=high if np.isfinite(high) else None, note=note)


def _nothing(impacts: Impacts, bounce: Estimate, known: Estimate | None) -> Calibration:
    """No impact lost tangential velocity."""
    n = impacts.normal_before.size
    note = (
        "Friction is not determined: no impact lost tangential velocity. Are V_x1 and V_x2 counted along the same "
        "direction?"
    )
    return Calibration(
        restitution=bounce,
        friction=Estimate("not determined", note=note),
        stiffness_ratio=known or Estimate("not determined", note="Nor is the stiffness ratio kappa."),
        sliding_friction=Estimate("not determined"),
        regimes=(UNKNOWN,) * n,
        outliers=(),
        before=np.stack([impacts.normal_before, impacts.tangential_before]),
        after=np.stack([impacts.normal_after, impacts.tangential_after]),
        residuals=np.zeros(n),
        residual_rms=0.0,
        degrees_of_freedom=0,
        chi_squared=None,
        scatter=None,
        mass_ratio=impacts.mass_ratio,
        curve_parameters=None,
    )
