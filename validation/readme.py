"""Figures for the README, the guide and the report, made from the saved results and nothing else."""

import re
from collections.abc import Iterable
from math import inf, isfinite
from pathlib import Path
from typing import Any, NamedTuple

from contactlaw.ending import whole
from contactlaw.laws.microslip import NODES
from validation.case import Table
from validation.store import Result, load

BEGIN, END = "<!-- results -->", "<!-- /results -->"


class Row(NamedTuple):
    """One line of the table: what was measured, in words, and the case whose result holds it.

    limits: regular expression for the names of limits; of several the worst is shown. data: or, for a figure without a
    limit, the keys that lead to it in the data, with its unit. front: the README shows it; the report shows all.
    """

    text: str
    case: str
    limits: str = ""
    data: tuple[str, ...] = ()
    unit: str = ""
    front: bool = False


ROWS = (
    Row("An impact by `rebound`, chi 0.5 to 2: largest error in psi_2",
        "law_accuracy", "^largest error of microslip, chi 0.5"),
    Row("The force at any instant of an impact, over mu P_max: largest difference from the annuli",
        "paper_figure_1", "^largest difference"),
    Row("The paper's two methods, chi = 1.256: largest difference in psi_2",
        "superposition", "^largest difference in psi_2"),
    Row("A ball's bounce in MuJoCo and PyBullet, steps from 4 ms to 1 us: largest error in psi_2",
        "any_step", "^error in .* at any step", front=True),
    Row("Energy that a random impact gains, at most",
        "energy", "^largest gain of energy, microslip", front=True),
    Row("Energy at the top of an elastic ball's bounces, largest change, both engines",
        "bouncing", "^energy of the elastic ball"),
    Row("A ball at rest for a minute: jitter over the overlap, both engines",
        "bouncing", "^jitter"),
    Row("Stability, contacts of 0.001 to 1000 steps, 1 kPa to 1 TPa, both engines: cells where the default law fails",
        "stability_map", "^cells that fail"),
    Row("Stability, ten properties taken to their ends, both engines: levels where the default law fails",
        "stability_extremes", "^levels that fail"),
    Row("Finite elements of others, recoil: rms difference over that of the next best law",
        "finite_elements", "^rms of microslip over the next best law's, recoil"),
    Row("Alumina on glass (Kharaz and others), nothing fitted: rms difference of e_t",
        "alumina_on_glass", "^rms of microslip in e_t"),
    Row("A MuJoCo step with a bouncing ball, over the native contact",
        "step_cost", "^bouncing, e = 1, over", front=True),
    Row("A MuJoCo step that resolves the contact, over the native contact",
        "step_cost", "^touching, microslip, over"),
    Row("A PyBullet step with a bouncing ball, over the native contact",
        "step_cost", "^PyBullet, bouncing, e = 1, over"),
    Row("The same where bodies that nothing can push are not read",
        "step_cost", "^PyBullet, bouncing, fixed bodies not read"),
    Row("A PyBullet step with a bouncing ball as time, callback and engine together",
        "step_cost", data=("microseconds", "PyBullet, bouncing, e = 1", "median"), unit="us"),
    Row("A box on a slope of 20 degrees for a minute in MuJoCo: creep",
        "crowds", "^creep of a box", front=True),
    Row("Heaps of 8 to 216 steel balls that drop in MuJoCo, over its own contact with CG",
        "crowds", "^heap of (8|64|216)(,| in) .*drop over CG", front=True),
    Row("The same once they sleep",
        "crowds", "^heap of .*, asleep over CG"),
    Row("Force where a slide turns, `MicroslipTurning`, over mu P: largest difference from rings with local friction",
        "turning", "^force along"),
    Row("A bouncing ball that spins about the normal: largest error in psi_2, against a grid with local friction",
        "any_step", "^error of psi_2 in .* spun"),
    Row(f"A substep of one contact with {NODES} nodes, the law alone",
        "front_law", data=("substeps", f"microslip, {NODES} nodes", "median"), unit="ns"),
    Row("A million impacts by `rebound` on two cores at most, error within 0.007",
        "front_law", "^a million impacts, error .*, default"),
)  # fmt: skip
COSTS = (
    Row("MuJoCo: a ball that bounces, elastic", "step_cost", "^bouncing, e = 1, over"),
    Row("a ball that rolls", "step_cost", "^rolling, over"),
    Row("a ball that slides", "step_cost", "^sliding, over"),
    Row("a box that slides, on a plane or on a box", "shapes", "^box sliding .* over"),
    Row("a box at rest, on a plane or on a box", "shapes", "^box at rest .* over"),
    Row("a mesh that tumbles", "shapes", "^mesh tumbling"),
    Row("an ant that stands", "crowds", "^an ant that stands"),
    Row("3000 balls that fall and bounce", "crowds", "^3000 balls"),
    Row("heaps of 8 to 216 steel balls that drop, over CG", "crowds", "^heap of (8|64|216)(,| in) .*drop over CG"),
    Row("the same asleep", "crowds", "^heap of .*, asleep over CG"),
    Row("a heap of 1000", "crowds", "^heap of 1000"),
    Row("64 balls of rubber", "crowds", "^heap of 64 of rubber"),
    Row("64 of glass, R 1 mm", "crowds", "^heap of 64 of glass"),
    Row("a ball that two fingers hold and shake", "crowds", "^grasp .*, over native"),
    Row("5 balls that fall into a narrow tube, until they sleep", "crowds", "^tube of 5, drop"),
    Row("models that others wrote: median", "models", "^cost .* median"),
    Row("models that others wrote: worst", "models", "^cost .* worst"),
    Row("PyBullet: a ball that bounces, elastic", "step_cost", "^PyBullet, bouncing, e = 1, over"),
    Row("the same, `fixed_bodies_move=False`", "step_cost", "^PyBullet, bouncing, fixed bodies not read"),
)  # fmt: skip
"""Time of a step over that of the engine's own contact, for the guide."""


