"""The ring solver: partial slip on a Hertz contact that is dragged along any path in its plane.

Rings of equal width, each with one traction vector, and Coulomb's law in each of them: the axisymmetric theory with
nu = 0, where a uniform vector on a ring displaces all points at one radius alike, so that nothing is left out. The
compiled core is in ring_kernel.py, where the equations stand; the normal motion of an impact in normal_motion.py.

First order in 1/N where the contact grows (a ring takes part from its inner edge on), nearly second at constant
overlap; first order in the steps where the slide turns (slip is along the traction at the end of a step), second on a
straight line. `refinement.extrapolated` removes the first order of both at once.

Elastic impacts only, restitution 1.

Scaled quantities: psi = (kappa/mu) V/V_z1, chi = (kappa/2) m_N/m_T; forces F/mu; displacements kappa s/mu.

Sources: Johnson, Contact Mechanics (1985), sections 3.3, 3.4 (a) (uniform pressure on a circle, here the traction) and
7.2; rings with a vector each in the manner of the annuli of Maw, Barber & Fawcett, Wear 38 (1976) 101-114.
"""

import math
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ellipe, ellipk

from validation.reference.normal_motion import Array, impact_motion
from validation.reference.refinement import sampled
from validation.reference.ring_kernel import march


@lru_cache(maxsize=16)
def influence(rings: int) -> Array:
    """Mean displacement of ring i per unit force on ring j, N equal rings within radius 1; goes with 1/radius.

    Unit tractions on the discs of radius b <= c do the work 8/3 c^3 [(1 + k^2) E(k) - (1 - k^2) K(k)], k = b/c, on
    each other: the integral of u = (4 c/pi) E(r/c) over the smaller. Rings are differences of discs.
    """
    b = np.arange(rings + 1) / rings
    large = np.maximum(b[:, None], b)
    k2 = (np.minimum(b[:, None], b) / np.where(large > 0.0, large, 1.0)) ** 2
    shear = (1.0 - k2) * ellipk(np.where(k2 < 1.0, k2, 0.0))
    discs = 8.0 / 3.0 * large**3 * ((1.0 + k2) * ellipe(k2) - shear)
    work = np.diff(np.diff(discs, axis=0), axis=1)
    area = math.pi * np.diff(b * b)
    matrix = work / np.outer(area, area)
    matrix.setflags(write=False)
    return matrix


def _march(
    motion: tuple[Array, Array], rings: int, displacement: Array | None, psi_1: Array, chi: Array
) -> tuple[Array, Array]:
    """Force and velocity, each (n, 2), for radii and steps (n,): along a displacement (n, 2), or with momentum."""
    radius, dt = motion
    largest = float(radius.max())
    (force, psi), sweeps = np.zeros((2, radius.size, 2)), np.zeros(radius.size, dtype=np.int64)
    given = np.zeros((1, 2)) if displacement is None else displacement
    told = radius, dt, given, displacement is not None, psi_1, chi, largest * np.arange(1, rings + 1) / rings
    march(*told, influence(rings) / largest, force, psi, sweeps)
    if sweeps.min() < 0:
        raise RuntimeError(f"stick and slip did not settle at instant {int(sweeps.argmin())} of {radius.size}")
    return force, psi


def force_along_path(approach: ArrayLike, displacement: ArrayLike, *, rings: int = 64) -> Array:
    """F/mu along a prescribed quasi-static motion that begins without traction, with E* = R = 1.

    Overlap, shape (n,), and kappa s/mu, shape (n, 2), in a straight step from sample to sample; the force, shape
    (n, 2), is along a first displacement.
    """
    radius, path = sampled(approach, displacement)
    return _march((radius, np.ones(radius.size)), rings, path, np.zeros(2), np.zeros(2))[0]


def rebound(psi_1: ArrayLike, chi: ArrayLike, *, rings: int = 32, steps: int = 800) -> Array:
    """Rebound psi_2 of an elastic impact of a body whose tangential mass depends on the direction.

    psi_1 and chi along the principal directions of the tangential mass, shape (2,), chi also one number for both; in at
    least so many steps.
    """
    motion = impact_motion(1.0, int(rings), int(steps))
    dt = np.diff(motion.time, prepend=motion.time[0])
    ratios = np.broadcast_to(np.asarray(chi, dtype=float), 2).copy()
    return _march((np.sqrt(motion.overlap), dt), rings, None, np.array(psi_1, dtype=float), ratios)[1][-1]
