"""`python -m validation`: run the cases, save their results, and write the report."""

from pathlib import Path
from typing import Annotated

import typer  # noqa: TID253
from rich.console import Console  # noqa: TID253
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn  # noqa: TID253
from rich.table import Table as RichTable  # noqa: TID253

from sims.ending import run
from validation import report, runner, store
from validation.case import Case, select
from validation.store import Result

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)


@app.command()
def main(
    quick: Annotated[
        bool, typer.Option("--quick", help="Fewer impacts and repeats, 2 minutes in all; goes to quick/ in the folder.")
    ] = False,
    pattern: Annotated[
        str, typer.Option("-f", "--filter", help="Regular expression: cases whose name it matches.")
    ] = "",
    resume: Annotated[
        bool, typer.Option("--resume", help="Leave out cases with a result of the same sources, versions and machine.")
    ] = False,
    only_report: Annotated[
        bool, typer.Option("--report", help="Only write the report and the pages' tables from the saved results.")
    ] = False,
    folder: Annotated[Path, typer.Option(help="Where results/ and report.md go.")] = store.HERE,
) -> None:
    """Measure what contactlaw claims, and write validation/report.md. The exit code is 1 if a limit is missed.

    All cases take about half an hour on two cores. Each is saved when it ends; --resume continues an interrupted run.
    """
    console = Console()
    try:
        cases = select(pattern)
    except ValueError as error:
        Console(stderr=True).print(str(error), markup=False, soft_wrap=True)
        raise typer.Exit(2) from None
    if quick:
        folder = runner.quick_folder(folder)
    if only_report:
        results = {case.name: result for case in cases if (result := store.load(case.name, folder))}
        if not results:
            Console(stderr=True).print(f"--report: no results of these cases in {folder / 'results'}", soft_wrap=True)
            raise typer.Exit(2)
    else:
        try:
            results = _run(cases, folder, quick, resume, console)
        except KeyboardInterrupt:
            console.print("Interrupted. What has ended is saved; the same command with --resume does the rest.")
            raise typer.Exit(130) from None
    path = runner.rewrite(folder, pictures=only_report)
    _show(results, console)
    console.print(f"Report: {path}", highlight=False, soft_wrap=True)
    if not all(result["passed"] for result in results.values()):
        raise typer.Exit(1)


def _run(cases: list[Case], folder: Path, quick: bool, resume: bool, console: Console) -> dict[str, Result]:
    """Results by name of the cases that can run here, with a progress bar."""
    results: dict[str, Result] = {}
    name = TextColumn("{task.description:<20}")
    with Progress(name, BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), console=console) as bars:
        task = bars.add_task("", total=len(cases))
        for case in cases:
            bars.update(task, description=case.name)
            if missing := runner.missing_modules(case):
                text = f"skipped, needs {', '.join(missing)} ({runner.how_to_install(case)})"
            elif resume and (done := runner.finished(case, folder, quick=quick)):
                results[case.name] = done
                text = f"{report.verdict(done)}, measured before"
            else:
                results[case.name] = result = runner.run_case(case, folder, quick=quick)
                text = f"{report.verdict(result)}, {result['seconds']:.0f} s"
            console.print(f"{case.name}: {text}", markup=False, highlight=False, soft_wrap=True)
            bars.advance(task)
    return results


def _show(results: dict[str, Result], console: Console) -> None:
    """Print limits asked and values reached of all cases."""
    table = RichTable("case", "limit", "asked", "reached", "")
    for name, result in results.items():
        for problem in result["problems"]:
            table.add_row(name, problem, "", "", "[red]NOT SANE")
        rows = report.limits_table(result).rows or [["no limits, see the report", "", "", ""]]
        for row in rows:
            table.add_row(name, *row[:3], "[red]MISSED" if row[3] == "MISSED" else row[3])
            name = ""
        table.add_section()
    console.print(table)


if __name__ == "__main__":
    run(lambda: app(prog_name="python -m validation"))
