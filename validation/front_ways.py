"""Every law in every setting, without an engine: what each way costs and errs; forces over impacts and paths; a million
impacts at once, on one core and two."""

from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from functools import partial
from itertools import product
from multiprocessing import get_context
from typing import Any

import numpy as np

from contactlaw import LAWS, MATERIALS, Body, ContactPair, collide, force_along_path, rebound
from contactlaw.collision import Impact
from contactlaw.laws import Law
from contactlaw.laws.microslip import Microslip
from validation.case import Array, Data
from validation.front import Rung, largest, rms
from validation.measure import interleaved, spread
from validation.reference import annulus, superposition

SUPERPOSITION = [16, 32, 64, 128, 256, 512, 1024]  # steps
ANNULI = [5, 10, 20, 40]
FEW_ANNULI = ANNULI[:3]
SINGLE = ("linear_spring", "mindlin", "mindlin_rescaled")
STEEL, FRICTION, RADIUS, MASS = MATERIALS["steel"], 0.115, 0.025, 0.5
DEFAULT = "microslip, default"
CLOSER, FASTER = 30.0, 100.0  # times that the default is asked to be so
HISTORY_NODES = [8, 16, 32]
HISTORY_STEPS = [50, 100, 200, 400, 800]
ALL_SPRINGS_STEPS = [50, 100, 200, 800, 1600, 3200]  # of the law as it is by default, which takes COLLIDE_STEPS
COLLIDE_STEPS = 400  # the default of `collide`
SOME = slice(2, None, 5)  # of the impacts: enough to time what is slow
PATH_NODES = [8, 16, 32, 64, 128]
FINE = 16000  # steps of the superposition method that others are judged by
DEEPEST = 0.01  # of the paths, over the radius
SWINGS = [(0.3, 1.0), (1.5, 2.0), (1.0, 3.5)]  # of the paths: height over DEEPEST mu/kappa, and periods
MILLION, CHUNK = 1_000_000, 50_000
CHEAP = (8, 48)  # nodes and steps: the cheapest round numbers that keep an error of 7e-3 with room
JUDGED = 300  # impacts of the million, of those that stick somewhere
Make = Callable[[Array], Callable[[], Any]]
"""Gives, of impacts (psi_1 and chi, shape (2, n)), the call that answers them, and is timed."""
Ways = dict[str, tuple[Make, Array]]
"""By name, how the call is made, and the impacts that it is timed with."""


def laws(nodes: Iterable[int], steps: Iterable[int]) -> dict[str, tuple[Law, int | None]]:
    """Settings of every law, by name."""
    found: dict[str, tuple[Law, int | None]] = {DEFAULT: (LAWS["microslip"], None)}
    found |= {f"microslip, {n} nodes, {s} steps": (Microslip(node_count=n), s) for n in nodes for s in steps}
    found |= {f"{name}, {s} steps": (LAWS[name], s) for name in SINGLE for s in steps}
    return found | {"coulomb": (LAWS["coulomb"], None)}


def ladder(
    ways: Ways, impacts: Array, error: Callable[[Any], Array], repeats: int,
    problem: Callable[[Any], str] = lambda answers: "",
) -> dict[str, Rung]:  # fmt: skip
    """All ways, timed side by side: the error of each of the impacts (n,) from the answers to all, and what makes these
    not sane."""
    answers = {name: make(impacts)() for name, (make, _) in ways.items()}
    seconds = interleaved({name: make(timed) for name, (make, timed) in ways.items()}, repeats)
    return {
        name: Rung(name.split(",")[0], error(answers[name]), seconds[name] / timed.shape[1], problem(answers[name]))
        for name, (_, timed) in ways.items()
    }


def one_by_one(solve: Callable[..., Any], **told: Any) -> Make:
    """Impact after impact."""

    def make(impacts: Array) -> Callable[[], list[Any]]:
        known = list(zip(*impacts.tolist(), strict=True))
        return lambda: [solve(*one, **told) for one in known]

    return make


def by_collide(law: str | Law, steps: int) -> Make:
    """Impact after impact, each with its whole history; bodies are made before the clock starts."""

    def make(impacts: Array) -> Callable[[], list[Impact]]:
        bodies = [thrown(law, *one) for one in zip(*impacts.tolist(), strict=True)]
        return lambda: [collide(*one, steps=steps) for one in bodies]

    return make


def methods(quick: bool) -> dict[str, Make]:
    """The two methods of the reference."""
    found = {f"superposition, {n} steps": one_by_one(superposition.impact, steps=n) for n in SUPERPOSITION}
    annuli = FEW_ANNULI if quick else ANNULI
    return found | {f"annuli, N = {n}": one_by_one(annulus.impact, annuli=n) for n in annuli}


