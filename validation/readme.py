"""Tables of the README, the guide and the report, made from the saved results alone."""

import re
from collections.abc import Iterable
from math import inf, isfinite
from pathlib import Path
from typing import Any, NamedTuple

from contactlaw.files import whole
from contactlaw.laws.microslip import NODES
from validation.case import Table
from validation.store import Result, load

BEGIN, END = "<!-- results -->", "<!-- /results -->"


class Row(NamedTuple):
    """One row of a table: what was measured, in words, and the case whose result holds it.

    page: "front", in the README and the report; "report"; or "steps", of the guide, times over the engine's own
    contact. limits: regular expression for the names of limits, of which the worst is shown; or, behind a slash, the
    keys that lead to a figure without a limit in the data, with its unit.
    """

    page: str
    text: str
    case: str
    limits: str
    unit: str = ""


_, *_LINES = Path(__file__).with_suffix(".csv").read_text(encoding="utf-8").replace("{NODES}", str(NODES)).splitlines()
ROWS = [Row(*line.split(";")) for line in _LINES]


def of(*pages: str) -> list[Row]:
    """The rows of some pages."""
    return [row for row in ROWS if row.page in pages]


def number(value: float) -> str:
    """A figure as the tables show it: four significant digits, so that a narrow miss shows."""
    return f"{value:.4g}" if 1e-3 <= abs(value) < 1e5 or value == 0.0 else f"{value:.1e}"


def with_unit(value: float, unit: str) -> str:
    """A figure and its unit, if it has one."""
    return f"{number(value)} {unit}" if unit else number(value)


def asked(limit: dict[str, Any]) -> str:
    """Text of what a saved limit asks."""
    return f"{'at least' if limit['at_least'] else 'at most'} {with_unit(limit['asked'], limit['unit'])}"


def reached(limit: dict[str, Any]) -> str:
    """Text of the value reached."""
    return with_unit(limit["reached"], limit["unit"])


def kept(limit: dict[str, Any]) -> str:
    """Whether a saved limit is kept."""
    return "kept" if limit["passed"] else "MISSED"


def markdown(table: Table, most: int | None = None) -> str:
    """The table in Markdown, with at most `most` rows."""
    rows = [table.heads, ["---"] * len(table.heads), *table.rows[:most]]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in rows)


def table(rows: Iterable[Row], folder: Path) -> Table:
    """Table of limits and values reached, from the full results in a folder; rows without a result say "not measured".

    Raises:
        LookupError: A row names a limit or a figure that the result of its case does not have.
    """
    out = Table("what | asked | reached |")
    out.rows.extend([row.text, *_cells(row, load(row.case, folder))] for row in rows)
    return out


def block(folder: Path) -> str:
    """The text between the README's markers, from the results in a folder."""
    rows = of("front")
    shown = [result for row in rows if (result := load(row.case, folder)) is not None and not result["quick"]]
    days = [result["machine"]["date"] for result in shown]
    machines = sorted({f"{result['machine']['cpu']}, {result['machine']['cores']} cores" for result in shown})
    measured = f" Measured {' to '.join(sorted({min(days), max(days)}))} on {'; '.join(machines)}." if days else ""
    limits = [limit for path in sorted((folder / "results").glob("*.json"))
              if (result := load(path.stem, folder)) is not None for limit in result["limits"]]  # fmt: skip
    missed = sum(not limit["passed"] for limit in limits)
    return (
        f"What was asked, and what `python -m validation` measured; a row for several limits shows the worst. "
        f"{missed} of {len(limits)}\nlimits are missed: the [report](validation/report.md) begins with them, and has "
        f"all figures and pictures.{measured}\n\n{markdown(table(rows, folder))}"
    )


def costs(folder: Path) -> str:
    """The table of the guide's page about steps."""
    return markdown(table(of("steps"), folder))


BLOCKS = {"README.md": block, "docs/steps.md": costs}
"""What stands between the markers, by the page's place in the repository."""


def write(root: Path, folder: Path) -> None:
    """Write the blocks between the markers of the pages; raises as `split`."""
    for name, made in BLOCKS.items():
        before, _, after = split((root / name).read_text(encoding="utf-8"))
        with whole(root / name) as part:
            part.write_text(f"{before}{BEGIN}\n{made(folder)}\n{END}{after}", encoding="utf-8")


def split(text: str) -> tuple[str, str, str]:
    """Split a text into the parts before, between and after the markers.

    Raises:
        ValueError: The text does not have each of the markers once, in order.
    """
    if text.count(BEGIN) != 1 or text.count(END) != 1 or text.index(BEGIN) > text.index(END):
        raise ValueError(f"page: must hold {BEGIN} and {END} once each, in this order")
    before, rest = text.split(BEGIN)
    between, after = rest.split(END)
    return before, between.strip("\n"), after


def _cells(row: Row, result: Result | None) -> list[str]:
    """Asked, reached and the verdict."""
    if result is None or result["quick"]:
        return ["", "", "not measured"]
    if not result["sane"]:
        return ["", "", "NOT SANE"]
    if row.limits.startswith("/"):
        return ["", with_unit(_figure(row, result["data"]), row.unit), "measured"]
    found = [limit for limit in result["limits"] if re.search(row.limits, limit["name"])]
    if not found:
        names = ", ".join(repr(limit["name"]) for limit in result["limits"])
        raise LookupError(f"README row {row.text!r}: {row.limits!r} is no limit of {row.case}; there are {names}")
    worst = max(found, key=_badness)
    return [asked(worst), reached(worst), kept(worst)]


def _figure(row: Row, data: Any) -> float:
    for key in row.limits[1:].split("/"):
        if not isinstance(data, dict) or key not in data:
            raise LookupError(f"README row {row.text!r}: the data of {row.case} has no {row.limits}")
        data = data[key]
    return float(data)


def _badness(limit: dict[str, Any]) -> tuple[bool, float]:
    """Missed before kept, then by how much of the limit is used up."""
    high, low = (limit["asked"], limit["reached"]) if limit["at_least"] else (limit["reached"], limit["asked"])
    if not isfinite(limit["reached"]):
        return True, inf
    return not limit["passed"], high / low if low > 0.0 else inf if high > low else high - low
