"""What is put on something with a gap of zero and no velocity rests on it, and has not fallen for half a step."""

from __future__ import annotations

import pytest
from mujoco_scenes import mujoco

from contactlaw import ContactPair
from contactlaw.mujoco_plugin import instances_of, ledger_of, load_model

GRAVITY, MASS, RADIUS = 9.81, 1.0, 0.03
PAIR = ContactPair("steel", "steel", friction=0.0, restitution=1.0)
# Of an elastic ball that a weight begins to press on a plane: W delta = 2/5 k delta^(5/2), with Hertz's k
DEEPEST = (2.5 * MASS * GRAVITY / (4.0 / 3.0 * PAIR.effective_modulus * RADIUS**0.5)) ** (2.0 / 3.0)
FREE = f'<body pos="0 0 {{}}"><freejoint/><geom name="ball" size="{RADIUS}" mass="{MASS}"/></body>'
ARM = f"""<body pos="0 0 {{}}"><joint axis="0 1 0"/><geom name="ball" size="{RADIUS}" pos=".3 0 0" mass="{MASS}"/>
</body>"""


def load(body: str, timestep: float, integrator: str = "Euler"):
    return load_model(
        f"""<mujoco><option timestep="{timestep}" integrator="{integrator}"/><worldbody>
        <geom name="floor" type="plane" size="1 1 1"/>{body}</worldbody></mujoco>""",
        [("*", "*", PAIR)],
    )


@pytest.mark.parametrize("body", [FREE, ARM])
@pytest.mark.parametrize("integrator", ["Euler", "RK4", "implicitfast"])
@pytest.mark.parametrize("timestep", [0.0005, 0.005])
def test_a_ball_in_mujoco(body: str, integrator: str, timestep: float) -> None:
    model = load(body.format(RADIUS), timestep, integrator)
    data = mujoco.MjData(model)
    for _ in range(2):  # as new, and in its place again
        mujoco.mj_resetData(model, data)
        mujoco.mj_step(model, data, round(0.1 / timestep))
        found = ledger_of(model, data, *instances_of(model))
        assert found.impacts == 1
        assert found.greatest_overlap == pytest.approx(DEEPEST, rel=3e-3)


DISC = '<body pos="0 0 .013"><freejoint/><geom type="cylinder" size=".05 .013" mass="1"/></body>'
ONE_ON_THE_OTHER = FREE.format(RADIUS) + FREE.format(3.0 * RADIUS).replace("ball", "upper")


@pytest.mark.parametrize("bodies", [DISC, ONE_ON_THE_OTHER])  # the gap of the disc is a rounding error
def test_in_mujoco_whether_velocities_are_half_a_step_behind_or_not(bodies: str) -> None:
    heights = []
    for integrator in ("Euler", "RK4"):
        model = load(bodies, 0.002, integrator)
        data = mujoco.MjData(model)
        mujoco.mj_step(model, data)
        heights.append(data.qpos[2::7].tolist())
    assert heights[0] == pytest.approx(heights[1], abs=1e-12)


HELD, LOOSE = '<joint axis="0 1 0"/>', "<freejoint/>"


@pytest.mark.parametrize("joint", [HELD, LOOSE])
@pytest.mark.parametrize("integrator", ["Euler", "RK4"])
@pytest.mark.parametrize("timestep", [0.0005, 0.005])
def test_a_moment_presses_where_the_centre_of_mass_does_not_accelerate(
    joint: str, integrator: str, timestep: float
) -> None:
    """A balanced rotor lays a ball at its arm on a wall: the first substep was the whole step, and gave it 70 J.

    The moment M is a load M L m/I on the effective mass m of the ball, as the weight above. Under Euler it counted as
    a moment that has acted for half a step before.
    """
    moment, arm, mass, inertia = 1.0, 0.1, 0.1, 2e-4
    model = load_model(
        f"""<mujoco><option timestep="{timestep}" gravity="0 0 0" integrator="{integrator}"/><worldbody>
        <geom type="plane" size="1 1 1" pos="{RADIUS} 0 0" zaxis="-1 0 0"/><body>{joint}
        <inertial pos="0 0 0" mass="{mass}" diaginertia="{inertia} {inertia} {inertia}"/>
        <geom size="{RADIUS}" pos="0 0 {arm}"/></body></worldbody></mujoco>""",
        [("*", "*", PAIR)],
    )
    data = mujoco.MjData(model)
    data.xfrc_applied[1, 4] = moment
    mujoco.mj_step(model, data)
    load_on_it = moment / arm if joint == HELD else moment * arm / (inertia / mass + arm**2)
    found = ledger_of(model, data, *instances_of(model))
    assert found.greatest_overlap == pytest.approx(DEEPEST * (load_on_it / (MASS * GRAVITY)) ** (2.0 / 3.0), rel=1e-2)


@pytest.mark.parametrize("arm", [0.0, 0.3])
@pytest.mark.parametrize("integrator", ["Euler", "RK4"])
def test_a_motor_presses_as_the_weight_does(arm: float, integrator: str) -> None:
    """Half a step of its force counted as speed, as only gravity could lay a tree on something: 4 times as deep."""
    joint = 'type="slide" axis="0 0 -1"' if arm == 0.0 else 'axis="0 1 0"'
    model = load_model(
        f"""<mujoco><option timestep="0.005" gravity="0 0 0" integrator="{integrator}"/><worldbody>
        <geom type="plane" size="1 1 1"/><body pos="0 0 {RADIUS}"><joint name="joint" {joint}/>
        <geom size="{RADIUS}" pos="{arm} 0 0" mass="{MASS}"/></body></worldbody>
        <actuator><motor joint="joint"/></actuator></mujoco>""",
        [("*", "*", PAIR)],
    )
    data = mujoco.MjData(model)
    data.ctrl[0] = MASS * GRAVITY * (arm or 1.0)
    mujoco.mj_step(model, data, 20)
    found = ledger_of(model, data, *instances_of(model))
    assert found.impacts == 1
    assert found.greatest_overlap == pytest.approx(DEEPEST, rel=3e-3)


def test_a_ball_in_mujoco_that_is_thrown_up_flies_as_without_the_law() -> None:
    model = load(FREE.format(RADIUS), 0.002)
    data = mujoco.MjData(model)
    data.qvel[2] = 1.0
    mujoco.mj_step(model, data, 10)
    assert data.qpos[2] == pytest.approx(RADIUS + 0.02 - 55 * GRAVITY * 0.002**2, abs=1e-14)  # by semi-implicit Euler


def test_balls_in_mujoco_side_by_side_fall_alike() -> None:
    row = "".join(FREE.format(1.0).replace("0 0 ", f"{x} 0 ").replace("ball", f"b{x}") for x in (0.0, 0.06, 0.2))
    model = load(row, 0.005)
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 10)
    assert data.qvel[2] == data.qvel[8] == data.qvel[14] == pytest.approx(-10 * GRAVITY * 0.005, rel=1e-12)


@pytest.mark.parametrize("timestep", [0.0005, 0.005])
def test_a_ball_in_pybullet(client: int, timestep: float) -> None:
    from pybullet_scenes import ball, in_contact, plane, step

    one = ball(client, (0.0, 0.0, RADIUS), radius=RADIUS, mass=MASS)
    callback, handle = in_contact(client, one, plane(client), PAIR, dt=timestep, gravity=GRAVITY)
    step(callback, round(0.1 / timestep))
    found = callback.ledger(handle)
    assert found.impacts == 1
    assert found.greatest_overlap == pytest.approx(DEEPEST, rel=3e-3)
