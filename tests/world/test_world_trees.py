"""Contacts of bodies that joints hold: energy, momentum, rest, and a free body as a tree of six."""

from __future__ import annotations

import numpy as np
import pytest

from contactlaw import ContactPair, Material
from contactlaw.world import World
from contactlaw.world.trees.description import Joint, Part, Tree
from tests.world.chains import Chain, Link
from tests.world.jointed_scenes import TIP, arm_over_floor, pendulum, pendulum_between_walls
from tests.world.world_scenes import FLOOR, RADIUS, mass_of, steel_pair


@pytest.mark.parametrize("timestep", [2e-3, 5e-3, 1e-2])
def test_a_pendulum_keeps_its_energy_when_its_tip_strikes(timestep: float) -> None:
    """Over its energy above rest, elastic, without friction; what an impact leaves goes with substeps squared."""
    lowest = World()
    lowest.add_tree(pendulum()[0])
    for seed in (1, 4, 5):
        rng = np.random.default_rng(seed)
        world = pendulum_between_walls([0.2 * rng.normal(), -0.1], 8.0 * rng.normal(size=2), timestep=timestep)
        first = before = world.energy.total
        scale = first - lowest.energy.total
        impacts, errors = 0, []
        while impacts < 100:
            world.step()
            rows = world.contacts
            if rows.size == 0 or rows["closed"].any():
                continue
            errors.append(abs(world.energy.total - before) / scale / rows["touches"].sum())
            impacts += rows["touches"].sum()
            before = world.energy.total
        assert np.median(errors) < (1e-5 if timestep == 2e-3 else 1.1e-5)
        assert abs(world.energy.total - first) < 1e-3 * scale
        assert world.arrays.world["late"][0] == 0


@pytest.mark.parametrize("restitution", [0.02, 0.1, 0.5, 1.0])
@pytest.mark.parametrize("timestep", [2e-3, 5e-3, 1e-2])
def test_an_arm_that_falls_stays_down(restitution: float, timestep: float) -> None:
    for height in (0.03, 0.1, 0.3):
        world = arm_over_floor(height, restitution, timestep=timestep)
        first = top = world.energy.total
        for _ in range(round(1.0 / timestep)):
            world.step()
            top = max(top, world.energy.total)
        assert top <= first * (1.0 + (1e-4 if restitution == 1.0 else 1e-9))
        if restitution == 1.0:
            assert world.energy.total == pytest.approx(first, rel=1e-4)
        else:
            assert np.abs(world.tree(0)[1]).max() < (1e-9 if restitution < 0.5 else 1e-6)
            assert 0.0 < world.contacts["overlap"].max() < 1e-6


def ball(tree: bool, timestep: float, at=(0.0, 0.0, 0.0)) -> World:
    """A spinning ball, free or as a tree of six, that is about to touch the floor."""
    world = World(timestep=timestep)
    floor = world.add_plane(None, *FLOOR)
    mass = mass_of(RADIUS)
    place, velocity, spin = (0.0, 0.0, RADIUS + 0.01), (0.5, 0.2, -1.0), (10.0, 20.0, 5.0)
    if tree:
        chain = Chain([Link(mass, 0.4 * mass * RADIUS**2)], free=True)
        _, (body,) = world.add_tree(chain, [*place, 1.0, 0.0, 0.0, 0.0], [*velocity, *spin])
    else:
        body = world.add_body(mass, 0.4 * mass * RADIUS**2, place, velocity, spin=spin)
    world.add_contact(world.add_sphere(body, RADIUS, at), floor, steel_pair(0.3, 0.9))
    return world


@pytest.mark.parametrize("at", [(0.0, 0.0, 0.0), (0.004, 0.002, -0.003)])
def test_a_free_body_is_a_tree_of_six(at) -> None:
    """Windows of one length, those of short steps: a schedule of its own moves impacts by what substeps leave."""
    free, tree = ball(False, 1e-5, at), ball(True, 1e-5, at)
    for _ in range(1200):
        free.step()
        tree.step()
    assert free.arrays.world["kicks"][0] > 90 and free.velocity[0, 2] > 0.3
    np.testing.assert_allclose(tree.position, free.position, atol=1e-9)
    np.testing.assert_allclose(tree.velocity, free.velocity, atol=1e-9)
    np.testing.assert_allclose(tree.spin, free.spin, atol=1e-9 * 20.0)
    np.testing.assert_allclose(tree.quaternion, free.quaternion, atol=1e-9)


