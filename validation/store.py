"""Saving and loading of results: one small JSON per case, with a stamp of the sources that it was measured with."""

import hashlib
import inspect
import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

from contactlaw.files import whole
from contactlaw.jit import SOURCE_STAMP
from validation.case import Case, Outcome

HERE = Path(__file__).resolve().parent
ONLY_SHOW = ("__main__.py", "report.py", "readme.py")
"""Files of validation that measure nothing."""
Result = dict[str, Any]


def stamp_of(case: Case) -> str:
    """A hash of the package, the scenes, the case's own file, and all that the cases share; not of other cases."""
    own = Path(inspect.getfile(type(case))).resolve()
    shared = [*HERE.rglob("*.py"), *(HERE / "data").glob("*.csv"), *(HERE.parent / "sims").rglob("*.py")]
    others = {HERE / name for name in ONLY_SHOW} | {path for path in shared if path.parent == HERE / "cases"}
    digest = hashlib.sha256(SOURCE_STAMP.encode())
    for path in sorted({own, *shared} - (others - {own})):
        digest.update(path.name.encode() + path.read_bytes())
    return digest.hexdigest()[:12]


def as_result(
    case: Case, outcome: Outcome, *, quick: bool, seconds: float, machine: dict[str, Any], sources: str
) -> Result:
    """A result as it is saved: JSON types, floats to six significant digits.

    JSON has no numbers that are not finite: data that hold one make the run not sane; what has no value is None.
    seconds: how long it took; machine: that and versions, by name; sources: a stamp of them.
    """
    limits = [{**asdict(limit), "passed": limit.passed} for limit in outcome.limits]
    data, odd = _rounded(outcome.data), []
    json.loads(json.dumps(data), parse_constant=odd.append)  # NaN and infinities are told, and nothing else
    problems = [*outcome.problems, *(["a value is not finite"] if odd else [])]
    kept = not problems and all(limit["passed"] for limit in limits)
    return _rounded({
        "case": case.name, "claim": case.claim, "quick": quick, "sane": not problems, "problems": problems,
        "passed": kept, "limits": limits, "seconds": seconds, "machine": machine, "sources": sources, "data": data,
    })  # fmt: skip


def save(result: Result, folder: Path) -> Path:
    """Write results/<case>.json in a folder, whole or not at all."""
    path = folder / "results" / f"{result['case']}.json"
    path.parent.mkdir(parents=True, exist_ok=True)
    with whole(path) as part:
        part.write_text(_text(result) + "\n")
    return path


def load(name: str, folder: Path) -> Result | None:
    """The saved result of a case, or None."""
    path = folder / "results" / f"{name}.json"
    return json.loads(path.read_text()) if path.exists() else None


def _rounded(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _rounded(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_rounded(item) for item in value]
    if hasattr(value, "tolist"):  # numpy
        return _rounded(value.tolist())
    if isinstance(value, float):
        return float(f"{value:.6g}")
    return value


def _text(value: Any, depth: int = 0) -> str:
    """JSON with one line for each short entry."""
    flat = json.dumps(value)
    nested = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    if len(flat) <= 100 or not (isinstance(value, dict) or any(isinstance(item, dict | list) for item in nested)):
        return flat
    pad = "  " * (depth + 1)
    if isinstance(value, dict):
        inner = [f"{pad}{json.dumps(key)}: {_text(item, depth + 1)}" for key, item in value.items()]
        return "{\n" + ",\n".join(inner) + "\n" + "  " * depth + "}"
    return "[\n" + ",\n".join(pad + _text(item, depth + 1) for item in value) + "\n" + "  " * depth + "]"
