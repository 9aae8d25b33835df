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

import numpy as np
from numpy.typing import ArrayLike

from validation.reference.normal_motion import Array


def displacement(r: ArrayLike, theta: ArrayLike, nu: float, contact_radius: float = 1.0) -> tuple[Array, Array]:
    """U_x and U_y over mu, R = 1, at distances r <= b from the centre and theta [rad] from the traction, broadcast.

    Raises:
        ValueError: A point outside the contact.
    """
    distance, angle = np.asarray(r, dtype=float), np.asarray(theta, dtype=float)
    outside = (distance < 0.0) | (distance > contact_radius)
    if outside.any():
        raise ValueError(f"r has the value {distance[outside].flat[0]}; it must lie in [0, {contact_radius!r}]")
    mean = 2.0 * (2.0 - nu) * (2.0 * contact_radius**2 - distance**2)
    turning = nu * distance**2
    scale = 1.0 / (8.0 * (1.0 - nu))
    return scale * (mean + turning * np.cos(2.0 * angle)), scale * turning * np.sin(2.0 * angle)
