"""The plugin's borders: specs and XML, native contacts, what is refused and what is said."""

import warnings

import numpy as np
import pytest
from mujoco_scenes import DENSITY, GEOM, RADIUS, ball_on_floor, bounce_of, mujoco, steel_pair, with_data

from contactlaw import ContactPair, ContactWarning, Material
from contactlaw.mujoco_plugin import add_contact, load_model


def test_the_native_contact_of_the_pair_is_off_and_that_with_others_stays():
    spec, _ = ball_on_floor(steel_pair(), timestep=1e-5)
    spec.worldbody.add_geom(name="wall", type=GEOM.mjGEOM_BOX, size=[0.1, 1, 1], pos=[0.1 + RADIUS - 1e-4, 0, 0.5])
    model, data = with_data(spec.compile())
    data.qpos[2] -= 1e-6
    mujoco.mj_forward(model, data)
    assert [sorted(model.geom(g).name for g in c.geom) for c in data.contact[: data.ncon]] == [["ball", "wall"]]
    mujoco.mj_step(model, data)
    mujoco.mj_forward(model, data)
    assert data.qfrc_passive[2] > 0.0


def test_geoms_without_others_leave_the_collision_detection_and_bounce_alike():
    after = []
    for others in (True, False):
        spec = mujoco.MjSpec()
        spec.option.timestep, spec.option.gravity = 1e-6, [0, 0, 0]
        floor = spec.worldbody.add_geom(type=GEOM.mjGEOM_PLANE, size=[1, 1, 0.1])
        body = spec.worldbody.add_body(pos=[0, 0, RADIUS])
        body.add_freejoint()
        ball = body.add_geom(size=[RADIUS, 0, 0], density=DENSITY)
        add_contact(spec, ball, floor, steel_pair(), others=others)
        model, data = with_data(spec.compile())
        data.qvel[:3] = [0.1, 0, -1]
        mujoco.mj_step(model, data, 150)
        after.append(data.qvel.copy())
        assert (model.npair, ball.contype) == ((1, 1) if others else (0, 0))
    assert np.array_equal(*after)


def test_a_deep_overlap_does_not_bring_the_native_contact_back():
    for floor in ("plane", "box"):
        spec, _ = ball_on_floor(steel_pair(radius=1e6), floor=floor)  # so flat that no warning of depth is due
        model, data = with_data(spec.compile())
        data.qpos[2] = 0.2 * RADIUS
        mujoco.mj_forward(model, data)
        assert data.ncon == 0


XML = """<mujoco><option timestep="1e-6" gravity="0 0 0" {option}/>
<extension><plugin plugin="contactlaw.contact"><instance name="bounce">{config}</instance></plugin></extension>
<worldbody><geom name="floor" type="plane" size="1 1 .1"/>
<body pos="0 0 .0254"><freejoint/><geom name="ball" size=".0254" density="7833"/></body></worldbody>
<contact>{native}</contact></mujoco>"""


KEYS = {"geom1": "ball", "geom2": "floor", "material1": "steel", "material2": "steel", "friction": "0.115"}


OFF = '<pair geom1="ball" geom2="floor" margin="-1e6"/>'


def xml(option="", native=OFF, **changes):
    config = "".join(f'<config key="{k}" value="{v}"/>' for k, v in {**KEYS, **changes}.items() if v)
    return XML.format(option=option, config=config, native=native)


def test_xml_needs_no_pair_where_the_engine_tests_none():
    """Of parent and child; it was refused, as if their native contact were on."""
    child = '<body pos="0 0 .1"><joint/><geom name="child" size=".02"/></body></body>'
    model = mujoco.MjModel.from_xml_string(xml(native="", geom2="child").replace("</body>", child))
    assert len(mujoco.MjData(model).plugin_data) == 1


def test_xml_and_add_contact_make_the_same_contact():
    spec, _ = ball_on_floor(steel_pair())
    after = []
    for model in (spec.compile(), mujoco.MjModel.from_xml_string(xml(restitution="0.93"))):
        data = mujoco.MjData(model)
        data.qvel[:3] = [0.1, 0.0, -1.0]
        mujoco.mj_step(model, data, 150)
        after.append(data.qvel.copy())
    assert np.array_equal(*after)


