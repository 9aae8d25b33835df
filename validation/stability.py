"""Whether a trial goes well: all finite, no energy gained, nothing gone through, rest where there is to be rest."""

# pyright: reportAttributeAccessIssue=false
# (pyright cannot see into the mujoco module)

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from math import inf, isfinite, isnan, nan
from multiprocessing import get_context
from typing import TypeVar

import numpy as np

from validation.case import Data
from validation.stability_trials import RADIUS, Trial
from validation.stability_worlds import World, world
from validation.sweep import sweep

GAIN = 1e-3  # of the energy at the start
REST = 1e-3  # the same
ACCELERATION = 1e10  # [m/s^2] or [rad/s^2]; more, and MuJoCo resets the state
LOOKS = 60
NOT_FINITE = "not finite"

Input = TypeVar("Input")
Answer = TypeVar("Answer")


@dataclass(frozen=True)
class Verdict:
    """Of a trial.

    Attributes:
        gain: Greatest gain of energy at any look with all bodies apart, over the energy at the start; -inf: no such
            look.
        left: Energy at the last such look, or else at the end, over that at the start.
        problem: What is wrong; "": nothing.
        refused: Whether it asks for more than the engine takes, so that nothing can be said.
    """

    gain: float = -inf
    left: float = nan
    problem: str = ""
    refused: bool = False


def judged(engine: str, trial: Trial, way: str) -> Verdict:
    """Run a trial to its end, or until it fails."""
    with warnings.catch_warnings(), quiet(engine):
        warnings.simplefilter("ignore")
        return _run(world(engine, trial, way), trial, trial.first_energy(way))


@contextmanager
def quiet(engine: str) -> Iterator[None]:
    """Within this, MuJoCo neither prints what goes wrong nor writes it to a file: the verdict says it."""
    if engine == "mujoco":
        import mujoco

        mujoco.set_mju_user_warning(lambda message: None)
    try:
        yield
    finally:
        if engine == "mujoco":
            mujoco.set_mju_user_warning(None)


def _run(one: World, trial: Trial, first: float) -> Verdict:
    steps = max(1, round(trial.duration / trial.step))
    worst, left, kinetic, energy, through = -inf, nan, inf, nan, False
    for count in np.diff(np.unique(np.linspace(0, steps, LOOKS + 1).astype(int))):
        one.step(int(count))
        places, velocities, spins = one.motion()
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
    if worst > GAIN:
        return Verdict(worst, left, "energy gained")
    if through:
        return Verdict(worst, left, "went through")
    if trial.rests and kinetic > REST * first:
        return Verdict(worst, left, "no rest")
    return Verdict(worst, left)


def tally(engine: str, way: str, trials: Sequence[Trial | None]) -> Data:
    """What the trials of one cell of a map give.

    Args:
        engine, way: As `stability_worlds.world` has them.
        trials: None: one that could not be drawn.

    Returns:
        runs, refused, failed, infinite: how many of each; gain: the greatest (not finite: 1e300; at least -1);
        failures: problem, gain and facts of those that fail; kept: median of the energy left by elastic trials, None
        without any.
    """
    verdicts = [(trial, judged(engine, trial, way)) for trial in trials if trial is not None]
    counted = [(trial, verdict) for trial, verdict in verdicts if not verdict.refused]
    kept = [
        verdict.left for trial, verdict in counted if trial.made["restitution"] == 1.0 and isfinite(verdict.left)
    ]  # fmt: skip
    failing = [(trial, verdict) for trial, verdict in counted if verdict.problem]
    return {
        "runs": len(counted),
        "refused": len(verdicts) - len(counted),
        "failed": len(failing),
        "infinite": sum(verdict.problem == NOT_FINITE for _, verdict in failing),
        "gain": max((_size(verdict) for _, verdict in counted), default=-1.0),
        "kept": float(np.median(kept)) if kept else None,
        "failures": [
            {"problem": verdict.problem, "gain": _size(verdict), "trial": str(trial)} for trial, verdict in failing
        ],
    }


def without_names(cell: Data) -> Data:
    """A tally that does not tell the trials that fail: of ways that fail everywhere."""
    return {key: value for key, value in cell.items() if key != "failures"}


def _size(verdict: Verdict) -> float:
    return 1e300 if verdict.problem == NOT_FINITE else max(verdict.gain, -1.0)


def short(gain: float) -> str:
    """A gain as text."""
    if gain >= 1e300:
        return NOT_FINITE
    return f"{gain:.0e}" if gain > 0.0 else "none"


def on_all_cores(
    function: Callable[[Input], Answer], inputs: Sequence[Input], progress: Callable[[float], None]
) -> list[Answer]:
    """A sweep on as many processes as there are cores."""
    with ProcessPoolExecutor(os.cpu_count(), get_context("spawn"), _say_nothing) as pool:
        return sweep(function, inputs, pool, chunk=4, progress=progress)


def _say_nothing() -> None:
    """Close this process's terminal: PyBullet greets when it is loaded."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
