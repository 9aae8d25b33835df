"""Actuators, tendons and joint limits of bodies that touch by the law in MuJoCo."""

import numpy as np
import pytest
from mujoco_scenes import mujoco, steel_pair, with_data

from contactlaw import MATERIALS, ContactPair, Material
from contactlaw.mujoco_plugin import load_model

UNSEEN = 'contype="0" conaffinity="0"'
REACH = 0.2  # [m] of an arm


@pytest.mark.parametrize(("stiffness", "damping"), [(1e3, 10.0), (1e3, 100.0), (1e4, 50.0), (1e4, 500.0)])
@pytest.mark.parametrize("mass", [0.1, 1.0])
def test_a_gripper_of_position_actuators_holds_a_ball_that_is_shaken(stiffness, damping, mass):
    """Fingers of 50 g, 2 ms: a finger alone would lose all of its speed in 0.1 ms at 500 N s/m. 6 mm at 3 Hz."""
    pair = ContactPair(MATERIALS["steel"], MATERIALS["rubber"], friction=0.8, restitution=0.5, radius=0.02)
    force = mass * 12.0 / 0.8  # twice what is needed
    squeeze = (0.75 * force / (pair.effective_modulus * 0.02**0.5)) ** (2.0 / 3.0)
    fingers = "".join(
        f'<body><joint name="{name}" type="slide" axis="{-side} 0 0"/>'
        f'<geom name="{name}" type="box" size=".005 .03 .03" pos="{side * 0.025} 0 0" mass=".05"/></body>'
        for side, name in ((1, "right"), (-1, "left"))
    )
    drive = f'kp="{stiffness}" kv="{damping}"'
    model = load_model(
        f"""<mujoco><option timestep=".002" integrator="implicitfast" gravity="0 0 0"/><worldbody>
        <body name="hand" pos="0 0 1"><joint name="lift" type="slide" axis="0 0 1"/>
        <geom type="box" size=".05 .05 .02" pos="0 0 .2" mass="2" {UNSEEN}/>{fingers}</body>
        <body pos="0 0 1"><freejoint/><geom name="ball" size=".02" mass="{mass}"/></body></worldbody><actuator>
        <position joint="right" {drive}/><position joint="left" {drive}/><position joint="lift" kp="1e5" kv="2e3"/>
        </actuator></mujoco>""",
        [("ball", ["right", "left"], pair)],
        others=False,
    )
    data, places = mujoco.MjData(model), []
    data.ctrl[:2] = force / stiffness + squeeze
    for step in range(2500):
        time = 0.002 * step
        model.opt.gravity[2] = -9.81 * min(time / 0.3, 1.0)
        data.ctrl[2] = 6e-3 * np.sin(6.0 * np.pi * time) * min(time / 0.3, 1.0)
        mujoco.mj_step(model, data)
        places.append(data.qpos[3:6] - [0.0, 0.0, 1.0 + data.qpos[0]])
    held = np.array(places)
    assert np.linalg.norm(held[-500:].mean(0) - held[500:1000].mean(0)) < 5e-5
    assert np.ptp(held[500:, 2]) < 2e-4


