"""States of MuJoCo's data set back: at any step, what follows is what followed, to the bit."""

from copy import copy

import numpy as np
import pytest
from mujoco_scenes import WHOLE, mujoco, state_of, steel_pair
from set_back import goes_on_from_all, law_for

from contactlaw import MATERIALS, ContactPair
from contactlaw.mujoco_plugin import load_model
from contactlaw.mujoco_plugin.block import HEAD
from contactlaw.mujoco_plugin.layout import record_at
from contactlaw.world.data.records import WORLD
from sims.heap import poured
from sims.scene import Settings


def test_a_heap_set_back_at_any_step_goes_on_to_the_bit():
    """While it falls, lands, waits with its implicit steps, lies, falls asleep and sleeps; into data used before."""
    world = poured(Settings("mujoco", timestep=2e-3), 8)
    world.start()
    data = world.data
    saved, waited, slept = [], 0, 0
    for _ in range(320):
        saved.append(state_of(world.model, data))
        mujoco.mj_step(world.model, data)
        numbers = data.plugin_state
        waited += int(((numbers < 0.0) & (numbers > -64.0) & (numbers == np.floor(numbers))).sum() >= 8)
        slept += int(not data.qvel.any())
    assert waited > 10 and slept > 100
    goes_on_from_all(world.model, saved, 20)
    world.close()


def test_a_box_set_back_at_any_step_goes_on_to_the_bit(tmp_path):
    """It strikes the floor, tumbles and comes to lie: its angular momentum is that of the spin in the state alone."""
    file = tmp_path / "box.xml"
    file.write_text(
        "<mujoco><option timestep='1e-3' integrator='implicit'/><worldbody><geom type='plane' size='1 1 1'/>"
        "<body pos='0 0 .05' euler='20 15 5'><freejoint/><geom type='box' size='.02 .015 .01' pos='.003 0 0'/></body>"
        "</worldbody></mujoco>"
    )
    model = load_model(file, [("*", "*", steel_pair(friction=0.3, restitution=0.3))])
    data, saved = mujoco.MjData(model), []
    for _ in range(300):
        saved.append(state_of(model, data))
        mujoco.mj_step(model, data)
    goes_on_from_all(model, saved, 5)


OFF = (
    "<body pos='{} 0 {}' euler='20 15 5'><freejoint/><geom type='sphere' size='.02' density='1000'/>"
    "<geom type='sphere' size='.01' pos='.008 .003 .015' density='5000'/></body>"
)
BOX = "<body pos='{} 0 {}' euler='20 15 5'><freejoint/><geom type='box' size='.02 .015 .01' pos='.003 0 0'/></body>"


def test_an_ellipsoid_set_back_at_any_step_rolls_on_to_the_bit(tmp_path):
    """Rolling resistance acts by the radius of its way: a contact that is set back is as oblong as it was."""
    file = tmp_path / "ellipsoid.xml"
    file.write_text(
        "<mujoco><option timestep='2e-3'/><worldbody><geom type='plane' size='1 1 1'/><body pos='0 0 .02'><freejoint/>"
        "<geom type='ellipsoid' size='.02 .03 .02'/></body></worldbody></mujoco>"
    )
    model = load_model(file, [("*", "*", steel_pair(rolling_resistance=0.05, restitution=0.5))])
    data, saved = mujoco.MjData(model), []
    data.qvel[0], data.qvel[4] = 0.1, 5.0
    for _ in range(30):
        saved.append(state_of(model, data))
        mujoco.mj_step(model, data)
    goes_on_from_all(model, saved, 3)


