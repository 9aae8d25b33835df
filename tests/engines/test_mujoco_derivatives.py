"""MuJoCo's derivatives of a step and its inverse dynamics, on which optimal control and identification build."""

import numpy as np
import pytest
from mujoco_scenes import mujoco, steel_pair

from contactlaw.mujoco_plugin import load_model

EVERYTHING = mujoco.mjtState.mjSTATE_INTEGRATION
CHANGE = 1e-6
LEG = """<mujoco><option timestep="2e-3" integrator="{}"/><worldbody><geom type="plane" size="1 1 1"/>
    <body pos="0 0 .3"><joint name="hip" type="slide" axis="0 0 1"/><joint name="knee" axis="0 1 0" damping=".1"/>
    <geom type="capsule" fromto="0 0 0 .3 0 -.25" size=".05"/></body>
    <body pos="0 .5 .02"><freejoint/><geom size=".02"/></body></worldbody>
    <actuator><motor joint="hip"/><position joint="knee" kp="20"/></actuator></mujoco>"""


def differences(model, start):
    """Change of the state after a step by the state and the controls before it, by central differences of steps."""
    nv, data, ends, columns = model.nv, mujoco.MjData(model), [], []
    for column in range(2 * nv + model.nu):
        ends.clear()
        for change in (CHANGE, -CHANGE):
            mujoco.mj_setState(model, data, start, EVERYTHING)
            if column < nv:
                mujoco.mj_integratePos(model, data.qpos, np.eye(nv)[column], change)
            else:
                (data.qvel if column < 2 * nv else data.ctrl)[(column - nv) % nv] += change
            mujoco.mj_step(model, data)
            ends.append((data.qpos.copy(), data.qvel.copy()))
        moved = np.empty(nv)
        mujoco.mj_differentiatePos(model, moved, 1.0, ends[1][0], ends[0][0])
        columns.append(np.concatenate([moved, ends[0][1] - ends[1][1]]) / (2.0 * CHANGE))
    return np.array(columns).T


@pytest.mark.parametrize("integrator", ["Euler", "implicitfast"])
@pytest.mark.parametrize("steps", [0, 70, 300])
def test_derivatives_of_a_step_are_those_of_steps_and_leave_no_trace(integrator, steps):
    """In flight, while a leg strikes the floor, and while it and a ball rest; then all goes on as without them."""
    model = load_model(LEG.format(integrator), [("*", "*", steel_pair())])
    data, start = mujoco.MjData(model), np.empty(mujoco.mj_stateSize(model, EVERYTHING))
    mujoco.mj_step(model, data, steps)
    mujoco.mj_getState(model, data, start, EVERYTHING)
    nv, nu = model.nv, model.nu
    by_state, by_control = np.zeros((2 * nv, 2 * nv)), np.zeros((2 * nv, nu))
    mujoco.mjd_transitionFD(model, data, CHANGE, True, by_state, by_control, None, None)
    ours = differences(model, start)
    assert np.abs(ours).max() > (1.5 if steps else 0.9)  # contacts make it stiff
    assert np.hstack([by_state, by_control]) == pytest.approx(ours, rel=1e-9, abs=1e-9)
    other = mujoco.MjData(model)
    mujoco.mj_setState(model, other, start, EVERYTHING)
    mujoco.mj_step(model, data)
    mujoco.mj_step(model, other)
    assert np.array_equal(data.qpos, other.qpos) and np.array_equal(data.qvel, other.qvel)


@pytest.mark.parametrize("integrator", ["Euler", "implicitfast", "RK4"])
def test_inverse_dynamics_give_back_the_forces_of_actuators(integrator):
    """What presses on the leg counts among the passive forces; asking for it changes nothing."""
    model = load_model(LEG.format(integrator), [("*", "*", steel_pair())])
    data, other = mujoco.MjData(model), mujoco.MjData(model)
    for one in (data, other):
        one.ctrl[:] = -5.0, 0.5
        mujoco.mj_step(model, one, 300)
    mujoco.mj_forward(model, data)
    mujoco.mj_inverse(model, data)
    assert np.abs(data.qfrc_actuator).max() > 4.0
    assert data.qfrc_inverse == pytest.approx(data.qfrc_actuator, abs=1e-10)
    mujoco.mj_step(model, data)
    mujoco.mj_step(model, other)
    assert np.array_equal(data.qpos, other.qpos) and np.array_equal(data.qvel, other.qvel)
