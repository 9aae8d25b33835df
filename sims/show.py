"""Run scenes and show their results, checks and pictures on a terminal."""

import importlib.util
import re
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from threading import Event, Thread
from time import perf_counter

from rich.console import Console
from rich.markup import escape
from rich.progress import (
    BarColumn,
    Progress,
    ProgressColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.table import Table

from contactlaw.jit import seconds_compiling
from sims.recording import Recording
from sims.scene import Limit, Measured, Scene, Settings

console = Console(width=None if sys.stdout.isatty() else 80)
messages = Console(stderr=True, width=console.width)
OFTEN = 1.5  # [s] between lines that say how far a run is, where no bar is seen
PATIENCE, LONG = 3.0, 20.0  # after how much of it [s] a run that takes longer than this [s] says how long


def run(scene: Scene, settings: Settings) -> Recording:
    """Run a scene with a progress bar; print the time left, and the settings, if it takes long."""
    asked = {key: value for key, value in settings.options.items() if value not in (None, scene.options[key].default)}
    asked |= {"timestep": settings.timestep} if settings.timestep else {}
    name = f"{scene.name} in {settings.engine}"
    given = " with " + ", ".join(f"{key} = {value:g}" for key, value in asked.items()) if asked else ""
    times: list[float] = []  # when it began, and when it said how long

    with bar(TimeRemainingColumn()) as progress:
        task = progress.add_task(name, total=1.0)

        def tell(part: float) -> None:
            progress.update(task, completed=part)
            now = perf_counter() - seconds_compiling()  # compiling, which happens once, says nothing of the rest
            if not times:
                times.append(now)
            spent = now - times[0]
            if len(times) == 1 and part > 0.0 and PATIENCE < spent > part * LONG:
                times.append(spent)
                messages.print(f"{name}{given}: up to about {_lasting(spent / part - spent)} to go; Ctrl-C ends it",
                               highlight=False, soft_wrap=True)  # fmt: skip

        return scene.run(replace(settings, progress=tell))


def _lasting(seconds: float) -> str:
    unit, each = next((one for one in (("h", 3600.0), ("min", 60.0)) if seconds > 2.0 * one[1]), ("s", 1.0))
    return f"{seconds / each:.0f} {unit}"


def measure(scene: Scene, recording: Recording) -> Measured:
    """Measure a recording, with a progress bar."""
    with bar() as progress:
        progress.add_task(f"figures of {scene.name}", total=None)
        return scene.measure(recording)


def figures(measured: Measured) -> None:
    """Print single values as one table, and each list of like objects as a table of its own."""
    plain = Table("quantity", "value", "unit")
    lists = {}
    for key, value in measured.items():
        if isinstance(value, list) and value and isinstance(value[0], dict):
            lists[key] = value
        elif isinstance(value, dict) and value:
            lists[key] = [{"": name} | one for name, one in value.items()]
        else:
            plain.add_row(key, "none" if value == {} else _text(value), unit_of(key, value))
    console.print(plain)
    for key, rows in lists.items():
        heads = [head for head, value in rows[0].items() if not isinstance(value, list | dict)]
        for part in _parts(heads):
            table = Table(title=key, padding=(0, 0, 0, 1))
            for head in part:
                unit = unit_of(head, rows[0][head])
                table.add_column(escape(head.replace("_", "\n") + f"\n[{unit}]" * bool(unit)), justify="right")
            for row in rows:
                table.add_row(*(_text(row[head]) for head in part))
            console.print(table)


def checks(found: Sequence[Limit]) -> bool:
    """Print a line for each check; return whether all passed."""
    for one in found:
        sign, unit = (">=" if one.at_least else "<="), f" {one.unit}" if one.unit else ""
        style, word = ("green", "holds") if one.passed else ("red", "FAILS")
        console.print(
            f"[{style}]{word}[/]  {one.name}: {one.reached:.3g}{unit}, asked {sign} {one.asked:g}{unit}",
            highlight=False,
        )
    return all(one.passed for one in found)


def pictures(
    scene: Scene, settings: Settings, recording: Recording, plot: Path | None, gif: Path | None,
    engines: Sequence[str] = (), mp4: Path | None = None,
) -> None:  # fmt: skip
    """Make the pictures asked for, with the engines' own contact beside the law."""
    from sims.panel import save
    from sims.pictures import draw_exposures, draw_gif, panels_of

    if not plot and not gif and not mp4:
        return
    with bar() as progress:
        progress.add_task(f"pictures of {scene.name}", total=None)
        if plot and (own := scene.figure(settings, recording)) is not None:
            save(own, plot)
            messages.print(f"picture: {plot}", highlight=False, soft_wrap=True)
            plot = None
        if not plot and not gif and not mp4:
            return
        panels = panels_of(scene, settings, recording, engines)
        made = [
            draw(scene, panels, file)
            for draw, file in ((draw_exposures, plot), (draw_gif, gif), (draw_gif, mp4))
            if file
        ]
    for file in made:
        messages.print(f"picture: {file}", highlight=False, soft_wrap=True)


def show_all(scenes: Sequence[Scene], out: Path) -> int:
    """Run and check each scene in every installed engine, and make its pictures; return an exit code."""
    held = True
    drawing = all(importlib.util.find_spec(name) for name in ("matplotlib", "PIL"))
    if not drawing:
        console.print("[yellow]no pictures without matplotlib and pillow (pip install 'contactlaw\\[plot]')[/]")
    for scene in scenes:
        console.rule(f"{scene.name}: {scene.title}", align="left")
        first: tuple[Settings, Recording] | None = None
        engines = [engine for engine in scene.engines if importlib.util.find_spec(engine)]
        for engine in engines:
            settings = Settings(engine)
            recording = run(scene, settings)
            console.print(f"{engine}, step {1e3 * float(recording.facts['timestep']):.3g} ms")
            held &= checks(scene.check(measure(scene, recording)))
            first = first or (settings, recording)
        if first and drawing:
            pictures(scene, *first, out / f"{scene.name}.png", out / f"{scene.name}.gif", engines)
    return 0 if held else 1


UNITS = {
    r"_um_per_s$": "um/s", r"_um$": "um", r"degrees$|^loft$|^launch_angle": "degrees", r"^turns_a_second$": "1/s",
    r"_over|_ratios?$|_error$|_gained$|_rise$|_change$|_lost$|^change_of|^psi|^slip_on|restitution": "-",
    r"^(chi|kappa|mu|friction|rolling|grip|aside|turned)$": "-",
    r"bounces$|^(balls|rows|passed|moving|steps|turns_reference)$": "-",
    r"^(back)?spin|^side_after$|rate$|^rate_": "rad/s", r"velocit|speed|^lift$": "m/s",
    r"^acceleration|^rim": "m/s^2", r"^energy(_before)?$": "J", r"^force$": "N",
    r"^x(_end)?$|height|^off_the_mirror$|^radius$": "m",
    r"^((wall_)?time|timestep|(contact_)?duration|seconds|settled|compared_until|drop_s)$": "s",
}  # fmt: skip
"""Units by the first pattern that a name matches; "-" for counts and ratios."""
COLUMNS = 7  # of a table of 80 characters


def unit_of(name: str, value: object = 0.0) -> str:
    """Unit of a value by its name; empty for text."""
    if isinstance(value, str | bool):
        return ""
    return next((unit for found, unit in UNITS.items() if re.search(found, name)), "")


def _parts(heads: list[str]) -> list[list[str]]:
    """Split columns into tables that fit a terminal, each with the first column."""
    if len(heads) <= COLUMNS:
        return [heads]
    rest, each = heads[1:], COLUMNS - 1
    return [[heads[0], *rest[start : start + each]] for start in range(0, len(rest), each)]


def _text(value: object) -> str:
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list):
        return ", ".join(_text(one) for one in value)
    return str(value)


def bar(*more: ProgressColumn) -> Progress:
    """Progress bar that disappears at the end; if the output is no terminal, a line now and then instead."""
    columns = TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn(), *more
    return (Progress if messages.is_terminal else _Lines)(*columns, console=messages, transient=True)


class _Lines(Progress):
    def start(self) -> None:
        self._over = Event()
        Thread(target=self._say, daemon=True).start()

    def stop(self) -> None:
        self._over.set()

    def _say(self) -> None:
        said: set[str] = set()
        while not self._over.wait(OFTEN):
            for task in self.tasks:
                part = "" if task.total is None else f": {task.percentage:.0f} %"
                line = f"{task.description}{part}"
                if not task.finished and line not in said:
                    said.add(line)
                    messages.print(line, highlight=False)
