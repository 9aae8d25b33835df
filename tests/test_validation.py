"""The validation runner: it finds its cases, tells a missed limit, and makes its report from saved results alone."""

from __future__ import annotations

import json
import math
import re
import subprocess
import sys
from pathlib import Path
from typing import ClassVar

import pytest
from typer.testing import CliRunner

from validation import report, runner, store
from validation.__main__ import app
from validation.case import CASES, Case, Limit, Outcome, Table, find_cases, register, select

FOLDER = Path(store.HERE)
FILES = sorted(path.stem for path in (FOLDER / "cases").glob("[!_]*.py"))


class Sample(Case):
    """A case that misses one of two limits."""

    name = "sample"
    title = "A sample"
    claim = "Seven is at most five."

    def run(self, quick, progress):
        """Two limits."""
        progress(1.0)
        return Outcome([Limit("seven", 5.0, 7.0), Limit("eight", 5.0, 8.0, "us", at_least=True)], {"seven": 7.0})

    def table(self, data):
        """One row."""
        return Table(["number"], [[f"{data['seven']:.3f}"]])


def test_every_file_of_the_folder_is_a_case_of_its_name():
    assert sorted(find_cases()) == FILES


@pytest.mark.parametrize("name", FILES)
def test_a_case_says_what_it_claims(name):
    case = find_cases()[name]
    assert case.title and case.claim.endswith(".")
    assert bool(case.caption) == (type(case).draw is not Case.draw)


def test_two_cases_of_one_name_are_refused():
    find_cases()

    class Twin(Sample):
        name: ClassVar[str] = FILES[0]

    with pytest.raises(ValueError, match="has a case of this name already"):
        register(Twin)
    assert type(CASES[FILES[0]]) is not Twin


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
    assert "1 of 2 MISSED" in text
    assert "| seven | at most 5 | 7 | MISSED |" in text
    assert "| eight | at least 5 us | 8 us | kept |" in text


def test_a_case_that_raises_is_not_sane_and_stops_nothing(tmp_path):
    class Broken(Sample):
        def run(self, quick, progress):
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


def test_a_case_without_its_extra_is_skipped_with_a_message(tmp_path, monkeypatch):
    monkeypatch.setattr("validation.runner.find_spec", lambda name: None)
    result = CliRunner().invoke(app, ["-f", "^mujoco_cost$", "--folder", str(tmp_path)])
    assert "skipped, needs mujoco" in result.output
    assert not (tmp_path / "results" / "mujoco_cost.json").exists()


@pytest.mark.skipif(not (FOLDER / "report.md").exists(), reason="no report yet")
def test_the_committed_report_is_that_of_the_committed_results(tmp_path):
    (tmp_path / "results").symlink_to(FOLDER / "results")
    assert report.write(find_cases().values(), tmp_path).read_text() == (FOLDER / "report.md").read_text()


def test_saved_results_are_small():
    for path in (FOLDER / "results").glob("*"):
        assert path.stat().st_size < 150_000, path
    for path in (FOLDER / "results").glob("*.json"):
        assert not re.search(r"NaN|Infinity", path.read_text()), path
