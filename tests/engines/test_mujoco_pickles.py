"""Models and mjData in other processes: pickled, spawned, in batches."""

import copy
import pickle
import subprocess
import sys

import numpy as np
import pytest
from mujoco_scenes import mujoco

from contactlaw import MATERIALS, ContactPair
from contactlaw.mujoco_plugin import load_model, save_model

BALL = """<mujoco><option timestep=".002"/><worldbody><geom name="floor" type="plane" size="1 1 1"/>
<body name="b" pos="0 0 .03"><freejoint/><geom name="ball" size=".025" density="7833"/></body></worldbody></mujoco>"""
RUBBER = ContactPair(MATERIALS["rubber"], MATERIALS["rubber"], 0.8, 0.5)


@pytest.fixture(scope="module")
def model():
    return load_model(BALL, [("ball", "floor", RUBBER)])


def rolling(model):
    data = mujoco.MjData(model)
    data.qvel[:] = [0.3, 0.1, -0.5, 1.0, 2.0, 3.0]
    mujoco.mj_step(model, data, 60)
    return data


def after(data, steps=50):
    mujoco.mj_step(data.model, data, steps)
    return np.concatenate([data.qpos, data.qvel, data.plugin_state])


@pytest.mark.parametrize("how", [copy.copy, copy.deepcopy, lambda data: pickle.loads(pickle.dumps(data))])
def test_a_copy_or_a_pickle_goes_on_to_the_bit(model, how):
    data = rolling(model)
    other = how(data)
    assert np.array_equal(after(other), after(data))
    del other
    assert np.isfinite(after(data)).all()


def test_models_without_the_law_are_pickled_as_before():
    plain = mujoco.MjModel.from_xml_string(BALL)
    data = mujoco.MjData(plain)
    mujoco.mj_step(plain, data, 20)
    other = pickle.loads(pickle.dumps(data))
    mujoco.mj_step(other.model, other, 20)
    mujoco.mj_step(plain, data, 20)
    assert np.array_equal(other.qpos, data.qpos)
    assert b"contactlaw" not in pickle.dumps(data)


def run(code, *arguments):
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", code, *arguments], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


def test_a_pickle_imports_what_it_needs(model, tmp_path):
    """As a worker that was spawned, and that knows nothing of contactlaw, gets it."""
    data = rolling(model)
    (tmp_path / "data").write_bytes(pickle.dumps(data))
    height = run(
        "import mujoco, pickle, sys; d = pickle.load(open(sys.argv[1], 'rb')); mujoco.mj_step(d.model, d, 50);"
        "print(d.qpos[2].hex())",
        str(tmp_path / "data"),
    )
    after(data)
    assert float.fromhex(height[-1]) == data.qpos[2]


def test_a_binary_model_opens_where_the_plugin_is_imported(model, tmp_path):
    mujoco.mj_saveModel(model, str(tmp_path / "a.mjb"), None)
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 100)
    height = run(
        "import contactlaw.mujoco_plugin, mujoco, sys; m = mujoco.MjModel.from_binary_path(sys.argv[1]);"
        "d = mujoco.MjData(m); mujoco.mj_step(m, d, 100); print(d.qpos[2].hex())",
        str(tmp_path / "a.mjb"),
    )
    assert float.fromhex(height[-1]) == data.qpos[2]


def test_a_file_says_what_is_to_be_imported_before(tmp_path):
    """MuJoCo names the plugin and the line; the line before says what to do."""
    path = save_model(BALL, tmp_path / "ball.xml", [("ball", "floor", RUBBER)])
    said = run(
        "import mujoco, sys\ntry: mujoco.MjModel.from_xml_path(sys.argv[1])\nexcept ValueError as error: print(error)",
        str(path),
    )
    assert "contactlaw.contact" in said
    line = int(said[said.index("line") + 1])
    assert "import contactlaw.mujoco_plugin" in "".join(path.read_text().splitlines()[line - 3 : line])


@pytest.mark.parametrize("persistent", [False, True])
def test_a_batch_moves_as_one_after_the_other(model, persistent):
    """Each simulation with a mass of its own; without `persistent` one mjData serves several of them in turn."""
    batch = pytest.importorskip("mujoco.batch").Batch(model, 3, 2, persistent)
    height, masses = batch.bind("qpos"), np.array([0.1, 0.3, 0.9])
    height[:, 2] += [0.0, 0.01, 0.02]
    batch.body("b").mass = masses[:, None]
    for _ in range(60):
        batch.step()
    for i, mass in enumerate(masses):
        own = copy.copy(model)
        own.body_mass[1] = mass
        data = mujoco.MjData(own)
        data.qpos[2] += 0.01 * i
        mujoco.mj_step(own, data, 60)
        assert height[i, 2] == pytest.approx(data.qpos[2], abs=1e-12)
        assert abs(data.qpos[2] - 0.03 - 0.01 * i) > 1e-3
