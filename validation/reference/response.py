"""Tangential response to a given normal motion: annuli laid out, kernel run, history gathered."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from validation.reference.annulus_kernel import march
from validation.reference.normal_motion import Array, NormalMotion


@dataclass(frozen=True)
class History:
    """Tangential response along a normal motion, in units of E* = R = m_N = 1.

    Attributes:
        time: Instants, shape (n,).
        overlap: Overlap, shape (n,).
        normal_force: P, shape (n,).
        tangential_force: F/mu, shape (n,), the share of P that the tractions mobilise of their limits; positive where
            it opposes psi_1 > 0.
        psi: Scaled tangential velocity, shape (n,); the given one is not known for a prescribed path: zeros.
        boundaries: Outer radii b_j of the annuli, shape (N,).
        radii: Radii r_j where traction is given, shape (N,): the middle of each annulus, the centre in the first.
        pressure: Hertz pressure p(r_j), the limit of the traction, shape (n, N). A damper leaves it as it is.
        traction: Elastic traction q/mu at r_j, shape (n, N); it sums to F/mu without damper, to F/mu P_Hertz/P with
            one.
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


def rings(overlap: Array, annuli: int) -> tuple[Array, Array]:
    """Outer radii of equal annuli within the largest contact radius, and the radii where they are watched."""
    width = math.sqrt(overlap.max()) / annuli
    boundaries = width * np.arange(1.0, annuli + 1.0, dtype=np.float64)
    points: Array = boundaries - 0.5 * width
    points[0] = 0.0  # in contact from the first touch on, so that there is always an annulus to carry force
    return boundaries, points


def solve(
    motion: NormalMotion,
    boundaries: Array,
    points: Array,
    *,
    psi_1: float = 0.0,
    chi: float = 1.0,
    displacement: Array | None = None,
) -> History:
    """Run the kernel: along a prescribed displacement if one is given, otherwise with the body's momentum."""
    instants, annuli = motion.time.size, points.size
    psi, share, energy = np.zeros(instants), np.zeros(instants), np.zeros(instants)
    traction = np.zeros((instants, annuli))
    stuck = np.zeros((instants, annuli), dtype=np.bool_)
    corrections = np.zeros(instants, dtype=np.int64)
    march(
        np.sqrt(motion.overlap),
        np.diff(motion.time, prepend=motion.time[0]),
        np.ascontiguousarray(motion.impulse),
        np.zeros(instants) if displacement is None else displacement,
        displacement is not None,
        psi_1,
        chi,
        boundaries,
        points,
        psi,
        share,
        traction,
        stuck,
        corrections,
        energy,
    )
    if corrections.min() < 0:
        raise RuntimeError(f"stick and slip did not settle at instant {int(corrections.argmin())} of {instants}")
    inside = np.maximum(motion.overlap[:, None] - points**2, 0.0)
    return History(
        time=motion.time,
        overlap=motion.overlap,
        normal_force=motion.force,
        tangential_force=share * motion.force,
        psi=psi,
        boundaries=boundaries,
        radii=points,
        pressure=(2.0 / math.pi) * np.sqrt(inside),
        traction=traction,
        stuck=stuck,
        corrections=corrections,
        energy=energy,
    )
