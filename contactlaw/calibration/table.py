"""A checked table of impacts."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Impacts:
    """A checked table of n impacts.

    Attributes:
        velocities: V_z1, V_x1, V_z2, V_x2 [m/s], shape (4, n).
        errors: Their standard deviations [m/s], shape (4, n); all 1 where they are not known.
        known_errors: Whether they are.
        mass_ratio: m_N/m_T.
        own_restitution: Whether V_z2 was measured, so that its error counts.
    """

    velocities: Array
    errors: Array
    known_errors: bool
    mass_ratio: float
    own_restitution: bool

    @property
    def size(self) -> int:
        """n."""
        return self.velocities.shape[1]

    def chosen(self, used: Mask) -> Impacts:
        """The impacts that are used, shape (n,)."""
        return replace(self, velocities=self.velocities[:, used], errors=self.errors[:, used])

    @property
    def impulse_ratio(self) -> tuple[Array, Array]:
        """Tangential over normal impulse and its standard deviation; mu where all slides.

        Eq. (6) of Maw, Barber & Fawcett (1981) with V_z1 + V_z2 for 2 V_z1.
        """
        z1, x1, z2, x2 = self.velocities
        s_z1, s_x1, s_z2, s_x2 = self.errors
        normal = self.mass_ratio * (z1 + z2)
        ratio = np.sign(x1) * (x1 - x2) / normal
        return ratio, np.sqrt(s_x1**2 + s_x2**2 + (self.mass_ratio * ratio) ** 2 * (s_z1**2 + s_z2**2)) / normal