@pytest.mark.parametrize(
    ("bodies", "steps"),
    [(OFF.format(0, 0.06) + OFF.format(0.03, 0.12), 400),
     ("".join(BOX.format(0.004 * i, 0.05 + 0.06 * i) for i in range(3)), 400)],
    ids=["two that spin on", "boxes"],
)  # fmt: skip
def test_bodies_off_their_centres_set_back_at_any_step_go_on_to_the_bit(bodies, steps):
    """They tumble in flight, strike the floor and each other, spin on it, come to lie and fall asleep."""
    model = law_for(bodies)
    data, saved = mujoco.MjData(model), []
    for _ in range(steps):
        saved.append(state_of(model, data))
        mujoco.mj_step(model, data)
    goes_on_from_all(model, saved, 12)


@pytest.mark.parametrize("floor", ["type='plane' size='5 5 1'", "type='box' size='5 5 .1' pos='0 0 -.1'"])
def test_a_box_that_slides_keeps_its_list_of_near_pairs_and_goes_on_to_the_bit_without_it(floor):
    model = law_for("<body pos='0 0 .02'><freejoint/><geom type='box' size='.03 .02 .02' mass='1'/></body>", floor)
    data, saved = mujoco.MjData(model), []
    mujoco.mj_step(model, data, 300)
    data.qvel[:] = [0.5, 0.1, 0.0, 0.0, 0.0, 1.0]
    world = record_at(int(record_at(int(data.plugin_data[0]), HEAD, 1)["world"][0]), WORLD, 1)
    before = int(world["lists"][0])
    for _ in range(60):
        saved.append(state_of(model, data))
        mujoco.mj_step(model, data)
    assert int(world["lists"][0]) - before < 30  # one in each step, before they were kept
    goes_on_from_all(model, saved, 10)


def test_boxes_that_bounce_list_what_they_can_touch_within_the_step_and_go_on_to_the_bit():
    """Not in the next four as well: of these long steps each would throw every box past most others."""
    places = [(0.07 * i, 0.07 * j, 0.03 + 0.07 * k) for i in range(3) for j in range(3) for k in range(3)]
    box = "<body pos='{} {} {}'><freejoint/><geom type='box' size='.025 .025 .025'/></body>"
    model = law_for("".join(box.format(*place) for place in places), option="timestep='1e-2'")
    data, saved, listed = mujoco.MjData(model), [], 0
    data.qvel[:] = np.random.default_rng(1).normal(size=model.nv)
    mujoco.mj_step(model, data)
    world = record_at(int(record_at(int(data.plugin_data[0]), HEAD, 1)["world"][0]), WORLD, 1)
    for _ in range(40):
        saved.append(state_of(model, data))
        mujoco.mj_step(model, data)
        listed += int(world["nears"][0])
    assert listed < 40 * 2000
    goes_on_from_all(model, saved, 4)


@pytest.mark.parametrize("seed", [2, 28, 29, 44])
def test_random_boxes_meshes_and_cylinders_set_back_go_on_to_the_bit_with_their_ledger(seed):
    """Contacts part together, leave initial overlaps and take slots that others have used."""
    draw, steel = np.random.default_rng(seed), MATERIALS["steel"]
    count = draw.integers(1, 5)
    rock = " ".join(map(str, (0.015 * draw.normal(size=(14, 3))).ravel()))
    bodies = ""
    for i in range(count):
        kind = draw.choice(["box", "mesh", "cylinder", "box"])
        sizes = {"box": draw.uniform(0.008, 0.025, 3), "mesh": (), "cylinder": draw.uniform(0.008, 0.02, 2)}[kind]
        shape = "mesh='rock'" if kind == "mesh" else f"size='{' '.join(map(str, sizes))}'"
        place = (*draw.uniform(-0.01, 0.01, 2), 0.04 + 0.045 * i)
        bodies += (
            f"<body pos='{' '.join(map(str, place))}' euler='{' '.join(map(str, draw.uniform(-60, 60, 3)))}'>"
            f"<freejoint/><geom type='{kind}' {shape}/></body>"
        )
    floor = draw.choice(["type='plane' size='1 1 1'", "type='box' size='1 1 .1' pos='0 0 -.1'"])
    model = load_model(
        f"<mujoco><option timestep='{draw.choice([1e-3, 2e-3, 4e-3])}'/>"
        f"<asset><mesh name='rock' vertex='{rock}'/></asset><worldbody><geom {floor}/>{bodies}</worldbody></mujoco>",
        [("*", "*", ContactPair(steel, MATERIALS["rubber"] if seed % 2 else steel, 0.3, 0.5))],
    )
    data, saved = mujoco.MjData(model), []
    data.qvel[:] = np.tile(np.r_[0.3 * draw.normal(size=3), 5.0 * draw.normal(size=3)], count)
    for _ in range(120):
        saved.append(state_of(model, data))
        mujoco.mj_step(model, data)
    goes_on_from_all(model, saved, 12)


