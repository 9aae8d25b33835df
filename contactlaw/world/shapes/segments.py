"""Where two segments come nearest. The sides of capsules are crowned a little, like rollers, so that it is one point.

Of two sides that are parallel no point is the nearest, and of two that are nearly so it jumps from end to end. The
radius around a segment is therefore r(s) = R (1 - CROWN s^2), s from -1 to 1 along it: a thousandth less at the ends.
The overlap r_a(s) + r_b(t) - |d + s u - t v| is greatest, where contact begins, at the minimum of

    |d + s u - t v|^2/2 + (R_a + R_b) CROWN (R_a s^2 + R_b t^2),

which is strictly convex: its minimum within the square of s and t is in closed form, and moves continuously. By the
theorem of the envelope the force along the line between both points is the gradient of the overlap.
"""

from __future__ import annotations

from contactlaw.jit import jit_inside
from contactlaw.world.data.vec import dot

CROWN = 1e-3


@jit_inside
def clip(s):
    """The nearest number from -1 to 1."""
    return min(max(s, -1.0), 1.0)


@jit_inside
def nearest_on_segments(d, u, radius_a, v, radius_b):
    """Places s and t along the half axes u of A and v of B; d: from the middle of B to that of A [m]."""
    both = 2.0 * CROWN * (radius_a + radius_b)
    uu, vv, uv = dot(u, u) + both * radius_a, dot(v, v) + both * radius_b, dot(u, v)
    du, dv = dot(d, u), dot(d, v)
    s = clip((uv * dv - vv * du) / (uu * vv - uv * uv))
    t = clip((dv + uv * s) / vv)
    return clip((uv * t - du) / uu), t
