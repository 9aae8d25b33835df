"""Rebound models that give psi_2 in closed form, as peers of the contact laws.

Sources: Walton, in Roco (ed.), Particulate Two-Phase Flow (1993), chapter 25; Foerster, Louge, Chang & Allia, Phys.
Fluids 6 (1994) 1108; Stronge, Impact Mechanics (2000), chapter 5; Stronge, James & Ravani, Phil. Trans. R. Soc. A 359
(2001) 2447.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from validation.reference.checks import check_finite, check_positive
from validation.reference.closed_forms import oscillator, rigid
from validation.reference.normal_motion import Array


def walton(psi_1: ArrayLike, chi: float, tangential_restitution: float, restitution: float = 1.0) -> Array:
    """Walton's three parameters e, mu, beta_0: an impact slides throughout, or its contact point leaves with -beta_0.

    Of the two the one that takes less of the velocity holds: psi_2 = max(psi_1 - 2 chi (1 + e), -beta_0 psi_1) for
    psi_1 >= 0.

    Args:
        psi_1: Incidence; any shape.
        chi: (kappa/2) m_N/m_T > 0.
        tangential_restitution: beta_0 in [-1, 1]; a fitted number, not a property of the material alone.
        restitution: e in (0, 1].

    Returns:
        psi_2, shaped as psi_1.

    Raises:
        ValueError: An argument is outside its range.
    """
    check_finite("tangential_restitution", tangential_restitution)
    if not -1.0 <= tangential_restitution <= 1.0:
        raise ValueError(f"tangential_restitution is {tangential_restitution!r}; it must lie in [-1, 1]")
    psi = np.asarray(psi_1, dtype=float)
    side = np.copysign(1.0, psi)
    return side * np.maximum(side * rigid.gross_slip(psi, chi, restitution), -tangential_restitution * np.abs(psi))


def stronge(psi_1: ArrayLike, chi: ArrayLike, restitution: float = 1.0, compliance_ratio: float = 1.0) -> float | Array:
    """Stronge's lumped parameters: a tangential spring beside a normal one that unloads with 1/e^2 its stiffness.

    His eta^2 is the normal over the tangential stiffness; where it is taken from the elastic constants, as for spheres
    in his section 5.1, it is 1/kappa and drops out of the scaled variables: for e = 1 the model is then the paper's
    linearisation (oscillator.py) to the letter.

    Args:
        psi_1: Incidence; broadcasts with chi.
        chi: (kappa/2) m_N/m_T > 0.
        restitution: e in (0, 1]; his energetic, and here also the kinematic one.
        compliance_ratio: eta^2 kappa > 0, for another tangential stiffness than that of the elastic constants.

    Returns:
        psi_2, a float for scalars.

    Raises:
        ValueError: An argument is outside its range.
    """
    check_positive("compliance_ratio", compliance_ratio)
    softer = 1.0 / compliance_ratio
    return compliance_ratio * oscillator.rebound(
        softer * np.asarray(psi_1, dtype=float), softer * np.asarray(chi, dtype=float), restitution
    )