def number(value: float) -> str:
    """A figure as the tables show it: four significant digits, so that a narrow miss shows."""
    return f"{value:.4g}" if 1e-3 <= abs(value) < 1e5 or value == 0.0 else f"{value:.1e}"


def with_unit(value: float, unit: str) -> str:
    """A figure and its unit, if it has one."""
    return f"{number(value)} {unit}" if unit else number(value)


def asked(limit: dict[str, Any]) -> str:
    """What a saved limit asks."""
    return f"{'at least' if limit['at_least'] else 'at most'} {with_unit(limit['asked'], limit['unit'])}"


def kept(limit: dict[str, Any]) -> str:
    """Whether a saved limit is kept."""
    return "kept" if limit["passed"] else "MISSED"


def markdown(table: Table, most: int | None = None) -> str:
    """The table in Markdown, or so many rows of it."""
    rows = [table.heads, ["---"] * len(table.heads), *table.rows[:most]]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in rows)


def table(rows: Iterable[Row], folder: Path) -> Table:
    """Asked and reached, from the full results in a folder; what has none is said not to be measured.

    Raises:
        LookupError: A row names a limit or a figure that the result of its case does not have.
    """
    out = Table("what | asked | reached |")
    out.rows.extend([row.text, *_cells(row, load(row.case, folder))] for row in rows)
    return out


def block(folder: Path) -> str:
    """The text between the README's markers, from the results in a folder."""
    rows = [row for row in ROWS if row.front]
    shown = [result for row in rows if (result := load(row.case, folder)) is not None and not result["quick"]]
    days = [result["machine"]["date"] for result in shown]
    machines = sorted({f"{result['machine']['cpu']}, {result['machine']['cores']} cores" for result in shown})
    measured = f" Measured {' to '.join(sorted({min(days), max(days)}))} on {'; '.join(machines)}." if days else ""
    limits = [limit for path in sorted((folder / "results").glob("*.json"))
              if (result := load(path.stem, folder)) is not None for limit in result["limits"]]  # fmt: skip
    missed = sum(not limit["passed"] for limit in limits)
    return (
        f"Asked of it, and what `python -m validation` measured; of several figures the worst. Of {len(limits)} limits "
        f"{missed} are\nmissed: the [report](validation/report.md) begins with them, and has all figures and pictures."
        f"{measured}\n\n{markdown(table(rows, folder))}"
    )


def costs(folder: Path) -> str:
    """The same of the guide's page about steps."""
    return markdown(table(COSTS, folder))


BLOCKS = {"README.md": block, "docs/steps.md": costs}
"""What stands between the markers, by the page's place in the repository."""


def write(root: Path, folder: Path) -> None:
    """Write the blocks between the markers of the pages; raises as `split`."""
    for name, made in BLOCKS.items():
        before, _, after = split((root / name).read_text(encoding="utf-8"))
        with whole(root / name) as part:
            part.write_text(f"{before}{BEGIN}\n{made(folder)}\n{END}{after}", encoding="utf-8")


def split(text: str) -> tuple[str, str, str]:
    """What stands before, between and after the markers.

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
    if row.data:
        return ["", with_unit(_figure(row, result["data"]), row.unit), "measured"]
    found = [limit for limit in result["limits"] if re.search(row.limits, limit["name"])]
    if not found:
        names = ", ".join(repr(limit["name"]) for limit in result["limits"])
        raise LookupError(f"README row {row.text!r}: {row.limits!r} is no limit of {row.case}; there are {names}")
    worst = max(found, key=_badness)
    return [asked(worst), with_unit(worst["reached"], worst["unit"]), kept(worst)]


def _figure(row: Row, data: Any) -> float:
    for key in row.data:
        if not isinstance(data, dict) or key not in data:
            raise LookupError(f"README row {row.text!r}: the data of {row.case} has no {' / '.join(row.data)}")
        data = data[key]
    return float(data)


def _badness(limit: dict[str, Any]) -> tuple[bool, float]:
    """Missed before kept, then by how much of the limit is used up."""
    high, low = (limit["asked"], limit["reached"]) if limit["at_least"] else (limit["reached"], limit["asked"])
    if not isfinite(limit["reached"]):
        return True, inf
    return not limit["passed"], high / low if low > 0.0 else inf if high > low else high - low
