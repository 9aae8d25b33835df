"""What flies past another body by its exact flight is not left inside it by the engine, which turns it once a step."""

from __future__ import annotations

import numpy as np
import pytest

from contactlaw import ContactPair
from sims.scene import Settings
from sims.worlds import Tuning, World, new_world

HALF, MASS = np.array([0.03, 0.02, 0.012]), 0.45  # [m], [kg]
INERTIA = MASS / 3.0 * (HALF @ HALF - HALF * HALF)
ROUNDING = 0.1 * HALF.min()
DT, SPIN, CLEAR = 1e-2, 58.0, 1e-6  # [s], [rad/s], [m] by which the exact flight misses the floor
PAIR = ContactPair("steel", "steel", friction=0.3, restitution=0.9)


def thrown(engine: str, spin: np.ndarray, height: float, integrator: str = "Euler", *, dt=DT, floor=True) -> World:
    """A box that turns in one place, without gravity."""
    world = new_world(Settings(engine, timestep=dt), (0.0, 0.0, 0.0), Tuning(integrator))
    world.solid("box", "box", HALF, MASS, INERTIA, [0.0, 0.0, height], np.zeros(3), spin, np.eye(3))
    if floor:
        world.plane("floor")
        world.contact("box", "floor", PAIR)
    world.start()
    return world


def reach(world: World) -> float:
    """How far the box reaches down from its centre [m]."""
    down = np.abs(world.read().rotation[0][2])
    return float(down @ (HALF - ROUNDING)) + ROUNDING


def furthest(spin: np.ndarray) -> float:
    """How far it reaches down within a step, by its exact flight [m]."""
    flight, found = thrown("none", spin, 1.0, dt=1e-3 * DT, floor=False), 0.0
    for _ in range(1000):
        found = max(found, reach(flight))
        flight.step()
    return max(found, reach(flight))


@pytest.mark.parametrize("setup", ["pybullet", "Euler", "RK4", "implicit", "implicitfast"])
def test_a_box_that_turns_past_the_floor_is_not_left_in_it(setup):
    engine, integrator = ("pybullet", "Euler") if setup == "pybullet" else ("mujoco", setup)
    pytest.importorskip(engine)
    rng, left_in = np.random.default_rng(1), 0
    for _ in range(15):
        spin = rng.normal(size=3)
        spin *= SPIN / np.linalg.norm(spin)
        height, mean = furthest(spin) + CLEAR, spin
        for _ in range(50 if integrator != "RK4" else 0):  # but for Runge-Kutta the spin is that of half a step before
            mean = spin + 0.25 * DT * np.cross(mean, INERTIA * mean) / INERTIA
        spin = 2.0 * mean - spin
        alone = thrown(engine, spin, height, integrator, floor=False)
        world = thrown(engine, spin, height, integrator)
        alone.step()
        world.step()
        left_in += reach(alone) > height
        assert reach(world) < height
        assert np.abs(world.read().velocity).max() < 1e-15
        alone.close()
        world.close()
    assert left_in > 0
