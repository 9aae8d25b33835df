"""The nodes of the microslip law: springs with a Coulomb cap each, at Gauss-Legendre points of half the contact line.

All nodes span a fixed radius while the contact grows and shrinks over them. Three things make few nodes enough:
a node that comes into contact inside a step takes part in the displacement from that instant only; the traction is
summed as a share of the summed caps, so that a contact that slips everywhere carries mu P exactly; the caps themselves
stay those of the exact pressure (scaling the caps instead costs ten times the error with 8 nodes).
"""

from __future__ import annotations

from math import sqrt

from contactlaw.jit import jit


@jit
def hertz_share(radius, overlap):
    """P_Hertz/E* = 4/3 sqrt(R) delta^1.5 [m^2]: what the node loads w z would sum to with infinitely many nodes."""
    return 4.0 / 3.0 * sqrt(radius * overlap) * overlap


@jit
def microslip_on_line(
    e_star, g_star, radius, mu, mu_static, span, x, w, overlap, before, du, q, flags
):  # fmt: skip
    """Displace all nodes by du [m] along the line; tractions q are updated in place. Returns F [N], undamped."""
    gained = overlap - before
    pull, load = 0.0, 0.0
    for i in range(x.size):
        z = overlap - span * span * x[i] * x[i] / radius
        if z <= 0.0:
            q[i] = 0.0
            if mu_static > mu:
                flags[i] = 0.0
            continue
        part = z / gained if z < gained else 1.0
        q[i] += g_star * part * du
        cap = mu * e_star * z
        if mu_static > mu:
            cap_held = cap if flags[i] != 0.0 else mu_static * e_star * z
            flags[i] = 1.0 if abs(q[i]) > cap_held else 0.0
            if flags[i] == 0.0:
                cap = cap_held
        q[i] = min(max(q[i], -cap), cap)
        pull += w[i] * q[i]
        load += w[i] * z
    if load == 0.0:
        return 0.0
    return pull / load * hertz_share(radius, overlap)


@jit
def microslip_in_plane(
    e_star, g_star, radius, mu, mu_static, span, x, w, overlap, before, du, dv, q, flags
):  # fmt: skip
    """Displace all nodes by (du, dv) [m]; tractions q (pairs) are updated in place. Returns F [N], undamped."""
    gained = overlap - before
    pull_u, pull_v, load = 0.0, 0.0, 0.0
    for i in range(x.size):
        z = overlap - span * span * x[i] * x[i] / radius
        if z <= 0.0:
            q[2 * i] = 0.0
            q[2 * i + 1] = 0.0
            if mu_static > mu:
                flags[i] = 0.0
            continue
        part = z / gained if z < gained else 1.0
        u = q[2 * i] + g_star * part * du
        v = q[2 * i + 1] + g_star * part * dv
        cap = mu * e_star * z
        size2 = u * u + v * v
        limit = cap
        if mu_static > mu:
            if flags[i] == 0.0:
                limit = mu_static * e_star * z
            flags[i] = 1.0 if size2 > limit * limit else 0.0
        if size2 > limit * limit:
            back = cap / sqrt(size2)
            u *= back
            v *= back
        q[2 * i] = u
        q[2 * i + 1] = v
        pull_u += w[i] * u
        pull_v += w[i] * v
        load += w[i] * z
    if load == 0.0:
        return 0.0, 0.0
    share = hertz_share(radius, overlap) / load
    return pull_u * share, pull_v * share


@jit
def spread(radius, span, x, overlap, f, g, planar, q):
    """Tractions q of a contact that slips everywhere with the force (f, g): shares of the Hertz pressure."""
    share = 1.0 / hertz_share(radius, overlap)
    for i in range(x.size):
        z = max(overlap - span * span * x[i] * x[i] / radius, 0.0) * share
        if planar:
            q[i] = f * z
        else:
            q[2 * i] = f * z
            q[2 * i + 1] = g * z


@jit
def regrid(radius, span, new_span, x, w, overlap, planar, q):
    """Carry the tractions over to nodes that span another radius.

    Linear between the old nodes and down to zero at the edge of the contact, then scaled so that the total force stays
    unless that would raise the elastic energy, sum of w q^2: a change of nodes never feeds the motion.
    """
    parts = 1 if planar else 2
    old = q.copy()
    edge = sqrt(radius * overlap) / span
    active = 0
    while active < x.size and x[active] < edge:
        active += 1
    overlap_of_forces, force2, energy, new_energy = 0.0, 0.0, 0.0, 0.0
    for part in range(parts):
        force, new_force = 0.0, 0.0
        for i in range(x.size):
            at = x[i] * new_span / span
            value = 0.0
            if active > 0 and at < edge:
                j = 0
                while j < active and x[j] < at:
                    j += 1
                if j == 0:
                    value = old[part]
                else:
                    left, right = x[j - 1], x[j] if j < active else edge
                    top = old[parts * j + part] if j < active else 0.0
                    value = old[parts * (j - 1) + part]
                    value += (top - value) * (at - left) / (right - left)
            q[parts * i + part] = value
            force += span * w[i] * old[parts * i + part]
            new_force += new_span * w[i] * value
            energy += span * w[i] * old[parts * i + part] ** 2
            new_energy += new_span * w[i] * value * value
        overlap_of_forces += force * new_force
        force2 += new_force * new_force
    # A force that is small beside its own tractions (sheared and brought back) is no measure of them.
    scale = overlap_of_forces / force2 if force2 > 0.0 else 1.0
    if not 0.5 < scale < 2.0:
        scale = 1.0
    if scale * scale * new_energy > energy:
        scale = sqrt(energy / new_energy)
    for i in range(q.size):
        q[i] *= scale