ARM = (
    "<body pos='.01 0 .06'><joint pos='-.08 0 0' axis='0 1 0'/>"
    "<geom type='ellipsoid' size='.01 .015 .018' density='1100'/></body>"
)
LED = "<body name='led' mocap='true' pos='.3 0 .05'><geom type='box' size='.02 .3 .05'/></body>"


@pytest.mark.parametrize("edited", [False, True], ids=["as it was", "after an edit that was undone"])
def test_data_in_which_bodies_sleep_go_on_to_the_bit_from_states_before(edited):
    """An arm that falls on the floor, or lies there; what slept, or was woken by the edit, counted as such."""
    floor, option = "type='box' size='1 1 .05' pos='0 0 -.05'", "timestep='4e-3' integrator='implicit'"
    model = law_for(ARM + BOX.format(0.3, 0.03), floor, option)
    data, saved = mujoco.MjData(model), []
    for _ in range(600):
        saved.append(state_of(model, data))
        mujoco.mj_step(model, data)
    assert not data.qvel.any()
    mass = model.body_mass.copy()
    for number in (*range(0, 40, 2), 500):
        if edited:
            model.body_mass[1] *= 1.5
            mujoco.mj_step(model, data)
            model.body_mass[:] = mass
        mujoco.mj_setState(model, data, saved[number], WHOLE)
        mujoco.mj_step(model, data)
        assert np.array_equal(state_of(model, data), saved[number + 1]), number
        mujoco.mj_setState(model, data, saved[-1], WHOLE)
        mujoco.mj_step(model, data)


def test_a_box_that_slept_goes_on_to_the_bit_once_it_is_pushed():
    """That an implicit step had failed before it slept no longer counts: a saved state does not tell."""
    model = law_for(BOX.format(0, 0.05), option="timestep='4e-3'")
    data, other = mujoco.MjData(model), mujoco.MjData(model)
    mujoco.mj_step(model, data, 100)
    assert not data.qvel.any()
    mujoco.mj_setState(model, other, state_of(model, data), WHOLE)
    for one in (data, other):
        one.qvel[:] = [0.1, 0.0, 0.1, 0.0, 1.0, 0.0]
        mujoco.mj_step(model, one)
    assert np.array_equal(state_of(model, other), state_of(model, data))


def test_what_sleeps_beside_a_body_that_is_led_sleeps_on_in_other_data():
    model = law_for(LED + BOX.format(0.1, 0.03) + "<body pos='0 0 2'><freejoint/><geom size='.01'/></body>")
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 500)
    assert not data.qvel[:6].any()
    saved, other = state_of(model, data), mujoco.MjData(model)
    mujoco.mj_setState(model, other, saved, WHOLE)
    for one in (data, other):
        mujoco.mj_step(model, one, 2)
    assert np.array_equal(state_of(model, other), state_of(model, data))


