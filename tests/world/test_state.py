"""The memory of a world as a row of numbers: a run goes on to the bit."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from contactlaw.world import World
from contactlaw.world.state import read, size, write
from sims.heap import poured
from sims.scene import Settings
from tests.world.long_shapes import scene
from tests.world.world_scenes import FLOOR, RADIUS, balls, box_of_planes, steel_pair

MOTION = ("position", "velocity", "spin", "quaternion")
ROOM = 64


def row_of(world: World) -> np.ndarray:
    """Its packed state."""
    arrays = world.arrays.bound()
    row = np.zeros(size(ROOM, arrays.memory.shape[1], arrays.bodies.size, arrays.pairs.size))
    assert write(arrays.world[0], row) == 0
    return row


def again(make: Callable[[], World], world: World) -> World:
    """A world made anew, with the motion of another."""
    new = make()
    for name in (*MOTION, "axes", "momentum"):
        new.arrays.bodies[name] = world.arrays.bodies[name]
    return new


def goes_on(make: Callable[[], World], before: int, after: int) -> tuple[int, int]:
    """Whether a copy goes on as the world does; returns how many contacts were closed, and bodies asleep."""
    world = make()
    world.step(before)
    row = row_of(world)
    new = again(make, world)
    assert read(new.arrays.bound().world[0], np.uint64(row.ctypes.data), row.size) == 0
    np.testing.assert_array_equal(new.asleep, world.asleep)
    for _ in range(after):
        world.step()
        new.step()
        for name in MOTION:
            np.testing.assert_array_equal(world.arrays.bodies[name], new.arrays.bodies[name])
        np.testing.assert_array_equal(row_of(world), row_of(new))
    return int(row[0]), int(world.asleep.sum())


def single(timestep: float, restitution: float) -> World:
    """A ball that is about to hit a floor."""
    return balls(steel_pair(restitution=restitution), [[0.0, 0.0, RADIUS + 1e-4]], [0.3, 0.0, -1.0], planes=[FLOOR],
                 gravity=9.81, timestep=timestep)  # fmt: skip


def two(timestep: float, restitution: float) -> World:
    """Two balls that are about to meet, one of which spins."""
    places, velocities = [[0.0, 0.0, 0.0], [2.0 * RADIUS - 0.01, 0.03, 1e-3]], [[1.0, 0.0, 0.0], [-1.0, 0.2, 0.0]]
    return balls(steel_pair(restitution=restitution), places, velocities, [[3.0, 9.0, 100.0], [0.0, 0.0, 0.0]],
                 timestep=timestep)  # fmt: skip


def eight(timestep: float, restitution: float, draw: int = 1) -> World:
    """Eight balls in a narrow box."""
    rng = np.random.default_rng(draw)
    corners = 0.0252 * np.array([(i, j, k) for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)])
    velocities, spins = 3.0 * rng.normal(size=(8, 3)), 30.0 * rng.normal(size=(8, 3))
    walls = box_of_planes(0.055)
    pair = steel_pair(restitution=restitution)
    return balls(pair, corners, velocities, spins, planes=walls, gravity=9.81, timestep=timestep)


def first_closed(make: Callable[[], World]) -> int:
    """Steps after which a contact is closed for the first time, or 2."""
    world = make()
    for step in range(1, 2000):
        world.step()
        if world.contacts["closed"].any():
            return step
    return 2


@pytest.mark.parametrize("timestep", [2e-3, 1e-4, 1e-5])
@pytest.mark.parametrize("restitution", [1.0, 0.8])
@pytest.mark.parametrize("kind", [single, two])
def test_one_contact_goes_on_to_the_bit(kind, restitution: float, timestep: float) -> None:
    before = first_closed(lambda: kind(timestep, restitution))
    closed, _ = goes_on(lambda: kind(timestep, restitution), before, 60)
    assert closed == 1 or timestep == 2e-3


@pytest.mark.parametrize("timestep", [2e-3, 1e-4, 1e-5])
@pytest.mark.parametrize("restitution", [1.0, 0.8])
def test_eight_balls_go_on_to_the_bit(restitution: float, timestep: float) -> None:
    closed = 0
    for before in (first_closed(lambda: eight(timestep, restitution)), 30, 71):
        closed += goes_on(lambda: eight(timestep, restitution), before, 200)[0]
    assert closed > 0


@pytest.mark.parametrize("spin", [0.3, 3.0, 9.0, 30.0])
def test_a_ball_that_pivots_in_implicit_steps_goes_on_to_the_bit(spin: float) -> None:
    """The tangent of its contact turns by up to some hundredths of a radian a step."""

    def make() -> World:
        return balls(steel_pair(restitution=0.8), [[0.0, 0.0, RADIUS]], [0.1, 0.0, 0.0], [[0.0, 0.0, spin]],
                     planes=[FLOOR], gravity=9.81, timestep=2e-3)  # fmt: skip

    assert goes_on(make, 40, 20)[0] == 1


@pytest.mark.parametrize("first", range(0, 60, 20))
def test_random_draws_go_on_to_the_bit(first: int) -> None:
    """In long steps, with near pairs listed at other times than in the original, often within a step."""
    closed = 0
    for draw in range(first, first + 20):
        closed += goes_on(lambda: eight(2e-3, (1.0, 0.8)[draw % 2], draw), (5, 30, 71)[draw % 3], 30)[0]  # noqa: B023
    assert closed > 0


@pytest.mark.parametrize("by", ["row", "save"])
def test_a_heap_set_back_at_any_step_goes_on_to_the_bit(by: str) -> None:
    """While it lands, lies and falls asleep; into a world that has done something else meanwhile."""
    world, other = (poured(Settings("none", timestep=2e-3), 8) for _ in range(2))
    for one in (world, other):
        one.start()
    world, other = world.world, other.world
    world.step(60)
    other.step(110)
    kept = []
    for _ in range(120):
        kept.append((world.save(), row_of(world)))
        world.step()
    assert world.asleep.all()
    for first in range(100):
        saved, row = kept[first]
        if by == "save":
            other.restore(saved)
        else:
            for name in (*MOTION, "axes", "momentum"):
                other.arrays.bodies[name] = saved.bodies[name]
            assert read(other.arrays.bound().world[0], np.uint64(row.ctypes.data), row.size) == 0
        for number in range(first + 1, first + 20):
            other.step()
            for name in MOTION:
                assert np.array_equal(other.arrays.bodies[name], kept[number][0].bodies[name]), (first, number)
            assert np.array_equal(row_of(other), kept[number][1]), (first, number)


@pytest.mark.parametrize("timestep", [2e-3, 1e-4])
def test_sleepers_go_on_to_the_bit(timestep: float) -> None:
    """Three sleep, and a fourth comes and wakes one."""

    def make() -> World:
        z = RADIUS + 1e-4
        places = [[0, 0, z], [0.2, 0, z], [0.1, 0, z], [-2.0, 0, RADIUS]]
        velocities = [[0, 0, 0], [0, 0, 0], [0, 0, 0], [3.0, 0, 0]]
        pair = steel_pair(restitution=0.5)
        return balls(pair, places, velocities, planes=[FLOOR], gravity=9.81, timestep=timestep)

    world = make()
    world.step(round(0.55 / timestep))
    assert world.asleep[:3].all()
    closed, asleep = goes_on(make, round(0.55 / timestep), round(0.3 / timestep))
    assert closed == 4 and asleep < 3


def test_a_sleeper_that_a_slow_roller_comes_to_goes_on_to_the_bit() -> None:
    """It sleeps on until it is touched, also where that is set back, and long implicit steps look ahead."""

    def make() -> World:
        z, speed = RADIUS - 4e-8, 1e-4
        return balls(steel_pair(restitution=0.5), [[0, 0, z], [-2.0 * RADIUS - 1e-5, 0, z]], [[0, 0, 0], [speed, 0, 0]],
                     [[0, 0, 0], [0, speed / RADIUS, 0]], planes=[FLOOR], gravity=9.81, timestep=2e-3)  # fmt: skip

    assert goes_on(make, 35, 5) == (2, 1)
    assert goes_on(make, 35, 40)[1] == 0


@pytest.mark.parametrize(("timestep", "steps", "draws"), [(1e-5, 200, 1), (2e-3, 40, 6)])
@pytest.mark.parametrize("kind", ["crossing capsules", "capsule on edges", "free box"])
def test_bodies_that_tumble_go_on_to_the_bit(kind: str, timestep: float, steps: int, draws: int) -> None:
    """In long steps too, in which times of impact are found in many looks, from bounds that the original has not."""
    for draw in range(1, 1 + draws):
        goes_on(lambda: scene(kind, draw, timestep, steel_pair(0.3, 0.8)), 37, steps)  # noqa: B023


def test_a_row_of_a_world_at_rest_is_zeros_and_too_little_room_is_told() -> None:
    world = eight(1e-5, 1.0)
    assert not row_of(world).any()
    world.step(30)
    arrays = world.arrays.bound()
    closed = int(world.contacts["closed"].sum())
    assert closed > 0
    row = np.zeros(size(0, arrays.memory.shape[1], arrays.bodies.size, arrays.pairs.size))
    assert write(arrays.world[0], row) == closed
