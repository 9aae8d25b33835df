"""One spring k_T = 2 G* a under one cap: what most discrete-element codes do."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

from contactlaw.laws.base import Impacts, Law
from contactlaw.laws.single_spring import impacts, spring_energy, spring_force


@dataclass(frozen=True)
class Mindlin(Law):
    """One spring, dF = 2 G* a ds, capped at mu P. Unloading with a loaded spring can create energy."""

    name = "mindlin"
    source = "full-stick stiffness of Mindlin, J. Appl. Mech. 16 (1949) 259, with a Coulomb cap on the total"
    rung = 2

    @staticmethod
    def force(contact, law, memory, du, dv, dt):
        """One spring under one cap."""
        return spring_force(contact, memory, False, False, du, dv)

    @staticmethod
    def energy(contact, law, memory):
        """F^2/(4 G* a)."""
        return spring_energy(contact, memory, 2.0 * contact.g_star * sqrt(contact.radius * contact.overlap))

    def impacts(self, zeta: float, steps: int) -> Impacts:
        """The same spring in scaled variables."""
        return impacts(self, zeta, steps)
