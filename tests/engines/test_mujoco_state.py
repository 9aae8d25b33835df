"""The plugin's state: committed, saved, copied, reset, threaded, freed."""

import subprocess
import sys
import warnings

import numba
import numpy as np
import pytest

mujoco = pytest.importorskip("mujoco")
if numba.config.DISABLE_JIT:
    pytest.skip("the MuJoCo plugin needs compiled callbacks", allow_module_level=True)

from mujoco_scenes import ball_on_floor, steel_pair  # noqa: E402

from contactlaw import ContactWarning  # noqa: E402
from contactlaw.mujoco_plugin import contacts_of  # noqa: E402


def test_history_is_committed_by_steps_alone():
    spec, name = ball_on_floor(steel_pair())
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qvel[:3] = [0.1, 0.0, -1.0]
    mujoco.mj_step(model, data, 40)
    committed = data.plugin_state.copy()
    mujoco.mj_forward(model, data)
    force = data.qfrc_passive.copy()
    mujoco.mj_forward(model, data)
    assert np.array_equal(data.plugin_state, committed)
    assert np.array_equal(data.qfrc_passive, force)
    assert np.hypot(*force[:2]) <= 0.115 * force[2] * (1 + 1e-12)
    mujoco.mj_step(model, data)
    assert not np.array_equal(data.plugin_state, committed)
    assert len(contacts_of(model, data, name)) == 1


def test_a_restart_in_mid_contact_is_bit_exact():
    spec, _ = ball_on_floor(steel_pair())
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qvel[:] = [0.1, 0.02, -1.0, 1.0, 2.0, 3.0]
    mujoco.mj_step(model, data, 50)
    kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
    state = np.empty(mujoco.mj_stateSize(model, kind))
    mujoco.mj_getState(model, data, state, kind)
    copy = mujoco.MjData(model)
    mujoco.mj_copyData(copy, model, data)
    mujoco.mj_step(model, data, 100)
    fresh = mujoco.MjData(model)
    mujoco.mj_setState(model, fresh, state, kind)
    for other in (fresh, copy):
        mujoco.mj_step(model, other, 100)
        assert np.array_equal(other.qvel, data.qvel)
        assert np.array_equal(other.plugin_state, data.plugin_state)


def test_a_reset_forgets_the_contact():
    spec, name = ball_on_floor(steel_pair())
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qvel[2] = -1.0
    mujoco.mj_step(model, data, 30)
    assert contacts_of(model, data, name)
    mujoco.mj_resetData(model, data)
    assert not contacts_of(model, data, name) and not data.plugin_state.any()


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
    model = spec.compile()
    data = mujoco.MjData(model)
    kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
    states = []
    for speed in (0.5, 1.0, 1.5, 2.0):
        mujoco.mj_resetData(model, data)
        data.qvel[:3] = [0.1, 0.05, -speed]
        mujoco.mj_step(model, data, 20)  # each starts in mid-contact
        state = np.empty(mujoco.mj_stateSize(model, kind))
        mujoco.mj_getState(model, data, state, kind)
        states.append(state)
    results = []
    for threads in (1, 2):
        datas = [mujoco.MjData(model) for _ in range(threads)]
        out, _ = rollout.rollout(model, datas, initial_state=np.array(states), nstep=150)
        results.append(out)
    assert np.array_equal(*results)


def damage(state, how):
    rng = np.random.default_rng(3)
    if how == "noise":
        state += 0.5 * rng.normal(size=state.size)
    elif how == "much noise":
        state += 1e3 * rng.normal(size=state.size)
    elif how in ("nan", "ones", "huge"):
        state[:] = {"nan": np.nan, "ones": 1.0, "huge": 1e200}[how]
    elif how.startswith("count"):
        state[0] = float(how.split()[1])
    elif how.startswith("key"):
        state[1] = float(how.split()[1])
    elif how.startswith("entry"):
        state[int(how.split()[1])] = np.inf


@pytest.mark.parametrize(
    "how",
    ["noise", "much noise", "nan", "ones", "huge", "count 1e9", "count -3", "count nan", "count 1e300", "key 1e7",
     "key -4", "key 1", "key nan", "key 0.5", *(f"entry {i}" for i in range(2, 80, 4))],
)  # fmt: skip
def test_a_damaged_state_is_dropped_with_a_warning(how):
    """The state is open to everybody: of what cannot be, nothing may lead out of the tables or into the motion."""
    spec, name = ball_on_floor(steel_pair(), 2e-3, gravity=9.81)
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[2] -= 1e-7
    mujoco.mj_step(model, data, 20)
    assert data.plugin_state[0] == 1.0 and data.plugin_state.size == 80
    damage(data.plugin_state, how)
    contacts_of(model, data, name)
    with pytest.warns(ContactWarning, match="not what a step of this model leaves"):
        mujoco.mj_step(model, data)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        mujoco.mj_step(model, data, 200)
    assert not said
    assert np.isfinite(data.plugin_state).all() and np.abs(data.qvel).max() < 0.05
    assert data.plugin_state[0] in (0.0, 1.0)
