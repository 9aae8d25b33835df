"""How bodies move between contacts: tumbling, planes on bodies that move, and what is near what."""

from __future__ import annotations

import numpy as np
import pytest

from contactlaw.world import World
from contactlaw.world.data.frames import matrix_of, quaternion_of
from tests.world.world_scenes import RADIUS, balls, box_of_planes, mass_of, steel_pair

INERTIA = (1e-4, 2e-4, 2.9e-4)


def tumbling(timestep: float, spin=(1.0, 30.0, 0.5)) -> World:
    """A body about its middle axis."""
    world = World(gravity=0.0, timestep=timestep)
    world.add_body(0.1, INERTIA, spin=spin)
    return world


@pytest.mark.parametrize("timestep", [1e-3, 1e-2])
def test_tumbling_keeps_energy_and_momentum_to_rounding(timestep: float) -> None:
    world = tumbling(timestep)
    energy, momentum = world.energy.kinetic, world.momentum[1]
    least = 1.0
    for _ in range(100):
        world.step(round(0.02 / timestep))
        least = min(least, matrix_of(world.quaternion[0])[1, 1])
    assert least < -0.9  # it has turned over
    assert world.energy.kinetic == pytest.approx(energy, rel=1e-12)
    np.testing.assert_allclose(world.momentum[1], momentum, atol=1e-12 * np.linalg.norm(momentum))


def test_tumbling_is_of_second_order() -> None:
    ends = []
    for timestep in (4e-3, 2e-3, 1e-3, 2.5e-5):
        world = tumbling(timestep, (3.0, 10.0, 5.0))
        world.step(round(0.4 / timestep))
        ends.append(world.quaternion[0])
    found = [np.abs(end - ends[-1]).max() for end in ends[:-1]]
    assert np.polyfit(np.log([4.0, 2.0, 1.0]), np.log(found), 1)[0] == pytest.approx(2.0, abs=0.2)
    assert found[-1] < 1e-4


def test_a_full_inertia_is_that_of_its_principal_axes() -> None:
    turn = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])
    full, plain = World(gravity=0.0), World(gravity=0.0)
    World().add_body(1.0, np.diag([0.1, 0.1, 0.1]) + 1e-18 * turn)  # what rounding leaves of zeros may differ
    spin = np.array([5.0, 20.0, 1.0])
    full.add_body(0.1, turn @ np.diag(INERTIA) @ turn.T, spin=turn @ spin)
    plain.add_body(0.1, INERTIA, spin=spin)
    for world in (full, plain):
        world.step(200)
    np.testing.assert_allclose(full.spin[0], turn @ plain.spin[0], atol=1e-9)
    assert full.quaternion[0] == pytest.approx(_turned(full, turn, plain), abs=1e-9)


def _turned(full: World, turn: np.ndarray, plain: World) -> np.ndarray:
    """Quaternion of R diag R^T for the plain body's R, with the sign of the full one's."""
    q = quaternion_of(turn @ matrix_of(plain.quaternion[0]) @ turn.T)
    return q * np.sign(q @ full.quaternion[0])


def test_a_ball_between_plates_that_are_bodies_keeps_all_momentum() -> None:
    """Two plates, planes on bodies of their own, close on a ball; without friction, elastic."""
    world = World(gravity=0.0, timestep=1e-3)
    plates = []
    for side in (1.0, -1.0):
        body = world.add_body(0.5, 1e-2, (0.0, 0.0, -0.06 * side), (0.0, 0.0, side), spin=(0.3, 0.1, 0.0))
        plates.append(world.add_plane(body, (0.0, 0.0, 0.0), (0.0, 0.0, side)))
    ball = world.add_sphere(world.add_body(mass_of(RADIUS), 1e-4, (0.002, 0.0, 0.0)), RADIUS)
    world.add_contact(ball, plates, steel_pair(0.2))
    linear, angular = world.momentum
    energy = world.energy.total
    touched = 0
    for _ in range(200):
        world.step()
        touched += world.contacts.size
    assert touched > 2
    assert np.abs(world.momentum[0] - linear).max() < 1e-14
    assert np.abs(world.momentum[1] - angular).max() < 1e-15
    assert 0.9 * energy < world.energy.total < energy * (1.0 + 1e-5)


def test_near_pairs_hold_all_that_touch() -> None:
    """Balls of three sizes in a box, against a search through all pairs; nobody is found closed too late."""
    rng = np.random.default_rng(5)
    half, count = 0.2, 60
    radii = rng.choice([0.004, 0.01, 0.03], size=count)
    places = []
    while len(places) < count:
        x = rng.uniform(-half + 0.031, half - 0.031, 3)
        if all(np.linalg.norm(x - y) > radii[len(places)] + r for y, r in zip(places, radii, strict=False)):
            places.append(x)
    made = balls(steel_pair(0.1, 0.9), places, 3.0 * rng.normal(size=(count, 3)), radius=radii,
                 planes=box_of_planes(half), timestep=2e-3)  # fmt: skip
    first, second = np.triu_indices(count, 1)
    for _ in range(100):
        made.step()
        x = made.position
        overlap = radii[first] + radii[second] - np.linalg.norm(x[first] - x[second], axis=1)
        closed = made.contacts["closed"] & (made.contacts["bodies"][:, 1] >= 0)
        assert (overlap > 0.0).sum() == closed.sum()
        assert np.abs(x).max() < half
    assert made.arrays.world["late"][0] == 0
    assert made.arrays.world["kicks"][0] > 1e4
    assert made.energy.total > 0.0


@pytest.mark.parametrize("timestep", [1e-3, 1e-2])
@pytest.mark.parametrize("mass", [np.inf, 1e3])
def test_a_ball_is_taken_along_by_a_face_that_turns_towards_it(mass: float, timestep: float) -> None:
    """The ball just touches, and nothing closes the gap but that the face turns: the first substep was the whole step,
    and it flew off at 150 m/s. Judge: in the frame of the face it slides by s'' = omega^2 s, at the height h."""
    rate, depth, radius, seconds = 20.0, 0.1, 0.01, 0.02
    world = World(timestep=timestep, gravity=0.0)
    table = world.add_body(mass, 1e3, spin=(0.0, rate, 0.0))
    ball = world.add_body(0.05, 2e-6, (0.0, 0.0, depth + radius))
    face = world.add_box(table, (0.3, 0.1, depth))
    world.add_contact(world.add_sphere(ball, radius), face, steel_pair(0.0, 0.5))
    world.step(round(seconds / timestep))
    angle = rate * seconds
    along, up = np.array([np.cos(angle), 0.0, -np.sin(angle)]), np.array([np.sin(angle), 0.0, np.cos(angle)])
    slides = (1.0 - np.cosh(angle)) * along + np.sinh(angle) * up
    assert world.velocity[ball] == pytest.approx(rate * (depth + radius) * slides, abs=2e-3)
