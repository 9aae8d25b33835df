"""The golden numbers in their file, and how far new ones are from them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from contactlaw import LAWS
from sims.scene import ENGINES
from tests.golden.runs import Run

FILE = Path(__file__).with_name("golden.json")
COMMAND = "python -m tests.golden"
NOTHING = 1e-3  # of the tolerance: smaller numbers are kept as zero

Kept = dict[str, tuple[float, Any]]
"""Quantity -> its scale, and its numbers as nested lists."""


def load() -> dict[str, Kept]:
    """Golden numbers of every run by its name."""
    return json.loads(FILE.read_text()) if FILE.exists() else {}


def save(golden: dict[str, Kept]) -> None:
    """Write them, a run a line; numbers read back the same."""
    lines = [f"{json.dumps(name)}: {json.dumps(golden[name], separators=(',', ':'))}" for name in sorted(golden)]
    FILE.write_text("{\n" + ",\n".join(lines) + "\n}\n")


def numbers_of(run: Run) -> Kept:
    """What a run gives, as the file has it."""
    out: Kept = {}
    for quantity, (numbers, scale) in run.make().items():
        array, scale = np.asarray(numbers, dtype=float), float(f"{scale:.3g}")
        assert np.isfinite(array).all() and scale > 0.0, f"{quantity} = {array.tolist()}, scale {scale}"
        out[quantity] = scale, np.where(np.abs(array) < NOTHING * run.tolerance * scale, 0.0, array).tolist()
    return out


def changes(golden: Kept, found: Kept, tolerance: float) -> list[str]:
    """A line for each quantity that is further off than the tolerance, which is relative to the golden scale."""
    out = []
    for quantity in golden | found:
        (scale, old), (_, new) = (one.get(quantity, (1.0, None)) for one in (golden, found))
        if old is None or new is None or np.shape(old) != np.shape(new):
            out.append(f"{quantity}: {np.shape(old)} numbers in the file, {np.shape(new)} now")
            continue
        off = float(np.abs(np.subtract(new, old)).max())
        if not off <= tolerance * scale:
            out.append(f"{quantity}: off by {off:.3g}, {off / scale:.2g} of its scale; allowed {tolerance:g}")
    return out


def why_gone(name: str) -> str:
    """Why nothing makes a run any more that the file has."""
    reason = "tests/golden/runs.py does not make it any more"
    for part in name.split("/")[1:]:
        if part not in LAWS and part.split("-")[0] not in ENGINES:
            reason = f"{part!r} is none of the laws {list(LAWS)} nor of the engines {list(ENGINES)}"
    return f"golden run {name!r} cannot be made: {reason}. If that is meant, `{COMMAND}` takes it out of the file"
