"""Balls whose size, or the place that they lie in, a user changes: they are not thrown, and no warning is spurious."""

import warnings

import pytest
from mujoco_scenes import BALL, WHOLE, mujoco, state_of

from contactlaw import ContactPair, ContactWarning
from contactlaw.mujoco_plugin import load_model

SLIDES = '<joint type="slide" axis="0 0 1"/>'


def resting(joint="<freejoint/>", ball="steel"):
    """A ball that sleeps on the floor, and its height [m] above where the model has it."""
    pair = ContactPair(ball, "steel", friction=0.115, restitution=0.9)
    model = load_model(BALL.replace("<freejoint/>", joint), [("ball", "floor", pair)])
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 2000)
    assert not data.qvel.any()
    return model, data, data.body("b").xpos[2:]


@pytest.mark.parametrize("joint", ["<freejoint/>", SLIDES], ids=["free", "slide"])
@pytest.mark.parametrize("factor", [1.05, 2.0])
def test_a_ball_that_grows_where_it_rests_is_not_thrown(joint, factor):
    model, data, height = resting(joint)
    model.geom_size[1, 0] *= factor
    found = f"'ball' of body 'b' on 'floor' .* {1 - 1 / factor:.2g} of the radius: they count as just touching"
    with pytest.warns(ContactWarning, match=found):
        mujoco.mj_step(model, data, 4)
    for _ in range(100):
        mujoco.mj_step(model, data)
        assert height[0] == pytest.approx(0.025, abs=1e-5)
    data.qpos[-5 if model.nq == 7 else 0] += 0.025 * factor  # out of the floor, onto which it falls as any other
    mujoco.mj_step(model, data, 2000)
    assert height[0] == pytest.approx(0.025 * factor, abs=1e-5)


@pytest.mark.parametrize("joint", ["<freejoint/>", SLIDES], ids=["free", "slide"])
def test_a_ball_that_has_grown_where_it_rested_when_its_state_was_saved_is_not_thrown(joint):
    """A rubber ball stores what throws it at 0.6 m/s; nothing but the size says that this is no impact."""
    model, data, _ = resting(joint, "rubber")
    state = state_of(model, data)
    model.geom_size[1, 0] *= 1.08
    other = mujoco.MjData(model)
    mujoco.mj_setState(model, other, state, WHOLE)
    with pytest.warns(ContactWarning, match="'ball' of body 'b' on 'floor' .* 0.0.* of the radius: they count as"):
        mujoco.mj_step(model, other, 200)
    assert 0.024 < other.body("b").xpos[2] < 0.025


@pytest.mark.parametrize("joint", ["<freejoint/>", SLIDES], ids=["free", "slide"])
def test_a_ball_that_shrinks_where_it_sleeps_falls_without_a_word(joint):
    model, data, height = resting(joint)
    model.geom_size[1, 0] *= 0.3
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        mujoco.mj_step(model, data, 1000)
    assert height[0] == pytest.approx(0.3 * 0.025, abs=1e-5)


def test_a_ball_that_grows_until_it_just_touches_does_so_without_a_word():
    """As sizes drawn at random in each reset do; where they touch, its radius and the table's half height round."""
    table = BALL.replace('type="plane" size="1 1 1"', 'type="box" size="1 1 .02" pos="0 0 -.02"')
    model = load_model(table.replace(".025", ".03"), [("ball", "floor", ContactPair("steel", "rubber", 0.5, 0.5))])
    data = mujoco.MjData(model)
    for size in (0.02, 0.03):
        model.geom_size[1, 0] = size
        mujoco.mj_resetData(model, data)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            mujoco.mj_step(model, data, 4)


@pytest.mark.parametrize("depth", [0.02, 1e-3])
def test_a_ball_that_is_put_deep_into_what_it_rests_on_is_not_thrown(depth):
    """A millimetre of steel throws it 58 m."""
    model, data, height = resting()
    data.qpos[2] -= depth
    says = f"'ball' of body 'b' on 'floor' .* found in each other by {depth / 0.025:.2g} of the radius"
    with pytest.warns(ContactWarning, match=says):
        mujoco.mj_step(model, data, 200)
    assert height[0] == pytest.approx(0.025 - depth, abs=1e-5)


def test_what_an_impact_of_five_metres_a_second_stores_is_taken_as_given():
    """A ball that is put into the floor leaves with what it stores there, up to that."""
    pair, ends = ContactPair("steel", "steel", friction=0.3, restitution=1.0, radius=0.025), []
    for share in (0.98, 1.02):
        model = load_model(
            """<mujoco><worldbody><geom name="floor" type="plane" size="1 1 1"/><body pos="0 0 .025"><freejoint/>
            <geom name="ball" size=".025" density="7800"/></body></worldbody></mujoco>""",
            [("ball", "floor", pair)],
        )
        data = mujoco.MjData(model)
        data.qpos[2] -= pair.greatest_overlap(model.body_mass[1], share * 5.0)
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            mujoco.mj_step(model, data, 200)
        ends.append((data.qvel[2], [str(one.message) for one in said]))
    (thrown, nothing), (lies, said) = ends
    assert thrown == pytest.approx(0.98 * 5.0 - 9.81 * data.time, abs=0.01) and not nothing
    assert abs(lies) < 0.01 and "found in each other" in said[0]
