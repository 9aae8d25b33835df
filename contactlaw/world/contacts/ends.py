"""The ends of an impact, where the force is a broken power of time and a sum over substeps needs a correction.

The force is summed over substeps as the trapezoidal rule does. At both ends of an impact it goes with a power p of time
and the first or last point of the sum lies s substeps inside: the sum is then too much by zeta(-p, s) times what the
force grows to in one substep (Euler-Maclaurin; zeta is Hurwitz's). Elastic force begins and ends with p = 3/2; the
damper sets in with p = 1/4. For a linear spring these are 1 and 0.
"""

from __future__ import annotations

from math import sqrt

from contactlaw.jit import jit_inside

# (zeta(-3/2, 1 + s) - zeta(-3/2))/s and zeta(-1/4, 1 + s) in powers of s on (0, 1], to 4e-5 and 1e-4
ELASTIC_END = (-0.31178923, -0.5489945, -0.15573116, 0.01654819)
DAMPED_END = (-0.32035357, -0.86369735, -0.16467251, 0.02834923)


@jit_inside
def cubic(a, s):
    """A polynomial of third degree."""
    return a[0] + s * (a[1] + s * (a[2] + s * a[3]))


@jit_inside
def elastic_end(s, linear):
    """By how many substeps the force at the first or last point acted too short; s in (0, 1]: see the module.

    Counted from an end on a point, s = 1, so that impacts which begin on a point are as symmetric in time as they are.
    """
    if linear:
        return 0.5 * (s - 1.0)
    s = max(s, 1e-6)
    return -(1.0 + cubic(ELASTIC_END, s) / sqrt(s))


@jit_inside
def damped_end(s, linear):
    """The same of the damper's force at the touch, not counted from anything."""
    if linear:
        return s - 0.5
    s = max(s, 1e-6)
    return -(1.0 + cubic(DAMPED_END, s) / sqrt(sqrt(s)))
