"""The scenes and their command line."""

import importlib.util
import json
import sys
from math import cos, pi, sin, sqrt
from pathlib import Path

import numba
import numpy as np
import pytest

pytest.importorskip("typer")
from typer.testing import CliRunner

from contactlaw import MATERIALS, ContactPair
from sims import show
from sims.bounces import bounces_of
from sims.cli import app
from sims.loaded_rebound import loaded_rebound
from sims.outlines import DARK, polygons_of
from sims.puck import ENGINES, LAUNCHES, SURFACES, Puck, run
from sims.recording import Recording, Track
from sims.scene import Limit, Settings, find_scenes
from sims.superball import BACKSPIN, RADIUS, flight, garwin
from sims.worlds import new_world
from sims.worlds.parts import matrix_to_quaternion, onto
from validation.reference.annulus import rebound_extrapolated

SCENES = find_scenes()
BOUNCE_KEYS = ["time", "x", "psi1", "psi2", "psi2_reference", "spin_before", "spin_after", "energy"]

KEYS = [
    "engine", "law", "material", "mu", "chi", "restitution", "timestep", "contact_duration", "steps", "psi1", "psi2",
    "psi2_reference", "energy_ratio", "wall_time",
]  # fmt: skip

pytestmark = pytest.mark.heavy


@pytest.fixture(params=ENGINES)
def engine(request):
    pytest.importorskip(request.param)
    if request.param == "mujoco" and numba.config.DISABLE_JIT:
        pytest.skip("the MuJoCo plugin needs compiled callbacks")
    return request.param


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
    with pytest.raises(AssertionError, match="psi2 off the reference by"):
        wrong.check()


def test_one_json_object_with_the_agreed_keys(engine):
    arguments = ["puck", "--engine", engine, "--material", "rubber", "--psi1", "1.2", "--launch", "spin", "--json"]
    finished = CliRunner().invoke(app, arguments)
    assert finished.exit_code == 0, finished.output
    values = json.loads(finished.stdout)
    assert list(values) == KEYS
    assert values["psi2"] == pytest.approx(values["psi2_reference"], abs=1e-3)


def test_the_scenes_are_listed():
    assert "puck" in CliRunner().invoke(app, ["list"]).stdout


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--engine", "bulet"], "did you mean 'pybullet'"),
        (["--material", "stele"], "did you mean 'steel'"),
        (["--law", "microslop"], "did you mean 'microslip'"),
        (["--timestep", "0"], "timestep = 0.0"),
        (["--psi1", "nan"], "psi1"),
    ],
)
def test_bad_arguments_are_answered_with_what_is_allowed(arguments, said):
    finished = CliRunner().invoke(app, ["puck", *arguments], env={"COLUMNS": "300", "TERM": "dumb"})
    assert finished.exit_code == 2
    assert said in " ".join(finished.output.split())


@pytest.mark.parametrize("engine", ENGINES)
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


@pytest.mark.parametrize("timestep", [None, 1e-4, 1 / 60])
def test_a_superball_comes_back_bounce_after_bounce(engine, timestep):
    # at 0.1 ms a contact of 3 ms is resolved; 1/60 s is five times as long
    scene = SCENES["superball"]
    measured = scene.measure(scene.run(Settings(engine, timestep=timestep)))
    assert all(check.passed for check in scene.check(measured))
    bounces = measured["bounces"]
    assert len(bounces) == 6
    assert max(abs(one["psi2"] - one["psi2_reference"]) for one in bounces) <= 1e-3  # ten times closer than is asked
    assert all(one["spin_before"] * one["spin_after"] < 0.0 for one in bounces)


def test_the_engines_own_contact_gives_no_superball(engine):
    scene = SCENES["superball"]
    measured = scene.measure(scene.run(Settings(engine, "native")))
    assert all(one["spin_after"] * one["spin_before"] > -1e-3 for one in measured["bounces"])


def test_both_engines_throw_the_same_ball():
    pytest.importorskip("mujoco")
    pytest.importorskip("pybullet")
    scene = SCENES["superball"]
    one, two = (scene.measure(scene.run(Settings(engine)))["bounces"] for engine in ENGINES)
    assert [b["x"] for b in one] == pytest.approx([b["x"] for b in two], abs=1e-3)


