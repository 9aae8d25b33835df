"""One tangential spring for the whole contact with a Coulomb limit: shared by linear_spring and both mindlin laws."""

from math import sqrt
from typing import ClassVar

from contactlaw.jit import jit
from contactlaw.laws.base import Array, Impacts, Law
from contactlaw.laws.hertz import elastic_force
from contactlaw.laws.record import SLIDING, SPRUNG, record_of
from contactlaw.laws.slip import carried, held, slides_on, sliding_direction, stuck_stiffness
from contactlaw.laws.whole_impacts import impacts

RESCALED = 1.0 / 3.0  # relative loss of a rescaled spring over that of P as the contact shrinks, (da/a)/(dP/P)


@jit
def stiffness_of(contact, law):
    """k_T [N/m] at the present overlap."""
    if law.linear != 0.0:
        return contact.g_star / contact.e_star * contact.stiffness
    return stuck_stiffness(contact)


class SingleSpring(Law):
    """Base class of laws with one spring, dF = k_T ds, |F| <= mu P; its memory holds the elastic part of F.

    Attributes:
        linear: k_T = kappa k_N of the linear normal spring; else k_T = 2 G* a.
        rescaled: Whether the force is reduced by a/a_old while the contact shrinks.
    """

    rescaled: ClassVar[bool] = False
    stiffness = staticmethod(stiffness_of)

    def numbers(self) -> Array:
        """Return `linear` and `rescaled`."""
        return record_of(linear=self.linear, rescaled=self.rescaled)

    @staticmethod
    def force(contact, law, memory, du, dv, dt):
        """Tangential force [N] of the spring; k_T = 2 G* a is averaged over the step."""
        if contact.state != SPRUNG and slides_on(contact, du, dv, RESCALED * law.rescaled):
            return contact.f, contact.g
        overlap, before = contact.overlap, contact.before
        start = max(before, 0.0)
        if contact.state == SLIDING:
            x, y = sliding_direction(contact)
            limit = contact.friction * elastic_force(contact, law.linear != 0.0, start)
            memory[0, 0], memory[1, 0] = limit * x, limit * y
        contact.state = SPRUNG
        part = 1.0 if before >= 0.0 else overlap / (overlap - before)
        shrink = 1.0  # square root of a/a_old, applied half before and half after the displacement: second order
        if law.linear != 0.0:
            stiffness = stiffness_of(contact, law)
        else:
            a, b = sqrt(contact.radius * start), sqrt(contact.radius * overlap)
            stiffness = 4.0 / 3.0 * contact.g_star * (a * a + a * b + b * b) / (a + b)
            if law.rescaled != 0.0 and b < a:
                shrink = sqrt(b / a)
        f = shrink * (shrink * memory[0, 0] + stiffness * part * du)
        g = shrink * (shrink * memory[1, 0] + stiffness * part * dv)
        share = held(contact, f, g)
        memory[0, 0], memory[1, 0] = f, g = share * f, share * g
        return carried(contact, f, g)

    @staticmethod
    def energy(contact, law, memory):
        """F^2/(2 k_T) [J]."""
        limit = contact.friction * contact.elastic
        square = limit * limit if contact.state == SLIDING else memory[0, 0] ** 2 + memory[1, 0] ** 2
        return 0.5 * square / stiffness_of(contact, law) if contact.overlap > 0.0 else 0.0

    def impacts(self, zeta: float, steps: int) -> Impacts:
        """Integrate the same spring in scaled variables."""
        return impacts(zeta, steps, linear=self.linear, rescaled=self.rescaled)
