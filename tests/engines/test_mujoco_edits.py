"""What a user changes while a model runs: masses, sizes, places, heights, friction of geoms."""

import warnings

import numpy as np
import pytest
from mujoco_scenes import BALL, SLED, mujoco, steel_pair, with_data

from contactlaw import MATERIALS, ContactPair, ContactWarning
from contactlaw.mujoco_plugin import (
    contacts_of,
    instances_of,
    load_model,
)

NAME = "contactlaw:ball:floor"
RUBBER = MATERIALS["rubber"]


def test_a_slide_whose_zero_is_moved():
    """The engine counts coordinates from qpos0, and so the ball meets the wall, at 1 m, elsewhere in them."""
    model, data = with_data(
        load_model(
            """<mujoco><option gravity="0 0 0"/><worldbody><geom name="wall" type="plane" size="1 1 1" zaxis="-1 0 0"
            pos="1 0 0"/><body><joint type="slide" axis="1 0 0"/><geom name="ball" size=".1"/></body></worldbody>
            </mujoco>""",
            [("ball", "wall", steel_pair(restitution=1.0))],
        )
    )
    data.qvel[0] = 1.0
    mujoco.mj_step(model, data, 20)
    model.qpos0[0] = -0.3
    mujoco.mj_step(model, data, 350)
    assert data.qvel[0] == pytest.approx(-1.0, abs=1e-6)
    assert data.qpos[0] == pytest.approx(2.0 * 0.6 - 0.74, abs=1e-3)


def lighter(model):
    model.body_mass[1] *= 0.1
    model.body_inertia[1] *= 0.1


def larger(model):
    model.geom_size[1, 0] *= 2.0


def slower(model):
    model.body_inertia[1] *= 2.0


@pytest.mark.parametrize("change", [lighter, slower, larger])
def test_a_model_that_was_changed_is_read_again(change):
    """As an MjData that is made after the change, which leaves at the speed that it came with."""
    after = []
    for late in (False, True):
        model = load_model(BALL, [("ball", "floor", steel_pair(restitution=1.0))])
        model.opt.gravity[:] = 0.0
        data = mujoco.MjData(model)
        change(model)
        mujoco.mj_setConst(model, data)
        if not late:
            data = mujoco.MjData(model)
        data.qpos[2] = 0.1
        data.qvel[:] = [0.3, 0.0, -1.0, 0.0, 0.0, 0.0]
        mujoco.mj_step(model, data, 200)
        after.append(data.qvel.copy())
    assert after[0][2] == pytest.approx(1.0, abs=1e-3)
    assert np.array_equal(*after)


TWO = """<mujoco><option timestep=".001" gravity="0 0 0" integrator="{}"/><worldbody>
<body name="a"><freejoint/><geom name="a" size=".02"/></body>
<body name="b" pos=".129 0 0"><freejoint/><geom name="b" size=".02"/></body></worldbody></mujoco>"""


@pytest.mark.parametrize("integrator", ["Euler", "RK4"])
@pytest.mark.parametrize("steps", [0, 1, 2, 3])
def test_a_mass_that_is_changed_in_flight_counts_in_the_next_impact(integrator, steps):
    """Three times as heavy a few steps before it strikes, a ball passes on 3/2 of its speed: collinear, elastic."""
    model, data = with_data(load_model(TWO.format(integrator), [("a", "b", steel_pair(restitution=1.0))]))
    mujoco.mj_step(model, data)
    data.qvel[0] = 10.0
    mujoco.mj_step(model, data, 8 - steps)
    model.body_mass[1] *= 3.0
    model.body_inertia[1] *= 3.0
    mujoco.mj_setConst(model, mujoco.MjData(model))
    assert data.qvel[6] == 0.0
    mujoco.mj_step(model, data, steps + 5)
    assert data.qvel[[0, 6]] == pytest.approx([5.0, 15.0], abs=1e-3)


def test_a_contact_goes_on_when_the_model_is_read_again():
    model, data = with_data(load_model(BALL, [("ball", "floor", ContactPair(RUBBER, RUBBER, 0.8, 0.5))]))
    mujoco.mj_step(model, data, 500)
    [before] = contacts_of(model, data, NAME)
    model.body_mass[1] *= 1.5
    mujoco.mj_forward(model, data)
    [held] = contacts_of(model, data, NAME)
    assert held.overlap == before.overlap
    mujoco.mj_step(model, data, 1000)
    [after] = contacts_of(model, data, NAME)
    assert after.normal_force == pytest.approx(1.5 * before.normal_force, rel=1e-3)


