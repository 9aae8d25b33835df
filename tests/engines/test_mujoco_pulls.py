"""Forces of MuJoCo that follow the motion of what lands on the floor: cables, servos, thrusters, drag."""

import numpy as np
import pytest
from mujoco_scenes import mujoco

from contactlaw import ContactPair
from contactlaw.mujoco_plugin import load_model

RUBBER = ContactPair("rubber", "rubber", friction=0.0, restitution=1.0)
UNSEEN = 'contype="0" conaffinity="0"'
BALL = """<body pos="0 0 .0205"><freejoint name="free"/><geom name="foot" size=".02" mass="1"/><site name="end"/></body>
    <site name="hook" pos="0 0 1"/>"""
ARM = f"""<body pos="0 0 .021"><joint name="j" axis="0 -1 0"/>
    <geom type="capsule" fromto="0 0 0 .3 0 0" size=".01" mass=".3" {UNSEEN}/>
    <geom name="foot" size=".02" pos=".3 0 0" mass=".1"/><site name="end" pos=".3 0 0"/></body>
    <site name="hook" pos=".3 0 .05"/>"""
CABLE = '<tendon><spatial name="t" {}><site site="hook"/><site site="end"/></spatial></tendon><actuator>{}</actuator>'
LEVER = '<tendon><fixed name="t" {}><joint joint="j" coef="1"/></fixed></tendon><actuator>{}</actuator>'
SCENES = {  # option, bodies, what pulls, controls, speed
    "winch": ("", BALL, CABLE.format("", '<position tendon="t" kp="5000"/>'), (0.98,), -1.0),
    "damper": ("", BALL, CABLE.format('damping="100"', ""), (), -1.0),
    "thruster": ("", BALL, '<actuator><velocity joint="free" gear="0 0 1 0 0 0" kv="100"/></actuator>', (0.0,), -1.0),
    "oil": ('viscosity="300"', BALL, "", (), -1.0),
    "site": (
        "", ARM, '<actuator><position site="end" refsite="hook" kp="500" kv="5" gear="0 0 1 0 0 0"/></actuator>',
        (0.0,), -4.0,
    ),
    "crank": (
        "", ARM.replace("</body>", '<site name="crank" pos=".05 0 0"/></body>', 1)
        + '<site name="slider" pos=".05 0 .4" zaxis="0 0 -1"/>',
        '<actuator><position cranksite="crank" slidersite="slider" cranklength=".3" kp="3e4"/></actuator>',
        (0.07,), -4.0,
    ),
    "weak": (
        "", ARM, LEVER.format('actuatorfrcrange="-3 3"', '<position tendon="t" kp="200" kv="5"/>'), (-0.5,), -4.0
    ),
}  # fmt: skip
if hasattr(mujoco.mjtGain, "mjGAIN_SO3"):  # from MuJoCo 3.15
    TOP = """<body pos="0 0 .0205">{}<inertial pos="0 0 0" mass="1" diaginertia=".003 .003 .004"/>
        <geom name="foot" size=".02" pos=".1 0 0"/><site name="end"/></body><site name="hook" pos="0 0 .02"/>"""
    TURNS = '<actuator><general {} gaintype="so3" biastype="so3" gainprm="60" biasprm="0 -60 0"/></actuator>'
    SCENES["attitude"] = ("", TOP.format("<freejoint/>"), TURNS.format('site="end" refsite="hook"'), (0, 0.1, 0), -2)
    SCENES["shoulder"] = ("", TOP.format('<joint type="ball" name="j"/>'), TURNS.format('joint="j"'), (0.1, 0.3, 0), 1)


def speed_after(model, step, integrator, control, speed):
    """Mean speed [m/s] of a foot between 20 and 30 ms after it was 0.5 or 1 mm over the floor."""
    model.opt.timestep, model.opt.integrator = step, getattr(mujoco.mjtIntegrator, f"mjINT_{integrator}")
    data, heights = mujoco.MjData(model), []
    data.qvel[min(2, model.nv - 1)], data.ctrl[:] = speed, control
    if integrator != "RK4":
        mujoco.mj_forward(model, data)
        data.qvel -= 0.5 * step * data.qacc
    for _ in range(2):
        mujoco.mj_step(model, data, round(0.01 * (2 - len(heights)) / step))
        mujoco.mj_kinematics(model, data)
        heights.append(data.geom("foot").xpos[2])
    return (heights[1] - heights[0]) / 0.01


def by_hertz(model, *how):
    """The same by the engine's fourth-order steps of 50 us, with Hertz's force as a callback in all stages."""
    foot, jacobian = model.geom("foot").id, np.zeros((3, model.nv))
    stiffness = 4.0 / 3.0 * RUBBER.effective_modulus * np.sqrt(0.02)

    def press(model, data):
        mujoco.mj_jac(model, data, jacobian, None, data.geom_xpos[foot], model.geom_bodyid[foot])
        data.qfrc_passive[:] += stiffness * max(0.02 - data.geom_xpos[foot, 2], 0.0) ** 1.5 * jacobian[2]

    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    mujoco.set_mjcb_passive(press)
    try:
        return speed_after(model, 5e-5, "RK4", *how)
    finally:
        mujoco.set_mjcb_passive(None)


@pytest.mark.parametrize("what", SCENES)
def test_what_pulls_at_a_body_follows_its_motion_as_it_lands(what):
    """Held within the step, it turned round too late: with speeds up to a quarter of that before the impact off."""
    option, bodies, pulls, control, speed = SCENES[what]
    text = f"""<mujoco><option {option}/><worldbody><geom name="floor" type="plane" size="5 5 .1" contype="0"/>{bodies}
        </worldbody>{pulls}</mujoco>"""
    due = by_hertz(mujoco.MjModel.from_xml_string(text), control, speed)
    model = load_model(text, [("foot", "floor", RUBBER)], others=False)
    for step in (5e-3, 2e-3):
        assert speed_after(model, step, "RK4", control, speed) == pytest.approx(due, abs=2e-3)
