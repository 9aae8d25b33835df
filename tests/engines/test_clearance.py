"""Bodies near each other that cannot touch in a step: the world does not take it, and no touch is found late."""

import numpy as np
import pytest
from mujoco_scenes import mujoco

from contactlaw import MATERIALS, ContactPair
from contactlaw.mujoco_plugin import layout, load_model
from contactlaw.mujoco_plugin.block import HEAD
from contactlaw.mujoco_plugin.callbacks import CALM, MOVED
from contactlaw.mujoco_plugin.layout import record_at
from contactlaw.world.data.records import WORLD

STEEL = ContactPair(MATERIALS["steel"], MATERIALS["steel"], friction=0.1, restitution=1.0)
ROOM = """<mujoco><option timestep="{dt}" integrator="{integrator}" gravity="0 0 -9.81"/><worldbody>
<geom name="w0" type="plane" size="1 1 1"/>
<geom name="w1" type="plane" size="1 1 1" pos="0 0 .4" euler="180 0 0"/>
<geom name="w2" type="plane" size="1 1 1" pos=".15 0 0" euler="0 -90 0"/>
<geom name="w3" type="plane" size="1 1 1" pos="-.15 0 0" euler="0 90 0"/>
<geom name="w4" type="plane" size="1 1 1" pos="0 .15 0" euler="90 0 0"/>
<geom name="w5" type="plane" size="1 1 1" pos="0 -.15 0" euler="-90 0 0"/>{bodies}</worldbody></mujoco>"""
BODY = """<body pos="{} {} {}"><freejoint/><geom name="a{}" size=".02" pos=".02 0 0" density="7833"/>
<geom name="b{}" size=".02" pos="-.02 0 0" density="7833"/></body>"""


def head_of(data):
    """The head of the block of the leading instance, and the record of its world."""
    blocks = record_at(data._address, layout.DATA, 1)[0]["plugin_data"]
    head = record_at(record_at(int(blocks), np.uint64, 1)[0], HEAD, 1)[0]
    return head, record_at(int(head["world"]), WORLD, 1)[0]


def test_a_ball_that_flies_close_to_the_floor_is_left_to_the_engine():
    model = load_model(
        """<mujoco><option timestep="1e-3"/><worldbody><geom name="floor" type="plane" size="1 1 1"/>
        <body pos="0 0 .0262"><freejoint/><geom name="ball" size=".025"/></body></worldbody></mujoco>""",
        [("ball", "floor", STEEL)],
    )
    data, how = mujoco.MjData(model), []
    head, world = head_of(data)
    for _ in range(200):
        mujoco.mj_step(model, data)
        assert world["nears"] == 1
        how.append(int(head["calm"]))
    assert set(how) == {CALM, MOVED}
    assert how.count(CALM) > 120
    assert world["late"] == 0


@pytest.mark.parametrize("integrator", ["Euler", "RK4"])
@pytest.mark.parametrize("seed", range(3))
def test_no_touch_of_tumbling_dumbbells_is_found_late(seed, integrator):
    rng = np.random.default_rng(seed)
    places = [(-0.07, -0.07, 0.1), (0.07, 0.07, 0.2), (-0.06, 0.07, 0.3)]
    bodies = "".join(BODY.format(*place, number, number) for number, place in enumerate(places))
    names = [f"{end}{number}" for number in range(3) for end in "ab"]
    model = load_model(
        ROOM.format(dt=1e-3, integrator=integrator, bodies=bodies),
        [(names, [*names, *(f"w{number}" for number in range(6))], STEEL)],
    )
    data = mujoco.MjData(model)
    data.qvel[:] = rng.uniform(-1.0, 1.0, 18) * np.tile([1.0] * 3 + [20.0] * 3, 3)
    head, world = head_of(data)
    calm = 0
    for _ in range(1500):
        mujoco.mj_step(model, data)
        calm += head["calm"] == CALM and world["nears"] > 0
    assert calm > 50
    assert world["late"] == 0


def test_a_part_without_shapes_does_not_ask_for_lists_wherever_it_goes():
    model = load_model(
        """<mujoco><option timestep="2e-3"/><worldbody><geom type="plane" size="1 1 1"/>
        <body pos="0 0 .05"><joint damping="1" axis="0 1 0" stiffness="9"/><geom size=".02" mass="1"/>
        <body pos=".1 0 0"><inertial pos="0 0 0" mass=".01" diaginertia="1e-6 1e-6 1e-6"/>
        <joint type="slide" stiffness="40"/></body></body></worldbody></mujoco>""",
        [("*", "*", STEEL)],
    )
    data = mujoco.MjData(model)
    data.qvel[1] = 0.5
    _, world = head_of(data)
    mujoco.mj_step(model, data, 500)
    assert int(world["lists"]) < 10, int(world["lists"])  # 111 when its margin counted


