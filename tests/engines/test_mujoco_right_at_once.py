"""After `mj_step` the state is right at once, whatever the integrator and whatever turns or hangs on joints."""

from math import asin

import numpy as np
import pytest
from mujoco_scenes import ball_on_floor, mujoco, steel_pair, with_data

from contactlaw import ContactPair
from contactlaw.mujoco_plugin import contacts_of, instances_of, load_model

INTEGRATORS = ("Euler", "RK4", "implicit", "implicitfast")
PLANES = """<geom name="low" type="plane" size="5 5 .1" pos="0 0 -.1"/>
  <geom name="high" type="plane" size="5 5 .1" pos="0 0 .1" euler="180 0 0"/>"""
CAPSULE = '<geom name="one" type="capsule" size=".02 .05" density="7800"/>'
FEET = "".join(
    f'<geom name="foot{i}" size=".01" density="7800" '
    f'pos="{0.05 * (1 - 2 * (i & 1))} {0.03 * (1 - (i & 2))} {0.04 * (1 - (i & 4) / 2)}"/>'
    for i in range(8)
)


def thrown(timestep, integrator, phase=0.4):
    """A ball that spins and is about to strike the floor; the model, its state, the name of the contact."""
    spec, name = ball_on_floor(steel_pair(restitution=0.8), timestep, gravity=9.81)
    spec.option.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator.upper()}")
    model, data = with_data(spec.compile())
    data.qpos[2] += (1.0 + phase) * timestep
    data.qvel[:3], data.qvel[3:] = [0.3, 0.1, -1.0], [5.0, 3.0, 8.0]
    return model, data, name


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("carried", [0.0, 0.5])
def test_a_kick_for_one_step_gives_what_rests_all_its_momentum(integrator, carried):
    """carried: share of the weight that is carried by a force, before, in the step of the kick and after it."""
    dt, kick = 2e-3, np.array([200.0, 100.0, 300.0])
    model, data, _ = thrown(dt, integrator)
    data.qpos[2], data.qvel[:] = model.qpos0[2], 0.0
    mass, inertia, lag = model.body_mass[1], model.body_inertia[1, 1], 0.0 if integrator == "RK4" else 0.5 * dt
    lift = np.array([0.0, 0.0, carried * 9.81 * mass])
    data.xfrc_applied[1, :3] = lift
    mujoco.mj_step(model, data, 100)
    data.xfrc_applied[1] = [*(kick + lift), 0.0, 0.3, 0.0]
    mujoco.mj_step(model, data)
    data.xfrc_applied[1] = [*lift, 0.0, 0.0, 0.0]
    mujoco.mj_step(model, data)
    falls = [0.0, 0.0, (1.0 - carried) * 9.81]
    assert data.qvel[:3] - lag * np.array(falls) == pytest.approx(
        kick * dt / mass - 2.0 * dt * np.array(falls), abs=2e-3
    )
    assert data.qvel[3:] == pytest.approx([0.0, 0.3 * dt / inertia, 0.0], abs=0.2)


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("phase", [0.05, 0.4, 0.75])
def test_velocity_and_place_after_an_impact_are_those_of_a_fine_integration(integrator, phase):
    timestep = 2e-3
    fine_model, fine, _ = thrown(timestep, "RK4", phase)
    fine_model.opt.timestep = timestep / 1000
    mujoco.mj_step(fine_model, fine, 4000)
    model, data, name = thrown(timestep, integrator, phase)
    lag = 0.0 if integrator == "RK4" else 0.5 * timestep
    data.qvel[2] += lag * 9.81  # a velocity of the start, not of half a step before it
    found = 0
    for _ in range(4):
        mujoco.mj_step(model, data)
        if contacts_of(model, data, name):
            after, found = data.qvel.copy(), found + 1
    assert found == 1
    assert data.qvel[[0, 1, 3, 4, 5]] == pytest.approx(after[[0, 1, 3, 4, 5]], abs=1e-9)
    true = data.qvel[:3] - [0.0, 0.0, lag * 9.81]
    assert true == pytest.approx(fine.qvel[:3], abs=3e-4)  # the law's own error at 100 substeps
    assert data.qpos[:3] == pytest.approx(fine.qpos[:3], abs=3e-4 * 4 * timestep)


