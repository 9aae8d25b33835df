"""The puck of the paper, in both engines and beside the reference."""

import json

import numpy as np
import pytest

pytest.importorskip("typer")
from typer.testing import CliRunner

from sims.cli import app
from sims.puck import LAUNCHES, SURFACES, Puck, run
from sims.scene import Settings, find_scenes

SCENES = find_scenes()
KEYS = [
    "engine", "law", "material", "mu", "chi", "restitution", "timestep", "contact_duration", "steps", "psi1", "psi2",
    "psi2_reference", "energy_ratio", "wall_time",
]  # fmt: skip


@pytest.mark.parametrize("material", SURFACES)
@pytest.mark.parametrize("launch", LAUNCHES)
def test_a_throw_meets_the_reference_and_checks_itself(engine, material, launch):
    for psi_1, heading in ((0.6, 0.0), (2.2, 2.0), (-1.5, 0.3)):
        result = run(Puck(material, psi_1, launch=launch, heading=heading), engine)
        assert abs(result.error) <= 1e-3
        assert result.psi1 == pytest.approx(psi_1)
        result.check()


@pytest.mark.parametrize(("steps", "allowed"), [(100, 5e-3), (50, 1e-2)])
def test_the_stated_accuracy_holds_at_fewer_steps(engine, steps, allowed):
    for material in SURFACES:
        for psi_1 in (1.2, 3.0):
            timestep = Puck(material).contact_duration / steps
            for phase in (0.1, 0.7):
                assert abs(run(Puck(material, psi_1, timestep=timestep, phase=phase), engine).error) <= allowed


def test_a_real_table_makes_no_difference(engine):
    with_table, without = (run(Puck("steel", 1.2, table=table), engine).psi2 for table in (True, False))
    assert with_table == pytest.approx(without, abs=1e-4)


def test_the_engines_own_contact_never_reverses_the_contact_point(engine):
    for psi_1 in (1.0, 2.0, 3.0):
        assert run(Puck("steel", psi_1, "native"), engine).psi2 > -1e-3


def test_a_failed_check_says_what_failed(engine):
    result = run(Puck("steel", 1.2, "coulomb"), engine)
    wrong = type(result)(**{key: getattr(result, key) for key in KEYS} | {"law": "microslip"})
    with pytest.raises(AssertionError, match="error of psi2 = "):
        wrong.check()


def test_one_json_object_with_the_agreed_keys(engine):
    arguments = ["puck", "--engine", engine, "--material", "rubber", "--psi1", "1.2", "--launch", "spin", "--json"]
    finished = CliRunner().invoke(app, arguments)
    assert finished.exit_code == 0, finished.output
    values = json.loads(finished.stdout)
    assert list(values) == KEYS
    assert values["psi2"] == pytest.approx(values["psi2_reference"], abs=1e-3)


@pytest.mark.parametrize("timestep", [1 / 60, 2e-3, 1e-5])
def test_a_step_longer_than_the_contact_does(engine, timestep):
    for material in ("steel", "rubber"):
        for psi_1 in (0.4, 1.2, 3.0):
            assert abs(run(Puck(material, psi_1, timestep=timestep), engine).error) <= 1.5e-3


def test_the_puck_is_that_of_the_paper():
    steel, rubber = Puck("steel"), Puck("rubber")
    assert steel.chi == pytest.approx(1.256, abs=5e-4)
    assert rubber.chi == pytest.approx(1.0)
    assert 2 * steel.radius == pytest.approx(0.1016)
    assert steel.inertia / (steel.mass * steel.radius**2) == pytest.approx(0.5)


def test_the_picture_is_drawn(tmp_path):
    pytest.importorskip("matplotlib")
    from sims.draw import draw_rebounds

    pytest.importorskip("pybullet")
    results = [run(Puck(material, 1.2), "pybullet") for material in SURFACES]
    psi_1 = np.linspace(0.0, 6.0, 5)
    path = draw_rebounds(results, psi_1, dict.fromkeys(SURFACES, psi_1), tmp_path / "puck.png")
    assert path.stat().st_size > 10_000


def test_the_puck_as_a_scene_is_the_same_throw(engine):
    scene = SCENES["puck"]
    seen = scene.measure(scene.run(Settings(engine, material="rubber", options={"psi1": 2.2, "spin": 1})))
    asked = run(Puck("rubber", 2.2, launch="spin"), engine)
    assert list(seen) == KEYS
    assert seen["psi1"] == pytest.approx(asked.psi1) and seen["psi2"] == pytest.approx(asked.psi2, abs=4e-3)
    assert seen["energy_ratio"] == pytest.approx(asked.energy_ratio, abs=4e-3)


def test_with_friction_set_mujoco_stops_the_slip_and_loses_restitution():
    pytest.importorskip("mujoco")
    damped, stiff, rigid = (run(Puck("steel", 2.0, law), "mujoco") for law in ("native_damped", "native", "coulomb"))
    assert abs(damped.psi2 - rigid.psi2) < 0.1 < stiff.psi2
    assert damped.energy_ratio < rigid.energy_ratio - 0.03, "less than rigid friction and the restitution leave"
