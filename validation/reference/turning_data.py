"""Reference data for slides that turn and for spin: `python -m validation.reference.turning_data` writes them anew.

What the ring and grid solvers tend to, each figure with an estimate of its error (refinement.extrapolated). Units:
force over mu P_max; psi, sigma and chi as in rings.py and grid.py.
"""

import json
import math
from collections.abc import Callable
from itertools import chain, product
from pathlib import Path
from typing import Any

import numpy as np

from validation.reference import grid, rings
from validation.reference.normal_motion import Array
from validation.reference.refinement import extrapolated
from validation.reference.turning_paths import MARKS, NAMES, path

FILE = Path(__file__).with_name("turning.json")

AMPLITUDES = [0.2, 0.4, 0.6, 0.8, 1.0, 1.3]
LEAST_RINGS = 32  # the finest has 4 times as many
STEPS_PER_RING = 0.5  # from mark to mark
STEPS_PER_IMPACT = 16  # and ring

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
Estimated = tuple[Array, float]


def force(name: str, amplitude: float, least: int = LEAST_RINGS) -> Estimated:
    """Force at the marks of a path, shape (n, 2), and its error."""

    def run(count: int) -> Array:
        fine = int(STEPS_PER_RING * count)
        approach, slide = path(name, amplitude, fine)
        return rings.force_along_path(approach, slide, rings=count)[::fine] / (4.0 / 3.0 * approach.max() ** 1.5)

    return extrapolated(run, least)


def uneven_rebound(chi: list[float], psi: float, heading: float, least: int = LEAST_RINGS) -> Estimated:
    """psi_2 along both principal directions of the tangential mass, and its error; heading [degrees] from the first."""
    incidence = psi * np.array([math.cos(math.radians(heading)), math.sin(math.radians(heading))])
    return extrapolated(lambda m: rings.rebound(incidence, chi, rings=m, steps=STEPS_PER_IMPACT * m), least)


def spinning_rebound(nu: float, chi_s: float, psi: float, sigma: float, least: int = LEAST_CELLS) -> Estimated:
    """psi_2 and sigma_2 of a ball, and their error."""
    spun, chi = [psi, 0.0, sigma], [BALL_CHI, BALL_CHI, chi_s]
    return extrapolated(lambda m: grid.rebound(spun, chi, nu=nu, cells=m, steps=STEPS_PER_CELL * m)[[0, 2]], least)


def forces() -> list[Data]:
    """Force at the marks of every path."""
    found = []
    for name, amplitude in product(NAMES, AMPLITUDES):
        values, error = force(name, amplitude)
        error = float(f"{error:.1e}")
        found.append({"path": name, "amplitude": amplitude, "error": error, "force": np.round(values, 4).tolist()})
    return found


def uneven() -> list[list[float]]:
    """chi_1, chi_2, psi_1, heading [degrees], psi_2 along both directions, error."""
    return [[*chi, psi, heading, *_row(uneven_rebound(chi, psi, heading))]
            for chi, psi, heading in product(UNEVEN_CHI, UNEVEN_PSI, HEADINGS)]  # fmt: skip


def spinning() -> list[list[float]]:
    """nu, chi_s, psi_1, sigma_1, psi_2, sigma_2, error."""
    heavy = product(NUS, [0.0], SPIN_PSI, SIGMAS)
    light = product(NUS[1:], [LARGE_CHI_S], [0.0, 0.5, 1.2, 3.0], [0.1, 0.3])
    return [[*given, *_row(spinning_rebound(*given))] for given in chain(heavy, light)]


def _row(found: Estimated) -> list[float]:
    return [*np.round(found[0], 5).tolist(), float(f"{found[1]:.1e}")]


def load() -> Data:
    """The data as saved."""
    return json.loads(FILE.read_text())


def main(say: Callable[[str], None] = print) -> None:
    """Compute everything, 20 minutes on one core, and write the file: one line for each entry of the lists."""
    settings = {
        "rings": f"{LEAST_RINGS}, {2 * LEAST_RINGS}, {4 * LEAST_RINGS}; {STEPS_PER_RING} steps from mark to mark, "
        f"or {STEPS_PER_IMPACT} an impact, times rings; extrapolated",
        "grid": f"{LEAST_CELLS}, {2 * LEAST_CELLS}, {4 * LEAST_CELLS} cells across; {STEPS_PER_CELL} steps an "
        "impact times cells; extrapolated",
        "chi": BALL_CHI,
    }
    told = {"what": (__doc__ or "").split("\n")[0],
            "marks": f"turning_paths.path(name, amplitude): {MARKS} marks a turn",
            "units": "force over mu P_max; displacement over that of full slip; psi, sigma, chi as in "
            "validation.reference", "settings": settings}  # fmt: skip
    parts = [f'"{name}": {json.dumps(value)}' for name, value in told.items()]
    for name, compute in (("forces", forces), ("uneven", uneven), ("spinning", spinning)):
        say(f"{name}: {(compute.__doc__ or '').strip()}")
        rows = ",\n  ".join(json.dumps(row, separators=(",", ":")) for row in compute())
        parts.append(f'"{name}": [\n  {rows}\n]')
    FILE.write_text("{\n" + ",\n".join(parts) + "\n}\n")
    say(f"wrote {FILE}, {FILE.stat().st_size} bytes")


if __name__ == "__main__":
    main()
