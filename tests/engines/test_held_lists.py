"""What lasts in implicit steps needs no new list of near pairs, and goes on from saved states to the bit."""

import numpy as np
import pytest
from mujoco_scenes import WHOLE, mujoco, state_of, steel_pair
from test_clearance import head_of

from contactlaw.mujoco_plugin import load_model

FINGER = """<body name="{name}" pos="{x} 0 .1"><joint name="{name}" type="slide" axis="{axis} 0 0" damping="5"/>
    <geom type="box" size=".01 .02 .03" mass=".05"/></body>"""
GRIP = f"""<mujoco><option timestep="2e-3" integrator="implicitfast"/><worldbody>
    <geom name="floor" type="plane" size="1 1 .1"/>
    <body name="wrist"><joint name="lift" type="slide" axis="0 0 1"/><geom size=".01" pos="0 0 .3" mass=".5"/>
    {FINGER.format(name="left", x=-0.0355, axis=1)}{FINGER.format(name="right", x=0.0355, axis=-1)}</body>
    <body name="cube" pos="0 0 .09"><freejoint/><geom type="box" size=".025 .025 .025" mass=".1"/></body>
    </worldbody><actuator><position joint="lift" kp="2000" kv="100"/>
    <motor joint="left" ctrlrange="0 20"/><motor joint="right" ctrlrange="0 20"/></actuator></mujoco>"""


@pytest.fixture
def grip():
    """A cube that two fingers hold, at rest."""
    model = load_model(GRIP, [("*", "*", steel_pair(friction=0.5, restitution=0.5))])
    data = mujoco.MjData(model)
    data.ctrl[:] = 0.0, 10.0, 10.0
    mujoco.mj_step(model, data, 500)
    return model, data


def test_a_cube_that_fingers_hold_and_move_is_not_listed_anew_in_every_step(grip):
    model, data = grip
    _, world = head_of(data)
    lists, implicit, place = (
        int(world["lists"]),
        int(world["implicit"]),
        data.body("cube").xpos - data.body("left").xpos,
    )
    for _ in range(200):
        data.ctrl[0] = 0.002 * np.sin(10.0 * data.time)
        mujoco.mj_step(model, data)
    assert world["implicit"] - implicit == 200
    assert world["lists"] - lists < 40
    assert np.abs(data.body("cube").xpos - data.body("left").xpos - place).max() < 1e-9


def test_a_cube_that_fingers_hold_goes_on_from_all_saved_states_to_the_bit(grip):
    model, data = grip
    other, ctrl = mujoco.MjData(model), data.ctrl.copy()
    for number in range(60):
        ctrl[0] = 0.002 * np.sin(10.0 * data.time)
        saved = state_of(model, data)
        mujoco.mj_resetData(model, other)
        mujoco.mj_setState(model, other, saved, WHOLE)
        for one in (data, other):
            one.ctrl[:] = ctrl
            mujoco.mj_step(model, one)
        assert np.array_equal(state_of(model, other), state_of(model, data)), number