@pytest.mark.parametrize("timestep", [5e-4, 2e-3, 5e-3])
@pytest.mark.parametrize("friction", [0.0, 0.3])
@pytest.mark.parametrize("body", [CAPSULE, FEET], ids=["capsule", "box on feet"])
def test_what_tumbles_between_planes_gains_no_energy(body, friction, timestep):
    """Under Runge-Kutta, whose own flight keeps it."""
    geoms = "one" if body == CAPSULE else "foot*"
    model = load_model(
        f"""<mujoco><option timestep="{timestep}" integrator="RK4" gravity="0 0 0"/><worldbody>{PLANES}
        <body><freejoint/>{body}</body></worldbody></mujoco>""",
        [(geoms, ["low", "high"], steel_pair(friction=friction, restitution=1.0))],
    )
    (name,) = instances_of(model)
    for seed in range(4):
        rng, data = np.random.default_rng(seed), mujoco.MjData(model)
        data.qpos[3:] = rng.normal(size=4)
        mujoco.mj_normalizeQuat(model, data.qpos)
        data.qvel[:3], data.qvel[3:] = rng.normal(size=3), 10.0 * rng.normal(size=3)
        energies = [kinetic(model, data)]
        for _ in range(20):
            mujoco.mj_step(model, data, round(0.15 / timestep))
            while any(one.touching for one in contacts_of(model, data, name)):  # which hold energy
                mujoco.mj_step(model, data)
            energies.append(kinetic(model, data))
        assert np.diff(energies).max() < 1e-3 * energies[0]
        assert friction > 0.0 or energies[-1] == pytest.approx(energies[0], rel=1e-3)


def kinetic(model, data):
    """Energy of motion of one free body whose frame is its own [J]."""
    turn = np.empty(9)
    mujoco.mju_quat2Mat(turn, model.body_iquat[1])
    spin = turn.reshape(3, 3).T @ data.qvel[3:]
    velocity = data.qvel[:3]
    return 0.5 * (model.body_mass[1] * velocity @ velocity + (model.body_inertia[1] * spin) @ spin)


@pytest.mark.parametrize("timestep", [1e-3, 2e-3, 5e-3])
def test_a_double_pendulum_between_walls_keeps_its_energy(timestep):
    link = '<geom type="capsule" fromto="0 0 0 0 0 -.3" size=".01" density="2700" contype="0" conaffinity="0"/>'
    hinge = '<joint type="hinge" axis="0 1 0"/>'
    model = load_model(
        f"""<mujoco><option timestep="{timestep}" integrator="RK4"><flag energy="enable"/></option><worldbody>
        <geom name="left" type="plane" size="5 5 .1" pos="-.25 0 0" zaxis="1 0 0"/>
        <geom name="right" type="plane" size="5 5 .1" pos=".25 0 0" zaxis="-1 0 0"/>
        <body pos="0 0 1">{hinge}{link}<body pos="0 0 -.3">{hinge}{link}
        <geom name="tip" size=".02" pos="0 0 -.3" density="7800"/></body></body></worldbody></mujoco>""",
        [("tip", ["left", "right"], steel_pair(friction=0.0, restitution=1.0))],
    )
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = [0.2, 0.3], [3.0, -2.0]
    energies, impacts = [], 0
    for _ in range(round(10.0 / timestep)):
        before = data.qvel.copy()
        mujoco.mj_step(model, data)
        impacts += np.abs(data.qvel - before).max() > 1.0
    for _ in range(2):
        mujoco.mj_forward(model, data)
        energies.append(data.energy.sum())
        mujoco.mj_resetData(model, data)
        data.qpos[:], data.qvel[:] = [0.2, 0.3], [3.0, -2.0]
    assert impacts > 20
    assert energies[0] == pytest.approx(energies[1], abs=1e-5 * impacts * abs(energies[1]))


