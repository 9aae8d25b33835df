"""What is odd is mended or refused with a sentence: files, configurations, states, flags and warnings."""

from __future__ import annotations

import os
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
from mujoco_scenes import mujoco

from contactlaw import ContactPair, ContactWarning
from contactlaw.mujoco_plugin import contacts_of, layout, load_model, save_model
from contactlaw.mujoco_plugin.drop_in import NEEDS
from contactlaw.world.data import demand

STEEL = ContactPair("steel", "steel", friction=0.115, restitution=0.9)
CONTACTS = [("ball", "floor", STEEL)]
BODY = '<body pos="0 0 {z}"><freejoint/><geom name="{name}" size=".025" density="7833"/></body>'


def scene(z=0.0249999, name="ball", more=""):
    return f"""<mujoco><worldbody><geom name="floor" type="plane" size="1 1 1"/>{BODY.format(z=z, name=name)}{more}
    </worldbody></mujoco>"""


@pytest.fixture(scope="module")
def model():
    return load_model(scene(), CONTACTS)


# ---- files


def test_a_file_that_the_model_includes_is_not_overwritten(tmp_path):
    (tmp_path / "robot.xml").write_text(f"<mujoco><worldbody>{BODY.format(z=0.1, name='ball')}</worldbody></mujoco>")
    (tmp_path / "scene.xml").write_text(
        '<mujoco><include file="robot.xml"/><worldbody><geom name="floor" type="plane" size="1 1 1"/></worldbody>'
        "</mujoco>"
    )
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    for target in before:
        with pytest.raises(ValueError, match="must be another file than the model's own and what it refers to"):
            save_model(tmp_path / "scene.xml", target, CONTACTS)
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before
    mujoco.MjModel.from_xml_path(str(save_model(tmp_path / "scene.xml", tmp_path / "new.xml", CONTACTS)))


@pytest.mark.parametrize("target", ["", None, 5, "a\0b.xml", "a.mjb"])
def test_a_target_that_is_no_xml_file(target):
    with pytest.raises(ValueError, match="target = "):
        save_model(scene(), target, CONTACTS)


def test_a_target_in_no_folder(tmp_path):
    with pytest.raises(ValueError, match=r"nowhere/a.xml': must be in a folder that exists"):
        save_model(scene(), tmp_path / "nowhere" / "a.xml", CONTACTS)


def test_a_target_that_is_no_file(tmp_path):
    for target in (tmp_path, "/dev/full"):
        with pytest.raises(ValueError, match="exists; must be a file"):
            save_model(scene(), target, CONTACTS)


def test_what_cannot_be_written_leaves_what_is_there(tmp_path, monkeypatch):
    target = tmp_path / "a.xml"
    precious = f"{NEEDS} precious"
    target.write_text(precious)

    def full(self, text, encoding):
        with self.open("w") as file:
            file.write(text[:9])
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_text", full)
    with pytest.raises(OSError, match="No space"):
        save_model(scene(), target, CONTACTS)
    assert [path.read_text() for path in tmp_path.iterdir()] == [precious]


def test_any_name_is_written_whatever_the_locale(tmp_path):
    code = f"""
from tests.engines.test_faults import CONTACTS, STEEL, save_model, scene
name = "b\\u00e4ll \\u7403"
print(save_model(scene(name=name), {str(tmp_path / "a.xml")!r}, [(name, "floor", STEEL)]))
"""
    path = os.pathsep.join([os.getcwd(), str(Path(__file__).parent)])
    plain = dict(os.environ, LC_ALL="C", PYTHONCOERCECLOCALE="0", PYTHONUTF8="0", PYTHONPATH=path)
    subprocess.run([sys.executable, "-c", code], env=plain, check=True, capture_output=True)
    assert mujoco.MjModel.from_xml_path(str(tmp_path / "a.xml")).geom("bäll 球").id == 1


# ---- configurations in XML


def configured(**over):
    keys = {"geom1": "ball", "geom2": "floor", "material1": "steel", "material2": "steel", "friction": "0.1"} | over
    config = "".join(f'<config key="{key}" value="{value}"/>' for key, value in keys.items())
    return scene().replace(
        "<worldbody>",
        f'<extension><plugin plugin="contactlaw.contact"><instance name="i">{config}</instance></plugin></extension>'
        '<contact><pair geom1="ball" geom2="floor" margin="-1e6"/></contact><worldbody>',
    )


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("substeps", "100.7", "substeps = '100.7'"), ("substeps", "1e3", "substeps = '1e3'"),
        ("crowd_substeps", "9", "crowd_substeps = 9"),
        ("substeps", "nan", "substeps = 'nan'"), ("friction", "nan", "friction = nan"),
        ("friction", "1_0", "friction = '1_0'"), ("friction", "1,5", "friction = '1,5'"),
        ("restitution", "0x1", "restitution = '0x1'"), ("radius", "nan", "radius = nan"),
        ("material1", "nan .3", "material1 = 'nan .3'"), ("material2", "Steel", "did you mean 'steel'"),
        ("law", "microslip node_count=2.9", "2.9"), ("law", "microslip node_count=nan", "nan"),
        ("ledger", "no", ""),
    ],
)  # fmt: skip
def test_a_value_that_is_none_is_refused_and_named(key, value, said, capfd):
    with pytest.raises(ValueError):
        mujoco.MjData(mujoco.MjModel.from_xml_string(configured(**{key: value})))
    assert said in capfd.readouterr().err


