"""Bodies that the user places anew in each step, in both engines: what they strike, carry and pass by."""

import numpy as np
import pytest
from mujoco_scenes import mujoco
from pybullet_scenes import ball, p, paddle, plane, shape

from contactlaw import Body, ContactPair, collide
from contactlaw.mujoco_plugin import load_model
from contactlaw.pybullet_callback import ContactCallback

ELASTIC = ContactPair("steel", "steel", friction=0.1, restitution=1.0)
SOFT = ContactPair("rubber", "steel", friction=0.5, restitution=0.5)
BALL = '<body><freejoint/><geom name="thing" size=".05" density="7800"/></body>'
CUBE = '<body pos="0 0 .05"><freejoint/><geom name="thing" type="box" size=".05 .05 .05" density="1000"/></body>'
SETS_OUT = 10  # steps in which a wall comes to its speed


def wall_and(thing, pair, place, size, step, **options):
    more = " ".join(f'{name}="{value}"' for name, value in options.items())
    model = load_model(
        f"""<mujoco><option timestep="{step}" {more}/><worldbody><body name="wall" mocap="true" pos="{place}">
        <geom name="wall" type="box" size="{size}"/></body>{thing}</worldbody></mujoco>""",
        [("thing", "wall", pair)],
    )
    return model, mujoco.MjData(model)


@pytest.mark.parametrize("integrator", ["Euler", "RK4", "implicitfast"])
@pytest.mark.parametrize(("step", "speed"), [(5e-4, 0.03), (2e-3, 0.3), (2e-3, 3.0), (5e-3, 0.3)])
def test_a_ball_leaves_a_wall_that_comes_at_twice_its_speed(integrator, step, speed):
    model, data = wall_and(BALL, ELASTIC, "-.2 0 0", ".05 .5 .5", step, gravity="0 0 0", integrator=integrator)
    for number in range(round(0.35 / speed / step)):
        data.mocap_pos[0, 0] += speed * step * min(1.0, (number + 1) / SETS_OUT)
        mujoco.mj_step(model, data)
    assert data.qvel[:3] == pytest.approx([2.0 * speed, 0.0, 0.0], abs=1e-6 * speed)


@pytest.mark.parametrize(("step", "speed"), [(1e-3, 0.3), (1 / 240, 0.03), (1 / 240, 3.0), (1 / 60, 0.3)])
def test_the_same_in_pybullet(client, step, speed):
    p.setTimeStep(step, client)
    wall = p.createMultiBody(0, shape(client, p.GEOM_BOX, halfExtents=[0.05, 0.5, 0.5]), physicsClientId=client)
    thing = ball(client, [0, 0, 0], radius=0.05, mass=1.0)
    contact, place = ContactCallback(client), -0.2
    contact.add_contact(thing, wall, ELASTIC)
    for number in range(round(0.35 / speed / step)):
        place += speed * step * min(1.0, number / SETS_OUT)
        p.resetBasePositionAndOrientation(wall, [place, 0, 0], [0, 0, 0, 1], client)
        contact.step()
    assert p.getBaseVelocity(thing, client)[0] == pytest.approx([2.0 * speed, 0.0, 0.0], abs=1e-6 * speed)


@pytest.mark.parametrize("step", [1e-4, 2e-3, 5e-3])
def test_a_racket_that_is_led_at_forty_metres_a_second_strikes_as_one_impact_says(step):
    """In the frame of the racket the ball comes obliquely at its speed: `collide`. The engine sees it move at once."""
    velocity, pair = np.array([30.0, 0.0, 20.0]), ContactPair("steel", "steel", friction=0.3, restitution=0.8)
    model, data = wall_and(BALL, pair, "-.6 0 -.46", ".5 .5 .01", step, gravity="0 0 0")
    for number in range(round(0.03 / step)):
        data.mocap_pos[0] = [0.0, 0.0, -0.06] + velocity * (number * step - 0.02)
        mujoco.mj_step(model, data)
    impact = collide(pair, Body(model.body_mass[2], 0.05, velocity=-velocity))
    assert data.qvel[:3] == pytest.approx(impact.velocity_a + velocity, abs=0.01)
    assert data.qvel[4] == pytest.approx(impact.spin_a[1], rel=1e-3)