@pytest.mark.parametrize("integrator", ["implicit", "implicitfast"])
@pytest.mark.parametrize("damping", [0.1, 10.0])
def test_a_tendon_that_damps_two_hinges_of_a_finger_is_felt_in_an_impact(damping, integrator):
    """A ball strikes the tip from below; 2 ms against 10 us."""
    link = f'<geom type="capsule" fromto="0 0 0 .1 0 0" size=".01" mass=".1" {UNSEEN}/>'
    text = f"""<mujoco><option integrator="{integrator}" gravity="0 0 0"/><worldbody>
        <body pos="0 0 .3"><joint name="a" axis="0 1 0"/>{link}
        <body pos=".1 0 0"><joint name="b" axis="0 1 0"/>{link}<geom name="tip" size=".01" pos=".1 0 0" mass=".02"/>
        </body></body><body pos=".2 0 .2"><freejoint/><geom name="ball" size=".02" mass=".1"/></body></worldbody>
        <tendon><fixed name="t"><joint joint="a" coef="1"/><joint joint="b" coef="-.7"/></fixed></tendon>
        <actuator><position tendon="t" kp="20" kv="{damping}"/></actuator></mujoco>"""
    after = []
    for step in (2e-3, 1e-5):
        model = load_model(text, [("tip", "ball", steel_pair(friction=0.3, restitution=0.9))], others=False)
        model.opt.timestep = step
        data = mujoco.MjData(model)
        data.qvel[4] = 3.0
        mujoco.mj_step(model, data, round(0.06 / step))
        after.append(np.append(data.qvel[:2], 10.0 * data.qvel[4]))
    assert abs(after[1][1]) > 5.0
    np.testing.assert_allclose(after[0], after[1], rtol=5e-3)


@pytest.mark.parametrize(("youngs_modulus", "step"), [(4e6, 5e-4), (4e6, 2e-3), (4e6, 5e-3), (1e8, 2e-3)])
@pytest.mark.parametrize("damping", [0.1, 1.0])
def test_an_arm_with_damping_that_lies_on_a_soft_end_stands_still_and_sleeps(youngs_modulus, step, damping):
    """Its contact lasts too long for implicit steps; gravity, damping and the contact must balance in substeps."""
    soft = Material(youngs_modulus, 0.3)
    model = load_model(
        f"""<mujoco><option timestep="{step}"/><worldbody><geom name="floor" type="plane" size="1 1 .1"/>
        <body pos="0 0 .3"><joint axis="0 1 0" damping="{damping}"/>
        <geom name="arm" type="capsule" size=".02" fromto="0 0 0 .3 0 -.1" mass=".3"/></body></worldbody></mujoco>""",
        [("arm", "floor", ContactPair(soft, soft, friction=0.5, restitution=0.3))],
    )
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, round(6.0 / step))
    angle = data.qpos[0]
    mujoco.mj_step(model, data, 100)
    assert data.qvel[0] == 0.0 and data.qpos[0] == angle


def arm(step, integrator, limit, solref):
    """An arm with a tip of steel over a floor that it touches where its hinge is at zero; without gravity."""
    model = load_model(
        f"""<mujoco><option timestep="{step}" integrator="{integrator}" gravity="0 0 0"/><worldbody>
        <geom name="floor" type="plane" size="1 1 .1"/><body pos="0 0 .02"><joint axis="0 -1 0" limited="true"
        range="{np.degrees(limit)} 90" solreflimit="{solref}"/>
        <geom type="capsule" fromto="0 0 0 {REACH} 0 0" size=".005" mass=".02" {UNSEEN}/>
        <geom name="tip" size=".02" pos="{REACH} 0 0" mass=".1"/></body></worldbody></mujoco>""",
        [("tip", "floor", steel_pair(friction=0.2, restitution=1.0))],
        others=False,
    )
    return model, mujoco.MjData(model)


@pytest.mark.parametrize("integrator", ["Euler", "RK4", "implicitfast", "implicit"])
@pytest.mark.parametrize("step", [5e-3, 2e-3])
def test_an_arm_that_passes_its_stop_as_it_strikes_the_floor_gains_nothing(step, integrator):
    for limit in (-0.02, -0.005, 0.0, 0.005, 0.02):
        for solref in ("0.02 1", "0.005 0.5"):
            for phase in (0.0, 0.3, 0.7):
                model, data = arm(step, integrator, limit, solref)
                data.qpos[0], data.qvel[0] = 0.05 * (1.0 + phase), -10.0
                for _ in range(round(0.06 / step)):
                    mujoco.mj_step(model, data)
                    assert abs(data.qvel[0]) < 10.0 * (1.0 + 1e-4)  # to what an elastic impact keeps


