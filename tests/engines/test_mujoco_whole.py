"""The law for every contact that a model makes by itself: which these are, who has them, and that the model runs."""

import re
import warnings

import numpy as np
import pytest
from mujoco_scenes import BALL, mujoco, steel_pair, with_data

from contactlaw import MATERIALS, ContactPair, ContactWarning
from contactlaw.mujoco_plugin import contacts_of, instances_of, ledger_of, load_model, model_xml, overlaps_of

STEEL, RUBBER = MATERIALS["steel"], MATERIALS["rubber"]
SOFT, HARD = ContactPair(STEEL, STEEL, 0.8, 0.5), steel_pair()
# All lie in each other: whatever may touch does.
HEAP = """<mujoco><option timestep="1e-9"/><worldbody>
<geom name="floor" type="plane" size="1 1 1"/><geom name="table" size=".1"/>
<body name="free"><freejoint/><geom name="ball" size=".1"/><geom name="twin" size=".09"/></body>
<body name="bits"><freejoint/><geom name="only sends" size=".08" contype="2" conaffinity="0"/></body>
<body name="takes"><freejoint/><geom name="takes" size=".07" contype="0" conaffinity="2"/></body>
<body name="seen"><freejoint/><geom name="seen" size=".07" contype="0" conaffinity="0"/></body>
<body name="hidden"><freejoint/><geom name="hidden" size=".06" contype="0" conaffinity="0"/></body>
<body name="base"><geom name="base" size=".11"/><body name="arm"><joint axis="1 0 0"/><geom name="arm" size=".12"/>
<body name="plate"><geom name="plate" size=".13"/></body>
<body name="hand" pos=".001 0 0"><joint axis="0 1 0"/><geom name="hand" type="capsule" size=".05 .05"/>
<body name="finger"><joint axis="1 0 0"/><geom name="finger" size=".04"/></body></body></body></body>
<body name="pedal" mocap="true"><geom name="pedal" size=".05"/></body>
</worldbody><contact><exclude body1="free" body2="hand"/><pair geom1="hidden" geom2="floor" friction=".1 .1 .1 .1 .1"/>
<pair geom1="arm" geom2="hand"/></contact></mujoco>"""