@pytest.mark.parametrize("integrator", ["Euler", "RK4", "implicitfast"])
@pytest.mark.parametrize("restitution", [0.02, 0.1, 0.5, 0.9])
def test_a_hinged_arm_that_falls_on_the_floor_stays_down(restitution, integrator):
    for timestep in (2e-3, 5e-3, 1e-2):
        for height in (0.03, 0.1, 0.25):
            model = load_model(
                f"""<mujoco><option timestep="{timestep}" integrator="{integrator}"/><worldbody>
                <geom name="floor" type="plane" size="5 5 .1"/><body pos="0 0 .02"><joint type="hinge" axis="0 1 0"/>
                <geom type="capsule" fromto="0 0 0 .3 0 0" size=".01" density="2700" contype="0" conaffinity="0"/>
                <geom name="tip" size=".02" pos=".3 0 0" density="7800"/></body></worldbody></mujoco>""",
                [("tip", "floor", steel_pair(friction=0.2, restitution=restitution))],
            )
            data = mujoco.MjData(model)
            data.qpos[0] = start = -asin(height / 0.3)
            angles = []
            for _ in range(round(3.0 / timestep)):
                mujoco.mj_step(model, data)
                angles.append(data.qpos[0])
            assert min(angles) >= 1.002 * start and max(angles) < 1e-3
            assert restitution > 0.5 or abs(angles[-1]) < 1e-3


@pytest.mark.parametrize("integrator", ["Euler", "RK4"])
@pytest.mark.parametrize("joint", ["<freejoint/>", '<joint axis="0 1 0" pos="-.25 0 0"/>'])
@pytest.mark.parametrize("moved", ["support", "body"])
def test_what_is_placed_away_from_its_support_falls_from_the_first_step(integrator, joint, moved):
    """The push of a contact that is no more stayed in the engine's step: it hung for one step."""
    xml = f"""<mujoco><option integrator="{integrator}"/><worldbody><geom type="plane" size="1 1 .1"/>
    <body pos="0 0 .05"><freejoint/><geom type="box" size=".05 .05 .05"/></body>
    <body pos="0 0 .12">{joint}<geom type="capsule" fromto="-.2 0 0 .2 0 0" size=".02"/></body></worldbody></mujoco>"""
    native, model = mujoco.MjModel.from_xml_string(xml), load_model(xml, [("*", "*", steel_pair())])
    native.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    data, alone = mujoco.MjData(model), mujoco.MjData(native)
    mujoco.mj_step(model, data, 200)
    free = model.nv == 12
    coordinate, change = (1, 0.5) if moved == "support" else (9, 0.2) if free else (7, -0.3)
    data.qpos[coordinate] += change
    alone.qpos[:], alone.qvel[:] = data.qpos, data.qvel
    for _ in range(3):
        mujoco.mj_step(model, data)
        mujoco.mj_step(native, alone)
        assert data.qvel[6:] == pytest.approx(alone.qvel[6:], rel=1e-5, abs=1e-6)


SLIDES = "".join(f'<joint type="slide" axis="{axis}"/>' for axis in ("1 0 0", "0 1 0", "0 0 1"))
WEIGHT = '<body><joint axis="0 0 1"/><geom size=".001" mass="1e-4" contype="0" conaffinity="0"/></body>'


@pytest.mark.parametrize("timestep", [1e-3, 5e-3])
@pytest.mark.parametrize(("joints", "carried"), [(SLIDES + '<joint type="ball"/>', ""), ("<freejoint/>", WEIGHT)])
def test_a_tree_that_spins_and_flies_rebounds_straight(joints: str, carried: str, timestep: float) -> None:
    """Without friction; half a step's turn of all velocity that an impact gave went to the side, 0.045 m/s at 5 ms."""
    scene = f"""<mujoco><option timestep="{timestep}" gravity="0 0 0"/><worldbody>
        <geom name="floor" type="plane" size="1 1 1"/><body pos="0 0 .0203">{joints}
        <geom name="ball" size=".02"/>{carried}</body></worldbody></mujoco>"""
    model = load_model(scene, [("ball", "floor", ContactPair("nylon", "nylon", friction=0.0, restitution=0.5))])
    data = mujoco.MjData(model)
    data.qvel[:5] = 0.0, 0.0, -0.2, 0.0, 60.0
    mujoco.mj_step(model, data, round(0.02 / timestep))
    assert data.qvel[:3] == pytest.approx([0.0, 0.0, 0.1], abs=1e-4)