def test_a_club_in_pybullet_strikes_a_ball_at_twice_its_speed(client):
    club = p.createMultiBody(0, shape(client, p.GEOM_BOX, halfExtents=[0.01, 0.5, 0.5]), physicsClientId=client)
    thing = ball(client, [0, 0, 0], radius=0.05, mass=1.0)
    p.changeDynamics(thing, -1, maxJointVelocity=1e6, physicsClientId=client)
    contact = ContactCallback(client)
    contact.add_contact(thing, club, ELASTIC)
    p.setTimeStep(2e-3, client)
    for number in range(15):
        p.resetBasePositionAndOrientation(club, [40.0 * (2e-3 * number - 0.02) - 0.06, 0, 0], [0, 0, 0, 1], client)
        contact.step()
    assert p.getBaseVelocity(thing, client)[0] == pytest.approx([80.0, 0.0, 0.0], abs=1e-3)


def test_a_lift_takes_up_what_sleeps_on_it_and_a_turntable_turns_it():
    model, data = wall_and(CUBE, SOFT, "0 0 -.05", ".5 .5 .05", 2e-3)
    mujoco.mj_step(model, data, 300)
    assert not data.qvel.any()  # it sleeps, as nobody moves what it lies on
    began = data.qpos[:3] - data.mocap_pos[0]
    for number in range(1000):
        data.mocap_pos[0] += 2e-3 * min(1.0, number / 100) * np.array([0.05, 0.0, 0.1])
        mujoco.mj_step(model, data)
    assert data.qpos[:3] - data.mocap_pos[0] == pytest.approx(began, abs=1e-7)
    assert data.qvel[:3] == pytest.approx([0.05, 0.0, 0.1], abs=1e-9)
    angle = 0.0
    for number in range(1000):
        angle += 2e-3 * min(1.0, number / 100)
        data.mocap_pos[0] += 2e-3 * max(1.0 - number / 100, 0.0) * np.array([0.05, 0.0, 0.1])
        data.mocap_quat[0] = np.cos(angle / 2), 0.0, 0.0, np.sin(angle / 2)
        mujoco.mj_step(model, data)
    assert data.qvel[5] == pytest.approx(1.0, abs=1e-6)
    assert 2.0 * np.arctan2(data.qpos[6], data.qpos[3]) == pytest.approx(angle, abs=1e-4)


@pytest.mark.parametrize("engine", ["MuJoCo, a plane", "MuJoCo, a height field", "PyBullet"])
def test_a_ball_rolls_in_circles_on_a_plane_that_turns(client, engine):
    """At 2/7 of its rate (closed form of a solid ball); what has no end turns at once, as what has one does.

    The ball creeps outwards by 0.12 mm (`test_a_ball_on_a_turntable_creeps_outwards_as_it_rolls`).
    """
    rate, radius, step, start, speed = 3.0, 0.02, 2e-3, 0.1, 0.05
    spin = (rate * start - speed) / radius  # with the plane's velocity where they touch
    if engine == "PyBullet":
        p.setGravity(0, 0, -9.81, client)
        p.setTimeStep(step, client)
        table = plane(client)
        thing = ball(client, [start, 0, radius], [0, speed, 0], [spin, 0, 0], radius=radius, mass=0.1)
        contact = ContactCallback(client)
        contact.add_contact(thing, table, SOFT)
    else:
        flat = 'type="plane"' if "plane" in engine else 'type="hfield" hfield="flat"'
        model = load_model(
            f"""<mujoco><option timestep="{step}"/><asset><hfield name="flat" nrow="3" ncol="3" size="1 1 1 1"/>
            </asset><worldbody><body name="table" mocap="true"><geom name="table" size="1 1 1" {flat}/></body>
            <body pos="{start} 0 {radius}"><freejoint/><geom name="ball" size="{radius}" mass=".1"/></body>
            </worldbody></mujoco>""",
            [("ball", "table", SOFT)],
        )
        data = mujoco.MjData(model)
        data.qvel[1], data.qvel[3] = speed, spin
    for number in range(1000):
        half = 0.5 * rate * step * (number + 1)
        if engine == "PyBullet":
            p.resetBasePositionAndOrientation(table, [0, 0, 0], [0, 0, np.sin(half), np.cos(half)], client)
            contact.step()
        else:
            data.mocap_quat[0] = np.cos(half), 0.0, 0.0, np.sin(half)
            mujoco.mj_step(model, data)
    place = p.getBasePositionAndOrientation(thing, client)[0][:2] if engine == "PyBullet" else data.qpos[:2]
    slow = 2.0 / 7.0 * rate
    turned, arm = slow * step * 1000, speed / slow
    assert place == pytest.approx([start + arm * (np.cos(turned) - 1.0), arm * np.sin(turned)], abs=2.5e-3 * arm)


