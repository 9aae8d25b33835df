"""Where a point, or the side of a capsule, is nearest to a box."""

from __future__ import annotations

from math import sqrt

from contactlaw.jit import jit_inside
from contactlaw.world.segments import clip
from contactlaw.world.vec import load, to_body, to_world

STEPS = 60  # of Newton's method, which is done when it comes to the right piece; bisection guards it
CROWN = 0.01  # of the radius


@jit_inside
def excess(x, half):
    """By how much a coordinate is beyond a box that reaches from -half to half."""
    return x - min(max(x, -half), half)


@jit_inside
def nearest_on_box(d, s, b):
    """Distance [m] of a point from a box, and the unit vector from there to it, in the world.

    d: from the box's centre, in the world. Inside, the distance has a minus, and the way out is through the nearest
    face.
    """
    x, y, z = to_body(s.axes, to_body(b.axes, d))
    h = s.half
    n = excess(x, h[0]), excess(y, h[1]), excess(z, h[2])
    far = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
    if far > 0.0:
        n = n[0] / far, n[1] / far, n[2] / far
    else:
        i, j, k = h[0] - abs(x), h[1] - abs(y), h[2] - abs(z)
        far = -min(i, j, k)
        if i == -far:
            n = 1.0 if x >= 0.0 else -1.0, 0.0, 0.0
        elif j == -far:
            n = 0.0, 1.0 if y >= 0.0 else -1.0, 0.0
        else:
            n = 0.0, 0.0, 1.0 if z >= 0.0 else -1.0
    return far, to_world(b.axes, to_world(s.axes, n))


@jit_inside
def deepest_on_box(d, u, radius, s, b):
    """Which point of a capsule's side is the deepest in a box: its place along the half axis u, and its radius [m].

    d: from the box's centre to the segment's middle, in the world. On a face a capsule lies on its ends; its side meets
    edges. It is crowned, r(s) = R (1 - CROWN (1 + s^2)), so that it does not share the load of the ends, and so that
    the deepest point is one that moves continuously, at the minimum of distance^2/2 + CROWN R^2 s^2: the root of a
    function of s that grows piece by piece along straight lines.
    """
    p, q, h = to_body(s.axes, to_body(b.axes, d)), to_body(s.axes, to_body(b.axes, u)), load(s.half)
    crown = 2.0 * CROWN * radius * radius
    low, high, at = -2.0, 2.0, 0.0
    for _ in range(STEPS):
        value, slope = crown * at, crown
        for i in range(3):
            e = excess(p[i] + at * q[i], h[i])
            value += e * q[i]
            if e != 0.0:
                slope += q[i] * q[i]
        if value > 0.0:
            high = at
        else:
            low = at
        new = clip(at - value / slope)
        if not low < new < high:
            new = clip(0.5 * (low + high))
        if new == at:
            break
        at = new
    return at, radius * (1.0 - CROWN * (1.0 + at * at))
