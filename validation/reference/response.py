"""Tangential response to a given normal motion: annuli laid out, kernel run, history gathered."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from validation.reference.annulus_kernel import march
from validation.reference.normal_motion import Array, NormalMotion


@dataclass(frozen=True)
class History:
    """Tangential response along a normal motion, in units of E* = R = m_N = 1 unless it is said to be normalised.

    Attributes:
        time, overlap, normal_force: Instants, overlap and P, shape (n,).
        tangential_force: F/mu, shape (n,), the share of P that the tractions mobilise of their limits; positive where
            it opposes psi_1 > 0.
        psi: Scaled tangential velocity, shape (n,); zeros for a prescribed path, whose own is not known.
        boundaries, radii: Outer radii b_j of the annuli, shape (N,), and radii r_j where traction is given: the middle
            of each, the centre in the first.
        pressure: Hertz pressure p(r_j), the limit of the traction, shape (n, N). A damper leaves it as it is.
        traction: Elastic traction q/mu at r_j, shape (n, N), |q| <= mu p; it sums to F/mu without damper, to
            F/mu P_Hertz/P with one.
        stuck: Whether annulus j is in contact and sticks, shape (n, N).
        corrections: Corrections of the stick and slip guess at each instant, shape (n,).
        energy: Tangential energy, shape (n,): elastic, plus psi^2/(4 chi) unless the path is prescribed. In a free
            motion without damper it grows by no more than the error of the annuli.
    """

    time: Array
    overlap: Array
    normal_force: Array
    tangential_force: Array
    psi: Array
    boundaries: Array
    radii: Array
    pressure: Array
    traction: Array
    stuck: NDArray[np.bool_]
    corrections: NDArray[np.int64]
    energy: Array

    @property
    def psi_2(self) -> float:
        """Rebound psi = (kappa/mu) V_x2/V_z1."""
        return float(self.psi[-1])

    @property
    def steps(self) -> int:
        """Number of time steps."""
        return self.time.size - 1


def rings(overlap: Array, annuli: int) -> tuple[Array, Array]:
    """Outer radii of equal annuli within the largest contact radius, and the radii where they are watched."""
    width = math.sqrt(overlap.max()) / annuli
    boundaries = width * np.arange(1.0, annuli + 1.0, dtype=np.float64)
    points: Array = boundaries - 0.5 * width
    points[0] = 0.0  # in contact from the first touch on, so that there is always an annulus to carry force
    return boundaries, points


def solve(
    motion: NormalMotion, boundaries: Array, points: Array, *, psi_1: float = 0.0, chi: float = 1.0,
    displacement: Array | None = None,
) -> History:  # fmt: skip
    """Run the kernel: along a prescribed displacement if one is given, otherwise with the body's momentum."""
    instants = motion.time.size
    psi, share, energy = np.zeros((3, instants))
    traction, stuck = np.zeros((instants, points.size)), np.zeros((instants, points.size), dtype=np.bool_)
    corrections = np.zeros(instants, dtype=np.int64)
    steps = np.diff(motion.time, prepend=motion.time[0])
    given = np.zeros(instants) if displacement is None else displacement
    told = np.sqrt(motion.overlap), steps, np.ascontiguousarray(motion.impulse), given, displacement is not None
    march(*told, psi_1, chi, boundaries, points, psi, share, traction, stuck, corrections, energy)
    if corrections.min() < 0:
        raise RuntimeError(f"stick and slip did not settle at instant {int(corrections.argmin())} of {instants}")
    pressure = 2.0 / math.pi * np.sqrt(np.maximum(motion.overlap[:, None] - points**2, 0.0))
    return History(motion.time, motion.overlap, motion.force, share * motion.force, psi, boundaries, points, pressure,
                   traction, stuck, corrections, energy)  # fmt: skip
