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

from dataclasses import dataclass
from functools import lru_cache
from math import exp, inf, sqrt
from typing import Any, NamedTuple

import numpy as np

from contactlaw.jit import jit, jit_inline, jit_module, jit_of_sums
from contactlaw.laws.base import Array
from contactlaw.laws.ellipse import force_on_ellipse
from contactlaw.laws.microslip import Microslip, displace, keeps_sliding
from contactlaw.laws.nodes import levers, step_of
from contactlaw.laws.record import record_of
from contactlaw.laws.slip import carried, slipped_along_mean

TURN = 1e-3  # sine, or share of the limit: tractions out of line by less count as straight; error 1e-4 mu P
BEYOND = 0.15  # distance of r_j from c_j, where the surface traction is infinite, in cells. 0.1 to 0.25 do as well
TOLERANCE, MOST_SWEEPS = 0.0075, 12  # change of the rings' forces in the last sweep, over that of a stuck contact
NEAR = 0.8  # a force whose square is above this share of the limit's counts as on the limit at the step's start


class Springs(NamedTuple):
    """Limits of the springs, shape (n,); tractions without slip, and new ones, shape (2, n)."""

    limit: Array
    free: Array
    new: Array


class Rings(NamedTuple):
    """Limits of the rings, shape (n,); forces now, before, and if this ring alone were stuck, shape (2, n)."""

    limit: Array
    force: Array
    before: Array
    stuck: Array


def cells(count: int) -> tuple[Array, Array]:
    """Positions and widths of cells on [0, 1] that end at x = sin of equal steps of an angle: narrow where slip begins.

    x^2 is its mean over the cell, so that the limits sum to mu P. (Gauss nodes are not in the middle of cells as wide
    as their weights: with slip in a tenth of the radius, the loss in a turn was off by 12 %.)
    """
    ends = np.sin(np.linspace(0.0, 0.5 * np.pi, count + 1))
    return np.sqrt((ends[1:] ** 2 + ends[1:] * ends[:-1] + ends[:-1] ** 2) / 3.0), np.diff(ends)


@lru_cache(maxsize=64)
def surface_maps(weights: tuple[float, ...]) -> dict[str, Any]:
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


def displace_on_surface(law, memory, s2, overlap, before, gu, gv, cap):
    """`microslip.displace`, with the same arguments and results, under Coulomb's limit on the surface.

    The first guess is by the limits of the springs; the tolerance is smaller if the step would create energy.
    """
    n = memory.shape[1]  # not law.w.size, a constant: the compiler would unroll these loops and not vectorise them
    rate = 1.0 / (overlap - before) if overlap > before else 1e300
    room = np.empty((5, n))
    most, free, new = springs = Springs(room[0], room[1:3], room[3:5])
    load, active, pull_u, pull_v, dissipated = 0.0, 0, 0.0, 0.0, 0.0
    for i in range(n):
        z = max(overlap - s2 * law.x2[i], 0.0)
        part = min(z * rate, 1.0)
        u, v = memory[0, i] + part * gu, memory[1, i] + part * gv
        back = min(cap * z / sqrt(u * u + v * v + 1e-300), 1.0)
        most[i], free[0, i], free[1, i] = cap * z, u, v
        new[0, i], new[1, i] = back * u, back * v
        load += law.w[i] * z
        active += z > 0.0
    rings = rings_of(law, memory, springs, active)
    tolerance = 2.0 * TOLERANCE * sqrt((gu * gu + gv * gv) * overlap / s2)
    for _ in range(3):
        dissipated = set_springs(law, memory, springs, rings, relax(law, rings, active, tolerance))
        if dissipated >= 0.0:
            break
        tolerance *= 1e-3
    if dissipated < 0.0 and (overlap >= before or tolerance == 0.0):  # else the mean force does not give the work
        pull_back(law, memory, springs, dissipated, 1.0 if overlap >= before else 0.0)
    for i in range(n):
        memory[0, i], memory[1, i] = u, v = new[0, i], new[1, i]
        pull_u += law.w[i] * u
        pull_v += law.w[i] * v
    within = min(cap * load / sqrt(pull_u * pull_u + pull_v * pull_v + 1e-300), 1.0)
    return within * pull_u, within * pull_v


