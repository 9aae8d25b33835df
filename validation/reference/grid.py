"""The grid solver: partial slip on a Hertz contact that is dragged along any path and spins about its normal.

Square cells, each with one traction vector and Coulomb's law; the response is Cerruti's, for any nu (cerruti.py); the
normal pressure is that of Hertz, which tangential traction between like materials leaves as it is. Unlike ones are also
sheared by the pressure, each surface drawn to the middle: where both stuck without friction they would part by

    u_r = -(4 beta/(3 pi)) a^3/r [1 - (1 - r^2/a^2)^(3/2)]        (beyond a the bracket is 1)

(Johnson, Contact Mechanics (1985), section 3.4 and equation 3.41; beta: Dundurs' second parameter; E* = R = 1). What
friction does to the pressure in turn, of the order of beta squared, is left out (Goodman, J. Appl. Mech. 29 (1962)
515). Nothing is assumed on where stick and slip lie, nor on the shape of the traction. The equations of a step stand in
grid_step.py; the normal motion of an impact in normal_motion.py.

At constant overlap the error falls as cells^(-3/2) to cells^(-2), where the contact grows as 1/cells (a cell takes part
once its first corner is covered). It is of first order in the steps where the slip turns: slip is along the traction
at the end of a step. `refinement.extrapolated` removes the first order of both. Elastic impacts only, restitution 1.

An elliptic contact, half axes a along x and b = a ratio along y, has cells of these proportions, and the axes that
Hertz gives it for the same P and overlap (section 4.2): a = (2/pi) K(1 - (b/a)^2) times the radius of the circle.

Scaled quantities: psi = (kappa/mu) V/V_z1, sigma = (kappa/mu) omega a_max/V_z1; chi = (kappa/2) m_N/m_T, for spin
chi_s = (kappa/2) m_N a_max^2/I, I the inertia about the normal; forces F/mu, moments M/mu; displacements kappa s/mu,
angles kappa theta/mu. Moments and angles turn x into y.
"""

import math

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ellipk

from validation.reference.grid_step import Step, cell_pressure
from validation.reference.normal_motion import Array, impact_motion
from validation.reference.refinement import sampled


def _march(
    motion: tuple[Array, Array], cells: int, nu: float, path: Array | None, psi_1: Array, chi: Array,
    coupling: float = 0.0, ratio: float = 1.0,
) -> tuple[Array, Array]:  # fmt: skip
    """Resultant (F_x, F_y, M/a_max) and velocity (psi_x, psi_y, sigma), each (n, 3), for radii and steps (n,).

    Along a path (w_x, w_y, theta a_max), shape (n, 3), if there is one, otherwise with momentum: psi' = -2 chi Q.
    """
    if cells % 2 or cells < 4:
        raise ValueError(f"cells is {cells!r}; it must be even and at least 4")
    wide = 2.0 / math.pi * float(ellipk(1.0 - ratio**2))
    radius, dt = wide * motion[0], motion[1]
    largest, last = float(radius.max()), radius.size - 1
    h = 2.0 * largest / cells
    middles = (2.0 * np.arange(cells) + 1.0 - cells) / cells
    arms = np.stack(np.broadcast_arrays(-ratio * middles, middles[:, None]))
    traction, before, slipped = np.zeros((3, 2, cells, cells))
    w, psi, force = np.zeros(3), psi_1.copy(), np.zeros(3)
    if path is not None:
        w = path[0]
        slipped = w[:2, None, None] + arms * w[2]  # a path that begins in contact begins without traction
    forces, velocities = np.zeros((radius.size, 3)), np.zeros((radius.size, 3))
    for k in range(radius.size):
        step = dt[k] if k > 0 else 0.0
        compliance = np.zeros(3) if path is not None else 0.5 * chi * step**2
        free = path[k] if path is not None else w + step * psi - compliance * force
        # The window holds the contact of the next instant too: what is about to be covered has to be followed.
        half = max(1, math.ceil(max(radius[k], radius[min(k + 1, last)]) / h * (1.0 - 1e-12)))
        window = (slice(None), *(slice(cells // 2 - half, cells // 2 + half),) * 2)
        caps = cell_pressure(radius[k], h, 2 * half) / (wide**3 * ratio)
        parted = coupling * drawn(largest * arms[window], radius[k])
        problem = Step(h, nu, radius[k], caps, arms[window], free, compliance, slipped[window] - parted, ratio)
        new = np.zeros_like(traction)
        if radius[k] > 0.0:
            new[window] = problem.solve(2.0 * traction[window] - before[window])
        slipped[window] = problem.slipped_after(new[window]) + parted
        before, traction = traction, new
        end = problem.resultant(new[window])
        w, psi, force = free - compliance * end, psi - chi * step * (force + end), end
        forces[k], velocities[k] = force, psi
    return forces, velocities


def drawn(arms: Array, a: float) -> Array:
    """How far pressure draws points to the middle, over beta; arms: (-y, x), shape (2, n, n); a: contact radius."""
    square = (arms**2).sum(axis=0)
    inside = 1.0 - np.maximum(1.0 - square / max(a * a, 1e-300), 0.0) ** 1.5
    return -4.0 / (3.0 * math.pi) * a**3 * inside / square * np.stack([arms[1], -arms[0]])


def force_along_path(approach: ArrayLike, displacement: ArrayLike, *, nu: float = 0.0, cells: int = 32) -> Array:
    """F/mu and moment about the normal along a prescribed quasi-static motion that begins without traction, E* = R = 1.

    Overlap, shape (n,), and kappa s/mu with kappa theta/mu, shape (n, 3); F_x, F_y and M, over mu, shape (n, 3), along
    a first displacement. nu: Poisson's ratio of both bodies, in (-1, 0.5]: it sets how the traction spreads; kappa is
    apart from it. cells: across the largest contact, even.

    Raises:
        ValueError: A number of cells that is odd or too small.
        RuntimeError: The iterations of a step do not end.
    """
    radius, path = sampled(approach, displacement)
    lengths = np.array([1.0, 1.0, radius.max()])
    return lengths * _march((radius, np.ones(radius.size)), cells, nu, path * lengths, np.zeros(3), np.zeros(3))[0]


def rebound(
    psi_1: ArrayLike, chi: ArrayLike, *, nu: float = 0.0, cells: int = 32, steps: int = 256, coupling: float = 0.0,
    ratio: float = 1.0,
) -> Array:  # fmt: skip
    """Rebound of an elastic impact of a body that spins about the normal.

    psi_x, psi_y and sigma before and, returned, after; chi > 0 along x and y, and chi_s >= 0, shape (3,) each. chi_s =
    0, a spin that friction does not change, is the limit of a small contact. nu, cells and what is raised as for
    `force_along_path`; steps: at least. coupling: (kappa/mu) beta, of unlike materials, on a circle. ratio: b/a of an
    elliptic contact, above 1 where its longer axis is along y; kappa is that of a circle.
    """
    incidence, ratios = np.array(psi_1, dtype=float), np.array(chi, dtype=float)
    motion = impact_motion(1.0, cells // 2, int(steps))
    dt = np.diff(motion.time, prepend=motion.time[0])
    return _march((np.sqrt(motion.overlap), dt), cells, nu, None, incidence, ratios, coupling, ratio)[1][-1]
