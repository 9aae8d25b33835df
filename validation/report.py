"""validation/report.md, made from the saved results and nothing else."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from validation.case import Case, Table
from validation.store import Result, load

HEAD = """# Validation

What `contactlaw` claims, each claim with the picture and the figures it rests on. This page is made by `python -m
validation` from the files in `results/`; no number in it is typed.

An oblique impact is described by two numbers: psi_1, the angle of incidence (tangential over normal velocity of the
contact point, times stiffness ratio over friction coefficient), and chi, which holds stiffness ratio and inertia
(1.44 for a steel ball). The question is psi_2, the same angle after the bounce, between -psi_1 (the contact point
reverses) and psi_1 (no friction); e is the restitution. The truth is the *reference*: the annulus solver of Maw,
Barber & Fawcett (1976, 1981), extrapolated. Steps and nodes say how finely a law is resolved in time and across the
contact.
"""


def write(cases: Iterable[Case], folder: Path) -> Path:
    """Write report.md into a folder from its results; cases without a result are named as missing."""
    found = [(case, load(case.name, folder)) for case in cases]
    present = [(case, result) for case, result in found if result is not None]
    parts = [HEAD, _summary(present)]
    parts += [_chapter(case, result, folder) for case, result in present]
    missing = [case.name for case, result in found if result is None]
    if missing:
        parts.append(
            f"## Not measured yet\n\n{', '.join(missing)}: run `python -m validation -f '{'|'.join(missing)}'`.\n"
        )
    path = folder / "report.md"
    path.write_text("\n".join(parts))
    return path


def number(value: float) -> str:
    """A figure as the tables show it: four significant digits, so that a narrow miss shows."""
    return f"{value:.4g}" if 1e-3 <= abs(value) < 1e5 or value == 0.0 else f"{value:.1e}"


def verdict(result: Result) -> str:
    """In one word or a few."""
    if not result["sane"]:
        return "NOT SANE"
    missed = sum(not limit["passed"] for limit in result["limits"])
    if missed:
        return f"{missed} of {len(result['limits'])} MISSED"
    return "kept" if result["limits"] else "measured"


def limits_table(result: Result) -> Table:
    """Asked and reached."""
    table = Table(["limit", "asked", "reached", ""])
    for limit in result["limits"]:
        sign = "at least" if limit["at_least"] else "at most"
        unit = f" {limit['unit']}" if limit["unit"] else ""
        table.rows.append(
            [limit["name"], f"{sign} {number(limit['asked'])}{unit}", f"{number(limit['reached'])}{unit}",
             "kept" if limit["passed"] else "MISSED"]
        )  # fmt: skip
    return table


def _summary(present: list[tuple[Case, Result]]) -> str:
    table = Table(["case", "limits", "took", "on"])
    for case, result in present:
        quick = ", quick" if result["quick"] else ""
        anchor = case.title.lower().replace(" ", "-")
        table.rows.append(
            [f"[{case.title}](#{anchor})", verdict(result), f"{result['seconds']:.0f} s{quick}",
             result["machine"]["date"]]
        )  # fmt: skip
    sources = {result["machine"].get("contactlaw") for _, result in present}
    mixed = (
        "" if len(sources) < 2 else "\nThese results come from different versions of the code: run all cases anew.\n"
    )
    return f"{markdown(table)}\n{mixed}"


def _chapter(case: Case, result: Result, folder: Path) -> str:
    lines = [f"## {case.title}", "", case.claim, ""]
    if result["problems"]:
        lines += ["**This run is not sane, its figures do not count:** " + "; ".join(result["problems"]), ""]
    if case.caption and (folder / "results" / f"{case.name}.png").exists():
        lines += [f"![{case.title}](results/{case.name}.png)", "", f"*{case.caption}*", ""]
    if result["limits"]:
        lines += [markdown(limits_table(result)), ""]
    if result["data"]:
        lines += [markdown(case.table(result["data"])), ""]
    stamp = result["machine"]
    versions = ", ".join(
        f"{key} {stamp[key]}"
        for key in ("python", "numpy", "numba", "mujoco", "pybullet", "contactlaw")
        if key in stamp
    )
    quick = " --quick" if result["quick"] else ""
    lines += [
        f"Repeat: `python -m validation{quick} -f {case.name}` ({result['seconds']:.0f} s). "
        f"Measured {stamp['date']} on {stamp['cpu']}, {stamp['cores']} cores; {versions}.",
        "",
    ]
    return "\n".join(lines)


def markdown(table: Table) -> str:
    """The table in Markdown."""
    rows = [table.heads, ["---"] * len(table.heads), *table.rows]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in rows)
