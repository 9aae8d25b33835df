"""Stops of joints and taut tendons that hold what a contact strikes."""

import pytest
from mujoco_scenes import DISCRETE, mujoco, steel_pair

from contactlaw import MATERIALS, ContactPair
from contactlaw.mujoco_plugin import load_model

REACH = 0.2  # [m] of an arm


@pytest.mark.parametrize("material", ["steel", "rubber"])
@pytest.mark.parametrize("integrator", ["EULER", "RK4", "IMPLICITFAST", *map(str.upper, DISCRETE)])
def test_a_ball_that_strikes_an_arm_at_its_stop_rebounds_alike_at_any_step(material, integrator):
    """The stop is as stiff as solimp says: 0.95 of what the arm would give way to is held."""
    speeds = []
    text = f"""<mujoco><option gravity="0 0 0"/><worldbody><body><joint axis="0 -1 0" limited="true" range="0 90"/>
        <geom type="capsule" fromto="0 0 0 {REACH} 0 0" size=".005" mass=".05" contype="0" conaffinity="0"/>
        <geom name="tip" size=".02" pos="{REACH} 0 0" mass=".1"/></body>
        <body pos="{REACH} 0 .1"><freejoint/><geom name="ball" size=".02" mass=".1"/></body></worldbody></mujoco>"""
    pair = ContactPair(MATERIALS[material], MATERIALS["steel"], friction=0.2, restitution=1.0)
    for step in (5e-3, 2e-3, 1e-4):
        model = load_model(text, [("tip", "ball", pair)], others=False)
        model.opt.timestep, model.opt.integrator = step, getattr(mujoco.mjtIntegrator, f"mjINT_{integrator}")
        data = mujoco.MjData(model)
        data.qfrc_applied[0] = -0.5
        mujoco.mj_step(model, data, round(0.3 / step))
        data.qpos[3], data.qvel[3] = 0.0452, -0.4
        mujoco.mj_step(model, data, round(0.06 / step))
        speeds.append(data.qvel[3])
    assert 0.34 < speeds[-1] < 0.4
    assert speeds == pytest.approx([speeds[-1]] * 3, rel=2e-3)


def test_a_ball_rebounds_from_a_weight_on_ropes_alike_at_any_step():
    """Taut ropes hold it against the ball, together; they yielded for a step: the ball left at a fifth of its speed."""
    rope = '<spatial limited="true" range="0 .5"><site site="{}"/><site site="w"/></spatial>'
    text = f"""<mujoco><option integrator="RK4"/><worldbody><site name="a" pos="-.3 0 .4"/>
        <site name="b" pos=".3 0 .4"/><body><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/>
        <geom name="w" size=".05" mass=".5"/><site name="w"/></body><body pos="0 0 .2"><freejoint/>
        <geom name="ball" size=".03" mass=".2"/></body></worldbody>
        <tendon>{rope.format("a")}{rope.format("b")}</tendon></mujoco>"""
    speeds = []
    for step in (1e-2, 2e-3, 1e-4):
        model = load_model(text, [("w", "ball", steel_pair(friction=0.2, restitution=0.9))])
        model.opt.timestep = step
        data = mujoco.MjData(model)
        for _ in range(round(0.5 / step)):
            data.qpos[4], data.qvel[2:] = 0.3, 0.0
            mujoco.mj_step(model, data)
        data.qpos[2], data.qpos[4], data.qvel[4] = 0.005, data.qpos[1] + 0.0815, -1.0
        mujoco.mj_step(model, data, round(0.03 / step))
        speeds.append(data.qvel[4])
    assert 0.55 < speeds[-1] < 0.65
    assert speeds == pytest.approx([speeds[-1]] * 3, rel=2e-3)
