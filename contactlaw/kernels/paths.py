"""Contacts whose normal motion is known beforehand: prescribed quasi-static paths, and whole impacts in SI units."""

from __future__ import annotations

from math import ceil, sqrt

import numpy as np

from contactlaw.jit import jit
from contactlaw.kernels.contact import (
    COULOMB,
    E_STAR,
    FRICTION,
    G_STAR,
    HEADER,
    LAW,
    LINEAR_SPRING,
    LINEAR_STIFFNESS,
    MICROSLIP,
    NODES,
    NORMAL,
    OPEN,
    OVERLAP,
    PARAMETERS,
    PHASE,
    PLANAR,
    RADIUS,
    SCALE,
    SLIDING,
    STATIC_FRICTION,
    TANGENTIAL,
    elastic_part,
    friction,
    hertz_stiffness,
)
from contactlaw.kernels.ledger import DELTA, DROP, FORCE, RATIO, ROOT, STEP, note
from contactlaw.kernels.line import advance, new_stack, spring_sum, stored

SUBSTEPS = 256  # per change of the whole overlap, or of the displacement that would make the whole contact slip
MOST_SUBSTEPS = 4096  # per segment of the path
ROUNDING = 1e-15  # of coordinates, over the largest


@jit
def force_along_path(p, approach, displacement, history, normal_out, tangential_out):
    """Forces along straight segments of overlap (n,) and tangential displacement (n, 2), from zero overlap."""
    deepest = max(np.max(approach), 0.0)
    k = hertz_stiffness(p)
    scale = LINEAR_STIFFNESS * k * sqrt(deepest) if p[LAW] == LINEAR_SPRING else sqrt(p[RADIUS] * deepest)
    history[SCALE] = scale
    finest = deepest / SUBSTEPS
    slip = p[FRICTION] * p[E_STAR] / p[G_STAR] * finest
    now, u, v = min(approach[0], 0.0), displacement[0, 0], displacement[0, 1]
    for j in range(approach.size):
        step_n, step_u, step_v = approach[j] - now, displacement[j, 0] - u, displacement[j, 1] - v
        parts = 1.0
        if finest > 0.0:
            parts = max(parts, ceil(abs(step_n) / finest))
        if slip > 0.0:
            parts = max(parts, ceil(sqrt(step_u**2 + step_v**2) / slip))
        count = int(min(parts, MOST_SUBSTEPS))
        force, f, g = history[NORMAL], history[TANGENTIAL], history[TANGENTIAL + 1]
        for i in range(count):
            before = now + step_n * i / count
            overlap = approach[j] if i == count - 1 else now + step_n * (i + 1) / count
            if overlap <= 0.0:
                history[:] = 0.0
                history[SCALE] = scale
                force, f, g = 0.0, 0.0, 0.0
                continue
            force = scale * overlap if p[LAW] == LINEAR_SPRING else k * overlap * sqrt(overlap)
            f, g = friction(p, history, overlap, before, step_u / count, step_v / count, force, 1.0, 0.0)
        now, u, v = approach[j], displacement[j, 0], displacement[j, 1]
        normal_out[j] = force
        tangential_out[j, 0] = f
        tangential_out[j, 1] = g


@jit
def direction(displacement):
    """Direction of the line on which a path (n, 2) runs but for rounding; (0, 0): on none."""
    size, far = 0.0, 0
    for j in range(displacement.shape[0]):
        u, v = displacement[j, 0] - displacement[0, 0], displacement[j, 1] - displacement[0, 1]
        if u * u + v * v > size:
            size, far = u * u + v * v, j
    if size == 0.0:
        return 1.0, 0.0
    length = sqrt(size)
    x, y = (displacement[far, 0] - displacement[0, 0]) / length, (displacement[far, 1] - displacement[0, 1]) / length
    slack = ROUNDING * np.max(np.abs(displacement))
    for j in range(displacement.shape[0]):
        u, v = displacement[j, 0] - displacement[0, 0], displacement[j, 1] - displacement[0, 1]
        if abs(u * y - v * x) > slack:
            return 0.0, 0.0
    return x, y


@jit
def path_on_line(p, approach, displacement, normal_out, tangential_out):
    """The same for all springs of `microslip` at once (`line`), displacement (n,), mu > 0: exact."""
    k, mu = hertz_stiffness(p), p[FRICTION]
    scale = p[G_STAR] / (mu * p[E_STAR])
    stack = new_stack(approach.size)
    top, s, before, place = 0, 0.0, min(approach[0], 0.0), displacement[0]
    for j in range(approach.size):
        overlap = approach[j]
        if overlap <= 0.0:
            top = 0
            normal_out[j] = 0.0
            tangential_out[j] = 0.0
        else:
            slide = scale * (displacement[j] - place)
            if before < 0.0:
                slide *= overlap / (overlap - before)
            root = sqrt(overlap)
            top, s = advance(stack, top, s + slide if top > 0 else slide, overlap, root)
            normal_out[j] = k * overlap * root
            tangential_out[j] = 1.5 * mu * k * spring_sum(stack, top, s)
        before, place = overlap, displacement[j]


