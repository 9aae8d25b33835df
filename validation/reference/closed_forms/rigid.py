"""Oblique impact of rigid bodies with Coulomb friction: friction can stop the contact point, never turn it back."""

import numpy as np
from numpy.typing import ArrayLike

from validation.reference.normal_motion import Array


def gross_slip(psi_1: ArrayLike, chi: float, restitution: float = 1.0) -> Array:
    """psi_2, shaped as psi_1, of an impact that slides throughout: |psi_1| - 2 chi (1 + e), with the sign of psi_1.

    The friction impulse is mu times the normal one, m_N V_z1 (1 + e). It holds for elastic bodies too, as long as all
    of the contact slides (regimes.py).
    """
    psi = np.asarray(psi_1, dtype=float)
    return np.copysign(1.0, psi) * (np.abs(psi) - 2.0 * chi * (1.0 + restitution))


def rebound(psi_1: ArrayLike, chi: float, restitution: float = 1.0) -> Array:
    """Rebound psi_2 of rigid bodies: as `gross_slip` while that leaves some sliding, otherwise the body rolls away.

    For e = 1 this is max(psi_1 - 4 chi, 0), the simple theory of Maw, Barber & Fawcett, J. Lubr. Technol. 103 (1981)
    74, Fig. 3.
    """
    psi = np.asarray(psi_1, dtype=float)
    slid = gross_slip(psi, chi, restitution)
    return np.where(slid * psi > 0.0, slid, 0.0)
