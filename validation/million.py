"""A million impacts at once: how many a second, on one core and two, by the law itself and from a table of it."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from functools import partial
from multiprocessing import get_context

import numpy as np
from numpy.typing import NDArray

from contactlaw import rebound
from contactlaw.laws.microslip import Microslip
from validation import front
from validation.case import Data
from validation.measure import interleaved, spread
from validation.reference import superposition
from validation.sweep import sweep

Array = NDArray[np.float64]
Chunk = tuple[Array, Array]
"""psi_1 and chi, shape (n,) each."""

MILLION = 1_000_000
CHUNK = 50_000
LOW, HIGH = 0.5, 2.0  # of chi
CHEAP = (8, 48)  # nodes and steps: the cheapest round numbers that keep an error of 7e-3 with room
JUDGED = 300  # impacts, of those that stick somewhere
FINE = 2000  # steps of the superposition method, which judges
TABLE = 129  # entries each way: the law at default settings, straight lines between


def rates(repeats: int, count: int) -> Data:
    """Million impacts a second of random impacts, those that slip throughout among them.

    Returns:
        By name: `rate`, a spread, and the largest and rms error of psi_2.
    """
    random = np.random.default_rng(1)
    chi = random.uniform(LOW, HIGH, count)
    psi_1 = random.uniform(0.0, 1.0, count) * (4.0 * chi + 1.5)
    chunks = [(psi_1[i : i + CHUNK], chi[i : i + CHUNK]) for i in range(0, count, CHUNK)]
    sticking = np.flatnonzero(psi_1 < np.maximum(4.0 * chi - 1.0, 1.0))[:JUDGED]
    judged = psi_1[sticking], chi[sticking]
    truth = np.atleast_1d(superposition.rebound(*judged, FINE))
    functions: dict[str, Callable[[Chunk], Array]] = {
        "default": partial(by_law, nodes=None, steps=None),
        f"{CHEAP[0]} nodes, {CHEAP[1]} steps": partial(by_law, nodes=CHEAP[0], steps=CHEAP[1]),
    }
    tabled = f"table of {TABLE} x {TABLE}, its making included, one core"
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as processes, ThreadPoolExecutor(2) as threads:
        where: dict[str, Executor | None] = {"one core": None, "two threads": threads, "two processes": processes}
        runs: dict[str, Callable[[], object]] = {
            f"{name}, {place}": partial(sweep, function, chunks, executor)
            for name, function in functions.items()
            for place, executor in where.items()
        }
        runs[tabled] = lambda: sweep(Table(TABLE), chunks)
        seconds = interleaved(runs, repeats)
    answers = {name: function(judged) for name, function in functions.items()} | {tabled: Table(TABLE)(judged)}
    found: Data = {}
    for name, times in seconds.items():
        error = next(answer for start, answer in answers.items() if name.startswith(start)) - truth
        found[name] = {
            "rate": spread(1e-6 * count / times), "largest": front.largest(error), "rms": front.rms(error)
        }  # fmt: skip
    return found


def by_law(chunk: Chunk, nodes: int | None, steps: int | None) -> Array:
    """psi_2 of some impacts by `rebound`."""
    return np.asarray(rebound(*chunk, Microslip(node_count=nodes), steps=steps))


class Table:
    """psi_2 of elastic impacts with psi_1 >= 0, read from a table of the law at default settings.

    Two sheets over chi meet where the theory has its kinks: psi_1 from 0 to 1 (starts stuck) and from 1 to 4 chi - 1
    (starts sliding). Beyond, psi_2 = psi_1 - 4 chi. Between the entries psi_2 runs straight in psi_1 and chi.

    Args:
        size: Entries each way; chi from `LOW` to `HIGH`.
    """

    def __init__(self, size: int) -> None:
        self.last = size - 1
        part, chi = np.linspace(0.0, 1.0, size), np.linspace(LOW, HIGH, size)[:, None]
        self.sheets = np.array(
            [rebound(part + 0.0 * chi, chi), rebound(1.0 + part * np.maximum(4.0 * chi - 2.0, 0.0), chi)]
        )

    def __call__(self, chunk: Chunk) -> Array:
        """psi_2 of some impacts."""
        psi_1, chi = chunk
        beyond = np.maximum(4.0 * chi - 2.0, 1e-12)
        sliding = (psi_1 > 1.0).astype(np.intp)
        across = np.clip(np.where(sliding, (psi_1 - 1.0) / beyond, psi_1), 0.0, 1.0) * self.last
        along = (chi - LOW) * (self.last / (HIGH - LOW))
        i, j = (np.minimum(x.astype(np.intp), self.last - 1) for x in (along, across))
        a, b = along - i, across - j
        flat, row = self.sheets.ravel(), self.last + 1
        corner = (sliding * row + i) * row + j
        near = flat[corner] * (1.0 - b) + flat[corner + 1] * b
        far = flat[corner + row] * (1.0 - b) + flat[corner + row + 1] * b
        return np.where(psi_1 >= np.maximum(4.0 * chi - 1.0, 1.0), psi_1 - 4.0 * chi, near * (1.0 - a) + far * a)