def test_a_spec_with_the_law_survives_a_round_trip_through_xml():
    pair = ContactPair(
        Material(1.1e9, 0.31), Material(2e9, 0.4), 0.3, 0.7, law="microslip node_count=24", stiffness_ratio=0.6
    )
    spec, _ = ball_on_floor(pair)
    model, data = with_data(mujoco.MjModel.from_xml_string(spec.to_xml()))
    original = spec.compile()
    other = mujoco.MjData(original)
    for m, d in ((model, data), (original, other)):
        d.qvel[:3] = [0.1, 0.0, -1.0]
        mujoco.mj_step(m, d, 100)
    assert np.array_equal(data.qvel, other.qvel)
    assert data.plugin_state.size == other.plugin_state.size


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"friction": "-0.1"}, "friction = -0.1: must be finite and >= 0"),
        ({"friction": ""}, "friction: missing"),
        ({"law": "mindlim"}, "did you mean 'mindlin'"),
        ({"geom2": "flor"}, "geom2 = 'flor'"),
        ({"geom2": "ball"}, "another geom"),
        ({"material1": "cheese"}, "material1 = 'cheese'"),
        ({"restitution": "0"}, "restitution = 0.0: must be in [1e-6, 1]"),
        ({"native": ""}, '<pair geom1="ball" geom2="floor"'),
        ({"option": '><flag spring="disable" damper="disable"/></option><option'}, "disableflags"),
    ],
)
def test_xml_that_cannot_be_is_refused_with_the_reason(changes, said, capfd):
    with pytest.raises(ValueError, match="init failed"):
        mujoco.MjModel.from_xml_string(xml(**changes))
    assert said in capfd.readouterr().err


def test_an_unknown_key_is_refused():
    with pytest.raises(ValueError, match="frictoin"):
        mujoco.MjModel.from_xml_string(xml(frictoin="0.1"))


def shapes_spec():
    return mujoco.MjSpec.from_string(
        '<mujoco><worldbody><geom name="floor" type="plane" size="1 1 .1"/>'
        '<geom name="wall" type="plane" size="1 1 .1" pos="9 0 0"/><body name="b" pos="0 0 .1"><freejoint/>'
        '<geom name="can" type="cylinder" size=".1 .1"/><geom name="ball" size=".1"/></body></worldbody></mujoco>'
    )


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"geom2": "flor"}, "geom2 = 'flor': is the name of no geom of the model; did you mean 'floor'"),
        ({"geom1": 99}, "geom1 = 99"),
        ({"geom1": "wall"}, "plane 'wall' on plane 'floor': planes and height fields do not touch each other"),
        ({"geom2": "ball"}, "another geom"),
        ({"pair": 0.1}, "pair = 0.1"),
        ({"spec": shapes_spec().compile()}, "before the model is compiled"),
    ],
)
def test_bad_input_is_refused_and_changes_nothing(change, said):
    spec = shapes_spec()
    arguments = {"spec": spec, "geom1": "ball", "geom2": "floor", "pair": steel_pair(), **change}
    before = spec.to_xml()
    with pytest.raises(ValueError, match=said):
        add_contact(**arguments)
    assert spec.to_xml() == before


def test_a_pair_is_added_once():
    spec = shapes_spec()
    add_contact(spec, "ball", "floor", steel_pair())
    for geoms in (("ball", "floor"), ("floor", "ball")):
        with pytest.raises(ValueError, match="added before"):
            add_contact(spec, *geoms, steel_pair())


def test_geoms_without_names_get_one():
    spec = mujoco.MjSpec()
    floor = spec.worldbody.add_geom(type=GEOM.mjGEOM_PLANE, size=[1, 1, 0.1])
    body = spec.worldbody.add_body(pos=[0, 0, 1])
    body.add_freejoint()
    ball = body.add_geom(size=[0.1, 0, 0])
    add_contact(spec, ball, floor, steel_pair())
    assert ball.name != floor.name
    mujoco.MjData(spec.compile())


