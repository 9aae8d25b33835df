"""The command line of the scenes: what it answers, prints and draws."""

import importlib.util
import json
import re
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("typer")
from typer.testing import CliRunner

from sims import compare, puck, show
from sims.cli import app
from sims.scene import Limit, Settings, find_scenes

SCENES = find_scenes()
BOUNCE_KEYS = ["time", "x", "psi1", "psi2", "psi2_reference", "spin_before", "spin_after", "energy"]


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


@pytest.mark.parametrize("name", SCENES)
def test_the_help_of_a_scene_names_its_options_and_fits_eighty_columns(name):
    finished = CliRunner().invoke(app, [name, "--help"], env={"COLUMNS": "80", "TERM": "dumb"})
    assert finished.exit_code == 0 and max(map(len, finished.output.splitlines())) <= 80
    hidden = {"spin"} if name == "puck" else set()
    for option in {"engine", "law", "timestep", "json", "gif", *SCENES[name].options} - hidden:
        assert f"--{option.replace('_', '-')} " in finished.output


def test_a_superball_as_one_json_object(engine):
    finished = CliRunner().invoke(app, ["superball", "--engine", engine, "--bounces", "2", "--json"])
    assert finished.exit_code == 0, finished.output
    values = json.loads(finished.stdout)
    assert [list(one)[: len(BOUNCE_KEYS)] for one in values["bounces"]] == [BOUNCE_KEYS] * 2


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
    shown = Path(__file__).parents[2] / "sims" / "figures" / "superball.gif"
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


def test_both_engines_where_there_is_one_says_why():
    finished = CliRunner().invoke(app, ["heap", "--engine", "both"], env={"COLUMNS": "300", "TERM": "dumb"})
    assert finished.exit_code == 2
    assert "must be one of mujoco, none; heap is not in pybullet: reading" in " ".join(finished.output.split())


def test_a_run_that_takes_long_says_how_long(monkeypatch, capsys):
    clock = iter([0.0, 1.0, 2.9, 3.1, 9.0])
    monkeypatch.setattr(show, "perf_counter", lambda: next(clock))
    monkeypatch.setattr(show.messages, "_force_terminal", False)

    def crawl(settings):
        for part in (0.0, 0.01, 0.02, 0.025, 0.03):
            settings.progress(part)

    scene = SimpleNamespace(name="heap", options=SCENES["heap"].options, run=crawl)
    show.run(scene, Settings("none", options={"balls": 9000, "mass": None, "friction": 0.3}))
    said = capsys.readouterr().err.strip().splitlines()
    assert said == ["heap in none with balls = 9000: up to about 2 min to go; Ctrl-C ends it"]

    clock = iter([0.0, 4.0])
    quick = SimpleNamespace(name="heap", options={}, run=lambda settings: [settings.progress(x) for x in (0.0, 0.9)])
    show.run(quick, Settings("none"))
    assert capsys.readouterr().err.strip() == "", "nothing is said of what is done soon"

    clock, compiled = iter([0.0, 20.0]), iter([0.0, 19.0])
    monkeypatch.setattr(show, "seconds_compiling", lambda: next(compiled))
    first = SimpleNamespace(name="heap", options={}, run=lambda settings: [settings.progress(x) for x in (0.0, 0.01)])
    show.run(first, Settings("none"))
    assert capsys.readouterr().err.strip() == "", "a first run that compiles does not take that long to its end"


def test_both_engines_in_one_call(tmp_path):
    pytest.importorskip("pybullet")
    finished = CliRunner().invoke(app, ["superball", "--engine", "both", "--bounces", "1"])
    assert finished.exit_code == 0, finished.output
    assert finished.output.count("holds  bounces: 1") == 2


@pytest.mark.parametrize(
    ("name", "unit"),
    [("spin_after", "rad/s"), ("rate_first", "rad/s"), ("rate_error", "-"), ("ball_speed", "m/s"), ("depth_um", "um"),
     ("velocity_closed_form", "m/s"), ("energy", "J"), ("energy_ratio", "-"), ("turning_height", "m"), ("psi2", "-"),
     ("launch_angle_sliding", "degrees"), ("creep_um_per_s", "um/s"), ("settled", "s"), ("spread_over_pitch", "-")],
)  # fmt: skip
def test_a_figure_has_its_unit(name, unit):
    assert show.unit_of(name) == unit


def cells(line):
    """What stands between the upright lines of a table, or between those of its head."""
    return [cell.strip() for cell in line.strip("┃│").split(line[0])]


def tables(lines):
    """Head and rows of each table, the lines of a head joined."""
    found = []
    for line in lines:
        if line.startswith("┏"):
            found.append(([], []))
        elif line[:1] in "┃│" and line:
            found[-1][line[0] == "│"].append(cells(line))
    return [([" ".join(filter(None, column)) for column in zip(*head, strict=True)], rows) for head, rows in found]


def is_number(text):
    try:
        float(text.split(",")[0])
    except ValueError:
        return False
    return True


SMALL = {"heap": ["--balls", "8"], "grasp": ["--seconds", "4"], "coin": ["--seconds", "0.4"],
         "slope": ["--seconds", "2"], "galton": ["--balls", "5", "--rows", "3"]}  # fmt: skip


@pytest.mark.parametrize("name", SCENES)
def test_every_number_in_a_table_has_a_unit_and_fits_eighty_columns(name, engine):
    if engine not in SCENES[name].engines:
        pytest.skip(SCENES[name].unable[engine])
    finished = CliRunner().invoke(app, [name, "--engine", engine, *SMALL.get(name, [])])
    lines = finished.stdout.splitlines()
    assert max(map(len, lines)) <= 80
    (names, rows), *lists = tables(lines)
    assert names == ["quantity", "value", "unit"] and len(rows) > 3
    assert [row for row in rows if is_number(row[1]) == (row[2] == "")] == []
    for head, rows in lists:
        numbers = [is_number(cell) for cell in rows[0]]
        assert [name for name, number in zip(head, numbers, strict=True) if number != name.endswith("]")] == []


def test_a_list_of_nothing_is_shown_as_none():
    with show.console.capture() as printed:
        show.figures({"chi": 1.0, "strokes": {}})
    ((_, rows),) = tables(printed.get().splitlines())
    assert rows == [["chi", "1", "-"], ["strokes", "none", ""]]


def test_the_table_of_the_main_job_has_units_and_fits_eighty_columns():
    pytest.importorskip("pybullet")
    result = puck.run(puck.Puck("steel", -12.5, "linear_spring", "oblique"), "pybullet")
    with show.console.capture() as printed:
        show.console.print(compare._table("steel", [result]))
    lines = printed.get().splitlines()
    assert max(map(len, lines)) <= 80
    ((head, _),) = tables(lines)
    assert head == [
        "engine", "law", "psi_1 [-]", "psi_2 [-]", "reference [-]", "error [-]", "energy [-]", "time [ms]"
    ]  # fmt: skip


def test_off_a_terminal_a_bar_is_a_line_now_and_then(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(show, "OFTEN", 0.02)
    with show.bar() as progress:
        for _ in progress.track(range(4), description="throws", update_period=0.01):
            time.sleep(0.03)
    assert re.search(r"throws: \d+ %", capsys.readouterr().err)


def test_another_engine_is_refused_with_all_that_there_are():
    finished = CliRunner().invoke(app, ["superball", "--engine", "other"], env={"COLUMNS": "300", "TERM": "dumb"})
    assert finished.exit_code == 2
    assert "must be one of mujoco, pybullet, none, both" in " ".join(finished.output.split())
