"""A million impacts at once: how many a second, on one core and two."""

from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from functools import partial
from itertools import product
from multiprocessing import get_context

import numpy as np

from contactlaw import rebound
from contactlaw.laws.microslip import Microslip
from validation import front
from validation.case import Array, Data
from validation.measure import interleaved, spread
from validation.reference import superposition

Chunk = tuple[Array, Array]
"""psi_1 and chi, shape (n,) each."""

MILLION = 1_000_000
CHUNK = 50_000
LOW, HIGH = 0.5, 2.0  # of chi
CHEAP = (8, 48)  # nodes and steps: the cheapest round numbers that keep an error of 7e-3 with room
JUDGED = 300  # impacts, of those that stick somewhere
FINE = 2000  # steps of the superposition method, which judges


def rates(repeats: int, count: int) -> Data:
    """By name `rate`, million impacts a second of random impacts, those that slip throughout among them, a spread; and
    the largest and rms error of psi_2."""
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
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as processes, ThreadPoolExecutor(2) as threads:
        where: Data = {"one core": map, "two threads": threads.map, "two processes": processes.map}
        runs: dict[str, Callable[[], object]] = {
            f"{name}, {place}": lambda run=run, function=function: list(run(function, chunks))
            for (name, function), (place, run) in product(functions.items(), where.items())
        }
        seconds = interleaved(runs, repeats)
    found: Data = {}
    for name, function in functions.items():
        error = function(judged) - truth
        for place in where:
            rate = spread(1e-6 * count / seconds[f"{name}, {place}"])
            found[f"{name}, {place}"] = {"rate": rate, "largest": front.largest(error), "rms": front.rms(error)}
    return found


def by_law(chunk: Chunk, nodes: int | None, steps: int | None) -> Array:
    """psi_2 of some impacts by `rebound`."""
    return np.asarray(rebound(*chunk, Microslip(node_count=nodes), steps=steps))
