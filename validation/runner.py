"""Run cases, save and draw their results, and write the report."""

from importlib.util import find_spec
from io import BytesIO
from pathlib import Path
from time import perf_counter

from contactlaw.files import whole
from validation import readme, report, store
from validation.case import Case, Outcome, find_cases
from validation.measure import machine
from validation.store import Result

ROOT = store.HERE.parent


def missing_modules(case: Case) -> list[str]:
    """Modules that a case needs and that are not installed."""
    return [name for name in case.needs if find_spec(name) is None]


def how_to_install(case: Case) -> str:
    """The command that installs all missing modules of a case."""
    return "pip install " + " ".join(case.needs[name] for name in missing_modules(case))


def quick_folder(folder: Path) -> Path:
    """Where quick results go: into a folder of their own, which git ignores, beside the full ones."""
    inner = folder / "quick"
    inner.mkdir(parents=True, exist_ok=True)
    (inner / ".gitignore").write_text("*\n")
    return inner


def finished(case: Case, folder: Path, *, quick: bool = False) -> Result | None:
    """The saved result of a case, if a run now would be of the same sources, length, versions and machine; or None.

    A result that is not sane does not count, since the machine may have been at fault.
    """
    result = store.load(case.name, folder)
    if result is None or not result["sane"] or result["quick"] != quick:
        return None
    if result.get("sources") != store.stamp_of(case):
        return None
    return result if {**result["machine"], "date": ""} == {**machine(), "date": ""} else None


def run_case(case: Case, folder: Path, *, quick: bool = False) -> Result:
    """Run one case, draw its picture and save its result, in this order, so that a saved result is complete.

    A case that fails is saved as not sane, with the error, so that the others still run.
    """
    sources = store.stamp_of(case)
    start = perf_counter()
    try:
        outcome = case.run(quick)
    except Exception as error:
        outcome = Outcome([], {}, [f"{type(error).__name__}: {error}"])
    seconds = perf_counter() - start
    result = store.as_result(case, outcome, quick=quick, seconds=seconds, machine=machine(), sources=sources)
    try:
        draw(case, result, folder)
    except Exception as error:
        result["problems"].append(f"no picture, {type(error).__name__}: {error}")
        result["sane"] = result["passed"] = False
    store.save(result, folder)
    return result


def draw(case: Case, result: Result, folder: Path) -> Path | None:
    """Draw a result; None where it has no picture, no data, or matplotlib is not installed."""
    if not case.caption or not result["data"] or find_spec("matplotlib") is None:
        return None
    from validation.picture import panels, styled

    path = folder / "results" / f"{case.name}.png"
    path.parent.mkdir(parents=True, exist_ok=True)
    with styled():
        figure, axes = panels(**case.sheet)
        case.draw(result["data"], *axes)
        drawn = BytesIO()
        figure.savefig(drawn)
    from PIL import Image

    with Image.open(drawn) as image:  # drawings have few colours: a third of the bytes
        few = image.convert("RGB").quantize(128, Image.Quantize.MAXCOVERAGE)
    with whole(path) as part:
        few.save(part, optimize=True)
    return path


def rewrite(folder: Path, *, pictures: bool = True) -> Path:
    """Write the report from what is saved, and where that is the project's own, the tables of README and guide.

    Args:
        folder: Holds results/, is given report.md.
        pictures: Draw the pictures again too.
    """
    cases = list(find_cases().values())
    if pictures:
        for case in cases:
            if result := store.load(case.name, folder):
                draw(case, result, folder)
    path = report.write(cases, folder)
    if folder.resolve() == store.HERE.resolve():
        readme.write(ROOT, folder)
    return path
