"""What is conserved: momenta to rounding, energy to the substeps' error, by kicks that are equal and opposite."""

from __future__ import annotations

import numpy as np
import pytest

from contactlaw import ContactPair
from tests.world.planar_balls import advance
from tests.world.world_scenes import (
    PHENOLIC,
    RADIUS,
    balls,
    column,
    mass_of,
    rack,
    steel_pair,
    tumbler,
)


@pytest.mark.parametrize("timestep", [1.0 / 60.0, 1.0 / 240.0, 2e-3, 1e-4, 1e-5])
def test_two_spinning_balls_keep_their_momenta(timestep: float) -> None:
    rng = np.random.default_rng(3)
    for _ in range(4):
        places = np.array([[-0.03, 0.0, 0.0], [0.03, 0.0, 0.0]]) + 0.002 * rng.normal(size=(2, 3))
        velocities = np.array([[3.0, 0.0, 0.0], [-3.0, 0.0, 0.0]]) + 0.3 * rng.normal(size=(2, 3))
        spins = 50.0 * rng.normal(size=(2, 3))
        made = balls(steel_pair(restitution=0.93), places, velocities, spins, timestep=timestep)
        linear, angular = made.momentum
        made.step(max(round(0.01 / timestep), 3))
        assert np.ptp(made.velocity[:, 0] - velocities[:, 0]) > 1.0
        size = mass_of(RADIUS) * np.linalg.norm(velocities, axis=1).sum()
        assert np.abs(made.momentum[0] - linear).max() < 1e-14 * size
        assert np.abs(made.momentum[1] - angular).max() < 1e-14 * size * 2.0 * RADIUS


@pytest.mark.parametrize("gap", [1e-4, 1e-2])
@pytest.mark.parametrize("speed", [0.1, 3.0])
@pytest.mark.parametrize("timestep", [1e-4, 1e-2])
def test_a_rattling_ball_keeps_its_speed(gap: float, speed: float, timestep: float) -> None:
    """To 3e-6 an impact, whether the step cuts impacts into pieces or holds twenty of them."""
    walls = [((0.0, 0.0, -s * (RADIUS + gap)), (0.0, 0.0, s)) for s in (1.0, -1.0)]
    made = balls(steel_pair(), [[0.0, 0.0, 0.3 * gap]], [0.0, 0.0, speed], planes=walls, timestep=timestep)
    first = made.energy.total
    made.step(round(0.1 / timestep))
    impacts = max(0.1 * speed / gap / 2.0, 10.0)
    assert made.energy.total == pytest.approx(first, rel=6e-6 * impacts)


@pytest.mark.parametrize("timestep", [2e-3, 2e-4, 1e-5])
def test_a_column_of_twenty_keeps_its_energy(timestep: float) -> None:
    made = column(20, 1e-4, timestep)
    first = made.energy.total
    made.step(round(0.3 / timestep))
    assert made.energy.total == pytest.approx(first, rel=1e-3)


@pytest.mark.parametrize("timestep", [2e-3, 1e-4])
def test_a_break_of_frictionless_balls_has_no_spin(timestep: float) -> None:
    """And its velocities are those of substeps a quarter as long to 0.1 % of the cue ball's."""
    made, fine = (rack(ContactPair(PHENOLIC, PHENOLIC, 0.0), timestep, 8.0) for _ in range(2))
    fine.arrays.world["substeps"] = fine.arrays.world["crowd_substeps"] = 240.0
    for world in (made, fine):
        world.step(round(0.02 / timestep))
    assert np.abs(made.spin).max() < 1e-10
    np.testing.assert_allclose(made.velocity.sum(0), [8.0, 0.0, 0.0], atol=1e-13)
    assert made.energy.kinetic == pytest.approx(0.5 * mass_of(0.028575, 1750.0) * 64.0, rel=1e-4)
    assert np.abs(made.velocity - fine.velocity).max() < 1e-3 * 8.0


@pytest.mark.parametrize("kind", ["capsule", "dumbbell", "box"])
@pytest.mark.parametrize("timestep", [pytest.param(5e-4, marks=pytest.mark.slow), 2e-3, 1e-2])
def test_tumbling_bodies_gain_no_energy(kind: str, timestep: float) -> None:
    for friction, restitution in ((0.0, 1.0), (0.3, 1.0), (0.0, 0.5), (0.3, 0.5)):
        made = tumbler(kind, 1, timestep, steel_pair(friction, restitution))
        first, touches = made.energy.total, 0
        for _ in range(round(3.0 / timestep)):
            made.step()
            contacts = made.contacts
            touches += int(contacts["touches"][~contacts["closed"]].sum())
            if not contacts["closed"].any():
                assert made.energy.total < first * (1.0 + 1e-5 * (touches + 1))
        assert touches > 3
        if friction == 0.0 and restitution == 1.0:
            assert made.energy.total == pytest.approx(first, rel=1e-3)


@pytest.mark.parametrize(("friction", "restitution"), [(0.0, 0.95), (0.06, 1.0), (0.06, 0.95)])
def test_a_break_is_that_of_an_independent_integration(friction: float, restitution: float) -> None:
    """To 0.2 % of the cue ball's 8 m/s, at steps of 2 ms."""
    pair, radius = ContactPair(PHENOLIC, PHENOLIC, friction, restitution), 0.028575
    made = rack(pair, 2e-3, 8.0)
    mass = mass_of(radius, 1750.0)
    position, velocity, spin = made.position[:, :2].copy(), made.velocity[:, :2].copy(), np.zeros(16)
    deepest = ContactPair(PHENOLIC, PHENOLIC, 0.0, radius=radius / 2.0).greatest_overlap(mass / 2.0, 9.0)
    material = (pair.effective_modulus, pair.effective_shear_modulus, friction, pair.damping_ratio)
    shape = (radius, mass, 0.4 * mass * radius**2)
    advance(position, velocity, spin, (*shape, *material, np.sqrt(0.5 * radius * deepest)), 1e-6, 20_000)
    made.step(10)
    assert np.abs(made.velocity[:, :2] - velocity).max() < 2e-3 * 8.0
    assert np.abs(made.spin[:, 2] - spin).max() * radius < 2e-3 * 8.0
    assert np.abs(spin).max() * radius > (0.1 if friction > 0.0 else -1.0)
