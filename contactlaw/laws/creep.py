"""Creep: what a contact that rolls loses of its elastic displacement and twist, as other places of the surfaces enter.

Kalker's linear theory of steady rolling (see `kalker`) gives force and moment on B by the slip of A over B, u along the
way that the surfaces pass through the contact, v across it, and the spin theta about the normal, all per way s. With
displacements and s over the radius c of the circle that is as stiff, and G that of both bodies,

    F_u/(G c^2) = C11 du/ds     F_v/(G c^2) = C22 dv/ds - C23 dtheta/ds     M/(G c^3) = C23 dv/ds + C33 dtheta/ds

C11 and C22 are Kalker's times a b/c^2, C23 and C33 those of a circle. A contact that sticks without rolling has
F = 4/(2 - nu) G c^2 u and M = 8/3 G c^3 theta (Mindlin 1949; Reissner & Sagoci 1944). If each way takes a share of the
elastic displacements away, both are limits of

    d(u, v, theta)_elastic = d(u, v, theta) - C^-1 K (u, v, theta)_elastic ds        K = diag(these stiffnesses)

The couplings of v and theta in C^-1 K, multiplied by K, are opposite: a twist that passes backwards pushes sidewise, as
a wheel that leans is pushed (camber thrust), and a force makes a moment by its trail. They cancel in the energy, and
the rest is lost. Contacts that have not spun have no moment: F_v is C22 dv/ds. Backward Euler makes the steady state
exact in any step.
"""

from math import sqrt

from contactlaw.jit import jit_module
from contactlaw.laws import kalker
from contactlaw.laws.ellipse import half_axes
from contactlaw.laws.slip import stuck_stiffness
from contactlaw.laws.torsion import FULL
from contactlaw.laws.torsion import stuck_stiffness as stuck_torsion


def losses(contact, modulus, area, slender, spins):
    """Return the entries of C^-1 K: along, across, across by twist, of twist by displacement across, and of twist.

    area: a b/c^2. Other arguments: as for `strained`.
    """
    stiff = contact.g_star / (modulus * contact.share)  # 4/(2 - nu), unless the pair has a stiffness ratio of its own
    nu = min(max(2.0 - 4.0 / stiff, 0.0), 0.5)
    along, across = kalker.compliances(slender, nu)
    stuck, twist = stiff / area, 8.0 / 3.0
    if not spins:
        return stuck * along, stuck * across, 0.0, 0.0, 0.0
    camber, turning = kalker.of_spin(nu)
    one = 1.0 / (turning + camber * camber * across / area)  # C22 over the determinant
    both = one * camber * across / area
    return stuck * along, stuck * across * one * turning, twist * both, stuck * area * both, twist * one


def strained(state, contact, modulus, moved, slender, spins):
    """Return by which displacement du, dv [m] and rotation [rad] springs are strained; moved: those of A over B.

    state: `torsion.TORSION`, whose way `passed` is reduced to the contact's half axis: what rolls to and fro by less
    counts as not rolling. contact: with its last tangential force. modulus: G_t [Pa]. slender: ln(a/b) of its half axes
    along and across the way. spins: whether it has a moment. No more than friction holds can be lost.
    """
    u, v = state.passed
    radius, way = sqrt(contact.radius * contact.overlap), sqrt(u * u + v * v)
    half, wide = half_axes(slender)
    state.rolled = max(way / radius - half, 0.0)
    if state.rolled == 0.0:
        return moved
    s, u, v = state.rolled, u / way, v / way
    state.passed[0], state.passed[1] = half * radius * u, half * radius * v
    along, across, camber, trail, turning = losses(contact, modulus, half * wide, slender, spins)
    one, soft, (du, dv, turned) = 1.0 / radius, 1.0 / (radius * stuck_stiffness(contact)), moved
    x = soft * (contact.f * u + contact.g * v) + one * (du * u + dv * v)  # if nothing was lost
    y = soft * (contact.g * u - contact.f * v) + one * (dv * u - du * v)
    z, load, p, q = 0.0, contact.mu * contact.force, 1.0 + across * s, 1.0 + turning * s
    if spins:
        supple = 1.0 / stuck_torsion(modulus, radius)
        most, twist = supple * FULL * load * radius, supple * state.moment + turned
        z = clipped((p * twist + trail * s * y) / (p * q + camber * trail * s * s), most)
    x, y = x / (1.0 + along * s), (y - camber * s * z) / p
    part = min(soft * load / sqrt(x * x + y * y + 1e-300), 1.0)
    x, y = part * x, part * y
    if spins:
        z = clipped((twist + trail * s * y) / q, most)
        turned -= s * (turning * z - trail * y)
    x, y = s * radius * along * x, s * radius * (across * y + camber * z)
    return du - x * u + y * v, dv - x * v - y * u, turned


def clipped(x, most):
    """Return a number, at most `most` in size."""
    return min(max(x, -most), most)


jit_module(__name__)
