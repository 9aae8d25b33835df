"""The impacts that laws are judged by, and what the annulus reference says of them."""

from functools import cache
from typing import NamedTuple

import numpy as np

from validation.case import Array
from validation.reference.annulus import rebound_extrapolated

Impact = tuple[float, float, float]
"""psi_1, chi, restitution."""


class Judged(NamedTuple):
    """Impacts with their converged psi_2 and its estimate of its own error, arrays of one shape (n,)."""

    psi_1: Array
    chi: Array
    restitution: Array
    psi_2: Array
    uncertainty: Array


_KEPT = cache(rebound_extrapolated)  # cases ask for the same impacts


def judge(impacts: list[Impact], annuli: int = 40) -> Judged:
    """Ask the reference; annuli: the middle one of its three resolutions."""
    psi_1, chi, restitution = np.array(impacts, dtype=float).T.copy()
    psi_2, uncertainty = np.array([_KEPT(*one, annuli=annuli) for one in impacts]).T.copy()
    return Judged(psi_1, chi, restitution, psi_2, uncertainty)


def incidences(chi: float, count: int) -> list[float]:
    """psi_1 evenly from nearly 0 to 4 chi + 1.5: stick, partial slip and gross slip."""
    return np.linspace(0.02, 4.0 * chi + 1.5, count).round(4).tolist()


def sticking(chi: float, count: int) -> list[float]:
    """psi_1 evenly within the part that sticks somewhere; beyond, a law needs no steps and makes no error (e = 1)."""
    return np.linspace(0.05, max(1.0, 4.0 * chi - 1.0) - 0.05, count).round(4).tolist()
