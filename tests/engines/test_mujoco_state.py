"""The plugin's state: committed, saved, copied, reset, threaded, freed."""

import subprocess
import sys
import warnings

import numpy as np
import pytest
from mujoco_scenes import WHOLE, ball_on_floor, mujoco, state_of, steel_pair, with_data

from contactlaw import ContactPair, ContactWarning, Material
from contactlaw.mujoco_plugin import contacts_of, instances_of, ledger_of, load_model


def test_what_is_remembered_changes_with_steps_alone():
    spec, name = ball_on_floor(steel_pair())
    model, data = with_data(spec.compile())
    data.qvel[:3] = [0.1, 0.0, -1.0]
    mujoco.mj_step(model, data, 40)
    committed, [contact] = data.plugin_state.copy(), contacts_of(model, data, name)
    mujoco.mj_forward(model, data)
    force = data.qfrc_passive.copy()
    mujoco.mj_forward(model, data)
    assert np.array_equal(data.plugin_state, committed)
    assert np.array_equal(data.qfrc_passive, force)
    assert contact.touching and contact.overlap > 0.0
    assert contact.normal_force == pytest.approx(force[2], rel=1e-12)
    assert np.linalg.norm(contact.tangential_force) <= 0.115 * contact.normal_force * (1 + 1e-12)
    mujoco.mj_step(model, data)
    assert not np.array_equal(data.plugin_state, committed)


def test_a_restart_in_mid_contact_is_bit_exact():
    spec, _ = ball_on_floor(steel_pair())
    model, data = with_data(spec.compile())
    data.qvel[:] = [0.1, 0.02, -1.0, 1.0, 2.0, 3.0]
    mujoco.mj_step(model, data, 50)
    state = state_of(model, data)
    copy = mujoco.MjData(model)
    mujoco.mj_copyData(copy, model, data)
    mujoco.mj_step(model, data, 100)
    fresh = mujoco.MjData(model)
    mujoco.mj_setState(model, fresh, state, WHOLE)
    for other in (fresh, copy):
        mujoco.mj_step(model, other, 100)
        assert np.array_equal(other.qvel, data.qvel)
        assert np.array_equal(other.plugin_state, data.plugin_state)


@pytest.mark.parametrize("what", ["nothing", "place", "size"])
def test_what_sleeps_wakes_where_it_is_set_back_to_another_place_or_as_another_model(what):
    spec, name = ball_on_floor(steel_pair(restitution=0.5), 2e-3, gravity=9.81)
    model, data = with_data(spec.compile())
    data.qpos[2] += 1e-5
    mujoco.mj_step(model, data, 500)
    assert not data.qvel.any() and contacts_of(model, data, name)[0].touching
    state = state_of(model, data)
    if what == "size":
        model.geom_size[model.body_geomadr[1], 0] *= 0.9
    other = mujoco.MjData(model)
    mujoco.mj_setState(model, other, state, WHOLE)
    if what == "place":
        other.qpos[2] += 1e-3
    mujoco.mj_step(model, other, 2)
    assert (other.qvel[2] < -0.01) == (what != "nothing")
    assert np.array_equal(other.plugin_state, data.plugin_state) == (what == "nothing")


def test_a_reset_forgets_the_contact():
    spec, name = ball_on_floor(steel_pair())
    model, data = with_data(spec.compile())
    data.qvel[2] = -1.0
    mujoco.mj_step(model, data, 30)
    assert contacts_of(model, data, name)[0].touching
    mujoco.mj_resetData(model, data)
    assert contacts_of(model, data, name) == [] and ledger_of(model, data, name).impacts == 0
    assert not data.plugin_state.any()


def test_what_follows_a_state_does_not_depend_on_what_was_before():
    """Saved at every step, set back much later into data that has done something else; at odd times besides."""
    spec, _ = ball_on_floor(steel_pair(restitution=0.8), 2e-3, gravity=9.81)
    for integrator in ("EULER", "RK4", "IMPLICITFAST"):
        spec.option.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator}")
        model = spec.compile()
        data, other = mujoco.MjData(model), mujoco.MjData(model)
        data.qpos[2] += 5e-3
        data.time = 1e6 + 1 / 3
        saved, after = [], []
        for _ in range(150):
            state = state_of(model, data)
            saved.append(state)
            mujoco.mj_step(model, data)
            after.append(np.concatenate([data.qpos, data.qvel, data.plugin_state]))
        for number in (140, 3, 60, 61, 20, 149):
            mujoco.mj_setState(model, other, saved[number], WHOLE)
            mujoco.mj_step1(model, other)
            if integrator == "RK4":  # which MuJoCo does not take in two halves
                mujoco.mj_step(model, other)
            else:
                mujoco.mj_step2(model, other)
            assert np.array_equal(np.concatenate([other.qpos, other.qvel, other.plugin_state]), after[number]), number


