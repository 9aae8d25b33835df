"""`MicroslipTurning`, a law for slides that turn: the springs of microslip with Coulomb's limit on the surface.

    pair = ContactPair(steel, steel, friction=0.1, law=MicroslipTurning())

On a straight slide |q| <= mu p on the line and |tau| <= mu p on the surface are the same condition (method of
dimensionality reduction). If tractions have different directions, only the second is Coulomb's law. Abel's transform
gives the forces on rings of the surface, which end at radii r_j, from the tractions q on the line, constant within
cells that end at c_i = w_1 + .. + w_i (Popov & Hess 2015, section 17):

    f = B q      B_ji = H_i(r_(j-1)) - H_i(r_j)      H_i(r) = 2 [sqrt(c_i^2 - r^2) - sqrt(c_(i-1)^2 - r^2)]

B is constant, and upper triangular with c_j <= r_j < c_(j+1). The energy of the springs, the sum of w q^2/G*, gives
the compliance between rings, A = C^T diag(2 w) C, C = B^-1. A step displaces all nodes, which gives q*. It then finds f
with |f_j| <= P_j = (B mu p)_j such that each ring on its limit slips, by r = A (B q* - f), along its traction, the mean
of before and after. If the few sweeps of the iteration leave tractions with which the step would create energy, these
are moved back until it does not.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import exp, inf, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contactlaw.jit import jit, jit_inline, jit_of_sums
from contactlaw.laws.microslip import Microslip, displace, keeps_sliding
from contactlaw.laws.nodes import levers, step_of
from contactlaw.laws.record import record_of
from contactlaw.laws.slip import carried, slipped_along_mean

TURN = 1e-3  # sine, or share of the limit: tractions out of line by less count as straight; error 1e-4 mu P
BEYOND = 0.15  # distance of r_j from c_j, where the surface traction is infinite, in cells. 0.1 to 0.25 do as well
TOLERANCE, MOST_SWEEPS = 0.0075, 12  # change of the rings' forces in the last sweep, over that of a stuck contact
NEAR = 0.8  # a force whose square is above this share of the limit's counts as on the limit at the step's start

# Rows of the array of nodes: limit; traction without slip, and new traction, along both tangents.
CAP, FREE_U, FREE_V, NEW_U, NEW_V = range(5)
# Rows of the array of rings: limit; force now, force before, and force if this ring alone were stuck.
LIMIT, FORCE_U, FORCE_V, BEFORE_U, BEFORE_V, STUCK_U, STUCK_V = range(7)


def cells(count: int) -> tuple[NDArray[Any], NDArray[Any]]:
    """Positions and widths of cells on [0, 1] that end at x = sin of equal steps of an angle: narrow where slip begins.

    x^2 is its mean over the cell, so that the limits sum to mu P. Gauss nodes are not in the middle of cells as wide as
    their weights: with slip in a tenth of the radius, the loss in a turn was off by 12 %.
    """
    ends = np.sin(np.linspace(0.0, 0.5 * np.pi, count + 1))
    return np.sqrt((ends[1:] ** 2 + ends[1:] * ends[:-1] + ends[:-1] ** 2) / 3.0), np.diff(ends)


@lru_cache(maxsize=64)
def surface_maps(weights: tuple[float, ...]) -> dict[str, NDArray[Any]]:
    """B; C; and, over the diagonal of A, C^T diag(2 w) by rows and A without its diagonal by columns; (n, n) each."""
    w = np.array(weights)
    ends = np.concatenate([[0.0], np.cumsum(w)])
    rims = ends + np.concatenate([[0.0], BEYOND * w[1:], [0.0]])
    within = 2.0 * np.sqrt(np.maximum(ends**2 - rims[:, None] ** 2, 0.0))
    b = np.triu(-np.diff(np.diff(within), axis=0))
    c = np.triu(np.linalg.inv(b))
    a = c.T @ (2.0 * w[:, None] * c)
    own = np.diag(a)
    return {"surface": b, "line": c, "slip": 2.0 * w * c.T / own[:, None], "follow": a / own - np.eye(w.size)}


@jit_inline
def on_a_line(contact, memory, du, dv):
    """Return whether force, displacement and the traction of the centre are on one line, within `TURN`."""
    f, g, u, v = contact.f, contact.g, memory[0, 0], memory[1, 0]
    if f == 0.0 and g == 0.0:
        f, g = u, v
    square, step, middle = f * f + g * g, f * dv - g * du, f * v - g * u
    narrow = TURN * TURN * square
    return step * step <= narrow * (du * du + dv * dv) and middle * middle <= narrow * (u * u + v * v)


@jit_of_sums
def fans_out(law, memory, s2, overlap, before, gu, gv, cap):
    """Return whether displaced nodes have tractions in different directions and some must slip; see `displace`."""
    rate = 1.0 / (overlap - before) if overlap > before else 1e300
    uu, uv, vv, load, most = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(law.w.size):
        z = max(overlap - s2 * law.x2[i], 0.0)
        part = min(z * rate, 1.0)
        u, v = memory[0, i] + part * gu, memory[1, i] + part * gv
        most = max(most, u * u + v * v - cap * cap * z * z)
        uu += law.w[i] * u * u
        uv += law.w[i] * u * v
        vv += law.w[i] * v * v
        load += law.w[i] * z
    return min(most, load) > 0.0 and uu * vv - uv * uv > (TURN * cap * load) ** 2 * (uu + vv)


@jit
def returned(x, y, limit, before_u, before_v):
    """Return the force (x, y) of a ring if it stuck, outside its limit, to the limit; before: at the start of the step.

    Slip is along the mean of the forces before and after. If the ring has just reached its limit, or the step is long
    compared with the limit, the force moves straight to the limit instead, then as that of a dragged spring along a
    tractrix: tan(angle/2) falls by exp(-way/limit).
    """
    square = limit * limit
    over, along = x * x + y * y - square, square + x * before_u + y * before_v
    if before_u * before_u + before_v * before_v > NEAR * square and over < 0.6 * square and along > 1.5 * square:
        return slipped_along_mean(x, y, before_u, before_v, along, over)
    way_x, way_y = x - before_u, y - before_v
    way = sqrt(way_x * way_x + way_y * way_y)
    if limit == 0.0 or way == 0.0:
        return before_u, before_v
    inward, across = (before_u * way_x + before_v * way_y) / way, (before_v * way_x - before_u * way_y) / way
    reach = sqrt(max(square - across * across, 0.0))
    half = across / (limit + reach) * exp(-max(way - reach + inward, 0.0) / limit)
    scale = limit / ((1.0 + half * half) * way)
    x, y = (1.0 - half * half) * scale, 2.0 * half * scale
    return x * way_x - y * way_y, x * way_y + y * way_x


@jit_of_sums
def displace_on_surface(law, memory, s2, overlap, before, gu, gv, cap):
    """`microslip.displace`, with the same arguments and results, under Coulomb's limit on the surface.

    The limits of the springs give the first guess. Then rings are returned to their limits from the edge inwards
    (Gauss-Seidel), to a smaller tolerance if the step would create energy.
    """
    n = memory.shape[1]  # not law.w.size, a constant: the compiler would unroll these loops and not vectorise them
    rate = 1.0 / (overlap - before) if overlap > before else 1e300
    node, ring = np.empty((5, n)), np.zeros((7, n))
    load, active, pull_u, pull_v, dissipated = 0.0, 0, 0.0, 0.0, 0.0
    for i in range(n):
        z = max(overlap - s2 * law.x2[i], 0.0)
        part = min(z * rate, 1.0)
        u, v = memory[0, i] + part * gu, memory[1, i] + part * gv
        back = min(cap * z / sqrt(u * u + v * v + 1e-300), 1.0)
        node[CAP, i] = cap * z
        node[FREE_U, i], node[FREE_V, i], node[NEW_U, i], node[NEW_V, i] = u, v, back * u, back * v
        load += law.w[i] * z
        active += z > 0.0
    for j in range(active):
        limit, fu, fv, before_u, before_v, out_u, out_v = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for i in range(n):
            b, slip = law.surface[j, i], law.slip[j, i]
            limit += b * node[CAP, i]
            fu += b * node[NEW_U, i]
            fv += b * node[NEW_V, i]
            before_u += b * memory[0, i]
            before_v += b * memory[1, i]
            out_u += slip * (node[FREE_U, i] - node[NEW_U, i])
            out_v += slip * (node[FREE_V, i] - node[NEW_V, i])
        limit, square = max(limit, 0.0), before_u * before_u + before_v * before_v
        onto = limit / sqrt(square) if square > NEAR * limit * limit else 1.0
        ring[LIMIT, j], ring[FORCE_U, j], ring[FORCE_V, j] = limit, fu, fv
        ring[BEFORE_U, j], ring[BEFORE_V, j] = onto * before_u, onto * before_v
        ring[STUCK_U, j], ring[STUCK_V, j] = fu + out_u, fv + out_v
    tolerance = 2.0 * TOLERANCE * sqrt((gu * gu + gv * gv) * overlap / s2)
    for _ in range(3):
        dissipated = set_springs(law, memory, node, ring, relax(law, ring, active, tolerance))
        if dissipated >= 0.0:
            break
        tolerance *= 1e-3
    if dissipated < 0.0 and (overlap >= before or tolerance == 0.0):  # else the mean force does not give the work
        pull_back(law, memory, node, dissipated, 1.0 if overlap >= before else 0.0)
    for i in range(n):
        memory[0, i], memory[1, i] = node[NEW_U, i], node[NEW_V, i]
        pull_u += law.w[i] * node[NEW_U, i]
        pull_v += law.w[i] * node[NEW_V, i]
    within = min(cap * load / sqrt(pull_u * pull_u + pull_v * pull_v + 1e-300), 1.0)
    return within * pull_u, within * pull_v


@jit_of_sums
def relax(law, ring, active, tolerance):
    """Return rings to their limits until a sweep changes their forces by no more than `tolerance` [N/m].

    Returns the innermost ring that slips; springs further in stick.
    """
    n, inner = ring.shape[1], active
    for _ in range(MOST_SWEEPS):
        change, inner = 0.0, active
        for i in range(active - 1, -1, -1):
            u, v, limit = ring[STUCK_U, i], ring[STUCK_V, i], ring[LIMIT, i]
            if u * u + v * v > limit * limit:
                inner = i
                u, v = returned(u, v, limit, ring[BEFORE_U, i], ring[BEFORE_V, i])
            by_u, by_v = u - ring[FORCE_U, i], v - ring[FORCE_V, i]
            by = sqrt(by_u * by_u + by_v * by_v)
            if by > 0.03 * tolerance:
                change += by
                ring[FORCE_U, i], ring[FORCE_V, i] = u, v
                for j in range(n):
                    ring[STUCK_U, j] -= law.follow[i, j] * by_u
                    ring[STUCK_V, j] -= law.follow[i, j] * by_v
        if change <= tolerance:
            break
    return inner


@jit_of_sums
def set_springs(law, memory, node, ring, inner):
    """Set the tractions of springs from ring `inner` outwards by the rings' forces; return the dissipation times G*."""
    n, dissipated = ring.shape[1], 0.0
    for i in range(inner, n):
        u, v = 0.0, 0.0
        for j in range(n):
            u += law.line[i, j] * ring[FORCE_U, j]
            v += law.line[i, j] * ring[FORCE_V, j]
        node[NEW_U, i], node[NEW_V, i] = u, v
        dissipated += law.w[i] * (
            (memory[0, i] + u) * (node[FREE_U, i] - u) + (memory[1, i] + v) * (node[FREE_V, i] - v)
        )
    for i in range(inner):
        node[NEW_U, i], node[NEW_V, i] = node[FREE_U, i], node[FREE_V, i]
    return dissipated


