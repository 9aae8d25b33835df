"""Stops of joints and taut tendons that hold what a contact strikes."""

import numpy as np
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


RUBBER = ContactPair("rubber", "rubber", friction=0.0, restitution=1.0)
HERTZ = 4.0 / 3.0 * RUBBER.effective_modulus * np.sqrt(0.02)  # [N/m^1.5] of a foot of 20 mm
LEG = """<mujoco><option integrator="RK4"/><worldbody><geom name="floor" type="plane" size="1 1 1" contype="0"/>
    <body pos="0 0 .3"><joint type="slide" axis="0 0 1"/><geom size=".03" mass=".3" contype="0" conaffinity="0"/>
    <body pos="0 0 -.1"><joint name="hip" axis="0 1 0" {0}/><geom type="capsule" fromto="0 0 0 .01 0 -.1" size=".01"
    mass=".1" contype="0" conaffinity="0"/><body pos="0 0 -.1"><joint name="knee" axis="0 1 0" {0}/><geom type="capsule"
    fromto="0 0 0 .01 0 -.1" size=".01" mass=".1" contype="0" conaffinity="0"/>
    <geom name="foot" size=".02" pos="0 0 -.1" mass=".05"/></body></body></body></worldbody>
    <actuator><position joint="hip" kp="{1}" kv=".02"/><position joint="knee" kp="{1}" kv=".02"/></actuator></mujoco>"""


def thrown(joints, stiffness, step, by_hand=False):
    """Velocities of a leg of rubber 20 ms after it was thrown down, by the law or with Hertz's force put in by hand."""
    model = load_model(LEG.format(joints, stiffness), [("foot", "floor", RUBBER)], others=False)
    model.opt.timestep, data = step, mujoco.MjData(model)
    data.qpos[1:], data.qvel[:] = (0.2, -0.3), (-1.5, -2.0, 3.0)
    mujoco.mj_kinematics(model, data)
    data.qpos[0] -= data.geom("foot").xpos[2] - 0.025
    jacobian, foot = np.zeros((3, model.nv)), model.geom("foot").id
    if by_hand:
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    for _ in range(round(0.02 / step)):
        if by_hand:
            mujoco.mj_kinematics(model, data)
            mujoco.mj_comPos(model, data)
            overlap = 0.02 - data.geom_xpos[foot, 2]
            point = data.geom_xpos[foot] - (0.0, 0.0, 0.02 - 0.5 * overlap)
            mujoco.mj_jac(model, data, jacobian, None, point, model.geom_bodyid[foot])
            data.qfrc_applied[:] = HERTZ * max(overlap, 0.0) ** 1.5 * jacobian[2]
        mujoco.mj_step(model, data)
    return data.qvel.copy()


@pytest.mark.parametrize(("joints", "stiffness", "within"), [
    ("", 5.0, 3e-2), ('frictionloss="50" armature="1e-4"', 0.0, 5e-2), ('frictionloss=".1"', 0.0, 5e-3),
])  # fmt: skip
def test_a_leg_lands_under_the_servos_and_the_dry_friction_of_its_joints_at_any_step(joints, stiffness, within):
    """They held for a step what they pull. At 5 ms velocities were 0.9 off by servos; 8 by friction that holds."""
    due = thrown(joints, stiffness, 1e-5, by_hand=True)
    for step in (5e-3, 2e-3):  # in steps of 0.2 ms such a servo is held
        assert abs(thrown(joints, stiffness, step) - due).max() < within * abs(due).max()


@pytest.mark.parametrize("integrator", ["EULER", "RK4", "IMPLICITFAST", *map(str.upper, DISCRETE)])
@pytest.mark.parametrize("step", [5e-3, 2e-3])
def test_a_tendon_that_becomes_taut_as_a_foot_lands_acts_as_the_stop_of_its_slide(step, integrator):
    """It acted a step late, when the foot had left."""
    speeds, limit = [], 'range="-.0015 1"'
    for joint, tendon in ((limit, ""), ("", f'<tendon><fixed {limit}><joint joint="j" coef="1"/></fixed></tendon>')):
        model = load_model(
            f"""<mujoco><compiler autolimits="true"/><worldbody><geom name="floor" type="plane" size="1 1 1"/>
            <body pos="0 0 .0205"><joint name="j" type="slide" axis="0 0 1" {joint}/>
            <geom name="foot" size=".02" mass=".2"/></body></worldbody>{tendon}</mujoco>""",
            [("foot", "floor", RUBBER)],
        )
        model.opt.timestep, model.opt.integrator = step, getattr(mujoco.mjtIntegrator, f"mjINT_{integrator}")
        data = mujoco.MjData(model)
        data.qvel[0] = -1.5
        mujoco.mj_step(model, data, round(0.01 / step))
        speeds.append(data.qvel[0])
    assert 1.4 < speeds[0] < 1.55
    assert speeds[1] == pytest.approx(speeds[0], rel=1e-6)