def test_a_force_on_a_part_without_mass_moves_the_whole():
    """A frame on a frictionless box: the box has the force, and its moment, which turns it about the vertical."""
    model = load_model(
        """<mujoco><option timestep=".002"/><worldbody><geom name="floor" type="plane" size="1 1 1"/>
        <body pos="0 0 .1"><freejoint/><geom name="box" type="box" size=".2 .2 .1" mass="1"/>
        <body name="frame" pos=".1 0 0"/></body></worldbody></mujoco>""",
        [("box", "floor", ContactPair("rubber", "rubber", friction=0.0, restitution=0.5))],
    )
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 300)
    data.xfrc_applied[2, 1] = 3.0
    mujoco.mj_step(model, data, 10)
    assert data.qvel[1] == pytest.approx(3.0 * 0.02, rel=1e-3)
    arm = data.xipos[2, 0] - data.xipos[1, 0]
    assert data.qvel[5] == pytest.approx(arm * 3.0 / model.body_inertia[1, 2] * 0.02, rel=1e-3)


@pytest.mark.parametrize("integrator", INTEGRATORS[:3])
def test_a_ball_rises_to_its_height_in_steps_of_two_halves(integrator):
    """In which MuJoCo takes Euler in place of Runge-Kutta: its velocities are those of half a step before."""
    model, data, _ = thrown(2e-3, integrator)
    found, square = [], (1.0 + 9.81 * 1e-3) ** 2 + 2.0 * 9.81 * 1.4 * 2e-3  # energies per mass; that of the impact
    for _ in range(60):
        mujoco.mj_step1(model, data)
        mujoco.mj_step2(model, data)
        found.append(0.5 * (data.qvel[2] - 0.5 * 2e-3 * 9.81) ** 2 + 9.81 * data.qpos[2])
    floor = 9.81 * model.qpos0[2]
    assert found[2:] == pytest.approx([floor + 0.5 * 0.8**2 * square] * 58, abs=1e-3)


@pytest.mark.parametrize("integrator", ["Euler", "implicit"])
@pytest.mark.parametrize("joints", ['<joint axis="1 0 0"/><joint axis="0 1 0"/>', '<joint type="ball"/>'])
def test_an_impact_of_what_turns_about_several_axes_keeps_its_energy(joints: str, integrator: str) -> None:
    """Without other forces the engine's velocities are the true ones: an impact without loss keeps their energy."""
    scene = f"""<mujoco><option timestep=".005" gravity="0 0 0" integrator="{integrator}"/><worldbody>
        <geom name="floor" type="plane" size="1 1 1" pos="0 0 -.05"/><body>{joints}
        <geom type="box" size=".1 .05 .02" contype="0" conaffinity="0"/>
        <geom name="tip" size=".02" pos=".1 0 0" mass=".1"/></body></worldbody></mujoco>"""
    model = load_model(scene, [("tip", "floor", steel_pair(friction=0.0, restitution=1.0))])
    data, energies = mujoco.MjData(model), list[float]()
    data.qvel[:2] = 10.0, 5.0
    while not contacts_of(model, data):
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_energyVel(model, data)
        energies.append(data.energy[1])
        mujoco.mj_step(model, data)
    mujoco.mj_fwdPosition(model, data)
    mujoco.mj_energyVel(model, data)
    assert data.energy[1] == pytest.approx(energies[-1], rel=1e-5)


