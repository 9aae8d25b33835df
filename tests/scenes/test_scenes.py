"""Every scene in every engine checks itself; and the scenes' own checks can fail."""

import json
import math
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import typer.testing
from typer.testing import CliRunner

pytest.importorskip("scipy")

from contactlaw import MATERIALS, RIGID, ContactPair
from sims.cli import app
from sims.contact_point import contact_velocity, rebound_of
from sims.scene import EVERYWHERE, LEAST_STEP, LONGEST_STEP, NATIVE, NONE, Settings, find_scenes
from sims.scenes import coin
from sims.worlds import World, new_world

SCENES = find_scenes()
runner: Any = typer.testing
runner._get_command = cache(runner._get_command)  # else each call makes the commands of all scenes anew


def measured(name, engine, law=None, timestep=None, **options):
    if engine != NONE:
        pytest.importorskip(engine)
    scene = SCENES[name]
    if engine not in scene.engines:
        pytest.skip(scene.unable.get(engine, "has more than balls and planes"))
    return scene.measure(scene.run(Settings(engine, law, timestep=timestep, options=options)))


def failed(name, values):
    return [one for one in SCENES[name].check(values) if not one.passed]


@pytest.mark.slow
@pytest.mark.parametrize("engine", EVERYWHERE)
@pytest.mark.parametrize("name", SCENES)
def test_a_scene_holds_what_it_checks(name, engine):
    values = measured(name, engine, **({"balls": 27} if name == "heap" else {}))
    assert SCENES[name].check(values)
    assert failed(name, values) == []
    assert json.loads(json.dumps(values)) == values  # JSON types only


@pytest.mark.parametrize("engine", EVERYWHERE)
@pytest.mark.parametrize(("name", "own"), [("cradle", "coulomb"), ("incline", "coulomb"), ("superball", "microslip")])
def test_a_scene_has_a_law_of_its_own_and_runs_by_another_on_demand(name, own, engine):
    assert measured(name, engine)["law"] == own
    for law in ("microslip", "mindlin"):
        values = measured(name, engine, law)
        assert values["law"] == law
        assert failed(name, values) == []


@pytest.mark.parametrize("law", [None, "microslip"])
def test_the_command_runs_the_law_that_it_is_told(law):
    pytest.importorskip("pybullet")
    asked = ["--law", law] if law else []
    finished = CliRunner().invoke(app, ["cradle", "--engine", "pybullet", "--json", *asked])
    assert finished.exit_code == 0, finished.output
    assert json.loads(finished.stdout)["law"] == (law or "coulomb")


def test_the_laws_of_several_pairs_are_all_told():
    pytest.importorskip("pybullet")
    steel = MATERIALS["steel"]
    world = new_world(Settings("pybullet"))
    world.plane("floor")
    assert world.law == "none"
    for number, law in enumerate(("coulomb", "mindlin", "coulomb")):
        world.ball(f"ball{number}", 0.02, 0.1, [0.1 * number, 0.0, 0.05])
        world.contact(f"ball{number}", "floor", ContactPair(steel, steel, 0.1, law=law))
    assert world.record(0.01).facts["law"] == "coulomb and mindlin"


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
def test_the_engines_own_contact_can_be_run_and_measured(name):
    if name == "paddle":
        with pytest.raises(ValueError, match="law = 'native'"):
            measured(name, "pybullet", "native")
        return
    values = measured(name, "pybullet", "native")
    assert values["law"] == "native"
    SCENES[name].check(values)


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("rubber_experiment", {"psi1": 0.8}),
        ("rubber_experiment", {"psi1": 5.0}),
        ("cradle", {"strikers": 2}),
        ("cradle", {"balls": 3, "gap": 1e-4}),
        ("incline", {"angle": 25.0}),
        ("incline", {"slippery": 0.0}),
        ("golf", {"speed": 4.0, "friction": 0.25}),
        ("billiards", {"side": 1.0, "angle": 0.0}),
        ("table_tennis", {"down": 2.0}),
        ("paddle", {"up": 3.0, "topspin": 6.0}),
        ("paddle", {"friction": 0.5, "restitution": 0.9}),
        ("superball", {"friction": 0.5, "restitution": 0.8, "mass": 0.06, "radius": 0.03}),
        ("under_table", {"mass": 0.04}),
        ("cradle", {"restitution": 0.9, "radius": 0.01, "mass": 0.1}),
        ("cradle", {"mass": 1e-6}),
        ("puck", {"friction": 0.2, "restitution": 1.0, "mass": 2.0, "radius": 0.04}),
        ("table_tennis", {"friction": 0.35, "restitution": 0.8}),
        ("coin", {"angle": 20.0, "thickness": 1e-3, "radius": 0.02, "seconds": 0.8}),
        ("galton", {"rows": 4, "balls": 40}),
        ("shapes", {"drop": 0.01, "friction": 0.6, "speed": 0.2}),
        ("billiard_break", {"gap": 1e-3, "restitution": 1.0}),
    ],
)
def test_the_checks_hold_with_other_options(name, options):
    assert failed(name, measured(name, "pybullet", **options)) == []