@pytest.mark.parametrize("integrator", ["Euler", "implicitfast"])
@pytest.mark.parametrize(("material", "restitution"), [("steel", 0.5), ("steel", 1.0), ("rubber", 0.9)])
def test_a_rail_damped_so_much_that_it_does_not_move_is_like_a_wall(integrator, material, restitution):
    """As robots stand on rails: its damping stops it within 0.2 ns; a touch of the arm lasts 10 us to 8 ms."""
    angles, pair = [], ContactPair(MATERIALS[material], MATERIALS["steel"], friction=0.3, restitution=restitution)
    for rail in ("", '<joint type="slide" axis="0 0 1" damping="1e11" armature="1e-4"/>'):
        model = load_model(
            f"""<mujoco><option timestep=".002" integrator="{integrator}"/><worldbody>
            <geom name="floor" type="plane" size="2 2 .1"/><body pos="0 0 .1">{rail}
            <geom type="box" size=".1 .1 .05" pos="0 0 .3" mass="20" {UNSEEN}/><body><joint axis="0 -1 0"/>
            <geom type="capsule" fromto="0 0 0 {REACH} 0 0" size=".005" mass=".02" {UNSEEN}/>
            <geom name="tip" size=".02" pos="{REACH} 0 0" mass=".1"/></body></body></worldbody></mujoco>""",
            [("tip", "floor", pair)],
        )
        data = mujoco.MjData(model)
        mujoco.mj_step(model, data, 200)
        angles.append(data.qpos[-1])
    assert abs(data.qpos[0]) < 1e-8
    assert angles[1] == pytest.approx(angles[0], abs=1e-3)


def pendulum(clearance, integrator):
    """Text of a pendulum over a floor that its tip passes by so far [m]."""
    return f"""<mujoco><option timestep="0.005" integrator="{integrator}"/><worldbody>
        <geom name="floor" type="plane" size="2 2 .1"/><body pos="0 0 {REACH + 0.02 + clearance}">
        <joint axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0 0 {-REACH}" size=".005" mass=".02" {UNSEEN}/>
        <geom name="tip" size=".02" pos="0 0 {-REACH}" mass=".1"/></body></worldbody></mujoco>"""


@pytest.mark.parametrize("integrator", ["Euler", "RK4"])
def test_an_arm_that_passes_over_the_floor_flies_as_the_engine_flies_it(integrator):
    """To the bit, though it is near all the time; one that is below the floor within a step alone is turned back."""
    contact = [("tip", "floor", steel_pair(friction=0.0, restitution=1.0))]
    native = mujoco.MjModel.from_xml_string(pendulum(1e-3, integrator))
    native.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    model = load_model(pendulum(1e-3, integrator), contact, others=False)
    data, alone = mujoco.MjData(model), mujoco.MjData(native)
    data.qpos[0] = alone.qpos[0] = 0.5
    for _ in range(200):
        mujoco.mj_step(model, data)
        mujoco.mj_step(native, alone)
        assert data.qpos[0] == alone.qpos[0]
    model, data = with_data(load_model(pendulum(-1e-3, integrator), contact, others=False))
    data.qpos[0], data.qvel[0] = 0.15, -60.0
    mujoco.mj_step(model, data, 2)
    assert data.qpos[0] > 0.0
    assert data.qvel[0] == pytest.approx(60.0, rel=1e-2)


def test_a_model_that_disables_contacts_has_none_of_the_law():
    model, data = arm(2e-3, "Euler", -1.0, "0.02 1")
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    data.qpos[0], data.qvel[0] = 0.05, -5.0
    mujoco.mj_step(model, data, 50)
    assert data.qpos[0] < -0.1


