"""The law in MuJoCo models that others wrote: files, names, what is refused, and two libraries of environments."""

import warnings
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from mujoco_scenes import bounce_of, mujoco, steel_pair, with_data

from contactlaw import MATERIALS, ContactPair, ContactWarning, Law
from contactlaw.mujoco_plugin import (
    contacts_of,
    geoms_of,
    instances_of,
    ledger_of,
    load_model,
    model_xml,
    overlaps_of,
    save_model,
)

SCENE = """<mujoco><option timestep="1e-5" gravity="0 0 0"/>
<default><geom condim="6" margin="0.01" friction="0.3 0.02 0.01" solref="-1000 -5"/></default>
<worldbody><geom name="floor" type="plane" size="1 1 .1"/><geom type="box" size=".1 .1 .1" pos="0 5 0"/>
<body name="ball" pos="0 0 .0254123456789012"><freejoint/><geom size=".0254" density="7833"/>
<geom name="stripe" type="cylinder" size=".0255 .001" contype="0" conaffinity="0" mass="0"/></body>
<body name="arm" pos="0 2 1"><joint axis="1 0 0"/><geom name="upper" type="capsule" fromto="0 0 0 0 .3 0" size=".02"/>
<body name="lower" pos="0 .3 0"><joint axis="1 0 0"/>
<geom name="lower" type="capsule" fromto="0 0 0 0 .3 0" size=".02"/></body></body></worldbody></mujoco>"""
PAIR = steel_pair()
TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


def floats(model):
    """Every field of a model that says how it moves, but for the pairs and the plugin."""
    names = [name for name in dir(model) if name.startswith(("body_", "geom_", "jnt_", "dof_", "mesh_vert", "qpos"))]
    fields = {name: getattr(model, name) for name in names}
    return {name: field for name, field in fields.items() if isinstance(field, np.ndarray) and field.dtype.kind == "f"}


@pytest.fixture
def folder(tmp_path):
    """A model in pieces: a file that includes one, which has a mesh in a folder of its own."""
    (tmp_path / "model" / "shapes").mkdir(parents=True)
    (tmp_path / "model" / "shapes" / "rock.obj").write_text(TETRAHEDRON)
    (tmp_path / "model" / "rock.xml").write_text(
        '<mujoco><asset><mesh name="rock" file="rock.obj" scale=".1 .1 .1"/></asset><worldbody><body name="rock" '
        'pos="0 3 0"><freejoint/><geom type="mesh" mesh="rock"/></body></worldbody></mujoco>'
    )
    (tmp_path / "model" / "main.xml").write_text(
        SCENE.replace("<default>", '<compiler meshdir="shapes"/><include file="rock.xml"/><default>')
    )
    return tmp_path


def test_a_file_with_includes_and_meshes_is_written_to_another_place_without_a_digit_lost(folder, monkeypatch):
    (folder / "elsewhere").mkdir()
    hard = steel_pair(radius=0.01)
    path = save_model(
        folder / "model" / "main.xml", folder / "elsewhere" / "with_law.xml",
        [("body:ball", "floor", PAIR), ("body:rock", "body:ball", hard)],
    )  # fmt: skip
    monkeypatch.chdir(folder)
    ours = mujoco.MjModel.from_xml_path(str(path))
    theirs = mujoco.MjModel.from_xml_path("model/main.xml")
    one, two = floats(ours), floats(theirs)
    assert len(one) > 40 and [name for name in one if not np.array_equal(one[name], two[name])] == []
    assert instances_of(ours) == ["contactlaw:ball_geom0:floor", "contactlaw:rock_geom0:ball_geom0"]
    assert instances_of(theirs) == []


def test_a_ball_bounces_by_the_law_whichever_way_it_got_there(folder):
    contacts = [("body:ball", "floor", PAIR)]
    (folder / "scene.xml").write_text(SCENE)
    models = [
        load_model(SCENE, contacts), load_model(SCENE.encode(), contacts), load_model(folder / "scene.xml", contacts),
        load_model(str(folder / "scene.xml"), contacts), mujoco.MjModel.from_xml_string(model_xml(SCENE, contacts)),
    ]  # fmt: skip
    bounces = [bounce_of(model) for model in models]
    assert bounces[0] == pytest.approx(0.93, abs=1e-3)  # the restitution, at some ten steps in the contact
    assert set(bounces) == {bounces[0]}


