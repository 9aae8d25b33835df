"""The law's rebound curve psi_2(psi_1) for every stiffness ratio, as a smooth function of both."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.interpolate import RectBivariateSpline

from contactlaw.calibration.table import Array
from contactlaw.impact import rebound

LAW, STEPS = "microslip node_count=32", 256  # one resolution for every chi, lest the curve jump where the default does
SHARES = np.linspace(0.0, 1.0, 161)  # of the psi_1 from which an impact slides throughout


def sliding_from(kappa: Array, mass_ratio: float, restitution: float) -> Array:
    """psi_1 from which an impact slides throughout: max(1, 2 chi (1 + e) - e); the paper has 4 chi - 1, at e = 1."""
    return np.maximum(1.0, kappa * mass_ratio * (1.0 + restitution) - restitution)


class Curve:
    """psi_2 by splines through whole impacts, good to 1e-4 (rms; 4e-3 where psi_1 = 1 puts a kink).

    Args:
        restitution: e.
        mass_ratio: m_N/m_T.
        low, high: Range of kappa.
    """

    def __init__(self, restitution: float, mass_ratio: float, low: float, high: float) -> None:
        self.restitution, self.mass_ratio = restitution, mass_ratio
        kappas = np.geomspace(low, high, 41 if high > 1.5 * low else 5)[:, None]
        psi, chi = SHARES * sliding_from(kappas, mass_ratio, restitution), 0.5 * kappas * mass_ratio
        less, more = restitution - min(0.01, 0.5 * restitution), min(restitution + 0.01, 1.0)
        at, below, above = (rebound(psi, chi, LAW, e, steps=STEPS) for e in (restitution, less, more))
        logs = np.log(kappas[:, 0])
        self._at = RectBivariateSpline(logs, SHARES, at)
        self._by_restitution = RectBivariateSpline(logs, SHARES, np.subtract(above, below) / (more - less))

    def __call__(self, psi: Array, kappa: Array) -> tuple[Array, Array, Array]:
        """psi_2, its slope over psi_1, and over e; the arrays broadcast, psi_1 >= 0."""
        end, gross = sliding_from(kappa, self.mass_ratio, self.restitution), kappa * self.mass_ratio
        where = np.log(kappa), np.minimum(psi / end, 1.0)
        slides = psi >= end
        value = np.where(slides, psi - gross * (1.0 + self.restitution), self._at.ev(*where))
        slope = np.where(slides, 1.0, self._at.ev(*where, dy=1) / end)
        return value, slope, np.where(slides, -gross, self._by_restitution.ev(*where))


curve = lru_cache(maxsize=32)(Curve)
