"""Border of height fields: walls and bottom of the block that they are the top of."""

import numpy as np
import pytest

from contactlaw import ContactPair
from contactlaw.world import World
from tests.world.world_scenes import steel_pair


def a_ball(world: World, **motion) -> tuple[int, int]:
    """A ball of 0.2 kg and 20 mm; the numbers of body and shape."""
    body = world.add_body(0.2, (4e-5, 5e-5, 6e-5), **motion)
    return body, world.add_sphere(body, 0.02)


def test_a_ball_that_goes_past_the_border_falls():
    world = World(timestep=2e-3)
    ground = world.add_height_field(None, np.zeros((3, 3)), (0.2, 0.2))
    body, shape = a_ball(world, position=(0.1, 0.0, 0.02), velocity=(1.0, 0.0, 0.0))
    world.add_contact(shape, ground, steel_pair(friction=0.3, restitution=0.5))
    world.step(40)
    assert world.position[body, 2] == pytest.approx(0.02, abs=1e-6)
    world.step(200)
    assert world.position[body, 2] < -0.3 and world.position[body, 0] > 0.22


@pytest.mark.parametrize("name", ["ball", "capsule", "egg", "box"])
@pytest.mark.parametrize(
    ("start", "velocity"),
    [
        ((0.3, 0.0, -0.05), (-1.0, 0.0, 0.0)),
        ((0.0, -0.3, -0.05), (0.0, 1.0, 0.0)),
        ((0.1, 0.1, -0.3), (0.0, 0.0, 1.0)),
    ],
    ids=["wall", "other wall", "bottom"],
)
def test_a_body_rebounds_from_the_walls_of_the_block_and_its_bottom(name, start, velocity):
    world = World(timestep=1e-3, gravity=(0.0, 0.0, 0.0))
    ground = world.add_height_field(None, np.zeros((3, 3)), (0.2, 0.2), base=0.1)
    body = world.add_body(0.2, (4e-5, 5e-5, 6e-5), position=start, velocity=velocity)
    shape = {
        "ball": lambda: world.add_sphere(body, 0.02),
        "capsule": lambda: world.add_capsule(body, 0.02, 0.03, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)),
        "egg": lambda: world.add_ellipsoid(body, (0.02, 0.03, 0.025)),
        "box": lambda: world.add_box(body, (0.03, 0.02, 0.02)),
    }[name]()
    world.add_contact(shape, ground, steel_pair(friction=0.0))
    world.step(200)
    assert world.velocity[body] == pytest.approx(-np.array(velocity), abs=1e-6)
    assert world.spin[body] == pytest.approx(0.0, abs=1e-5)


def test_a_ball_passes_below_the_block():
    world = World(timestep=1e-3, gravity=(0.0, 0.0, 0.0))
    ground = world.add_height_field(None, np.zeros((3, 3)), (0.2, 0.2), base=0.1)
    body, shape = a_ball(world, position=(-0.3, 0.0, -0.121), velocity=(1.0, 0.0, 0.0))
    world.add_contact(shape, ground, steel_pair(friction=0.0))
    world.step(600)
    assert world.position[body, 0] == pytest.approx(0.3, abs=1e-9)


@pytest.mark.parametrize("seed", [7, 25, 110, 150, 408])
def test_a_box_that_falls_on_the_border_gains_no_energy(seed):
    """Below the border its edges had contacts with opposite normals: some left with 40 times their energy, or NaN."""
    rng = np.random.default_rng(seed)
    heights = 0.015 * np.array([[1, 0, 1, 0, 1], [0, 2, 0, 2, 0], [1, 0, 1, 0, 1], [0, 2, 0, 2, 0], [1, 0, 1, 0, 1]])
    turn = rng.normal(size=4)
    turn /= np.linalg.norm(turn)
    place = (rng.choice([-1, 1]) * rng.uniform(0.45, 0.62), rng.uniform(-0.3, 0.3), 0.22)
    motion = {"velocity": (*rng.normal(size=2), -5.0), "spin": 6.0 * rng.normal(size=3)}
    world = World(timestep=1e-3)
    ground = world.add_height_field(None, heights, (0.53, 0.53))
    body = world.add_body(4.2, (0.03836, 0.01036, 0.035), position=place, quaternion=turn, **motion)
    box = world.add_box(body, (0.05, 0.15, 0.07))
    world.add_contact(box, ground, ContactPair("rubber", "steel", friction=0.8, restitution=0.5))
    before = sum(world.energy)
    for _ in range(120):
        world.step()
        assert sum(world.energy) <= before + 1e-9
