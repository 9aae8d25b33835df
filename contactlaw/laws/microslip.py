"""Microslip: springs with a Coulomb limit each, at Gauss-Legendre points of half the contact line.

    p(x) = E* (delta - x^2/R)      dq = G* ds, |q| <= mu p      (method of dimensionality reduction)

The nodes span a fixed radius, over which the contact grows and shrinks. Few nodes suffice for three reasons. A node
that comes into contact within a step takes part in the displacement from that instant only. The force is mu P times the
sum of the tractions over the sum of the limits, so that a contact that slips everywhere carries exactly mu P. The
limits are those of the exact pressure (scaling the limits instead gives ten times the error with 8 nodes).
The factor on the force also multiplies the displacement of the nodes (`nodes.levers`). So the work of the contact is
that of the nodes, whose energy no change of load increases: the law creates no energy on any path with any steps.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from math import sqrt
from numbers import Real
from types import ModuleType
from typing import Any, ClassVar, Self

import numpy as np

from contactlaw import checks
from contactlaw.jit import jit_inline, jit_of_sums
from contactlaw.laws import microslip_line, whole_impacts
from contactlaw.laws.base import MOST_VECTORS, Array, Impacts, Law
from contactlaw.laws.ellipse import force_on_ellipse
from contactlaw.laws.nodes import follow, levers, step_of
from contactlaw.laws.record import LASTING, OPEN, SLIDING, SPRUNG, UNSHEARED, record_of
from contactlaw.laws.shear_loss import displace_viscous, loads, retardation
from contactlaw.laws.slip import AT_LIMIT, STRAIGHT, carried, slides_on, sliding_direction

NODES = 24  # default in engines: psi_2 within 5e-4 at any step; fills SIMD vectors, so hardly slower than 16
# tangent of the angle between slip and force up to which tractions count as of one direction; measured: the force is
# then within 2.1e-3 mu P of that with nodes
TURN = 0.02
LAG = 0.8  # depth over that of the middle, to whose node that direction belongs: mean of z^2 over that of z
NEARLY = 1.0 - 1e-4  # square of a friction force over that of its limit from which directions may count as one


@dataclass(frozen=True)
class Microslip(Law):
    """Springs along the contact line, each with its own Coulomb limit: part of the contact slips, the rest sticks.

    Attributes:
        node_count: Gauss-Legendre nodes on half the line. None: motion along a line is solved in closed form
            (`collide`, `force_along_path`); otherwise there are 24, or a number by chi where it is known (`rebound`).
        shear_loss: Whether shear dissipates energy as compression does (`laws.shear_loss`), a property of the material.
    """

    name = "microslip"
    source = "method of dimensionality reduction: Popov & Hess (2015); Lyashenko & Popov, Tech. Phys. Lett. 41 (2015)"
    rung = 4
    nodes: ClassVar[int] = NODES
    node_count: int | None = None
    shear_loss: bool = False

    def __post_init__(self) -> None:
        if not (isinstance(self.shear_loss, np.bool_ | Real) and self.shear_loss in (0, 1)):
            raise ValueError(f"shear_loss = {self.shear_loss!r}: must be 0 or 1")
        object.__setattr__(self, "shear_loss", int(self.shear_loss))  # a law's fields are numbers
        if self.node_count is not None:
            checks.count("node_count", self.node_count, 2, MOST_VECTORS)

    @property
    def memory(self) -> int:
        """Number of vectors, one traction a node."""
        return self.node_count or self.nodes

    @property
    def sectors(self) -> bool:
        """Whether `laws.sectors` may replace the law: without losses in shear."""
        return not self.shear_loss

    def with_nodes(self, suggested: int | None) -> Self:
        """Return the law with its own number of nodes, else the suggested, else the default."""
        return replace(self, node_count=self.node_count or suggested or self.nodes)

    def numbers(self) -> Array:
        """Return the positions of the nodes on [0, 1], their squares, and their weights."""
        x, w = half_line_nodes(self.memory)
        return record_of(x=x, x2=x * x, w=w)

    @staticmethod
    def force(contact, law, memory, du, dv, dt):
        """Displace all nodes and sum their tractions, both scaled by P over the load of the nodes."""
        if contact.skew != 0.0:
            return force_on_ellipse(contact, law, memory, du, dv)
        if (dt > 0.0 and keeps_turning(contact, du, dv)) or keeps_sliding(contact, law, memory, du, dv):
            return contact.f, contact.g
        share, lever = levers(contact, law)
        pull_u, pull_v = displace(law, memory, *step_of(contact, lever * du, lever * dv))
        f, g = pull_u * share, pull_v * share
        square, most = f * f + g * g, (contact.friction * contact.elastic) ** 2
        if dt > 0.0:
            straight = abs(dv * f - du * g) <= TURN * (du * f + dv * g)
            slides = straight and square >= NEARLY * most and all_slip(law, memory, *step_of(contact, 0.0, 0.0))
        else:
            slides = contact.course == LASTING and square >= AT_LIMIT * most
        if slides:
            contact.state, contact.slid_limit = SLIDING, contact.friction * contact.e_star
        return carried(contact, f, g)

    @staticmethod
    def energy(contact, law, memory):
        """Integral of q^2/G* over half the line; q = mu p everywhere in a contact that slides as a whole."""
        if contact.overlap <= 0.0 or contact.state == UNSHEARED:
            return 0.0
        if contact.state == SLIDING:
            limit = contact.friction * contact.elastic
            return 0.3 * limit * limit / (contact.g_star * sqrt(contact.radius * contact.overlap))
        total = 0.0
        for i in range(law.w.size):
            total += law.w[i] * ((1.0 + contact.skew) * memory[0, i] ** 2 + (1.0 - contact.skew) * memory[1, i] ** 2)
        return contact.scale * total / contact.g_star

    def functions(self) -> tuple[Callable[..., Any], ...]:
        """Return force (with or without losses in shear), stiffness and energy."""
        return self.lossy_force if self.shear_loss else self.force, self.stiffness, self.energy

    @staticmethod
    def lossy_force(contact, law, memory, du, dv, dt):
        """`force` with losses in shear; the limits alone are scaled, so that they sum to mu times the whole P."""
        if keeps_sliding(contact, law, memory, du, dv):
            return contact.f, contact.g
        lag, thrust, late_u, late_v = retardation(contact, dt)
        known = law, memory, *step_of(contact, du, dv)
        load = loads(law, known[2], contact.overlap, thrust)
        if load <= 0.0:
            return 0.0, 0.0
        share = contact.force / (2.0 * contact.scale * contact.e_star * load)
        pull_u, pull_v = displace_viscous(*known, (lag, thrust, share, late_u, late_v))
        return 2.0 * contact.scale * pull_u, 2.0 * contact.scale * pull_v

    def impacts(self, zeta: float, steps: int) -> Impacts | None:
        """Integrate in scaled variables, eight impacts at a time (`whole_impacts`); None with losses in shear."""
        if self.shear_loss and zeta > 0.0:
            return None
        return whole_impacts.impacts(zeta, steps, *half_line_nodes(self.memory))

    @property
    def on_line(self) -> ModuleType | None:
        """`microslip_line` if the number of nodes is left open and shear has no losses."""
        return microslip_line if self.node_count is None and not self.shear_loss else None


@lru_cache(maxsize=64)
def half_line_nodes(count: int) -> tuple[Array, Array]:
    """Gauss-Legendre abscissae and weights on [0, 1]."""
    x, w = np.polynomial.legendre.leggauss(count)
    return 0.5 * (x + 1.0), 0.5 * w


@jit_of_sums
def displace(law, memory, s2, overlap, before, gu, gv, cap):
    """Displace all nodes and return the weighted sums of their tractions along both tangents [N/m].

    Arguments: see `nodes.step_of`. The loop has no branch, so that it vectorises: a node out of contact has no load,
    hence a limit of zero and no traction.
    """
    gained = overlap - before
    rate = 1.0 / gained if gained > 0.0 else 1e300
    pull_u, pull_v = 0.0, 0.0
    for i in range(law.w.size):
        z = max(overlap - s2 * law.x2[i], 0.0)
        part = min(z * rate, 1.0)
        u = memory[0, i] + part * gu
        v = memory[1, i] + part * gv
        back = min(cap * z / sqrt(u * u + v * v + 1e-300), 1.0)
        u *= back
        v *= back
        memory[0, i] = u
        memory[1, i] = v
        pull_u += law.w[i] * u
        pull_v += law.w[i] * v
    return pull_u, pull_v


@jit_of_sums
def all_slip(law, memory, s2, overlap, _before, _gu, _gv, cap):
    """Return whether all nodes are on their limits; arguments: `nodes.step_of`."""
    least = 1.0
    for i in range(law.w.size):
        limit = cap * max(overlap - s2 * law.x2[i], 0.0)
        least = min(least, memory[0, i] ** 2 + memory[1, i] ** 2 - AT_LIMIT * limit * limit)
    return least >= 0.0


@jit_inline
def keeps_turning(contact, du, dv):
    """Return whether a contact that slides as a whole does so after a slight turn; contact.f and .g are then set.

    With tractions of one direction e and slip d = (x, y) along and across e, G* x >= mu E* times the growth of the
    overlap, every node goes on to slip, and its new direction is that of mu E* z e + G* d. Nodes at different depths z
    lag behind a steady turn by angles proportional to z, so the force lags by the mean of z^2 over that of z. The sum
    dissipates energy as each node does.
    """
    old = sqrt(contact.f * contact.f + contact.g * contact.g)
    if contact.state != SLIDING or old == 0.0 or contact.before < 0.0:
        return False
    limit = contact.friction * contact.e_star
    if contact.course == LASTING and contact.slid_limit < limit:  # springs stretch, see `keeps_sliding`
        return False
    e, n = contact.f / old, contact.g / old
    x, y = contact.g_star * (du * e + dv * n), contact.g_star * (dv * e - du * n)
    if abs(y) > TURN * x or abs(y) <= STRAIGHT * x or x < limit * (contact.overlap - contact.before):
        return False
    ahead = LAG * limit * contact.before + x
    force = contact.friction * contact.force / sqrt(ahead * ahead + y * y)
    contact.f, contact.g = force * (ahead * e - y * n), force * (ahead * n + y * e)
    contact.slid_limit = limit
    return True


@jit_inline
def keeps_sliding(contact, law, memory, du, dv):
    """Return whether the contact slides on as a whole, or was never sheared; contact.f and contact.g are then set.

    Otherwise the nodes span the contact and, after a slide, hold its tractions. Where the limit grows, springs of a
    persistent contact must stretch before they slide on.
    """
    follow(contact, law, memory)
    if du == 0.0 == dv and (contact.state == OPEN or contact.state == UNSHEARED):
        contact.state = UNSHEARED
        contact.f, contact.g = 0.0, 0.0
        return True
    limit = contact.friction * contact.e_star
    stretches = contact.state == SLIDING and contact.course == LASTING and contact.slid_limit < limit
    if contact.state < SPRUNG and not stretches and slides_on(contact, du, dv, 0.0):
        contact.slid_limit = limit
        return True
    if contact.state == SLIDING:
        x, y = sliding_direction(contact)
        mu_e, start = contact.slid_limit, max(contact.before, 0.0)
        s2 = contact.scale * contact.scale / contact.radius
        for i in range(law.w.size):
            cap = mu_e * max(start - s2 * law.x2[i], 0.0)
            memory[0, i], memory[1, i] = cap * x, cap * y
    contact.state = SPRUNG
    return False
