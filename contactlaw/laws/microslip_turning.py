"""Microslip where the slide turns: the same springs, but Coulomb's limit on the surface instead of on the line.

On a straight slide |q| <= mu p on the line and |tau| <= mu p on the surface are one condition (method of dimensionality
reduction); where tractions have different directions only the second is friction's. Abel's transform takes the line's
tractions q, constant within cells that end at c_i = w_1 + .. + w_i, to the forces on rings of the surface, which end at
r_j (Popov & Hess 2015, section 17):

    f = B q      B_ji = H_i(r_(j-1)) - H_i(r_j)      H_i(r) = 2 [sqrt(c_i^2 - r^2) - sqrt(c_(i-1)^2 - r^2)]

B is constant, and upper triangular with c_j <= r_j < c_(j+1). The springs' energy, sum of w q^2/G*, makes A = C^T diag(2 w) C, C = B^-1, the
compliance between the rings. A step displaces all nodes, q*, then finds f, |f_j| <= P_j = (B mu p)_j, such that a ring
on its limit slips, r = A (B q* - f), along its traction, the mean of that before and after the step.
"""

from __future__ import annotations

from functools import lru_cache
from math import exp, sqrt

import numpy as np
from numpy.typing import NDArray

from contactlaw.jit import jit, jit_of_sums
from contactlaw.laws.slip import STRAIGHT

BEYOND = 0.15  # of the next cell: r_j beyond c_j, where the surface's traction is infinite. 0.1 to 0.25 are as good
ENOUGH = 0.01  # change of the rings' forces in a sweep, over that of the contact in the step if it stuck
MOST_SWEEPS = 12


