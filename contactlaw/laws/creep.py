"""Creep: what a contact that rolls loses of its elastic displacement and twist, as other places of the surfaces enter.

Kalker's linear theory of steady rolling (Three-Dimensional Elastic Bodies in Rolling Contact, 1990; a circle, nu = 1/4)
gives force and moment on B by the slip of A over B, u along the way that the surfaces pass through the contact, v
across it, and the spin theta about the normal, all per way s in contact radii a, displacements over a:

    F_u/(G a^2) = C11 du/ds     F_v/(G a^2) = C22 dv/ds - C23 dtheta/ds     M/(G a^3) = C23 dv/ds + C33 dtheta/ds

A contact that sticks without rolling has F = 16/7 G a^2 u and M = 8/3 G a^3 theta (Mindlin 1949; Reissner & Sagoci
1944). If each way takes a share of the elastic displacements away, both are limits of

    d(u, v, theta)_elastic = d(u, v, theta) - C^-1 K (u, v, theta)_elastic ds        K = diag(16/7, 16/7, 8/3)

The couplings of v and theta in C^-1 K, multiplied by K, are opposite: a twist that passes backwards pushes sidewise, as
a wheel that leans is pushed (camber thrust), and a force makes a moment by its trail. They cancel in the energy, and
the rest is lost. Backward Euler makes the steady state exact in any step.
"""

from math import sqrt

import numpy as np

from contactlaw.jit import jit_module
from contactlaw.laws.slip import stuck_stiffness
from contactlaw.laws.torsion import FULL
from contactlaw.laws.torsion import stuck_stiffness as stuck_torsion

C11, C22, C23, C33 = 4.12, 3.67, 1.47, 1.19
STUCK, STUCK_TWIST = 16.0 / 7.0, 8.0 / 3.0
ALONG = STUCK / C11
(ACROSS, CAMBER), (TRAIL, TWIST) = np.abs(np.linalg.inv([[C22, -C23], [C23, C33]]) * (STUCK, STUCK_TWIST)).tolist()
"""Entries of C^-1 K: losses along and across the way, by twist, of twist by displacement across, and of twist."""


def strained(state, contact, modulus, moved):
    """Return by which displacement du, dv [m] and rotation [rad] springs are strained; moved: those of A over B.

    state: `torsion.TORSION`, whose way `passed` is reduced to a contact radius: what rolls to and fro by less counts as
    not rolling. contact: with its last tangential force. modulus: G_t [Pa]. No more than friction holds can be lost.
    """
    u, v = state.passed
    radius, way = sqrt(contact.radius * contact.overlap), sqrt(u * u + v * v)
    state.rolled = max(way / radius - 1.0, 0.0)
    if state.rolled == 0.0:
        return moved
    s, u, v = state.rolled, u / way, v / way
    state.passed[0], state.passed[1] = radius * u, radius * v
    one, load = 1.0 / radius, contact.mu * contact.force
    soft, turning = one / stuck_stiffness(contact), 1.0 / stuck_torsion(modulus, radius)
    (du, dv, turned), most, most_twist = moved, soft * load, turning * FULL * load * radius
    x = soft * (contact.f * u + contact.g * v) + one * (du * u + dv * v)  # if nothing was lost
    y = soft * (contact.g * u - contact.f * v) + one * (dv * u - du * v)
    twist, p, q = turning * state.moment + turned, 1.0 + ACROSS * s, 1.0 + TWIST * s
    z = clipped((p * twist + TRAIL * s * y) / (p * q + CAMBER * TRAIL * s * s), most_twist)
    x, y = x / (1.0 + ALONG * s), (y - CAMBER * s * z) / p
    part = min(most / sqrt(x * x + y * y + 1e-300), 1.0)
    x, y = part * x, part * y
    z = clipped((twist + TRAIL * s * y) / q, most_twist)
    turned -= s * (TWIST * z - TRAIL * y)
    x, y = s * radius * ALONG * x, s * radius * (ACROSS * y + CAMBER * z)
    return du - x * u + y * v, dv - x * v - y * u, turned


def clipped(x, most):
    """Return a number, at most `most` in size."""
    return min(max(x, -most), most)


jit_module(__name__)
