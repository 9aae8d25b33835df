"""The chain of hinges by itself: its equations of motion, and free flight."""

from __future__ import annotations

import numpy as np
import pytest

from contactlaw.world import World
from contactlaw.world.trees.tree_records import numbers
from tests.world.chains import Chain, Link
from tests.world.jointed_scenes import UPPER, mass_matrix, pendulum


def test_a_double_pendulum_is_that_of_the_textbook() -> None:
    """Mass matrix and accelerations in closed form, for absolute angle of the first rod, relative of the second."""
    rng = np.random.default_rng(0)
    chain, _ = pendulum()
    (m1, i1, c1), (m2, i2, c2) = ((one.mass, one.inertia[1], one.hinge[2]) for one in chain.links)
    world = World(gravity=9.81)
    world.add_tree(chain)
    for _ in range(5):
        q, v = rng.uniform(-3.0, 3.0, 2), 6.0 * rng.normal(size=2)
        world.place_tree(0, q, v)
        both = m2 * UPPER * c2 * np.cos(q[1])
        own = i2 + m2 * c2**2
        mass = np.array([[i1 + m1 * c1**2 + m2 * UPPER**2 + own + 2.0 * both, own + both], [own + both, own]])
        turn = m2 * UPPER * c2 * np.sin(q[1])
        force = np.array([turn * (2.0 * v[0] + v[1]) * v[1], -turn * v[0] ** 2])
        low = m2 * c2 * np.sin(q.sum())
        force -= 9.81 * np.array([(m1 * c1 + m2 * UPPER) * np.sin(q[0]) + low, low])

        np.testing.assert_allclose(mass_matrix(world.arrays, 0), mass, rtol=1e-12)
        np.testing.assert_allclose(numbers(world.arrays, 0, "a"), np.linalg.solve(mass, force), rtol=1e-12)


def swing(timestep: float) -> tuple[float, np.ndarray]:
    """Change of energy [J] and end of a double pendulum that swings far for a second."""
    world = World(timestep=timestep)
    world.add_tree(pendulum()[0], [1.5, -1.0], [3.0, -5.0])
    first = world.energy.total
    world.step(round(1.0 / timestep))
    return world.energy.total - first, world.tree(0)[0]


def test_free_swinging_is_of_fourth_order() -> None:
    """In steps so short that the flight takes them whole."""
    steps = [1.6e-3, 8e-4, 4e-4]
    exact = swing(5e-5)[1]
    found = [np.abs(swing(step)[1] - exact).max() for step in steps]
    assert np.polyfit(np.log(steps), np.log(found), 1)[0] > 3.8
    assert abs(swing(1e-3)[0]) < 3e-8


def test_a_chain_on_a_free_base_keeps_its_momenta() -> None:
    """Three bodies with hinges about different axes tumble without gravity."""
    rng = np.random.default_rng(2)
    half = (0.1, 0.0, 0.0)
    axes = np.eye(3)[[1, 2, 0]]
    links = [Link(0.3 + 0.1 * i, (1e-3, 2e-3, 2.5e-3), (-0.1, 0.0, 0.0), axes[i], half) for i in range(3)]
    world = World(gravity=0.0, timestep=2e-3)
    chain = Chain(links, free=True)
    world.add_tree(chain, chain.start, 3.0 * rng.normal(size=chain.v_size))
    (linear, angular), energy = world.momentum, world.energy.total
    world.step(200)
    np.testing.assert_allclose(world.momentum[0], linear, atol=1e-7 * np.linalg.norm(linear))
    np.testing.assert_allclose(world.momentum[1], angular, atol=1e-7 * np.linalg.norm(angular))
    assert world.energy.total == pytest.approx(energy, rel=1e-7)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: Chain([]), "links: is empty"),
        (lambda: Chain([Link(1.0, np.eye(3))]), r"inertia: shape \(3, 3\); must be one number or \(3,\)"),
    ],
)
def test_bad_chains_are_named(call, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call()


def test_bad_coordinates_are_named() -> None:
    world = World()
    tree, bodies = world.add_tree(pendulum()[0])
    with pytest.raises(ValueError, match=r"v: shape \(3,\); must be \(2,\)"):
        world.place_tree(tree, np.zeros(2), np.zeros(3))
    with pytest.raises(ValueError, match="there are 1 trees"):
        world.tree(1)
    with pytest.raises(ValueError, match="belongs to a tree"):
        world.place(bodies[0], velocity=(0.0, 0.0, 1.0))
