"""Dependence of restitution on speed: the most likely law with one parameter, and the parameter.

Constant, viscoelastic and elastic-plastic restitution have one parameter each, so their likelihoods can be compared
directly. If errors are unknown, -2 ln(likelihood) is n ln(chi^2), and the range is that of an F test, as for friction
(`ranges`).
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy import optimize

from contactlaw.calibration.ranges import NORMAL, widening
from contactlaw.calibration.result import Estimate, OverSpeedFit
from contactlaw.calibration.table import Array
from contactlaw.losses import OverSpeed, Plastic, Viscoelastic

CLEAR = 6.0  # difference in 2 ln(likelihood) that distinguishes two laws: 20 to 1
CONSTANT = "constant"
LEAST, SPREAD = 4, 0.3  # least number of impacts and range of ln V_z1 for a dependence on speed


def over_speed(speed: Array, ratio: Array, error: Array, known: bool, asked: str | None) -> OverSpeedFit | None:
    """Choose a law for V_z2/V_z1 at approach speeds, shape (n,); None if the table shows no clear dependence.

    error: standard deviations; if not known, all equal, since speeds have relative errors. asked: name of the law that
    is wanted.
    """
    if asked == CONSTANT or speed.size < LEAST or np.ptp(np.log(speed)) < SPREAD:
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
    wider = widening(chi, speed.size - 1, known)
    number = Estimate("measured", float(np.exp(best)))
    if wider is not None:
        most = chi + (wider[0] * wider[1]) ** 2
        low, high = (_end(misfit, most, best, edge) for edge in grid[[0, -1]])
        number = Estimate("measured", float(np.exp(best)), (high - low) / (2.0 * NORMAL), low, high)
    rival = next((name for name in order if name != chosen and clear[name] < CLEAR), None)
    note = "" if rival is None else f"The table does not distinguish it from a {rival} restitution."
    return OverSpeedFit(law, number, note)


def _end(misfit: Callable[[float], float], most: float, best: float, edge: float) -> float:
    """Parameter between best and edge at which the misfit reaches `most`; the edge if it does not."""
    if misfit(edge) <= most:
        return float(np.exp(edge))
    return float(np.exp(optimize.brentq(lambda x: misfit(x) - most, best, edge)))  # type: ignore[arg-type]
