"""Whose energy it is that jointed bodies gain: Euler's flight makes some where they turn fast, contacts make none."""

import numpy as np
import pytest
from mujoco_scenes import DISCRETE, mujoco, steel_pair

from contactlaw import MATERIALS, ContactPair, Material
from contactlaw.mujoco_plugin import contacts_of, load_model

THROWN = """<mujoco><option timestep="0.0033" integrator="{}"><flag energy="enable"/></option><worldbody>
    <geom type="plane" size="5 5 .1"/><body pos="0 0 .6"><freejoint/>
    <geom type="sphere" size=".0339" pos=".1035 0 0" density="1000"/><body pos=".285 -.1016 -.0931">
    <joint axis=".0736 -1.607 1.1319" limited="true" range="-66.4 67.7"/>
    <geom type="sphere" size=".0514" pos=".1425 0 0" density="1000"/><body pos=".1044 .0125 .0472">
    <joint axis=".3418 -.3261 -.5768"/>
    <geom type="capsule" fromto="0 0 0 .1044 .0125 .0472" size=".0207" density="1000"/></body></body></body>
    </worldbody></mujoco>"""


@pytest.mark.parametrize("integrator", ["Euler", "RK4"])
@pytest.mark.parametrize("restitution", [0.5, 0.9])
def test_a_jointed_model_gains_nothing_by_its_contacts(integrator, restitution):
    """What the engine's own step would do to the same state, without contacts, is taken off."""
    pair = ContactPair(MATERIALS["rubber"], MATERIALS["steel"], friction=0.0, restitution=restitution)
    model = load_model(THROWN.format(integrator), [("*", "*", pair)])
    alone = mujoco.MjModel.from_xml_string(THROWN.format(integrator))
    alone.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    data = mujoco.MjData(model)
    data.qvel[:] = [2.7, 0.2, 0.3, 0.6, 1.3, 2.3, 0.0, 1.0]

    def energy(one):
        there = mujoco.MjData(alone)
        there.qpos[:], there.qvel[:] = one.qpos, one.qvel
        mujoco.mj_forward(alone, there)
        return there.energy.sum()

    first, flown, touched = energy(data), 0.0, 0
    for _ in range(300):
        before, engine = energy(data), mujoco.MjData(alone)
        engine.qpos[:], engine.qvel[:], engine.qacc_warmstart[:] = data.qpos, data.qvel, data.qacc_warmstart
        mujoco.mj_step(alone, engine)
        mujoco.mj_step(model, data)
        if np.array_equal(engine.qpos, data.qpos) and np.array_equal(engine.qvel, data.qvel):
            flown += energy(data) - before
            assert not any(c.touching for c in contacts_of(model, data))
        else:
            touched += 1
        assert energy(data) - flown < first * (1.0 + 1e-2)
    assert touched > 3
    assert energy(data) - flown < first


AT_A_STOP = """<mujoco><option timestep="2e-3" integrator="{}"/><worldbody><geom type="plane" size="1 1 .1"/>
    <body pos="0 0 .03"><joint type="slide" axis="0 0 1"/><geom size=".02" mass=".1"/><body pos=".1 0 .1">
    <joint name="arm" type="slide" axis="1 0 0" range="-.01 .01"/><geom size=".02" mass=".1"/></body></body></worldbody>
    <actuator><motor joint="arm"/></actuator></mujoco>"""


@pytest.mark.parametrize("integrator", ["Euler", "implicitfast", "RK4"])
def test_what_bounces_with_an_arm_at_its_stop_rises_no_higher(integrator):
    """Where it passes by everything, nothing that an earlier step found of its limit is written to it."""
    pair = ContactPair("steel", "steel", friction=0.0, restitution=1.0)
    model = load_model(AT_A_STOP.format(integrator), [("*", "*", pair)])
    data, highest = mujoco.MjData(model), 0.0
    data.ctrl[0] = 1.0
    for _ in range(400):
        mujoco.mj_step(model, data)
        highest = max(highest, data.qpos[0])
    assert highest < 1e-5  # of a fall of 10 mm; it rose by 3.6 mm more with nothing to lift it


@pytest.mark.parametrize("integrator", ["Euler", "RK4"])
def test_a_stop_gives_nothing_to_what_is_knocked_off_it_and_back_within_a_step(integrator):
    """Balls strike from behind, then from before; the second met the inertia of a stop that it left: 4 J -> 17."""
    body = '<body pos="{} 0 0"><joint type="slide" axis="1 0 0" {}/><geom name="{}" size=".05" mass="1"/></body>'
    row = ((0.0, 'range="0 1"', "block"), (-0.101, "", "behind"), (0.1025, "", "before"))
    model = load_model(
        f"""<mujoco><option timestep="2e-3" gravity="0 0 0" integrator="{integrator}"/><worldbody>
        {"".join(body.format(*one) for one in row)}</worldbody></mujoco>""",
        [("block", ["behind", "before"], ContactPair("steel", "steel", friction=0.0, restitution=1.0))],
    )
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = -4e-3, [0.0, 2.0, -2.0]
    mujoco.mj_step(model, data)
    assert data.qvel[2] > 2.0  # both have struck
    assert 3.5 < 0.5 * data.qvel @ data.qvel < 4.0


