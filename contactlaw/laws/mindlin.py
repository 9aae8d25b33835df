"""One spring k_T = 2 G* a with one Coulomb limit, as in most discrete-element codes."""

from dataclasses import dataclass

from contactlaw.laws.single_spring import SingleSpring


@dataclass(frozen=True)
class Mindlin(SingleSpring):
    """One spring, dF = 2 G* a ds, capped at mu P. Unloading with a loaded spring can create energy."""

    name = "mindlin"
    source = "full-stick stiffness of Mindlin, J. Appl. Mech. 16 (1949) 259, with a Coulomb cap on the total"
    rung = 2
