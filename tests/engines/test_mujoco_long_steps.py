"""The law at the engine's own step: impacts, rest, rolling, integrators, articulated bodies."""

from time import process_time

import numpy as np
import pytest
from mujoco_scenes import (
    DENSITY,
    DISCRETE,
    GEOM,
    MASS,
    RADIUS,
    ball_on_floor,
    duration,
    free_ball,
    mujoco,
    steel_pair,
    with_data,
)

from contactlaw import ContactPair
from contactlaw.mujoco_plugin import add_contact, contacts_of, load_model

INTEGRATORS = {name: int(getattr(mujoco.mjtIntegrator, f"mjINT_{name}")) for name in
               ("EULER", "RK4", "IMPLICIT", "IMPLICITFAST")}  # fmt: skip
GRAVITY = 9.81


def static_overlap(pair, weight=MASS * GRAVITY):
    return (weight / (4.0 / 3.0 * pair.effective_modulus * np.sqrt(RADIUS))) ** (2.0 / 3.0)


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_the_ball_is_where_its_bounce_puts_it(integrator):
    """Time of the touch and of the contact by hand; what is left is the overlap at which the damper's force ends."""
    pair, step = steel_pair(friction=0.0, restitution=0.8), 2e-3
    for phase in (0.1, 0.5, 0.9):
        spec, _ = ball_on_floor(pair, step)
        spec.option.integrator = INTEGRATORS[integrator]
        model, data = with_data(spec.compile())
        height = (1.0 + phase) * step
        data.qpos[2] += height
        data.qvel[2] = -1.0
        mujoco.mj_step(model, data, 5)
        expected = 0.8 * (5 * step - height - duration(pair))
        assert data.qpos[2] - RADIUS == pytest.approx(expected, abs=2e-5)


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_a_tumbling_rod_hit_by_a_ball_keeps_angular_momentum(integrator):
    """The spin is read and written half a step behind, with the gyroscopic rate of change."""
    step, inertia, place = 1e-3, np.array([1.5e-3, 1.5e-3, 8e-5]), [0.04, 0.0, 0.1]
    spec = mujoco.MjSpec()
    rod = spec.worldbody.add_body(name="rod", mass=0.4, inertia=inertia, explicitinertial=True)
    rod.add_freejoint()
    rod.add_geom(name="side", type=GEOM.mjGEOM_CAPSULE, size=[0.02, 0.1, 0.0])
    free_ball(spec, [0.02 + RADIUS + 1e-2, *place[1:]])
    add_contact(spec, "side", "ball", steel_pair())
    spec.option.timestep, spec.option.integrator, spec.option.gravity = step, INTEGRATORS[integrator], [0.0, 0.0, 0.0]
    model, data = with_data(spec.compile())
    data.qvel[3:7] = 1.0, -2.0, 5.0, -2.0

    def angular():
        total = np.zeros(3)
        for k in range(2):
            turn, moments, spin = np.zeros(9), model.body_inertia[k + 1], data.qvel[6 * k + 3 : 6 * k + 6]
            mujoco.mju_quat2Mat(turn, data.qpos[7 * k + 3 : 7 * k + 7])
            if integrator != "RK4":
                spin = spin - 0.5 * step * np.cross(spin, moments * spin) / moments
            momentum = model.body_mass[k + 1] * data.qvel[6 * k : 6 * k + 3]
            total += np.cross(data.qpos[7 * k : 7 * k + 3], momentum) + turn.reshape(3, 3) @ (moments * spin)
        return total

    jumps, last = [], angular()
    for _ in range(10):
        mujoco.mj_step(model, data)
        jumps.append(np.abs(angular() - last).max())
        last = angular()
    assert data.qvel[6] > -1.9
    assert max(jumps) < 1e-6


def test_what_changes_at_rest_is_noticed():
    """Gravity, an applied force, a place edited by hand: the contact follows, whatever it kept in mind."""
    pair = steel_pair(restitution=0.5)
    spec, name = ball_on_floor(pair, 2e-3, gravity=GRAVITY)
    model, data = with_data(spec.compile())
    mujoco.mj_step(model, data, 500)
    data.xfrc_applied[1, 2] = -10.0
    mujoco.mj_step(model, data, 500)
    assert RADIUS - data.qpos[2] == pytest.approx(static_overlap(pair, MASS * GRAVITY + 10.0), rel=1e-7)
    data.xfrc_applied[:] = 0.0
    model.opt.gravity[2] = -2.0
    mujoco.mj_step(model, data, 500)
    assert RADIUS - data.qpos[2] == pytest.approx(static_overlap(pair, MASS * 2.0), rel=1e-7)
    data.qpos[2] += 1e-3
    mujoco.mj_step(model, data, 2)
    assert not any(contact.touching for contact in contacts_of(model, data, name))


