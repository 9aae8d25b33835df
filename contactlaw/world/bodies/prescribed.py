"""Kinematic bodies: contacts do not push them, the user moves them from step to step.

A position alone gives no velocity. A body moves uniformly from where the last step left it to where the user has put
it, so that contacts feel its motion and carry along what lies on it, and arrives there at the end of the step.
"""

from contactlaw.jit import jit_inside
from contactlaw.world.bodies.motion import set_axes
from contactlaw.world.data.vec import ZERO, load, load4, norm, product, rotation_vector, scale, store, store4, sub

# [m/s]: a body whose speed would change by more in a step, and by more than its present speed, has jumped: robot arms
# and belts start with less, 10 mm in 2 ms is no motion. Also the limit of `touch.initial_overlap_limit`
JUMP = 5.0


@jit_inside
def move_kinematic(w, b, place, turn, h):
    """Set the velocities of a kinematic body such that it reaches a pose at the end of a step of h [s].

    place, turn: that pose, position [m] and quaternion. On entry the pose of the body is where the last step left it,
    its velocities are those of that step. A body that jumps is put there at once, at rest, and marked as `placed`.
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
