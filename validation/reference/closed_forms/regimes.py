"""What sticks and what slides in the elastic theory of oblique impact.

While all of a contact slides, its surface moves with the closing velocity v (in units of psi; gross_slip.py), and
momentum gives psi = psi_1 - 2 chi (1 - v) with v falling from 1 to -e. The contact slides as long as psi > v.

Source: Maw, Barber & Fawcett, J. Lubr. Technol. 103 (1981) 74, "Solutions" (i) to (iii) and appendix, for e = 1. The
scan of that paper prints 4 lambda and 1 + 1/K; 4 chi and 1 + 1/K^2 are meant (its eqs. (3), (5) and (6) have K^2).
"""

STARTS_SLIDING = 1.0
"""psi_1 above which the contact slides from the touch on."""


def slides_throughout_from(chi: float, restitution: float = 1.0) -> float:
    """Least psi_1 from which the contact slides to the end: max(1, 2 chi (1 + e) - e); 4 chi - 1 for e = 1.

    With e < 1 this supposes a normal force whose damping leaves the closing velocity the measure of sliding, as both
    the annulus solver and `contactlaw` have it.
    """
    return max(STARTS_SLIDING, 2.0 * chi * (1.0 + restitution) - restitution)


def rescaled_spring_slides_throughout_from(chi: float, restitution: float = 1.0) -> float:
    """The same for one spring whose force is scaled by a/a_old while the contact shrinks.

    On its limit F = mu P, with P as delta^(3/2) and a as delta^(1/2), the scaling takes a third of dP by itself; the
    displacement has to follow the other two thirds, so it sticks from psi = 2/3 v on where the bodies part:
    max(1, 2 chi (1 + e) - 2/3 e).
    """
    return max(STARTS_SLIDING, 2.0 * chi * (1.0 + restitution) - 2.0 / 3.0 * restitution)


def closing_velocity_at_first_stick(psi_1: float, chi: float, restitution: float = 1.0) -> float:
    """Closing velocity over approach speed at which an impact that starts sliding sticks all at once.

    (2 chi - psi_1)/(2 chi - 1), between 1 and -e; psi is the same then.

    Raises:
        ValueError: psi_1 is not above 1 and below `slides_throughout_from`.
    """
    end = slides_throughout_from(chi, restitution)
    if not STARTS_SLIDING < psi_1 < end:
        raise ValueError(f"psi_1 is {psi_1!r}; sliding that ends needs it between 1 and {end!r}")
    return (2.0 * chi - psi_1) / (2.0 * chi - 1.0)
