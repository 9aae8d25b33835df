"""States set back into data of MuJoCo, and a model for it: what follows is what followed, to the bit."""

import numpy as np
from mujoco_scenes import WHOLE, mujoco, state_of, steel_pair

from contactlaw.mujoco_plugin import load_model


def goes_on_from_all(model, saved, count):
    """Set one mjData back to each state, and step it while the next ones of so many are known."""
    other = mujoco.MjData(model)
    for first in range(len(saved) - count + 1):
        mujoco.mj_setState(model, other, saved[first], WHOLE)
        for number in range(first + 1, first + count):
            mujoco.mj_step(model, other)
            assert np.array_equal(state_of(model, other), saved[number]), (first, number)


def goes_on_after_resets(model, data, steps):
    """Step an mjData, and beside it another one that is reset, and set to its state, before each step."""
    other = mujoco.MjData(model)
    for number in range(steps):
        saved = state_of(model, data)
        mujoco.mj_step(model, data)
        mujoco.mj_resetData(model, other)
        mujoco.mj_setState(model, other, saved, WHOLE)
        mujoco.mj_step(model, other)
        assert np.array_equal(state_of(model, other), state_of(model, data)), number


def law_for(bodies, floor="type='plane' size='1 1 1'", option="timestep='2e-3'"):
    text = f"<mujoco><option {option}/><worldbody><geom {floor}/>{bodies}</worldbody></mujoco>"
    return load_model(text, [("*", "*", steel_pair(friction=0.3, restitution=0.5))])