@pytest.mark.parametrize("stop", ["-300 -10", "-300 -3"])
def test_a_ball_on_an_arm_that_yields_at_its_stop_sinks_alike_at_any_step(stop):
    """The second stage of an implicit step left out what the stop had changed: it rattled at 7 rad/s, for 0.6."""
    text = f"""<mujoco><compiler autolimits="true"/><worldbody><body pos="0 0 1">
        <joint axis="0 1 0" range="-90 0" solreflimit="{stop}"/><geom name="arm" type="box" size=".1 .03 .005"
        pos=".1 0 0" mass=".1"/></body><body pos=".15 0 1.0249"><joint type="slide" axis="0 0 1"/>
        <joint type="slide" axis="1 0 0"/><geom name="ball" size=".02" mass=".2"/></body></worldbody></mujoco>"""
    pair, angles = ContactPair("steel", "rubber", friction=0.9, restitution=0.5), []
    for step in (2e-4, 2e-3, 1e-2):
        model = load_model(text, [("ball", "arm", pair)], others=False)
        model.opt.timestep, data = step, mujoco.MjData(model)
        angles.append([])
        for _ in range(12):
            mujoco.mj_step(model, data, round(0.05 / step))
            angles[-1].append(data.qpos[0])
    assert 0.05 < max(angles[0]) < 0.09
    assert np.abs(np.array(angles) - angles[0]).max() < 2e-3


def test_what_sleeps_on_joints_with_dry_friction_is_struck_as_if_it_were_awake():
    """Where it sleeps, its forces are those that contacts balance."""
    pair, after = steel_pair(friction=0.3, restitution=0.6), []
    for nudge in (0.0, 1e-6):
        model = load_model(
            """<mujoco><worldbody><geom name="floor" type="plane" size="5 5 1"/><body pos="0 0 .02">
            <joint type="slide" axis="1 0 0" frictionloss=".5"/><joint type="slide" axis="0 0 1" frictionloss=".1"/>
            <geom name="foot" size=".02" mass=".2"/></body><body pos="-1 0 .02"><freejoint/>
            <geom name="ball" size=".02" mass=".1"/></body></worldbody></mujoco>""",
            [("foot", "floor", pair), ("ball", "floor", pair), ("ball", "foot", pair)],
        )
        data = mujoco.MjData(model)
        mujoco.mj_step(model, data, 500)
        assert not data.qvel.any()
        data.qvel[0], data.qpos[2], data.qvel[2:] = nudge, -0.05, (1.0, 0.0, 0.0, 0.0, 50.0, 0.0)
        mujoco.mj_step(model, data, 20)
        after.append(data.qvel.copy())
    assert after[0][0] > 0.3
    assert after[0] == pytest.approx(after[1], abs=1e-5)


def test_what_stands_on_damped_legs_with_dry_friction_comes_to_rest():
    """So it does natively. The engine's friction resists how the damping of a light leg would brake that without the
    floor; as a constant force this rocked the trunk for ever, with 5 mrad/s in the knees.
    """
    joint, unseen = 'axis="0 1 0" damping=".1" frictionloss="1"', 'contype="0" conaffinity="0"'
    legs = "".join(
        f"""<body pos="{x} {y} 0"><joint name="hip{i}" {joint}/>
        <geom type="capsule" fromto="0 0 0 .05 0 -.12" size=".01" mass=".1" {unseen}/>
        <body pos=".05 0 -.12"><joint name="knee{i}" {joint}/>
        <geom type="capsule" fromto="0 0 0 -.05 0 -.1" size=".01" mass=".1" {unseen}/>
        <geom name="foot{i}" size=".015" pos="-.05 0 -.1" mass=".05"/></body></body>"""
        for i, (x, y) in enumerate([(-0.15, -0.1), (-0.15, 0.1), (0.15, -0.1), (0.15, 0.1)])
    )
    servos = "".join(f'<position joint="{kind}{i}" kp="60" kv=".2"/>' for i in range(4) for kind in ("hip", "knee"))
    text = f"""<mujoco><option timestep=".003" integrator="RK4"/><worldbody>
        <geom name="floor" type="plane" size="5 5 .1"/><body pos="0 0 .24"><freejoint/>
        <geom type="box" size=".2 .1 .03" mass="2" {unseen}/>{legs}</body></worldbody>
        <actuator>{servos}</actuator></mujoco>"""
    model = load_model(text, [("foot*", "floor", steel_pair(friction=0.3, restitution=0.8))])
    data = mujoco.MjData(model)
    data.ctrl[:] = 0.05
    mujoco.mj_step(model, data, 900)
    assert not data.qvel.any()