def test_a_motor_that_presses_is_carried():
    pair = steel_pair(restitution=0.5)
    spec = mujoco.MjSpec()
    spec.worldbody.add_geom(name="floor", type=GEOM.mjGEOM_PLANE, size=[1, 1, 0.1])
    body = spec.worldbody.add_body(name="ball", pos=[0, 0, RADIUS])
    body.add_joint(name="up", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[0, 0, 1])
    body.add_geom(name="round", size=[RADIUS, 0, 0], density=DENSITY)
    motor = spec.add_actuator(name="press", target="up", trntype=mujoco.mjtTrn.mjTRN_JOINT)
    motor.gainprm[0] = 1.0
    name = add_contact(spec, "round", "floor", pair)
    model, data = with_data(spec.compile())
    data.ctrl[0] = -20.0
    mujoco.mj_step(model, data, 600)
    assert -data.qpos[0] == pytest.approx(static_overlap(pair, MASS * GRAVITY + 20.0), rel=1e-6)
    assert contacts_of(model, data, name)[0].normal_force == pytest.approx(MASS * GRAVITY + 20.0, rel=1e-6)


@pytest.mark.parametrize("damping", [0.0, 10.0])
def test_a_hinged_paddle_returns_the_ball_alike_at_any_step(damping):
    after = {}
    for step in (1e-5, 2e-3):
        for phase in (0.0, 0.6):
            spec = mujoco.MjSpec()
            spec.option.timestep, spec.option.gravity = step, [0, 0, 0]
            arm = spec.worldbody.add_body(name="arm")
            hinge = arm.add_joint(name="hinge", type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 1, 0])
            hinge.damping[0] = damping
            arm.add_geom(name="paddle", type=GEOM.mjGEOM_BOX, size=[0.02, 0.1, 0.1], pos=[0, 0, 0.4], density=2000)
            free_ball(spec, [0.03 + RADIUS + phase * 2e-3, 0, 0.42], "round")
            add_contact(spec, "round", "paddle", steel_pair(restitution=1.0))
            model, data = with_data(spec.compile())
            data.qvel[0], data.qvel[1:4] = 0.5, [-1.0, 0.1, 0.2]
            mujoco.mj_step(model, data, round(0.03 / step))
            assert data.qvel[1] > 0.8
            after[step, phase] = data.qvel[1:].copy()
    for phase in (0.0, 0.6):
        allowed = 3e-3 if damping == 0.0 else 2e-2
        assert after[2e-3, phase][:3] == pytest.approx(after[1e-5, phase][:3], abs=allowed)


def test_nothing_passes_through_a_thin_box():
    spec = mujoco.MjSpec()
    spec.option.gravity = [0, 0, 0]
    spec.worldbody.add_geom(name="wall", type=GEOM.mjGEOM_BOX, size=[1, 1, 1e-3])
    free_ball(spec, [0, 0, 0.5], "round")
    add_contact(spec, "round", "wall", steel_pair(restitution=1.0))
    model, data = with_data(spec.compile())
    data.qvel[2] = -100.0
    mujoco.mj_step(model, data, 10)
    assert data.qvel[2] == pytest.approx(100.0, rel=1e-3)


def test_a_restart_is_bit_exact_in_contact_and_at_rest():
    spec, name = ball_on_floor(steel_pair(restitution=0.6), 2e-3, gravity=GRAVITY)
    model = spec.compile()
    data, other = mujoco.MjData(model), mujoco.MjData(model)
    data.qpos[2] += 0.02
    data.qvel[:2], data.qvel[3:] = [0.3, 0.1], [5.0, 3.0, 8.0]
    kind = int(mujoco.mjtState.mjSTATE_FULLPHYSICS)
    saved = np.empty(mujoco.mj_stateSize(model, kind))
    pressed = 0
    for k in range(400):
        mujoco.mj_getState(model, data, saved, kind)
        pressed += contacts_of(model, data, name) != []
        mujoco.mj_setState(model, other, saved, kind)
        mujoco.mj_step(model, data)
        mujoco.mj_forward(model, other)
        mujoco.mj_step(model, other)
        assert np.array_equal(data.qpos, other.qpos) and np.array_equal(data.qvel, other.qvel), k
        assert np.array_equal(data.plugin_state, other.plugin_state)
    assert pressed > 10
    mujoco.mj_resetData(model, data)