@jit_of_sums
def pull_back(law, memory, node, dissipated, turned):
    """Move tractions whose dissipation is negative towards the reversed ones of the start (turned = 1) or zero (0).

    Zero: the load falls, in a step without displacement.
    """
    n, both = memory.shape[1], 1e-300
    for i in range(n):
        u, v = node[NEW_U, i] + turned * memory[0, i], node[NEW_V, i] + turned * memory[1, i]
        both += law.w[i] * (u * u + v * v)
    share = max(1.0 + dissipated / both, 0.0)
    share = share if turned > 0.0 else sqrt(share)
    for i in range(n):
        u, v = turned * memory[0, i], turned * memory[1, i]
        node[NEW_U, i], node[NEW_V, i] = share * (node[NEW_U, i] + u) - u, share * (node[NEW_V, i] + v) - v


@dataclass(frozen=True)
class MicroslipTurning(Microslip):
    """`Microslip` that is also right for slides that turn, at five times the cost there and none elsewhere.

    It is not in `LAWS`: in a crowd nearly every slide turns.
    """

    name = "microslip_turning"
    source = "rings with local Coulomb friction by Abel's transform: the docstring of this file"
    rung = inf
    nodes = 16  # the cost of a sweep grows with their square

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.shear_loss:
            raise ValueError("shear_loss = True: must be False here, slides that turn have no losses in shear")

    def numbers(self) -> NDArray[Any]:
        """Return positions of the nodes on [0, 1], their squares and weights, and the maps between line and surface."""
        x, w = cells(self.memory)
        # The maps first: numba takes a record that begins as another one for its subtype, and warns of that.
        return record_of(**surface_maps(tuple(w)), x=x, x2=x * x, w=w)

    @staticmethod
    def force(contact, law, memory, du, dv, dt):
        """Force of `Microslip`, but with the limit on the surface if tractions differ in direction."""
        if keeps_sliding(contact, law, memory, du, dv):
            return contact.f, contact.g
        share, lever = levers(contact, law)
        step = step_of(contact, lever * du, lever * dv)
        # Two returns: with a common one the compiler would sum `displace` in another order.
        if not on_a_line(contact, memory, du, dv) and fans_out(law, memory, *step):
            pull_u, pull_v = displace_on_surface(law, memory, *step)
            return carried(contact, pull_u * share, pull_v * share)
        pull_u, pull_v = displace(law, memory, *step)
        return carried(contact, pull_u * share, pull_v * share)
