"""Tables of impacts of known truth, for the tests of calibration."""

from __future__ import annotations

from functools import cache

import numpy as np

from contactlaw import rebound
from validation.reference.annulus import rebound as reference

DISK = 0.5
MU, KAPPA, E = 0.115, 0.837, 0.93  # the paper's steel puck
RATIO = 1.0 + 1.0 / DISK
ALL = (*np.linspace(0.3, 4.2, 9), *np.linspace(4.6, 8.0, 7))
NOISE = 0.005  # of every velocity, over the approach speed


@cache
def curve(psi_1, mu=MU, kappa=KAPPA, e=E, ratio=RATIO, law=False):
    """V_z1, V_x1, V_z2, V_x2 without errors."""
    chi = 0.5 * kappa * ratio
    psi_2 = rebound(psi_1, chi, restitution=e) if law else reference(psi_1, chi, 16, restitution=e)
    ones = np.ones(len(psi_1))
    return np.stack([ones, mu / kappa * np.array(psi_1), e * ones, mu / kappa * np.atleast_1d(psi_2)])


def table(psi_1=ALL, noise=NOISE, seed=0, **truth):
    """(before, after) with normal errors."""
    z1, x1, z2, x2 = curve(tuple(psi_1), **truth)
    z1, x1, z2, x2 = np.stack([z1, x1, z2, x2]) + noise * np.random.default_rng(seed).standard_normal((4, x1.size))
    return (z1, x1), (z2, x2)


def errors(noise=NOISE):
    return {"normal_error": noise, "tangential_error": noise}


def off(estimate, truth):
    """In standard uncertainties."""
    return abs(estimate.value - truth) / estimate.uncertainty