SWUNG = """<mujoco><option timestep="{}"/><worldbody><geom type="plane" size="5 5 .1"/>
    <site name="hook" pos="0 0 -.05"/><body pos="0 0 .05">{}
    <geom size=".05" mass=".1"/><site name="middle"/></body></worldbody>
    <tendon><spatial name="t" {} springlength="0"><site site="hook"/><site site="middle"/></spatial></tendon>{}
    </mujoco>"""
SERVO = '<actuator><position tendon="t" kp="50"/></actuator>'


@pytest.mark.parametrize("step", [2e-3, 1e-2])
@pytest.mark.parametrize("joints", ["<freejoint/>", '<joint type="slide"/><joint type="slide" axis="1 0 0"/>'])
@pytest.mark.parametrize(
    ("pull", "gain"), [(('stiffness="50"', ""), 1e-3), (("", SERVO), 5e-3)], ids=["spring", "servo"]
)
def test_a_ball_that_a_tendon_swings_on_the_floor_gains_nothing(joints, step, pull, gain):
    """The tendon draws it to the floor, hardly longer for the swing; it gained 3 % a period at 2 ms, 10^4 in 4 s."""
    pair = ContactPair("rubber", "rubber", friction=0.0, restitution=0.5)
    model = load_model(SWUNG.format(step, joints, *pull), [("*", "*", pair)])
    data, energy = mujoco.MjData(model), []
    across = 0 if model.nv == 6 else 1
    data.qvel[across] = 0.5
    for _ in range(400):
        mujoco.mj_step(model, data)
        energy.append(0.5 * 0.1 * data.qvel[across] ** 2 + 0.5 * 50.0 * data.qpos[across] ** 2)
    assert max(energy) < energy[0] * (1.0 + gain)


def test_a_ball_joint_keeps_its_swing_beside_a_tendon_in_a_tree_that_is_pressed():
    """Its spring acts within the step; a second time, as what the tendon follows, it took half of this energy."""
    model = load_model(
        """<mujoco><option timestep="2e-3"/><worldbody><geom type="plane" size="1 1 .1"/><body pos="0 0 .05">
        <joint type="slide" axis="0 0 1"/><geom size=".05" mass="1"/><body pos="0 0 .3"><joint type="ball"
        stiffness=".4"/><inertial pos="0 0 0" mass=".1" diaginertia="1e-3 1e-3 1e-3"/></body><body pos="0 0 .6">
        <joint name="x"/><inertial pos="0 0 0" mass=".1" diaginertia="1e-3 1e-3 1e-3"/></body></body></worldbody>
        <tendon><fixed stiffness=".1"><joint joint="x" coef="1"/></fixed></tendon></mujoco>""",
        [("*", "*", ContactPair("rubber", "rubber", friction=0.0, restitution=0.5))],
    )
    data = mujoco.MjData(model)
    data.qvel[1:5] = [2.0, 0.0, 0.0, 2.0]
    mujoco.mj_step(model, data, 1000)
    assert contacts_of(model, data)[0].touching
    turned = 2.0 * np.arctan2(data.qpos[2], data.qpos[1])
    assert 0.5e-3 * data.qvel[1] ** 2 + 0.5 * 0.4 * turned**2 == pytest.approx(2e-3, rel=1e-3)
    assert 0.5e-3 * data.qvel[4] ** 2 + 0.5 * 0.1 * data.qpos[5] ** 2 == pytest.approx(2e-3, rel=1e-3)


@pytest.mark.parametrize("step", [1e-3, 4e-3])
@pytest.mark.parametrize("integrator", ["Euler", "RK4"])
def test_the_spring_of_a_free_joint_swings_what_slides_beside_a_tendon(integrator, step):
    """The tendon is that of a hinge which the ball carries; the swing is sqrt(k/m), nothing is lost or gained."""
    model = load_model(
        f"""<mujoco><option timestep="{step}" integrator="{integrator}"/><worldbody><geom type="plane" size="1 1 .1"/>
        <body pos="0 0 .05"><joint type="free" stiffness="20"/><geom size=".05" mass="1"/><body pos="0 0 .1">
        <joint name="x" axis="0 0 1"/><inertial pos="0 0 0" mass=".25" diaginertia="1e-3 1e-3 1e-3"/></body></body>
        </worldbody><tendon><fixed stiffness=".1"><joint joint="x" coef="1"/></fixed></tendon></mujoco>""",
        [("*", "*", ContactPair("rubber", "rubber", friction=0.0, restitution=0.5))],
    )
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, round(0.4 / step))
    data.qpos[0], start = 0.1, data.time
    mujoco.mj_step(model, data, round(3.0 / step))
    assert contacts_of(model, data)[0].touching
    assert data.qpos[0] == pytest.approx(0.1 * np.cos(4.0 * (data.time - start)), abs=5e-4)