@pytest.mark.parametrize("speed", [20.0, 80.0, 140.0, 200.0])
def test_a_fast_arm_strikes_what_it_would_jump_over_in_a_step(speed):
    """A box on an arm of 0.3 m, against a thin box; a step of 2 ms is up to 12 cm, so that no parts are listed before.

    The elastic impact turns the arm back; one that missed the thin box would go on round.
    """
    model = load_model(
        f"""<mujoco><option timestep=".002" gravity="0 0 0"/><worldbody>
        <geom name="wall" type="box" size=".004 .05 .05" pos="-.3 0 0"/><body><joint name="j" axis="0 0 1"/>
        <geom type="box" size=".14 .01 .01" pos=".15 0 0" mass=".1" {UNSEEN}/>
        <geom name="tip" type="box" size=".02 .015 .02" pos=".3 0 0" mass=".1" euler="10 20 0"/>
        </body></worldbody></mujoco>""",
        [("tip", "wall", ContactPair("rubber", "steel", friction=0.3, restitution=1.0))],
        others=False,
    )
    for phase in np.linspace(0.0, 2e-3 * speed, 8):
        data = mujoco.MjData(model)
        data.qpos[:], data.qvel[:] = -phase, speed
        most = -np.inf
        while abs(data.qpos[0]) < 2.0 * np.pi and data.time < 1.5 * np.pi / speed:
            mujoco.mj_step(model, data)
            most = max(most, data.qpos[0])
        assert most < np.pi + 0.2  # rubber is pressed deeper than the wall is thick; at 75 m/s it may leave behind it
        assert -1.01 * speed < data.qvel[0] < 0.0


@pytest.mark.parametrize("timestep", [1e-3, 5e-3])
@pytest.mark.parametrize("integrator", ["Euler", "RK4"])
def test_a_light_link_that_carries_a_heavy_one_gains_no_energy_from_an_impact(integrator, timestep):
    """6 g carry 1.4 kg at a ball joint. A torque error that the 1.4 kg would hardly notice spins 6 g up."""
    bodies = """<worldbody><geom name="floor" type="plane" size="3 3 1"/>
        <body pos="0 0 .1406"><freejoint/><geom type="sphere" size=".0172" pos="-.012 0 -.051" density="300"/>
        <body pos="-.0082 -.1179 -.0876"><joint type="ball"/>
        <geom name="heavy" type="sphere" size=".035" pos="-.021 0 -.016" density="7800"/>
        <body pos="-.0368 -.0584 .1099"><joint axis="-1.014 .352 -.32" armature="1e-5"/>
        <geom type="cylinder" size=".0265 .0175" pos="0 0 .017" density="1000"/></body></body></body></worldbody>"""
    source = f'<mujoco><option timestep="{timestep}" integrator="{integrator}"/>{bodies}</mujoco>'
    pair = ContactPair(MATERIALS["wood"], MATERIALS["wood"], friction=0.65, restitution=0.74)
    model = load_model(source, [("floor", "heavy", pair)])
    flight = mujoco.MjModel.from_xml_string(source)
    flight.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    flight.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    data, read = mujoco.MjData(model), mujoco.MjData(flight)
    data.qvel[:] = [-4.0, 0.0, -4.0, 5.0, 40.0, 18.0, -13.0, 3.0, -10.0, -100.0]
    energies = []
    for _ in range(round(1e-2 / timestep) + 1):
        read.qpos[:], read.qvel[:] = data.qpos, data.qvel
        mujoco.mj_forward(flight, read)
        energies.append(read.energy.sum())
        mujoco.mj_step(model, data)
    assert max(energies) < energies[0] * 1.02
    assert energies[-1] < 0.8 * energies[0]


OVER_THE_FLOOR = '<joint name="x" type="slide" axis="1 0 0"/><geom name="ball" size=".025" mass="1"/>'
ABOVE = """<geom name="ball" size=".025" mass="1"/><body><joint name="x" type="slide" axis="1 0 0"/>
<geom size=".01" mass="1" pos="0 0 .1" contype="0" conaffinity="0"/></body>"""
TENDON = '<tendon><fixed name="t" stiffness="{}"><joint joint="x" coef="2"/></fixed></tendon>'
SPRINGS = {
    "spring": lambda k: "", "servo": lambda k: f'<actuator><position joint="x" kp="{k / 4}" gear="2"/></actuator>',
    "tendon": lambda k: TENDON.format(k / 4), "tendon servo": lambda k: TENDON.format(0)
    + f'<actuator><general tendon="t" gainprm="{k / 4}" biastype="affine" biasprm="0 {-k / 4} 0"/></actuator>',
}  # fmt: skip