def test_friction_of_geoms_is_what_the_model_has():
    """Of a table without friction: as geom_friction is, by the engine's rule, also where somebody edits it."""
    model = load_model(SLED, {"*": RUBBER}, restitution=0.5)
    data, found = mujoco.MjData(model), []
    data.qvel[0] = 3.0
    for friction in ((0.2, 0.05), (0.05, 0.3), (0.1, 0.1)):  # of the floor and of the feet
        model.geom_friction[0, 0], model.geom_friction[1:, 0] = friction
        mujoco.mj_step(model, data, 20)
        before = data.qvel[0]
        mujoco.mj_step(model, data, 100)
        found.append((before - data.qvel[0]) / 0.2)
    assert found == pytest.approx([0.2 * 9.81, 0.3 * 9.81, 0.1 * 9.81], rel=0.01)
    model.geom_friction[2, 0] = 0.4  # one of four feet
    mujoco.mj_step(model, data, 5)
    [name] = instances_of(model)
    limits = sorted(
        (contact.geom2, round(float(np.linalg.norm(contact.tangential_force) / contact.normal_force), 4))
        for contact in contacts_of(model, data, name)
    )
    assert limits == [(1, 0.1), (2, 0.4), (3, 0.1), (4, 0.1)]


def test_each_geom_may_have_a_friction_of_its_own():
    """Twelve balls that slide: each is slowed down by its own coefficient, except where the floor has priority."""
    own = np.linspace(0.02, 0.24, 12)
    balls = "".join(
        f'<body pos="0 {i} .1"><freejoint/><geom size=".1" friction="{mu}"/></body>' for i, mu in enumerate(own)
    )
    floor = '<geom type="plane" size="1 1 1" friction="0.01" priority="{}"/>'
    for priority, expected in ((0, own), (1, np.full(12, 0.01))):
        scene = f'<mujoco><option timestep=".002"/><worldbody>{floor.format(priority)}{balls}</worldbody></mujoco>'
        model = load_model(scene, {"*": RUBBER}, restitution=0.5)
        data = mujoco.MjData(model)
        data.qvel[::6] = 6.0
        mujoco.mj_step(model, data, 150)
        before = data.qvel[::6].copy()
        mujoco.mj_step(model, data, 50)
        assert before - data.qvel[::6] == pytest.approx(0.1 * 9.81 * expected, rel=0.01)


def test_what_cannot_be_served_is_refused_with_a_word():
    """A foot without size; the law goes on with what the model was."""
    model, data = with_data(load_model(SLED, {"*": RUBBER}, restitution=0.5))
    data.qvel[0] = 4.0
    mujoco.mj_step(model, data, 20)
    size = model.geom_size[2].copy()
    model.geom_size[2] = 0.0
    with pytest.warns(ContactWarning, match="old values: geom_size of 'foot1': radius = 0.0: must be finite and > 0"):
        mujoco.mj_step(model, data, 2)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        mujoco.mj_step(model, data, 2)
    model.geom_size[2], model.geom_friction[:, 0] = size, 0.3
    mujoco.mj_step(model, data, 100)
    before = data.qvel[0]
    mujoco.mj_step(model, data, 100)
    assert before - data.qvel[0] == pytest.approx(0.2 * 0.3 * 9.81, rel=0.01)


def test_a_body_on_joints_that_sleeps_notices_another_direction_of_gravity():
    """It slides down a slope of 30 degrees: a = g (sin 30 - mu cos 30)."""
    scene = """<mujoco><worldbody><geom name="floor" type="plane" size="5 5 1"/><body pos="0 0 .05"><joint type="slide"
    axis="1 0 0"/><joint type="slide"/><geom name="box" type="box" size=".05 .05 .05"/></body></worldbody></mujoco>"""
    model, data = with_data(load_model(scene, [("box", "floor", steel_pair(friction=0.3))]))
    mujoco.mj_step(model, data, 500)
    model.opt.gravity[:] = 9.81 * np.array([0.5, 0.0, -np.sqrt(0.75)])
    mujoco.mj_step(model, data, 150)
    assert data.qvel[0] == pytest.approx(0.3 * 9.81 * (0.5 - 0.3 * np.sqrt(0.75)), rel=0.01)


