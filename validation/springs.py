"""`microslip` as it is along a line, springs with a cap each, on whatever path: for comparison where it turns."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

from contactlaw.laws.microslip import Microslip, displace, follow
from contactlaw.laws.record import OPEN, SLIDING, SPRUNG
from contactlaw.laws.slip import carried, slides_on, sliding_direction


@dataclass(frozen=True)
class Springs(Microslip):
    """`Microslip` that never looks whether the slide turns."""

    name = "springs"
    source = "method of dimensionality reduction, applied in the plane"

    @staticmethod
    def force(contact, law, memory, du, dv, dt):
        """All nodes displaced, each with the limit of its own place on the line."""
        if contact.state == OPEN:
            contact.scale = sqrt(contact.radius * contact.reach)
        else:
            follow(contact, law, memory)
        if contact.state != SPRUNG and slides_on(contact, du, dv, 0.0):
            return contact.f, contact.g
        mu_e, start = contact.friction * contact.e_star, max(contact.before, 0.0)
        s2 = contact.scale * contact.scale / contact.radius
        if contact.state == SLIDING:
            x, y = sliding_direction(contact)
            for i in range(law.w.size):
                cap = mu_e * max(start - s2 * law.x2[i], 0.0)
                memory[0, i], memory[1, i] = cap * x, cap * y
        contact.state = SPRUNG
        gu, gv = contact.g_star * du, contact.g_star * dv
        pull_u, pull_v, load = displace(law, memory, s2, contact.overlap, contact.before, gu, gv, mu_e)
        share = contact.elastic / (contact.e_star * load) if load > 0.0 else 0.0
        return carried(contact, pull_u * share, pull_v * share)