@pytest.mark.parametrize("integrator", ["Euler", "RK4", "implicitfast"])
@pytest.mark.parametrize(("timestep", "restitution"), [(2e-3, 0.5), (2e-4, 0.5), (2e-3, 1.0)])
@pytest.mark.parametrize("what", [OVER_THE_FLOOR, ABOVE], ids=["sliding", "standing"])
@pytest.mark.parametrize("spring", SPRINGS)
def test_what_a_spring_or_servo_swings_in_contact_gains_no_energy(spring, what, timestep, restitution, integrator):
    """A ball that slides on a smooth floor, or a mass on one that sticks: thirteen times to and fro at omega h = 0.2.

    Contacts take implicit steps, or are resolved as their step is short or they are elastic.
    """
    stiffness = (0.2 / timestep) ** 2
    if spring == "spring":
        what = what.replace('name="x"', f'name="x" stiffness="{stiffness}"')
    model = load_model(
        f"""<mujoco><option timestep="{timestep}" integrator="{integrator}"/><worldbody>
        <geom name="floor" type="plane" size="1 1 1"/><body pos="0 0 .025"><joint type="slide" axis="0 0 1"/>
        {what}</body></worldbody>{SPRINGS[spring](stiffness)}</mujoco>""",
        [("ball", "floor", ContactPair("steel", "steel", 0.5 if what == ABOVE else 0.0, restitution))],
    )
    data = mujoco.MjData(model)
    data.qpos[1] = 0.01
    energies = []
    for _ in range(400):
        mujoco.mj_step(model, data)
        energies.append(stiffness * data.qpos[1] ** 2 + data.qvel[1] ** 2)
    assert 0.95 < max(energies[300:]) / max(energies[20:120]) < 1.001


@pytest.mark.parametrize("seed", range(3))
def test_motors_that_whirl_a_soft_arm_over_the_floor_do_not_run_away(seed):
    """A substep for so slow a contact would be 10 rad: 1e22 rad/s and more, before. Natively it is 3e4 rad/s."""
    soft = ContactPair(Material(1e4, 0.4, 1100.0), MATERIALS["steel"], friction=0.8, restitution=0.5)
    model = load_model(
        """<mujoco><option timestep="2e-3"/><worldbody><geom type="plane" size="1 1 .1"/>
        <body pos="0 0 .2"><joint axis="0 0 1"/><geom size=".03" mass="1"/><body pos=".05 0 0"><joint axis="0 1 0"/>
        <geom type="capsule" fromto="0 0 0 .2 0 0" size=".02" mass=".5"/><body pos=".2 0 0"><joint axis="1 1 0"/>
        <geom type="capsule" fromto="0 0 0 .2 0 0" size=".02" mass=".2"/></body></body></body></worldbody></mujoco>""",
        [("*", "*", soft)],
    )
    data = mujoco.MjData(model)
    data.qpos[1] = 0.46
    mujoco.mj_step(model, data)
    data.qfrc_applied[:] = 1e4 * np.random.default_rng(seed).uniform(-1.0, 1.0, 3)
    mujoco.mj_step(model, data)
    assert 1e3 < np.abs(data.qvel).max() < 1e5


