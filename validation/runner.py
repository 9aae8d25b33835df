"""Run cases, save what they give, draw it, and write the report."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from time import perf_counter

from validation import report, store
from validation.case import Case, Data, Outcome, Progress, find_cases
from validation.measure import machine
from validation.store import Result


def missing_modules(case: Case) -> list[str]:
    """What a case needs and is not installed."""
    return [name for name in case.needs if find_spec(name) is None]


def run_case(case: Case, folder: Path, *, quick: bool = False, progress: Progress = lambda part: None) -> Result:
    """Run one case and save its result and picture.

    A case that fails is saved as not sane, with the error, so that the others still run.
    """
    start = perf_counter()
    try:
        outcome = case.run(quick, progress)
    except Exception as error:
        outcome = Outcome([], {}, [f"{type(error).__name__}: {error}"])
    result = store.as_result(case, outcome, quick=quick, seconds=perf_counter() - start, machine=machine())
    store.save(result, folder)
    if outcome.data:
        draw(case, folder)
    return result


def draw(case: Case, folder: Path) -> Path | None:
    """Draw a case's saved result; None where it has no picture, no data, or matplotlib is not installed."""
    result = store.load(case.name, folder)
    if not case.caption or result is None or not result["data"] or find_spec("matplotlib") is None:
        return None
    from validation.picture import styled

    data: Data = result["data"]
    path = folder / "results" / f"{case.name}.png"
    with styled():
        figure = case.draw(data)
        if figure is None:
            return None
        figure.savefig(path)
    return path


def rewrite(folder: Path, *, pictures: bool = True, told: Callable[[str], None] = lambda text: None) -> Path:
    """Write the report again from what is saved, and draw the pictures again."""
    cases = list(find_cases().values())
    if pictures:
        for case in cases:
            if draw(case, folder):
                told(case.name)
    return report.write(cases, folder)
