"""What closed contacts press with, as a generalised force."""

from __future__ import annotations

from math import sqrt

from contactlaw.mujoco_plugin.block import free_at
from contactlaw.mujoco_plugin.free import jit, press_free
from contactlaw.mujoco_plugin.jointed import press_jointed
from contactlaw.world.access import body_at, world_at
from contactlaw.world.force import hardly_moves


@jit
def mean_share(c, dt):
    """What a closed contact will press with in the mean over the next step, over what it presses with now.

    Of an impact that is going on the impulse left is m (v + u): v closing speed now, u parting speed, from
    m u^2/2 = m v^2/2 + 2/5 P delta. Limits and equalities would hold against all of its force for a whole step.
    """
    t = c.touch
    if t.force <= 0.0 or hardly_moves(c, 1.0):
        return 1.0
    parting = sqrt(t.closing * t.closing + 0.8 * t.force * max(t.overlap, 0.0) / t.mass)
    return min(t.mass * (t.closing + parting) / (t.force * dt), 1.0)


@jit
def press(head, body, arm, force, push_io):
    """Add a force on a body of the world [N], at an arm [m] from its centre of mass, to the generalised one."""
    if 0 < body <= head.free_count:
        press_free(head, free_at(head.frees, body - 1), arm, force, push_io)
        return
    b = body_at(world_at(head.world, 0).bodies, body)
    if b.tree != 0:
        press_jointed(head, b, arm, force, push_io)
