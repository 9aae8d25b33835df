"""Which ingredients of the law each scene can do without, what that changes and what it saves."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sims.panel import ENGINE_NAMES
from validation.case import Case, Data, Limit, Outcome, Progress, Table, register
from validation.picture import SETTINGS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

TRACED = "pybullet"  # which runs without the compiler, too
QUICK = {"mujoco": ("puck", "superball", "cradle"), "pybullet": ("table tennis",)}
BUDGET, QUICK_BUDGET = 1.4, 0.1  # for the interleaved rounds of a scene [s]
TABLE = "gravity and the air table's own contact"  # of the puck: stands in the column of gravity
LIGHT, DARK = -7.0, 0.5  # decimal logarithms of the changes that are drawn lightest and darkest


@register
class LeaveOut(Case):
    """Scene by ingredient: change, time saved, verdict."""

    name = "leave_out"
    place = 96
    title = "What each scene can leave out"
    claim = (
        "Each scene is built with every ingredient of the law, then with one left out: what its result (psi_2, or a "
        "velocity after over one before, the largest change) changes by, and the part of the time that is saved. What "
        "changes it by at most 1e-4, a quarter of the law's own error, is what the scene has no use for, and can be "
        "left out; that must also hold of all such ingredients together, and of what the scenes as shipped leave out. "
        "Fewer substeps are accuracy given away, and change more. A saving counts from 2 % on, and where it is twice "
        "what two runs of the same build differ by. The engines' kernels call a law by its address: a scene runs its "
        "own laws and no other (rows 'terms', counted with the compiler off). Whole impacts and substeps of one "
        "contact are timed by law, without an engine. The paddle, a body with a joint, is built by hand and not varied."
    )
    caption = (
        "Change of a scene's result without an ingredient (above; 'other': another motion altogether) and the time "
        "saved without it (below; sub-cycling: how many times longer the run takes with steps of a 200th of the "
        "contact instead). Darker: larger change. Framed: can be left out, and saves time. The puck's gravity comes "
        "with its air table, whose own contact is the engine's. Native contact: the engine's own between the same "
        "bodies, detected to be left out."
    )
    needs = ("mujoco", "pybullet", "scipy")

    def run(self, quick: bool, progress: Progress) -> Outcome:
        """Scene after scene; the resolved runs are long ones and not repeated."""
        from validation.leave_out_entered import seen
        from validation.leave_out_kernels import kernel_times
        from validation.leave_out_measure import grouping, judge, sub_cycling, table_of_puck
        from validation.leave_out_scenes import subjects

        data: Data = {"engines": {}, "grouping": {}, "kernels": kernel_times(15 if quick else 100)}
        known = subjects()
        names = {engine: QUICK[engine] if quick else tuple(known) for engine in ENGINE_NAMES}
        done, total = 0, sum(len(some) for some in names.values())
        for engine, some in names.items():
            data["engines"][engine] = {}
            for name in some:
                found = judge(known[name], engine, QUICK_BUDGET if quick else BUDGET)
                if name == "puck":
                    found["cells"][TABLE] = table_of_puck(engine, 10 if quick else 30)
                found["sub_cycling"] = None if quick else sub_cycling(known[name], engine)
                data["engines"][engine][name] = found
                done += 1
                progress(done / total)
            data["grouping"][engine] = grouping(engine)
        data["entered"] = seen(list(names[TRACED]))
        return Outcome(_limits(data), data, _problems(data))

    def table(self, data: Data) -> Table:
        """A row for each scene and engine, then the kernels."""
        table = Table(["scene", "with everything [ms]", "can be left out", "saves nothing", "needed",
                       "all that can be, together", "as shipped"])  # fmt: skip
        for engine, scenes in data["engines"].items():
            for name, found in scenes.items():
                table.rows.append([f"{name}, {ENGINE_NAMES[engine]}", *_row(found)])
        for what, change in data["grouping"].items():
            table.rows.append([
                f"grouping of contacts, {ENGINE_NAMES[what]}", "", "cannot be turned off: contacts that share bodies "
                "are integrated together, whichever call added them", "", "",
                f"cradle with a call for each couple: changes {_number(change)}", "",
            ])  # fmt: skip
        for name, one in data["entered"].items():
            table.rows.append([f"terms, {name}, {ENGINE_NAMES[TRACED]}", "", "", "", "", "", _terms(one)])
        for what, time in data["kernels"].items():
            said = f"{time['median']:.0f} ns ({time['low']:.0f} to {time['high']:.0f})"
            table.rows.append([f"kernel, {what}", said, "", "", "", "", ""])
        return table

    def draw(self, data: Data) -> Figure:
        """A map for each engine."""
        from matplotlib.figure import Figure

        figure = Figure(figsize=(11.5, 1.6 + 0.46 * sum(len(found) for found in data["engines"].values())),
                        layout="constrained")  # fmt: skip
        heights = [len(found) for found in data["engines"].values()]
        for axes, (engine, found) in zip(figure.subplots(len(heights), 1, height_ratios=heights),
                                         data["engines"].items(), strict=True):  # fmt: skip
            _draw_map(axes, engine, found)
        return figure


def _limits(data: Data) -> list[Limit]:
    from validation.leave_out_measure import ALLOWED, OUT

    scenes = [found for engine in data["engines"].values() for found in engine.values()]
    single = [cell["change"] for found in scenes for cell in found["cells"].values() if cell["verdict"] == OUT]
    return [
        Limit("change by one ingredient that is said to be left out", ALLOWED, max(single, default=0.0)),
        Limit("change by all of them together", ALLOWED, _largest(found["together"]["change"] for found in scenes)),
        Limit("change by what the scenes as shipped leave out", ALLOWED,
              _largest(found["shipped"]["change"] for found in scenes)),
        Limit("change by giving the cradle's couples one by one", 0.0, _largest(data["grouping"].values())),
    ]  # fmt: skip


def _terms(entered: Data) -> str:
    """What a scene as shipped runs of the kernels and the laws."""
    calls = entered["calls"]
    laws = ", ".join(f"{count} steps by {law}" for law, count in entered["laws"].items()) or "no step"
    terms = {
        "nodes": calls.get("microslip.displace", 0),
        "single spring": calls.get("single_spring.spring_force", 0),
        "damper": entered["damper"],
        "intervals": calls.get("intervals.march", 0),
    }
    has = ", ".join(f"{what} {count}" for what, count in terms.items() if count) or "none of the terms"
    never = ", ".join(what for what, count in terms.items() if not count) or "nothing"
    return f"{laws}: {has}; never {never}"


def _largest(changes: Any) -> float:
    """The largest change; infinite where one made another motion of it."""
    return max(float("inf") if change is None else change for change in changes)


def _problems(data: Data) -> list[str]:
    return [
        f"{name} in {engine}: result {found['result']}"
        for engine, scenes in data["engines"].items()
        for name, found in scenes.items()
        if not found["result"] or not np.isfinite(found["result"]).all()
    ]


def _number(change: float | None) -> str:
    """A change in few characters."""
    if change is None:
        return "other"
    if change == 0.0:
        return "0"
    if 1e-2 <= change < 100.0:
        return f"{change:.2g}"
    digits = 1 if 1e-4 <= change < 1e-2 else 0  # these stand beside what is allowed
    return f"{change:.{digits}e}".replace("e-0", "e-").replace("e+0", "e")


def _row(found: Data) -> list[str]:
    from validation.leave_out_measure import NEEDED, NOTHING, OUT

    def those(verdict: str, *, with_time: bool = True) -> str:
        return "; ".join(
            f"{what} ({_number(cell['change'])}{f', saves {_percent(cell)}' if with_time else ''})"
            for what, cell in found["cells"].items() if cell["verdict"] == verdict
        )  # fmt: skip

    fine = found["sub_cycling"]
    resolved = "no resolved run, too many steps"
    if fine:
        resolved = f"{_number(fine['change'])}, {fine['times']:.0f} times as long without"
    needed = "; ".join(filter(None, [those(NEEDED, with_time=False), f"sub-cycling ({resolved})"]))
    together, shipped = found["together"], found["shipped"]
    lean = ", ".join(shipped["left_out"]) or "nothing"
    rest = ", ".join(f"{what} ({100.0 * one['part']:.0f} % of it)" for what, one in shipped["still_in"].items())
    return [
        f"{1e-3 * found['microseconds']['median']:.2f}", those(OUT), those(NOTHING, with_time=False), needed,
        f"changes {_number(together['change'])}, saves {_percent(together)}",
        f"leaves out {lean}: saves {_percent(shipped)}" + (f"; could save more: {rest}" if rest else ""),
    ]  # fmt: skip


def _percent(cell: Data) -> str:
    return f"{100.0 * cell['saved']['part']:.0f} %".replace("-0 %", "0 %")


def _draw_map(axes: Axes, engine: str, scenes: Data) -> None:
    """Rows: scenes; columns: ingredients."""
    from matplotlib.patches import Rectangle

    from validation.leave_out_measure import INGREDIENTS, OUT, SUB_CYCLING

    columns = [*INGREDIENTS, SUB_CYCLING, "all together", "as shipped"]
    shades = np.full((len(scenes), len(columns)), np.nan)
    for row, found in enumerate(scenes.values()):
        cells = found["cells"] | {"all together": found["together"], "as shipped": found["shipped"]}
        cells |= {SUB_CYCLING: found["sub_cycling"]} if found["sub_cycling"] else {}
        cells |= {"gravity": cells[TABLE]} if TABLE in cells else {}
        for column, what in enumerate(columns):
            if what not in cells:
                axes.text(column, row, "\N{EN DASH}", ha="center", va="center", color="#808080")
                continue
            cell = cells[what]
            change = np.inf if cell["change"] is None else cell["change"]
            shade = float(np.clip((np.log10(max(change, 1e-30)) - LIGHT) / (DARK - LIGHT), 0.0, 1.0))
            shades[row, column] = shade
            below = f"\N{MULTIPLICATION SIGN}{cell['times']:.0f}" if "times" in cell else _percent(cell)
            axes.text(column, row, f"{_number(cell['change'])}\n{below}", ha="center", va="center", fontsize=8,
                      color="white" if shade > 0.6 else "black")  # fmt: skip
            if cell.get("verdict") == OUT:
                axes.add_patch(Rectangle((column - 0.47, row - 0.45), 0.94, 0.9, fill=False, linewidth=1.8))
    axes.imshow(0.85 * shades, cmap="Greys", vmin=0.0, vmax=1.0, aspect="auto")
    axes.axvline(len(columns) - 2.5, color="black", linewidth=SETTINGS["lines.linewidth"])
    axes.set_xticks(range(len(columns)), [what.replace(" ", "\n") for what in columns], fontsize=8)
    axes.set_yticks(range(len(scenes)), list(scenes))
    axes.tick_params(length=0, top=False, labeltop=True, labelbottom=False, bottom=False)
    axes.grid(visible=False)
    axes.set_title(f"{ENGINE_NAMES[engine]}: change without it, and time saved", fontsize=10)
