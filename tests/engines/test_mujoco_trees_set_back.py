"""Trees of MuJoCo in states set back: at any step, what follows is what followed, to the bit."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from mujoco_scenes import WHOLE, mujoco, state_of
from set_back import goes_on_after_resets, goes_on_from_all, law_for

LYING = (
    "<body pos='0 0 .06'><freejoint/><geom type='capsule' fromto='-.1 0 0 0 0 0' size='.02'/>"
    "<body><joint name='knee' axis='0 1 0' damping='.05'/>"
    "<geom type='capsule' fromto='0 0 0 .1 0 0' size='.015'/></body></body>"
)


def test_a_tree_that_sleeps_goes_on_sleeping_where_it_is_set_back_and_wakes_for_what_is_new():
    """In an mjData used before, in a new one, in a copy, in two threads; what pushes it anew is felt at once."""
    model = law_for(LYING)
    data, saved = mujoco.MjData(model), []
    for _ in range(900):
        saved.append(state_of(model, data))
        mujoco.mj_step(model, data)
    asleep = [number for number, state in enumerate(saved) if not state[1 + model.nq :][: model.nv].any()]
    first = asleep[1]
    assert asleep[1:] == list(range(first, len(saved)))
    goes_on_from_all(model, saved[first - 30 :], 25)
    copy = mujoco.MjData(model)
    mujoco.mj_setState(model, copy, saved[first], WHOLE)
    mujoco.mj_step(model, copy)
    with ThreadPoolExecutor(2) as pool:
        others = [mujoco.MjData(model) for _ in range(2)]
        for other in others:
            mujoco.mj_copyData(other, model, copy)
        list(pool.map(lambda other: mujoco.mj_step(model, other, 50), others))
    for other in others:
        assert np.array_equal(state_of(model, other), saved[first + 51])
    mujoco.mj_setState(model, copy, saved[-1], WHOLE)
    copy.qfrc_applied[model.joint("knee").dofadr[0]] = 1.0
    mujoco.mj_step(model, copy)
    assert copy.qvel.any()


ARMS = {
    "parts that overlap at the start": (
        "timestep='.002' integrator='implicitfast'",
        "<body pos='.25 0 .27'><joint axis='-1.73 -.08 0'/>"
        "<geom type='cylinder' size='.034 .011' pos='.011 0 -.001' euler='245 313 0' density='300'/>"
        "<body pos='.002 -.003 -.027'><joint axis='-.26 -.98 -.17' damping='.001' armature='1e-5'/>"
        "<geom type='ellipsoid' size='.018 .042 .018' pos='.004 0 -.022' euler='161 288 0' density='300'/>"
        "<body pos='-.021 -.023 .087'><joint axis='-1.1 .03 .04' armature='1e-5'/>"
        "<geom type='capsule' size='.045 .019' pos='-.007 0 -.017' euler='89 267 0' density='300'/>"
        "</body></body></body>",
    ),
    "limits of guards": (
        "timestep='.002' integrator='Euler'",
        "<body pos='0 0 .256'><joint axis='-.13 .44 0'/>"
        "<geom type='sphere' size='.044' pos='-.006 0 .024' density='300'/>"
        "<body pos='.106 -.052 -.026'><joint type='slide' axis='-.51 -1.25 -1.03'/>"
        "<geom type='cylinder' size='.013 .025' pos='-.014 0 .032' euler='270 316 0' density='7800'/></body></body>",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", ARMS)
def test_trees_set_back_at_any_step_go_on_to_the_bit(name):
    """Whether the engine or the world moves a tree must not depend on when near pairs were listed."""
    option, bodies = ARMS[name]
    model = law_for(bodies, "type='box' size='3 3 .2' pos='0 0 -.2'", option)
    data = mujoco.MjData(model)
    data.qvel[:] = np.random.default_rng(3).normal(size=model.nv)
    goes_on_after_resets(model, data, 600)


@pytest.mark.parametrize("seed", [8, 17, 48, 52])
def test_a_robot_with_legs_goes_on_to_the_bit_in_new_data(seed):
    """What the user has not moved is not held to have been, however long nothing touches it: a floor counted so."""
    leg = """<body pos='{x} {y} 0'><joint axis='{v} {u} 0' range='-60 60' armature='1e-3'/>
    <geom type='capsule' fromto='0 0 0 {x} {y} -.12' size='.015'/>
    <body pos='{x} {y} -.12'><joint axis='{v} {u} 0' range='-60 60' armature='1e-3'/>
    <geom type='capsule' fromto='0 0 0 0 0 -.12' size='.012'/></body></body>"""
    legs = "".join(leg.format(x=0.1 * u, y=0.1 * v, u=u, v=-v) for u, v in ((1, 0), (0, 1), (-1, 0), (0, -1)))
    model = law_for(f"<body pos='0 0 .32'><freejoint/><geom type='sphere' size='.06'/>{legs}</body>")
    data, kept = mujoco.MjData(model), mujoco.mjtState.mjSTATE_INTEGRATION
    data.qvel[:] = 3.0 * np.random.default_rng(seed).normal(size=model.nv)
    other, state = data, np.empty(mujoco.mj_stateSize(model, kept))
    for number in range(250):
        if number % 7 == 3:
            mujoco.mj_getState(model, data, state, kept)
            other = mujoco.MjData(model)
            mujoco.mj_setState(model, other, state, kept)
        mujoco.mj_step(model, data)
        mujoco.mj_step(model, other)
        assert np.array_equal(state_of(model, other), state_of(model, data)), number


def test_a_tree_with_the_spring_of_a_tendon_goes_on_to_the_bit_while_something_presses_it():
    """Its velocities follow that spring from step to step; set back it was held to have been moved by the user."""
    arm = """<body pos='0 0 .2'><joint name='one' axis='0 1 0'/><geom type='capsule' fromto='0 0 0 .2 0 0' size='.02'/>
    <body pos='.2 0 0'><joint name='two' axis='0 1 0'/><geom type='capsule' fromto='0 0 0 .2 0 -.05' size='.02'/></body>
    </body>"""
    spring = """</worldbody><tendon><fixed stiffness='20' damping='.05'><joint joint='one' coef='1'/>
    <joint joint='two' coef='-.5'/></fixed></tendon><worldbody>"""
    model = law_for(arm + spring, option="timestep='1e-3'")
    data, saved = mujoco.MjData(model), []
    for _ in range(400):
        mujoco.mj_step(model, data)
        saved.append(state_of(model, data))
    goes_on_from_all(model, saved, 3)


def test_a_tree_that_a_ball_falls_past_goes_on_to_the_bit():
    """So must whether it passes by a body that is near enough to be listed, and no nearer."""
    model = law_for(
        "<body pos='0 0 .5'><joint axis='0 1 0'/><geom type='capsule' fromto='0 0 0 0 0 -.2' size='.02'/>"
        "<body pos='0 0 -.2'><joint axis='0 1 0'/><geom type='capsule' fromto='0 0 0 0 0 -.1' size='.01'/></body>"
        "</body><body pos='.1 0 .6'><freejoint/><geom type='sphere' size='.02'/></body>"
    )
    data = mujoco.MjData(model)
    data.qvel[:3] = [-2.0, 3.0, 0.0]
    goes_on_after_resets(model, data, 150)