# ---- running


def step_until_interrupted(model, data):
    for _ in range(10_000):  # an interrupt comes between two calls
        mujoco.mj_step(model, data)


def test_warnings_made_errors_reach_the_caller(model):
    data = mujoco.MjData(model)
    data.qpos[2], data.qvel[2] = 0.03, -300.0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(ContactWarning, match="overlap over radius"):
            step_until_interrupted(model, data)


@pytest.mark.parametrize("kind", [OSError, KeyboardInterrupt])
def test_what_is_raised_while_something_is_compiled_reaches_the_caller(model, kind, monkeypatch):
    def supply(what):
        raise kind

    data = mujoco.MjData(model)
    data.qpos[2], data.qvel[2], data.qvel[5] = 0.026, -1.0, 50.0
    with monkeypatch.context() as patched:
        patched.setattr(demand, "supply", supply)
        demand.TABLE["functions"][0, demand.SPIN] = 0
        with pytest.raises(kind):
            step_until_interrupted(model, data)
        assert not demand.PENDING_ERROR
        assert data.time < 0.01
    mujoco.mj_step(model, data, 5)
    assert 0.5 < data.qvel[2] < 1.0


def test_an_interrupt_while_an_mjdata_is_made_leaves_none_half_made(model, monkeypatch, capfd):
    def stop(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("contactlaw.mujoco_plugin.plugin._new_block", stop)
    with pytest.raises(mujoco.FatalError, match="init failed"):
        mujoco.MjData(model)
    assert capfd.readouterr().err == "contactlaw: plugin instance 0: KeyboardInterrupt\n"


@pytest.mark.parametrize(
    ("field", "flags", "said"),
    [
        ("disableflags", layout.NO_PASSIVE, "spring and damper are both disabled"),
        ("enableflags", layout.SLEEP, "sleep"),
    ],
)
def test_flags_that_turn_the_law_off_are_noticed(model, field, flags, said):
    data, before = mujoco.MjData(model), getattr(model.opt, field)
    mujoco.mj_step(model, data, 3)
    setattr(model.opt, field, before | flags)
    try:
        with pytest.warns(ContactWarning, match=said):
            mujoco.mj_step(model, data, 10)
    finally:
        setattr(model.opt, field, before)
    assert np.isfinite(data.qpos).all()


def test_a_state_of_another_model_is_refused(model):
    other = load_model(scene(more='<geom name="wall" type="box" size=".1 .1 .1" pos="5 0 0"/>'), CONTACTS)
    kind = mujoco.mjtState.mjSTATE_INTEGRATION
    here, there = mujoco.MjData(model), mujoco.MjData(other)
    mujoco.mj_step(model, here, 5)
    state = np.empty(mujoco.mj_stateSize(model, kind))
    assert state.size == mujoco.mj_stateSize(other, kind)
    mujoco.mj_getState(model, here, state, kind)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        mujoco.mj_setState(model, mujoco.MjData(model), state, kind)
        mujoco.mj_step(model, here, 5)
    mujoco.mj_setState(other, there, state, kind)
    with pytest.warns(ContactWarning, match="of another model"):
        mujoco.mj_step(other, there, 50)
    assert np.abs(there.qvel).max() < 0.05
    name = "contactlaw:ball:floor"
    with pytest.raises(ValueError, match="of another model"):
        contacts_of(model, there, name)


def test_a_geom_of_another_type_is_followed_or_told_of():
    """A ball needs less room in the state than a box: only the first of the two can be followed."""
    crate = scene().replace('size=".025"', 'type="box" size=".025 .025 .025"')
    heights = []
    for text, kind, told in ((crate, mujoco.mjtGeom.mjGEOM_SPHERE, False), (scene(), mujoco.mjtGeom.mjGEOM_BOX, True)):
        model = load_model(text, CONTACTS)
        data = mujoco.MjData(model)
        mujoco.mj_step(model, data, 10)
        model.geom_type[1], model.geom_size[1] = kind, 0.02
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always", ContactWarning)
            mujoco.mj_step(model, data, 500)
        messages = [str(one.message) for one in said]
        assert any("keeps the old values" in message for message in messages) == told, messages
        heights.append(data.qpos[2])
    assert heights == pytest.approx([0.02, 0.025], abs=1e-5)