def test_many_mjdata_come_and_go():
    spec, _ = ball_on_floor(steel_pair())
    model = spec.compile()
    for _ in range(200):
        data = mujoco.MjData(model)
        data.qvel[2] = -1.0
        mujoco.mj_step(model, data, 3)


def test_a_process_ends_cleanly_with_the_plugin_in_use():
    code = (
        "import mujoco, contactlaw.mujoco_plugin as p, contactlaw as c;"
        "s = mujoco.MjSpec(); s.worldbody.add_geom(name='f', type=mujoco.mjtGeom.mjGEOM_PLANE, size=[1, 1, 1]);"
        "b = s.worldbody.add_body(); b.add_freejoint(); b.add_geom(name='b', size=[.1, 0, 0]);"
        "m = c.MATERIALS['steel']; p.add_contact(s, 'b', 'f', c.ContactPair(m, m, .1)); m = s.compile();"
        "d = [mujoco.MjData(m) for _ in range(3)]; mujoco.mj_step(m, d[0]); print('done')"
    )
    finished = subprocess.run([sys.executable, "-W", "ignore", "-c", code], capture_output=True, text=True, check=False)
    assert (finished.returncode, finished.stdout.strip()) == (0, "done"), finished.stderr


def test_rollouts_on_two_threads_give_the_bits_of_one():
    from mujoco import rollout

    spec, _ = ball_on_floor(steel_pair())
    model, data = with_data(spec.compile())
    states = []
    for speed in (0.5, 1.0, 1.5, 2.0):
        mujoco.mj_resetData(model, data)
        data.qvel[:3] = [0.1, 0.05, -speed]
        mujoco.mj_step(model, data, 20)  # each starts in mid-contact
        state = state_of(model, data)
        states.append(state)
    results = []
    for threads in (1, 2):
        datas = [mujoco.MjData(model) for _ in range(threads)]
        out, _ = rollout.rollout(model, datas, initial_state=np.array(states), nstep=150)
        results.append(out)
    assert np.array_equal(*results)


FIRST = 15  # of the law's part of plugin_state, behind three checksums and two forces: how many contacts there are


def damage(state, how):
    rng = np.random.default_rng(3)
    what, _, value = how.partition(" ")
    if how == "noise":
        state += 0.5 * rng.normal(size=state.size)
    elif how == "much noise":
        state += 1e3 * rng.normal(size=state.size)
    elif how in ("nan", "ones", "huge"):
        state[:] = {"nan": np.nan, "ones": 1.0, "huge": 1e200}[how]
    elif what in ("count", "shape"):
        state[FIRST + (what == "shape")] = float(value)
    else:
        state[FIRST + int(value)] = np.inf


def damaged(how):
    """Of a ball that lies on the floor: model, mjData, another one with a damaged state, name of the instance."""
    spec, name = ball_on_floor(steel_pair(), 2e-3, gravity=9.81)
    model = spec.compile()
    data, other = mujoco.MjData(model), mujoco.MjData(model)
    data.qpos[2] -= 1e-7
    mujoco.mj_step(model, data, 20)
    assert data.plugin_state[FIRST] == 1.0
    mujoco.mj_copyData(other, model, data)
    damage(other.plugin_state, how)
    return model, data, other, name


@pytest.mark.parametrize(
    "how",
    ["noise", "much noise", "nan", "ones", "huge", "count 1e9", "count -3", "count nan", "count 1e300", "shape 1e7",
     "shape -4", "shape 0", "shape nan", "shape 0.5", *(f"entry {i}" for i in range(2, 70, 4))],
)  # fmt: skip
def test_a_damaged_state_is_dropped_with_a_warning(how):
    """The state is open to everybody: of what cannot be, nothing may lead out of the tables or into the motion."""
    model, _, other, name = damaged(how)
    with pytest.warns(ContactWarning, match="not written by a step of this model"):
        mujoco.mj_step(model, other)
    contacts_of(model, other, name)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        mujoco.mj_step(model, other, 200)
    assert not said
    assert np.isfinite(other.plugin_state).all() and np.abs(other.qvel).max() < 0.05
    assert other.plugin_state[FIRST] in (0.0, 1.0)


@pytest.mark.parametrize("how", ["count 1e9", "shape 0", "entry 20", "noise"])
def test_a_damaged_state_is_dropped_by_a_readout_too(how):
    model, data, other, name = damaged(how)
    with pytest.warns(ContactWarning, match="not written by a step of this model"):
        assert contacts_of(model, other, name) == []
    assert contacts_of(model, data, name)