@pytest.mark.parametrize(("push", "speed"), [(30.0, 30.0), (100.0, -30.0)])
def test_a_copy_follows_an_arm_past_what_is_led_by_and_under_a_sudden_push(push, speed):
    """Whether the engine has the arm must not depend on when near pairs were listed, nor for how far."""
    model = load_model(
        """<mujoco><option timestep=".002" integrator="RK4" gravity="0 0 0"/><worldbody>
        <body mocap="true"><geom size=".03"/></body>
        <body><joint axis="0 0 1"/><geom type="box" size=".1 .01 .01" pos=".1 0 0" mass="1"/>
        <body pos=".2 0 0"><joint axis="0 0 1"/><geom type="box" size=".1 .01 .01" pos=".1 0 0" mass=".2"/></body>
        </body><body pos="0 .9 0"><joint type="slide"/><geom type="box" size=".05 .05 .05" mass="1"/></body>
        </worldbody></mujoco>""",
        [("*", "*", ContactPair(MATERIALS["steel"], MATERIALS["steel"], 0.3, 0.5))],
    )
    data = mujoco.MjData(model)
    data.mocap_pos[0, 0], data.qvel[:] = 0.5, (9.0, speed, 0.1)
    for start in range(0, 140, 4):
        other = copy(data)
        for one in (data, other):
            for i in range(start, start + 4):
                one.mocap_pos[0, :2] = 0.5 + 0.1 * np.sin(0.28 * i), 0.1 * np.cos(0.2 * i)
                one.qfrc_applied[1] = push * np.sin(0.4 * i)
                mujoco.mj_step(model, one)
        assert np.array_equal(state_of(model, other), state_of(model, data)), start


@pytest.mark.parametrize(("held", "seed"), [("<freejoint/>", 0), ("", 2), (None, 0), (None, 1)])
def test_a_grasp_set_back_at_any_step_goes_on_to_the_bit(held, seed):
    """Fingers with hanging links, which contacts push, round a ball, a mocap body that is led to and fro, or nothing.

    What is listed near the links, by margins of this step or of an earlier one, decides whether the step is implicit.
    """

    def finger(name, side):
        return f"""<body pos="{0.05 * side} 0 0"><joint name="{name}" type="slide" axis="{-side} 0 0" damping="1"/>
        <geom type="box" size=".03 .1 .1" mass=".2"/><body pos="0 0 -.1"><joint axis="0 1 0" stiffness=".3"
        damping=".001"/><geom type="box" size=".012 .05 .04" pos="0 0 -.05" mass=".02"/></body></body>"""

    mocap = 'mocap="true"' if held == "" else ""
    ball = "" if held is None else f'<body {mocap}>{held}<geom size=".02" density="3000"/></body>'
    model = load_model(
        f"""<mujoco><option timestep=".008" integrator="implicitfast"/><worldbody>
        <geom type="plane" size="1 1 .1" pos="0 0 -.4"/><geom type="box" size=".02 .3 .3" pos=".13 0 -.1"/>
        <body><joint type="slide" axis="0 0 1" stiffness="1e3" damping="5"/><joint type="slide" axis="1 0 0"
        stiffness="300"/><geom size=".02" pos="0 0 .3"/>{finger("l", -1)}{finger("r", 1)}</body>
        {ball}</worldbody>
        <actuator><motor joint="l"/><motor joint="r"/></actuator></mujoco>""",
        [("*", "*", steel_pair(friction=0.4, restitution=0.8))],
    )
    data, other, saved = mujoco.MjData(model), mujoco.MjData(model), []
    data.qvel[:6] = np.random.default_rng(seed).normal(size=6) * 2.0

    def step(one, number):
        one.ctrl[:] = 30.0 + 25.0 * np.sin(0.3 * number + seed) * np.array([1.0, 0.7])
        one.mocap_pos[:] = [4e-3 * np.sin(0.2 * number), 0.0, 0.0]
        mujoco.mj_step(model, one)

    for number in range(150):
        saved.append(state_of(model, data))
        step(data, number)
    for first in range(147):
        mujoco.mj_setState(model, other, saved[first], WHOLE)
        for number in range(first, first + 3):
            step(other, number)
            assert np.array_equal(state_of(model, other), saved[number + 1]), (first, number)