@pytest.mark.parametrize("name", SCENES)
def test_what_a_ball_is_can_be_told_of_every_scene_that_has_one(name):
    asked = {"friction", "restitution", "mass", "radius"}
    assert asked <= set(SCENES[name].options) or name in ("coin", "shapes", "slope"), "these have no ball"


def test_a_thin_coin_goes_round_as_eulers_disk_does():
    alpha, thin = np.radians([3.0, 20.0, 40.0]), SimpleNamespace(radius=0.0375, thickness=1e-9)
    rate, _, _ = coin.rolling(alpha, thin)
    np.testing.assert_allclose(rate, 2.0 * np.sqrt(9.81 / (thin.radius * np.sin(alpha))), rtol=1e-6)
    still = coin.rolling(alpha, SimpleNamespace(radius=0.0129, thickness=0.0022))
    axial = still[0] * np.sin(alpha) * still[2] / still[1]  # with which the middle stands still
    again = coin.rolling(alpha, SimpleNamespace(radius=0.0129, thickness=0.0022), axial)
    np.testing.assert_allclose(again[0], still[0], rtol=1e-12)


def test_a_coin_that_starts_with_another_rate_is_noticed():
    values = measured("coin", NONE, seconds=0.4)
    wrong = values | {"rate_error": 2.0 * 0.02, "rate_highest": values["rate_first"]}
    assert len(failed("coin", wrong)) == 2 > len(failed("coin", measured("coin", NONE)))


def test_the_checks_notice_a_wrong_law():
    """Rigid friction under the name of the default law: the checks against the reference fail."""
    for name in ("rubber_experiment", "golf", "table_tennis"):
        values = measured(name, "pybullet", "coulomb") | {"law": "microslip"}
        assert any("psi_2" in one.name for one in failed(name, values))


def test_the_second_block_stands_at_the_angle_that_gives_the_psi_asked_for():
    for psi in (0.8, 3.0):
        values = measured("rubber_experiment", "pybullet", psi1=psi)
        assert values["psi1_second"] == pytest.approx(psi, rel=1e-3)
        assert values["spin_between"] < -10.0


def test_a_golf_ball_leaves_as_the_scale_of_speeds_has_it():
    """By the law spin over speed and launch angle do not depend on the speed."""
    slow, fast = (measured("golf", "pybullet", speed=speed)["shots"] for speed in (3.0, 6.0))
    for one, two in zip(slow, fast, strict=True):
        assert two["backspin"] / one["backspin"] == pytest.approx(2.0, rel=2e-3)
        assert two["launch_angle"] == pytest.approx(one["launch_angle"], rel=2e-3)


def test_contact_point_of_a_rolling_ball_is_at_rest():
    velocity = contact_velocity([1.0, 0.0, 0.0], [0.0, 20.0, 0.0], [0.0, 0.0, 1.0], 0.05)
    np.testing.assert_allclose(velocity, 0.0, atol=1e-15)