@pytest.mark.parametrize(("kv", "parting"), [(1e2, 5.4 / 1.003 - 2.0), (1e6, 3.4)])
def test_a_paddle_that_a_servo_moves_strikes_alike_at_any_step(kv, parting):
    """A ball of 3 g comes at 2 m/s to a paddle of 1 kg that a servo holds at 1 m/s; it left with 3.56 and 3.76 m/s."""
    text = f"""<mujoco><option gravity="0 0 0" integrator="implicitfast"/><worldbody>
      <body name="paddle"><joint name="lift" type="slide" axis="0 0 1"/>
        <geom name="paddle" type="box" size=".1 .1 .01" mass="1"/></body>
      <body pos="0 0 .3"><freejoint/><geom name="ball" size=".02" mass=".003"/></body></worldbody>
      <actuator><velocity joint="lift" kv="{kv}"/></actuator></mujoco>"""
    model = load_model(text, [("ball", "paddle", ContactPair("nylon", "nylon", friction=0.5, restitution=0.8))])
    for timestep in (1e-2, 2e-3, 1e-4):
        model.opt.timestep = timestep
        data = mujoco.MjData(model)
        data.ctrl[0], data.qvel[0], data.qvel[3] = 1.0, 1.0, -2.0
        mujoco.mj_step(model, data, round(0.2 / timestep))
        assert data.qvel[[0, 3]] == pytest.approx([1.0, parting], abs=2e-3)


@pytest.mark.parametrize(("torque", "left"), [(400.0, True), (20.0, False)])
def test_a_tree_that_a_step_loses_is_left_to_the_engine(torque: float, left: bool) -> None:
    """It gains 60 rad a step in one step of 2 ms, over a floor; where it gains 3 rad, it meets the floor."""
    rod = f"""<mujoco><option timestep="0.002"/><worldbody><geom type="plane" size="1 1 .1"/><body pos="0 0 .06">
    <joint name="j" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 .1 0 0" size=".01" mass=".008"/></body></worldbody>
    <actuator><motor joint="j" ctrlrange="-1 1" gear="{torque}"/></actuator></mujoco>"""
    pair = ContactPair("rubber", "steel", friction=0.8, restitution=0.5)
    native, law = mujoco.MjModel.from_xml_string(rod), load_model(rod, [("*", "*", pair)])
    native.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    ends = []
    for model in (native, law):
        data = mujoco.MjData(model)
        data.ctrl[:] = 1.0
        mujoco.mj_step(model, data)
        ends.append([data.qpos[0], data.qvel[0]])
    gain = model.opt.timestep * ends[0][1]
    assert (10.0 < gain < 100.0) if left else (1.0 < gain < 10.0)
    assert (ends[1] == pytest.approx(ends[0], rel=1e-9)) == left


@pytest.mark.parametrize(
    "extra",
    [
        '<tendon><fixed name="t" armature=".2"><joint joint="a" coef="2"/></fixed></tendon>',
        '<tendon><fixed name="t" armature=".2"><joint joint="a" coef="2"/><joint joint="b" coef="1"/></fixed></tendon>',
        """<tendon><fixed name="t"><joint joint="a" coef="1"/></fixed></tendon>
        <actuator><motor tendon="t" armature=".2" gear="2"/></actuator>""",
        '<actuator><motor joint="a" armature=".2" gear="2"/></actuator>',
        '<actuator><position joint="a" kp="1e-3" armature=".2" gear="2"/></actuator>',
    ],
    ids=["tendon", "tendon of two joints", "motor of a tendon", "motor", "servo"],
)
@pytest.mark.skipif(not hasattr(mujoco.MjModel, "actuator_armature"), reason="from MuJoCo 3.7")
def test_tendons_and_actuators_resist_an_impact_by_their_inertia(extra):
    """A ball strikes a slide that carries another one, without loss; the engine's mass matrix says how heavy it is."""
    model = load_model(
        f"""<mujoco><option gravity="0 0 0"/><worldbody><body><joint name="a" type="slide" axis="1 0 0"/>
        <geom name="struck" size=".05" mass=".1"/><body pos="0 0 1"><joint name="b" type="slide" axis="1 0 0"/>
        <geom size=".05" mass=".3" {UNSEEN}/></body></body>
        <body pos="-.11 0 0"><freejoint/><geom name="ball" size=".05" mass=".5"/></body></worldbody>{extra}</mujoco>""",
        [("ball", "struck", steel_pair(restitution=1.0))],
    )
    data, mobility = mujoco.MjData(model), np.zeros((1, model.nv))
    mujoco.mj_forward(model, data)
    mujoco.mj_solveM(model, data, mobility, np.eye(1, model.nv))
    data.qvel[2] = 1.0
    mujoco.mj_step(model, data, 20)
    mass = 1.0 / mobility[0, 0]
    assert data.qvel[2] == pytest.approx((0.5 - mass) / (0.5 + mass), abs=1e-4)


