"""Linear normal and tangential springs, as in linear discrete-element codes."""

from dataclasses import dataclass

from contactlaw.laws.single_spring import SingleSpring


@dataclass(frozen=True)
class LinearSpring(SingleSpring):
    """Linear normal and tangential springs, k_T = kappa k_N, k_N = m_N (pi/T_Hertz)^2 at the touching speed."""

    name = "linear_spring"
    source = "linearisation in Maw, Barber & Fawcett, J. Lubr. Technol. 103 (1981) 74, eqs. (3) to (5)"
    rung = 1
    linear = True
