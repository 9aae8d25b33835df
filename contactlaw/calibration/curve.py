"""The law's rebound curve psi_2(psi_1) as a smooth function of psi_1 and the stiffness ratio."""

from functools import lru_cache

import numpy as np
from scipy.interpolate import RectBivariateSpline

from contactlaw.calibration.table import Array
from contactlaw.impact import rebound

LAW, STEPS = "microslip node_count=32", 256  # the same for all chi: the default resolution changes in steps
SHARES = np.linspace(0.0, 1.0, 161)  # psi_1 over that from which an impact slides throughout


def sliding_from(kappa: Array, mass_ratio: float, restitution: float) -> Array:
    """psi_1 from which an impact slides throughout, max(1, 2 chi (1 + e) - e); in the paper 4 chi - 1, for e = 1."""
    return np.maximum(1.0, kappa * mass_ratio * (1.0 + restitution) - restitution)


class Curve:
    """psi_2 by splines through whole impacts, with an rms error of 1e-4 (4e-3 at the kink at psi_1 = 1).

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
        """Return psi_2 and its derivatives by psi_1 and by e; psi >= 0 and kappa broadcast."""
        end, gross = sliding_from(kappa, self.mass_ratio, self.restitution), kappa * self.mass_ratio
        where = np.log(kappa), np.minimum(psi / end, 1.0)
        slides = psi >= end
        value = np.where(slides, psi - gross * (1.0 + self.restitution), self._at.ev(*where))
        slope = np.where(slides, 1.0, self._at.ev(*where, dy=1) / end)
        return value, slope, np.where(slides, -gross, self._by_restitution.ev(*where))


curve = lru_cache(maxsize=32)(Curve)