def heavier(model):
    model.body_subtreemass[1:] *= 3.0
    model.body_mass[:] *= 3.0
    model.body_inertia[:] *= 3.0


def turned(model):
    model.opt.gravity[:] = [9.81, 0.0, 0.0]


def lowered(model):
    model.body_pos[1, 2] -= 0.1


def stiffer(model):
    model.dof_armature[:] += 5.0


@pytest.mark.parametrize("change", [heavier, turned, lowered, stiffer])
@pytest.mark.parametrize("integrator", ["EULER", "RK4"])
def test_a_jointed_model_that_is_changed_moves_as_one_that_was_so_from_the_start(change, integrator):
    """An arm falls on a post that stands on another body; both runs have the state before the change in common."""
    scene = """<mujoco><option timestep=".002"/><worldbody><body name="stand" pos="0 0 .1">
    <geom name="post" size=".05"/></body><body name="arm" pos="-.3 0 .3"><joint axis="0 1 0" damping=".1"/>
    <geom name="rod" type="capsule" fromto="0 0 0 .4 0 0" size=".02" density="300"/></body></worldbody></mujoco>"""
    ends = []
    for late in (False, True):
        model = load_model(scene, [("rod", "post", ContactPair(RUBBER, RUBBER, 0.5, 0.5))])
        model.opt.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator}")
        data = mujoco.MjData(model)
        mujoco.mj_step(model, data, 200)
        assert contacts_of(model, data, "contactlaw:rod:post")
        change(model)
        if not late:
            kind = mujoco.mjtState.mjSTATE_INTEGRATION
            state = np.empty(mujoco.mj_stateSize(model, kind))
            mujoco.mj_getState(model, data, state, kind)
            data = mujoco.MjData(model)
            mujoco.mj_setState(model, data, state, kind)
        mujoco.mj_step(model, data, 300)
        ends.append(np.concatenate([data.qpos, data.qvel]))
    assert ends[0] == pytest.approx(ends[1], abs=1e-5)  # what is set back wakes


def test_a_state_in_which_a_robot_sleeps_is_set_back_without_complaint():
    scene = BALL.replace("<freejoint/>", '<joint type="slide" axis="0 0 1"/>')
    model = load_model(scene, [("ball", "floor", ContactPair(RUBBER, RUBBER, 0.8, 0.5))])
    data, other = mujoco.MjData(model), mujoco.MjData(model)
    mujoco.mj_step(model, data, 3000)
    assert np.abs(data.qvel).max() == 0.0
    mujoco.mj_copyData(other, model, data)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        mujoco.mj_step(model, other, 20)
        model.body_mass[1] *= 1.1
        mujoco.mj_step(model, data, 20)
    assert other.qpos == pytest.approx(data.qpos, abs=1e-4)


def test_contype_that_is_edited_is_told_of():
    """But not that of a geom which the law does not have."""
    other = '<geom name="other" size=".1" pos="1 0 0"/></worldbody>'
    model, data = with_data(load_model(BALL.replace("</worldbody>", other), [("ball", "floor", steel_pair())]))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        mujoco.mj_step(model, data, 20)
        model.geom("other").contype = 0
        mujoco.mj_step(model, data, 20)
    model.geom("ball").contype = model.geom("ball").conaffinity = 0
    text = r"^contacts at .* geom_contype = 0 of geom 'ball', geom_conaffinity = 0 of geom 'ball': the law keeps"
    with pytest.warns(ContactWarning, match=text):
        mujoco.mj_step(model, data, 5)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        mujoco.mj_step(model, data, 20)
    assert data.qpos[2] == pytest.approx(0.025, abs=1e-5)


