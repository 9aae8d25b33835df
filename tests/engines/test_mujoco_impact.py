"""The law in unmodified mj_step: impacts against `rebound`, conservation, shapes."""

import warnings

import numpy as np
import pytest
from mujoco_scenes import (
    DENSITY,
    GEOM,
    RADIUS,
    ball_on_floor,
    free_ball,
    mujoco,
    steel_pair,
    with_data,
)

from contactlaw.mujoco_plugin import add_contact


def test_a_shape_found_by_the_engine_agrees_with_the_closed_form():
    after = []
    for kind, size in ((GEOM.mjGEOM_SPHERE, [RADIUS, 0, 0]), (GEOM.mjGEOM_ELLIPSOID, [RADIUS] * 3)):
        spec = mujoco.MjSpec()
        spec.option.timestep, spec.option.gravity = 1e-6, [0, 0, 0]
        spec.worldbody.add_geom(name="floor", type=GEOM.mjGEOM_PLANE, size=[1, 1, 0.1])
        body = spec.worldbody.add_body(pos=[0, 0, RADIUS])
        body.add_freejoint()
        body.add_geom(name="round", type=kind, size=size, density=DENSITY)
        add_contact(spec, "round", "floor", steel_pair(radius=RADIUS))
        model, data = with_data(spec.compile())
        data.qvel[:3] = [0.2, 0.1, -1.0]
        mujoco.mj_step(model, data, 150)
        after.append(data.qvel.copy())
    assert after[1] == pytest.approx(after[0], rel=1e-3, abs=1e-6)


def test_capsule_ends_are_balls_and_give_the_same_bounce():
    """Two capsules end to end strike as two balls of the same mass and inertia do."""
    after = []
    for half in (0.0, 0.04):
        spec = mujoco.MjSpec()
        spec.option.timestep, spec.option.gravity = 1e-6, [0, 0, 0]
        for name, z in (("low", 0.0), ("high", 2 * RADIUS + 2 * half)):
            body = spec.worldbody.add_body(name=name, pos=[0, 0, z])
            body.add_freejoint()
            body.explicitinertial, body.mass, body.ipos, body.inertia = True, 1.0, [0, 0, 0], [1e-3] * 3
            kind = GEOM.mjGEOM_CAPSULE if half else GEOM.mjGEOM_SPHERE
            body.add_geom(name=name + "_geom", type=kind, size=[RADIUS, half, 0])
        add_contact(spec, "low_geom", "high_geom", steel_pair(friction=0.0, restitution=1.0))
        model, data = with_data(spec.compile())
        data.qvel[8] = -1.0
        mujoco.mj_step(model, data, 300)
        after.append(data.qvel.copy())
    assert after[1] == pytest.approx(after[0], abs=1e-6)
    assert after[0][2] == pytest.approx(-1.0, abs=1e-3)  # equal masses exchange their velocities


def test_a_hinged_paddle_returns_the_ball_without_making_energy():
    spec = mujoco.MjSpec()
    spec.option.timestep, spec.option.gravity = 1e-6, [0, 0, 0]
    arm = spec.worldbody.add_body(name="arm")
    arm.add_joint(name="hinge", type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 1, 0])
    arm.add_geom(name="paddle", type=GEOM.mjGEOM_BOX, size=[0.02, 0.1, 0.1], pos=[0, 0, 0.4], density=2000)
    free_ball(spec, [0.02 + RADIUS, 0, 0.42], "ball_geom")
    add_contact(spec, "ball_geom", "paddle", steel_pair(restitution=1.0))
    model, data = with_data(spec.compile())
    data.qvel[model.jnt_dofadr[1] :][:3] = [-1.0, 0.1, 0.2]
    model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    mujoco.mj_forward(model, data)
    before = data.energy[1]
    mujoco.mj_step(model, data, 500)
    mujoco.mj_forward(model, data)
    assert data.qvel[0] < -0.5
    assert 0.9 * before < data.energy[1] <= before * (1.0 + 1e-3)


def test_free_flight_is_untouched():
    spec, _ = ball_on_floor(steel_pair(), timestep=1e-3)
    plain = mujoco.MjSpec.from_string("<mujoco><option gravity='0 0 0' timestep='1e-3'/></mujoco>")
    free_ball(plain, [0, 0, RADIUS])
    after = []
    for model in (spec.compile(), plain.compile()):
        data = mujoco.MjData(model)
        data.qpos[2] = 1.0
        data.qvel[:] = [1, 2, 3, 4, 5, 6]
        mujoco.mj_step(model, data, 100)
        after.append(np.concatenate([data.qpos, data.qvel]))
    assert np.array_equal(*after)


@pytest.mark.parametrize("radius", [None, 0.025])
def test_the_side_of_a_capsule_does_not_pass_through_a_box(radius):
    spec = mujoco.MjSpec()
    spec.option.timestep, spec.option.gravity = 1e-6, [0, 0, 0]
    spec.worldbody.add_geom(name="block", type=GEOM.mjGEOM_BOX, size=[0.05] * 3, pos=[0, 0, -0.05])
    body = spec.worldbody.add_body(pos=[0, 0, 0.025])
    body.add_freejoint()
    body.add_geom(
        name="bar",
        type=GEOM.mjGEOM_CAPSULE,
        size=[0.025, 0.2, 0],
        quat=[np.sqrt(0.5), 0, np.sqrt(0.5), 0],
        density=1000,
    )
    add_contact(spec, "bar", "block", steel_pair(radius=radius, friction=0.0))
    model, data = with_data(spec.compile())
    data.qvel[2] = -1.0
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        mujoco.mj_step(model, data, 600)
    assert data.qvel[2] > 0.5
    assert any("at the edge of a box" in str(w.message) for w in caught) == (radius is None)
