"""A mass that is changed while a contact is closed: its damper is that of the new mass."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from contactlaw import ContactPair
from sims.scene import Settings
from sims.worlds import Tuning, new_world

RADIUS, MASS, SPEED, HEAVIER = 0.0254, 0.5, 0.2, 4.0  # [m], [kg], [m/s], factor
PAIR = ContactPair("steel", "steel", friction=0.0, restitution=0.5, radius=RADIUS)


@pytest.mark.parametrize("engine", ["mujoco", "pybullet"])
def test_what_becomes_heavier_at_the_greatest_overlap_leaves_with_the_restitution_of_its_new_mass(engine):
    """There it is at rest. How it goes on from there is the same for all masses, but for time, which goes as sqrt(m):
    it leaves at e v sqrt(m/M)."""
    pytest.importorskip(engine)
    world: Any = new_world(
        Settings(engine, timestep=PAIR.contact_duration(MASS, SPEED) / 200.0), (0.0, 0.0, 0.0), Tuning()
    )
    world.ball("ball", RADIUS, MASS, [0.0, 0.0, RADIUS], [0.0, 0.0, -SPEED])
    world.plane("floor")
    world.contact("ball", "floor", PAIR)
    world.start()
    while world.read().velocity[0, 2] < 0.0:
        world.step()
    mass, inertia = HEAVIER * MASS, 0.4 * HEAVIER * MASS * RADIUS**2
    if engine == "mujoco":
        world.model.body_mass[1], world.model.body_inertia[1] = mass, inertia
    else:
        import pybullet as p

        p.changeDynamics(
            world.ids["ball"], -1, mass=mass, localInertiaDiagonal=[inertia] * 3, physicsClientId=world.client
        )
    world.step(600)
    left = world.read().velocity[0, 2]
    world.close()
    assert left == pytest.approx(PAIR.restitution * SPEED / np.sqrt(HEAVIER), rel=0.02)
