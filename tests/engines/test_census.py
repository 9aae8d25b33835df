"""How the census judges energy, and what becomes unstable."""

import pytest
from mujoco_scenes import mujoco, with_data

from contactlaw import ContactPair
from contactlaw.mujoco_plugin import load_model
from validation.cases.models import CHANCE, by_chance
from validation.census import fallen, often


def test_what_overlaps_store_at_the_start_is_no_gain():
    """A ball 10 mm inside the floor is thrown up by more than it weighs; what it cannot keep is lost to its damper."""
    scene = """<mujoco><option timestep="1e-3"/><worldbody><geom type="plane" size="1 1 .1"/>
        <body pos="0 0 .04"><freejoint/><geom size=".05" mass=".5"/></body></worldbody></mujoco>"""
    model = load_model(scene, [("*", "*", ContactPair("rubber", "steel", 0.8, 0.5))], overlaps="keep")
    data, heights = mujoco.MjData(model), []
    for _ in range(200):
        mujoco.mj_step(model, data)
        heights.append(data.qpos[2])
    assert max(heights) > 0.2
    assert -1.0 < fallen(mujoco, model, 10.0)["gain"] < 0.0


def test_what_passed_joint_limits_store_at_the_start_is_no_gain():
    """A rod half a radian beyond its limit is thrown back, with no more than it stored."""
    scene = """<mujoco><option timestep="1e-4" gravity="0 0 0"/><compiler angle="radian"/><worldbody><body>
        <joint axis="0 1 0" limited="true" range=".5 2"/><geom type="capsule" fromto="0 0 0 .2 0 0" size=".01"/>
        </body></worldbody></mujoco>"""
    model, data = with_data(mujoco.MjModel.from_xml_string(scene))
    mujoco.mj_forward(model, data)
    mujoco.mj_step(model, data, 1000)
    assert data.qvel[0] > 1.0
    assert -1.0 < fallen(mujoco, model, 10.0)["gain"] < 0.0


def test_what_becomes_unstable_is_counted_over_seeds(tmp_path, monkeypatch):
    """Draws of torque pass 1e10 rad/s^2 in half of the runs; the arm touches nothing, so both ways are alike."""
    monkeypatch.chdir(tmp_path)  # where MuJoCo leaves its log
    path = tmp_path / "arm.xml"
    path.write_text(
        """<mujoco><option timestep="2e-3"/><worldbody><body><joint name="j" axis="0 1 0"/>
        <geom type="capsule" fromto="0 0 0 .2 0 0" size=".01" mass="1e-3"/></body></worldbody>
        <actuator><motor joint="j" ctrlrange="-SIZE SIZE"/></actuator></mujoco>""".replace("SIZE", "1.6e5")
    )
    found = often(str(path), 0.1, 10.0)["often"]
    native, law = found["native"], found["law"]
    assert (native["runs"], law["runs"]) == (60, 10)
    assert 0 < native["bad"] < 60
    assert by_chance(found) > CHANCE


@pytest.mark.parametrize(("bad", "missed"), [(3, False), (5, False), (6, True), (10, True)])
def test_more_runs_unstable_than_chance_allows_are_missed(bad, missed):
    """Of 10, beside 7 of 60; with 5 the chance is 0.0102, with 6 0.0018."""
    often = {"law": {"bad": bad, "runs": 10}, "native": {"bad": 7, "runs": 60}}
    assert (by_chance(often) < CHANCE) == missed
    assert by_chance(None) < CHANCE
