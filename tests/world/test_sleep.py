"""Which bodies sleep: what touches sleeps together, and what only passes by disturbs nobody."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from contactlaw import ContactPair
from contactlaw.world import World
from sims.heap import DEFAULT, poured
from sims.scene import NONE, Settings
from tests.world.world_scenes import FLOOR, FRICTION, RADIUS, balls, mass_of, steel_pair

LOW = RADIUS - 3.60201647e-7  # [m] height at which a ball rests on the floor


def sleeper_and_roller(timestep: float, place: tuple[float, float], speed: float) -> World:
    """A ball that stands on a floor, and one beside it, at x and y [m], that rolls along x [m/s]."""
    world = balls(steel_pair(restitution=0.5), [[0.0, 0.0, LOW], [*place, LOW]], [[0.0, 0.0, 0.0], [speed, 0.0, 0.0]],
                  planes=[FLOOR], gravity=9.81, timestep=timestep)  # fmt: skip
    world.place(1, spin=(0.0, speed / RADIUS, 0.0))
    return world


@pytest.mark.parametrize(("timestep", "speed", "gap"), [(2e-3, 1e-3, 2e-5), (2e-5, 1e-2, 2e-6)])
def test_what_rolls_by_neither_keeps_awake_nor_wakes(timestep: float, speed: float, gap: float) -> None:
    """So close that a bounce would reach the sleeper within a step, and without any loss."""
    world = sleeper_and_roller(timestep, (-500.0 * speed * timestep, 2.0 * RADIUS + gap), speed)
    world.step(100)
    before = world.save()
    assert world.asleep.tolist() == [True, False]
    for _ in range(90):
        world.step(10)
        assert world.asleep.tolist() == [True, False]
    for name in ("position", "velocity", "quaternion", "spin"):
        np.testing.assert_array_equal(world.arrays.bodies[name][1], before.bodies[name][1])
    assert world.velocity[1] == pytest.approx([speed, 0.0, 0.0], rel=1e-9, abs=1e-9)


@pytest.mark.parametrize(("speed", "sleeps"), [(1e-8, True), (1e-6, False)])
def test_what_rolls_with_a_billionth_of_its_elastic_energy_sleeps(speed: float, sleeps: bool) -> None:
    world = sleeper_and_roller(2e-3, (-4.0 * RADIUS, 0.0), speed)
    world.step(20)
    assert world.asleep.tolist() == [True, sleeps]


@pytest.mark.parametrize("speed", [1e-4, 1e-2])
def test_what_it_rolls_against_wakes(speed: float) -> None:
    """And not before; no energy comes from nothing."""
    world = sleeper_and_roller(2e-3, (-2.0 * RADIUS - 0.1 * speed, 0.0), speed)
    world.step()
    energy, woken = world.energy.total, False
    for k in range(1, 100):
        world.step()
        assert world.energy.total <= energy * (1.0 + 1e-12)
        energy = world.energy.total
        woken = woken or (k > 40 and not world.asleep[0])
        assert abs(k - 50) < 3 or woken == (k > 50)  # it touches after 0.1 s
    assert 0.8 * speed > world.velocity[0, 0] > world.velocity[1, 0] > 0.1 * speed


@pytest.mark.parametrize("seed", [0, 2])
def test_a_heap_sleeps_but_for_what_rolls_freely(seed: int) -> None:
    """In two seconds; a ball that rolls on the floor alone goes on for ever."""
    made = poured(Settings(NONE, timestep=2e-3), 64, seed=seed)
    made.start()
    made.step(1000)
    closed = made.world.contacts[made.world.contacts["closed"]]
    touching = np.bincount(closed["bodies"][closed["bodies"] >= 0], minlength=64)
    assert (made.world.asleep | (touching == 1)).all() and made.world.asleep.sum() >= 62


def test_a_heap_without_friction_sleeps() -> None:
    """All of it: its balls do not spin, which nothing would stop."""
    made = poured(Settings(NONE, timestep=2e-3), 27, o=SimpleNamespace(**(vars(DEFAULT) | {"friction": 0.0})))
    made.start()
    made.step(100)
    assert RADIUS * np.abs(made.world.spin).max() < 1e-12 * np.abs(made.world.velocity).max()
    made.step(500)
    assert made.world.asleep.all()


@pytest.mark.parametrize("gone", [lambda world: world.place(0, position=(1.0, 0.0, LOW)),
                                  lambda world: world.add_rule(0, [1, 2, 3])])  # fmt: skip
def test_what_has_lost_its_support_falls(gone) -> None:
    """Balls that sleep on one that is then placed elsewhere, or that no longer touches anything."""
    world = balls(steel_pair(restitution=0.5), [[0.0, 0.0, LOW + 2.0 * k * RADIUS] for k in range(3)], 0.0,
                  planes=[FLOOR], gravity=9.81, timestep=2e-3)  # fmt: skip
    world.step(100)
    assert world.asleep.all()
    before = world.position[1:, 2]
    gone(world)
    world.step(20)
    assert before - world.position[1:, 2] == pytest.approx(0.5 * 9.81 * 0.04**2, rel=0.02)  # what was pressed rebounds


def on_a_lift(speed: float = 0.0) -> tuple[World, int, int]:
    """A ball at rest on a kinematic plane that sinks; also their shapes' numbers."""
    world, mass = World(timestep=2e-3), mass_of(RADIUS)
    world.add_body(np.inf, 1.0, velocity=(0.0, 0.0, -speed))
    world.add_body(mass, 0.4 * mass * RADIUS**2, (0.0, 0.0, LOW))
    plane, ball = world.add_plane(0, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)), world.add_sphere(1, RADIUS)
    world.add_contact(plane, ball, steel_pair(restitution=0.5))
    world.step(100)
    return world, plane, ball


