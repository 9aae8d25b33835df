"""Oblique impact on linear springs under a Coulomb cap, piecewise in closed form.

The paper's linearisation: normal and tangential springs in the ratio kappa, so that omega_T/omega_N = sqrt(2 chi) = w.
With time in 1/omega_N from touch, 0, to release, pi, f = F/mu over the greatest force, and v the closing velocity over
the approach speed, P = sin t, v = P' = cos t and

    stick   f' = psi, psi' = -2 chi f:    f, psi are sines and cosines of w t
    slip    f = s P, s = +1 or -1:        psi = psi_0 + 2 chi s (v - v_0)

Stick ends where |f| reaches P, a root of elementary functions, found to rounding; slip ends where the spring end keeps
up with the body, s psi = P', linear in v. Nothing is stepped in time.

Sources: Maw, Barber & Fawcett, J. Lubr. Technol. 103 (1981) 74, eqs. (3) to (5); Stronge, Impact Mechanics (2000),
chapter 5.
"""

from math import acos, copysign, cos, pi, sqrt
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from validation.reference.normal_motion import Array
from validation.reference.refinement import broadcast

ROUNDING = 1e-13  # forces and velocities are of order one: below this a difference has no sign
MOST_PHASES = 50  # and as many again for each unit of chi; two or three are usual
SAMPLES = 400  # per unit of time and of w, among which roots are bracketed


def frequency_ratio(chi: float) -> float:
    """omega_T/omega_N = sqrt(2 chi)."""
    return sqrt(2.0 * chi)


def full_stick_rebound(psi_1: float, chi: float) -> float:
    """psi_1 cos(pi sqrt(2 chi)): no slip at any time, which the cap allows only in the limit of small psi_1."""
    return psi_1 * cos(pi * frequency_ratio(chi))


class Phase(NamedTuple):
    """A time of stick (side 0) or of slip (its sign and that of the force), from start to end [1/omega_N]; force and
    psi are those at the start."""

    chi: float
    start: float
    side: int
    force: float
    psi: float
    end: float = pi

    def at(self, time: ArrayLike) -> tuple[Array, Array]:
        """F/mu over the greatest normal force, positive where it opposes psi > 0, and psi at instants within it."""
        instants = np.asarray(time, dtype=float)
        if self.side:
            fall = np.cos(instants) - cos(self.start)
            return self.side * np.sin(instants), self.psi + 2.0 * self.chi * self.side * fall
        w, since = frequency_ratio(self.chi), instants - self.start
        sine, cosine = np.sin(w * since), np.cos(w * since)
        return self.force * cosine + self.psi / w * sine, self.psi * cosine - w * self.force * sine


def phases(psi_1: float, chi: float) -> list[Phase]:
    """The phases of an impact, in their order; psi_1 is finite, chi > 0.

    Raises:
        RuntimeError: Rounding makes stick and slip alternate without end.
    """
    slides = abs(psi_1) > 1.0 or (abs(psi_1) == 1.0 and chi < 0.5)
    found: list[Phase] = []
    time, force, psi, side = 0.0, 0.0, float(psi_1), int(copysign(1, psi_1)) if slides else 0
    while time < pi:
        told = float(chi), time, side, force, psi
        time = _end_of_slip(Phase(*told)) if side else _end_of_stick(Phase(*told))
        found.append(Phase(*told, time))
        force, psi = map(float, found[-1].at(time))
        side = 0 if side else int(copysign(1, force))
        if len(found) > MOST_PHASES * (1.0 + chi):
            raise RuntimeError(f"psi_1 = {psi_1!r}, chi = {chi!r}: stick and slip alternate without end near {time!r}")
    return found


def rebound(psi_1: ArrayLike, chi: ArrayLike) -> float | Array:
    """Rebound psi_2; psi_1 and chi broadcast, as for `phases`."""
    return broadcast(lambda psi, ratio: float(phases(psi, ratio)[-1].at(pi)[1]), psi_1, chi)


def _end_of_slip(phase: Phase) -> float:
    """When the slip s psi - P' = s psi_0 - 2 chi v_0 + (2 chi - 1) v of a phase ends."""
    constant, slope = phase.side * phase.psi - 2.0 * phase.chi * cos(phase.start), 2.0 * phase.chi - 1.0
    if constant - slope >= -ROUNDING:  # at release, v = -1, it still slips
        return pi
    if constant + slope * cos(phase.start) <= 0.0:
        return phase.start
    return acos(-constant / slope)


def _end_of_stick(phase: Phase) -> float:
    """When |f| first reaches P; stationary points of P - |f| are sampled too, so that no short excess is missed."""
    w = frequency_ratio(phase.chi)
    time = np.linspace(phase.start, pi, int(SAMPLES * (1.0 + w) * (pi - phase.start)) + 16)
    for side in (1.0, -1.0):

        def slope(instant: ArrayLike, side: float = side) -> Array:
            return np.cos(instant) - side * phase.at(instant)[1]

        values = slope(time)
        turns = np.flatnonzero(values[:-1] * values[1:] < 0.0)
        time = np.union1d(time, [_root(slope, time[i], time[i + 1]) for i in turns])
    over = np.flatnonzero(np.sin(time) - np.abs(phase.at(time)[0]) < -ROUNDING)
    if not over.size:
        return pi
    first = int(over[0])
    side = copysign(1.0, float(phase.at(time[first])[0]))

    def room(instant: float) -> float:
        return float(np.sin(instant) - side * phase.at(instant)[0])

    before = time[max(first - 1, 0)]
    if before == phase.start:  # there the room may be zero: a phase of stick can begin on the cap
        before = phase.start + 1e-9 * (time[first] - phase.start)
    return float(before) if room(before) <= 0.0 else _root(room, before, time[first])


def _root(function: Any, low: float, high: float) -> float:
    root: Any = brentq(function, low, high, xtol=1e-15)
    return float(root)