def test_sensors_without_a_name_do_not_keep_contacts_from_a_file():
    """MuJoCo writes no instance of a plugin that comes after one without a name, or after those of another plugin."""
    plugin = '<plugin plugin="contactlaw.contact"'
    sensor = f'{plugin} objtype="body" objname="ball"/>'
    grid = """<plugin plugin="mujoco.sensor.touch_grid" objtype="site" objname="site"><config key="size" value="2 2"/>
      <config key="fov" value="9 9"/><config key="gamma" value="0"/><config key="nchannel" value="1"/></plugin>"""
    extension = f'<extension><plugin plugin="mujoco.sensor.touch_grid"/>{plugin}/></extension>'
    scene = SCENE.replace("<default>", f"{extension}<default>").replace("<worldbody>", '<worldbody><site name="site"/>')
    scene = scene.replace("</mujoco>", f"<sensor>{sensor}{grid}{sensor}</sensor></mujoco>")
    for model in (scene, model_xml(scene, [("body:ball", "floor", PAIR)])):
        model = mujoco.MjModel.from_xml_string(model_xml(model, [("upper", "floor", PAIR)]))
    assert instances_of(model) == ["contactlaw:ball_geom0:floor", "contactlaw:upper:floor"]
    assert bounce_of(model) == pytest.approx(0.93, abs=1e-3) and model.nsensor == 3


@pytest.mark.parametrize("integrator", ["Euler", "RK4", "implicit", "implicitfast"])
@pytest.mark.parametrize("cone", ["pyramidal", "elliptic"])
def test_neither_integrator_nor_cone_matter(integrator, cone):
    scene = SCENE.replace("<option", f'<option integrator="{integrator}" cone="{cone}"')
    assert bounce_of(load_model(scene, [("body:ball", "floor", PAIR)])) == pytest.approx(0.93, abs=1e-3)


def test_a_pair_and_an_exclusion_of_the_model_make_way():
    for own in ('<pair geom1="floor" geom2="upper" condim="1"/>', '<exclude body1="world" body2="arm"/>'):
        scene = SCENE.replace("</mujoco>", f"<contact>{own}</contact></mujoco>")
        model = load_model(scene, [("upper", "floor", PAIR)])
        assert model.npair == 1 and model.pair_margin[0] < 0.0


def chosen(what):
    spec = mujoco.MjSpec.from_string(SCENE)
    spec.compile()
    return [geom.id for geom in geoms_of(spec, what)]


def test_geoms_are_chosen_by_name_pattern_body_and_id():
    assert chosen("floor") == [0]
    assert chosen("stripe") == [3], "by its own name a geom that touches nothing is had"
    assert chosen("body:ball") == [2], "a body means what can touch"
    assert chosen("*er") == [4, 5]
    assert chosen("body:*") == [2, 4, 5], "all but the world"
    assert chosen("body:world") == [0, 1]
    assert chosen(["lower", 1, "*er", np.int64(1)]) == [5, 1, 4]
    spec = mujoco.MjSpec.from_string(SCENE)
    assert [geom.name for geom in geoms_of(spec, spec.geoms[0], "upper")] == ["floor", "upper"]


@pytest.mark.parametrize(
    ("geoms", "message"),
    [
        ("flor", r"contacts\[0\], geoms1 = 'flor': is the name of no geom .*did you mean 'floor'"),
        ("uper*", r"geoms1 = 'uper\*': fits the name of no geom .*did you mean 'upper'"),
        (
            "nothing like it",
            r"there are floor, lower, stripe, upper; 2 geoms have no name, say 'body:NAME' or their id",
        ),
        ("body:bal", r"no body of the model has such a name; did you mean 'ball'"),
        ("str*", r"means cylinder 'stripe', and the engine lets none of them touch anything"),
        (17, r"geoms1 = 17: .* id of a geom \(0 to 5\)"),
        (True, r"geoms1 = True: must be a geom's name"),
        (1.5, r"geoms1 = 1.5: must be a geom's name"),
        ([], r"geoms1: holds no geoms"),
    ],
)
def test_a_wrong_choice_of_geoms_is_told_with_the_nearest_names(geoms, message):
    with pytest.raises(ValueError, match=message):
        load_model(SCENE, [(geoms, "floor", PAIR)])


