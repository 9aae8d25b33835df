"""Nodes along the contact line, each with a traction: loads and displacements in a step, and their span."""

from math import sqrt

from contactlaw.jit import jit, jit_inline, jit_of_sums
from contactlaw.laws.record import OPEN, SPRUNG
from contactlaw.laws.slip import span_of


@jit_inline
def step_of(contact, du, dv):
    """Return s2, overlap, before, gu, gv, cap of a displacement (du, dv) [m], the arguments of `microslip.displace`.

    s2: square of the span over R [m]. gu, gv: G* times the displacement [N/m]. cap: mu E* [Pa].
    """
    s2, g_star = contact.scale * contact.scale / contact.radius, contact.g_star
    return s2, contact.overlap, contact.before, g_star * du, g_star * dv, contact.friction * contact.e_star


@jit_of_sums
def levers(contact, law):
    """Factor [m] from the sum of the nodes' tractions to the force, and factor from the displacement to the nodes'.

    Both are P over the load of the nodes, so that their work is that of the contact. While the contact grows, the
    second is a mean over the step, as loads of single nodes have kinks in time and P has none.
    """
    s2, overlap = contact.scale * contact.scale / contact.radius, contact.overlap
    gained = max(overlap - max(contact.before, 0.0), 1e-15 * overlap)
    load, more = 1e-200, 1e-200
    for i in range(law.w.size):
        z = max(overlap - s2 * law.x2[i], 0.0)
        new = min(z, gained)
        load += law.w[i] * z
        more += law.w[i] * new * (z - 0.5 * new)
    y, whole = gained / overlap, contact.elastic / contact.e_star
    # (1 - (1 - y)^2.5)/(2.5 y) within 1e-3, and exact for long and for short steps
    mean = 1.0 - y * (0.75 - y * (0.125 + y * (0.015625 + 0.0046875 * y * (1.0 + y))))
    return whole / load, 0.5 * whole * mean * gained / (more * contact.scale)


@jit
def follow(contact, law, memory):
    """Adapt the span of the nodes to the contact; at the touch it is the radius at the reach of the contact."""
    if contact.state == OPEN:
        contact.scale = sqrt(contact.radius * contact.reach)
        return
    span = span_of(contact, contact.scale)
    if span != contact.scale and contact.state == SPRUNG:
        regrid(contact, law, memory, span)
    contact.scale = span


@jit
def regrid(contact, law, memory, new_span):
    """Interpolate the tractions to nodes of another span [m], linearly, to zero at the edge of the previous contact.

    Then all are scaled to keep the total force, unless that would raise the elastic energy, the sum of w q^2: a change
    of the nodes must not add energy.
    """
    n, span, x, w, old = law.w.size, contact.scale, law.x, law.w, memory.copy()
    edge, active = sqrt(contact.radius * max(contact.before, 0.0)) / span, 0
    while active < n and x[active] < edge:
        active += 1
    both, square, energy, new_energy = 0.0, 0.0, 0.0, 0.0
    for side in range(2):
        force, new_force = 0.0, 0.0
        soft = 1.0 + contact.skew if side == 0 else 1.0 - contact.skew
        for i in range(n):
            at = x[i] * new_span / span
            value, j = 0.0, 0
            while j < active and x[j] < at:
                j += 1
            if active > 0 and at < edge:
                value = old[side, max(j - 1, 0)]
            if j > 0 and at < edge:
                right, top = (x[j], old[side, j]) if j < active else (edge, 0.0)
                value += (top - value) * (at - x[j - 1]) / (right - x[j - 1])
            memory[side, i] = value
            force += span * w[i] * old[side, i]
            new_force += new_span * w[i] * value
            energy += soft * span * w[i] * old[side, i] ** 2
            new_energy += soft * new_span * w[i] * value * value
        both += force * new_force
        square += new_force * new_force
    # Do not scale if tractions of opposite signs nearly cancel in the force (after shear to and fro).
    scale = both / square if square > 0.0 else 1.0
    if not 0.5 < scale < 2.0:
        scale = 1.0
    if scale * scale * new_energy > energy:
        scale = sqrt(energy / new_energy)
    memory *= scale
