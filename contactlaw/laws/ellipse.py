"""Microslip on an elliptic contact, whose tangential compliance is larger along its longer axis than across it.

The traction Q/(2 pi a b) (1 - x^2/a^2 - y^2/b^2)^(-1/2) on an ellipse of semi-axes a >= b displaces all its points
equally. The integrals of the traction times 1/r and x^2/r^3 about the centre are Q K/a and Q D/a, D = (K - E)/k^2,
k^2 = 1 - (b/a)^2. With Cerruti's kernel, [(1 - nu)/r + nu x^2/r^3]/(2 pi G), and k_N of the same punch, k_T/k_N is

    along a: 1/(1 + 2 (1/kappa - 1) D/K)        along b: 1/(1 + 2 (1/kappa - 1) (1 - D/K))

with the kappa of a circle, where D/K = 1/2 (Mindlin 1949; Johnson, Contact Mechanics (1985), section 7.2). In units of
1/G* the compliances are 1 + s and 1 - s, s = 2 (1 - kappa) (D/K - 1/2). Slip on similar ellipses superposes as on
circles (Vermeulen & Johnson 1964). So the springs of `microslip` apply, each with the stiffness G* C^-1,
C = diag(1 + s, 1 - s). Coulomb's limit is isotropic and slip is along the traction: a spring whose trial traction t
exceeds its limit gets the traction q with

    C (t - q) = lambda q,  |q| = mu p        q_i = c_i t_i/(c_i + lambda)

This q is the nearest to t in the norm of energy, so friction dissipates energy in any step. lambda is found by Newton's
method on 1/|q|, as in trust-region methods; for s = 0 the first step is exact.
"""

from math import exp, sqrt

from contactlaw.jit import jit, jit_inline
from contactlaw.laws.nodes import follow, levers, step_of
from contactlaw.laws.record import SPRUNG
from contactlaw.laws.slip import carried

MEANS = 5  # right to 2e-8 for ratios up to 1000
ROOTS = 2  # steps of Newton's method: right to 1e-12, as s is at most 0.17 if 1/kappa is below 1.25


@jit_inline
def share_along(length):
    """D/K - 1/2 as a function of length = ln(q/p), curvatures p <= q: a fit within 3e-4 for q/p up to 1e5."""
    return 0.0829516 * length * (1.0 + 0.0639377 * length * length) ** -0.413082


@jit_inline
def elongation(length):
    """ln(a/b) of the half axes a >= b as a function of length = ln(q/p), as above: a fit within 1.3e-3 up to 1e5."""
    return length * (0.5 + 1.0 / 6.0 * (1.0 + 0.05815733 * length * length) ** -0.30928258)


@jit_inline
def half_axes(slender):
    """Half axes of an ellipse of ln(a/b), over the radius pi a/(2 K) of the circle that is as stiff: K by Gauss's mean.

    K(k) = pi/(2 M(1, b/a)), so that the radius is M(a, b).
    """
    if slender == 0.0:
        return 1.0, 1.0
    one = exp(-slender)
    mean, other = 1.0, one
    for _ in range(MEANS):
        mean, other = 0.5 * (mean + other), sqrt(mean * other)
    return 1.0 / mean, one / mean


@jit_inline
def returned(u, v, limit, cu, cv):
    """Return the trial traction (u, v) of a spring, beyond its limit > 0, to the limit. cu, cv: its compliances."""
    more = sqrt(u * u + v * v) / limit - 1.0
    for _ in range(ROOTS):  # x and y are q over a common factor: few divisions, as these take most of the time
        a, b = cu + more, cv + more
        x, y = cu * u * b, cv * v * a
        square = x * x + y * y
        more += (sqrt(square) - a * b * limit) * square / ((x * x * b + y * y * a) * limit)
    x, y = cu * u * (cv + more), cv * v * (cu + more)
    back = limit / sqrt(x * x + y * y)
    return back * x, back * y


@jit
def force_on_ellipse(contact, law, memory, du, dv):
    """`Microslip.force` of an elliptic contact, whose first tangent is its longer axis."""
    follow(contact, law, memory)
    contact.state = SPRUNG
    cu, cv = 1.0 + contact.skew, 1.0 - contact.skew
    share, lever = levers(contact, law)
    s2, overlap, before, gu, gv, cap = step_of(contact, lever * du / cu, lever * dv / cv)
    rate = 1.0 / (overlap - before) if overlap > before else 1e300
    pull_u, pull_v = 0.0, 0.0
    for i in range(law.w.size):
        z = max(overlap - s2 * law.x2[i], 0.0)
        part, limit = min(z * rate, 1.0), cap * z
        u, v = memory[0, i] + part * gu, memory[1, i] + part * gv
        if limit == 0.0:
            u, v = 0.0, 0.0
        elif u * u + v * v > limit * limit:
            u, v = returned(u, v, limit, cu, cv)
        memory[0, i], memory[1, i] = u, v
        pull_u += law.w[i] * u
        pull_v += law.w[i] * v
    return carried(contact, pull_u * share, pull_v * share)
