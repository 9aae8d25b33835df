"""Reference data for slides that turn and for spin: `python -m validation.reference.turning_data` writes them anew.

What the ring and grid solvers tend to, each figure with an estimate of its error (refinement.extrapolated). Units:
force over mu P_max; psi, sigma and chi as in rings.py and grid.py.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from validation.reference import grid, rings
from validation.reference.refinement import extrapolated
from validation.reference.turning_paths import MARKS, NAMES, path

FILE = Path(__file__).parents[1] / "data" / "turning.json"

AMPLITUDES = [0.2, 0.4, 0.6, 0.8, 1.0, 1.3]
LEAST_RINGS = 32  # the finest has 4 times as many
STEPS_PER_RING = 0.5  # from mark to mark

UNEVEN_CHI = [[1.5, 0.5], [2.4, 0.8]]
UNEVEN_PSI = [0.3, 0.6, 1.0, 1.5, 2.5, 4.0]
HEADINGS = [15.0, 30.0, 45.0, 60.0, 75.0]

BALL_CHI = 1.465  # a solid ball with nu = 0.28
NUS = [0.0, 0.28]
SPIN_PSI = [0.2, 0.5, 1.0, 1.2, 2.0, 3.0, 5.0]
SIGMAS = [0.0, 0.05, 0.1, 0.18, 0.3]
LARGE_CHI_S = 0.1  # such a ball pressed in by a tenth of its radius
LEAST_CELLS = 20
STEPS_PER_CELL = 8

Data = dict[str, Any]


def forces() -> list[Data]:
    """Force at the marks of every path."""

    def one(name: str, amplitude: float) -> Data:
        def run(count: int) -> np.ndarray:
            fine = int(STEPS_PER_RING * count)
            approach, slide = path(name, amplitude, fine)
            return rings.force_along_path(approach, slide, rings=count)[::fine] / (4.0 / 3.0 * approach.max() ** 1.5)

        force, error = extrapolated(run, LEAST_RINGS)
        return {"path": name, "amplitude": amplitude, "error": _short(error), "force": np.round(force, 4).tolist()}

    return [one(name, amplitude) for name in NAMES for amplitude in AMPLITUDES]


def uneven() -> list[list[float]]:
    """chi_1, chi_2, psi_1, heading [degrees], psi_2 along both directions, error."""

    def one(chi: list[float], psi: float, heading: float) -> list[float]:
        angle = math.radians(heading)
        incidence = psi * np.array([math.cos(angle), math.sin(angle)])
        found, error = extrapolated(lambda m: rings.rebound(incidence, chi, rings=m, steps=16 * m), LEAST_RINGS)
        return [*chi, psi, heading, *np.round(found, 5).tolist(), _short(error)]

    return [one(chi, psi, heading) for chi in UNEVEN_CHI for psi in UNEVEN_PSI for heading in HEADINGS]


def spinning() -> list[list[float]]:
    """nu, chi_s, psi_1, sigma_1, psi_2, sigma_2, error."""

    def one(nu: float, chi_s: float, psi: float, sigma: float) -> list[float]:
        def run(cells: int) -> np.ndarray:
            chi = [BALL_CHI, BALL_CHI, chi_s]
            return grid.rebound([psi, 0.0, sigma], chi, nu=nu, cells=cells, steps=STEPS_PER_CELL * cells)[[0, 2]]

        found, error = extrapolated(run, LEAST_CELLS)
        return [nu, chi_s, psi, sigma, *np.round(found, 5).tolist(), _short(error)]

    fixed = [one(nu, 0.0, psi, sigma) for nu in NUS for psi in SPIN_PSI for sigma in SIGMAS]
    return fixed + [one(NUS[1], LARGE_CHI_S, psi, sigma) for psi in [0.0, 0.5, 1.2, 3.0] for sigma in [0.1, 0.3]]


def _short(error: float) -> float:
    return float(f"{error:.1e}")


def main(say: Callable[[str], None] = print) -> None:
    """Compute everything, 20 minutes on one core, and write the file."""
    data: Data = {
        "what": __doc__.split("\n")[0] if __doc__ else "",
        "units": "force over mu P_max; displacement over that of full slip; psi, sigma, chi as in validation.reference",
        "marks": f"turning_paths.path(name, amplitude): {MARKS} marks a turn",
        "settings": {
            "rings": f"{LEAST_RINGS}, {2 * LEAST_RINGS}, {4 * LEAST_RINGS}; {STEPS_PER_RING} steps from mark to mark, "
            "or 16 an impact, times rings; extrapolated",
            "grid": f"{LEAST_CELLS}, {2 * LEAST_CELLS}, {4 * LEAST_CELLS} cells across; {STEPS_PER_CELL} steps an "
            "impact times cells; extrapolated",
            "chi": BALL_CHI,
        },
    }
    for name, compute in (("forces", forces), ("uneven", uneven), ("spinning", spinning)):
        say(f"{name}: {(compute.__doc__ or '').strip()}")
        data[name] = compute()
    FILE.write_text(_text(data))
    say(f"wrote {FILE}, {FILE.stat().st_size} bytes")


def _text(data: Data) -> str:
    """JSON with one line for each entry of the lists."""
    parts = []
    for name, value in data.items():
        if isinstance(value, list):
            rows = ",\n  ".join(json.dumps(row, separators=(",", ":")) for row in value)
            parts.append(f'"{name}": [\n  {rows}\n]')
        else:
            parts.append(f'"{name}": {json.dumps(value)}')
    return "{\n" + ",\n".join(parts) + "\n}\n"


if __name__ == "__main__":
    main()