@pytest.mark.parametrize(("overlaps", "says"), [("keep", "overlap .* is 0.2"), ("relax", "found in each other by 0.2")])
def test_a_deep_contact_is_warned_of(overlaps, says):
    soft = ContactPair(Material(1e5, 0.5), Material(1e5, 0.5), 0.1)
    spec, _ = ball_on_floor(soft, timestep=1e-5, overlaps=overlaps)
    model, data = with_data(spec.compile())
    data.qpos[2] = 0.8 * RADIUS
    which = "'ball' of body 'body of ball' on 'floor' of body 'world' at 1e-05 s"
    with pytest.warns(ContactWarning, match=f"{which}: {says}"):
        mujoco.mj_step(model, data)


def test_a_box_edge_asks_for_a_radius():
    for radius, warned in ((None, True), (RADIUS, False)):
        spec, _ = ball_on_floor(steel_pair(radius=radius), floor="box")
        model, data = with_data(spec.compile())
        data.qpos[0] = 1.0 + 0.5 * RADIUS
        data.qpos[2] = np.sqrt(0.75) * RADIUS - 1e-6
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            mujoco.mj_step(model, data)
        assert any("edge" in str(w.message) for w in caught) == warned


def test_a_mujoco_whose_structs_lie_elsewhere_is_refused(monkeypatch):
    from contactlaw.mujoco_plugin import layout

    layout.check()
    kinds, places = zip(*layout.DATA.fields.values(), strict=True)
    places = [place + 8 * (name == "xquat") for name, place in zip(layout.DATA.names, places, strict=True)]
    moved = {"names": layout.DATA.names, "formats": kinds, "offsets": places, "itemsize": layout.DATA.itemsize}
    monkeypatch.setattr(layout, "DATA", np.dtype(moved))
    with pytest.raises(ImportError, match=r"does not fit MuJoCo .*mjData\.xquat"):
        layout.check()


def test_a_mujoco_of_another_age_is_refused(monkeypatch):
    from contactlaw.mujoco_plugin.plugin import register

    monkeypatch.setattr(mujoco, "__version__", "3.2.1")
    with pytest.raises(ImportError, match=r"MuJoCo 3\.3\.6 to 4\.x, not 3\.2\.1"):
        register()


def test_the_contact_is_kept_when_a_spec_is_copied_or_attached():
    spec, _ = ball_on_floor(steel_pair())
    expected = bounce_of(spec.compile())
    assert expected == pytest.approx(0.93, abs=1e-3)
    assert bounce_of(spec.copy().compile()) == expected
    for prefix in ("x_", ""):
        child, _ = ball_on_floor(steel_pair())
        parent = mujoco.MjSpec()
        parent.option.timestep, parent.option.gravity = 1e-6, [0, 0, 0]
        parent.attach(child, frame=parent.worldbody.add_frame(), prefix=prefix)
        assert bounce_of(parent.compile()) == pytest.approx(expected, rel=1e-12)


BALL_AND_POST = """<mujoco><worldbody><geom name="floor" type="plane" size="1 1 1"/><geom name="wall" size=".02"/>
    <body name="A"><freejoint/><geom name="a" size=".02"/></body><body name="post"><geom name="b" size=".02"/></body>
    </worldbody></mujoco>"""


@pytest.mark.parametrize("change", ["copy", "attach", "delete"])
def test_both_contacts_of_one_body_are_kept_when_a_spec_changes(change):
    """MuJoCo drops an instance to which no body refers, and a body can refer to one only."""
    spec = mujoco.MjSpec.from_string(BALL_AND_POST)
    for other in ("floor", "wall"):
        add_contact(spec, "a", other, steel_pair())
    parent = mujoco.MjSpec()
    if change == "attach":
        parent.attach(spec, frame=parent.worldbody.add_frame(), prefix="x_")
    elif change == "delete":
        spec.delete(spec.body("post"))
    assert {"attach": parent, "copy": spec.copy(), "delete": spec}[change].compile().nplugin == 2


