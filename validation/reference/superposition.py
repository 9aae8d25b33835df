"""Superposition along the load history: the source paper's first method, a second reference beside the annuli.

Every increment of load is solved from the present state by the theory of Mindlin & Deresiewicz, and its traction is
added to those before: after n steps the traction is a sum of up to n Hertz-shaped components of different radii.
Components that later slip swallows drop out; those left, the irreducible ones, are all that the contact remembers.
Their number has no bound but that of the steps, and each step sums over all of them: its cost grows with the history.
(With sums carried along the stack instead, a step would cost a bounded time on average; the components must be kept
all the same.) The compiled core is in superposition_kernel.py, where the equations stand. Nothing is shared with the
annulus solver: no fixed annuli, no influence matrix, no guess of stick and slip.

What is assumed: slip is one ring along the edge, all in one sense, and stick a disc. A ring of slip enclosed by stick
is never looked for. For a Hertz contact under one line of force none can arise in the axisymmetric theory: growth
without slip raises the limit everywhere by at least as much as the traction, and slip that starts at the edge meets
every condition of contact, which has one solution. So both methods apply to the same motions. (Elastic terms that are
not axisymmetric are left out, as in the paper.)

Elastic impacts only, restitution 1. A prescribed path, straight between its samples, is solved exactly up to rounding;
an impact with an error of second order in the time step.

Scaled quantities: psi = (kappa/mu) V_x/V_z1, chi = (kappa/2) m_N/m_T; forces F/mu; displacements kappa s_x/mu.

Sources: Maw, The oblique impact of elastic spheres (1976), as described by Maw, Barber & Fawcett, J. Lubr. Tech. 103
(1981) 74-80; Mindlin & Deresiewicz, J. Appl. Mech. 20 (1953) 327-344.
"""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import beta, betainc

from validation.reference.normal_motion import Array
from validation.reference.refinement import broadcast
from validation.reference.superposition_kernel import march_impact, march_path

__all__ = ["Impact", "force_along_path", "impact", "rebound", "traction_along_path"]

STEPS = 1000


class Impact(NamedTuple):
    """One elastic impact, from touch to release: psi_2 = (kappa/mu) V_x2/V_z1; then, shape (n,) each, tau = t/T,
    P/P_max, F/(mu P_max), positive where it opposes psi_1 > 0, tangential velocity psi, and number of components."""

    psi_2: float
    time: Array
    normal_force: Array
    tangential_force: Array
    psi: Array
    components: NDArray[np.int64]


def rebound(psi_1: ArrayLike, chi: ArrayLike, steps: int = STEPS) -> float | Array:
    """Rebound psi_2 = (kappa/mu) V_x2/V_z1, told as `impact` is: a float for scalars, arrays broadcast."""
    return broadcast(lambda psi, ratio: impact(psi, ratio, steps).psi_2, psi_1, chi)


def impact(psi_1: float, chi: float, steps: int = STEPS) -> Impact:
    """One elastic impact with its whole history, of psi_1 and chi > 0 in at least 4 time steps."""
    time, overlap, speed = _normal_motion(int(steps))
    psi, force = np.empty(time.size), np.empty(time.size)
    components = np.empty(time.size, dtype=np.int64)
    march_impact(time, overlap, speed, float(psi_1), float(chi), psi, force, components)
    deepest = (15.0 / 16.0) ** 0.4
    normal, tangential = (overlap / deepest) ** 1.5, force / (4.0 / 3.0 * deepest**1.5)
    return Impact(float(psi[-1]), time / time[-1], normal, tangential, psi, components)


@lru_cache(maxsize=64)
def _normal_motion(steps: int) -> tuple[Array, Array, Array]:
    """Time, overlap and its rate over an elastic Hertz impact d'' = -4/3 d^(3/2), d'(0) = 1, shape (steps + 1,).

    By energy d'^2 + 16/15 d^(5/2) = 1, thus d' = cos(theta), d = (15/16)^(2/5) sin(theta)^(4/5), and the time is an
    incomplete beta function of sin(theta)^2. Instants lie evenly in theta, from 0 to pi.
    """
    deepest = (15.0 / 16.0) ** 0.4
    angle = np.linspace(0.0, math.pi, steps + 1)
    sine = np.sin(angle)
    sine[-1] = 0.0
    inward = 0.4 * deepest * beta(0.4, 0.5) * betainc(0.4, 0.5, sine**2)
    duration = 0.8 * deepest * beta(0.4, 0.5)
    motion = np.where(angle <= 0.5 * math.pi, inward, duration - inward), deepest * sine**0.8, np.cos(angle)
    for array in motion:
        array.setflags(write=False)
    return motion


def force_along_path(
    approach: ArrayLike, displacement: ArrayLike, *, kappa: float = 1.0, friction: float = 1.0
) -> Array:
    """Tangential force along a prescribed quasi-static motion, straight between samples, with E* = R = 1.

    Overlap and displacement s_x, shape (n,); the force, shape (n,), is positive along a first displacement.
    """
    depth, scaled = np.array(approach, dtype=float), np.array(displacement, dtype=float) * (kappa / friction)
    return friction * _along(depth, scaled, np.empty(0))[0]


def traction_along_path(
    approach: ArrayLike, displacement: ArrayLike, radii: ArrayLike
) -> tuple[Array, NDArray[np.int64]]:
    """Traction q/mu at radii (m,) along a path of overlap and kappa s_x/mu (n,), shape (n, m), and components, (n,)."""
    depth, scaled, points = (np.array(one, dtype=float) for one in (approach, displacement, radii))
    return _along(depth, scaled, points)[1:]


def _along(depth: Array, displacement: Array, points: Array) -> tuple[Array, Array, NDArray[np.int64]]:
    """Force, traction at the points, and number of components at each sample of a path in scaled units."""
    before, after = depth[:-1], depth[1:]
    touching = np.flatnonzero((before < 0.0) & (after > 0.0))
    # The instant of touch, from which on displacement counts: an added sample of overlap 0.
    position = touching + before[touching] / (before[touching] - after[touching])
    touched = np.interp(position, np.arange(depth.size), displacement)
    path = np.insert(depth, touching + 1, 0.0), np.insert(displacement, touching + 1, touched)
    given = np.arange(depth.size) + np.searchsorted(touching, np.arange(depth.size))
    force, components = np.empty(path[0].size), np.empty(path[0].size, dtype=np.int64)
    traction = np.empty((path[0].size, points.size))
    march_path(*path, points, force, traction, components)
    return force[given], traction[given], components[given]
