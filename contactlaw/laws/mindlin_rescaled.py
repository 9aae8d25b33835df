"""Mindlin's spring, rescaled while the contact shrinks."""

from dataclasses import dataclass

from contactlaw.laws.single_spring import SingleSpring


@dataclass(frozen=True)
class MindlinRescaled(SingleSpring):
    """`mindlin` with the force reduced by a/a_old while the contact shrinks, so that unloading creates no energy."""

    name = "mindlin_rescaled"
    source = "Mindlin's spring rescaled on unloading: Thornton, Cummins & Cleary, Powder Technol. 233 (2013) 30"
    rung = 3
    rescaled = True