def native(model):
    """Names of all two geoms that the engine has in contact."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return {frozenset((model.geom(a).name, model.geom(b).name)) for a, b in data.contact.geom}


def by_law(model, name=None):
    """Names of all two geoms that the law has in contact, of one instance or all."""
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data)
    found = contacts_of(model, data, name)
    pairs = {frozenset((model.geom(contact.geom1).name, model.geom(contact.geom2).name)) for contact in found}
    assert name or pairs == {
        frozenset((model.geom(a).name, model.geom(b).name)) for a, b, _ in overlaps_of(model, data)
    }, "what is counted beside the world is what it does"
    return pairs


@pytest.fixture(autouse=True)
def quiet():
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", ".*(overlap over|geoms lie|at an edge)")
        yield


@pytest.mark.parametrize("flag", ["", '<option><flag filterparent="disable"/></option>'])
def test_every_contact_that_the_engine_would_make_is_the_laws(flag):
    scene = HEAP.replace("<worldbody>", f"{flag}<worldbody>", 1)
    expected = native(mujoco.MjModel.from_xml_string(scene))
    assert len(expected) > 25 and {frozenset(("arm", "hand")), frozenset(("hidden", "floor"))} <= expected
    model = load_model(scene, [("*", "*", SOFT)])
    assert native(model) == set()
    assert by_law(model) == expected
    again = mujoco.MjModel.from_xml_string(model_xml(scene, [("*", "*", SOFT)]))
    assert native(again) == set() and by_law(again) == expected


def test_what_it_does_not_serve_stays_the_engines_and_is_said():
    scene = HEAP.replace("<worldbody>", """<extension><plugin plugin="mujoco.sdf.torus"><instance name="t"/></plugin>
      </extension><asset><mesh name="torus"><plugin instance="t"/></mesh></asset><worldbody>
      <geom name="ring" type="sdf" mesh="torus" pos=".2 0 0"><plugin instance="t"/></geom>
      <body name="crate" pos=".105 .001 0"><freejoint/><geom name="crate" type="mesh" mesh="m"/></body>""", 1).replace(
        "<asset>", '<asset><mesh name="m" vertex="0 0 -.1 .1 0 -.1 0 .1 -.1 0 0 .1"/>'
    )  # fmt: skip
    expected = native(mujoco.MjModel.from_xml_string(scene))
    with pytest.warns(ContactWarning, match=r"does not serve .*sdf 'ring'.*keep the engine's own contact"):
        model = load_model(scene, [("*", "*", SOFT)])
    left, taken = native(model), by_law(model)
    assert left and taken and not left & taken
    assert all("ring" in pair for pair in left if "crate" not in pair)
    assert {pair for pair in expected if "ring" in pair} <= left
    assert taken == expected - left and left <= expected


def test_the_entry_with_fewer_stars_has_a_pair_and_of_two_alike_the_later_one():
    contacts = [("hand", "table", HARD), ("ba*", "*", HARD), ("*", "*", SOFT), (["arm", "ball"], "*", SOFT)]
    model = load_model(HEAP, contacts)
    every = {}
    for name in instances_of(model):
        for pair in by_law(model, name):
            assert pair not in every, "each pair belongs to one instance"
            every[pair] = name
    assert set(every) == native(mujoco.MjModel.from_xml_string(HEAP))
    owners = {"hand table": 3, "base ball": 2, "base twin": 1, "arm table": 2, "twin table": 0, "arm hand": 2}
    names = instances_of(model)
    assert {pair: names.index(every[frozenset(pair.split())]) for pair in owners} == owners


def test_skip_leaves_geoms_and_pairs_to_the_engine():
    expected = native(mujoco.MjModel.from_xml_string(HEAP))
    model = load_model(HEAP, [("*", "*", SOFT)], skip=["takes", ("ta*", "ball")])
    kept = {pair for pair in expected if "takes" in pair or pair == {"table", "ball"}}
    assert len(kept) > 1 and native(model) == kept and by_law(model) == expected - kept
    with pytest.raises(ValueError, match=r"skip = 'takes': must be a sequence, such as \['shin"):
        load_model(HEAP, [("*", "*", SOFT)], skip="takes")
    with pytest.raises(ValueError, match="skip = 'tales': is the name of no geom"):
        load_model(HEAP, [("*", "*", SOFT)], skip=["tales"])


def test_others_false_leaves_nothing_to_the_engine():
    model = load_model(HEAP, [("table", "*", SOFT)], others=False)
    assert native(model) == {pair for pair in native(mujoco.MjModel.from_xml_string(HEAP)) if "table" not in pair}
    assert all("table" in pair for pair in by_law(model))


def test_geoms_of_condim_1_have_no_friction_where_natively_they_have_none():
    """By the condim of the greater priority, or the greater condim; the coefficient is then the greater one of both."""
    for floor, ball, priority, due in ((1, 1, 0, 0.0), (1, 3, 0, 0.2), (3, 1, 0, 0.2), (1, 3, 1, 0.0), (3, 1, 1, 0.2)):
        scene = f"""<mujoco><worldbody>
          <geom type="plane" size="1 1 1" friction=".2" condim="{floor}" priority="{priority}"/>
          <body pos="0 0 .1"><freejoint/><geom size=".1" friction=".1" condim="{ball}"/></body></worldbody></mujoco>"""
        model, data = with_data(load_model(scene, {"*": RUBBER}, restitution=0.5))
        data.qvel[0] = 6.0
        mujoco.mj_step(model, data, 100)
        before = data.qvel[0]
        mujoco.mj_step(model, data, 50)
        assert round((before - data.qvel[0]) / (0.1 * 9.81), 3) == due


def test_a_table_of_materials_and_frictions():
    scene = HEAP.replace('name="ball"', 'name="ball" friction=".3"').replace(
        'geom name="arm"', 'geom name="arm" priority="1"'
    )
    model = load_model(scene, {"*": STEEL, "ba*": RUBBER}, restitution=0.9)
    expected = native(mujoco.MjModel.from_xml_string(scene))
    assert by_law(model) == expected
    assert len(instances_of(model)) == 3, "frictions are the geoms', within each two materials"
    few = load_model(scene, {"*": STEEL, "ba*": RUBBER}, friction=lambda a, b: 0.1 + (a is b), restitution=0.9)
    assert by_law(few) == expected and len(instances_of(few)) == 3
    with pytest.raises(ValueError, match=r"contacts\['ba\*'\] = 3: must be a contactlaw.Material"):
        load_model(scene, {"ba*": 3})
    assert by_law(load_model(scene, {"*": "steel", "ba*": "rubber"})) == expected
    with pytest.raises(ValueError, match=r"contacts = \{\}: must be .*, not empty"):
        load_model(scene, {})
    with pytest.warns(ContactWarning, match="no two geoms that touch natively are in one of them"):
        assert instances_of(load_model(scene, {"ball": RUBBER})) == []
    with pytest.warns(ContactWarning, match="nothing is added"):  # as the law has them already
        load_model(model_xml(BALL, [("*", "*", SOFT)]), [("*", "*", HARD)])


def test_what_a_list_of_contacts_does_not_have_is_no_setting_of_it():
    for name in ("friction", "restitution"):
        with pytest.raises(ValueError, match=f"{name} = 0.3: is of a table of materials"):
            load_model(HEAP, [("*", "*", SOFT)], **{name: 0.3})
    with pytest.raises(ValueError, match=r"contacts\[0\] = .*: must be .* and maybe a dict of settings"):
        load_model(HEAP, [("*", "*", SOFT, None)])


def test_what_is_read_of_no_instance_is_an_error():
    """MuJoCo looks a name that is None up, which ended the process; a model without the law has the same signature."""
    model, plain = load_model(HEAP, [("*", "*", SOFT)]), mujoco.MjModel.from_xml_string(HEAP)
    for name in (None, 0, "", "none"):
        with pytest.raises(ValueError, match=f"name = {name!r}: must be .* plugin instance .*there are contactlaw"):
            (ledger_of if name is None else contacts_of)(model, mujoco.MjData(model), name)
    assert contacts_of(plain, mujoco.MjData(plain)) == [], "without a name: all there are"
    with pytest.raises(ValueError, match="data: is of another model"):
        contacts_of(model, mujoco.MjData(plain), instances_of(model)[0])


def test_a_ball_bounces_by_its_own_entry():
    scene = """<mujoco><option gravity="0 0 0"/><worldbody><geom name="floor" type="plane" size="1 1 1"/>
    <body pos="0 0 .03"><freejoint/><geom name="one" size=".025" density="7833"/></body>
    <body pos="1 0 .03"><freejoint/><geom name="two" size=".025" density="7833"/></body></worldbody></mujoco>"""
    model, data = with_data(load_model(scene, [("two", "*", steel_pair(restitution=0.6)), ("*", "*", HARD)]))
    data.qvel[[2, 8]] = -1.0
    mujoco.mj_step(model, data, 10)
    assert data.qvel[[2, 8]] == pytest.approx([0.93, 0.6], abs=1e-3)


def test_large_models_stay_small():
    """A thousand balls: half a million pairs, none of which is written down."""
    balls = "".join(
        f'<body pos="{i % 10} {i // 10 % 10} {i // 100 + 1}"><freejoint/><geom size=".1"/></body>' for i in range(1000)
    )
    scene = f'<mujoco><worldbody><geom type="plane" size="1 1 1"/>{balls}</worldbody></mujoco>'
    model = load_model(scene, [("*", "*", SOFT)])
    assert model.npair == 0 and model.npluginattr < 100_000
    mujoco.mj_step(model, mujoco.MjData(model))


START = """<mujoco><worldbody><geom name="floor" type="plane" size="1 1 1"/>
<body name="leg" pos="0 0 .3"><joint name="slide" type="slide" axis="0 0 1"/><joint name="hip" axis="0 1 0"/>
<geom name="leg" type="capsule" fromto="0 0 0 0 0 -.35" size=".03"/></body>
<body pos="1 0 .08"><freejoint/><geom name="one" size=".1"/></body>
<body pos="1.15 0 .1"><freejoint/><geom name="two" size=".1"/></body></worldbody></mujoco>"""


def test_overlaps_at_the_start_are_said_with_their_geoms():
    text = "'leg' by 80 mm, 'one' and 'two' by 48.7 mm, 'floor' and 'one' by 20 mm"
    with pytest.warns(ContactWarning, match=text):
        model = load_model(START, [("*", "*", SOFT)])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        mujoco.mj_step(model, mujoco.MjData(model))
    with pytest.raises(ValueError, match=f"overlaps = 'raise': .*{text}"):
        load_model(START, [("*", "*", SOFT)], overlaps="raise")
    with warnings.catch_warnings():
        warnings.filterwarnings("error", "geoms lie")
        load_model(START, [("*", "*", SOFT)], overlaps="keep")
    with pytest.raises(ValueError, match=r"overlaps = 'kep': must be one of .*did you mean 'keep'"):
        load_model(START, [("*", "*", SOFT)], overlaps="kep")


HULLS = """<mujoco><option timestep=".002" gravity="0 0 0"/><asset>
<mesh name="palm" vertex="-.1 -.1 -.1 .1 -.1 -.1 -.1 .1 -.1 .1 .1 -.1 -.1 -.1 .1 .1 -.1 .1 -.1 .1 .1 .1 .1 .1"/>
<mesh name="finger" vertex="-.03 -.01 -.01 .03 -.01 -.02 -.03 .02 -.01 .03 .01 -.01 -.03 -.01 .02 .04 -.01 .01 -.03 .01 .01"/>
</asset><worldbody><body name="palm"><geom name="palm" type="mesh" mesh="palm"/></body>
<body name="finger"><joint type="slide" axis="1 0 0"/><joint axis="1 0 0"/>
<geom name="finger" type="mesh" mesh="finger" mass=".1"/></body></worldbody></mujoco>"""  # noqa: E501


def test_of_all_data_of_a_model_the_first_tells_what_is_doubtful():
    """Each told it, with the time, so that a batch repeated it; and it told of 3e11 radii, where there is no depth."""
    with pytest.warns(ContactWarning, match="geoms overlap"):
        model = load_model(HULLS, [("*", "*", SOFT)])
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        for time in range(5):
            data = mujoco.MjData(model)
            data.time = time
            mujoco.mj_step(model, data, 3)
    assert [str(one.message) for one in said] == [
        "'finger' of body 'finger' on 'palm' of body 'palm' at 0.002 s: so deep in each other that no normal is "
        "unique: they pass through each other until they have parted"
    ]
    with pytest.warns(ContactWarning, match="geoms overlap"):
        again = load_model(HULLS, [("*", "*", SOFT)])
    with pytest.warns(ContactWarning, match="pass through each other"):
        mujoco.mj_step(again, mujoco.MjData(again))


def test_hulls_that_reach_into_each_others_cores_leave_each_other_alone_until_they_have_parted():
    """A finger turns and slides out of its palm as if that were not there, and bounces off it when it comes back."""
    with pytest.warns(ContactWarning, match="geoms overlap"):
        model = load_model(HULLS, [("*", "*", SOFT)])
    data = mujoco.MjData(model)
    data.qvel[:] = 0.2, 1.0
    start = data.qvel.copy()
    for _ in range(400):
        mujoco.mj_step(model, data)
        assert np.abs(data.qvel - start).max() < 1e-12
    assert data.qpos[0] > 0.15 and overlaps_of(model, data) == []
    data.qvel[:] = -0.2, 0.0
    mujoco.mj_step(model, data, 400)
    assert data.qvel[0] > 0.05


@pytest.mark.parametrize("root", ["", '<joint type="slide" axis="0 1 0" armature="1"/>'])
def test_hulls_of_a_mechanism_that_cross_leave_each_other_alone_until_they_have_parted(root: str):
    """Half of the finger is in its palm, so that their edges cross; it turns and slides out, and then touches."""
    text = HULLS.replace('<body name="palm">', f'<body name="palm">{root}').replace(
        'mesh="palm"/>', 'mesh="palm" mass="1"/>'
    )
    text = text.replace('<body name="finger">', '<body name="finger" pos=".1 0 0">')
    model = load_model(text, [("*", "*", SOFT)])
    data = mujoco.MjData(model)
    data.qvel[-2:] = 0.2, 1.0
    start = data.qvel.copy()
    for _ in range(200):
        mujoco.mj_step(model, data)
        assert np.abs(data.qvel - start).max() < 1e-12
        assert not any(c.touching for c in contacts_of(model, data))
    assert overlaps_of(model, data) == []
    data.qvel[-2:] = -0.2, 0.0
    mujoco.mj_step(model, data, 400)
    assert data.qvel[-2] > 0.05


BUILT_IN = """<mujoco><option timestep=".002"><flag energy="enable"/></option><worldbody>
<geom name="table" type="box" size=".3 .3 .05" pos="0 0 -.05"/>
<body name="peg" pos="0 0 .01"><freejoint/><geom name="peg" type="box" size=".02 .02 .03"/></body>
<body name="ball" pos=".2 0 .01"><freejoint/><geom name="ball" size=".02"/></body></worldbody></mujoco>"""


def test_what_is_built_into_each_other_stands_as_deep_as_it_is():
    """A peg 20 mm and a ball 10 mm in a table: both stay there without a motion, and gain nothing; as given, they are
    thrown out."""
    with pytest.warns(ContactWarning, match="'table' and 'peg' by 20 mm"):
        model = load_model(BUILT_IN, [("*", "*", SOFT)])
    data = mujoco.MjData(model)
    start = data.qpos.copy()
    for _ in range(5):
        mujoco.mj_step(model, data, 100)
        assert np.abs(data.qpos[[2, 9]] - start[[2, 9]]).max() < 2e-4, "pressed in by their weights alone"
        assert np.abs(data.qvel).max() < 1e-3
    given = load_model(BUILT_IN, [("*", "*", SOFT)], overlaps="keep")
    thrown = mujoco.MjData(given)
    mujoco.mj_step(given, thrown, 20)
    assert thrown.qvel[[2, 8]].min() > 1.0


def test_what_leaves_where_it_was_built_in_meets_it_from_then_on():
    """A ball lifted out of the table and let go stands on it; saved and set back, it goes on to the bit."""
    with pytest.warns(ContactWarning):
        model = load_model(BUILT_IN, [("*", "*", SOFT)])
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 10)
    data.qvel[8] = 0.5
    mujoco.mj_step(model, data, 5)
    state = np.zeros(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS))
    mujoco.mj_getState(model, data, state, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    mujoco.mj_step(model, data, 400)
    assert data.qpos[9] == pytest.approx(0.02, abs=2e-4)
    assert data.qpos[2] == pytest.approx(0.01, abs=2e-4), "the peg has not left"
    again = mujoco.MjData(model)
    mujoco.mj_setState(model, again, state, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    mujoco.mj_step(model, again, 400)
    assert np.array_equal(data.qpos, again.qpos)


def test_what_moves_out_of_where_it_was_built_in_is_not_thrown_when_it_is_struck():
    """A ball strikes a peg 20 mm in a table that moves out: cores that overlap and part counted as apart, so that the
    peg began its contact within the impact, all of its depth as if it had just come about."""
    struck = re.sub('(<body name="ball" pos=").2 0 .01', r"\1 0 0 .0601", BUILT_IN)
    with pytest.warns(ContactWarning):
        model = load_model(struck, [("*", "*", ContactPair("steel", "steel", 0.2, 0.9))])
    data = mujoco.MjData(model)
    data.qvel[[2, 8]] = 0.5, -0.5
    for _ in range(20):
        mujoco.mj_step(model, data)
        assert np.abs(data.qvel[[2, 8]]).max() < 1.5  # they met at 1 m/s; it was 6000 m/s


DEEP = """<mujoco><option timestep=".001" gravity="0 0 0" integrator="RK4"/><asset>
<mesh name="cube" vertex="-.03 -.03 -.03 .03 -.03 -.03 .03 .03 -.03 -.03 .03 -.03 -.03 -.03 .03 .03 -.03 .03"/></asset>
<worldbody><body><freejoint/><geom {}/></body>
<body name="two" pos=".01 .005 -.005"><freejoint/><geom {}/></body></worldbody></mujoco>"""
ELLIPSOID, CYLINDER = 'type="ellipsoid" size=".03 .02 .04"', 'type="cylinder" size=".03 .02"'
BOX, CUBE = 'type="box" size=".03 .04 .02"', 'type="mesh" mesh="cube"'


@pytest.mark.filterwarnings("ignore::contactlaw.pair.ContactWarning")
@pytest.mark.parametrize(
    ("one", "two"), [(ELLIPSOID, BOX), (ELLIPSOID, CUBE), (ELLIPSOID, CYLINDER), (CYLINDER, CYLINDER)]
)
def test_what_is_deep_in_each_other_gains_nothing(one, two):
    """Two bodies turned at random, their middles 12 mm apart, come out of each other with no more than they had."""
    model = load_model(DEEP.format(one, two), [("*", "*", ContactPair("steel", "steel", 0.5, 0.3))])
    for seed in range(6):
        rng, data = np.random.default_rng(seed), mujoco.MjData(model)
        data.qpos[[3, 4, 5, 6, 10, 11, 12, 13]] = rng.normal(size=8)
        mujoco.mj_normalizeQuat(model, data.qpos)
        data.qvel[:] = rng.normal(size=12) * np.repeat([0.3, 3.0, 0.3, 3.0], 3)
        mujoco.mj_forward(model, data)
        mujoco.mj_energyVel(model, data)
        start = data.energy[1]
        for _ in range(100):
            mujoco.mj_step(model, data)
            mujoco.mj_energyVel(model, data)
            assert data.energy[1] < 1.001 * start, seed


def test_an_ellipsoid_stands_as_deep_in_a_table_as_it_is():
    """Its middle 10 mm below the table's top, where its ball is within; it tips over, and is not thrown out."""
    ball = f'<body name="ball" pos=".2 0 -.01" quat=".3 .5 .1 .7"><freejoint/><geom name="ball" {ELLIPSOID}/></body>'
    with pytest.warns(ContactWarning):
        model = load_model(re.sub('<body name="ball".*</body>', ball, BUILT_IN), [("*", "*", SOFT)])
    data = mujoco.MjData(model)
    for _ in range(500):
        mujoco.mj_step(model, data)
        assert -0.04 < data.qpos[9] < 0.0
    assert np.abs(data.qvel[6:9]).max() < 0.5