LEG = """<mujoco><option gravity="0 0 0"/><worldbody><geom name="floor" type="plane" size="1 1 1" contype="0"/>
    <body pos="0 0 .1775"><joint type="slide" axis="0 0 1"/><geom size=".03" mass=".3" contype="0"/>
    <body><joint axis="0 1 0" limited="true" range="-30 30"/><geom size=".01" pos="0 0 -.05" mass=".1" contype="0"/>
    <body pos="0 0 -.1"><joint axis="0 1 0" limited="true" range="-40 60"/>
    <geom name="foot" size=".02" pos="0 0 -.04" mass=".03"/></body></body></body></worldbody></mujoco>"""


def landed(model, step, integrator="EULER", stiffness=0.0, start=(0.55, -0.8, -2.0, 0.6, -3.6), time=4e-3):
    """Velocities of a leg a time [s] after its throw, by the law or, with its stiffness, by Hertz's force by hand."""
    model.opt.timestep, model.opt.integrator = step, getattr(mujoco.mjtIntegrator, f"mjINT_{integrator}")
    data, jacobian, foot = mujoco.MjData(model), np.zeros((3, 3)), model.geom("foot").id
    data.qpos[1:], data.qvel[:] = start[:2], start[2:]
    data.qpos[0] = 0.0216 - 0.1775 + 0.1 * np.cos(start[0]) + 0.04 * np.cos(start[0] + start[1])
    if stiffness > 0.0:
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    for _ in range(round(time / step)):
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        overlap = 0.02 - data.geom_xpos[foot, 2]
        if stiffness > 0.0:
            mujoco.mj_jac(model, data, jacobian, None, data.geom_xpos[foot], model.geom_bodyid[foot])
            data.qfrc_applied[:] = stiffness * max(overlap, 0.0) ** 1.5 * jacobian[2]
        mujoco.mj_step(model, data)
    return data.qvel


@pytest.mark.parametrize("integrator", ["EULER", "RK4", "IMPLICITFAST", *map(str.upper, DISCRETE)])
def test_a_leg_with_two_joints_at_their_stops_lands_as_the_engines_stops_have_it(integrator):
    """Each stop resisted as if the other were not there: 1.2 times the energy of before, for half of it."""
    pair = steel_pair(friction=0.0, restitution=1.0)
    hertz = 4.0 / 3.0 * pair.effective_modulus * np.sqrt(0.02)
    due = landed(mujoco.MjModel.from_xml_string(LEG), 1e-6, stiffness=hertz)
    model = load_model(LEG, [("foot", "floor", pair)], others=False)
    for step in (2e-3, 5e-4, 1e-4):
        assert landed(model, step, integrator)[0] == pytest.approx(due[0], abs=0.03)


@pytest.mark.parametrize("start", [(0.52, -0.69, -2.0, 0.0, 0.0), (0.2, -0.69, -2.0, 0.0, 0.0)])
def test_a_leg_that_reaches_its_stops_as_it_lands_meets_them_in_that_step(start):
    """They acted a step late, and a foot of rubber left three times as fast."""
    pair = ContactPair("rubber", "rubber", friction=0.0, restitution=1.0)
    hertz = 4.0 / 3.0 * pair.effective_modulus * np.sqrt(0.02)
    due = landed(mujoco.MjModel.from_xml_string(LEG), 1e-5, stiffness=hertz, start=start, time=1e-2)
    model = load_model(LEG, [("foot", "floor", pair)], others=False)
    for step in (5e-3, 2e-3, 5e-4):
        assert landed(model, step, start=start, time=1e-2)[0] == pytest.approx(due[0], abs=0.03)


def test_what_an_impact_would_do_if_it_lasted_a_step_is_no_sign_of_a_lost_tree():
    """Held for a step, its force turned a light link by 200 rad, and the tree was left to the engine: 1e6 times E.

    Two cylinders begin at one joint and press on each other and the floor; of a thousand throws one came to this.
    """
    soft = Material(15542874.724667778, 0.4)
    model = load_model(
        """<mujoco><option timestep=".004" integrator="RK4"/><worldbody><geom type="plane" size="2 2 .1"/>
        <body pos="0 0 .5"><freejoint/><geom type="sphere" size=".02" density="3000"/><body>
        <joint type="ball" axis="-0.803 -1.083 -0.224"/><geom type="cylinder" size="0.0241960238081685"
        fromto="0 0 0 0.1379 -0.0039 -0.0654" density="1000"/></body><body>
        <joint type="hinge" axis="0.969 2.183 1.210"/><geom type="cylinder" size="0.02344118513053574"
        fromto="0 0 0 -0.0631 -0.0585 0.0578" density="1000"/></body></body></worldbody></mujoco>""",
        [("*", "*", ContactPair(soft, soft, friction=0.4))],
    )
    data = mujoco.MjData(model)
    data.qvel[:] = [
        0.6243494069776152, -0.23879238519382273, -1.9989419840781926, -0.9589765184867445, -0.11105802115062557,
        1.045073776179004, 1.702181450641513, -1.116879531602672, -4.943544585056248, 4.554488767372106,
    ]  # fmt: skip
    mujoco.mj_step(model, data, 46)
    assert abs(data.qvel).max() < 200.0  # 5e4 before
