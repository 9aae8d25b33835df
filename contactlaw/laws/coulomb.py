"""Rigid Coulomb friction, as in rigid-body engines."""

from dataclasses import dataclass
from math import inf, sqrt

import numpy as np

from contactlaw.laws.base import Impacts, Law
from contactlaw.laws.oscillator import restitution
from contactlaw.laws.record import SLIDING


@dataclass(frozen=True)
class Coulomb(Law):
    """Rigid friction with the Hertz normal force: it can stop the sliding of the contact point but never reverse it."""

    name = "coulomb"
    source = "Coulomb friction at the velocity level, as rigid-body engines have it"
    rung = 0
    memory = 0

    @staticmethod
    def force(contact, law, memory, du, dv, dt):
        """The force m_T s/dt^2 that stops the slide within the step, at most mu P; mu P if dt = 0."""
        contact.state = SLIDING
        slide, limit = sqrt(du * du + dv * dv), contact.friction * contact.force
        if slide == 0.0:
            return 0.0, 0.0
        mobility = dt * dt / contact.tangential_mass
        pull = slide / mobility if slide <= limit * mobility else limit
        return pull * du / slide, pull * dv / slide

    @staticmethod
    def stiffness(contact, law):
        """Infinite."""
        return inf

    @staticmethod
    def energy(contact, law, memory):
        """Zero."""
        return 0.0

    def impacts(self, zeta: float, steps: int) -> Impacts:
        """Closed form: |psi_2| = max(|psi_1| - 2 chi (1 + e), 0)."""
        e = restitution(zeta)

        def run(psi, chi, out):
            out[:] = np.copysign(np.maximum(np.abs(psi) - 2.0 * chi * (1.0 + e), 0.0), psi)

        return run