def test_a_rebound_is_told_along_the_slip_before_it():
    pair = ContactPair(MATERIALS["rubber"], RIGID, 0.5, radius=0.02)
    one = rebound_of(pair, pair.chi(1.0, 1.0 / 3.5), [0.3, 0.4, -2.0], [-0.3, -0.4, 1.8], [0.0, 0.0, 1.0])
    assert one["psi1"] == pytest.approx(pair.kappa / 0.5 * 0.25)
    assert one["psi2"] == pytest.approx(-one["psi1"])
    assert one["restitution"] == pytest.approx(0.9)
    assert one["aside"] == pytest.approx(0.0, abs=1e-15)
    assert math.isnan(rebound_of(pair, 1.0, [0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [0.0, 0.0, 1.0])["psi1"])


@pytest.mark.parametrize(
    ("name", "options", "said"),
    [
        ("cradle", {"strikers": 5}, "strikers"),
        ("rubber_experiment", {"psi1": 0.01}, "psi1"),
        ("incline", {"angle": 95.0}, "angle"),
        ("golf", {"speed": -1.0}, "speed"),
        ("billiards", {"sied": 1.0}, "side"),
        ("superball", {"restitution": 0.0}, "restitution = 0.0: must be in"),
        ("heap", {"mass": -1.0}, "mass = -1.0: must be in"),
    ],
)
def test_options_outside_what_is_allowed_are_refused(name, options, said):
    with pytest.raises(ValueError, match=said):
        SCENES[name].run(Settings("pybullet" if name != "heap" else NONE, options=options))


@pytest.mark.parametrize("name", SCENES)
def test_a_value_beyond_the_range_is_answered_at_once(name, monkeypatch):
    """Every option of every scene, and the step: a sentence with the range, before anything is moved."""
    monkeypatch.setattr(type(SCENES[name]), "simulate", None)
    ranges = {"timestep": (LEAST_STEP, LONGEST_STEP)} | {key: one[2:] for key, one in SCENES[name].options.items()}
    for key, (low, high) in ranges.items():
        if (name, key) == ("puck", "spin"):
            continue  # `--launch` says it
        below = 0.1 * low if low > 0.0 else low - 1.0
        whole = key in SCENES[name].options and type(SCENES[name].options[key].default) is int
        for value in (below, 2.0 * high, 1e9, *([] if whole else [math.nan])):
            asked = [name, f"--{key.replace('_', '-')}", f"{value:.0f}" if whole else repr(value)]
            finished = CliRunner().invoke(app, asked, env={"COLUMNS": "300", "TERM": "dumb"})
            assert finished.exit_code == 2, asked
            assert f"{key} = " in finished.output and "must be" in finished.output, finished.output


class Asked(Exception):
    """How many steps a scene would take."""


@pytest.mark.filterwarnings("ignore::contactlaw.ContactWarning")
@pytest.mark.parametrize("name", [name for name in SCENES if name not in ("paddle", "grasp")])  # of their own length
def test_no_value_makes_a_scene_last_beyond_patience(name, monkeypatch):
    """But those that say how long or how many: every other end of a range takes seconds."""

    def record(world, duration, *_, **__):
        raise Asked(duration / world.timestep)

    monkeypatch.setattr(World, "record", record)
    scene, steps = SCENES[name], {}
    for key, option in scene.options.items():
        for value in () if key in ("seconds", "balls", "rows") else (option.low, option.high):
            with pytest.raises((Asked, ValueError)) as raised:  # or values that go with no other's default
                scene.run(Settings(scene.engines[-1], options={key: value}))
            steps |= {(key, value): raised.value.args[0]} if raised.type is Asked else {}
    assert steps
    assert {case: count for case, count in steps.items() if count > 1e5} == {}


def test_what_the_packages_own_world_has_not_is_refused():
    world = new_world(Settings(NONE))
    with pytest.raises(ValueError, match="drives no body; 'bat'"):
        world.paddle("bat", (0.1, 0.1, 0.1), lambda time: (0.0, 0.0, time))
    with pytest.raises(ValueError, match="no contact of its own"):
        SCENES["superball"].run(Settings(NONE, NATIVE))
