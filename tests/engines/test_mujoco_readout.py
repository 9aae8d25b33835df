"""What a user reads of contacts: wrenches, slip, observations; and what reads the engine's own contacts alone."""

import warnings
import weakref

import numpy as np
import pytest
from mujoco_scenes import BALL, SLED, mujoco, steel_pair

from contactlaw import MATERIALS, ContactPair, ContactWarning
from contactlaw.mujoco_plugin import contact_wrenches, contacts_of, load_model, save_model
from contactlaw.mujoco_plugin.readout import view_of

RUBBER = MATERIALS["rubber"]


def test_wrenches_are_those_that_the_engine_reads_of_its_own_contacts():
    """A sled at rest that is pulled and twisted: what holds it is all that is applied, about its centre of mass."""
    push = np.array([1.0, 0.5, -2.0, 0.1, 0.05, -0.02])  # force, moment
    pair = ContactPair(RUBBER, RUBBER, friction=1.0, restitution=0.5)
    model = load_model(SLED, [("foot*", "floor", pair)])
    found = []
    for m in (mujoco.MjModel.from_xml_string(SLED), model):
        data = mujoco.MjData(m)
        data.xfrc_applied[1] = push
        mujoco.mj_step(m, data, 2000)
        mujoco.mj_subtreeVel(m, data)
        mujoco.mj_rnePostConstraint(m, data)
        found.append(contact_wrenches(m, data) if m is model else data.cfrc_ext - [[0] * 6, [*push[3:], *push[:3]]])
    expected = [*-push[3:], -push[0], -push[1], 2 * 9.81 - push[2]]
    assert found[1].shape == (2, 6) and not found[1][0].any()
    np.testing.assert_allclose(found[1][1], expected, atol=2e-3)
    np.testing.assert_allclose(found[0][1], expected, atol=0.02)  # whose own contact creeps


@pytest.mark.parametrize("integrator", ["Euler", "RK4"])
@pytest.mark.parametrize("resistance", [0.0, 0.05])
def test_the_wrench_on_a_ball_that_rolls_changes_its_spin_as_it_does(resistance, integrator):
    """The moment of rolling resistance was left out, and under Euler the arm was of one step later than the centre."""
    pair = ContactPair(RUBBER, RUBBER, friction=0.5, restitution=0.5, rolling_resistance=resistance)
    scene = BALL.replace("<worldbody>", f'<option integrator="{integrator}"/><worldbody>', 1)
    sensors = '<sensor><frameangacc objtype="geom" objname="ball"/></sensor></mujoco>'
    model = load_model(scene.replace("</mujoco>", sensors), [("ball", "floor", pair)])
    data, (radius, *_), seen = mujoco.MjData(model), model.geom("ball").size, []
    mujoco.mj_step(model, data, 1000)
    data.qvel[0], data.qvel[4] = 1.0, 1.0 / radius
    for _ in range(100):
        before = data.qvel[4]
        mujoco.mj_step(model, data)
        rate = (data.qvel[4] - before) / model.opt.timestep
        moment = contact_wrenches(model, data)[1][1] / model.body_inertia[1, 1]
        seen.append((rate, moment, data.sensordata[1]))
    rate, moment, told = np.mean(seen[20:], axis=0)
    assert rate == pytest.approx(-resistance * 9.81 / (1.4 * radius), rel=0.02, abs=1e-6)  # mu_r g/(1 + K^2), docs
    assert (moment, told) == (pytest.approx(rate, rel=1e-3, abs=1e-6), pytest.approx(rate, rel=1e-3, abs=1e-6))


def test_what_is_read_lives_as_long_as_its_reader():
    """`load_model` read the names of geoms that overlap from an MjData that was gone; robot hands ended the process."""
    model = load_model(BALL, [("ball", "floor", steel_pair())])
    data = mujoco.MjData(model)
    alive, view = weakref.ref(data), view_of(model, data)
    del data
    assert alive() is not None and view.geoms.size == view.shapes.size


def test_slip_is_told():
    pair = ContactPair(RUBBER, RUBBER, friction=0.5, restitution=0.5)
    model = load_model(SLED, [("foot*", "floor", pair)])
    name = "contactlaw:foot0..foot3(4):floor"
    states = []
    for push in (0.0, 0.5, 1.5):
        data = mujoco.MjData(model)
        data.qpos[2] -= 1e-4
        mujoco.mj_step(model, data, 500)
        data.xfrc_applied[1, 0] = push * 0.5 * 2 * 9.81
        mujoco.mj_step(model, data, 100)
        contact = contacts_of(model, data, name)[0]
        states.append(contact.slip)
        assert contact.point[2] == pytest.approx(0.0, abs=1e-3)
        assert contact.contact_radius == pytest.approx(np.sqrt(0.02 * contact.overlap), rel=1e-6)
        share = np.linalg.norm(contact.tangential_force) / (0.5 * contact.normal_force)
        if push < 1.0:
            expected = contact.contact_radius * (1 - share) ** (1 / 3)
            assert contact.stick_radius == pytest.approx(expected, rel=1e-9)
    assert states == ["stuck", "partly", "sliding"]


