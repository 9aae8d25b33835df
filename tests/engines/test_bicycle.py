"""A bicycle on wheels of steel leans and steers as its linear equations say: what rolls spins with hardly a moment.

The benchmark of Meijaard, Papadopoulos, Ruina & Schwab, Proc. R. Soc. A 463 (2007) 1955: M q'' + v C q' + (g K_0 +
v^2 K_2) q = 0 for lean and steer angles q, with knife-edged wheels.
"""

from math import cos, pi, sin

import numpy as np
import pytest
from mujoco_scenes import mujoco

from contactlaw import ContactPair
from contactlaw.mujoco_plugin import load_model

SPEED = 5.0  # [m/s], at which the benchmark is stable
M = np.array([[80.81722, 2.31941332208709], [2.31941332208709, 0.29784188199686]])
K_0 = np.array([[-80.95, -2.59951685249872], [-2.59951685249872, -0.80329488458618]])
K_2 = np.array([[0.0, 76.59734589573222], [0.0, 2.65431523794604]])
C = np.array([[0.0, 33.86641391492494], [-0.85035641456978, 1.68540397397560]])
UP = np.array([-sin(pi / 10.0), 0.0, cos(pi / 10.0)])  # of the steer axis
HEAD = np.array([1.1, 0.0, 0.0]) + 0.9 * UP  # [m], a point on it
WHEEL = """<joint name="{0}" axis="0 1 0"/><inertial pos="0 0 0" mass="{1}" diaginertia="{2} {3} {2}"/>
<geom name="wheel_{0}" type="ellipsoid" size="{4} .004 {4}"/>"""
BICYCLE = f"""<mujoco><option timestep="{{timestep}}"/><worldbody><geom name="floor" type="plane" size="100 100 1"/>
<body name="frame"><freejoint/><inertial pos=".3 0 .9" mass="85" fullinertia="9.2 11 2.8 0 -2.4 0"/>
  <body pos="0 0 .3">{WHEEL.format("rear", 2, 0.0603, 0.12, 0.3)}</body>
  <body pos="{HEAD[0]} 0 {HEAD[2]}"><joint name="steer" axis="{UP[0]} 0 {UP[2]}"/>
    <inertial pos="{0.9 - HEAD[0]} 0 {0.7 - HEAD[2]}" mass="4" fullinertia=".05892 .06 .00708 0 .00756 0"/>
    <body pos="{1.02 - HEAD[0]} 0 {0.35 - HEAD[2]}">{WHEEL.format("front", 3, 0.1405, 0.28, 0.35)}</body>
  </body></body></worldbody></mujoco>"""


@pytest.mark.parametrize("friction", [0.1, 1.0])
@pytest.mark.parametrize("timestep", [1e-3, 2e-3])
def test_a_bicycle_leans_and_steers_as_its_linear_equations_say(timestep, friction):
    pair = ContactPair("steel", "steel", friction=friction, restitution=0.3)
    model = load_model(BICYCLE.format(timestep=timestep), [("wheel*", "floor", pair)])
    data = mujoco.MjData(model)
    data.qvel[0], data.qvel[3] = SPEED, 0.01  # set out, and pushed to the side
    data.joint("rear").qvel[0], data.joint("front").qvel[0] = SPEED / 0.3, SPEED / 0.35
    found = []
    for _ in range(round(2.0 / timestep)):
        mujoco.mj_step(model, data)
        lean, steer = np.arcsin(data.body("frame").xmat[7]), -data.joint("steer").qpos[0]
        found.append((lean, steer))
    angles, begin = np.array(found), round(0.15 / timestep)
    inverse = np.linalg.inv(M)
    own = np.block([[np.zeros((2, 2)), np.eye(2)], [-inverse @ (9.81 * K_0 + SPEED**2 * K_2), -inverse @ (SPEED * C)]])
    rates = (angles[begin + 1] - angles[begin - 1]) / (2.0 * timestep)
    values, modes = np.linalg.eig(own)
    time = timestep * np.arange(len(angles) - begin)[:, None]
    expected = (np.linalg.solve(modes, [*angles[begin], *rates]) * np.exp(values * time)) @ modes[:2].T
    error = np.abs(angles[begin:] - expected.real).max(0) / np.abs(expected).max(0)
    assert error.max() < 0.02  # 8.7 with the torsion of wheels that stand, at a friction of 1
