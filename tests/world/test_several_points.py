"""Restitution of bodies that land on several points at once: flat, on an edge, on a joint."""

from __future__ import annotations

from math import cos, sin

import numpy as np
import pytest

from contactlaw import ContactPair
from contactlaw.world import World
from contactlaw.world.trees.description import Joint, Part, Tree

SIZES = {"cube": (0.02, 0.02, 0.02), "plate": (0.02, 0.02, 0.004), "tower": (0.01, 0.01, 0.04), "can": (0.03, 0.03)}
"""Half lengths of boxes; radius and half length of a cylinder [m]."""


@pytest.mark.heavy
@pytest.mark.parametrize(
    ("name", "on", "off"),
    [
        *((name, on, 1e-3) for name in SIZES for on in ("plane", "box")),
        ("cube", "slide", 0.02),
        ("tower", "edge", 2e-3),
    ],
)
def test_what_lands_on_several_points_rebounds_as_its_pair_says(name: str, on: str, off: float) -> None:
    """By energy. With dampers that each belong to the mass of one contact alone it was 0.29 to 0.57 in place of 0.5."""
    world, size = World(gravity=0.0, timestep=1e-3), SIZES[name]
    half, mass = size[-1], 0.1
    x, y, z = (size[0], size[0], half) if name == "can" else size
    inertia = mass / 3.0 * np.array([y * y + z * z, x * x + z * z, x * x + y * y])
    if on == "slide":
        joint = Joint("slide", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
        _, (body,) = world.add_tree(Tree([Part(mass, inertia, (joint,), -1, (0.0, 0.0, half + 1e-4))]), v=[-0.5])
    elif on == "edge":
        turn = (cos(0.2), sin(0.2), 0.0, 0.0)
        height = y * sin(0.4) + z * cos(0.4)
        body = world.add_body(mass, inertia, (0.0, 0.0, height), (0.0, 0.0, -0.5), turn)
    else:
        body = world.add_body(mass, inertia, (0.0, 0.0, half + 1e-4), (0.0, 0.0, -0.5))
    shape = world.add_cylinder(body, *size) if name == "can" else world.add_box(body, size)
    if on == "box":
        floor = world.add_box(None, (0.1, 0.1, 0.05), (0.0, 0.0, -0.05))
    else:
        floor = world.add_plane(None, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    world.add_contact(shape, floor, ContactPair("steel", "steel", 0.0, 0.5))
    before = world.energy.total
    world.step(12)
    assert not world.contacts["closed"].any()
    if on == "edge":  # the point of the edge beneath the centre leaves as fast as half of what it came with
        r = 0.1 * y  # of the rounding
        arm = np.array([0.0, (z - r) * sin(0.4) - (y - r) * cos(0.4), 0.0])
        assert (world.velocity[body] + np.cross(world.spin[body], arm))[2] == pytest.approx(0.25, rel=off)
    else:
        assert world.energy.total == pytest.approx(0.25 * before, rel=2.0 * off)


@pytest.mark.heavy
@pytest.mark.parametrize("restitution", [0.05, 0.2, 0.5, 0.9])
@pytest.mark.parametrize("feet", [4, 8, 16])
def test_many_feet_rebound_as_their_pair_says_with_few_substeps_too(feet: int, restitution: float) -> None:
    """By the speed. Each damper solved with all others, more than share the mass, gave 0.24 for 0.2."""
    world = World(gravity=0.0, timestep=2e-3)
    floor = world.add_plane(None, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    body = world.add_body(1.0, (5e-3, 5e-3, 1e-2), (0.0, 0.0, 0.0203), (0.0, 0.0, -1.0))
    turns = 2.0 * np.pi / feet * np.arange(feet)
    balls = [world.add_sphere(body, 0.02, (0.1 * cos(turn), 0.1 * sin(turn), 0.0)) for turn in turns]
    world.add_contact(balls, floor, ContactPair("steel", "steel", 0.0, restitution))
    world.step(5)
    assert world.velocity[body, 2] == pytest.approx(restitution, abs=1e-4 if feet == 4 else 1e-2)
