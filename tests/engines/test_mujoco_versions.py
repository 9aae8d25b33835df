"""The least that each version of MuJoCo must do: the figures hold for all of them.

Against another version: `PYTHONPATH=FOLDER python -m pytest tests/engines/test_mujoco_versions.py`, where `pip install
--no-deps --target FOLDER mujoco==VERSION` has put it; `.ci/run` does so for some.
"""

import pickle

import numpy as np
import pytest
from mujoco_scenes import mujoco, steel_pair, with_data

from contactlaw import MATERIALS, Body, ContactPair, collide
from contactlaw.mujoco_plugin import contacts_of, layout, ledger_of, load_model, model_xml

BALL = '<body pos="{} 0 .03"><freejoint/><geom name="ball{}" size=".025" density="7833"/></body>'
BALLS = f"""<mujoco><option gravity="0 0 0"/><worldbody><geom name="floor" type="plane" size="1 1 1"/>
{"".join(BALL.format(0.1 * i, i) for i in range(3))}</worldbody></mujoco>"""
PAIR = steel_pair()
CONTACTS = [("ball*", ["ball*", "floor"], PAIR)]
SHELL = """<mujoco><compiler inertiagrouprange="1 1"/><worldbody><geom name="floor" type="plane" size="1 1 1"/>
<body pos="0 0 .1"><freejoint/><geom name="ball" size=".03"/><geom name="core" group="1" size=".01"/></body>
</worldbody></mujoco>"""
LEG = """<mujoco><option timestep=".002"/><worldbody><geom name="floor" type="plane" size="1 1 1"/>
<geom name="wall" type="box" size=".1 .1 .1" pos="2 0 0"/>
<body name="trunk" pos="0 0 .6"><joint type="slide" axis="0 0 1"/><geom name="trunk" size=".05" mass="5"/>
<body name="leg"><joint name="hip" axis="0 1 0" damping=".5" range="-20 20"/>
<geom name="leg" type="capsule" fromto="0 0 0 0 0 -.5" size=".02" mass="1"/></body></body></worldbody>
<actuator><position joint="hip" kp="200" kv="5"/></actuator></mujoco>"""


def thrown(model, steps=8):
    data = mujoco.MjData(model)
    data.qvel[:3], data.qvel[6:9], data.qvel[12:15] = [0.2, 0.0, -1.0], [0.0, 0.1, -2.0], [0.0, 0.0, -0.5]
    mujoco.mj_step(model, data, steps)
    return data


def test_the_structs_are_where_the_description_says():
    layout.check()
    model = mujoco.MjModel.from_xml_string(BALLS)
    view = layout.ModelView(model._address)
    for size in ("nq", "nv", "nbody", "ngeom", "npair", "nplugin", "npluginstate"):
        assert getattr(view, size) == getattr(model, size)


@pytest.mark.parametrize("integrator", ["Euler", "RK4", "implicit", "implicitfast"])
def test_balls_bounce_as_one_impact_does(integrator):
    scene = BALLS.replace("<option", f'<option integrator="{integrator}"')
    if layout.LOSES_SPIN and integrator == "implicitfast":
        with pytest.raises(ValueError, match="loses the spin of impacts"):
            load_model(scene, CONTACTS)
        return
    model = load_model(scene, CONTACTS)
    data = thrown(model)
    impact = collide(PAIR, Body(mass=float(model.body_mass[1]), radius=0.025, velocity=(0.2, 0.0, -1.0)))
    np.testing.assert_allclose(data.qvel[:3], impact.velocity_a, atol=2e-4)
    assert data.qvel[4] == pytest.approx(impact.spin_a[1], rel=2e-3)
    assert data.qvel[8] == pytest.approx(1.86, abs=1e-3)


def test_the_same_from_xml_and_from_a_saved_state():
    model = load_model(BALLS, CONTACTS)
    again = mujoco.MjModel.from_xml_string(model_xml(BALLS, CONTACTS))
    assert np.array_equal(thrown(model).qvel, thrown(again).qvel)
    copy = pickle.loads(pickle.dumps(model))
    assert np.array_equal(thrown(model).qvel, thrown(copy).qvel)
    model.opt.timestep, model.opt.gravity[2] = 1e-5, -9.81
    data, everything = thrown(model, 495), mujoco.mjtState.mjSTATE_INTEGRATION
    assert any(contact.touching for contact in contacts_of(model, data, "contactlaw:ball0..ball2(3):ball0..floor(4)"))
    saved, ends = np.empty(mujoco.mj_stateSize(model, everything)), []
    mujoco.mj_getState(model, data, saved, everything)
    for _ in range(2):
        mujoco.mj_setState(model, data, saved, everything)
        mujoco.mj_step(model, data, 200)
        ends.append(data.qpos.copy())
    assert np.array_equal(*ends)


