"""Stick and slip on concentric rings with tractions in the plane: the compiled core of the ring solver.

Units: E* = R = m_N = 1; tangential quantities carry the factors that remove friction and stiffness ratio (see
annulus_kernel.py). Ring j carries the force f_j, a vector, spread evenly over its area; u_i is the mean displacement of
ring i, w the rigid displacement of the body, S_i what has slipped.

    u_i = sum_j A_ij f_j          (nu = 0: each component of u answers to the same component of f)
    slip of a step  r_i = w - S_i - u_i
    |f_i| <= P_i                  P_i: Hertz pressure over the ring, so that all rings together carry P exactly
    |f_i| < P_i: r_i = 0          |f_i| = P_i: r_i along f_i

With slip along the traction at the end of a step this is the minimum of 1/2 f.A f - f.(w - S) within the caps, which is
unique because A is symmetric and positive. It is found ring by ring, f_i <- cap[f_i + r_i/A_ii], from the guess that
all goes on as in the step before, until nothing moves (over-relaxation only takes longer: that guess is smooth, what
it leaves is not). A body's inertia over a step adds C to each A_ij: w = free - C F.
A ring that is not covered has cap zero; its S follows w - u, so that it comes into contact unstressed.

Sources: the principle: Kalker, Three-Dimensional Elastic Bodies in Rolling Contact (1990), section 4.3; that projected
relaxation converges: Cryer, SIAM J. Control 9 (1971) 385; Glowinski, Numerical Methods for Nonlinear Variational
Problems (1984), section V.5 for products of discs.
"""

import math

import numba
import numpy as np

TOLERANCE = 1e-8  # of the normal force: change of all ring forces together in the last sweep
MOST_SWEEPS = 20000


@numba.njit(cache=True)
def ring_caps(a, boundaries, caps_out) -> int:
    """Hertz pressure (2/pi) sqrt(a^2 - r^2) over each ring; returns the number of rings that are covered."""
    inner = a**3
    covered = 0
    for j in range(boundaries.size):
        outer = max(a * a - boundaries[j] ** 2, 0.0) ** 1.5
        caps_out[j] = 4.0 / 3.0 * (inner - outer)
        covered += caps_out[j] > 0.0
        inner = outer
    return covered


@numba.njit(cache=True, fastmath={"reassoc", "contract"})
def product(row, values, n) -> float:
    """Sum of n products; the order of summation is left to the compiler."""
    total = 0.0
    for j in range(n):
        total += row[j] * values[j]
    return total


@numba.njit(cache=True)
def settle(influence, caps, n, free, compliance, slipped, force) -> int:
    """Ring forces f at the end of a step, shape (2, N), found from a first guess; returns the sweeps, -1 if too many.

    influence A, shape (N, N); caps P_i, of which n are covered; rigid displacement with no force at the end of the step
    and C, shape (2,); slipped S, shape (2, N).
    """
    total = caps[:n].sum()
    sum_x, sum_y = force[0, :n].sum(), force[1, :n].sum()
    softest = max(compliance[0], compliance[1])
    for sweep in range(MOST_SWEEPS):
        change = 0.0
        for i in range(n):
            slip_x = free[0] - compliance[0] * sum_x - slipped[0, i] - product(influence[i], force[0], n)
            slip_y = free[1] - compliance[1] * sum_y - slipped[1, i] - product(influence[i], force[1], n)
            softness = influence[i, i] + softest
            x, y = force[0, i] + slip_x / softness, force[1, i] + slip_y / softness
            size = math.sqrt(x * x + y * y)
            if size > caps[i]:
                x, y = x * caps[i] / size, y * caps[i] / size
            dx, dy = x - force[0, i], y - force[1, i]
            sum_x, sum_y = sum_x + dx, sum_y + dy
            force[0, i], force[1, i] = x, y
            change += math.sqrt(dx * dx + dy * dy)
        if change <= TOLERANCE * total:
            return sweep + 1
    return -1


@numba.njit(cache=True)
def march(radius, dt, displacement, prescribed, psi_1, chi, boundaries, influence, force_out, psi_out, sweeps_out):
    """Follow a normal motion from instant to instant, along a displacement or with momentum, psi' = -2 chi F.

    Given: contact radius, zero out of contact, and length of the step that ends at each instant, shape (n,); the rigid
    displacement, shape (n, 2), read only if prescribed; velocity at first and chi of the two directions, shape (2,);
    outer radii of the rings, shape (N,), and A. Found: F/mu and velocity, shape (n, 2); sweeps, shape (n,).
    """
    rings = boundaries.size
    caps, slipped, force, before = np.zeros(rings), np.zeros((2, rings)), np.zeros((2, rings)), np.zeros((2, rings))
    w, psi, total, free, compliance = np.zeros(2), psi_1.copy(), np.zeros(2), np.zeros(2), np.zeros(2)
    for k in range(radius.size):
        covered = ring_caps(radius[k], boundaries, caps)
        step = dt[k] if k > 0 else 0.0
        for d in range(2):
            if prescribed:
                free[d] = displacement[k, d]
                if k == 0:
                    slipped[d, :] = free[d]  # a path that begins in contact begins without traction
            else:
                compliance[d] = 0.5 * chi[d] * step * step
                free[d] = w[d] + step * psi[d] - compliance[d] * total[d]
            for i in range(rings):  # first guess: as much again as in the step before
                old = force[d, i]
                force[d, i] = 2.0 * old - before[d, i] if i < covered else 0.0
                before[d, i] = old
        for i in range(covered):
            size = math.hypot(force[0, i], force[1, i])
            if size > caps[i]:
                force[0, i] *= caps[i] / size
                force[1, i] *= caps[i] / size
        sweeps_out[k] = settle(influence, caps, covered, free, compliance, slipped, force)
        if sweeps_out[k] < 0:
            return
        for d in range(2):
            new = force[d].sum()
            if prescribed:
                w[d] = free[d]
            else:
                w[d] = free[d] - compliance[d] * new
                psi[d] -= chi[d] * step * (total[d] + new)
            total[d] = new
            force_out[k, d], psi_out[k, d] = new, psi[d]
        for i in range(rings):
            # Within a hair of its cap a ring slips; the residual of one that sticks is no slip.
            if math.hypot(force[0, i], force[1, i]) >= caps[i] * (1.0 - 1e-12):
                for d in range(2):
                    slipped[d, i] = w[d] - product(influence[i], force[d], covered)
