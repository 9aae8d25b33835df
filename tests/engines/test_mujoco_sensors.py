"""MuJoCo's sensors of forces and accelerations with the law, against statics, impulses and its own contacts."""

import numpy as np
import pytest
from mujoco_scenes import mujoco, with_data

from contactlaw import MATERIALS, ContactPair
from contactlaw.mujoco_plugin import contacts_of, load_model

RUBBER, STEEL = MATERIALS["rubber"], MATERIALS["steel"]
SOFT, HARD = ContactPair(RUBBER, RUBBER, 0.8, 0.5), ContactPair(STEEL, STEEL, 0.3, 0.8)
FOOT, TRUNK, G = 1.0, 9.0, 9.81  # [kg], [m/s^2]
BALLS = "".join(
    f'<geom name="ball{i}" size=".05" pos="{x} {y} -.05"/>'
    for i, (x, y) in enumerate([(-0.1, -0.1), (-0.1, 0.1), (0.1, -0.1), (0.1, 0.1)])
)
OURS = '<plugin plugin="contactlaw.contact" objtype="{}" objname="{}"/>'
NATIVE = """<force name="force" site="ankle"/><torque name="torque" site="ankle"/>
<accelerometer name="accelerometer" site="trunk"/><touch name="touch" site="sole"/><touch name="half" site="half"/>
<touch name="weak" site="sole" cutoff="50"/>"""


def leg(sensors="", timestep=0.002, integrator="Euler", gravity=G, joint=""):
    """A trunk on a foot of four balls, both one body for the engine unless a joint is between them."""
    return f"""<mujoco><extension><plugin plugin="contactlaw.contact"/></extension>
    <option timestep="{timestep}" integrator="{integrator}" gravity="0 0 {-gravity}"/>
    <worldbody><geom name="floor" type="plane" size="1 1 1"/>
    <body name="trunk" pos="0 0 .5"><freejoint/><inertial pos="0 0 0" mass="{TRUNK}" diaginertia=".1 .1 .1"/>
    <site name="trunk"/><body name="foot" pos="0 0 -.4">{joint}
    <inertial pos="0 0 0" mass="{FOOT}" diaginertia=".01 .01 .01"/>
    <site name="ankle"/><site name="sole" size=".3"/><site name="half" type="box" size=".2 .2 .2" pos=".2 0 0"/>{BALLS}
    </body></body></worldbody><sensor>{sensors}</sensor></mujoco>"""


def lawful(pair=SOFT, **options):
    return load_model(leg(**options), [("ball*", "floor", pair)])


def read(data, name):
    return data.sensor(name).data.copy()


@pytest.mark.parametrize("integrator", ["Euler", "RK4", "implicitfast"])
def test_what_stands_still_reads_as_statics_say(integrator):
    """A pull and a twist at the trunk; the sensor at the ankle reads what the foot does to the trunk."""
    model = lawful(sensors=NATIVE, integrator=integrator)
    native = mujoco.MjModel.from_xml_string(leg(sensors=NATIVE, integrator=integrator))
    pull, twist, weight = np.array([8.0, 0.0, -5.0]), np.array([0.0, 3.0, 0.0]), np.array([0.0, 0.0, -G])
    for m in (model, native):
        data = mujoco.MjData(m)
        data.xfrc_applied[1] = [*pull, *twist]
        mujoco.mj_step(m, data, 4000)  # rubber feet settle for seconds
        for _ in range(2):
            turn, trunk = data.site("ankle").xmat.reshape(3, 3), data.site("ankle").xpos - data.body("trunk").xipos
            force, moment = pull + TRUNK * weight, twist - np.cross(trunk, pull + TRUNK * weight)
            assert turn @ read(data, "force") == pytest.approx(force, abs=2e-2)
            assert turn @ read(data, "torque") == pytest.approx(moment, abs=2e-2)
            assert turn @ read(data, "accelerometer") == pytest.approx(-weight, abs=2e-3)
            assert read(data, "touch")[0] == pytest.approx(-(force + FOOT * weight)[2], rel=1e-3)
            # moments about the balls at x = -0.1, which the others hold up
            arms = np.array([data.body(name).xipos[0] for name in ("trunk", "foot")]) - data.geom("ball0").xpos[0]
            moment = pull[0] * data.body("trunk").xipos[2] - force[2] * arms[0] + FOOT * G * arms[1] + twist[1]
            share = moment / (data.geom("ball2").xpos[0] - data.geom("ball0").xpos[0])
            assert read(data, "half")[0] == pytest.approx(share, rel=1e-3)
            assert read(data, "weak") == [50.0]
            assert data.cfrc_ext[2, 3:] == pytest.approx(-(force + FOOT * weight), abs=2e-2)
            assert data.cfrc_int[2, 3:] == pytest.approx(force, abs=2e-2)
            assert data.cacc[1] == pytest.approx([0, 0, 0, 0, 0, G], abs=2e-3)
            mujoco.mj_forward(m, data)  # what presses now is what pressed in the mean
        assert data.xfrc_applied[1].tolist() == [*pull, *twist] and not data.xfrc_applied[2].any()


