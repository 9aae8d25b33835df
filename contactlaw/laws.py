"""The ladder of tangential laws, each rung there so that the next can be judged."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from contactlaw import checks
from contactlaw.kernels import contact


@dataclass(frozen=True)
class Law:
    """How the tangential force of a contact follows from its motion.

    To add a law:
      1. give it a code and a branch in `kernels.contact.friction`, with its equations and their source there;
      2. keep what it must remember in the history, `nodes` tractions (or springs) after the header, nothing elsewhere;
      3. never let the tangential force leave the cone mu P, nor the history change when a step is only looked at;
      4. give it a path in `kernels.rebound` and `impact._group`; without one `rebound` refuses the law;
      5. subclass `Law` here with `name`, `code`, `source`: LAWS, the command line and the property tests find it.

    Attributes:
        name: As users write it.
        code: Of the branch in the kernels.
        source: Where the law comes from.
    """

    name: ClassVar[str]
    code: ClassVar[int]
    source: ClassVar[str]

    @property
    def nodes(self) -> int:
        """How many tractions (or springs) the history holds."""
        return 1

    def nodes_or(self, suggested: int | None) -> int:
        """The same, where the number is left open as many as suggested."""
        return self.nodes


@dataclass(frozen=True)
class Coulomb(Law):
    """Rigid friction on the Hertz normal force: it can stop the sliding of the contact point, never reverse it."""

    name = "coulomb"
    code = contact.COULOMB
    source = "Coulomb friction at the velocity level, as rigid-body engines have it"

    @property
    def nodes(self) -> int:
        """None."""
        return 0


@dataclass(frozen=True)
class LinearSpring(Law):
    """Linear normal and tangential springs, k_T = kappa k_N, k_N = m_N (pi/T_Hertz)^2 at the touching speed."""

    name = "linear_spring"
    code = contact.LINEAR_SPRING
    source = "linearisation in Maw, Barber & Fawcett, J. Lubr. Technol. 103 (1981) 74, eqs. (3) to (5)"


@dataclass(frozen=True)
class Mindlin(Law):
    """One spring, dF = 2 G* a ds, capped at mu P. Unloading with a loaded spring can create energy."""

    name = "mindlin"
    code = contact.MINDLIN
    source = "full-stick stiffness of Mindlin, J. Appl. Mech. 16 (1949) 259, with a Coulomb cap on the total"


@dataclass(frozen=True)
class MindlinRescaled(Law):
    """`mindlin` with the force reduced by a/a_old while the contact shrinks, so that unloading creates no energy."""

    name = "mindlin_rescaled"
    code = contact.MINDLIN_RESCALED
    source = "Mindlin's spring rescaled on unloading: Thornton, Cummins & Cleary, Powder Technol. 233 (2013) 30"


@dataclass(frozen=True)
class Microslip(Law):
    """Springs along the contact line, each with its own Coulomb cap: part of the contact slips while the rest sticks.

    Attributes:
        node_count: Gauss-Legendre nodes on half the line. None: all springs at once where the motion is along a line
            (`collide`, `force_along_path`); else 16, or as many as chi asks for where it is known (`rebound`).
    """

    name = "microslip"
    code = contact.MICROSLIP
    source = "method of dimensionality reduction: Popov & Hess (2015); Lyashenko & Popov, Tech. Phys. Lett. 41 (2015)"
    node_count: int | None = None

    def __post_init__(self) -> None:
        if self.node_count is not None and not (isinstance(self.node_count, int) and 2 <= self.node_count <= 512):
            raise ValueError(f"node_count = {self.node_count!r}: must be None or an integer from 2 to 512")

    @property
    def nodes(self) -> int:
        """One traction for each node."""
        return self.node_count or 16

    def nodes_or(self, suggested: int | None) -> int:
        """As many as given, else as suggested."""
        return self.node_count or suggested or self.nodes


LAWS: dict[str, Law] = {cls.name: cls() for cls in Law.__subclasses__()}
"""Every law by its name, in the order of the ladder."""


def law_of(value: str | Law) -> Law:
    """The law with this name, or the given law itself."""
    if isinstance(value, Law):
        return value
    return LAWS[checks.one_of("law", value, LAWS)]