def rings_of(law, memory, springs, active):
    """Rings of the tractions of springs; only `active` ones are in contact."""
    n, room = memory.shape[1], np.zeros((7, memory.shape[1]))
    rings, (most, free, new) = Rings(room[0], room[1:3], room[3:5], room[5:7]), springs
    for j in range(active):
        limit, fu, fv, before_u, before_v, out_u, out_v = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for i in range(n):
            b, slip = law.surface[j, i], law.slip[j, i]
            limit += b * most[i]
            fu += b * new[0, i]
            fv += b * new[1, i]
            before_u += b * memory[0, i]
            before_v += b * memory[1, i]
            out_u += slip * (free[0, i] - new[0, i])
            out_v += slip * (free[1, i] - new[1, i])
        limit, square = max(limit, 0.0), before_u * before_u + before_v * before_v
        onto = limit / sqrt(square) if square > NEAR * limit * limit else 1.0
        rings.limit[j], rings.force[0, j], rings.force[1, j] = limit, fu, fv
        rings.before[0, j], rings.before[1, j] = onto * before_u, onto * before_v
        rings.stuck[0, j], rings.stuck[1, j] = fu + out_u, fv + out_v
    return rings


def relax(law, rings, active, tolerance):
    """Return rings to their limits, from the edge inwards, until a sweep changes their forces by `tolerance` [N/m].

    Returns the innermost ring that slips; springs further in stick.
    """
    (most, force, before, stuck), inner = rings, active
    n = most.size
    for _ in range(MOST_SWEEPS):
        change, inner = 0.0, active
        for i in range(active - 1, -1, -1):
            u, v, limit = stuck[0, i], stuck[1, i], most[i]
            if u * u + v * v > limit * limit:
                inner = i
                u, v = returned(u, v, limit, before[0, i], before[1, i])
            by_u, by_v = u - force[0, i], v - force[1, i]
            by = sqrt(by_u * by_u + by_v * by_v)
            if by > 0.03 * tolerance:
                change += by
                force[0, i], force[1, i] = u, v
                for j in range(n):
                    stuck[0, j] -= law.follow[i, j] * by_u
                    stuck[1, j] -= law.follow[i, j] * by_v
        if change <= tolerance:
            break
    return inner


def set_springs(law, memory, springs, rings, inner):
    """Set the tractions of springs from ring `inner` outwards by the rings' forces; return the dissipation times G*."""
    (_, free, new), force, n, dissipated = springs, rings.force, memory.shape[1], 0.0
    for i in range(inner, n):
        u, v = 0.0, 0.0
        for j in range(n):
            u += law.line[i, j] * force[0, j]
            v += law.line[i, j] * force[1, j]
        new[0, i], new[1, i] = u, v
        dissipated += law.w[i] * ((memory[0, i] + u) * (free[0, i] - u) + (memory[1, i] + v) * (free[1, i] - v))
    for i in range(inner):
        new[0, i], new[1, i] = free[0, i], free[1, i]
    return dissipated


def pull_back(law, memory, springs, dissipated, turned):
    """Move tractions that dissipate less than zero towards the reversed ones of the start (turned = 1).

    turned = 0: towards zero, as the load falls in a step without displacement.
    """
    new, both = springs.new, 1e-300
    for i in range(memory.shape[1]):
        u, v = new[0, i] + turned * memory[0, i], new[1, i] + turned * memory[1, i]
        both += law.w[i] * (u * u + v * v)
    share = max(1.0 + dissipated / both, 0.0)
    share = share if turned > 0.0 else sqrt(share)
    for side in range(2):
        for i in range(memory.shape[1]):
            was = turned * memory[side, i]
            new[side, i] = share * (new[side, i] + was) - was


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

    def numbers(self) -> Array:
        """Return positions of the nodes on [0, 1], their squares and weights, and the maps between line and surface."""
        x, w = cells(self.memory)
        # The maps first: numba takes a record that begins as another one for its subtype, and warns of that.
        return record_of(**surface_maps(tuple(w)), x=x, x2=x * x, w=w)

    @staticmethod
    def force(contact, law, memory, du, dv, dt):
        """Force of `Microslip`, but with the limit on the surface if tractions on a circle differ in direction."""
        if contact.skew != 0.0:
            return force_on_ellipse(contact, law, memory, du, dv)
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


jit_module(__name__, jit_of_sums)