@pytest.mark.parametrize(("timestep", "integrator"), [(5e-4, "Euler"), (2e-3, "Euler"), (5e-3, "RK4")])
def test_in_an_impact_the_mean_over_the_step_is_read(timestep, integrator):
    """Straight down, without gravity: what the trunk and both together are given is the sum of the readings."""
    model = lawful(HARD, sensors=NATIVE, timestep=timestep, integrator=integrator, gravity=0.0)
    data, total = mujoco.MjData(model), dict.fromkeys(("force", "accelerometer", "touch"), 0.0)
    data.qpos[2] += 2.3e-3
    data.qvel[2] = -1.0
    for _ in range(round(0.01 / timestep)):
        mujoco.mj_step(model, data)
        for name in total:
            total[name] += timestep * read(data, name)[-1]
    change = data.qvel[2] + 1.0
    assert change > 1.5
    assert total["touch"] == pytest.approx((TRUNK + FOOT) * change, rel=1e-9)
    assert total["accelerometer"] == pytest.approx(change, rel=1e-9)
    assert total["force"] == pytest.approx(-TRUNK * change, rel=1e-9)


def test_a_hinge_that_turns_freely_has_no_torque_in_an_impact():
    """Force and moment balance of the foot, with accelerations and contacts as they are read."""
    hinge = '<joint name="hinge" axis="0 1 0"/>'
    model = lawful(HARD, sensors=NATIVE, gravity=0.0, joint=hinge)
    data, steps = mujoco.MjData(model), 0
    data.qpos[2] += 1e-3
    data.qvel[:] = [0.3, 0.2, -1.0, 0.5, 1.0, -2.0, 3.0]
    for _ in range(10):
        mujoco.mj_step(model, data)
        push = data.cfrc_ext[2, 3:]
        steps += np.linalg.norm(push) > 10.0
        assert abs(read(data, "torque")[1]) < 1e-9 * (1.0 + np.linalg.norm(read(data, "torque")))
    assert steps >= 1


def test_what_sensors_read_changes_nothing_else():
    runs = []
    for sensors in ("", NATIVE + OURS.format("body", "foot")):
        model, data = with_data(lawful(sensors=sensors, joint='<joint axis="0 1 0" stiffness="300" damping="1"/>'))
        data.qpos[2] += 0.01
        data.qvel[0] = 0.1
        mujoco.mj_step(model, data, 150)
        runs.append(
            np.concatenate([data.qpos, data.qvel, data.qacc, data.qacc_warmstart, data.qfrc_passive, [data.time]])
        )
    assert np.array_equal(*runs)


