"""The rebound curve that is fitted to impacts, and their distances from it; see `fit`."""

from functools import lru_cache
from math import exp, factorial, sqrt
from typing import NamedTuple

import numpy as np
from scipy.interpolate import make_interp_spline

from contactlaw.calibration.table import Array
from contactlaw.impact import rebound
from contactlaw.jit import jit

LAW, STEPS = "microslip node_count=32", 256  # the same for all chi: the default resolution changes in steps
CELLS = 160
SHARES = np.linspace(0.0, 1.0, CELLS + 1)  # psi_1 over that from which an impact slides throughout


def sliding_from(kappa: Array, mass_ratio: float, restitution: float) -> Array:
    """psi_1 from which an impact slides throughout, max(1, 2 chi (1 + e) - e); in the paper 4 chi - 1, for e = 1."""
    return np.maximum(1.0, kappa * mass_ratio * (1.0 + restitution) - restitution)


class Curve(NamedTuple):
    """psi_2 and its derivative by e at e and m_N/m_T: coefficients as of `_powers` over ln kappa and SHARES."""

    restitution: float
    mass_ratio: float
    logs: Array
    powers: Array


@lru_cache(maxsize=32)
def curve(restitution: float, mass_ratio: float, low: float, high: float) -> Curve:
    """psi_2 and its derivative by e, by splines through whole impacts, for kappa from low to high.

    Their rms error is 1e-4 (4e-3 at the kink at psi_1 = 1).
    """
    kappas = np.geomspace(low, high, 41 if high > 1.5 * low else 5)[:, None]
    psi, chi = SHARES * sliding_from(kappas, mass_ratio, restitution), 0.5 * kappas * mass_ratio
    less, more = restitution - min(0.01, 0.5 * restitution), min(restitution + 0.01, 1.0)
    at, below, above = (rebound(psi, chi, LAW, e, steps=STEPS) for e in (restitution, less, more))
    values, logs = np.stack([at, np.subtract(above, below) / (more - less)], axis=-1), np.log(kappas[:, 0])
    return Curve(restitution, mass_ratio, logs, _powers(logs, _powers(SHARES, values, 1), 0))


def _powers(x: Array, values: Array, axis: int) -> Array:
    """Coefficients of the cubic spline through values over x, by cell along the axis and by power on a new last one."""
    spline = make_interp_spline(x, values, axis=axis)
    return np.stack([spline(x[:-1], power) / factorial(power) for power in range(4)], axis=-1)


@jit
def distances(places, ends, impacts, own, restitution, mass_ratio, logs, powers):
    """V_x2 less the curve, and its standard deviation [m/s], shape (2, m, n).

    places: (ln mu, ln kappa), shape (m, 2); ends: `sliding_from` there. impacts: velocities and errors as in `Impacts`,
    shape (n, 8). own: V_z2 was measured, so that its error counts. The others are those of a `Curve`.
    """
    out = np.empty((2, len(places), len(impacts)))
    for row in range(len(places)):
        kappa, unit = exp(places[row, 1]), exp(places[row, 0] - places[row, 1])
        line = min(max(int((places[row, 1] - logs[0]) / (logs[1] - logs[0])), 0), len(powers) - 1)
        u, gross, end = places[row, 1] - logs[line], kappa * mass_ratio, ends[row]
        for i in range(len(impacts)):
            z1, x1, z2, x2 = impacts[i, 0], impacts[i, 1], impacts[i, 2], impacts[i, 3]
            t, e = abs(x1) / z1, z2 / z1
            psi = t / unit
            value, slope, by_e = psi - gross * (1.0 + restitution), 1.0, -gross
            if psi < end:
                cell = min(int(psi / end * CELLS), CELLS - 1)
                v, value, slope, by_e = psi / end - cell / CELLS, 0.0, 0.0, 0.0
                for n in range(3, -1, -1):
                    of, of_e = powers[line, cell, 0, n], powers[line, cell, 1, n]
                    slope = slope * v + value
                    value = value * v + ((of[3] * u + of[2]) * u + of[1]) * u + of[0]
                    by_e = by_e * v + ((of_e[3] * u + of_e[2]) * u + of_e[1]) * u + of_e[0]
                slope /= end
            value, own_e = unit * (value + by_e * (e - restitution)), unit * by_e if own else 0.0
            by_z1, by_z2 = (t * slope - value + own_e * e) * impacts[i, 4], own_e * impacts[i, 6]
            out[0, row, i] = x2 - (-z1 if x1 < 0.0 else z1) * value
            out[1, row, i] = sqrt(impacts[i, 7] ** 2 + (slope * impacts[i, 5]) ** 2 + by_z1**2 + by_z2**2)
    return out
