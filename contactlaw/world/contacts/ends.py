"""Corrections of the sum of a force over substeps at both ends of an impact.

There the force grows as a power p of time, and the first or last point of the sum lies s substeps, 0 < s <= 1, inside
the impact. The sum then exceeds the integral by zeta(-p, s) times the force after one substep (Euler-Maclaurin with
Hurwitz's zeta function). The force at the first or last point is s^p times that, so that its weight, one substep, must
change by -zeta(-p, s)/s^p substeps. p = 3/2 for the elastic force of Hertz, 1/4 for its damper at the touch; for a
linear spring 1 and 0.
"""

from math import sqrt

from contactlaw.jit import jit

AT_ONE = 1.0 / 12.0, 0.025485202  # -zeta(-p, 1) of elastic forces, linear and of Hertz
# (zeta(-3/2, 1 + s) - zeta(-3/2))/s and zeta(-1/4, 1 + s) in powers of s on (0, 1], to 4e-5 and 1e-4
ELASTIC_END = (-0.31178923, -0.5489945, -0.15573116, 0.01654819)
DAMPED_END = (-0.32035357, -0.86369735, -0.16467251, 0.02834923)


@jit
def cubic(a, s):
    """Return the cubic polynomial of s with the coefficients a, lowest first."""
    return a[0] + s * (a[1] + s * (a[2] + s * a[3]))


@jit
def elastic_end(s, linear):
    """Return the correction [substeps] of the weight of the elastic force at the first or last point of an impact.

    That for s = 1 is left out: -(zeta(-p, s) - zeta(-p))/s^p. An impact that begins at the end of a substep needs no
    correction then and stays symmetric in time.
    """
    if linear:
        return 0.5 * (s - 1.0)
    s = max(s, 1e-6)
    return -(1.0 + cubic(ELASTIC_END, s) / sqrt(s))


@jit
def single_end(s, linear):
    """Return the whole correction [substeps], -zeta(-p, s)/s^p, of an elastic force that a damper lets end otherwise.

    With linear, also that of a damped force as it falls to zero while the shapes still overlap.
    """
    return elastic_end(s, linear) + (AT_ONE[0] / s if linear else AT_ONE[1] / (s * sqrt(s)))


@jit
def damped_end(s, linear):
    """Return the correction [substeps] of the weight of the damper's force at the first point: -zeta(-p, s)/s^p."""
    if linear:
        return s - 0.5
    s = max(s, 1e-6)
    return -(1.0 + cubic(DAMPED_END, s) / sqrt(sqrt(s)))
