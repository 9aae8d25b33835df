"""Losses of a material inside both engines: what a world alone does with them, they do."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from contactlaw import Body, ContactPair, collide
from contactlaw.losses import FallingFriction, OverSpeed, Plastic, Table
from validation.ball import DOWN, GRAVITY, MASS, RADIUS, STEEL, at, ball_world, static_overlap

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


@pytest.mark.parametrize("engine", ["none", *ENGINES])
@pytest.mark.parametrize("friction", [FallingFriction(0.3, 0.05, 0.5), Table((0.2, 1.5), (0.05, 0.3))])
def test_a_ball_that_slides_long_reads_its_friction_again(engine: str, friction: OverSpeed) -> None:
    """Rigid sliding from 1.7 m/s, askew to the way: v' = -mu(|u|) g u/|u|, u' = 7/2 v', until it rolls."""
    if engine != "none":
        pytest.importorskip(engine)
    start, spin = np.array([1.5, 0.0]), np.array([0.8 / RADIUS, 0.0, 0.0])
    first = start + np.array([0.0, RADIUS * spin[0]])  # u = (v_x - R w_y, v_y + R w_x), which keeps its direction

    def slow(_: float, u: np.ndarray) -> list[float]:
        return [-3.5 * friction(abs(u[0])) * GRAVITY]

    def rolls(_: float, u: np.ndarray) -> float:
        return u[0]

    rolls.terminal = True  # type: ignore[attr-defined]
    size = float(np.hypot(*first))
    found = solve_ivp(slow, (0.0, 5.0), [size], events=rolls, rtol=1e-9, atol=1e-12, max_step=1e-2, dense_output=True)
    assert found.sol is not None
    world = ball_world(engine, 2e-3, ContactPair(STEEL, STEEL, friction, 0.5), DOWN)
    world.start(at(-static_overlap(), (*start, 0.0), spin))
    for time, steps in ((0.1, 50), (0.3, 100), (1.0, 350)):
        world.step(steps)
        lost = (size - found.sol(min(time, found.t[-1]))[0]) / size
        np.testing.assert_allclose(world.read().velocity[0, :2], start - lost * first / 3.5, atol=1e-3)
    world.close()