def test_a_check_that_is_not_kept_is_seen():
    assert not Limit("error", 0.01, 0.02).passed
    assert not Limit("bounces", 6, 5, at_least=True).passed
    assert not Limit("error", 0.01, float("nan")).passed
    scene = SCENES["superball"]
    measured = scene.measure(scene.run(Settings("pybullet", "coulomb"))) | {"law": "microslip"}
    said = [check.name for check in scene.check(measured) if not check.passed]
    assert "psi2 off the reference at a bounce" in said and "bounces that reverse the spin" in said


def test_weight_in_the_contact():
    for e in (1.0, 0.9):
        light = loaded_rebound(1.2, 1.05, e, 0.0)
        assert light.psi_2 == pytest.approx(rebound_extrapolated(1.2, 1.05, e)[0], abs=1e-4)
        assert light.restitution == pytest.approx(e, abs=1e-8)
    # sliding throughout friction gives mu times the normal impulse, and that is 2 and the load's over the contact
    heavy = loaded_rebound(6.0, 1.05, 1.0, 0.01)
    assert heavy.psi_2 == pytest.approx(6.0 - 2.0 * 1.05 * (2.0 + 0.01 * heavy.duration), abs=1e-5)
    assert heavy.restitution == pytest.approx(1.0, abs=1e-8)  # a load has a potential
    with pytest.raises(ValueError, match="does not leave"):
        loaded_rebound(1.2, 1.05, 0.5, 5.0)


def throw(speed: float = 1.0, height: float = 0.1) -> Recording:
    """A superball before its first bounce, as a recording of one entry."""
    still = np.zeros((1, 3))
    spin = still - [0.0, BACKSPIN * speed / RADIUS, 0.0]
    track = Track(
        "ball", "ball", (RADIUS,), still + [0, 0, RADIUS + height], np.eye(3)[None], still + [speed, 0, 0], spin
    )
    return Recording(np.zeros(1), [track], facts={"gravity": [0.0, 0.0, -9.81]})


def test_bounces_are_found_between_the_entries_of_a_recording():
    height, speed = 0.1, 1.0
    fall = sqrt(2.0 * height / 9.81)
    bounces = bounces_of(flight(throw(speed, height), garwin, 4), "ball")
    assert [one.time for one in bounces] == pytest.approx([fall, 3 * fall, 5 * fall, 7 * fall], abs=1e-9)
    for number, one in enumerate(bounces):
        side = (-1.0) ** number
        assert one.place == pytest.approx([side * speed * fall, 0.0, RADIUS], abs=1e-9)
        assert one.velocity_before[0] == pytest.approx(side * speed) and one.velocity_after[0] == pytest.approx(
            -side * speed
        )
        assert one.approach == pytest.approx(9.81 * fall) and one.departure == pytest.approx(9.81 * fall)
        before, after = one.sliding(RADIUS)
        assert before == pytest.approx(side * (1.0 + BACKSPIN) * speed) and after == pytest.approx(-before)
        assert one.duration == pytest.approx(0.0, abs=1e-9)


def test_a_recording_is_kept(tmp_path):
    recording = SCENES["under_table"].run(Settings("pybullet"))
    kept = Recording.load(recording.save(tmp_path / "kept.npz"))
    assert kept.facts == recording.facts and kept.view == recording.view
    assert np.array_equal(kept.times, recording.times)
    for one, two in zip(kept.tracks, recording.tracks, strict=True):
        assert (one.name, one.shape, one.size, one.mass, one.inertia) == (
            two.name, two.shape, two.size, two.mass, two.inertia,
        )  # fmt: skip
        for kind in ("positions", "rotations", "velocities", "spins"):
            assert np.array_equal(getattr(one, kind), getattr(two, kind))
    for one, two in zip(kept.scenery, recording.scenery, strict=True):
        assert (one.name, one.solid) == (two.name, two.solid) and np.array_equal(one.points, two.points)
    scene = SCENES["under_table"]
    assert scene.measure(kept) == scene.measure(recording)


