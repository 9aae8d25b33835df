"""What the steps within an engine's step leave to be mended."""

from __future__ import annotations

import numpy as np
import pytest

from contactlaw import MATERIALS, ContactPair
from contactlaw.kernels.subcycle import parting


@pytest.mark.parametrize("law", ["microslip", "linear_spring"])
def test_parting_takes_back_what_a_sum_over_steps_has_too_much(law: str) -> None:
    """Euler-Maclaurin: the sum of (s + j)^m less its integral, s steps from the end, less the same at one."""
    power = 1.0 if law == "linear_spring" else 1.5

    def excess(s: float) -> float:
        end = s + 200
        t = s + np.arange(200)
        return float((t**power).sum() - end ** (power + 1.0) / (power + 1.0) + 0.5 * end**power
                     - power / 12.0 * end ** (power - 1.0))  # fmt: skip

    p = ContactPair(MATERIALS["steel"], MATERIALS["steel"], 0.1, radius=0.02, law=law).parameters()
    for s in np.linspace(0.02, 1.0, 50):
        assert -parting(p, s, 1.0) * s**power == pytest.approx(excess(float(s)) - excess(1.0), abs=1e-4)
