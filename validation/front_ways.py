"""Every law in every setting, without an engine: what each way costs and errs, and forces over impacts and paths."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contactlaw import LAWS, MATERIALS, Body, ContactPair, collide, force_along_path
from contactlaw.laws import Law
from contactlaw.laws.microslip import Microslip
from validation.case import Array
from validation.front import Rung
from validation.measure import interleaved
from validation.reference import annulus, superposition

SUPERPOSITION = [16, 32, 64, 128, 256, 512, 1024]  # steps
ANNULI = [5, 10, 20, 40]
FEW_ANNULI = ANNULI[:3]
SINGLE = ("linear_spring", "mindlin", "mindlin_rescaled")
STEEL, FRICTION, RADIUS, MASS = MATERIALS["steel"], 0.115, 0.025, 0.5
DEFAULT = "microslip, default"
HISTORY_NODES = [8, 16, 32]
HISTORY_STEPS = [50, 100, 200, 400, 800]
ALL_SPRINGS_STEPS = [50, 100, 200, 800, 1600, 3200]  # of the law as it is by default, which takes COLLIDE_STEPS
COLLIDE_STEPS = 400  # the default of `collide`
PATH_NODES = [8, 16, 32, 64, 128]
FINE = 16000  # steps of the superposition method that others are judged by
DEEPEST = 0.01  # of the paths, over the radius
SWINGS = [(0.3, 1.0), (1.5, 2.0), (1.0, 3.5)]  # of the paths: height over DEEPEST mu/kappa, and periods


def laws(nodes: Iterable[int], steps: Iterable[int]) -> dict[str, tuple[Law, int | None]]:
    """Settings of every law, by name."""
    found: dict[str, tuple[Law, int | None]] = {DEFAULT: (LAWS["microslip"], None)}
    found |= {f"microslip, {n} nodes, {s} steps": (Microslip(node_count=n), s) for n in nodes for s in steps}
    found |= {f"{name}, {s} steps": (LAWS[name], s) for name in SINGLE for s in steps}
    return found | {"coulomb": (LAWS["coulomb"], None)}


def rungs(
    runs: Mapping[str, Callable[[], object]], counts: dict[str, int], errors: dict[str, Array], repeats: int,
    problems: dict[str, str] | None = None,
) -> dict[str, Rung]:  # fmt: skip
    """Time all side by side; counts: impacts a run."""
    seconds = interleaved(runs, repeats)
    return {
        name: Rung(name.split(",")[0], errors[name], seconds[name] / counts[name], (problems or {}).get(name, ""))
        for name in runs
    }


def sample(count: int) -> NDArray[np.int64]:
    """Every fifth impact: enough to time what is slow."""
    return np.arange(2, count, 5)


def thrown(law: str | Law, psi_1: float, chi: float) -> tuple[ContactPair, Body]:
    """A body in SI units whose impact has these two numbers; its inertia makes chi what it is to be."""
    pair = ContactPair(STEEL, STEEL, FRICTION, 1.0, law=law)
    inertia = RADIUS**2 * MASS / (2.0 * chi / pair.kappa - 1.0)
    velocity = (psi_1 * FRICTION / pair.kappa, 0.0, -1.0)
    return pair, Body(mass=MASS, radius=RADIUS, inertia=inertia, velocity=velocity)


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
