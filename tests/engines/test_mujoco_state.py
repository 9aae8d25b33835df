"""The plugin's state: committed, saved, copied, reset, threaded, freed."""

import subprocess
import sys

import numba
import numpy as np
import pytest

mujoco = pytest.importorskip("mujoco")
if numba.config.DISABLE_JIT:
    pytest.skip("the MuJoCo plugin needs compiled callbacks", allow_module_level=True)

from mujoco_scenes import ball_on_floor, steel_pair  # noqa: E402

from contactlaw.kernels.contact import NORMAL, OVERLAP, PHASE, TANGENTIAL  # noqa: E402
from contactlaw.laws.record import OPEN  # noqa: E402
from contactlaw.mujoco_plugin import contact_history  # noqa: E402


def test_history_is_committed_by_steps_alone():
    spec, name = ball_on_floor(steel_pair())
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qvel[:3] = [0.1, 0.0, -1.0]
    mujoco.mj_step(model, data, 40)
    history = contact_history(model, data, name)
    committed = history.copy()
    mujoco.mj_forward(model, data)
    force = data.qfrc_passive.copy()
    mujoco.mj_forward(model, data)
    assert np.array_equal(history, committed)
    assert np.array_equal(data.qfrc_passive, force)
    mujoco.mj_step(model, data)
    assert not np.array_equal(history, committed)
    assert data.plugin_state.any() and history[0, NORMAL] == pytest.approx(force[2], rel=0.05)
    assert history[0, OVERLAP] > 0.0
    assert np.hypot(*history[0, TANGENTIAL : TANGENTIAL + 2]) <= 0.115 * history[0, NORMAL] * (1 + 1e-12)


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
    assert contact_history(model, data, name)[0, PHASE] != OPEN
    mujoco.mj_resetData(model, data)
    assert not contact_history(model, data, name).any()


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