def test_a_deleted_body_of_a_contact_is_reported_and_does_not_end_it_for_others(capfd):
    spec = mujoco.MjSpec.from_string(BALL_AND_POST)
    add_contact(spec, ["a", "b"], ["a", "b", "floor"], steel_pair())
    spec.delete(spec.body("A"))
    with pytest.raises(ValueError, match="plugin"):
        mujoco.MjData(spec.compile())
    said = capfd.readouterr().err
    assert "geom1 = 'a b'" in said and "; 'a' is none" in said


def test_margins_that_are_overridden_are_refused(capfd):
    """They bring the engine's own contact back, beside the law's."""
    spec, _ = ball_on_floor(steel_pair())
    model = spec.compile()
    model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_OVERRIDE)
    with pytest.raises(mujoco.FatalError, match="init failed"):
        mujoco.MjData(model)
    assert "override must be off" in capfd.readouterr().err


def test_a_geom_of_another_spec_is_refused():
    spec, other = shapes_spec(), shapes_spec()
    with pytest.raises(ValueError, match="must be a geom of this model"):
        add_contact(spec, other.geom("ball"), "floor", steel_pair())


def test_a_height_field_on_a_plane_is_refused_by_name():
    spec = mujoco.MjSpec.from_string("""<mujoco><asset><hfield name="hills" nrow="3" ncol="3" size="1 1 .1 .1"/></asset>
      <worldbody><geom name="ground" type="hfield" hfield="hills"/>
      <body pos="0 0 1" mocap="true"><geom name="table" type="plane" size="1 1 1"/></body></worldbody></mujoco>""")
    with pytest.raises(ValueError, match="plane 'table' on hfield 'ground': planes and height fields do not touch"):
        add_contact(spec, "table", "ground", steel_pair(radius=0.02))


HILLS = """<mujoco><option timestep="2e-3"/><asset><hfield name="hills" nrow="4" ncol="5" size="1 .8 .3 .1"
  elevation="0 1 2 3 4 0 1 2 3 4 0 1 2 3 4 0 1 2 3 4"/></asset><worldbody>
  <geom name="ground" type="hfield" hfield="hills" pos="0 0 -.15" euler="0 0 {yaw}"/>
  <body pos="0 0 .1"><freejoint/><geom name="ball" size=".02" density="2000"/></body>
  <body pos=".2 .2 .2"><freejoint/><geom name="box" type="box" size=".03 .02 .02"/></body></worldbody></mujoco>"""


@pytest.mark.parametrize("yaw", [0, 90])
def test_a_height_field_is_where_mujoco_has_it(yaw):
    """Heights that rise along x make a slope of 0.15: bodies slide down it as on MuJoCo's plane of that slope."""
    pair = steel_pair(friction=0.0, restitution=0.01)
    model, data = with_data(load_model(HILLS.format(yaw=yaw), [(["ball", "box"], "ground", pair)]))
    mujoco.mj_step(model, data, 300)
    down = np.array([-1.0, 0.0, -0.15]) if yaw == 0 else np.array([0.0, -1.0, -0.15])
    before = data.qvel[:3].copy()
    mujoco.mj_step(model, data, 100)
    gained = 9.81 * 0.15 / (1.0 + 0.15**2) * 0.2  # g sin(slope), of which the way along is 1/sqrt(1 + slope^2)
    assert data.qvel[:3] - before == pytest.approx(gained * down, rel=1e-6, abs=1e-9)
    turned = data.geom("ground").xmat.reshape(3, 3).T
    for name, depth in (("ball", 0.02), ("box", 0.02)):
        place = turned @ (data.geom(name).xpos - data.geom("ground").xpos)
        height = (place[2] - 0.15 - 0.15 * place[0]) / np.sqrt(1.0 + 0.15**2)
        assert height == pytest.approx(depth, abs=2e-6)