TORUS = """<mujoco><extension><plugin plugin="mujoco.sdf.torus"><instance name="t"/></plugin></extension>
<asset><mesh name="torus"><plugin instance="t"/></mesh></asset><worldbody>
<geom name="ring" type="sdf" mesh="torus"><plugin instance="t"/></geom>
<body name="b c" pos="0 0 1"><freejoint/><geom name="my ball" size=".1"/>
<geom name="other" size=".1"/></body></worldbody></mujoco>"""
STILL = """<mujoco><worldbody><geom name="floor" type="plane" size="1 1 1"/><body pos="0 0 2">
<geom name="still" size=".1"/></body></worldbody></mujoco>"""
OPTION = '<option timestep="1e-5" gravity="0 0 0"/>'


@pytest.mark.parametrize(
    ("scene", "contact", "settings", "message"),
    [
        (SCENE, ("floor", "floor", PAIR), {}, r"contacts\[0\]: .*another geom"),
        (SCENE, (["upper", "lower"], ["lower", "floor"], PAIR), {}, "capsule 'upper' and capsule 'lower' belong to"),
        (SCENE, ("upper", "floor"), {}, r"contacts\[0\] = .* must be \(geoms1, geoms2, pair\)"),
        (SCENE, ("upper", "floor", "steel"), {}, r"contacts\[0\] = .* pair a contactlaw.ContactPair"),
        (SCENE, ("upper", "floor", PAIR), {"substeps": 1}, "substeps = 1"),
        (SCENE, ("upper", "floor", PAIR), {"substep": 20}, "setting = 'substep': must be .*did you mean 'substeps'"),
        (SCENE, ("upper", "floor", PAIR), {"others": "no"}, "others = 'no': must be True or False"),
        (SCENE, ("upper", "floor", PAIR), {"as_native": 0}, "as_native = 0: must be True or False"),
        (STILL, ("floor", "still", steel_pair(radius=1.0)), {}, "'floor', 'still': none of these geoms can move"),
        (TORUS, ("other", "ring", PAIR), {}, "sdf .ring.: MuJoCo computes no reliable distance"),
        (TORUS, (["my ball", "other"], "ring", PAIR), {}, "sdf .ring.: MuJoCo computes no reliable distance"),
        (SCENE.replace(OPTION, '<compiler discardvisual="true"/>'), ("upper", "floor", PAIR), {"others": False},
         "others = False: .*discardvisual"),
        (SCENE.replace(OPTION, '<option><flag spring="disable" damper="disable"/></option>'), ("upper", "floor", PAIR),
         {}, "spring"),
        ("nowhere.xml", ("upper", "floor", PAIR), {}, "model = 'nowhere.xml': no such file"),
        (3, ("upper", "floor", PAIR), {}, "model = 3: must be the path"),
        (mujoco.MjSpec(), ("upper", "floor", PAIR), {}, "for an MjSpec there is add_contact"),
        ("<mujoco><wordbody/></mujoco>", ("upper", "floor", PAIR), {}, "wordbody"),
    ],
)  # fmt: skip
def test_what_the_law_cannot_serve_is_refused(scene, contact, settings, message):
    with pytest.raises(ValueError, match=message):
        load_model(scene, [contact], **settings)


@pytest.mark.parametrize("policy", ["auto", "init"])
def test_sleep_of_the_engine_is_turned_off_in_the_first_step(policy):
    """A ball falls on one that lies on the floor, as in a model without that flag."""
    scene = f"""<mujoco><option timestep=".002">{{}}</option><worldbody><geom type="plane" size="1 1 1"/>
        <body pos="0 0 .1" sleep="{policy}"><freejoint/><geom size=".1"/></body>
        <body pos=".01 0 1"><freejoint/><geom size=".1"/></body></worldbody></mujoco>"""
    (plain, one), (model, two) = (
        with_data(load_model(scene.format(flag), [("*", "*", PAIR)])) for flag in ("", '<flag sleep="enable"/>')
    )
    mujoco.mj_step(plain, one, 400)
    with pytest.warns(ContactWarning, match="sleep is turned off") as told:
        mujoco.mj_step(model, two, 400)
    assert len(told) == 1 and model.opt.enableflags == 0
    assert (one.qpos == two.qpos).all() and one.qvel[0] < 0.0