def test_the_ant_of_gymnasium_has_its_observations_back(tmp_path):
    """Standing on its feet it is lifted by its weight, by the law as by the engine."""
    ant = pytest.importorskip("gymnasium.envs.mujoco.ant_v5")
    pytest.importorskip("imageio")

    class Ant(ant.AntEnv):
        @property
        def contact_forces(self):
            own = self.data.cfrc_ext + contact_wrenches(self.model, self.data)
            return np.clip(own, *self._contact_force_range)

    lifted = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # what gymnasium's own files are warned of, deep overlaps of soft feet
        file = Ant().fullpath
        sole = ContactPair(RUBBER, MATERIALS["steel"], friction=0.8, restitution=0.5)
        ours = save_model(file, tmp_path / "ant.xml", [("*", "*", sole)])
        for xml in (file, str(ours)):
            env = Ant(xml_file=xml, contact_force_range=(-1e3, 1e3), reset_noise_scale=0.0)
            observed = env.reset(seed=1)[0]
            for _ in range(60):
                observed = env.step(np.zeros(8))[0]
            assert observed.shape == (105,) and np.array_equal(observed[27:].reshape(13, 6), env.contact_forces[1:])
            lifted.append(env.contact_forces[:, 5].sum() / (9.81 * env.model.body_subtreemass[0]))
            env.close()
    assert lifted == pytest.approx([1.0, 1.0], abs=0.05)


def test_what_knows_the_contacts_of_the_engine_alone_is_told_of():
    """Adhesion and <contact> sensors, where they are on what touches by the law."""
    if not hasattr(mujoco.mjtSensor, "mjSENS_CONTACT"):
        pytest.skip("this MuJoCo has no such sensor")
    both = """<body name="c" pos="1 0 .025"><freejoint/><geom name="cube" type="box" size=".02 .02 .02"/></body>
    </worldbody><actuator><adhesion name="grip" body="b" ctrlrange="0 1"/>
    <adhesion name="other" body="c" ctrlrange="0 1"/></actuator><sensor>
    <contact name="felt" geom1="ball"/><contact name="under" subtree1="b" body2="world"/><contact name="any"/>
    <contact name="cubes" geom1="cube"/><contact name="far" subtree1="world" geom2="cube"/></sensor>"""
    with pytest.warns(ContactWarning) as told:
        model = load_model(BALL.replace("</worldbody>", both), [("ball", "floor", steel_pair())])
    said = {str(one.message) for one in told}
    assert len(told) == len(said)  # though several mjData are made on the way
    assert {text.split(":")[0] for text in said} == {
        "actuator 'grip'",
        "sensor 'felt'",
        "sensor 'under'",
        "sensor 'any'",
    }
    assert (
        "actuator 'grip': adhesion of body 'b' acts by the engine's own contacts, and not by those of the law" in said
    )
    assert model.nsensor == 5


@pytest.mark.parametrize(("name", "value"), [("adhesion", "1"), ("surfacevel", "1 0 0 0 0 0")])
def test_what_geoms_do_by_the_contacts_of_the_engine_alone_is_told_of(name, value):
    if not hasattr(mujoco.MjModel, f"geom_{name}"):
        pytest.skip("geoms of this MuJoCo have none")
    floor = BALL.replace('"floor"', f'"floor" {name}="{value}"')
    with pytest.warns(ContactWarning, match=f"geom 'floor': {name} acts by the engine's own contacts"):
        load_model(floor, [("ball", "floor", steel_pair())])


def test_sensors_of_skins_are_told_of_and_their_geoms_need_no_native_contact():
    """A tactile sensor refuses a geom that touches nothing natively."""
    if not hasattr(mujoco.mjtSensor, "mjSENS_TACTILE"):
        pytest.skip("this MuJoCo has no such sensor")
    more = """<site name="skin" size=".03"/></body></worldbody><asset><mesh name="ball" builtin="sphere" params="1"
    scale=".025 .025 .025"/></asset><extension><plugin plugin="mujoco.sensor.touch_grid"/></extension><sensor>
    <tactile geom="ball" mesh="ball"/><plugin plugin="mujoco.sensor.touch_grid" objtype="site" objname="skin">
    <config key="size" value="2 2"/><config key="fov" value="90 90"/></plugin></sensor>"""
    with pytest.warns(ContactWarning) as told:
        load_model(BALL.replace("</body></worldbody>", more), [("*", "*", steel_pair())])
    text = "sensor {}: measures the engine's own contacts, and not those of the law"
    said = {str(one.message).split(";")[0] for one in told}
    assert said == {text.format(0), text.format(1)}
