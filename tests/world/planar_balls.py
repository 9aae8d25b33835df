"""Equal balls in a plane by plain explicit steps: an integration that shares nothing with the world.

Hertz, Tsuji's damper and sixty springs a contact (method of dimensionality reduction), steps a thousandth of an
impact, no corrections of any kind.
"""

from __future__ import annotations

import numba
import numpy as np

SPRINGS = 60


@numba.njit
def advance(position, velocity, spin, made, dt, steps):
    """Move balls: position, velocity (n, 2), spin (n,), in place. made: R, M, I, E*, G*, mu, zeta, half the line."""
    radius, mass, inertia, e_star, g_star, mu, zeta, width = made
    n = position.shape[0]
    k = 4.0 / 3.0 * e_star * np.sqrt(0.5 * radius)
    tractions, overlaps = np.zeros((n, n, SPRINGS)), np.full((n, n), -1.0)
    force, torque = np.zeros((n, 2)), np.zeros(n)
    for _ in range(steps):
        position += dt * velocity
        force[:] = 0.0
        torque[:] = 0.0
        for i in range(n):
            for j in range(i + 1, n):
                x, y = position[j, 0] - position[i, 0], position[j, 1] - position[i, 1]
                far = np.sqrt(x * x + y * y)
                overlap, before = 2.0 * radius - far, overlaps[i, j]
                overlaps[i, j] = overlap
                if overlap <= 0.0:
                    tractions[i, j] = 0.0
                    continue
                x, y = x / far, y / far
                u, v = velocity[i, 0] - velocity[j, 0], velocity[i, 1] - velocity[j, 1]
                arm = 0.5 * far
                slide = (-u * y + v * x + (spin[i] + spin[j]) * arm) * dt
                elastic = k * overlap**1.5
                closing = u * x + v * y
                normal = max(elastic + zeta * np.sqrt(2.5 * mass * k * np.sqrt(overlap)) * closing, 0.0)
                pull, load = 0.0, 0.0
                for s in range(SPRINGS):
                    z = overlap - ((s + 0.5) * width / SPRINGS) ** 2 / (0.5 * radius)
                    if z <= 0.0:
                        tractions[i, j, s] = 0.0
                        continue
                    part = min(z / (overlap - before), 1.0) if overlap > before else 1.0
                    cap = mu * e_star * z
                    q = min(max(tractions[i, j, s] + g_star * part * slide, -cap), cap)
                    tractions[i, j, s] = q
                    pull += q
                    load += e_star * z
                across = pull / load * normal if load > 0.0 else 0.0
                for one, sign in ((i, -1.0), (j, 1.0)):
                    force[one, 0] += sign * (normal * x - across * y)
                    force[one, 1] += sign * (normal * y + across * x)
                    torque[one] -= arm * across
        velocity += dt / mass * force
        spin += dt / inertia * torque