def test_velocities_of_a_recording_are_true_ones(engine):
    world = new_world(Settings(engine, timestep=4e-3))
    turn = onto(np.array([0.6, 0.0, 0.8]))
    world.box("brick", [0.1, 0.1, 0.1], 2.0, [0, 0, 1.0], [0.3, -0.2, 1.5], [0.5, -2.0, 1.0], rotation=turn)
    world.plane("floor")
    recording = world.record(0.2)
    brick = recording.track("brick")
    assert brick.velocities[:, 2] == pytest.approx(1.5 - 9.81 * recording.times, abs=1e-9)
    assert brick.positions[:, 2] == pytest.approx(1.0 + 1.5 * recording.times - 4.905 * recording.times**2, abs=1e-9)
    assert np.ptp(brick.energy([0.0, 0.0, -9.81])) < 1e-9
    assert brick.spins == pytest.approx(np.tile([0.5, -2.0, 1.0], (recording.times.size, 1)), abs=1e-9)
    assert brick.rotations[0] == pytest.approx(turn)


def test_a_paddle_follows_its_path_and_gives_a_ball_its_speed(engine):
    def path(time: float) -> list[float]:
        return [0.0, 0.0, -0.01 + 2.0 * time]

    steel = ContactPair(MATERIALS["steel"], MATERIALS["steel"], 0.2)
    world = new_world(Settings(engine, timestep=1e-3), gravity=(0, 0, 0))
    world.ball("ball", 0.02, 0.1, [0, 0, 0.05])
    world.paddle("paddle", [0.1, 0.1, 0.01], path)
    world.contact("ball", "paddle", steel)
    recording = world.record(0.05)
    paddle, ball = recording.track("paddle"), recording.track("ball")
    assert paddle.positions == pytest.approx(np.array([path(t) for t in recording.times]), abs=1e-9)
    assert paddle.velocities[1:, 2] == pytest.approx(2.0)
    assert ball.velocities[-1, 2] == pytest.approx(4.0, rel=2e-3)  # elastic, off something that nothing slows


def test_quaternions_turn_as_their_matrices():
    for angle in (0.0, 0.7, 2.5, pi):
        for number in range(3):
            axis = np.roll([1.0, 0.0, 0.0], number)
            skew = np.cross(axis, np.eye(3)).T
            matrix = np.eye(3) + sin(angle) * skew + (1.0 - cos(angle)) * skew @ skew
            expected = np.array([cos(0.5 * angle), *(sin(0.5 * angle) * axis)])
            assert abs(matrix_to_quaternion(matrix) @ expected) == pytest.approx(1.0)
    assert onto(np.array([0.6, 0.0, 0.8])) @ [0, 0, 1] == pytest.approx([0.6, 0.0, 0.8])


@pytest.mark.parametrize(("turn", "dark"), [(0.0, 0.5), (0.5 * pi, 0.0), (-0.5 * pi, 1.0), (-pi / 6, 0.75)])
def test_the_dark_half_of_a_ball_is_seen_as_it_is_turned(turn, dark):
    # the ball's x axis lies in the picture, then points away from who looks along +y, then at them
    matrix = np.array([[cos(turn), -sin(turn), 0.0], [sin(turn), cos(turn), 0.0], [0.0, 0.0, 1.0]])
    still = np.zeros((1, 3))
    track = Track("ball", "ball", (1.0,), still, matrix[None], still, still)
    corners = next(corners for corners, tone in polygons_of(track, 0, (0, 2)) if tone == DARK)
    x, y = corners.T
    area = 0.5 * abs(float(x @ np.roll(y, 1) - y @ np.roll(x, 1)))
    assert area == pytest.approx(dark * pi, abs=0.01)