def test_a_file_refers_to_meshes_in_its_folder(tmp_path):
    scene = BALLS.replace("<option", '<compiler meshdir="parts"/><asset><mesh file="cube.obj"/></asset><option', 1)
    (tmp_path / "parts").mkdir()
    corners = "".join(f"v {x} {y} {z}\n" for x in (0, 1) for y in (0, 1) for z in (0, 1))
    (tmp_path / "parts" / "cube.obj").write_text(f"{corners}f 1 2 3\nf 1 2 5\n")
    (tmp_path / "scene.xml").write_text(scene)
    assert load_model(tmp_path / "scene.xml", CONTACTS).nmesh == 1
    again = mujoco.MjModel.from_xml_string(model_xml(tmp_path / "scene.xml", CONTACTS))
    assert again.mesh_vertnum == 8


@pytest.mark.parametrize("compiler", ['inertiagrouprange="1 1"', 'settotalmass="14"'])
@pytest.mark.filterwarnings("ignore:.*settotalmass")  # deprecated from 4.0 on
def test_what_masses_are_made_of_is_written(compiler):  # MuJoCo up to 3.15 leaves these out
    contacts, scene = [("ball", "floor", PAIR)], SHELL.replace('inertiagrouprange="1 1"', compiler)
    again = mujoco.MjModel.from_xml_string(model_xml(scene, contacts))
    assert again.body_mass == pytest.approx(load_model(scene, contacts).body_mass, rel=1e-12)


def test_a_size_that_a_geom_does_not_use_need_not_be_written():
    scene = SHELL.replace('name="core" group="1" size=".01"', 'name="core" group="1" type="cylinder" size=".01 .01 .5"')
    mujoco.MjModel.from_xml_string(model_xml(scene, [("ball", "floor", PAIR)]))


@pytest.mark.parametrize("integrator", ["Euler", "RK4", "implicitfast"])
def test_a_leg_stands_on_its_foot_and_its_weight_is_on_it(integrator):
    if layout.LOSES_SPIN and integrator == "implicitfast":
        pytest.skip("refused, see above")
    rubber = MATERIALS["rubber"]
    scene = LEG.replace("<option", f'<option integrator="{integrator}"')
    model = load_model(scene, [("leg", "floor", ContactPair(rubber, rubber, friction=0.8, restitution=0.5))])
    data = mujoco.MjData(model)
    data.qpos[0] = -0.0799
    mujoco.mj_step(model, data, 1000)
    [foot] = [contact for contact in contacts_of(model, data, "contactlaw:leg:floor") if contact.touching]
    assert foot.normal_force == pytest.approx(6.0 * 9.81, rel=1e-3)
    assert np.abs(data.qvel).max() < 1e-3 and ledger_of(model, data, "contactlaw:leg:floor").impacts >= 1


def test_a_joint_limit_holds_what_lies_on_it():
    """A beam at its stop, a ball dropped on its end: the engine's limit rows are read within the step."""
    scene = """<mujoco><worldbody><body pos="0 0 1"><joint name="hinge" axis="0 1 0" limited="true" range="0 60"/>
<geom name="beam" type="box" size=".3 .05 .01" pos="-.3 0 0" mass=".5"/></body>
<body pos="-.5 0 1.06"><freejoint/><geom name="ball" size=".025" density="7833"/></body></worldbody></mujoco>"""
    model, data = with_data(load_model(scene, [("ball", "beam", steel_pair(restitution=0.5, radius=0.025))]))
    mujoco.mj_step(model, data, 600)
    assert -0.05 < data.qpos[0] < 0.01, "the beam is at its stop"
    assert data.qpos[3] == pytest.approx(1.035 + 0.5 * np.sin(data.qpos[0]), abs=3e-3), "the ball lies on it"