def test_a_body_that_turns_a_dozen_times_in_a_step_costs_no_seconds():
    """Its 80 near pairs are looked at where it flies to once for all: 0.6 s, 11 s if each flew it from the start."""
    text = """<mujoco><option timestep=".042"/><worldbody><geom type="box" size="3 3 .2" pos="0 0 -.2"/>
        <body><freejoint/><geom type="box" size=".03 .013 .018"/>
        <geom type="box" size=".03 .03 .02" pos=".02 -.01 -.02"/></body></worldbody></mujoco>"""
    model = load_model(text, [("*", "*", ContactPair("glass", "steel", friction=0.3, restitution=0.8))])
    for spin in ([1.0, 0.5, 0.4], [1800.0, 900.0, 700.0]):  # the first compiles what is needed
        data = mujoco.MjData(model)
        data.qpos[2], data.qvel[3:6] = 0.12, spin
        begun = process_time()
        mujoco.mj_step(model, data)
    assert process_time() - begun < 4.0


@pytest.mark.parametrize("integrator", ["Euler", "implicitfast"])
def test_joints_that_turn_far_in_a_step_are_the_engine_s_own_where_nothing_is_near(integrator):
    """By up to 2 rad a step, where a flight in the world differs much: what the engine holds stable must stay so."""
    link = '<body pos=".2 0 0"><joint axis="0 1 0"/><geom type="capsule" size=".01" fromto=".03 0 0 .17 0 0"/>{}</body>'
    xml = f"""<mujoco><option integrator="{integrator}"/><worldbody>
      <geom name="floor" type="plane" size="1 1 1" pos="0 0 -300"/>
      <body><joint axis="0 0 1"/><geom type="capsule" size=".01" fromto=".03 0 0 .17 0 0"/>
      {link.format(link.format(""))}</body></worldbody></mujoco>"""
    ends = []
    for model in (mujoco.MjModel.from_xml_string(xml), load_model(xml, [("*", "floor", steel_pair())])):
        data = mujoco.MjData(model)
        data.qvel[0] = 1000.0
        mujoco.mj_step(model, data, 3)
        ends.append((data.qpos, data.qvel))
    np.testing.assert_array_equal(*ends)


def row_of_balls(kinds, gap, step, integrator="Euler"):
    """Equal elastic steel balls in a row, `gap` [m] apart: free, on a slide joint (rail) or a mocap body."""
    held = {"free": "<freejoint/>", "rail": '<joint type="slide" axis="1 0 0"/>', "mocap": ""}
    text = "".join(
        f"""<body pos="{k * (2 * RADIUS + gap)} 0 0" {'mocap="true"' if kind == "mocap" else ""}>{held[kind]}
        <geom name="ball{k}" size="{RADIUS}"/></body>""" for k, kind in enumerate(kinds))  # fmt: skip
    text = f'<mujoco><option timestep="{step}" gravity="0 0 0" integrator="{integrator}"/><worldbody>{text}'
    model = load_model(text + "</worldbody></mujoco>", [("*", "*", steel_pair(friction=0.0, restitution=1.0))])
    return with_data(model)


@pytest.mark.parametrize("integrator", ["Euler", "RK4"])
@pytest.mark.parametrize("kinds", [("free",) * 4 + ("rail",), ("rail",) * 3])
@pytest.mark.parametrize(("speed", "step", "gaps"), [(20.0, 1e-2, 1.0), (30.0, 5e-3, 0.5), (30.0, 1e-2, 2.0)])
def test_a_ball_on_a_rail_is_struck_by_what_is_thrown_from_afar_in_the_same_step(
    integrator, kinds, speed, step, gaps
):  # fmt: skip
    """Before that step nothing that moves is near it: the step is taken again as something comes there."""
    model, data = row_of_balls(kinds, gaps * RADIUS, step, integrator)
    data.qvel[0] = speed
    mujoco.mj_step(model, data, 8)
    assert data.qvel[model.jnt_dofadr] == pytest.approx([0.0] * (len(kinds) - 1) + [speed], abs=1e-3 * speed)


