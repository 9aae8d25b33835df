"""Bodies that a mocap body leads by a weld, in MuJoCo, and push others by the law."""

import numpy as np
import pytest
from mujoco_scenes import mujoco

from contactlaw import MATERIALS, ContactPair
from contactlaw.mujoco_plugin import contacts_of, instances_of, load_model
from contactlaw.mujoco_plugin.readout import view_of

SPEED, MU = 0.1, 0.3  # [m/s] of the mocap body; friction on the floor
FREE = "<freejoint/>"
SLIDES = '<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/>'


def pushing(holder, step, solref, material="rubber", mass=2.0):
    """A box, led by a weld at 0.1 m/s without friction or weight, and a cube on the floor before it."""
    low, high = (ContactPair(MATERIALS[material], MATERIALS["steel"], mu, 0.5) for mu in (MU, 0.0))
    model = load_model(
        f"""<mujoco><option timestep="{step}"/><worldbody><geom name="floor" type="plane" size="1 1 1"/>
        <body name="mocap" mocap="true" pos="-.06 0 .03"/>{holder}
        <body name="cube" pos="0 0 .025"><freejoint/>
        <geom name="cube" type="box" size=".025 .025 .025" mass="{mass}"/></body></worldbody>
        <equality><weld body1="mocap" body2="hand" solref="{solref}"/></equality></mujoco>""",
        [("cube", "floor", low), ("cube", "hand", high)],
    )
    return model, mujoco.MjData(model)


def hand(joints, place="-.06 0 .03", mass=1.0):
    return (
        f'<body name="hand" pos="{place}" gravcomp="1">{joints}'
        f'<geom name="hand" type="box" size=".02 .02 .02" mass="{mass}"/></body>'
    )


def led(model, data, seconds):
    """Lead the hand for so long; yields after each step."""
    begin = data.mocap_pos[0, 0]
    for i in range(round(seconds / model.opt.timestep)):
        data.mocap_pos[0, 0] = begin + SPEED * model.opt.timestep * (i + 1)
        mujoco.mj_step(model, data)
        yield


@pytest.mark.parametrize("material", ["rubber", "steel"])
def test_the_base_of_an_arm_that_damping_alone_holds_stays_where_it_is(material):
    """Rails of 1e11 N s/m carry 50 kg and an arm of two hinges and a wrist: what it pushes does not move them."""
    link = '<geom type="capsule" fromto="0 0 0 .3 0 0" size=".02" mass="1" contype="0" conaffinity="0"/>'
    arm = f"""<body pos="-.5 0 .25"><joint name="x" type="slide" axis="1 0 0" damping="1e11" armature="1e-4"/>
        <joint name="z" type="slide" axis="0 0 1" damping="1e11" armature="1e-4"/>
        <geom type="box" size=".1 .1 .1" mass="50" contype="0" conaffinity="0"/>
        <body><joint axis="0 1 0" damping="1"/>{link}
        <body pos=".3 0 0"><joint axis="0 1 0" damping="1"/>{link}
        {hand('<joint axis="0 1 0" damping="1"/>', ".14 0 -.22")}</body></body></body>"""
    model, data = pushing(arm, 0.002, "0.02 1", material)
    cube = [data.body("cube").xpos[0] for _ in led(model, data, 0.5)]
    assert np.abs(data.qvel[:2]).max() < 1e-6
    assert np.abs(data.qpos[:2]).max() < 1e-6
    assert (cube[-1] - cube[-101]) / (100 * 0.002) == pytest.approx(SPEED, rel=0.02)


@pytest.mark.parametrize("joints", [FREE, SLIDES], ids=["free", "slides"])
@pytest.mark.parametrize("solref", ["0.02 1", "0.001 1"], ids=["soft", "stiff"])
@pytest.mark.parametrize("step", [5e-4, 2e-3, 1e-2])
def test_a_hand_that_is_led_pushes_with_the_force_of_friction(joints, solref, step):
    """Statics: what pushes a cube at a constant speed is the friction that it slides with."""
    model, data = pushing(hand(joints), step, solref, "steel")
    of_hand = instances_of(model)[1]
    pushes = [sum(contact.normal_force for contact in contacts_of(model, data, of_hand)) for _ in led(model, data, 0.8)]
    last = np.array(pushes[-round(0.2 / step) :])
    assert last == pytest.approx(MU * 2.0 * 9.81, rel=1e-3)
    assert data.qvel[-6] == pytest.approx(SPEED, rel=1e-3)


@pytest.mark.parametrize("joints", [FREE, SLIDES], ids=["free", "slides"])
@pytest.mark.parametrize("material", ["rubber", "steel"])
@pytest.mark.parametrize("solref", ["0.02 1", "0.001 1"], ids=["soft", "stiff"])
def test_a_weld_gives_nothing_to_what_strikes_a_light_hand(joints, material, solref):
    """20 kg at 0.5 m/s meet 0.2 kg: a weld that is constant over the step gave 43 % at 2 ms. Alike at any step."""
    left = []
    for step in (5e-4, 2e-3, 1e-2):
        model, data = pushing(hand(joints, mass=0.2), step, solref, material, 20.0)
        model.opt.gravity[2] = 0.0
        data.qpos[-7:-4], data.qvel[-6] = [-0.01, 0.0, 0.03], -0.5
        mujoco.mj_forward(model, data)
        energy = []
        for _ in range(round(0.2 / step)):
            mujoco.mj_step(model, data)
            energy.append((20.0 * data.qvel[-6:-3] @ data.qvel[-6:-3] + 0.2 * data.qvel[:2] @ data.qvel[:2]) / 5.0)
        assert max(energy) < 1.0 + 1e-3
        left.append(data.qvel[-6])
    if solref == "0.02 1":  # the other is not shorter than two steps
        assert left == pytest.approx([left[0]] * 3, abs=0.05)