def test_what_is_wrong_with_a_world_is_said():
    pytest.importorskip("pybullet")
    world = new_world(Settings("pybullet"))
    world.plane("floor")
    with pytest.raises(ValueError, match="one of this name"):
        world.ball("floor", 0.1, 1.0, [0, 0, 1])
    with pytest.raises(ValueError, match="name = 'bal'"):
        world.contact("bal", "floor", ContactPair(MATERIALS["steel"], MATERIALS["steel"], 0.2))
    world.ball("ball", 0.1, 1.0, [0, 0, 1])
    world.record(0.01)  # and let go of the engine
    with pytest.raises(ValueError, match="bounces = 99"):
        SCENES["superball"].run(Settings("pybullet", options={"bounces": 99}))
    with pytest.raises(ValueError, match="option = 'bounce'"):
        SCENES["superball"].run(Settings("pybullet", options={"bounce": 3}))


def test_a_superball_as_one_json_object(engine):
    finished = CliRunner().invoke(app, ["superball", "--engine", engine, "--bounces", "2", "--json"])
    assert finished.exit_code == 0, finished.output
    values = json.loads(finished.stdout)
    assert [list(one)[: len(BOUNCE_KEYS)] for one in values["bounces"]] == [BOUNCE_KEYS] * 2


def test_the_puck_as_a_scene_is_the_same_throw(engine):
    scene = SCENES["puck"]
    seen = scene.measure(scene.run(Settings(engine, material="rubber", options={"psi1": 2.2, "spin": 1})))
    asked = run(Puck("rubber", 2.2, launch="spin"), engine)
    assert list(seen) == KEYS
    assert seen["psi1"] == pytest.approx(asked.psi1) and seen["psi2"] == pytest.approx(asked.psi2, abs=4e-3)
    assert seen["energy_ratio"] == pytest.approx(asked.energy_ratio, abs=4e-3)


def test_a_failed_check_is_an_exit_code(monkeypatch):
    monkeypatch.setattr(type(SCENES["superball"]), "check", lambda self, measured: [Limit("never", 0.0, 1.0)])
    finished = CliRunner().invoke(app, ["superball", "--engine", "pybullet"])
    assert finished.exit_code == 1 and "FAILS" in finished.output


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["superbal"], "did you mean 'superball'"),
        (["superball", "--law", "microslop"], "did you mean 'microslip'"),
        (["superball", "--material", "ruber"], "did you mean 'rubber'"),
        (["superball", "--bounces", "0"], "bounces = 0"),
        (["under_table", "--clearance", "0.01"], "clearance = 0.01"),
    ],
)
def test_a_scene_is_told_what_is_allowed(arguments, said):
    finished = CliRunner().invoke(app, arguments, env={"COLUMNS": "300", "TERM": "dumb"})
    assert finished.exit_code == 2
    assert said in " ".join(finished.output.split())


def test_the_pictures_of_a_scene(tmp_path):
    image = pytest.importorskip("PIL.Image")
    png, gif = tmp_path / "under.png", tmp_path / "under.gif"
    finished = CliRunner().invoke(app, ["under_table", "--engine", "pybullet", "--plot", str(png), "--gif", str(gif)])
    assert finished.exit_code == 0, finished.output
    with image.open(png) as picture:
        assert len(picture.convert("RGB").getcolors(1 << 24)) > 50
    seen, lasting = [], 0
    with image.open(gif) as movie:
        for number in range(movie.n_frames):
            movie.seek(number)
            lasting += movie.info["duration"]
            seen.append(np.asarray(movie.convert("RGB")))
    assert lasting == round(1000 * 10.0 * 0.36) + 1500  # ten times slower than life, and a last frame that stands
    assert (seen[0] != seen[len(seen) // 2]).any(axis=2).mean() > 1e-3


def test_the_picture_that_is_shown_first_is_small():
    shown = Path(__file__).parent.parent / "sims" / "figures" / "superball.gif"
    assert 10_000 < shown.stat().st_size <= 400_000


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["superball", "--speed", "0"], "speed = 0.0: must be in [0.001, 1000]"),
        (["superball", "--speed", "1e9"], "speed = 1000000000.0: must be in"),
        (["superball", "--drop", "1e-9"], "drop = 1e-09: must be in"),
        (["superball", "--timestep", "10"], "timestep = 10.0: must be in [1e-08, 0.05] s"),
        (["superball", "--timestep", "1e-9"], "timestep = 1e-09: must be in"),
        (["superball", "--timestep", "1e-8"], "more than 1e+07; ask for a longer one"),
        (["cradle", "--speed", "inf"], "speed = inf"),
        (["puck", "--timestep", "1"], "timestep = 1.0"),
        (["puck", "--psi1", "1e9"], "psi1 = 1000000000.0: must be in [-1000, 1000]"),
        (["puck", "--friction", "0"], "friction = 0.0: must be in"),
        (["golf", "--material", "steel"], "golf has materials of its own"),
        (["superball", "--engine", "none", "--law", "native"], "has no contact of its own"),
        (["superball", "--gif", "x.png"], "must end in .gif"),
        (["grasp", "--view"], "view: there is no"),
        (["coin", "--timestep", "1"], "timestep = 1.0: must be in"),
        (["galton", "--radius", "5"], "radius = 5.0: must be in"),
        (["cradle", "--law", "native_damped"], "is for puck, superball in mujoco"),
        (["superball", "--engine", "pybullet", "--law", "native_damped"], "is for puck, superball in mujoco"),
    ],
)
def test_values_that_make_no_scene_are_answered_at_once(arguments, said):
    finished = CliRunner().invoke(app, arguments, env={"COLUMNS": "300", "TERM": "dumb"})
    assert finished.exit_code == 2
    assert said in " ".join(finished.output.split())


