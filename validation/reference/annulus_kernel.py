"""Stick and slip on concentric annuli: the compiled core of the annulus solver.

Every jitted function of the reference stands in this file, because numba's cache does not notice edits elsewhere.

Units: E* = R = m_N = 1 throughout. Tangential quantities carry the factors that remove friction and stiffness ratio,
so that Coulomb's limit is the pressure itself and the tangential influence functions are the normal ones:

    traction q/mu      force F/mu      displacement s = kappa s_x/mu      velocity psi = ds/dt

Symbols: a contact radius; b_j outer radius of annulus j, the outermost one ending at a; r_i radius where annulus i is
watched; c_j share of the Hertz-shaped traction (2/pi) sqrt(b_j^2 - r^2); S_i locked-in displacement, what remains of s
at annulus i once the elastic displacement is taken off.

    stuck      sum_j c_j u(b_j, r_i) = s - S_i
    slipping   sum_j c_j sqrt(b_j^2 - r_i^2) = +-sqrt(a^2 - r_i^2)
    uncovered  no traction, S_i follows s - u: an annulus comes into contact unstressed

Since the outermost distribution always ends at the contact edge, gross slip (c = 0, ..., 0, +-1) is represented
exactly.

The share mobilised, sum_j c_j (b_j/a)^3, is force over limit. Of a damped normal force P the tangential force is the
same share; P enters the momentum alone, psi' = -2 chi P share, never the equations above.

Sources: Maw, Barber & Fawcett, Wear 38 (1976) 101-114 and J. Lubr. Tech. 103 (1981) 74-80, the second method;
influence functions: Johnson, Contact Mechanics (1985), sections 3.4 and 7.2, without the non-axisymmetric terms.
"""

import math

import numba
import numpy as np

STICK = 0  # +1 and -1 stand for slip with traction along +x and -x
EDGE = 1e-9  # relative distance below which an annulus counts as sitting on the contact edge
CAP_SLACK = 1e-10  # overshoot of Coulomb's limit, relative, that is still rounding
SLIP_SLACK = 1e-13  # backward slip, over the largest overlap, that is still rounding
JOINT_CORRECTIONS = 12  # rounds in which all wrong guesses change together; after that one at a time
ROUNDS_PER_ANNULUS = 40  # bound on corrections; only a singular system could exceed it


@numba.njit(cache=True)
def hertz_displacement(b: float, r: float) -> float:
    """Surface displacement at radius r under the pressure (2/pi) sqrt(b^2 - r^2), r < b."""
    if r <= b:
        return b * b - 0.5 * r * r
    return ((2.0 * b * b - r * r) * math.asin(b / r) + b * math.sqrt(r * r - b * b)) / math.pi


@numba.njit(cache=True)
def hertz_force(b: float) -> float:
    """Resultant of the pressure (2/pi) sqrt(b^2 - r^2)."""
    return 4.0 / 3.0 * b**3


@numba.njit(cache=True)
def stored_energy(shares, radii) -> float:
    """Elastic energy of the traction: half its work on the displacement, pair by pair.

    The displacement of the wider distribution is c^2 - r^2/2 all over the narrower one, whose mean r^2 is 2 b^2/5.
    """
    total = 0.0
    for i in range(shares.size):
        for j in range(shares.size):
            inner, outer = min(radii[i], radii[j]), max(radii[i], radii[j])
            total += 0.5 * shares[i] * shares[j] * hertz_force(inner) * (outer**2 - inner**2 / 5.0)
    return total


@numba.njit(cache=True)
def solve_in_place(matrix, rhs) -> None:
    """Gaussian elimination with row exchange; the solution replaces rhs. For so few rows numpy's is slower."""
    n = rhs.size
    for k in range(n):
        pivot = k
        for i in range(k + 1, n):
            if abs(matrix[i, k]) > abs(matrix[pivot, k]):
                pivot = i
        if pivot != k:
            for j in range(k, n):
                matrix[k, j], matrix[pivot, j] = matrix[pivot, j], matrix[k, j]
            rhs[k], rhs[pivot] = rhs[pivot], rhs[k]
        for i in range(k + 1, n):
            factor = matrix[i, k] / matrix[k, k]
            if factor != 0.0:
                for j in range(k + 1, n):
                    matrix[i, j] -= factor * matrix[k, j]
                rhs[i] -= factor * rhs[k]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            rhs[k] -= matrix[k, j] * rhs[j]
        rhs[k] /= matrix[k, k]


@numba.njit(cache=True)
def traction_share(radii, i, r, shares) -> float:
    """Traction over Coulomb's limit at radius r of annulus i; the last radius is the contact edge."""
    edge = radii[-1]
    total = shares[-1]
    for j in range(i, shares.size - 1):
        total += shares[j] * math.sqrt((radii[j] ** 2 - r * r) / (edge * edge - r * r))
    return total


@numba.njit(cache=True)
def trial_shares(state, radii, points, displacement, locked, free, compliance, shares_out) -> None:
    """The shares c_j for a guess of stick and slip (STICK, +1 or -1 each), by one linear solve.

    displacement: u(radii[j], points[i]). free: tangential displacement with no force at the end of the step;
    compliance: its fall per unit share mobilised, inertia over the step; zero for a given path.
    """
    n = radii.size
    edge = radii[n - 1]
    # A ring of slip at the edge, all one way, carries the whole limit: c = 0, ..., 0, +-1 there, nothing to solve.
    ring = n
    while ring > 0 and state[ring - 1] != STICK and state[ring - 1] == state[n - 1]:
        ring -= 1
    shares_out[ring:n] = 0.0
    held = 0.0
    if ring < n:
        shares_out[n - 1] = held = state[n - 1]
    matrix = np.zeros((ring, ring))
    scale = 1.0 / (edge * edge + compliance)
    for i in range(ring):
        if state[i] == STICK:
            for j in range(ring):
                matrix[i, j] = scale * (displacement[i, j] + compliance * (radii[j] / edge) ** 3)
            shares_out[i] = scale * (free - locked[i] - held * (displacement[i, n - 1] + compliance))
        else:
            for j in range(i, ring):
                matrix[i, j] = math.sqrt((radii[j] ** 2 - points[i] ** 2) / (edge * edge - points[i] ** 2))
            shares_out[i] = state[i] - held
    solve_in_place(matrix, shares_out[:ring])


