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

SUBSTEPS = 256  # per change of the whole overlap, or of the displacement that would make the whole contact slip
MOST_SUBSTEPS = 4096  # per segment of the path


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
def collide(p, tangential_mass, speed, overlap, force, ratio, impulse, dt, history, force_out, slide_out, elastic_out):
    """One impact along a line with tabulated normal motion.

    tangential_mass: effective [kg]. speed: tangential velocity at the touch [m/s]. overlap [m], force [N], ratio (force
    over the undamped one), impulse [N s]: at steps + 1 instants, the impulse that of the normal force from half a step
    before the instant to half a step after. dt [s]: of the steps between. history: planar. force_out [N], elastic_out
    [J]: at the instants. slide_out: displacement over each step [m]. Returns the tangential velocity after [m/s].
    """
    steps = dt.size
    share = first_share(p, speed, overlap[1] / dt[0])
    for k in range(steps + 1):
        if 0 < k < steps:
            f, _ = friction(
                p, history, overlap[k], overlap[k - 1], slide_out[k - 1], 0.0, force[k], ratio[k], dt[k] ** 2 /
                tangential_mass
            )  # fmt: skip
            force_out[k], elastic_out[k] = f, elastic_energy(p, history)
            share = f / force[k] if force[k] > 0.0 else 0.0
        speed -= share * impulse[k] / tangential_mass
        if k < steps:
            slide_out[k] = speed * dt[k]
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