@pytest.mark.parametrize("timestep", [2e-3, 1e-5])
def test_a_chain_that_hits_a_ball_keeps_linear_momentum(timestep: float) -> None:
    """A free chain of two bodies strikes a free ball, with friction: to what its mass matrix is held for."""
    world = World(gravity=0.0, timestep=timestep)
    links = [Link(0.1, (1e-5, 1e-4, 1e-4), (-0.05, 0.0, 0.0), anchor=(0.05, 0.0, 0.0)) for _ in range(2)]
    chain = Chain(links, free=True)
    _, bodies = world.add_tree(chain, [*chain.start[:7], 0.5], [0.0, 0.0, -1.0, 0.0, 3.0, 0.0, 5.0])
    tip = world.add_sphere(bodies[1], TIP, (0.05, 0.0, 0.0))
    x = world.position[1] + [0.03, 0.005, -0.06]
    mass = mass_of(RADIUS)
    other = world.add_body(mass, 0.4 * mass * RADIUS**2, x, (0.0, 0.0, 1.0), spin=(0.0, 30.0, 10.0))
    world.add_contact(tip, world.add_sphere(other, RADIUS), steel_pair(0.3, 1.0))
    (linear, angular), energy = world.momentum, world.energy.total
    world.step(round(0.04 / timestep))
    assert world.arrays.world["kicks"][0] > 90
    size = mass + 0.2
    assert np.abs(world.momentum[0] - linear).max() < 3e-6 * size
    assert np.abs(world.momentum[1] - angular).max() < 3e-6 * size * 0.1
    assert 0.5 * energy < world.energy.total < energy * (1.0 + 1e-5)


def test_saved_in_mid_contact_a_tree_goes_on_to_the_bit() -> None:
    world = arm_over_floor(0.03, 0.9, timestep=1e-5)
    while world.contacts.size == 0 or not world.contacts["closed"].any():
        world.step()
    saved, ends = world.save(), []
    for _ in range(2):
        world.restore(saved)
        world.step(30)
        ends.append(world.tree(0))
    np.testing.assert_array_equal(ends[0], ends[1])


def test_two_bodies_of_a_tree_may_touch_each_other() -> None:
    """A jack-knife of two arms without gravity: ball strikes ball, elastic, again and again."""
    links = [
        Link(0.1, 1e-4, (-0.1, 0.0, 0.0)),
        Link(0.1, 1e-4, (-0.1, 0.0, 0.0), anchor=(0.1, 0.0, 0.0)),
    ]
    world = World(gravity=0.0, timestep=2e-3)
    _, bodies = world.add_tree(Chain(links), [0.0, 2.0], [0.0, 10.0])
    ends = [world.add_sphere(body, 0.02, (0.05 * s, 0.0, 0.0)) for body, s in zip(bodies, (-1.0, 1.0), strict=True)]
    world.add_contact(ends[0], ends[1], steel_pair(0.0))
    energy = world.energy.total
    world.step(500)
    assert world.arrays.world["kicks"][0] > 200
    assert world.energy.total == pytest.approx(energy, rel=5e-5)


def test_an_arm_on_a_turntable_lands_alike_however_fast_that_turns() -> None:
    """The centre of mass is on the axis. At 3.4 rad a step a turntable needs ten substeps of a step, and no more."""
    soft = ContactPair(Material(2e5, 0.45), Material(2e5, 0.45), 0.0, 0.5)
    heights, kicks = [], []
    for rate in (0.0, 1700.0):
        world = World(timestep=2e-3)
        arm = Link(0.1, 4e-4, (-1.0, 0.0, 0.0), anchor=(-1.0, 0.0, 0.0))
        _, bodies = world.add_tree(Chain([Link(1.0, 1e-2, axis=(0.0, 0.0, 1.0)), arm]), None, [rate, 0.0])
        floor = world.add_plane(None, (0.0, 0.0, -0.0205), (0.0, 0.0, 1.0))
        world.add_contact(world.add_sphere(bodies[1], 0.02, (0.0, 0.0, 0.0)), floor, soft)
        heights.append([])
        for _ in range(100):
            world.step()
            heights[-1].append(world.position[bodies[1], 2])
        kicks.append(world.arrays.world["kicks"][0])
    np.testing.assert_allclose(heights[1], heights[0], atol=2e-5)
    assert kicks[1] < 11 * 100


@pytest.mark.parametrize(("timestep", "error"), [(1e-3, 2e-5), (5e-3, 2e-4)])
def test_a_scotch_yoke_turns_as_its_inertias_say(timestep: float, error: float) -> None:
    """The pin of a balanced crank just touches both faces of the slot: at first no centre of mass accelerates, and the
    pin flew a step into them, which gave 2e7 times the energy. Judge: (I + m r^2 sin^2 q) q'^2 is constant."""
    inertia, mass, arm, rate, seconds = 2e-3, 0.5, 0.05, 20.0, 0.5
    world = World(timestep=timestep, gravity=0.0)
    number, (turning,) = world.add_tree(Tree([Part(0.1, inertia, [Joint("hinge")])]), None, [rate])
    slide = Joint("slide", axis=(1.0, 0.0, 0.0))
    _, (sliding,) = world.add_tree(Tree([Part(mass, 1e-3, [slide], position=(arm, 0.0, 0.0))]))
    pin = world.add_sphere(turning, 0.01, (arm, 0.0, 0.0))
    faces = [world.add_box(sliding, (0.02, 0.03, 0.1), (s * 0.03, 0.0, 0.0)) for s in (-1.0, 1.0)]
    world.add_contact(pin, faces, steel_pair(0.0, 0.5))
    energy = world.energy.total
    world.step(round(seconds / world.timestep))
    assert world.energy.total == pytest.approx(energy, rel=error)
    angles = np.linspace(0.0, world.tree(number)[0][0], 10001)
    times = np.sqrt((inertia + mass * arm**2 * np.sin(angles) ** 2) / inertia) / rate
    assert np.trapezoid(times, angles) == pytest.approx(seconds, rel=error)
