"""Bodies that are led: nothing pushes them, and somebody puts them elsewhere from step to step.

A place alone tells no velocity. A body goes evenly from where it was left to where it has been put, so that contacts
see it come and drag what lies on it along, and is there as the step ends.
"""

from __future__ import annotations

from contactlaw.jit import jit_inside
from contactlaw.world.bodies.motion import set_axes
from contactlaw.world.data.vec import ZERO, load, load4, norm, product, rotation_vector, scale, store, store4, sub

# [m/s]: who would change speed by more in a step, and by more than all of it, has jumped. Arms of robots and belts set
# out with less; 10 mm in 2 ms are no motion. Nor is it what an overlap stands for that would throw bodies so fast
JUMP = 5.0


@jit_inside
def lead(w, b, place, turn, h):
    """Let a body, which is where it was left, go to a place [m] and a quaternion within a step of h [s].

    Its velocities are those of the step before. One that jumps is there at once, at rest, as somebody who is `placed`.
    """
    back = load4(b.quaternion)
    twist = rotation_vector(product(turn, (back[0], -back[1], -back[2], -back[3])))
    velocity, spin = scale(1.0 / h, sub(place, load(b.position))), scale(1.0 / h, twist)
    change = norm(sub(velocity, load(b.velocity))) + b.reach * norm(sub(spin, load(b.spin)))
    if change <= max(norm(load(b.velocity)) + b.reach * norm(load(b.spin)), JUMP):
        store(b.velocity, velocity)
        store(b.spin, spin)
    else:
        store(b.position, place)
        store4(b.quaternion, turn)
        b.placed, w.stale = 1, 1
        store(b.velocity, ZERO)
        store(b.spin, ZERO)
    set_axes(b)