@pytest.mark.parametrize("how", ["count 1e9", "shape nan", "entry 20"])
def test_damage_to_what_a_step_has_left_itself_is_not_looked_at(how):
    spec, _ = ball_on_floor(steel_pair(), 2e-3, gravity=9.81)
    model = spec.compile()
    runs = []
    for harmed in (False, True):
        data = mujoco.MjData(model)
        data.qpos[2] -= 1e-7
        mujoco.mj_step(model, data, 20)
        if harmed:
            damage(data.plugin_state, how)
        mujoco.mj_step(model, data, 20)
        runs.append(np.concatenate([data.qpos, data.qvel, data.plugin_state]))
    assert np.array_equal(*runs)


def test_a_reset_to_where_a_ball_sleeps_finds_it_pressed():
    text = """<mujoco><option timestep="0.002"/><worldbody><geom name="floor" type="plane" size="1 1 1"/>
        <body pos="0 0 0.025"><freejoint/><geom name="ball" size="0.025" density="7833"/></body></worldbody></mujoco>"""
    model = load_model(text, [("ball", "floor", steel_pair(restitution=0.5))])
    data, fresh = mujoco.MjData(model), mujoco.MjData(model)
    mujoco.mj_step(model, data, 500)
    place = data.qpos.copy()
    assert not data.qvel.any()
    mujoco.mj_resetData(model, data)
    for one in (data, fresh):
        one.qpos[:] = place
        mujoco.mj_step(model, one, 10)
    assert np.array_equal(data.qpos, fresh.qpos)
    assert abs(data.qpos[2] - place[2]) < 1e-12


FLAIL = """<mujoco><option timestep=".004"/><worldbody><geom name="floor" type="plane" size="1 1 1"/>
<geom name="wall" type="box" size=".02 .5 .5" pos=".35 0 .3"/>
<body pos="0 0 .5" euler="20 40 10"><freejoint/><geom type="box" size=".05 .03 .02"/>
<body pos=".1 .02 0"><joint type="ball" pos="-.05 0 0" damping="1e-5"/><geom type="cylinder" size=".02 .04"/>
<body pos=".08 0 .03"><joint axis=".3 1 .2" pos="-.04 0 0"/><geom type="capsule" size=".01 .03"/></body></body></body>
<body pos=".1 .1 .8"><freejoint/><geom type="ellipsoid" size=".04 .03 .02"/>
<body pos=".06 0 0"><joint axis="0 1 .3" pos="-.03 0 0"/><geom type="box" size=".02 .01 .03"/></body></body>
</worldbody></mujoco>"""


def test_what_is_reset_goes_as_what_is_new():
    """Chains that flail and strike: of the run before nothing is left, be it a bound on how fast they were."""
    model = load_model(FLAIL, [("*", "*", ContactPair("rubber", "steel", 0.5, 0.5))])

    def run(data):
        data.qvel[:] = 2.0 * np.random.default_rng(3).normal(size=model.nv)
        mujoco.mj_forward(model, data)
        mujoco.mj_step(model, data, 120)
        return data.qpos.copy()

    new = run(mujoco.MjData(model))
    for steps in (30, 150):
        data = mujoco.MjData(model)
        run(data)
        mujoco.mj_step(model, data, steps)
        mujoco.mj_resetData(model, data)
        assert np.array_equal(run(data), new)


def test_a_state_has_room_for_every_contact_of_soft_boxes_stacked_askew():
    """Each on the next by eight corners and crossings of edges beside them; a restored state goes on as it was."""
    box = '<body pos="{} 0 {}"><freejoint/><geom type="box" size=".05 .05 .05"/></body>'
    stack = "".join(box.format(0.002 * (i % 2), 0.05 + 0.1001 * i) for i in range(5))
    floor = '<geom type="plane" size="1 1 1"/>'
    soft = ContactPair(Material(1.2e7, 0.4), Material(1.2e7, 0.4), friction=0.3, restitution=0.3)
    model = load_model(f"<mujoco><worldbody>{floor}{stack}</worldbody></mujoco>", [("*", "*", soft)])
    data, again = mujoco.MjData(model), mujoco.MjData(model)
    with warnings.catch_warnings():
        warnings.filterwarnings("error", ".*no room")
        mujoco.mj_step(model, data, 300)
    names = instances_of(model)
    assert sum(len(contacts_of(model, data, name)) for name in names) > 60
    mujoco.mj_copyData(again, model, data)
    for one in (data, again):
        mujoco.mj_step(model, one, 20)
    assert np.array_equal(data.qpos, again.qpos)