def test_sensors_of_contacts_tell_what_contacts_do():
    own = (
        OURS.format("body", "foot")
        + OURS.format("geom", "ball3")
        + OURS.format("site", "half")
        + OURS.format("geom", "floor")
    )
    model, data = with_data(lawful(sensors=own))
    data.xfrc_applied[1, :3] = [8.0, 0.0, -5.0]
    mujoco.mj_step(model, data, 300)
    data.xfrc_applied[1, 2] = 400.0  # it leaves the ground
    for _ in range(20):
        every = contacts_of(model, data, "contactlaw:ball0..ball3(4):floor")
        contacts = [contact for contact in every if contact.force @ contact.normal > 0.0]
        foot, ball, half, floor = data.sensordata.reshape(4, 10)
        signs = [1.0 if contact.geom1 else -1.0 for contact in contacts]
        forces = np.array([sign * contact.force for sign, contact in zip(signs, contacts, strict=True)]).reshape(-1, 3)
        points, sizes = np.array([contact.point for contact in contacts]).reshape(-1, 3), np.linalg.norm(forces, axis=1)
        assert foot[0] == len(contacts) and half[0] == sum(contact.point[0] > 0.0 for contact in contacts)
        assert ball[0] == min(len(contacts), 1)
        assert foot[1:4] == pytest.approx(forces.sum(0), abs=1e-9) and floor[1:4] == pytest.approx(-foot[1:4], abs=1e-9)
        if len(contacts):
            speed = np.abs(data.qvel[:3]).sum() + 0.5 * np.abs(data.qvel[3:]).sum()
            way = 1e-6 + model.opt.timestep * speed  # readings are of where the step began
            centre = sizes @ points / sizes.sum()
            assert foot[7:] == pytest.approx(centre, abs=way)
            assert foot[4:7] == pytest.approx(np.cross(points - foot[7:], forces).sum(0), abs=2e-2)
            assert half[7] > 0.09 and ball[1:4] == pytest.approx(forces[-1], abs=1e-9)
        else:
            assert not data.sensordata.any()
        mujoco.mj_step(model, data)
    assert not data.sensordata.any()


def test_a_sensor_of_contacts_is_on_something():
    with pytest.raises(ValueError):
        mujoco.MjData(lawful(sensors='<plugin plugin="contactlaw.contact"/>'))


@pytest.mark.skipif(not hasattr(mujoco.MjModel, "sensor_delay"), reason="sensors have no delay before")
def test_a_sensor_with_a_delay_knows_what_presses():
    model, data = with_data(lawful(sensors='<accelerometer name="late" site="trunk" delay=".01" nsample="6"/>'))
    mujoco.mj_step(model, data, 4000)
    assert read(data, "late") == pytest.approx([0.0, 0.0, G], abs=1e-3)


@pytest.mark.parametrize("material", ["steel", "rubber"])  # which take implicit steps, and substeps
@pytest.mark.parametrize("integrator", ["Euler", "implicitfast", "RK4"])
@pytest.mark.parametrize("joint", ['type="slide" axis="0 0 1" range="0 1"', 'axis="0 1 0" range="-60 0" pos="-.1 0 0"'])
def test_what_rests_on_the_stop_of_a_joint_above_a_contact_sinks_and_weighs_as_the_engine_has_it(
    joint, integrator, material
):
    """It sank 1.4 to 20 times as deep, and sensors read up to twice its weight."""
    model = load_model(
        f"""<mujoco><compiler autolimits="true"/><option timestep="2e-3" integrator="{integrator}"/><worldbody>
        <geom name="floor" type="plane" size="1 1 1"/><body pos="0 0 .05"><joint type="slide" axis="0 0 1"/>
        <geom name="ball" size=".05" mass="1"/><body pos="0 0 .2"><joint {joint}/><inertial pos="0 0 0" mass=".2"
        diaginertia="1e-4 1e-4 1e-4"/><site name="s"/></body></body></worldbody>
        <sensor><accelerometer site="s"/><force site="s"/></sensor></mujoco>""",
        [("ball", "floor", ContactPair(material, material, friction=0.3, restitution=0.5))],
    )
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 750)
    assert data.sensordata[[2, 5]] == pytest.approx([9.81, 9.81 * 0.2], rel=1e-3)
    data.qfrc_applied[0] = 9.81 * 1.2  # in place of the contact
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    mujoco.mj_forward(model, data)
    assert data.qacc == pytest.approx([0.0, 0.0], abs=0.1)
