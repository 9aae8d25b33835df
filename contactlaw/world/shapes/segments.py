"""Nearest points of two segments. The sides of capsules are slightly crowned, as rollers are, to make these unique.

Of two parallel segments no point is the nearest, and of nearly parallel ones it jumps from end to end. The radius
around a segment is therefore r(s) = R (1 - C s^2), s from -1 to 1 along it, C = CAPSULE_CROWN. The overlap
r_a(s) + r_b(t) - |d + s u - t v| is greatest, where contact begins, at the minimum of

    |d + s u - t v|^2/2 + (R_a + R_b) C (R_a s^2 + R_b t^2),

which is strictly convex: its minimum over the square of s and t has a closed form and moves continuously. By the
envelope theorem the force along the line of both points is the gradient of the overlap.
"""

from contactlaw.jit import jit
from contactlaw.world.data.vec import dot

CAPSULE_CROWN = 1e-3  # of the radius, by which a side is lower at its ends


@jit
def clip(s):
    """Return the number from -1 to 1 nearest to s."""
    return min(max(s, -1.0), 1.0)


@jit
def next_place(at, value, slope, ends):
    """Take a step of Newton's method for the root, from -1 to 1, of a growing function; bisect where that leads out.

    value, slope: of the function at a place `at`. ends: between which the root was before. Returns the next place, and
    between which the root is now.
    """
    low, high = (ends[0], at) if value > 0.0 else (at, ends[1])
    new = clip(at - value / slope) if slope > 0.0 else high
    if not low < new < high:
        new = clip(0.5 * (low + high))
    return new, (low, high)


@jit
def nearest_on_segments(d, u, radius_a, v, radius_b):
    """Return the places s and t along the half axes u of A and v of B; d: from the middle of B to that of A [m]."""
    both = 2.0 * CAPSULE_CROWN * (radius_a + radius_b)
    uu, vv, uv = dot(u, u) + both * radius_a, dot(v, v) + both * radius_b, dot(u, v)
    du, dv = dot(d, u), dot(d, v)
    s = clip((uv * dv - vv * du) / (uu * vv - uv * uv))
    t = clip((dv + uv * s) / vv)
    return clip((uv * t - du) / uu), t
