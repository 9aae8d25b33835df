"""Friction that a user changes while a model runs, by `set_friction` or in the model."""

import numpy as np
import pytest
from mujoco_scenes import BALL, SLED, mujoco, with_data

from contactlaw import MATERIALS, ContactPair
from contactlaw.losses import FallingFriction, Viscoelastic
from contactlaw.mujoco_plugin import contacts_of, instances_of, load_model, set_friction

NAME = "contactlaw:ball:floor"
RUBBER = MATERIALS["rubber"]


def sliding(friction, change=None):
    """Decelerations of a sled, before and after a change [m/s^2]."""
    pair = ContactPair(RUBBER, RUBBER, friction=friction, restitution=0.5)
    model, data = with_data(load_model(SLED, [("foot*", "floor", pair)]))
    data.qvel[0] = 2.0
    speeds = []
    for step in range(200):
        if step == 100 and change:
            change(model, data)
        mujoco.mj_step(model, data)
        speeds.append(data.qvel[0])
    return [(speeds[i] - speeds[i + 40]) / 0.08 for i in (50, 150)]


def test_friction_changes_while_a_sled_slides():
    name = "contactlaw:foot0..foot3(4):floor"
    before, after = sliding(0.2, lambda model, data: set_friction(model, data, name, 0.05))
    assert before == pytest.approx(0.2 * 9.81, rel=0.01)
    assert after == pytest.approx(0.05 * 9.81, rel=0.01)


def test_friction_is_kept_through_resets_and_wakes_what_sleeps_on_a_slope():
    pair = ContactPair(RUBBER, RUBBER, friction=0.8, restitution=0.5)
    model, data = with_data(load_model(SLED, [("foot*", "floor", pair)]))
    model.opt.gravity[:] = 9.81 * np.array([np.sin(0.3), 0.0, -np.cos(0.3)])
    mujoco.mj_step(model, data, 1000)
    assert abs(data.qvel[0]) < 1e-6
    set_friction(model, data, "contactlaw:foot0..foot3(4):floor", 0.1)
    mujoco.mj_step(model, data, 100)
    assert data.qvel[0] == pytest.approx(0.2 * 9.81 * (np.sin(0.3) - 0.1 * np.cos(0.3)), rel=0.05)
    mujoco.mj_resetData(model, data)
    mujoco.mj_step(model, data, 200)
    assert data.qvel[0] > 0.5
    with pytest.raises(ValueError, match=r"friction = -1.0: must be"):
        set_friction(model, data, "contactlaw:foot0..foot3(4):floor", -1.0)
    with pytest.raises(ValueError, match=r"name = 'x': must be the name of a plugin instance"):
        set_friction(model, data, "x", 0.1)


@pytest.mark.parametrize("old", [0.0, 0.5])
def test_friction_changes_while_a_ball_spins(old):
    """Its spin falls by the moment of full slip, 3 pi/16 mu P a, with the friction that has been set."""
    model, data = with_data(load_model(BALL, [("ball", "floor", ContactPair(RUBBER, RUBBER, old, 0.5))]))
    mujoco.mj_step(model, data, 500)
    data.qvel[5] = 100.0
    mujoco.mj_step(model, data, 50)
    set_friction(model, data, NAME, 0.1)
    spins = []
    for _ in range(2):
        mujoco.mj_step(model, data, 50)
        spins.append(data.qvel[5])
    [contact] = contacts_of(model, data, NAME)
    moment = 3.0 * np.pi / 16.0 * 0.1 * contact.normal_force * contact.contact_radius
    assert (spins[0] - spins[1]) / 0.1 == pytest.approx(moment / model.body_inertia[1, 2], rel=1e-3)


def test_friction_over_speed_is_not_set():
    curve = FallingFriction(0.5, 0.2, 0.3)
    model, data = with_data(load_model(BALL, {"*": RUBBER}, friction=curve, restitution=Viscoelastic(0.5)))
    with pytest.raises(ValueError, match="its friction is a curve over speed"):
        set_friction(model, data, instances_of(model)[0], 0.1)


def test_friction_ends_by_condim():
    model, data = with_data(load_model(BALL, {"*": RUBBER}, restitution=0.5))
    mujoco.mj_step(model, data, 300)
    data.qvel[0], model.geom_condim[:] = 1.0, 1
    mujoco.mj_step(model, data, 20)
    assert data.qvel[[0, 4]] == pytest.approx([1.0, 0.0], abs=1e-9)