PINNED = """<mujoco><option timestep="{step}"><flag energy="enable"/></option><worldbody>
<geom name="palm" type="cylinder" size=".029 .05" zaxis="0 1 0" pos=".004 0 .04"/>
<body pos="0 .01 .0444"><joint type="slide" axis="0 1 0" damping="100" armature="1"/>
<geom type="box" size=".005 .025 .0085" pos="-.005 -.003 .0083" mass=".02"/>
<geom type="box" size=".005 .00675 .0375" pos="0 .01725 .04" mass=".02"/></body></worldbody></mujoco>"""


def test_a_damper_along_what_joints_hold_gives_no_energy():
    """A finger within a palm, its slide across most normals, that jump from face to face as it moves: as given, 20 mm
    deep, it moves with no more than what is stored; with the mass of the touch it had 1e6 J."""
    soft = ContactPair("rubber", "steel", 0.8, 0.5)
    for step in (2e-3, 1e-3, 5e-4):
        model = load_model(PINNED.format(step=step), [("*", "*", soft)], overlaps="keep")
        data, most = mujoco.MjData(model), 0.0
        model.opt.timestep = 1e-6
        mujoco.mj_step(model, data)
        found = contacts_of(model, data)
        stored = 0.4 * sum(c.normal_force * c.overlap for c in found)
        mujoco.mj_resetData(model, data)
        model.opt.timestep = step
        for _ in range(round(0.01 / step)):
            mujoco.mj_step(model, data)
            most = max(most, 0.5 * 1.04 * data.qvel[0] ** 2)
        assert most < stored < 1e4
