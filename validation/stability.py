"""Whether a trial goes well: all finite, no energy gained, nothing gone through, rest where it is to be; and maps."""

import os
import warnings
from abc import abstractmethod
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import closing, contextmanager
from itertools import product
from math import inf, isfinite, isnan, nan
from multiprocessing import get_context
from typing import Any, ClassVar, NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from validation.case import Axes, Case, Data, Limit, Table
from validation.stability_trials import RADIUS, Trial
from validation.stability_worlds import ENGINES, SUB_CYCLED, TITLES, WAYS, TrialWorld

GAIN = 1e-3  # of the energy at the start
REST = 1e-3  # the same
ACCELERATION = 1e10  # [m/s^2] or [rad/s^2]; more, and MuJoCo resets the state
LOOKS = 60
NOT_FINITE = "not finite"

Input = TypeVar("Input")
Answer = TypeVar("Answer")


class Verdict(NamedTuple):
    """Of a trial: the greatest gain of energy at any look with all bodies apart, over the energy at the start (-inf: no
    such look); energy left at the last such look, or else at the end, over that at the start; what is wrong ("":
    nothing); whether it asks for more than the engine takes, so that nothing can be said."""

    gain: float = -inf
    left: float = nan
    problem: str = ""
    refused: bool = False


def judged(engine: str, trial: Trial, way: str) -> Verdict:
    """Run a trial to its end, or until it fails."""
    with warnings.catch_warnings(), quiet(engine):
        warnings.simplefilter("ignore")
        one = TrialWorld(engine, trial, way)
        with closing(one.world):
            return _run(one, trial, trial.first_energy(way))


@contextmanager
def quiet(engine: str) -> Iterator[None]:
    """Within this, MuJoCo neither prints what goes wrong nor writes it to a file: the verdict says it."""
    if engine == "mujoco":
        import mujoco

        mujoco.set_mju_user_warning(lambda message: None)  # pyright: ignore[reportAttributeAccessIssue]
    try:
        yield
    finally:
        if engine == "mujoco":
            mujoco.set_mju_user_warning(None)  # pyright: ignore[reportAttributeAccessIssue]


def _run(one: TrialWorld, trial: Trial, first: float) -> Verdict:
    steps = max(1, round(trial.duration / trial.step))
    worst, left, kinetic, energy, through = -inf, nan, inf, nan, False
    for count in np.diff(np.unique(np.linspace(0, steps, LOOKS + 1).astype(int))):
        one.step(int(count))
        places, _, velocities, spins = one.read()
        kinetic = trial.kinetic(velocities, spins)
        energy = kinetic + trial.potential(places)
        if one.broken() or not isfinite(energy):
            refused = one.broken() and trial.acceleration > 0.01 * ACCELERATION
            return Verdict(problem=NOT_FINITE, refused=refused)
        gap = trial.gaps(places).min()
        through = through or gap < -RADIUS
        if gap > 0.0:
            left = energy / first
            worst = max(worst, left - 1.0)
    left = energy / first if isnan(left) else left
    unrest = trial.rests and kinetic > REST * first
    return Verdict(worst, left, "energy gained" if worst > GAIN else "went through" if through else
                   "no rest" if unrest else "")  # fmt: skip


def tally(engine: str, way: str, trials: Sequence[Trial | None]) -> Data:
    """What the trials of one cell of a map give; None: one that could not be drawn.

    runs, refused, failed, infinite: how many of each; gain: the greatest (not finite: 1e300; at least -1); failures:
    problem, gain and facts of those that fail; kept: median of the energy left by elastic trials, None without any.
    """
    verdicts = [(trial, judged(engine, trial, way)) for trial in trials if trial is not None]
    counted = [(trial, verdict) for trial, verdict in verdicts if not verdict.refused]
    kept = [one.left for trial, one in counted if trial.made["restitution"] == 1.0 and isfinite(one.left)]
    failing = [(trial, verdict) for trial, verdict in counted if verdict.problem]
    return {
        "runs": len(counted),
        "refused": len(verdicts) - len(counted),
        "failed": len(failing),
        "infinite": sum(verdict.problem == NOT_FINITE for _, verdict in failing),
        "gain": max((_size(verdict) for _, verdict in counted), default=-1.0),
        "kept": float(np.median(kept)) if kept else None,
        "failures": [{"problem": one.problem, "gain": _size(one), "trial": str(trial)} for trial, one in failing],
    }


def _size(verdict: Verdict) -> float:
    return 1e300 if verdict.problem == NOT_FINITE else max(verdict.gain, -1.0)


def short(gain: float) -> str:
    """A gain as text."""
    return NOT_FINITE if gain >= 1e300 else f"{gain:.0e}" if gain > 0.0 else "none"


def on_all_cores(function: Callable[[Input], Answer], inputs: Sequence[Input]) -> list[Answer]:
    """The answers, in the order of the inputs, from as many processes as there are cores."""
    with ProcessPoolExecutor(os.cpu_count(), get_context("spawn"), _say_nothing) as pool:
        return list(pool.map(function, inputs, chunksize=4))