@pytest.mark.parametrize("integrator", ["Euler", "implicitfast", "RK4"])
@pytest.mark.parametrize(("servo", "joint"), [('forcerange="-30 30"', ""), ("", 'actuatorfrcrange="-30 30"')])
def test_a_servo_at_its_force_limit_throws_a_ball_at_the_floor_by_a_constant_force(servo, joint, integrator):
    """Closed form, but for the time that the impact takes."""
    timestep, fall = 5e-3, 30.0 + 9.81
    model = load_model(
        f"""<mujoco><option timestep="{timestep}" integrator="{integrator}"/><worldbody>
        <geom name="floor" type="plane" size="1 1 1"/><body pos="0 0 .15"><joint name="rail" type="slide" axis="0 0 1"
        {joint}/><geom name="ball" size=".05" mass="1"/></body></worldbody>
        <actuator><position joint="rail" kp="1000" kv="20" {servo}/></actuator></mujoco>""",
        [("ball", "floor", steel_pair(friction=0.0, restitution=0.9))],
    )
    data, lag = mujoco.MjData(model), 0.0 if integrator == "RK4" else 0.5 * timestep
    data.ctrl[0], data.qvel[0] = -0.3, lag * fall
    mujoco.mj_step(model, data, 20)
    struck = (2.0 * 0.1 / fall) ** 0.5
    left, since = 0.9 * fall * struck, data.time - struck
    assert data.qvel[0] - lag * fall == pytest.approx(left - fall * since, abs=1e-2)
    assert data.qpos[0] == pytest.approx(left * since - 0.5 * fall * since**2 - 0.1, abs=4e-4)


@pytest.mark.parametrize("integrator", ["Euler", "implicitfast", "RK4"])
@pytest.mark.parametrize(
    ("servo", "joint"),
    [
        ('forcerange="-5 5"', ""),
        ("", 'actuatorfrcrange="-5 5"'),
        ('forcerange="-5 5"/><position joint="rail" kp="1"', ""),
        ('forcerange="-5 5"/><position joint="rail" kp="1e3" kv="1e4" group="3"', ""),
    ],
)
def test_a_damped_servo_that_is_struck_resists_by_its_greatest_force(servo, joint, integrator):
    """Closed form: like masses exchange their speeds of 2 m/s, and a constant force brakes what was at rest.

    So it does beside a servo without damping, or in a group that is switched off.
    """
    timestep, speed = 4e-3, 2.0
    model = load_model(
        f"""<mujoco><option timestep="{timestep}" integrator="{integrator}" gravity="0 0 0" actuatorgroupdisable="3"/>
        <worldbody><body><joint name="rail" type="slide" axis="1 0 0" {joint}/>
        <geom name="struck" size=".05" mass="1"/></body>
        <body pos="-.105 0 0"><freejoint/><geom name="ball" size=".05" mass="1"/></body></worldbody>
        <actuator><position joint="rail" kp="100" kv="1000" {servo}/></actuator></mujoco>""",
        [("ball", "struck", steel_pair(friction=0.0, restitution=1.0))],
    )
    data, lag = mujoco.MjData(model), 0.0 if integrator == "RK4" else 0.5 * timestep
    data.qvel[1] = speed
    mujoco.mj_step(model, data, 25)
    since = data.time - 0.005 / speed
    assert data.qvel[0] - lag * 5.0 == pytest.approx(speed - 5.0 * since, abs=1e-2)
    assert data.qpos[0] == pytest.approx(speed * since - 2.5 * since**2, abs=1e-3)
    assert data.qvel[1] == pytest.approx(0.0, abs=5e-3)


@pytest.mark.parametrize(
    ("servo", "joint"),
    [('forcerange="-5 5" forcelimited="false"', ""), ("", 'actuatorfrcrange="-5 5" actuatorfrclimited="false"')],
)
def test_a_damped_servo_whose_range_is_off_resists_without_end(servo, joint):
    """As with a time constant of 1 ms: what moves at 2 m/s stops after 2 mm."""
    model = load_model(
        f"""<mujoco><option timestep="4e-3" integrator="implicitfast" gravity="0 0 0"/>
        <worldbody><body><joint name="rail" type="slide" axis="1 0 0" {joint}/><geom name="struck" size=".05" mass="1"/>
        </body><body pos="-.105 0 0"><freejoint/><geom name="ball" size=".05" mass="1"/></body></worldbody>
        <actuator><velocity joint="rail" kv="1000" {servo}/></actuator></mujoco>""",
        [("ball", "struck", steel_pair(friction=0.0, restitution=1.0))],
    )
    data = mujoco.MjData(model)
    data.qvel[1] = 2.0
    mujoco.mj_step(model, data, 25)
    assert data.qpos[0] == pytest.approx(2e-3, rel=0.02)
