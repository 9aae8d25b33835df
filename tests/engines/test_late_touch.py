"""No touch of a tree is found late: beside a slow contact, or when what it lies against is woken in a step."""

from __future__ import annotations

import pytest
from mujoco_scenes import mujoco

from contactlaw import ContactPair
from contactlaw.mujoco_plugin import load_model

BODY = """<body pos="{}" quat="{}"><freejoint/>{}<body pos="0 0 .08"><joint type="ball"/>
<geom name="tip{}" size=".02" density="2000"/></body></body>"""
FIRST = '<geom type="ellipsoid" size=".0371 .0341 .0158" density="2000"/>'
SECOND = '<geom type="cylinder" size=".0168 .0391" density="2000"/>'


@pytest.mark.filterwarnings("ignore::contactlaw.ContactWarning")
@pytest.mark.parametrize("integrator", ["Euler", "RK4"])
@pytest.mark.parametrize("timestep", [0.0005, 0.002])
def test_tips_that_lean_on_each_other_do_not_hide_the_floor(integrator: str, timestep: float) -> None:
    """The tips of two trees overlap at first, which counts as touching: in free fall that contact has no force, and
    asks for substeps of any length. The ellipsoid of the first then meets the floor."""
    bodies = BODY.format(".0033 .0285 .1", ".291 .928 -.011 -1.181", FIRST, 0)
    bodies += BODY.format("-.0351 -.0156 .22", "-.574 .353 2.341 -.065", SECOND, 1)
    model = load_model(
        f"""<mujoco><option integrator="{integrator}" timestep="{timestep}"><flag energy="enable"/></option>
        <worldbody><geom name="floor" type="plane" size="1 1 1"/>{bodies}</worldbody></mujoco>""",
        [("*", "*", ContactPair("steel", "steel", friction=0.9, restitution=0.95))],
    )
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    start = data.energy.sum()
    while data.time < 0.15:
        mujoco.mj_step(model, data)
        mujoco.mj_forward(model, data)
        assert data.energy.sum() < 1.02 * start


@pytest.mark.parametrize("timestep", [0.0002, 0.002, 0.01])
def test_a_ball_on_a_rail_is_struck_by_one_that_slept(timestep: float) -> None:
    """Of five balls in a row the third and the fourth touch by rounding, and sleep; the fifth is awake beside them. The
    speeds are those of a chain of Hertz springs (Hinch & Saint-Jean 1999), as in the world."""
    row = "".join(
        f'<body pos="{0.04 * i} 0 0"><joint type="slide" axis="1 0 0"/><geom name="b{i}" size=".02"/></body>'
        for i in range(5)
    )
    model = load_model(
        f'<mujoco><option timestep="{timestep}" gravity="0 0 0"/><worldbody>{row}</worldbody></mujoco>',
        [("*", "*", ContactPair("steel", "steel", friction=0.0))],
    )
    data = mujoco.MjData(model)
    data.qpos[0], data.qvel[0] = -0.05, 1.0
    while data.time < 0.08:
        mujoco.mj_step(model, data)
    assert data.qvel == pytest.approx([-0.0711, -0.0303, -0.0145, 0.127, 0.9888], abs=2e-4)