def test_what_the_engine_says_of_attached_models_is_said_once(tmp_path):
    child = SCENE.replace('timestep="1e-5"', 'timestep="1e-3"')
    (tmp_path / "child.xml").write_text(child)
    (tmp_path / "main.xml").write_text(
        """<mujoco><option timestep="2e-3"/><asset><model name="child" file="child.xml"/></asset><worldbody>
        <geom name="ground" type="plane" size="1 1 1"/><attach model="child" body="ball" prefix="its_"/>
        </worldbody></mujoco>"""
    )
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        load_model(tmp_path / "main.xml", [("ground", "body:its_ball", PAIR)])
    assert len([one for one in told if "Attach conflict" in str(one.message)]) == 1


def test_a_law_without_a_name_is_refused_as_no_configuration_can_tell_of_it():
    @dataclass(frozen=True)
    class Nameless(Law):
        source = "none"

        @staticmethod
        def force(contact, law, memory, du, dv, dt):
            return 0.0, 0.0

    with pytest.raises(ValueError, match=r"pair: its law .*Nameless.* must have a name"):
        load_model(SCENE, [("upper", "floor", replace(PAIR, law=Nameless()))])


def test_geoms_that_can_meet_nothing_by_the_law_are_left_to_the_engine():
    free = '<geom type="plane" size="1 1 1"/><body><freejoint/><geom name="ring"'
    scene = TORUS.replace("<freejoint/>", "").replace('<geom name="ring"', free).replace("</geom>", "</geom></body>")
    with pytest.warns(ContactWarning, match="does not serve"), pytest.warns(ContactWarning, match="nothing is added"):
        assert not instances_of(load_model(scene, [("*", "*", PAIR)]))


def test_the_same_two_cannot_be_had_twice():
    with pytest.raises(ValueError, match=r"'upper'.*'floor'.*added before"):
        load_model(SCENE, [("upper", "floor", PAIR), (["upper", "lower"], "floor", PAIR)])


@pytest.mark.parametrize("contacts", [[], "ball", None])
def test_contacts_must_be_a_list_of_them(contacts):
    with pytest.raises(ValueError, match="contacts = "):
        load_model(SCENE, contacts)


def test_a_model_is_not_written_over(folder):
    path = folder / "model" / "main.xml"
    before = path.read_text()
    with pytest.raises(ValueError, match="must be another file"):
        save_model(path, path, [("body:ball", "floor", PAIR)])
    assert path.read_text() == before


def test_neighbours_in_a_chain_may_touch_if_just_these_two_are_asked_for():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ContactWarning)  # they overlap at their joint
        assert len(instances_of(load_model(SCENE, [("upper", "lower", steel_pair(radius=0.01))]))) == 1


def test_settings_are_of_all_contacts_or_of_one():
    contacts = [("body:ball", "floor", PAIR), (["upper", "lower"], "floor", PAIR, {"substeps": 9})]
    with pytest.raises(ValueError, match=r"contacts\[1\]: substeps = 9"):
        load_model(SCENE, contacts)
    model = load_model(SCENE, contacts[:1] + [(*contacts[1][:3], {"substeps": 50})], substeps=200)
    ball, arm = instances_of(model)
    data = mujoco.MjData(model)
    assert ledger_of(model, data, ball).impacts == 0 and contacts_of(model, data, arm) == []


def test_what_a_model_repeats_can_be_named():
    scene = SCENE.replace('<body name="ball"', '<replicate count="3" offset="1 0 0"><body name="ball"')
    scene = scene.replace('<body name="arm"', '</replicate><body name="arm"')
    model = mujoco.MjModel.from_xml_string(model_xml(scene, [("body:ball*", "floor", PAIR)]))
    assert model.npair == 3
    data = mujoco.MjData(model)
    data.qvel[[2, 8, 14]] = -1.0
    mujoco.mj_step(model, data, 300)
    assert data.qvel[[2, 8, 14]] == pytest.approx(0.93, abs=1e-3)