@pytest.mark.parametrize("sinks", [1e-4, 1e-3])
def test_what_sleeps_follows_a_support_that_is_placed_near_by(sinks: float) -> None:
    """So near that both stay in the list of near pairs: it hung in the air."""
    world, _, _ = on_a_lift()
    assert world.asleep[1]
    world.place(0, position=(0.0, 0.0, -sinks))
    world.step(200)
    assert world.position[1, 2] + sinks == pytest.approx(LOW, abs=1e-12)


@pytest.mark.parametrize("moved", [False, True])
def test_a_wall_that_is_put_into_what_sleeps_throws_it(moved: bool) -> None:
    """By the energy of the overlap, 2/5 k depth^2.5, less what the floor brakes in a step; the sleeper lay on in it."""
    world, _, ball = on_a_lift()
    depth, pair, stands = 1e-5, steel_pair(friction=0.0), world.add_body(np.inf, 1.0, (-1.0, 0.0, 0.0))
    if moved:
        world.add_contact(world.add_plane(stands, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)), ball, pair)
        world.step(100)
        assert world.asleep[1]
        world.place(stands, position=(depth - RADIUS, 0.0, 0.0))
    else:
        world.add_contact(world.add_plane(None, (depth - RADIUS, 0.0, 0.0), (1.0, 0.0, 0.0)), ball, pair)
    world.step()
    stiffness = 4.0 / 3.0 * pair.effective_modulus * RADIUS**0.5
    thrown = (0.8 * stiffness * depth**2.5 / mass_of(RADIUS)) ** 0.5 - FRICTION * 9.81 * world.timestep
    assert world.velocity[1, 0] == pytest.approx(thrown, rel=1e-3)


def test_a_kinematic_body_keeps_however_low_a_speed() -> None:
    """It fell asleep with what it carries."""
    world, _, _ = on_a_lift(1e-8)
    assert world.velocity[0, 2] == -1e-8
    assert world.position[:, 2] == pytest.approx([-2e-9, LOW - 2e-9], abs=1e-12)


def test_a_later_rule_holds_for_contacts_that_there_are() -> None:
    """Of a ball that sleeps on a slope: without friction it slides."""
    world, plane, ball = on_a_lift()
    world.place(0, quaternion=(1.0, 0.0, 1e-3, 0.0))
    world.place(1, velocity=(0.0, 0.0, 0.0))
    world.add_contact(plane, ball, steel_pair(friction=0.0, restitution=0.5))
    world.step(100)
    assert world.velocity[1, 0] == pytest.approx(9.81 * 2e-3 * 0.2, rel=1e-3)
    assert world.spin[1, 1] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("restitution", [0.5, 0.9])
def test_a_ball_sleeps_by_steps_of_a_third_of_an_impact(restitution: float) -> None:
    """Where rounding along a contact would keep it moving, as implicit steps damp little in that time."""
    world = balls(steel_pair(restitution=restitution), [[0.0, 0.0, LOW + 1e-3]], 0.0, planes=[FLOOR], gravity=9.81,
                  timestep=2.31e-4)  # fmt: skip
    world.step(5000)
    assert world.asleep.all()


def box_under_torque() -> tuple[World, int]:
    """A rubber box of 1 kg on a floor for a second, under 0.02 N m about the normal: less than friction's moment."""
    world = World(timestep=2e-3)
    body = world.add_body(1.0, 4e-4, (0.0, 0.0, 0.02))
    pair = ContactPair("rubber", "rubber", friction=0.8, restitution=0.3)
    world.add_contact(world.add_box(body, (0.02, 0.02, 0.02)), world.add_plane(None, *FLOOR), pair)
    world.apply_force(body, torque=(0.0, 0.0, 0.02))
    world.step(500)
    return world, body


def test_what_a_constant_torque_turns_against_friction_sleeps_on() -> None:
    """By the torque alone the box woke in each step."""
    world, body = box_under_torque()
    for _ in range(20):
        world.step()
        assert world.asleep[body]
    world.apply_force(body, torque=(0.0, 0.0, 0.5))
    world.step(5)
    assert not world.asleep[body] and world.spin[body, 2] > 1.0


def test_a_force_in_place_of_a_torque_of_the_same_number_is_felt() -> None:
    """By statics; a torque counted as the force at an arm of 1 m, so that one for the other changed nothing."""
    world, body = box_under_torque()
    assert world.asleep[body]
    world.apply_force(body, force=(0.0, 0.0, 0.02))
    world.step(500)
    assert world.contacts["force"][:, 2].sum() == pytest.approx(9.81 - 0.02, rel=1e-6)
