"""The engine's constraint stage: off only where it can find nothing, and the motion is the same without it."""

import numpy as np
import pytest
from mujoco_scenes import mujoco, steel_pair

from contactlaw.mujoco_plugin import add_contact, instances_of, load_model, skip_constraints
from contactlaw.pair import ContactWarning

OFF = mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
FLOOR = '<geom name="floor" type="plane" size="1 1 .1"/>'
BODIES = """<body pos="0 0 .02"><freejoint/><geom name="ball" size=".01"/><site name="a"/></body>
<body name="box" pos=".05 0 .02" euler="20 0 0"><freejoint/><geom name="box" type="box" size=".01 .01 .01"/>{inside}
<site name="b"/></body>"""


def scene(inside="", outside="", world=""):
    bodies = BODIES.format(inside=inside)
    return f"<mujoco><worldbody>{FLOOR}{bodies}{world}</worldbody>{outside}</mujoco>"


def all_by_law(xml, **settings):
    return load_model(xml, [("*", "*", steel_pair())], **settings)


def test_the_stage_is_off_where_the_law_makes_all_contacts_of_free_bodies_and_nothing_else_changes():
    ends = []
    for flag in (OFF, 0):
        model = all_by_law(scene())
        assert model.opt.disableflags == OFF
        model.opt.disableflags = flag
        data = mujoco.MjData(model)
        data.qvel[6:9] = [-1, 0, 0]  # the box meets the ball
        mujoco.mj_step(model, data, 60)
        ends.append([*data.qpos, *data.qvel])
    assert np.array_equal(*ends)


@pytest.mark.parametrize(
    "parts",
    [
        {"inside": '<body pos="0 0 .03"><joint/><geom name="arm" size=".005"/></body>'},
        {"outside": '<equality><connect body1="box" anchor="0 0 0"/></equality>'},
        {"world": '<body pos="0 0 1"><joint type="free" frictionloss="1"/><geom size=".01"/></body>'},
        {"outside": '<tendon><spatial><site site="a"/><site site="b"/></spatial></tendon>'},
    ],
)
def test_it_stays_on_where_joints_equalities_or_tendons_may_bind(parts):
    assert all_by_law(scene(**parts)).opt.disableflags == 0


def test_it_stays_on_where_the_engine_may_make_contacts():
    assert all_by_law(scene(), skip=[("ball", "box")]).opt.disableflags == 0
    other = '<body pos="0 0 1"><freejoint/><geom name="other" size=".01"/></body>'
    for visual, flag in ((' contype="0" conaffinity="0"', OFF), ("", 0)):
        spec = mujoco.MjSpec.from_string(scene(world=other.replace(' size=".01"', f' size=".01"{visual}')))
        add_contact(spec, ["ball", "box"], ["floor", "ball", "box"], steel_pair())
        model = spec.compile()
        assert model.opt.disableflags == 0
        assert skip_constraints(model) is bool(flag)
        assert model.opt.disableflags == flag
    native = mujoco.MjModel.from_xml_string(scene())
    assert not skip_constraints(native) and native.opt.disableflags == 0


def test_two_geoms_of_the_law_in_an_explicit_pair_of_the_engine_keep_it_on():
    spec = mujoco.MjSpec.from_string(scene())
    add_contact(spec, "ball", "floor", steel_pair(), others=False)
    spec.add_pair(geomname1="ball", geomname2="box")
    assert not skip_constraints(spec.compile())


def test_a_model_whose_constraints_are_disabled_makes_no_contacts():
    with pytest.warns(ContactWarning, match="nothing is added"):
        model = all_by_law(scene(outside='<option><flag constraint="disable"/></option>'))
    assert not instances_of(model)
