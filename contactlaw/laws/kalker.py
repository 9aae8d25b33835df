"""Kalker's coefficients of steady rolling, by the shape of the contact and Poisson's ratio.

By table E.3 of Kalker, Three-Dimensional Elastic Bodies in Rolling Contact (1990), an ellipse of half axes a along the
way and b across it, on bodies of shear modulus G, holds the forces G a b C11 du/ds and G a b C22 dv/ds at a creep of du
and dv per way s. As tractions displace surfaces by terms linear in nu, so is 1/C, to 0.5 % at nu = 1/4; at nu = 0 C11 =
C22. The table ends at ratios of ten. Contacts shorter than a tenth of their width have its first row, right to 2 %, and
longer ones his asymptotes, times the factor by which these meet the table: with L = ln(16 a^2/b^2), h = 3 - ln 4,

    C11 = 2 pi a/b [1 + h/(L - 2 nu)]/(L - 2 nu)        C22 = 2 pi a/b [1 + h/L']/[(1 - nu) L'],  L' = L + 2 nu/(1 - nu)
"""

from math import log

import numpy as np

from contactlaw.jit import jit_module

TABLE = np.array([  # a/b; C11 = C22 at nu = 0; C11 and C22 at nu = 1/2
    (0.1, 2.51, 4.85, 2.53), (0.2, 2.59, 4.81, 2.66), (0.3, 2.68, 4.80, 2.81), (0.4, 2.78, 4.82, 2.98),
    (0.5, 2.88, 4.83, 3.14), (0.6, 2.98, 4.91, 3.31), (0.7, 3.09, 4.97, 3.48), (0.8, 3.19, 5.05, 3.65),
    (0.9, 3.29, 5.12, 3.82), (1.0, 3.40, 5.20, 3.98), (1 / 0.9, 3.51, 5.30, 4.16), (1 / 0.8, 3.65, 5.42, 4.39),
    (1 / 0.7, 3.82, 5.58, 4.67), (1 / 0.6, 4.06, 5.80, 5.04), (2.0, 4.37, 6.11, 5.56), (2.5, 4.84, 6.57, 6.31),
    (1 / 0.3, 5.57, 7.34, 7.51), (5.0, 6.96, 8.82, 9.79), (10.0, 10.7, 12.9, 16.0),
])  # fmt: skip
FIRST, STEP, POINTS = log(0.1), log(10.0) / 16.0, 65  # of ln(a/b), between which 1/C is interpolated: to ratios of 1000


def _compliances() -> np.ndarray:
    """Return 1/C at the points of ln(a/b), in the columns of TABLE."""
    ratio = np.geomspace(10.0, 1000.0, 33)
    length, part = np.log(16.0 * ratio**2)[:, None] + (0.0, -1.0, 2.0), (1.0, 1.0, 0.5)
    long = ratio[:, None] / part * (1.0 + (3.0 - log(4.0)) / length) / length
    known = np.concatenate([TABLE[:-1, 1:], TABLE[-1, 1:] / long[0] * long])
    at, ratios = FIRST + STEP * np.arange(POINTS), np.concatenate([TABLE[:-1, 0], ratio])
    return np.exp([-np.interp(at, np.log(ratios), np.log(column)) for column in known.T]).T


COMPLIANCES = _compliances()


def compliances(slender, nu):
    """Return 1/C11 and 1/C22; slender: ln(a/b)."""
    x = min(max((slender - FIRST) / STEP, 0.0), POINTS - 1.0)
    i = min(int(x), POINTS - 2)
    flat, along, across = between(i, x - i, 0), between(i, x - i, 1), between(i, x - i, 2)
    return flat + 2.0 * nu * (along - flat), flat + 2.0 * nu * (across - flat)


def between(i, x, column):
    """Return what the table of 1/C has beyond point i, by the share x of the way to the next."""
    return COMPLIANCES[i, column] + x * (COMPLIANCES[i + 1, column] - COMPLIANCES[i, column])


def of_spin(nu):
    """Return C23 and C33 of a circle: parabolas through the table's values at nu = 0, 1/4 and 1/2."""
    return 1.33 + nu * (0.52 + 0.16 * nu), 1.21 - nu * (0.06 + 0.08 * nu)


jit_module(__name__)