@lru_cache(maxsize=64)
def half_line_nodes(count: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Gauss-Legendre abscissae and weights on [0, 1]."""
    x, w = np.polynomial.legendre.leggauss(count)
    return 0.5 * (x + 1.0), 0.5 * w


@lru_cache(maxsize=64)
def surface_maps(count: int) -> tuple[NDArray[np.float64], ...]:
    """B by columns, diag(2 w) C and A of so many nodes, (n, n) each."""
    _, w = half_line_nodes(count)
    ends, rims = np.concatenate([[0.0], np.cumsum(w)]), np.concatenate([[0.0], np.cumsum(w)])
    rims[1:-1] += BEYOND * w[1:]
    within = 2.0 * np.sqrt(np.maximum(ends**2 - rims[:, None] ** 2, 0.0))
    b = -np.diff(np.diff(within), axis=0)
    c = np.linalg.inv(b)
    return np.triu(b).T, np.triu(2.0 * w[:, None] * c), c.T @ (2.0 * w[:, None] * c)


@jit
def parallel(a, b, c, d):
    """Whether vectors (a, b) and (c, d) lie on one line, to `STRAIGHT`; one that is zero does."""
    across = a * d - b * c
    return across * across <= STRAIGHT * STRAIGHT * (a * a + b * b) * (c * c + d * d)


@jit_of_sums
def fans_out(law, memory, s2, overlap, before, gu, gv, cap):
    """Whether tractions lie on no one line once all nodes are displaced and some must slip; arguments: `displace`."""
    gained = overlap - before
    rate = 1.0 / gained if gained > 0.0 else 1e300
    uu, uv, vv, load, most = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(law.w.size):
        z = max(overlap - s2 * law.x2[i], 0.0)
        part = min(z * rate, 1.0)
        u = memory[0, i] + part * gu
        v = memory[1, i] + part * gv
        most = max(most, u * u + v * v - cap * cap * z * z)
        uu += law.w[i] * u * u
        uv += law.w[i] * u * v
        vv += law.w[i] * v * v
        load += law.w[i] * z
    across = STRAIGHT * cap * load
    return most > 0.0 and uu * vv - uv * uv > across * across * (uu + vv)


@jit
def returned(x, y, limit, before_x, before_y, before_limit):
    """A ring's force on its limit, from where it would be without (outside); before: at the start of the step.

    The slip along the mean of the tractions before and after needs no root; a ring that has just come to its limit, or
    a step that is long beside it, goes straight to the limit and then, as a spring that is dragged, along a tractrix:
    tan(angle/2) falls by exp(-way/limit).
    """
    if limit <= 0.0:
        return 0.0, 0.0
    size2, limit2, old2 = x * x + y * y, limit * limit, before_x * before_x + before_y * before_y
    if old2 >= before_limit * before_limit * (1.0 - 1e-6) or old2 > limit2:
        onto = limit / sqrt(old2 + 1e-300)
        before_x, before_y, old2 = before_x * onto, before_y * onto, limit2
        along = limit2 + x * before_x + y * before_y
        if size2 < 1.6 * limit2 and along > 1.5 * limit2:
            back = 0.5 * (size2 - limit2) / along
            return (x - back * before_x) / (1.0 + back), (y - back * before_y) / (1.0 + back)
    way_x, way_y = x - before_x, y - before_y
    way2 = way_x * way_x + way_y * way_y
    way = sqrt(way2)
    inward = (before_x * way_x + before_y * way_y) / way
    across = (before_y * way_x - before_x * way_y) / way
    reach = sqrt(max(limit2 - across * across, 0.0))  # along the way, from the middle of the chord to the limit
    half = across / (limit + reach + 1e-300) * exp(-max(way - reach + inward, 0.0) / limit)
    cosine, sine = (1.0 - half * half) / (1.0 + half * half), 2.0 * half / (1.0 + half * half)
    cosine, sine = limit * cosine / way, limit * sine / way
    return cosine * way_x - sine * way_y, cosine * way_y + sine * way_x


@jit_of_sums
def displace_on_surface(law, memory, s2, overlap, before, gu, gv, cap):
    """`microslip.displace`, with its arguments and results, by friction's limit on the surface.

    The springs' own limit makes the first guess; then rings are returned from the edge inwards (Gauss-Seidel), each
    knowing what those outside of it have slipped.
    """
    n, b, c, a = law.w.size, law.surface, law.line, law.compliance
    gained = overlap - before
    rate = 1.0 / gained if gained > 0.0 else 1e300
    ring = np.zeros((8, n))  # limit, force and slip; limit and force at the start of the step
    limit, fx, fy, rx, ry, old_limit, ox, oy = ring
    load = 0.0
    for i in range(n):
        z = max(overlap - s2 * law.x2[i], 0.0)
        p, old_p = cap * z, cap * max(before - s2 * law.x2[i], 0.0)
        part = min(z * rate, 1.0)
        old_u, old_v = memory[0, i], memory[1, i]
        u, v = old_u + part * gu, old_v + part * gv
        back = min(p / sqrt(u * u + v * v + 1e-300), 1.0)
        over_u, over_v = u - back * u, v - back * v
        u, v = back * u, back * v
        load += law.w[i] * z
        for j in range(n):
            limit[j] += b[i, j] * p
            old_limit[j] += b[i, j] * old_p
            fx[j] += b[i, j] * u
            fy[j] += b[i, j] * v
            ox[j] += b[i, j] * old_u
            oy[j] += b[i, j] * old_v
            rx[j] += c[i, j] * over_u
            ry[j] += c[i, j] * over_v
    enough = 2.0 * ENOUGH * sqrt((gu * gu + gv * gv) * overlap / s2)
    for _ in range(MOST_SWEEPS):
        change = 0.0
        for i in range(n - 1, -1, -1):
            x, y, top = fx[i] + rx[i] / a[i, i], fy[i] + ry[i] / a[i, i], max(limit[i], 0.0)
            if x * x + y * y > top * top:
                x, y = returned(x, y, top, ox[i], oy[i], old_limit[i])
            move_x, move_y = x - fx[i], y - fy[i]
            move = abs(move_x) + abs(move_y)
            if move > 0.03 * enough:
                change += move
                fx[i], fy[i] = x, y
                for j in range(n):
                    rx[j] -= a[i, j] * move_x
                    ry[j] -= a[i, j] * move_y
        if change <= enough:
            break
    pull_u, pull_v = 0.0, 0.0
    for i in range(n):
        u, v = 0.0, 0.0
        for j in range(i, n):
            u += c[i, j] * fx[j]
            v += c[i, j] * fy[j]
        u, v = 0.5 * u / law.w[i], 0.5 * v / law.w[i]
        memory[0, i], memory[1, i] = u, v
        pull_u += law.w[i] * u
        pull_v += law.w[i] * v
    return pull_u, pull_v, load
