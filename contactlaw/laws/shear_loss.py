"""Losses in shear as in compression: each spring of the contact line is a Kelvin-Voigt element, in both directions.

    p(x) = E* (z + tau dz/dt), not below zero      q(x) = G* (u + tau du/dt), |q| <= mu p      z = delta - x^2/R

The retardation time is that of the normal damper c (`hertz`), tau = c/k_N = sqrt(5)/1.5 zeta sqrt(m/k) delta^(-1/4), so
no new number is needed. While everything slides, u = mu E*/G* z solves both equations: first stick and gross slip are
those of the elastic law. The limits are scaled so that they sum to mu times the normal force. With the elastic traction
t = G* u, a step h from t_0, the displacement g = G* ds, and r = tau/h,

    q = t + r (t - t_0); without slip q = t_0 + (1 + r) g; q is reduced to its limit; then t = (q + r t_0)/(1 + r)

so friction and damper dissipate energy with any step. The displacement gives the rate in the middle of the step, but q
belongs to its end. The change of the rate in between, -h F/(2 m_T), is estimated by the force of the previous step.
"""

from math import sqrt

from contactlaw.jit import jit_inline, jit_of_sums


@jit_inline
def retardation(contact, dt):
    """tau/h; tau d(delta)/dt [m]; and corrections of the displacement to the rate at the step's end, times G* [N/m]."""
    thrust = (contact.ratio - 1.0) / 1.5 * contact.overlap  # the ratio is 1 + 3/2 tau d(delta)/dt/delta
    if dt <= 0.0 or contact.zeta == 0.0:
        return 0.0, thrust, 0.0, 0.0
    tau = sqrt(5.0 * contact.mass / (contact.stiffness * sqrt(contact.overlap))) * contact.zeta / 1.5
    late = -0.5 * dt * dt * contact.g_star / contact.tangential_mass
    return tau / dt, thrust, late * contact.f, late * contact.g


@jit_of_sums
def loads(law, s2, overlap, thrust):
    """Weighted sum of the springs' loads over E* [m]. thrust: tau d(delta)/dt [m]."""
    load = 0.0
    for i in range(law.w.size):
        z = overlap - s2 * law.x2[i]
        load += law.w[i] * (max(z + thrust, 0.0) if z > 0.0 else 0.0)
    return load


@jit_of_sums
def displace_viscous(law, memory, s2, overlap, before, gu, gv, cap, loss):
    """`microslip.displace` with losses. loss: results 0 and 1 of `retardation`, factor of the limits, results 2, 3."""
    r, thrust, share, late_u, late_v = loss
    gained = overlap - before
    rate = 1.0 / gained if gained > 0.0 else 1e300
    pull_u, pull_v = 0.0, 0.0
    for i in range(law.w.size):
        z = max(overlap - s2 * law.x2[i], 0.0)
        on = 1.0 if z > 0.0 else 0.0
        part = min(z * rate, 1.0)
        u = on * memory[0, i] + part * gu
        v = on * memory[1, i] + part * gv
        q_u, q_v = u + on * r * (gu + late_u), v + on * r * (gv + late_v)
        limit = on * cap * share * max(z + thrust, 0.0)
        back = min(limit / sqrt(q_u * q_u + q_v * q_v + 1e-300), 1.0)
        slip = (1.0 - back) * part / max(part + r, 1e-300)
        memory[0, i] = u - slip * q_u
        memory[1, i] = v - slip * q_v
        pull_u += law.w[i] * back * q_u
        pull_v += law.w[i] * back * q_v
    return pull_u, pull_v