def test_a_video_is_written_or_said_to_need_the_extra(tmp_path, monkeypatch):
    pytest.importorskip("PIL")
    file = tmp_path / "under.mp4"
    command = ["under_table", "--engine", "none", "--mp4", str(file)]
    if importlib.util.find_spec("imageio_ffmpeg"):
        assert CliRunner().invoke(app, command).exit_code == 0 and file.stat().st_size > 10_000
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    finished = CliRunner().invoke(app, command, env={"COLUMNS": "300", "TERM": "dumb"})
    assert finished.exit_code == 2 and "pip install 'contactlaw[video]'" in finished.output


def test_a_scene_without_an_engine_has_pictures(tmp_path):
    pytest.importorskip("matplotlib")
    file = tmp_path / "ball.png"
    finished = CliRunner().invoke(app, ["superball", "--engine", "none", "--bounces", "1", "--plot", str(file)])
    assert finished.exit_code == 0 and file.stat().st_size > 10_000


def test_both_engines_in_one_call(tmp_path):
    pytest.importorskip("pybullet")
    finished = CliRunner().invoke(app, ["superball", "--engine", "both", "--bounces", "1"])
    assert finished.exit_code == 0, finished.output
    assert finished.output.count("holds  bounces: 1") == 2


@pytest.mark.parametrize(
    ("name", "unit"),
    [("spin_after", "rad/s"), ("rate_first", "rad/s"), ("rate_error", ""), ("ball_speed", "m/s"), ("depth_um", "um"),
     ("velocity_closed_form", "m/s"), ("energy", "J"), ("energy_ratio", ""), ("turning_height", "m"), ("psi2", ""),
     ("launch_angle_sliding", "degrees"), ("creep_um_per_s", "um/s"), ("settled", "s"), ("spread_over_pitch", "")],
)  # fmt: skip
def test_a_figure_has_its_unit(name, unit):
    assert show.unit_of(name) == unit


def test_tables_have_units_and_fit_eighty_columns():
    finished = CliRunner().invoke(app, ["superball", "--engine", "pybullet", "--bounces", "2"])
    assert finished.exit_code == 0, finished.output
    for unit in ("[rad/s]", "[J]", "[s]", "[m]"):
        assert unit in finished.output
    assert max(len(line) for line in finished.output.splitlines() if "asked" not in line) <= 80


def test_with_friction_set_mujoco_stops_the_slip_and_loses_restitution():
    pytest.importorskip("mujoco")
    damped, stiff, rigid = (run(Puck("steel", 2.0, law), "mujoco") for law in ("native_damped", "native", "coulomb"))
    assert abs(damped.psi2 - rigid.psi2) < 0.1 < stiff.psi2
    assert damped.energy_ratio < rigid.energy_ratio - 0.03, "less than rigid friction and the restitution leave"