def test_a_weld_that_is_switched_off_is_gone_and_jacobians_kept_whole_say_the_same():
    """Beside another tree that is held; 5 kg at 1 m/s meet 0.2 kg whose weld is off: momentum is kept."""
    speeds = []
    for jacobian in ("dense", "sparse"):
        xml = f"""<mujoco><option timestep=".002" jacobian="{jacobian}" gravity="0 0 0"/><worldbody>
            <body name="other" pos="1 0 0">{SLIDES}<geom name="o" size=".03" mass="1"/></body>
            <body name="hand">{SLIDES}<geom name="h" size=".03" mass=".2"/></body>
            <body name="ball" pos=".2 0 0"><freejoint/><geom name="b" size=".03" mass="5"/></body></worldbody><equality>
            <connect body1="other" anchor="0 0 0"/><weld body1="hand"/></equality></mujoco>"""
        model = load_model(xml, [("b", ["h", "o"], ContactPair(MATERIALS["rubber"], MATERIALS["rubber"], 0.3, 0.8))])
        for off in (False, True):
            data = mujoco.MjData(model)
            data.qvel[4] = -1.0
            mujoco.mj_step(model, data, 50)
            data.eq_active[1] = not off
            mujoco.mj_step(model, data, 100)
            speeds.append(data.qvel[[2, 4]].copy())
    assert speeds[0] == pytest.approx(speeds[2], abs=1e-9)
    assert speeds[1] == pytest.approx(speeds[3], abs=1e-9)
    assert 0.2 * speeds[1][0] + 5.0 * speeds[1][1] == pytest.approx(-5.0, rel=1e-6)
    assert speeds[1][1] < -0.9 < -0.5 < speeds[0][1]


def test_a_connect_at_a_hinge_adds_rows_that_are_zero_and_the_engine_drops():
    """MuJoCo makes room for rows of it that it then leaves out: the motion is that of the model without it."""
    ends = []
    for idle in ("", '<connect body1="arm" body2="hand" anchor="0 0 0"/>'):
        xml = f"""<mujoco><option timestep=".002" integrator="RK4" gravity="0 0 0"/><worldbody>
            <body name="hand">{SLIDES}<geom name="h" size=".03" mass=".5"/><body name="arm" pos="0 .1 0">
            <joint name="elbow" axis="0 0 1"/><geom pos="0 .1 0" size=".03" mass=".2"/></body></body>
            <body pos="0 .5 0"><joint name="slide" type="slide"/><geom size=".03" mass="1"/></body>
            <body pos=".2 0 0"><freejoint/><geom name="b" size=".03" mass=".5"/></body></worldbody><equality>
            <joint joint1="elbow" joint2="slide" polycoef="0 .3"/>{idle}</equality></mujoco>"""
        model = load_model(xml, [("b", "h", ContactPair(MATERIALS["rubber"], MATERIALS["rubber"], 0.3, 0.8))])
        data = mujoco.MjData(model)
        data.qvel[2:5] = [3.0, 0.0, -1.0]
        mujoco.mj_step(model, data, 200)
        assert data.nefc == 1
        ends.append(data.qvel.copy())
    assert ends[0][0] < -0.1
    assert ends[1] == pytest.approx(ends[0], abs=1e-12)


@pytest.mark.parametrize("mocap", [False, True])
def test_a_base_that_is_moved_meets_what_only_turns_above_the_ground_otherwise(mocap):
    """A hinge across a gap of 7 mm: what it carries never meets the table, unless its base may be led there."""
    model = load_model(
        f"""<mujoco><option timestep="1e-3"/><worldbody><geom name="table" type="box" size=".1 .1 .05"/>
        <body name="base" pos="0 0 .077" mocap="{str(mocap).lower()}"><body><joint axis="0 0 1"/>
        <geom name="hand" type="box" size=".02 .02 .02" mass="1"/></body></body></worldbody></mujoco>""",
        [("hand", "table", ContactPair(MATERIALS["rubber"], MATERIALS["steel"], MU, 0.5))],
    )
    data = mujoco.MjData(model)
    data.qvel[0] = 100.0
    mujoco.mj_step(model, data, 10)
    assert (view_of(model, data).world["nears"] > 0) == mocap


@pytest.mark.parametrize("kind", ["weld", "connect"])
def test_overlaps_that_a_constraint_holds_are_not_kept(kind):
    """Two steel boxes 70 mm deep in each other: the energy of that would end in numbers that are not finite."""
    anchor = ' anchor="0 0 0"' if kind == "connect" else ""
    boxes = "".join(
        f'<body name="{name}" pos="{x} 0 .3"><freejoint/><geom name="{name}" type="box" size=".05 .05 .05"/></body>'
        for name, x in (("left", 0.0), ("right", 0.03))
    )
    held = f'<equality><{kind} body1="left" body2="right"{anchor}/></equality>'
    scene = f"<mujoco><worldbody>{boxes}</worldbody>{held}</mujoco>"
    with pytest.raises(
        ValueError, match="overlaps = 'keep': parts are built into each other: 'left' and 'right' by 70 mm"
    ):
        load_model(scene, [("*", "*", ContactPair("steel", "steel", 0.3, 0.9))], overlaps="keep")
