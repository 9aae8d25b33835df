"""The tables of README and guide come from the saved results, show the worst, and say what is not measured."""

from __future__ import annotations

from pathlib import Path

import pytest

from validation import readme, report, runner, store
from validation.case import Case, Limit, Outcome, Table, find_cases
from validation.readme import BEGIN, END, Row


class Sample(Case):
    """Four limits."""

    name = "sample"
    title = "A sample"
    claim = "Seven is at most five."

    def run(self, quick):
        """Of two sorts, one of each missed."""
        limits = [
            Limit("error, near", 10.0, 9.0), Limit("error, far", 1.0, 1.5, "m"),
            Limit("rate, slow", 4.0, 5.0, at_least=True), Limit("rate, fast", 2.0, 9.0, at_least=True),
            Limit("failed", 0.0, 0.0), Limit("failed badly", 0.0, 3.0),
        ]  # fmt: skip
        return Outcome(limits, {"times": {"one": 7.25}})

    def table(self, data):
        """No rows."""
        return Table(["nothing"])


def shown(folder: Path) -> list[str]:
    """The lines of the table."""
    return [line for line in readme.block(folder).splitlines() if line.startswith("|")][2:]


@pytest.mark.parametrize(
    ("limits", "expected"),
    [
        ("^error", "| row | at most 1 m | 1.5 m | MISSED |"),
        ("^rate", "| row | at least 4 | 5 | kept |"),
        ("near$", "| row | at most 10 | 9 | kept |"),
        ("^failed$", "| row | at most 0 | 0 | kept |"),
        ("^failed", "| row | at most 0 | 3 | MISSED |"),
    ],
)
def test_of_several_limits_the_worst_is_shown(limits, expected, tmp_path, monkeypatch):
    monkeypatch.setattr(readme, "ROWS", [Row("front", "row", "sample", limits)])
    runner.run_case(Sample(), tmp_path)
    assert shown(tmp_path) == [expected]


def test_a_figure_without_a_limit_is_shown_with_its_unit(tmp_path, monkeypatch):
    monkeypatch.setattr(readme, "ROWS", [Row("front", "row", "sample", "/times/one", "us")])
    runner.run_case(Sample(), tmp_path)
    assert shown(tmp_path) == ["| row |  | 7.25 us | measured |"]


@pytest.mark.parametrize("row", [Row("front", "row", "sample", "^eror"), Row("front", "row", "sample", "/times/two")])
def test_a_row_that_leads_nowhere_is_an_error(row, tmp_path, monkeypatch):
    monkeypatch.setattr(readme, "ROWS", [row])
    runner.run_case(Sample(), tmp_path)
    with pytest.raises(LookupError, match=r"README row 'row': .*sample"):
        readme.block(tmp_path)


def test_rows_that_are_not_for_the_front_stand_in_the_report(tmp_path, monkeypatch):
    monkeypatch.setattr(
        readme, "ROWS", [Row("front", "one", "sample", "^rate"), Row("report", "two", "sample", "near$")]
    )
    runner.run_case(Sample(), tmp_path)
    assert shown(tmp_path) == ["| one | at least 4 | 5 | kept |"]
    text = report.write([Sample()], tmp_path).read_text()
    assert "| one | at least 4 | 5 | kept |\n| two | at most 10 | 9 | kept |" in text


def test_what_is_missed_is_counted(tmp_path, monkeypatch):
    monkeypatch.setattr(readme, "ROWS", [Row("front", "row", "sample", "^rate")])
    runner.run_case(Sample(), tmp_path)
    assert "2 of 6\nlimits are missed" in readme.block(tmp_path)


def test_what_has_no_full_result_is_said_not_to_be_measured(tmp_path, monkeypatch):
    monkeypatch.setattr(readme, "ROWS", [Row("front", "row", "sample", "^rate")])
    assert shown(tmp_path) == ["| row |  |  | not measured |"]
    runner.run_case(Sample(), tmp_path, quick=True)
    assert shown(tmp_path) == ["| row |  |  | not measured |"]


def test_a_run_that_is_not_sane_has_no_figures(tmp_path, monkeypatch):
    class Broken(Sample):
        def run(self, quick):
            return Outcome([Limit("rate", 1.0, 2.0, at_least=True)], {}, ["the ball is gone"])

    monkeypatch.setattr(readme, "ROWS", [Row("front", "row", "sample", "^rate")])
    runner.run_case(Broken(), tmp_path)
    assert shown(tmp_path) == ["| row |  |  | NOT SANE |"]


def test_a_run_into_the_projects_own_folder_writes_the_block_and_nothing_else(tmp_path, monkeypatch):
    monkeypatch.setattr(readme, "ROWS", [Row(page, "row", "sample", "^rate") for page in ("front", "steps")])
    monkeypatch.setattr(runner, "find_cases", lambda: {"sample": Sample()})
    monkeypatch.setattr(runner, "ROOT", tmp_path)
    monkeypatch.setattr(store, "HERE", tmp_path / "validation")
    text = f"before\n\n{BEGIN}\nold\n{END}\n\nafter\n"
    pages = {tmp_path / name: made for name, made in readme.BLOCKS.items()}
    for page in pages:
        page.parent.mkdir(exist_ok=True)
        page.write_text(text)
    for folder in (tmp_path / "elsewhere", runner.quick_folder(store.HERE)):
        runner.run_case(Sample(), folder)
        runner.rewrite(folder)
        assert {page.read_text() for page in pages} == {text}
    runner.run_case(Sample(), store.HERE)
    runner.rewrite(store.HERE)
    for page, made in pages.items():
        before, between, after = readme.split(page.read_text())
        assert (before, after) == ("before\n\n", "\n\nafter\n")
        assert between == made(store.HERE) and "old" not in between


@pytest.mark.parametrize("text", ["", BEGIN, f"{END} {BEGIN}", f"{BEGIN} {END} {BEGIN} {END}"])
def test_a_page_without_its_markers_is_a_clear_error(text):
    with pytest.raises(ValueError, match="once each, in this order"):
        readme.split(text)


def test_every_row_is_of_a_case_and_names_one_thing():
    for row in readme.ROWS:
        assert row.case in find_cases() and row.limits and row.page in ("front", "report", "steps"), row
    assert len(readme.of("front")) == 5


@pytest.mark.parametrize("page", readme.BLOCKS)
def test_committed_pages_show_the_committed_results(page):
    text = (runner.ROOT / page).read_text(encoding="utf-8")
    assert readme.split(text)[1] == readme.BLOCKS[page](store.HERE)
