"""Bodies that a mocap body leads by a weld, in MuJoCo, and push others by the law."""

import numba
import numpy as np
import pytest

mujoco = pytest.importorskip("mujoco")
if numba.config.DISABLE_JIT:
    pytest.skip("the MuJoCo plugin needs compiled callbacks", allow_module_level=True)

from contactlaw import MATERIALS, ContactPair  # noqa: E402
from contactlaw.mujoco_plugin import load_model  # noqa: E402

SPEED, MU = 0.1, 0.3  # [m/s] of the mocap body; friction on the floor
FREE = "<freejoint/>"
SLIDES = '<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/>'


def pushing(holder, step, solref, material="rubber"):
    """A box of 1 kg, led by a weld at 0.1 m/s without friction or weight, and a cube of 2 kg on the floor before it."""
    low, high = (ContactPair(MATERIALS[material], MATERIALS["steel"], mu, 0.5) for mu in (MU, 0.0))
    model = load_model(
        f"""<mujoco><option timestep="{step}"/><worldbody><geom name="floor" type="plane" size="1 1 1"/>
        <body name="mocap" mocap="true" pos="-.06 0 .03"/>{holder}
        <body name="cube" pos="0 0 .025"><freejoint/>
        <geom name="cube" type="box" size=".025 .025 .025" mass="2"/></body></worldbody>
        <equality><weld body1="mocap" body2="hand" solref="{solref}"/></equality></mujoco>""",
        [("cube", "floor", low), ("cube", "hand", high)],
    )
    return model, mujoco.MjData(model)


def hand(joints, place="-.06 0 .03"):
    return (
        f'<body name="hand" pos="{place}" gravcomp="1">{joints}'
        '<geom name="hand" type="box" size=".02 .02 .02" mass="1"/></body>'
    )


def led(model, data, seconds):
    """Lead the hand for so long; yields after each step."""
    begin = data.mocap_pos[0, 0]
    for i in range(round(seconds / model.opt.timestep)):
        data.mocap_pos[0, 0] = begin + SPEED * model.opt.timestep * (i + 1)
        mujoco.mj_step(model, data)
        yield


@pytest.mark.parametrize("material", ["rubber", "steel"])
def test_the_base_of_an_arm_that_damping_alone_holds_stays_where_it_is(material):
    """Rails of 1e11 N s/m carry 50 kg and an arm of two hinges and a wrist: what it pushes does not move them."""
    link = '<geom type="capsule" fromto="0 0 0 .3 0 0" size=".02" mass="1" contype="0" conaffinity="0"/>'
    arm = f"""<body pos="-.5 0 .25"><joint name="x" type="slide" axis="1 0 0" damping="1e11" armature="1e-4"/>
        <joint name="z" type="slide" axis="0 0 1" damping="1e11" armature="1e-4"/>
        <geom type="box" size=".1 .1 .1" mass="50" contype="0" conaffinity="0"/>
        <body><joint axis="0 1 0" damping="1"/>{link}
        <body pos=".3 0 0"><joint axis="0 1 0" damping="1"/>{link}
        {hand('<joint axis="0 1 0" damping="1"/>', ".14 0 -.22")}</body></body></body>"""
    model, data = pushing(arm, 0.002, "0.02 1", material)
    cube = [data.body("cube").xpos[0] for _ in led(model, data, 0.8)]
    assert np.abs(data.qvel[:2]).max() < 1e-6
    assert np.abs(data.qpos[:2]).max() < 1e-6
    assert (cube[-1] - cube[-101]) / (100 * 0.002) == pytest.approx(SPEED, rel=0.02)
