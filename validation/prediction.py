"""Predictions of every law, and of the reference, for impacts that others have measured."""

import warnings
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from contactlaw import LAWS, ContactPair, ContactWarning, rebound
from validation.case import Array
from validation.reference import annulus

REFERENCE = "(the reference)"
"""The annulus solver's name among the laws."""
_KEPT = cache(annulus.rebound)  # cases and pictures ask for the same impacts
ANNULI = 40  # its error in psi_2 is below 1e-3 then, a tenth of what can be read from a figure
SPHERE = 3.5
"""1 + 1/K^2 of a homogeneous sphere (K^2 = 2/5), or of two equal ones: chi = 3.5 kappa/2."""


def quiet_pair(*told: Any, **more: Any) -> ContactPair:
    """A pair whose warning of unlike materials is left to what the case says of them."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ContactWarning)
        return ContactPair(*told, **more)


def reference(psi_1: ArrayLike, chi: float, restitution: float = 1.0) -> Array:
    """psi_2 of the annulus solver at each psi_1, shape (n,)."""
    return np.array([_KEPT(float(psi), chi, ANNULI, restitution=restitution) for psi in np.atleast_1d(psi_1)])


def rebounds(psi_1: ArrayLike, chi: float, e: float = 1.0, *, with_reference: bool = True) -> dict[str, Array]:
    """psi_2 by name of the law, shape (n,) each, best law first, and by the reference (milliseconds an impact)."""
    psi = np.atleast_1d(np.asarray(psi_1, dtype=float))
    found = {name: np.atleast_1d(rebound(psi, chi, name, e)) for name in [*LAWS][::-1]}
    if with_reference:
        found[REFERENCE] = reference(psi, chi, e)
    return found


def rms(differences: ArrayLike) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(np.square(differences))))


def over_the_next_best(measures: dict[str, float]) -> float:
    """The default law's distance from the data over the smallest of the other laws': below 1 it is the best rung."""
    others = [value for name, value in measures.items() if name not in ("microslip", REFERENCE)]
    return measures["microslip"] / min(others)
