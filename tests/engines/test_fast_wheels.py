"""Wheels that turn far within a step are as round as before: a car on them takes implicit steps."""

import numpy as np
import pytest
from mujoco_scenes import mujoco
from test_clearance import head_of

from contactlaw import ContactPair
from contactlaw.mujoco_plugin import load_model

RADIUS, TORQUE = 0.05, 0.02
WHEEL = """<body pos="{} {} 0"><joint name="j{}" axis="0 1 0"/>
<geom name="w{}" type="cylinder" zaxis="0 1 0" size=".05 .015" mass=".2"/></body>"""
PLACES = [(-0.1, -0.08), (-0.1, 0.08), (0.1, -0.08), (0.1, 0.08)]


@pytest.mark.parametrize("timestep", [2e-3, 5e-3])
def test_a_car_on_fast_wheels_takes_implicit_steps_and_gains_what_its_motors_give(timestep):
    wheels = "".join(WHEEL.format(*place, i, i) for i, place in enumerate(PLACES))
    motors = "".join(f'<motor joint="j{i}"/>' for i in range(4))
    model = load_model(
        f"""<mujoco><option timestep="{timestep}"/><worldbody><geom name="floor" type="plane" size="50 5 1"/>
        <body pos="0 0 .05"><freejoint/><geom type="box" size=".12 .06 .03" pos="0 0 .02" mass="2" contype="0"
        conaffinity="0"/>{wheels}</body></worldbody><actuator>{motors}</actuator></mujoco>""",
        [("w*", "floor", ContactPair("steel", "steel", friction=0.3, restitution=0.3))],
    )
    data = mujoco.MjData(model)
    data.qvel[0], data.qvel[6:] = 4.0, 4.0 / RADIUS  # 0.16 and 0.4 rad a step
    mujoco.mj_step(model, data, round(0.2 / timestep))
    world, start = head_of(data)[1], data.qvel[0]
    implicit, kicks, steps = int(world["implicit"]), int(world["kicks"]), round(0.5 / timestep)
    data.ctrl[:] = TORQUE
    mujoco.mj_step(model, data, steps)
    inertia = 2.8 + 4 * 0.5 * 0.2  # m + 4 I/r^2
    assert data.qvel[0] - start == pytest.approx(0.5 * 4 * TORQUE / RADIUS / inertia, rel=5e-3)
    assert np.abs(data.qvel[6:] * RADIUS - data.qvel[0]).max() < 1e-3
    assert int(world["implicit"]) - implicit > 0.9 * steps  # none before, and 640 contact substeps a step at 5 ms
    assert int(world["kicks"]) - kicks < 60 * steps
