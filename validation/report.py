"""validation/report.md, made from the saved results alone."""

import re
from collections.abc import Iterable
from itertools import groupby
from pathlib import Path

from contactlaw.files import whole
from validation import readme
from validation.case import Case, Table
from validation.readme import asked, kept, markdown, reached
from validation.store import Result, load

COVER = "law_accuracy"
"""The case whose picture heads the report."""

TEMPLATE = Path(__file__).with_name("report_template.md")
COSTS = """Costs are processor times divided by those of the scene or solver named after "over": native is the engine's
own contact, CG its solver of that name.
"""
MOST_ROWS = 8
"""Rows of a chapter's table; its results hold the others."""


def write(cases: Iterable[Case], folder: Path) -> Path:
    """Write report.md into a folder from its results; cases without a result are named as missing."""
    found = [(case, load(case.name, folder)) for case in cases]
    present = [(case, result) for case, result in found if result is not None]
    covers = (case for case, result in present if case.name == COVER and _drawn(case, result, folder))
    cover = "".join(f"{_picture(case)}\n\n" for case in covers)
    rows = [row for row in readme.of("front", "report") if row.case in {case.name for case, _ in present}]
    table = f"A row for several limits shows the worst.\n\n{markdown(readme.table(rows, folder))}"
    short = f"## In short\n\n{table}\n\n" if rows else ""
    chapters = [_chapter(case, result, folder) for case, result in present]
    missing = [case.name for case, result in found if result is None]
    if missing:
        command = f"python -m validation -f '^({'|'.join(missing)})$'"
        chapters.append(f"## Not measured yet\n\n{', '.join(missing)}: run `{command}`.\n")
    text = TEMPLATE.read_text(encoding="utf-8").format(
        cover=cover, missed=_missed(present), short=short, summary=_summary(present), chapters="\n".join(chapters)
    )
    path = folder / "report.md"
    with whole(path) as part:
        part.write_text(text)
    return path


def verdict(result: Result) -> str:
    """The outcome of a case in a few words."""
    if not result["sane"]:
        return "NOT SANE"
    missed, count = sum(not limit["passed"] for limit in result["limits"]), len(result["limits"])
    return f"{missed} of {count} MISSED" if missed else "kept" if count else "measured"


def limits_table(result: Result) -> Table:
    """Limits asked, values reached."""
    table = Table("limit | asked | reached |")
    for limit in result["limits"]:
        table.rows.append([limit["name"], asked(limit), reached(limit), kept(limit)])
    return table


def link(case: Case, text: str = "") -> str:
    """A text, or the title, linked to the chapter: GitHub drops punctuation from the anchors of headings."""
    anchor = re.sub(r"[^\w -]", "", case.title.lower()).replace(" ", "-")
    return f"[{text or case.title}](#{anchor})"


def _missed(present: list[tuple[Case, Result]]) -> str:
    """Table of every missed limit, and of every run that is not sane."""
    table = Table("case | limit | asked | reached")
    for case, result in present:
        table.rows.extend([link(case), f"**not sane**: {problem}", "", ""] for problem in result["problems"])
        table.rows.extend([link(case), *row[:3]] for row in limits_table(result).rows if row[3] == "MISSED")
    text = f"{COSTS}\n{markdown(table)}" if table.rows else "Nothing: every limit that was measured is kept."
    return f"## What is missed\n\n{text}\n"


def _summary(present: list[tuple[Case, Result]]) -> str:
    """Table of the limits that each case has and misses, and the machines used."""
    table = Table("case | limits | kept | missed | took | on")
    all_asked = all_kept = 0
    for case, result in present:
        count, held = len(result["limits"]), sum(limit["passed"] for limit in result["limits"])
        all_asked, all_kept = all_asked + count, all_kept + held
        figures = [str(count), str(held), f"**{count - held}**" if count > held else ""] if count else [""] * 3
        if not result["sane"]:
            figures[2] = "**NOT SANE**"
        quick = ", quick" if result["quick"] else ""
        took = f"{result['seconds']:.0f} s{quick}"
        table.rows.append([link(case, case.name), *figures, took, result["machine"]["date"]])
    minutes = sum(result["seconds"] for _, result in present) / 60.0
    missed = all_asked - all_kept
    totals = [str(all_asked), str(all_kept), str(missed) if missed else "", f"{minutes:.1f} min", ""]
    table.rows.append([f"all {len(present)}", *totals])
    keys = ("cpu", "cores", "python", "numpy", "numba", "mujoco", "pybullet")
    machines = {", ".join(f"{key} {result['machine'][key]}" for key in keys if key in result["machine"])
                for _, result in present}  # fmt: skip
    lines = ["## All cases", "", markdown(table), "", f"Measured on {'; '.join(sorted(machines))}.", ""]
    if len({result["machine"].get("contactlaw") for _, result in present}) > 1:
        lines += ["**These results come from different versions of the code: run all cases again.**", ""]
    return "\n".join(lines)


def _chapter(case: Case, result: Result, folder: Path) -> str:
    """A claim, its picture, missed and kept limits, and its figures."""
    lines = [f"## {case.title}", "", case.claim, ""]
    if result["problems"]:
        lines += ["**This run is not sane, its figures do not count:** " + "; ".join(result["problems"]), ""]
    if _drawn(case, result, folder):
        lines += [_picture(case), ""]
    for word, passed in (("**MISSED**", False), ("Kept", True)):
        alike = groupby((limit for limit in result["limits"] if limit["passed"] is passed), asked)
        told = [(most, "; ".join(f"{one['name']} **{reached(one)}**" for one in limits)) for most, limits in alike]
        lines += [f"{word}:", "", *(f"- {most}: {ones}" for most, ones in told), ""] if told else []
    if result["data"] and (table := case.table(result["data"])):
        rest = len(table.rows) - MOST_ROWS
        lines += [markdown(table, MOST_ROWS), ""]
        lines += [f"[The results](results/{case.name}.json) have {rest} more rows.\n"] if rest > 0 else []
    return "\n".join(lines)


def _drawn(case: Case, result: Result, folder: Path) -> bool:
    """Return whether there is a picture of this result."""
    return bool(case.caption and result["data"] and (folder / "results" / f"{case.name}.png").exists())


def _picture(case: Case) -> str:
    """The picture and its caption."""
    return f"![{case.title}](results/{case.name}.png)\n\n*{case.caption}*"