def thrown(law: str | Law, psi_1: float, chi: float) -> tuple[ContactPair, Body]:
    """A body in SI units whose impact has these two numbers; its inertia makes chi what it is to be."""
    pair = ContactPair(STEEL, STEEL, FRICTION, 1.0, law=law)
    inertia = RADIUS**2 * MASS / (2.0 * chi / pair.kappa - 1.0)
    velocity = (psi_1 * FRICTION / pair.kappa, 0.0, -1.0)
    return pair, Body(mass=MASS, radius=RADIUS, inertia=inertia, velocity=velocity)


def histories(impacts: Array, repeats: int, quick: bool) -> dict[str, Rung]:
    """F over mu P_max at each instant of whole impacts, against the superposition method in fine steps."""
    exact = one_by_one(superposition.impact, steps=FINE)(impacts)()

    def error(found: list[Any]) -> Array:
        out = []
        for one, of in zip(found, exact, strict=True):
            time, force = one.time, one.tangential_force
            if isinstance(one, Impact):
                time, force = time / time[-1], -force[:, 0] / (FRICTION * one.normal_force.max())
            out.append(np.abs(force - np.interp(time, of.time, of.tangential_force)).max())
        return np.array(out)

    settings = laws(HISTORY_NODES, HISTORY_STEPS[1::2] if quick else HISTORY_STEPS)
    some = ALL_SPRINGS_STEPS[1::2] if quick else ALL_SPRINGS_STEPS
    settings |= {f"microslip, all springs, {steps} steps": (LAWS["microslip"], steps) for steps in some}
    ways = {name: by_collide(law, steps or COLLIDE_STEPS) for name, (law, steps) in settings.items()} | methods(quick)
    return ladder({name: (make, impacts) for name, make in ways.items()}, impacts, error, repeats)


def along_paths(repeats: int, quick: bool) -> dict[str, Rung]:
    """F over mu P_max along paths of 200 samples, against the superposition method, exact on straight segments."""
    part = np.linspace(0.0, 1.0, 201)
    overlap = DEEPEST * np.sin(np.pi * part) ** 0.8
    overlap[-1] = 0.0
    named: dict[str, str | Law] = {DEFAULT if name == "microslip" else name: name for name in LAWS}
    named |= {f"microslip, {n} nodes": Microslip(n) for n in PATH_NODES}
    pairs = {name: ContactPair(STEEL, STEEL, FRICTION, radius=1.0, law=law) for name, law in named.items()}
    told = {"kappa": pairs[DEFAULT].kappa, "friction": FRICTION}
    sheared = [FRICTION / told["kappa"] * DEEPEST * height * np.sin(2.0 * np.pi * n * part) for height, n in SWINGS]

    def by_law(pair: ContactPair) -> list[Array]:
        return [force_along_path(pair, overlap, s)[1] / pair.effective_modulus for s in sheared]

    def by_method(method: Any, **size: int) -> list[Array]:
        return [method.force_along_path(overlap, s, **told, **size) for s in sheared]

    exact = by_method(superposition)
    scale = FRICTION * 4.0 / 3.0 * DEEPEST**1.5  # mu P_max with E* = R = 1

    def error(found: list[Array]) -> Array:
        return np.array([np.abs(force - of).max() / scale for force, of in zip(found, exact, strict=True)])

    calls = {name: partial(by_law, pair) for name, pair in pairs.items()}
    calls["superposition"] = partial(by_method, superposition)
    calls |= {f"annuli, N = {n}": partial(by_method, annulus, annuli=n) for n in (FEW_ANNULI if quick else ANNULI)}
    swings = np.zeros((2, len(SWINGS)))  # impacts that no call looks at: each knows its paths
    return ladder({name: (lambda _, call=call: call, swings) for name, call in calls.items()}, swings, error, repeats)


def rates(repeats: int, count: int) -> Data:
    """By name `rate`, million impacts a second of random impacts, those that slip throughout among them, a spread; and
    the largest and rms error of psi_2."""
    random = np.random.default_rng(1)
    chi = random.uniform(0.5, 2.0, count)
    psi_1 = random.uniform(0.0, 1.0, count) * (4.0 * chi + 1.5)
    chunks = [(psi_1[i : i + CHUNK], chi[i : i + CHUNK]) for i in range(0, count, CHUNK)]
    sticking = np.flatnonzero(psi_1 < np.maximum(4.0 * chi - 1.0, 1.0))[:JUDGED]
    judged = psi_1[sticking], chi[sticking]
    truth = np.atleast_1d(superposition.rebound(*judged, 2000))
    functions: dict[str, Callable[[tuple[Array, Array]], Array]] = {
        "default": partial(in_chunks, nodes=None, steps=None),
        f"{CHEAP[0]} nodes, {CHEAP[1]} steps": partial(in_chunks, nodes=CHEAP[0], steps=CHEAP[1]),
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
            found[f"{name}, {place}"] = {"rate": rate, "largest": largest(error), "rms": rms(error)}
    return found


def in_chunks(chunk: tuple[Array, Array], nodes: int | None, steps: int | None) -> Array:
    """psi_2 of some impacts by `rebound`."""
    return np.asarray(rebound(*chunk, Microslip(node_count=nodes), steps=steps))
