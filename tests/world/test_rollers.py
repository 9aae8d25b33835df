"""Cylinders near other shapes: how they turn about their own axis brings them no nearer."""

import pytest

from contactlaw import ContactPair
from contactlaw.world import World

STEEL = ContactPair("steel", "steel", friction=0.3, restitution=0.5)
RADIUS, SPEED, STEPS = 0.02, 0.5, 200


@pytest.mark.parametrize("length", [0.04, 0.05])  # within the width of the plates, and flush with their edges
def test_a_roller_between_two_plates_takes_implicit_steps(length):
    world = World(timestep=2e-3)
    plates = [world.add_box(None, (1.0, 0.05, 0.01), at=(0.0, 0.0, z)) for z in (-0.01, 2.0 * RADIUS + 2e-4 + 0.01)]
    mass = 0.5
    across = mass * (3.0 * RADIUS**2 + 4.0 * length**2) / 12.0
    roller = world.add_body(
        mass,
        (across, 0.5 * mass * RADIUS**2, across),
        position=(-0.2, 0.0, RADIUS),
        velocity=(SPEED, 0.0, 0.0),
        spin=(0.0, SPEED / RADIUS, 0.0),
    )
    world.add_contact(world.add_cylinder(roller, RADIUS, length, axis=(0.0, 1.0, 0.0)), plates, STEEL)
    world.step(STEPS)
    assert world.arrays.world["implicit"][0] > 0.95 * STEPS
    assert world.position[roller][0] == pytest.approx(-0.2 + SPEED * STEPS * 2e-3, rel=1e-6)
    assert world.spin[roller][1] == pytest.approx(SPEED / RADIUS, rel=1e-6)
