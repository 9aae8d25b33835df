"""Losses of a material inside both engines: what a world alone does with them, they do."""

from __future__ import annotations

import numpy as np
import pytest

from contactlaw import Body, ContactPair, collide
from contactlaw.losses import FallingFriction, Plastic
from validation.ball import DOWN, MASS, RADIUS, STEEL, at, ball_world

ENGINES = ["mujoco", "pybullet"]


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("law", ["microslip", "microslip shear_loss=1"])
def test_an_impact_is_that_of_collide(engine: str, law: str) -> None:
    """Restitution and friction of its speeds, from a model's text or a call, at a step of many contact times."""
    pytest.importorskip(engine)
    pair = ContactPair(STEEL, STEEL, FallingFriction(0.3, 0.03, 0.5), Plastic(0.05, 0.98), law=law)
    for speed in (0.3, 2.0):
        world = ball_world(engine, 2e-3, pair)
        world.start(at(1e-3 * speed, (0.5 * speed, 0.0, -speed)))
        world.step(10)
        state = world.read()
        impact = collide(pair, Body(MASS, RADIUS, velocity=(0.5 * speed, 0.0, -speed)))
        np.testing.assert_allclose(state.velocity[0], impact.velocity_a, atol=2e-3 * 0.3 * speed)
        assert state.velocity[0, 2] == pytest.approx(pair.at(speed).restitution * speed, rel=1e-3)
        world.close()


@pytest.mark.parametrize("engine", ENGINES)
def test_a_rolling_ball_slows_and_stops(engine: str) -> None:
    """mu_r g/(1 + 2/5), until it stands."""
    pytest.importorskip(engine)
    pair = ContactPair(STEEL, STEEL, 0.3, 0.5, rolling_resistance=0.02)
    world = ball_world(engine, 2e-3, pair, DOWN)
    world.start(at(-1e-7, (0.1, 0.0, 0.0), (0.0, 0.1 / RADIUS, 0.0)))
    world.step(50)
    first = world.read().velocity[0, 0]
    world.step(150)
    assert (first - world.read().velocity[0, 0]) / 0.3 == pytest.approx(0.02 * 9.81 / 1.4, rel=1e-2)
    world.step(500)
    assert abs(world.read().velocity[0, 0]) < 1e-7
    world.close()
