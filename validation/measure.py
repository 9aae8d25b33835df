"""Comparable times on a noisy machine: interleaved runs after a warm-up, medians of ratios with their spread."""

import datetime
import gc
import os
import platform
import re
from collections.abc import Callable, Mapping
from importlib import metadata
from pathlib import Path
from random import Random
from time import perf_counter

import numpy as np

from contactlaw.jit import SOURCE_STAMP
from validation.case import Array

Spread = dict[str, float]
"""median, and the quartiles low and high."""

STAMPED = ("numpy", "numba", "mujoco", "pybullet")


def machine() -> dict[str, str | int]:
    """Machine and versions of a measurement; `contactlaw`: a hash of its sources."""
    stamp: dict[str, str | int] = {
        "cpu": _cpu(), "cores": os.cpu_count() or 0, "system": platform.platform(terse=True),
        "python": platform.python_version(), "date": datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%d"),
        "contactlaw": SOURCE_STAMP[:12],
    }  # fmt: skip
    for name in STAMPED:
        try:
            stamp[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            stamp[name] = "not installed"
    return stamp


def _cpu() -> str:
    told = Path("/proc/cpuinfo")
    found = re.search(r"^model name\s*: (?!unknown)(.+)$", told.read_text() if told.exists() else "", re.M)
    return found[1].strip() if found else platform.processor() or platform.machine()


def interleaved(
    runs: Mapping[str, Callable[[], object]], repeats: int, prepare: Mapping[str, Callable[[], object]] | None = None,
    clock: Callable[[], float] = perf_counter,
) -> dict[str, Array]:  # fmt: skip
    """Time several things side by side, so that the drift of the machine meets all of them alike.

    Each round runs everything once, in a random order or in the reverse of the last one, so that what ran before, and
    fills the caches, is another each time; two more go before, uncounted. prepare: called before a run, untimed; clock:
    `process_time` where other processes would be in the way. Returns seconds by name, shape (repeats,); entries of the
    same round belong together.
    """
    seconds = {name: np.empty(repeats) for name in runs}
    order, shuffle = list(runs), Random(0).shuffle
    enabled = gc.isenabled()
    gc.disable()
    try:
        for number in range(-2, repeats):
            order.reverse() if number % 2 else shuffle(order)
            for name in order:
                if prepare and name in prepare:
                    prepare[name]()
                start = clock()
                runs[name]()
                seconds[name][max(number, 0)] = clock() - start
    finally:
        if enabled:
            gc.enable()
    return seconds


def spread(values: Array) -> Spread:
    """Median and quartiles."""
    low, median, high = np.percentile(values, [25, 50, 75])
    return {"median": float(median), "low": float(low), "high": float(high)}
