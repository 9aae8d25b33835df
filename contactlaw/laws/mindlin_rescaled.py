"""Mindlin's spring, rescaled while the contact shrinks."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

from contactlaw.laws.base import Impacts, Law
from contactlaw.laws.single_spring import impacts, spring_energy, spring_force


@dataclass(frozen=True)
class MindlinRescaled(Law):
    """`mindlin` with the force reduced by a/a_old while the contact shrinks, so that unloading creates no energy."""

    name = "mindlin_rescaled"
    source = "Mindlin's spring rescaled on unloading: Thornton, Cummins & Cleary, Powder Technol. 233 (2013) 30"
    rung = 3

    @staticmethod
    def force(contact, law, memory, du, dv, dt):
        """One spring under one cap."""
        return spring_force(contact, memory, False, True, du, dv)

    @staticmethod
    def energy(contact, law, memory):
        """F^2/(4 G* a)."""
        return spring_energy(contact, memory, 2.0 * contact.g_star * sqrt(contact.radius * contact.overlap))

    def impacts(self, zeta: float, steps: int) -> Impacts:
        """The same spring in scaled variables."""
        return impacts(self, zeta, steps, rescaled=True)
