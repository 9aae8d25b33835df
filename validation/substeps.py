"""What a substep of one contact costs by law, without any engine.

A substep is `laws.step.press` and `ask`. Its impact goes from overlap 0 over D to 0 as a half sine, while the slide
swings back; it starts stuck (psi_1 = 1/2), so that every node of the microslip law is at work in every step.
"""

from collections.abc import Callable
from hashlib import sha256
from math import pi
from pathlib import Path

import numpy as np

from contactlaw import LAWS, MATERIALS, ContactPair
from contactlaw.jit import jit_for
from contactlaw.laws.microslip import NODES
from contactlaw.laws.record import PAIR_SIZE, pair_of
from contactlaw.laws.step import ask, press, reset
from validation.case import Array
from validation.measure import Spread, interleaved, spread

FRICTION, RADIUS = 0.115, 0.0254  # [m]
RESTITUTION = 0.93  # of the paper's steel
DEEPEST, SPEED = 1e-5, 0.1  # overlap [m] and speed of approach [m/s]
STEPS = 100  # of an impact; its last one ends apart and is left out
IMPACTS = 20  # in a call that is timed

jit = jit_for(sha256(Path(__file__).read_bytes()).hexdigest())


def substep_times(repeats: int) -> dict[str, Spread]:
    """Time of a substep [ns], by law."""
    calls = {f"{law}{f', {NODES} nodes' if law == 'microslip' else ''}": impacts_of(law) for law in LAWS}
    calls["microslip, damped"] = impacts_of("microslip", RESTITUTION)
    seconds = interleaved(calls, repeats)
    return {name: spread(1e9 * one / ((STEPS - 1) * IMPACTS)) for name, one in seconds.items()}


def impacts_of(law: str, restitution: float = 1.0, impacts: int = IMPACTS) -> Callable[[], Array]:
    """A call that returns normal and tangential force of an impact [N], shape (STEPS - 1, 2)."""
    pair = ContactPair(MATERIALS["steel"], MATERIALS["steel"], FRICTION, restitution, radius=RADIUS, law=law)
    p, (header, memory) = pair.parameters(), pair.law.with_nodes(None).new_contact()
    dt, turn = pi * DEEPEST / SPEED / STEPS, np.linspace(0.0, pi, STEPS + 1)
    overlap = DEEPEST * np.sin(turn[:-1])
    slide = 0.5 * FRICTION / pair.kappa * SPEED * np.cos(2.0 * turn[:-2]) * dt
    mass = 4.0 / 3.0 * pair.effective_modulus * RADIUS**0.5 * DEEPEST**2.5 / (1.25 * SPEED**2)
    forces = np.zeros((STEPS - 1, 2))
    return lambda: _impacts(p, header, memory, overlap, slide, dt, mass, impacts, forces)


@jit
def _impacts(p, header, memory, overlap, slide, dt, mass, impacts, force_out):
    pair, contact, law = pair_of(p), header[0], p[PAIR_SIZE:]
    for _ in range(impacts):
        memory[:] = 0.0
        reset(contact, pair, pair.radius)
        contact.mass, contact.tangential_mass = mass, mass
        for i in range(slide.size):
            contact.before, contact.overlap = overlap[i], overlap[i + 1]
            contact.closing = (overlap[i + 1] - overlap[i]) / dt
            press(contact, pair, dt)
            ask(contact, pair, law, memory, slide[i], 0.0, dt)
            force_out[i, 0], force_out[i, 1] = contact.force, contact.f
    return force_out
