"""Every law in every setting, without an engine, and how such ways are timed: shared by the fronts of the law alone."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from contactlaw import LAWS, MATERIALS, Body, ContactPair
from contactlaw.laws import Law
from contactlaw.laws.microslip import Microslip
from validation.front import Rung
from validation.measure import interleaved

Array = NDArray[np.float64]

SUPERPOSITION = [16, 32, 64, 128, 256, 512, 1024]  # steps
ANNULI = [5, 10, 20, 40]
FEW_ANNULI = ANNULI[:3]
SINGLE = ("linear_spring", "mindlin", "mindlin_rescaled")
STEEL, FRICTION, RADIUS, MASS = MATERIALS["steel"], 0.115, 0.025, 0.5
DEFAULT = "microslip, default"


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
