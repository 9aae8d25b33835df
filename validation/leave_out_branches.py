"""What it costs that one kernel serves all laws: its branches against the same kernel compiled for one law alone.

The one for a law alone is the engines' source, `kernels.contact`, with its parameters that choose between terms (law,
plane, damping, static friction) as constants: the compiler then drops every term and every branch that the law does not
have. Both go over the same impact: overlap D sin(pi t/T) in the plane, and a slide that swings back; it starts stuck
(psi_1 = 1/2), so that every node of the microslip law is at work in every step.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from math import pi
from pathlib import Path
from types import ModuleType
from typing import Any

import numba
import numpy as np

from contactlaw import LAWS, MATERIALS, ContactPair
from contactlaw.kernels import contact
from contactlaw.kernels.workspace import bare

DEEPEST, SPEED = 1e-5, 0.1  # overlap [m] and speed of approach [m/s]
STEPS = 100  # of an impact
IMPACTS = 20  # in a call that is timed
BRANCHING, ALONE = "branching", "one law alone"
TIMED = {"microslip, e = 0.93": ("microslip", 0.93), "microslip, e = 1": ("microslip", 1.0),
         "mindlin, e = 1": ("mindlin", 1.0), "coulomb, e = 1": ("coulomb", 1.0)}  # fmt: skip


def contact_for(constants: Mapping[str, str]) -> ModuleType:
    """`kernels.contact` with parameters of a contact as constants, by their names there."""
    source = Path(contact.__file__).read_text(encoding="utf-8")
    for name, value in constants.items():
        source, count = re.subn(rf"\bp\[{name}\]", value, source)
        if not count:
            raise ValueError(f"name = {name!r}: must be a parameter that kernels.contact reads")
    module = ModuleType("contact_for_one_law")
    exec(compile(source, "<kernels.contact for one law>", "exec"), module.__dict__)
    return module


def loop_of(kernels: Any) -> Callable[..., None]:
    """Impacts by a kernel's `step`."""
    step = kernels.step

    @numba.njit(error_model="numpy")
    def loop(p, history, overlap, closing, slide, dt, mass, impacts, force_out):
        p, history = bare(p), bare(history)  # as the engines lend them: without a count of references
        none = 0.0 * dt
        for _ in range(impacts):
            for i in range(1, overlap.size):
                normal, f, _ = step(
                    p, history, overlap[i], overlap[i - 1], closing[i], none, slide[i], none, dt, mass, mass
                )
                force_out[i, 0], force_out[i, 1] = normal, f

    return loop


def kernels_of(law: str, restitution: float, impacts: int = IMPACTS) -> dict[str, Callable[[], np.ndarray]]:
    """Calls that return normal and tangential force of an impact [N], shape (STEPS + 1, 2): `BRANCHING`, `ALONE`."""
    pair = ContactPair(MATERIALS["steel"], MATERIALS["steel"], 0.115, restitution, radius=0.0254, law=law)
    p = pair.parameters(plane=(0.0, 0.0, 1.0))
    dt, turn = pi * DEEPEST / SPEED / STEPS, np.linspace(0.0, pi, STEPS + 1)
    overlap = DEEPEST * np.sin(turn)
    overlap[-1] = 0.0  # and the contact forgets
    mass = float(contact.hertz_stiffness(p) * DEEPEST**2.5 / (1.25 * SPEED**2))
    closing, slide = np.diff(overlap, prepend=0.0) / dt, np.zeros(STEPS + 1)
    slide[1:] = 0.5 * pair.friction / pair.kappa * SPEED * np.cos(2.0 * turn[:-1]) * dt
    constants = {"LAW": f"{LAWS[law].code:.1f}", "PLANAR": "1.0", "ZETA": repr(float(p[contact.ZETA])),
                 "STATIC_FRICTION": "p[FRICTION]"}  # fmt: skip

    def call_of(kernels: Any) -> Callable[[], np.ndarray]:
        loop, history, forces = loop_of(kernels), pair.history(planar=True), np.zeros((STEPS + 1, 2))

        def call() -> np.ndarray:
            loop(p, history, overlap, closing, slide, dt, mass, impacts, forces)
            return forces

        return call

    return {BRANCHING: call_of(contact), ALONE: call_of(contact_for(constants))}
