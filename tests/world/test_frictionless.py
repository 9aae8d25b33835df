"""What slides without friction, in implicit steps."""

from math import cos, sin

import numpy as np
import pytest

from contactlaw import ContactPair
from contactlaw.world import World
from tests.world.world_scenes import STEEL


@pytest.mark.parametrize("timestep", [1e-3, 2e-3])
def test_what_slides_without_friction_takes_implicit_steps(timestep: float) -> None:
    """A ladder of two balls, by its closed form until it leaves the wall; the direction of no friction was not finite.

    Newton's method gave up whatever needed an iteration, and substeps took all steps.
    """
    half, mass, lean = 0.3, 0.5, 1.2
    world, turn = World(timestep=timestep), 0.5 * lean
    place = half * cos(lean) + 0.004, 0.0, half * sin(lean) + 0.004
    body = world.add_body(mass, mass * half**2 / 3.0, place, quaternion=(cos(turn), 0.0, sin(turn), 0.0))
    tips = [world.add_sphere(body, 0.004, (x, 0.0, 0.0)) for x in (-half, half)]
    floor, wall = (world.add_plane(None, (0.0, 0.0, 0.0), n) for n in ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0)))
    world.add_contact(tips, [floor, wall], ContactPair(STEEL, STEEL, friction=0.0, restitution=0.5))
    steps = round(0.26 / timestep)
    world.step(steps)
    height = world.position[body, 2] - 0.004
    speed = np.sqrt(1.5 * 9.81 * (half * sin(lean) - height))  # of the centre, which goes round the corner
    assert np.hypot(world.velocity[body, 0], world.velocity[body, 2]) == pytest.approx(speed, rel=2e-5)
    assert world.arrays.world["implicit"][0] > 0.7 * steps
