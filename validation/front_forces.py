"""Tangential forces without an engine: over whole impacts and along prescribed paths, what each way costs and errs."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contactlaw import LAWS, Body, ContactPair, collide, force_along_path
from contactlaw.laws import Law
from contactlaw.laws.microslip import Microslip
from validation.front import Rung
from validation.front_ways import ANNULI, DEFAULT, FEW_ANNULI, FRICTION, STEEL, SUPERPOSITION, laws, rungs, thrown
from validation.reference import annulus, superposition

Array = NDArray[np.float64]

HISTORY_NODES = [8, 16, 32]
HISTORY_STEPS = [50, 100, 200, 400, 800]
ALL_SPRINGS_STEPS = [50, 100, 200, 800, 1600, 3200]  # of the law as it is by default, which takes COLLIDE_STEPS
COLLIDE_STEPS = 400  # the default of `collide`
PATH_NODES = [8, 16, 32, 64, 128]
FINE = 16000  # steps of the superposition method that others are judged by
DEEPEST = 0.01  # of the paths, over the radius
SWINGS = [(0.3, 1.0), (1.5, 2.0), (1.0, 3.5)]  # of the paths: height over DEEPEST mu/kappa, and periods


def histories(impacts: list[tuple[float, float]], repeats: int, quick: bool) -> dict[str, Rung]:
    """F over mu P_max at each instant of whole impacts (psi_1, chi), against the superposition method in fine steps."""
    exact = [superposition.impact(*one, FINE) for one in impacts]
    sizes = list(zip(exact, impacts, strict=True))

    def error(time: Array, force: Array, of: superposition.Impact) -> float:
        return float(np.abs(force - np.interp(time, of.time, of.tangential_force)).max())

    def by_law(law: Law, steps: int) -> Array:
        found = []
        for of, one in sizes:
            made = collide(*thrown(law, *one), steps=steps)
            scale = -FRICTION * float(made.normal_force.max())
            found.append(error(made.time / made.time[-1], made.tangential_force[:, 0] / scale, of))
        return np.array(found)

    def by_method(solve: Callable[..., Any], size: int) -> Array:
        made = [(solve(*one, size), of) for of, one in sizes]
        return np.array([error(one.time, one.tangential_force, of) for one, of in made])

    def whole(bodies: list[tuple[ContactPair, Body]], steps: int) -> list[Any]:
        return [collide(*one, steps=steps) for one in bodies]

    def march(solve: Callable[..., Any], size: int) -> list[Any]:
        return [solve(*one, size) for one in impacts]

    runs: dict[str, Callable[[], object]] = {}
    errors: dict[str, Array] = {}
    settings = laws(HISTORY_NODES, HISTORY_STEPS[1::2] if quick else HISTORY_STEPS)
    some = ALL_SPRINGS_STEPS[1::2] if quick else ALL_SPRINGS_STEPS
    settings |= {f"microslip, all springs, {steps} steps": (LAWS["microslip"], steps) for steps in some}
    for name, (law, steps) in settings.items():
        count = steps or COLLIDE_STEPS
        runs[name] = partial(whole, [thrown(law, *one) for one in impacts], count)
        errors[name] = by_law(law, count)
    for size in SUPERPOSITION:
        name = f"superposition, {size} steps"
        runs[name], errors[name] = partial(march, superposition.impact, size), by_method(superposition.impact, size)
    for size in FEW_ANNULI if quick else ANNULI:
        name = f"annuli, N = {size}"
        runs[name], errors[name] = partial(march, annulus.impact, size), by_method(annulus.impact, size)
    return rungs(runs, dict.fromkeys(runs, len(impacts)), errors, repeats)


def along_paths(repeats: int, quick: bool) -> dict[str, Rung]:
    """F over mu P_max along paths of 200 samples, against the superposition method, exact on straight segments."""
    part = np.linspace(0.0, 1.0, 201)
    overlap = DEEPEST * np.sin(np.pi * part) ** 0.8
    overlap[-1] = 0.0
    pairs = {name: ContactPair(STEEL, STEEL, FRICTION, radius=1.0, law=law) for name, law in LAWS.items()}
    pairs = {DEFAULT if name == "microslip" else name: pair for name, pair in pairs.items()}
    pairs |= {
        f"microslip, {n} nodes": ContactPair(STEEL, STEEL, FRICTION, radius=1.0, law=Microslip(n)) for n in PATH_NODES
    }
    kappa = pairs[DEFAULT].kappa
    sheared = [FRICTION / kappa * DEEPEST * height * np.sin(2.0 * np.pi * n * part) for height, n in SWINGS]
    exact = [superposition.force_along_path(overlap, s, kappa=kappa, friction=FRICTION) for s in sheared]
    scale = FRICTION * 4.0 / 3.0 * DEEPEST**1.5  # mu P_max with E* = R = 1

    def by_law(pair: ContactPair) -> list[Array]:
        stiffness = pair.effective_modulus
        return [force_along_path(pair, overlap, s)[1] / stiffness for s in sheared]

    def by_superposition() -> list[Array]:
        return [superposition.force_along_path(overlap, s, kappa=kappa, friction=FRICTION) for s in sheared]

    def by_annuli(annuli: int) -> list[Array]:
        return [
            annulus.force_along_path(overlap, s, kappa=kappa, friction=FRICTION, annuli=annuli) for s in sheared
        ]  # fmt: skip

    runs: dict[str, Callable[[], list[Array]]] = {name: partial(by_law, pair) for name, pair in pairs.items()}
    runs["superposition"] = by_superposition
    runs |= {f"annuli, N = {n}": partial(by_annuli, n) for n in (FEW_ANNULI if quick else ANNULI)}
    errors = {
        name: np.array([np.abs(force - of).max() / scale for force, of in zip(run(), exact, strict=True)])
        for name, run in runs.items()
    }
    return rungs(runs, dict.fromkeys(runs, len(sheared)), errors, repeats)