@numba.njit(cache=True)
def corrected_guess(state, radii, points, displacement, locked, s, shares, slack, one_only, state_out) -> int:
    """Annuli whose guess fails its test, changed in state_out; returns their number.

    A stuck annulus above the limit starts to slip; a slipping one that moves against its traction sticks.
    """
    wrong = 0
    for i in range(radii.size):
        new = state[i]
        if state[i] == STICK:
            share = traction_share(radii, i, points[i], shares)
            if abs(share) > 1.0 + CAP_SLACK:
                new = 1 if share > 0.0 else -1
        else:
            slip = s - locked[i]
            for j in range(radii.size):
                slip -= shares[j] * displacement[i, j]
            if state[i] * slip < -slack:
                new = STICK
        state_out[i] = new
        if new != state[i]:
            wrong += 1
            if one_only:
                break
    return wrong


@numba.njit(cache=True)
def march(
    radius, dt, impulse, displacement_in, prescribed, psi_1, chi, boundaries, points,
    psi_out, force_share_out, traction_out, stuck_out, corrections_out, energy_out,
):  # fmt: skip
    """Follow a normal motion from instant to instant, along a displacement or with the body's momentum.

    Given, shape (n,): contact radius a, zero out of contact; length of the step that ends at each instant, and impulse
    of the whole normal force P over it; the displacement s, read only if prescribed. psi_1: velocity at first;
    boundaries b_j and points r_j < b_j, shape (N,). Found: tangential velocity, share mobilised F/(mu P), shape (n,);
    elastic traction q/mu at the points, and whether an annulus is covered and sticks, shape (n, N); corrections of the
    guess, -1 if they did not end; tangential kinetic energy over 2 chi plus elastic energy, of a path the latter alone.
    """
    total = points.size
    fixed = np.empty((total, total))
    for i in range(total):
        for j in range(total):
            fixed[i, j] = hertz_displacement(boundaries[j], points[i])
    moving = fixed.copy()
    radii = boundaries.copy()
    shares, locked = np.zeros(total), np.zeros(total)
    state, guess = np.zeros(total, dtype=np.int64), np.zeros(total, dtype=np.int64)
    slack = SLIP_SLACK * boundaries[-1] ** 2
    s = displacement_in[0] if prescribed else 0.0
    psi, share, loaded, covered = psi_1, 0.0, False, 0
    for k in range(radius.size):
        a, before, covered = radius[k], covered, 0
        while covered < total and a > points[covered] * (1.0 + EDGE):
            covered += 1
        state[covered:] = STICK
        n = covered
        if before > 0 and before < n:
            # A newly covered annulus is first guessed to do what its neighbour does.
            state[before:n] = state[before - 1]
        # The share is carried through the step as a straight line between its ends: exact for gross slip. Where there
        # is no contact (first and last instant), the value of the other end holds for the whole step.
        step, step_impulse = (dt[k], impulse[k]) if k > 0 else (0.0, 0.0)
        end_weight = (0.5 if loaded else 1.0) if n > 0 else 0.0
        if prescribed:
            free, compliance = displacement_in[k], 0.0
        else:
            compliance = chi * step_impulse * step * end_weight
            free = s + step * psi - chi * step_impulse * step * (1.0 - end_weight) * share
        if before > 0:  # back to the fixed boundary where the contact edge stood
            radii[before - 1], moving[:, before - 1] = boundaries[before - 1], fixed[:, before - 1]
        corrections, new_share = 0, 0.0
        if n > 0:
            radii[n - 1] = a
            for i in range(total):
                moving[i, n - 1] = hertz_displacement(a, points[i])
            while True:
                trial_shares(state, radii[:n], points, moving, locked, free, compliance, shares[:n])
                new_share = 0.0
                for j in range(n):
                    new_share += shares[j] * (radii[j] / a) ** 3
                told = radii[:n], points, moving, locked, free - compliance * new_share, shares[:n], slack
                if not corrected_guess(state, *told, corrections >= JOINT_CORRECTIONS, guess):
                    break
                state[:n] = guess[:n]
                corrections += 1
                if corrections > ROUNDS_PER_ANNULUS * n:
                    corrections = -1
                    break
        shares[n:] = 0.0
        if prescribed:
            s = displacement_in[k]
        else:
            mean_share = end_weight * new_share + (1.0 - end_weight) * share
            psi_end = psi - 2.0 * chi * step_impulse * mean_share
            s += 0.5 * step * (psi + psi_end)
            psi = psi_end
        share, loaded = new_share, n > 0
        for i in range(total):
            if i < n:
                limit = 2.0 / math.pi * math.sqrt(a * a - points[i] ** 2)
                traction_out[k, i] = traction_share(radii[:n], i, points[i], shares[:n]) * limit
                stuck_out[k, i] = state[i] == STICK
            if not stuck_out[k, i]:
                locked[i] = s
                for j in range(n):
                    locked[i] -= shares[j] * moving[i, j]
        psi_out[k], force_share_out[k], corrections_out[k] = psi, share, corrections
        energy_out[k] = stored_energy(shares[:n], radii[:n]) + (0.0 if prescribed else psi * psi / (4.0 * chi))
        if corrections < 0:
            break