def test_what_a_wall_is_put_across_in_one_step_is_left_alone():
    """20 cm in 2 ms are no motion; nor is a wall that is put into a ball one that strikes it."""
    for place in (0.2, 0.02):
        model, data = wall_and(BALL, ELASTIC, "-.2 0 0", ".05 .5 .5", 2e-3, gravity="0 0 0")
        mujoco.mj_step(model, data, 5)
        data.mocap_pos[0, 0] = place
        mujoco.mj_step(model, data, 50)
        assert np.abs(data.qvel).max() == 0.0


def test_a_step_goes_on_to_the_bit_from_a_state_saved_while_a_wall_comes():
    model, data = wall_and(CUBE, SOFT, "-.11 0 .05", ".05 .5 .5", 2e-3, gravity="0 0 0")
    saved, numbers = [], []
    what = mujoco.mjtState.mjSTATE_INTEGRATION
    for number in range(60):
        saved.append(np.empty(mujoco.mj_stateSize(model, what)))
        mujoco.mj_getState(model, data, saved[-1], what)
        data.mocap_pos[0, 0] += 1e-3 * min(1.0, number / SETS_OUT)
        mujoco.mj_step(model, data)
        numbers.append(np.concatenate([data.qpos, data.qvel]))
    assert numbers[-1][7] > 0.4
    for number in range(60):
        again = mujoco.MjData(model)
        mujoco.mj_setState(model, again, saved[number], what)
        again.mocap_pos[0, 0] += 1e-3 * min(1.0, number / SETS_OUT)
        mujoco.mj_step(model, again)
        assert np.array_equal(np.concatenate([again.qpos, again.qvel]), numbers[number])


@pytest.mark.parametrize("awake", [0.0, 1e-3])
def test_a_wall_that_jumps_into_a_ball_throws_it_whether_it_sleeps_or_not(awake):
    """By the energy of the overlap, 2/5 k depth^2.5, if nothing brakes; a ball that slept lay on in the wall."""
    depth, smooth = 1e-5, ContactPair("steel", "steel", friction=0.0)
    floor, thing = '<geom name="floor" type="plane" size="1 1 1"/>', BALL.replace("<body>", '<body pos="0 0 .05">')
    wall = '<body name="wall" mocap="true" pos="-.5 0 .05"><geom name="wall" type="box" size=".05 .05 .05"/></body>'
    model = load_model(
        f"<mujoco><worldbody>{floor}{wall}{thing}</worldbody></mujoco>",
        [("thing", "floor", ContactPair("steel", "steel", 0.0, 0.5)), ("thing", "wall", smooth)],
    )
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 200)
    assert not data.qvel.any()
    data.qvel[1], data.mocap_pos[0, 0] = awake, depth - 0.1
    mujoco.mj_step(model, data)
    energy = 0.4 * 4.0 / 3.0 * smooth.effective_modulus * 0.05**0.5 * depth**2.5
    assert data.qvel[0] == pytest.approx((2.0 * energy / model.body_mass[-1]) ** 0.5, rel=1e-3)


def test_what_hangs_by_joints_on_a_body_that_is_led_is_told_of(recwarn):
    """Where others are near: its contacts do not know how fast it goes."""
    arm = """<body name="base" mocap="true" pos="0 0 .5"><body pos="0 0 -.34"><joint axis="0 1 0"/>
        <geom name="tip" size=".05" mass="1"/></body></body>"""
    model = load_model(
        f"""<mujoco><worldbody><geom name="floor" type="plane" size="1 1 1"/>{arm}{CUBE}</worldbody></mujoco>""",
        [("tip", ["floor", "thing"], ELASTIC), ("thing", "floor", SOFT)],
    )
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 10)
    assert not [one for one in recwarn if "by joints" in str(one.message)]
    for _ in range(20):
        data.mocap_pos[0, 2] -= 1e-3
        mujoco.mj_step(model, data)
    assert len([one for one in recwarn if "body 'base' carries others by joints" in str(one.message)]) == 1


def test_a_fixed_base_with_joints_that_is_led_is_told_of(client, recwarn):
    """Where it is moved in each step; not where it is put elsewhere once."""
    arm, floor = paddle(client), plane(client)
    p.resetBasePositionAndOrientation(floor, [0, 0, -5], [0, 0, 0, 1], client)
    callback = ContactCallback(client)
    callback.add_contact([(arm, 0)], [floor], ELASTIC)
    for number in (0, 1, 1, 2, 2, 2):
        p.resetBasePositionAndOrientation(arm, [0, 0, number], [0, 0, 0, 1], client)
        callback.step()
    assert not recwarn.list
    for number in range(9):
        p.resetBasePositionAndOrientation(arm, [0, 0, 1e-3 * number], [0, 0, 0, 1], client)
        callback.step()
    [told] = recwarn.list
    assert f"body {arm} has joints and a fixed base" in str(told.message) and told.filename == __file__
