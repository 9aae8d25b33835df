"""Relative displacement of two like surfaces while all of a Hertz contact slides.

The traction is mu p(r) = 2 G mu sqrt(b^2 - r^2)/(pi R (1 - nu)) along x. With theta counted from x, the two surfaces
move against each other by

    U_x = mu/(8 R (1 - nu)) [2 (2 - nu) (2 b^2 - r^2) + nu r^2 cos 2 theta]
    U_y = mu/(8 R (1 - nu)) nu r^2 sin 2 theta                                          r <= b

The terms with 2 theta are what an axisymmetric theory leaves out; they do not depend on b, so that all points have the
velocity V_x = mu (2 - nu)/(R (1 - nu)) b db/dt. With b^2 = R d this is (mu/kappa) dd/dt: in units of psi the closing
velocity.

Sources: appendix of Maw, Barber & Fawcett, J. Lubr. Technol. 103 (1981) 74; for one body, half of this: Johnson,
Contact Mechanics (1985), eq. (3.91), and section 7.2 for its use.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from validation.reference.normal_motion import Array


def displacement(
    r: ArrayLike,
    theta: ArrayLike,
    *,
    contact_radius: float,
    radius: float = 1.0,
    friction: float = 1.0,
    poissons_ratio: float,
) -> tuple[Array, Array]:
    """U_x and U_y [m] at points inside the contact.

    Args:
        r: Distance from the centre of contact [m], from 0 to the contact radius; broadcasts with theta.
        theta: Angle from the direction of the traction [rad].
        contact_radius: b [m].
        radius: Effective radius R [m].
        friction: mu > 0.
        poissons_ratio: nu of both bodies, in (-1, 0.5].

    Raises:
        ValueError: An argument is outside its range.
    """
    distance, angle, nu = np.asarray(r, dtype=float), np.asarray(theta, dtype=float), poissons_ratio
    outside = (distance < 0.0) | (distance > contact_radius)
    if outside.any():
        raise ValueError(f"r has the value {distance[outside].flat[0]}; it must lie in [0, {contact_radius!r}]")
    scale = friction / (8.0 * radius * (1.0 - nu))
    mean = 2.0 * (2.0 - nu) * (2.0 * contact_radius**2 - distance**2)
    turning = nu * distance**2
    return scale * (mean + turning * np.cos(2.0 * angle)), scale * turning * np.sin(2.0 * angle)


def velocity(
    contact_radius: float, growth: float, *, radius: float = 1.0, friction: float = 1.0, poissons_ratio: float
) -> float:
    """V_x = dU_x/dt [m/s], the same at all points of the contact; V_y is zero.

    Args:
        contact_radius: b [m].
        growth: db/dt [m/s].
        radius: Effective radius R [m].
        friction: mu > 0.
        poissons_ratio: nu of both bodies, in (-1, 0.5].
    """
    return friction * (2.0 - poissons_ratio) / (radius * (1.0 - poissons_ratio)) * contact_radius * growth