@jit
def impact_on_line(
    chi, mu, kappa, table, mass, approach, length, tangential_mass, speed, x, y, z, ledger_out, force_out
):  # fmt: skip
    """One impact of all springs of `microslip` at once, mu > 0; arguments as for `impact_by_steps` and `note`.

    The tangential motion is marched in the scaled form of `rebound`: psi' = -2 chi F/mu.
    """
    steps = table.shape[1] - 1
    unit = mu * approach / kappa  # [m/s]
    full, energy = mu * mass * approach * approach / length, 0.75 * mu * mu / kappa * mass * approach * approach
    psi, after = speed / unit, speed
    share, pull, work, elastic = min(psi, 1.0), 0.0, 0.0, 0.0
    stack = new_stack(steps)
    top, s, slide = 0, 0.0, 0.0
    for k in range(steps + 1):
        last = pull
        if 0 < k < steps:
            delta, root = table[DELTA, k], table[ROOT, k]
            top, s = advance(stack, top, s + slide, delta, root)
            share = 1.5 * spring_sum(stack, top, s) / (root * delta)
            pull, elastic = full * share * table[FORCE, k], energy * stored(stack, top, s)
        elif k == steps:
            pull, elastic = 0.0, 0.0
        before = after
        work += 0.5 * (last + pull) * unit * slide * length / approach
        psi -= 2.0 * chi * share * table[DROP, k]
        slide = psi * table[STEP, k]
        after = unit * psi
        now = 0.5 * (before + after) if 0 < k < steps else before if k == 0 else after
        note(table, k, mass, approach, length, tangential_mass, now, pull, elastic, work, x, y, z, ledger_out,
             force_out)  # fmt: skip
    return after


@jit
def impact_by_steps(
    p, history, table, mass, approach, length, tangential_mass, speed, x, y, z, ledger_out, force_out
):  # fmt: skip
    """One impact along a line by any law.

    p, history: of the pair, planar, its scale in place. table: normal motion (`ledger`). mass, tangential_mass:
    effective [kg]. approach: speed [m/s]. length: of the scaled motion [m]. speed: tangential velocity at the touch
    [m/s], along the direction x, y, z. Writes the ledger, returns the tangential velocity after [m/s].
    """
    steps = table.shape[1] - 1
    unit, impulse = mass * approach * approach / length, mass * approach / tangential_mass
    share = first_share(p, speed, approach * table[DELTA, 1] / table[STEP, 0])
    pull, work, elastic, slide = 0.0, 0.0, 0.0, 0.0
    for k in range(steps + 1):
        last, before = pull, speed
        if 0 < k < steps:
            overlap, force = length * table[DELTA, k], unit * table[FORCE, k]
            dt = length / approach * table[STEP, k]
            pull, _ = friction(
                p, history, overlap, length * table[DELTA, k - 1], slide, 0.0, force, table[RATIO, k],
                dt * dt / tangential_mass,
            )  # fmt: skip
            elastic = elastic_energy(p, history)
            share = pull / force if force > 0.0 else 0.0
        elif k == steps:
            pull, elastic = 0.0, 0.0
        work += 0.5 * (last + pull) * slide
        speed -= share * impulse * table[DROP, k]
        slide = speed * length / approach * table[STEP, k]
        now = 0.5 * (before + speed) if 0 < k < steps else before if k == 0 else speed
        note(table, k, mass, approach, length, tangential_mass, now, pull, elastic, work, x, y, z, ledger_out,
             force_out)  # fmt: skip
    return speed


@jit
def first_share(p, speed, closing):
    """F/P at the touch: mu where the contact starts sliding, psi_1 of it where it sticks."""
    if p[LAW] == COULOMB:
        return p[FRICTION] if speed > 0.0 else 0.0
    share = p[G_STAR] / p[E_STAR] * speed / closing
    return p[FRICTION] if share >= p[STATIC_FRICTION] else share


@jit
def elastic_energy(p, h):
    """Elastic energy [J] stored in the tangential springs of a history."""
    law, overlap = p[LAW], h[OVERLAP]
    if law == COULOMB or h[PHASE] == OPEN:
        return 0.0
    f, g = elastic_part(h)
    force2 = f * f + g * g
    if law == LINEAR_SPRING:
        return 0.5 * force2 * p[E_STAR] / (p[G_STAR] * h[SCALE])
    a = sqrt(p[RADIUS] * overlap)
    if law != MICROSLIP:
        return force2 / (4.0 * p[G_STAR] * a)
    if h[PHASE] == SLIDING:  # q = F z/(4/3 sqrt(R) delta^1.5) all along the line
        return 0.3 * force2 / (p[G_STAR] * a)
    n = int(p[NODES])
    total = 0.0
    for i in range(n):
        if p[PLANAR] != 0.0:
            q2 = h[HEADER + i] ** 2
        else:
            q2 = h[HEADER + 2 * i] ** 2 + h[HEADER + 2 * i + 1] ** 2
        total += p[PARAMETERS + n + i] * q2
    return h[SCALE] * total / p[G_STAR]