def test_overlaps_are_seen_that_the_engine_does_not_tell():
    model, data = with_data(load_model(SCENE, [("body:ball", "floor", PAIR)]))
    mujoco.mj_forward(model, data)
    assert overlaps_of(model, data) == []
    data.qpos[2] = 0.0254 - 1e-4
    mujoco.mj_forward(model, data)
    ball, floor = model.geom("ball_geom0").id, model.geom("floor").id
    [(one, two, depth)] = overlaps_of(model, data)
    assert data.ncon == 0 and {one, two} == {ball, floor} and depth == pytest.approx(1e-4, rel=1e-9)


def test_pusher_of_gymnasium():
    pytest.importorskip("gymnasium.envs.mujoco.mujoco_env")
    pytest.importorskip("imageio")
    from sims import gymnasium_example

    hits = gymnasium_example.check()
    assert set(hits) == {"engine", "law"}


def test_parts_that_start_in_each_other_and_part_are_not_thrown():
    """Nor is a slot freed twice, where a pair that has lost its initial overlap touches anew."""
    gymnasium = pytest.importorskip("gymnasium")
    path = Path(gymnasium.__file__).parent / "envs" / "mujoco" / "assets" / "humanoidstandup.xml"
    rubber = ContactPair("rubber", "rubber", friction=0.8, restitution=0.5)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ContactWarning)  # of the initial overlaps
        model = load_model(path, [("*", "*", rubber)])
        data = mujoco.MjData(model)
        for _ in range(150):
            mujoco.mj_step(model, data)
            assert np.abs(data.qvel).max() < 10.0


@pytest.mark.parametrize(
    ("name", "feet"),
    [("Ant-v5", "*_ankle_geom"), ("Walker2d-v5", "foot*"), ("HalfCheetah-v5", "?foot"), ("Hopper-v5", "foot_geom"),
     ("Humanoid-v5", "*_foot")],
)  # fmt: skip
def test_what_walks_in_gymnasium_stands_on_rubber_feet(name, feet, tmp_path):
    """Rubber, as steel feet on legs are too hard for the steps of these environments, 2 to 10 ms: those gain energy."""
    gymnasium = pytest.importorskip("gymnasium")
    pytest.importorskip("imageio")
    sole = ContactPair(MATERIALS["rubber"], MATERIALS["steel"], friction=0.8, restitution=0.5)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # what gymnasium's own files are warned of, and deep overlaps of soft feet
        with gymnasium.make(name) as env:
            file = save_model(env.unwrapped.fullpath, tmp_path / "law.xml", [(feet, "floor", sole)])
        heights, energies = [], []
        for options in ({}, {"xml_file": str(file)}):
            with gymnasium.make(name, **options) as env:
                env.reset(seed=3)
                model, data = env.unwrapped.model, env.unwrapped.data
                model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
                mujoco.mj_forward(model, data)
                start = data.energy.sum()
                for _ in range(60):
                    env.step(np.zeros(env.action_space.shape))
                heights.append(data.subtree_com[0, 2])
                energies.append((start, data.energy.sum()))
    assert heights[1] == pytest.approx(heights[0], abs=0.2), "it neither sank in nor flew off"
    assert abs(energies[1][1] - energies[0][1]) < 0.1 * abs(energies[0][0]) + 5.0


def test_ball_in_cup_of_dm_control():
    pytest.importorskip("dm_control")
    from sims import dm_control_example

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # no display
        assert set(dm_control_example.check()) == {"engine", "law"}


def test_mjcf_of_dm_control_keeps_the_law():
    pytest.importorskip("dm_control")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # no display
        from sims import dm_control_example

        dm_control_example.load(law=False)
        from dm_control import mjcf

        root = mjcf.from_xml_string(model_xml(SCENE, [("body:ball", "floor", PAIR)]))
        physics = mjcf.Physics.from_mjcf_model(root)
    assert bounce_of(physics.model.ptr) == pytest.approx(0.93, abs=1e-3)


def test_no_warning_of_a_contact_that_the_engine_does_not_make_either():
    """Of two planes that nothing moves, one of them a mocap body's."""
    scene = """<mujoco><worldbody><geom name="floor" type="plane" size="1 1 1"/><body mocap="true" pos="1 0 0">
      <geom name="wall" type="plane" size="1 1 1" zaxis="-1 0 0"/></body>
      <body pos="0 0 .2"><freejoint/><geom name="ball" size=".1"/></body></worldbody></mujoco>"""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert instances_of(load_model(scene, [("*", "*", PAIR)]))