def test_parts_that_lie_flush_and_do_not_move_are_listed_once():
    model = load_model(
        """<mujoco><option timestep="2e-3"/><worldbody><geom type="box" size="1 1 .1" pos="0 0 .75"/>
        <body pos="0 0 .9"><joint type="slide" axis="1 0 0"/><geom type="box" size=".05 .05 .05"/></body>
        </worldbody></mujoco>""",
        [("*", "*", STEEL)],
    )
    data = mujoco.MjData(model)
    _, world = head_of(data)
    mujoco.mj_step(model, data, 100)
    assert int(world["lists"]) < 5 and data.qpos[0] == 0.0  # one in each step before, as by rounding they overlap


def test_a_light_link_with_a_stiff_damper_is_near_only_what_it_can_reach():
    # Without inertia a servo of stiffness k turns it at k/d times its error at most: 2 rad/s, though qacc is 1e5 times
    # that. Its tip, 50 mm from the hinge, moves by 3 mm in 16 steps; the wall is 20 mm away.
    model = load_model(
        """<mujoco><option timestep="2e-3"/><worldbody><geom type="box" size=".05 .05 .05" pos=".08 0 .09"/>
        <body><joint name="hinge" axis="0 1 0" damping="1"/>
        <geom type="box" size=".02 .003 .003" pos=".03 0 0" mass=".004"/>
        </body></worldbody><actuator><position joint="hinge" kp="2"/></actuator></mujoco>""",
        [("*", "*", STEEL)],
    )
    data = mujoco.MjData(model)
    near = 0
    for i in range(60):
        data.ctrl[0] = 1.0 if i % 20 < 10 else -1.0
        mujoco.mj_step(model, data)
        near = max(near, head_of(data)[1]["nears"])
    assert np.abs(data.qvel).max() < 4.0
    assert near == 0


def test_near_pairs_are_listed_once_in_a_step_where_one_tree_is_pushed_and_another_passes():
    model = load_model(
        """<mujoco><option timestep="1e-3"/><worldbody><geom type="plane" size="1 1 .1"/>
        <body pos="0 0 .0199"><joint type="slide" axis="0 0 1"/><geom type="box" size=".02 .02 .02" mass=".1"/></body>
        <body pos=".3 0 .3"><joint axis="0 1 0"/><geom type="box" size=".02 .02 .02" pos="0 0 -.1" mass=".1"/></body>
        </worldbody></mujoco>""",
        [("*", "*", ContactPair(MATERIALS["rubber"], MATERIALS["steel"], friction=0.5, restitution=0.5))],
    )
    data = mujoco.MjData(model)
    data.qpos[1] = 1.0
    mujoco.mj_step(model, data, 50)  # the box has landed
    before = int(head_of(data)[1]["lists"])
    for i in range(50):
        data.qfrc_applied[0] = 0.3 * np.sin(i)  # it does not fall asleep
        mujoco.mj_step(model, data)
    assert head_of(data)[1]["kicks"] > 0
    assert head_of(data)[1]["lists"] - before <= 50


def test_an_arm_that_whirls_keeps_its_list_of_near_pairs():
    arm = ""
    for axis in ("0 1 0", "1 0 0", "0 1 0", "0 0 1"):
        box = "<geom type='box' size='.03 .04 .08' pos='0 0 -.1'/>"
        arm = f"<body pos='0 0 -.2'><joint axis='{axis}' damping='.003'/>{box}{arm}</body>"
    text = "<mujoco><option timestep='.002' integrator='implicitfast'/><worldbody>{}</worldbody></mujoco>"
    model = load_model(text.format(arm), [("*", "*", ContactPair("rubber", "steel", friction=0.8, restitution=0.5))])
    lists = []
    for share in np.linspace(0.97, 1.03, 12):  # it strikes itself, and no two runs are alike
        data = mujoco.MjData(model)
        data.qvel[:] = share * np.array([600.0, -300.0, 400.0, 900.0])  # 1.8 rad in a step
        mujoco.mj_step(model, data)
        before = int(head_of(data)[1]["lists"])
        mujoco.mj_step(model, data, 50)
        lists.append(int(head_of(data)[1]["lists"]) - before)
    assert np.mean(lists) < 40  # of 50 steps
