"""Closed forms of a tangential load cycle at constant normal force: first loading, unloading, reloading, lost work.

Units: force F over mu P; displacement s over the one at which the whole contact slips, 3 mu P/(4 a G*); work over their
product. Every reversal starts a branch of the first loading's shape, twice as large both ways (Masing's rule): the
slip of the new sense first has to undo the older one.

Sources: Mindlin & Deresiewicz, J. Appl. Mech. 20 (1953) 327-344; Johnson, Contact Mechanics (1985), sections 7.2, 7.4.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from validation.reference.normal_motion import Array


class Loop(NamedTuple):
    """First loading and one whole cycle: s and F from 0 to the turn, back to the opposite turn, and forth again."""

    displacement: Array
    force: Array


def first_loading(displacement: ArrayLike) -> Array:
    """F over s, for any sign: 1 - (1 - s)^(3/2) up to s = 1, then gross slip."""
    s = np.asarray(displacement, dtype=float)
    return np.sign(s) * (1.0 - np.maximum(1.0 - np.abs(s), 0.0) ** 1.5)


def turning_displacement(amplitude: float) -> float:
    """s at which first loading reaches the force amplitude, between 0 and 1."""
    _check(amplitude)
    return 1.0 - (1.0 - amplitude) ** (2.0 / 3.0)


def cycle(amplitude: float, points: int = 201) -> Loop:
    """Load cycle between F = amplitude, in (0, 1], and F = -amplitude; so many points on each branch, even in s."""
    turn = turning_displacement(amplitude)
    loading, back = np.linspace(0.0, turn, points), np.linspace(turn, -turn, points)
    unloading = amplitude - 2.0 * first_loading(0.5 * (turn - back))
    force = np.concatenate([first_loading(loading), unloading[1:], -unloading[1:]])
    return Loop(np.concatenate([loading, back[1:], -back[1:]]), force)


def lost_work(amplitude: float) -> float:
    """Work that one cycle between +-amplitude turns to heat (Johnson 1985, section 7.4)."""
    _check(amplitude)
    left = 1.0 - amplitude
    return 4.8 * (1.0 - left ** (5.0 / 3.0) - 5.0 / 6.0 * amplitude * (1.0 + left ** (2.0 / 3.0)))


def _check(amplitude: float) -> None:
    if not 0.0 < amplitude <= 1.0:
        raise ValueError(f"amplitude is {amplitude!r}; it must lie in (0, 1]: the largest F/(mu P)")
