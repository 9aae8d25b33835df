"""Motion of the contact point of a round body before and after an impact, beside the reference."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contactlaw import ContactPair
from sims.puck import reference

Array = NDArray[np.float64]


def contact_velocity(velocity: ArrayLike, spin: ArrayLike, normal: ArrayLike, radius: float) -> Array:
    """Velocity of the contact point of a round body, v + omega x (-R n) [m/s].

    Args:
        velocity: Of its centre [m/s], shape (..., 3).
        spin: [rad/s], shape (..., 3).
        normal: Unit vector from what it touches to its centre, shape (3,).
        radius: [m].
    """
    turning, up = np.asarray(spin, dtype=float), np.asarray(normal, dtype=float)
    return np.asarray(velocity, dtype=float) - radius * np.cross(turning, up)


def static_overlap(pair: ContactPair, load: float, radius: float) -> float:
    """Overlap [m] of a Hertz contact of effective radius [m] under a load [N]."""
    return (load / (4.0 / 3.0 * pair.effective_modulus * radius**0.5)) ** (2.0 / 3.0)


def rebound_of(pair: ContactPair, chi: float, before: ArrayLike, after: ArrayLike, normal: ArrayLike) -> dict[str, Any]:
    """psi before and after an impact, and psi after by the reference.

    Args:
        pair: The contact.
        chi: (kappa/2) m_N/m_T of the impact.
        before, after: Velocity of the contact point relative to what it touches [m/s], shape (3,).
        normal: Unit vector to the body, shape (3,).

    Returns:
        psi1 >= 0, psi2 along the same direction, psi2_reference (annulus solver), restitution, and `aside`: psi across
        that direction after the impact. All NaN where the bodies did not approach.
    """
    first, second, n = (np.asarray(one, dtype=float) for one in (before, after, normal))
    approach = -float(first @ n)
    if approach <= 0.0:
        return dict.fromkeys(("psi1", "psi2", "psi2_reference", "restitution", "aside"), float("nan"))
    sliding, left = first + approach * n, second - (second @ n) * n
    speed = float(np.linalg.norm(sliding))
    along = sliding / speed if speed > 0.0 else np.zeros(3)
    psi1 = pair.psi(speed, approach)
    return {
        "psi1": psi1,
        "psi2": pair.psi(float(left @ along), approach),
        "psi2_reference": reference(round(psi1, 9), chi, pair.restitution),
        "restitution": float(second @ n) / approach,
        "aside": pair.psi(float(np.linalg.norm(left - (left @ along) * along)), approach),
    }
