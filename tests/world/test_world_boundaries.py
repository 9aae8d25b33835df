"""Touches at the very end of a step, to rounding."""

import numpy as np
import pytest

from contactlaw import ContactPair
from contactlaw.world import World


@pytest.mark.parametrize("speed", [0.1, 0.5, 3.0])
@pytest.mark.parametrize("dt", [5e-4, 2e-3])
def test_a_touch_at_the_end_of_a_step_is_like_any_other(speed: float, dt: float) -> None:
    for count in range(1, 30):
        for off in (-1e-17, 0.0, 1e-17, 1e-15, 1e-12, 1e-9):
            world = World(gravity=0.0, timestep=dt)
            ball = world.add_body(0.5, 1e-4, (0.0, 0.0, 0.025 + count * dt * speed + off), (0.0, 0.0, -speed))
            floor = world.add_plane(None, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
            world.add_contact(world.add_sphere(ball, 0.025), floor, ContactPair("steel", "steel", 0.0, 1.0))
            world.step(count + 3)
            np.testing.assert_allclose(world.velocity[0], [0.0, 0.0, speed], atol=1e-4 * speed)