def _say_nothing() -> None:
    """Close this process's terminal: PyBullet greets when it is loaded."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)


DEFAULT = "microslip"


class StabilityCase(Case):
    """Trials of every way in both engines, by cells in rows; a subclass says which, and what they are called.

    The data hold by engine and way the sums of `tally` and its failures, and by rows "gain", "kept" and "fails".
    """

    cells: ClassVar[str]
    heads: ClassVar[str]

    @abstractmethod
    def kept(self, values: list[float]) -> str:
        """What elastic balls keep of their energy, of all cells."""

    def measured(self, function: Callable[[Any], Data], rows: Sequence[Sequence[Any]]) -> Data:
        """By engine and way, of a function of (engine, way, *cell)."""
        ways = list(product(ENGINES, WAYS))
        found = iter(on_all_cores(function, [(*way, *cell) for way in ways for row in rows for cell in row]))
        out: Data = {engine: {} for engine in ENGINES}
        for engine, way in ways:
            grid = [[next(found) for _ in row] for row in rows]
            every = [cell for row in grid for cell in row]
            out[engine][way] = {
                **{key: sum(cell[key] for cell in every) for key in ("runs", "refused", "failed", "infinite")},
                **{key: [[cell[key] for cell in row] for row in grid] for key in ("gain", "kept")},
                "fails": [[cell["failed"] > 0 for cell in row] for row in grid],
            }
            if way == DEFAULT:
                out[engine][way]["failures"] = [failure for cell in every for failure in cell["failures"]]
        return out

    def limits(self, data: Data) -> list[Limit]:
        """Of the default no cell fails, of all laws no run is not finite."""
        return [
            limit for engine, ways in data["engines"].items() for limit in (
                Limit(f"{self.cells} that fail, {DEFAULT}, {TITLES[engine]}", 0.0,
                      float(np.sum(ways[DEFAULT]["fails"]))),
                Limit(f"runs that are not finite, all sub-cycled laws, {TITLES[engine]}", 0.0,
                      float(sum(ways[way]["infinite"] for way in SUB_CYCLED))),
            )
        ]  # fmt: skip

    def table(self, data: Data) -> Table:
        """A row for each way with all that fails, then every failure of the default."""
        table = Table(f"way | runs | {self.cells} | fail | not finite | largest gain | {self.heads}")
        wider = data.get("wider", {})
        for engine, way in product(ENGINES, WAYS):
            one = data["engines"][engine][way]
            kept = self.kept([value for row in one["kept"] for value in row if value is not None])
            fails = np.array(one["fails"])
            table.add(f"{way}, {TITLES[engine]} | {{runs}} | {fails.size} | {fails.sum()} | {{infinite}} | "
                      f"{short(np.max(one['gain']))} | {kept}", one)  # fmt: skip
        for engine, one in wider.items():
            table.add(f"{DEFAULT}, {TITLES[engine]}, wider draw, runs that fail | {{runs}} | | {len(one['failures'])}",
                      one)  # fmt: skip
        for engine, ways in data["engines"].items():
            for failure in ways[DEFAULT]["failures"] + wider.get(engine, {"failures": []})["failures"]:
                table.add(f"FAILS: {DEFAULT}, {TITLES[engine]}, {{problem}}: {{trial}} | | | | | " +
                          short(failure["gain"]), failure)  # fmt: skip
        refused = sum(one["refused"] for ways in data["engines"].values() for one in ways.values())
        table.add(f"beyond the accelerations that MuJoCo takes, not counted | {refused}")
        return table


LIGHT, DARK = -6.0, 0.0  # log10 of the gain of energy
EDGE = {"edgecolor": "#bbbbbb", "linewidth": 0.3}


def gains(axes: Axes, x: ArrayLike, y: ArrayLike, gain: ArrayLike) -> Any:
    """Cells between the edges x (m + 1) and y (n + 1) with the shade of their gain (n, m); returns the mesh."""
    shades = np.log10(np.clip(np.asarray(gain, dtype=float), 10.0**LIGHT, 10.0**DARK))
    mesh = axes.pcolormesh(x, y, shades, cmap="Greys", vmin=LIGHT, vmax=DARK, **EDGE)
    axes.grid(visible=False)
    return mesh


def crosses(axes: Axes, places: Iterable[tuple[float, float]], size: float) -> None:
    """A cross in the middle of each cell that fails, black with a white rim."""
    points = list(places)
    for colour, wider in (("white", 2.0), ("black", 0.0)):
        axes.plot(*(zip(*points, strict=True) if points else ([], [])), "x", color=colour, clip_on=False,
                  markersize=size + 0.5 * wider, markeredgewidth=0.8 + wider, linestyle="none")  # fmt: skip


def scale_of_gains(mesh: Any, axes: Any) -> None:
    """The bar beside the axes."""
    bar = mesh.figure.colorbar(mesh, ax=axes, fraction=0.02, pad=0.01)
    bar.set_label("log10 of the largest gain of energy [-]", fontsize=8)
    bar.ax.tick_params(labelsize=8)