@pytest.mark.parametrize("restitution", [1.0, 0.5])
@pytest.mark.parametrize("armature", [0.2, 200.0])
def test_a_light_plate_with_inertia_of_its_joints_parts_with_the_restitution(armature, restitution):
    """By momentum and restitution: it had left with 0.54 for 0.5, as if its own mass alone stood behind the springs."""
    axes = "1 0 0", "0 1 0", "0 0 1"
    slides = "".join(f'<joint type="slide" axis="{axis}" armature="{armature}"/>' for axis in axes)
    for joints in (f'<joint type="free" armature="{armature}"/>', f'{slides}<joint type="ball"/>'):
        text = f"""<mujoco><option gravity="0 0 0"/><worldbody>
            <body>{joints}<geom name="plate" type="box" size=".1 .1 .01" mass=".02"/></body>
            <body pos="0 0 .0403"><freejoint/><geom name="ball" size=".03" mass="1"/></body></worldbody></mujoco>"""
        model = load_model(text, [("ball", "plate", steel_pair(friction=0.0, restitution=restitution))])
        data = mujoco.MjData(model)
        data.qvel[8] = -1.0
        mujoco.mj_step(model, data, 2)
        assert data.qvel[8] - data.qvel[2] == pytest.approx(restitution, abs=2e-4)
        assert (0.02 + armature) * data.qvel[2] + data.qvel[8] == pytest.approx(-1.0, abs=1e-9)


@pytest.mark.parametrize("kind", ["box", "cylinder"])
def test_a_light_body_with_inertia_of_its_joint_lands_flat_with_no_more_than_the_restitution(kind):
    """A cylinder of 20 g with 2 kg of armature had left with 46 times its speed, 2087 times its energy."""
    size = {"box": ".1 .1 .01", "cylinder": ".1 .01"}[kind]
    text = f"""<mujoco><option gravity="0 0 0"/><worldbody><geom name="floor" type="plane" size="1 1 1"/>
        <body pos="0 0 .0103"><joint type="free" armature="2"/><geom name="it" type="{kind}" size="{size}" mass=".02"/>
        </body></worldbody></mujoco>"""
    model = load_model(text, [("it", "floor", steel_pair(friction=0.0, restitution=0.5))])
    data = mujoco.MjData(model)
    data.qvel[2] = -1.0
    mujoco.mj_step(model, data, 5)
    assert 0.44 < data.qvel[2] < 0.5 + 1e-3


def test_balls_of_a_cradle_that_are_drawn_up_together_swing_as_one_until_they_strike():
    """They touch to the last bit but one, which differs from pair to pair; equal pendulums stay equal."""
    ball = '<body pos="{} 0 0"><joint axis="0 -1 0"/><geom size=".02" pos="0 0 -.3" mass=".26"/></body>'
    balls = "".join(ball.format(0.04 * k) for k in range(5))
    text = f'<mujoco><option timestep=".002"/><worldbody>{balls}</worldbody></mujoco>'
    model, data = with_data(load_model(text, [("*", "*", steel_pair(friction=0.0, restitution=1.0))]))
    data.qpos[:3] = -0.5
    mujoco.mj_step(model, data, 130)
    assert data.qpos[:3] == pytest.approx(data.qpos[0], abs=1e-12) and -0.15 < data.qpos[0] < -0.05
    assert data.qvel[:3] == pytest.approx(data.qvel[0], abs=1e-12)
