"""What a call of the kernels costs with and without a term of the law, and what its branches cost."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from contactlaw import LAWS, MATERIALS, ContactPair, force_along_path, rebound
from contactlaw.laws.microslip import Microslip
from validation.case import Data
from validation.leave_out_branches import ALONE, BRANCHING, IMPACTS, STEPS, TIMED, kernels_of
from validation.leave_out_scenes import BARELY
from validation.measure import interleaved, spread

FRICTION = 0.115
CHI, RESTITUTION = 1.256, 0.93  # the paper's chi, its steel
THROWS = np.linspace(0.05, 4.0 * CHI - 1.05, 200)
"""psi_1 of impacts that all stick at some time: those that slide throughout cost nothing."""
PATH = 200  # points of a loop of force
NODES = Microslip(16)  # as in the engines; left open, a path along a line takes all springs at once


def kernel_times(repeats: int) -> Data:
    """Times of calls, and ratios of those that differ by one term.

    Returns:
        microseconds: spread by the name of the call, for an impact or a path; ratios: spread by what was left out.
    """
    calls: dict[str, Callable[[], object]] = {
        f"impact, {law}": (lambda law=law: rebound(THROWS, CHI, law)) for law in LAWS
    }
    calls["impact, microslip, e = 0.93"] = lambda: rebound(THROWS, CHI, "microslip", RESTITUTION)
    calls["impact, microslip, e = 1"] = lambda: rebound(THROWS, CHI, "microslip", 1.0)
    turn = np.linspace(0.0, 2.0 * np.pi, PATH)
    approach = 1e-5 * (1.0 + 0.5 * np.sin(turn))
    line = 1e-6 * np.sin(3.0 * turn)
    plane = np.column_stack([line, np.zeros(PATH)])
    for law in ("microslip", "mindlin", "coulomb"):
        rule = NODES if law == "microslip" else law
        pair = ContactPair(MATERIALS["steel"], MATERIALS["steel"], FRICTION, radius=0.0254, law=rule)
        calls[f"path, {law}, planar"] = lambda pair=pair: force_along_path(pair, approach, line)
        calls[f"path, {law}, in space"] = lambda pair=pair: force_along_path(pair, approach, plane)
    sticky = ContactPair(
        MATERIALS["steel"], MATERIALS["steel"], FRICTION, radius=0.0254, law=NODES, static_friction=BARELY * FRICTION
    )
    calls["path, microslip, planar, static friction"] = lambda: force_along_path(sticky, approach, line)
    for law, told in TIMED.items():
        calls |= {f"substep, {law}, {kind}": call for kind, call in kernels_of(*told).items()}
    seconds = interleaved(calls, repeats)
    many = {"impact": THROWS.size, "path": 1, "substep": STEPS * IMPACTS}
    parts = {name: many[name.split(",")[0]] for name in calls}
    less = {
        "planar over in space": ("path, microslip, planar", "path, microslip, in space"),
        "mindlin over microslip": ("path, mindlin, planar", "path, microslip, planar"),
        "coulomb over mindlin": ("path, coulomb, planar", "path, mindlin, planar"),
        "one friction over static friction too": (
            "path, microslip, planar", "path, microslip, planar, static friction",
        ),
        "an impact, mindlin over microslip": ("impact, mindlin", "impact, microslip"),
        "an impact, coulomb over mindlin": ("impact, coulomb", "impact, mindlin"),
        "an impact, e = 1 over e = 0.93": ("impact, microslip, e = 1", "impact, microslip, e = 0.93"),
        "a substep, e = 1 over e = 0.93": (
            f"substep, microslip, e = 1, {BRANCHING}", f"substep, microslip, e = 0.93, {BRANCHING}",
        ),
    } | {
        f"a substep, {law}: {BRANCHING} over {ALONE}": (
            f"substep, {law}, {BRANCHING}", f"substep, {law}, {ALONE}",
        ) for law in TIMED
    }  # fmt: skip
    return {
        "microseconds": {name: spread(1e6 * taken / parts[name]) for name, taken in seconds.items()},
        "ratios": {name: spread(seconds[one] / seconds[two]) for name, (one, two) in less.items()},
    }