def test_heights_that_are_edited_count_from_the_next_reset():
    """A ball on a flat field that is raised by 5 mm: dropped anew it rests as much higher, whenever that is."""
    xml = """<mujoco><option timestep=".002"/><asset><hfield name="land" nrow="3" ncol="3" size=".2 .2 .1 .1"
    elevation="0 0 0 0 0 0 0 0 1"/></asset><worldbody><geom name="land" type="hfield" hfield="land"/>
    <body pos="0 0 .12"><freejoint/><geom name="ball" size=".02"/></body></worldbody></mujoco>"""
    model = load_model(xml, [("ball", "land", steel_pair())])
    data, places = mujoco.MjData(model), []
    for height in (0.0, 0.05, 0.1):
        model.hfield_data[:] = height
        mujoco.mj_resetData(model, data)
        data.qpos[2] = 0.0205 + 0.1 * height
        mujoco.mj_step(model, data, 1001)
        places.append(data.qpos[2])
    assert places == pytest.approx([0.02, 0.025, 0.03], abs=1e-5)


TYPED = """<mujoco><option timestep=".002"/><worldbody><geom name="floor" type="plane" size="1 1 1"/>
<body pos="0 0 .1"><freejoint/><geom name="one" type="{}" size=".1 .1 .1"/></body></worldbody></mujoco>"""


@pytest.mark.parametrize("kind", ["SDF", "HFIELD", "PLANE", "MESH", "CAPSULE", "BOX"])
def test_a_type_that_a_geom_cannot_become_is_refused_and_the_old_one_stays(kind):
    """Balls that became distance fields fell through, and those that became boxes were told of plugin_state."""
    model, data = with_data(load_model(TYPED.format("sphere"), [("*", "*", ContactPair(RUBBER, RUBBER, 0.3, 0.5))]))
    mujoco.mj_step(model, data, 3)
    model.geom_type[1] = getattr(mujoco.mjtGeom, f"mjGEOM_{kind}")
    with pytest.warns(ContactWarning, match=f"keeps the old values: geom_type = {kind.lower()} of geom 'one'") as said:
        mujoco.mj_step(model, data, 100)
    assert len(said) == 1
    assert data.qpos[2] == pytest.approx(0.1, abs=2e-3)


def test_a_type_whose_size_is_refused_is_named():
    model, data = with_data(load_model(TYPED.format("sphere"), [("*", "*", ContactPair(RUBBER, RUBBER, 0.3, 0.5))]))
    model.geom_type[1], model.geom_size[1, 1:] = mujoco.mjtGeom.mjGEOM_BOX, 0.0
    with pytest.warns(ContactWarning, match=r"old values: geom_type = box of geom 'one': half_lengths = "):
        mujoco.mj_step(model, data, 100)


def test_a_box_that_becomes_a_ball_lies_on_as_one():
    """It needs less of plugin_state; that was taken for damaged."""
    model, data = with_data(load_model(TYPED.format("box"), [("*", "*", ContactPair(RUBBER, RUBBER, 0.3, 0.5))]))
    mujoco.mj_step(model, data, 300)
    model.geom_type[1] = mujoco.mjtGeom.mjGEOM_SPHERE
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        mujoco.mj_step(model, data, 300)
    assert not [one for one in said if "found in each other" not in str(one.message)]
    assert data.qpos[2] == pytest.approx(0.1, abs=5e-3)


def test_a_mass_that_is_refused_is_named():
    model, data = with_data(load_model(TYPED.format("sphere"), [("*", "*", ContactPair(RUBBER, RUBBER, 0.3, 0.5))]))
    model.body_mass[1] = 0.0
    with pytest.warns(ContactWarning, match="old values: body_mass of 1: "):
        mujoco.mj_step(model, data, 100)


@pytest.mark.parametrize(
    ("field", "value", "said"),
    [
        ("body_mass", -1.0, "body_mass = -1.0 of body 'cup': must be finite and not negative"),
        ("body_inertia", (np.nan, 1.0, 1.0), "body_inertia = [nan, 1.0, 1.0] of body 'cup': must be finite"),
        ("body_inertia", (1.0, 1.0, 3.0), "body 'cup': inertia: principal moments [1.0, 1.0, 3.0]"),
    ],
)
def test_a_mass_that_no_mjdata_can_have_is_named(field, value, said, capfd):
    """A negative mass was "bodies: link 0 has no mass"."""
    text = TYPED.format("sphere").replace('<body pos="0 0 .1"', '<body name="cup" pos="0 0 .1"')
    model = load_model(text, [("*", "*", ContactPair(RUBBER, RUBBER, 0.3, 0.5))])
    getattr(model, field)[1] = value
    with pytest.raises(mujoco.FatalError, match="init failed"):
        mujoco.MjData(model)
    assert said in capfd.readouterr().err