@pytest.mark.parametrize(
    ("kinds", "step", "gaps"),
    [(("mocap", "rail"), 5e-3, 0.5), (("mocap", "rail"), 1e-2, 1.0), (("mocap", "free", "rail"), 1e-2, 1.25)],
)
def test_a_mocap_body_that_sets_out_fast_strikes_a_ball_on_a_rail(kinds, step, gaps, recwarn):
    """Its margin was that of a body at rest. A heavy ball at v sends elastic ones away with 2 v, and enters none."""
    model, data = row_of_balls(kinds, gaps * RADIUS, step)
    mujoco.mj_step(model, data)
    for _ in range(20):
        data.mocap_pos[0, 0] += 3.0 * step
        mujoco.mj_step(model, data)
    assert data.qvel[model.jnt_dofadr[-1]] == pytest.approx(6.0, abs=6e-3)
    assert not recwarn


def swinging_on_a_sled(step, integrator, stiffness, offset=0.3, kind="hinge"):
    """Coordinates of what a spring holds on a sled that slides, for 2 s or 1000 steps: a pendulum, or a mass across."""
    model = load_model(
        f"""<mujoco><option timestep="{step}" integrator="{integrator}"/><worldbody>
        <geom name="floor" type="plane" size="1 1 1"/>
        <body pos="0 0 .05"><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/>
        <geom name="sled" type="box" size=".1 .1 .05" mass="50"/><body pos="0 .2 0">
        <joint type="{kind}" axis="0 1 0" stiffness="{stiffness}"/>
        <geom pos="0 0 {-0.005 if kind == "hinge" else 0.0}" size=".002" mass=".3"/></body></body>
        </worldbody></mujoco>""",
        [("sled", "floor", steel_pair(friction=0.02, restitution=0.5))],
    )
    data = mujoco.MjData(model)
    data.qvel[0], data.qpos[2] = 2.0, offset
    places = []
    for _ in range(min(round(2.0 / step), 1000)):
        mujoco.mj_step(model, data)
        places.append(data.qpos[2])
    return np.array(places)


def last_amplitude(places):
    """That of the last eighth over that of the first."""
    part = len(places) // 8
    return np.ptp(places[-part:]) / np.ptp(places[:part])


@pytest.mark.parametrize("integrator", ["Euler", "implicitfast"])
@pytest.mark.parametrize("step", [2e-3, 4e-3])
def test_what_a_spring_swings_on_a_sled_that_slides_keeps_its_amplitude(step, integrator):
    """Its phase turns by 0.4 and 0.8 rad a step."""
    assert last_amplitude(swinging_on_a_sled(step, integrator, 0.3)) == pytest.approx(1.0, abs=1e-2)


@pytest.mark.parametrize(("step", "integrator"), [(1e-4, "Euler"), (1e-4, "RK4"), (2e-3, "RK4")])
@pytest.mark.parametrize("phase", [0.4, 1.6])
def test_a_spring_across_a_slide_keeps_its_energy_in_substeps_and_under_runge_kutta(step, integrator, phase):
    """Steps of 0.1 ms are substeps of the contact, those of 2 ms implicit ones."""
    places = swinging_on_a_sled(step, integrator, 0.3 * (phase / step) ** 2, 0.01, "slide")
    assert last_amplitude(places) == pytest.approx(1.0, abs=2e-3)


@pytest.mark.skipif(not DISCRETE, reason="from MuJoCo 3.13 on")
@pytest.mark.parametrize("step", [1e-4, 2e-3])
@pytest.mark.parametrize("phase", [2.5, 10.0, 100.0])
def test_springs_far_too_stiff_for_the_step_lose_energy(step, phase):
    """The engine's own integrator for such springs is stable with any; so is the world."""
    places = swinging_on_a_sled(step, "discrete", 0.3 * (phase / step) ** 2, 0.01, "slide")
    assert np.abs(places).max() < 0.015
    assert np.abs(places[-100:]).max() < 1e-3
