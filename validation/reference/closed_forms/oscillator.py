"""Oblique impact on linear springs under a Coulomb cap, piecewise in closed form.

The paper's linearisation: normal and tangential springs in the ratio kappa, so that omega_T/omega_N = sqrt(2 chi) = w.
With time in 1/omega_N, f = F/mu over the greatest force, and v the closing velocity over the approach speed,

    stick   f' = psi, psi' = -2 chi f:    f, psi are sines and cosines of w t
    slip    f = s P, s = +1 or -1:        psi = psi_0 + 2 chi s (v - v_0)

Stick ends where |f| reaches P; slip ends where the spring end keeps up with the body, s psi = P'. These instants are
roots of elementary functions, found to rounding; nothing is stepped in time.

The normal spring may unload stiffer than it loads, k/e^2 instead of k (bimodal, as in Stronge's model), which gives
restitution e: P = sin t up to pi/2, then P = cos((t - pi/2)/e), v = -e sin((t - pi/2)/e).

Sources: Maw, Barber & Fawcett, J. Lubr. Technol. 103 (1981) 74, eqs. (3) to (5); Stronge, Impact Mechanics (2000),
chapter 5.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import copysign, cos, pi, sqrt
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from validation.reference.checks import check_finite, check_positive, check_restitution
from validation.reference.normal_motion import Array

ROUNDING = 1e-13  # forces and velocities are of order one: below this a difference has no sign
MOST_PHASES = 50  # and as many again for each unit of chi; two or three are usual
SAMPLES = 400  # per quarter of the normal oscillation and per unit of w, among which roots are bracketed


def frequency_ratio(chi: float) -> float:
    """omega_T/omega_N = sqrt(2 chi)."""
    check_positive("chi", chi)
    return sqrt(2.0 * chi)


def full_stick_rebound(psi_1: float, chi: float) -> float:
    """psi_1 cos(pi sqrt(2 chi)): no slip at any time, which the cap allows only in the limit of small psi_1."""
    check_finite("psi_1", psi_1)
    return psi_1 * cos(pi * frequency_ratio(chi))


@dataclass(frozen=True)
class NormalSpring:
    """Half a period on a linear spring that unloads with 1/e^2 times its stiffness; times in 1/omega_N.

    Attributes:
        restitution: e, in (0, 1].
    """

    restitution: float = 1.0

    @property
    def duration(self) -> float:
        """From touch to release."""
        return 0.5 * pi * (1.0 + self.restitution)

    def force(self, time: ArrayLike) -> Array:
        """P over its greatest value."""
        late = self._late(time)
        return np.where(late > 0.0, np.cos(late), np.sin(time))

    def force_rate(self, time: ArrayLike) -> Array:
        """dP/dt."""
        late = self._late(time)
        return np.where(late > 0.0, -np.sin(late) / self.restitution, np.cos(time))

    def velocity(self, time: ArrayLike) -> Array:
        """Closing velocity v over the approach speed."""
        late = self._late(time)
        return np.where(late > 0.0, -self.restitution * np.sin(late), np.cos(time))

    def _late(self, time: ArrayLike) -> Array:
        return (np.asarray(time, dtype=float) - 0.5 * pi) / self.restitution


@dataclass(frozen=True)
class Phase:
    """A time of stick or of slip.

    Attributes:
        start, end: [1/omega_N].
        side: 0 in stick, otherwise the sign of the slip and of the force.
        force, psi: At the start.
        chi: (kappa/2) m_N/m_T.
        normal: The normal motion.
    """

    start: float
    end: float
    side: int
    force: float
    psi: float
    chi: float
    normal: NormalSpring

    def force_at(self, time: ArrayLike) -> Array:
        """F/mu over the greatest normal force at instants within the phase; positive where it opposes psi > 0."""
        if self.side:
            return self.side * self.normal.force(time)
        w, since = sqrt(2.0 * self.chi), np.asarray(time, dtype=float) - self.start
        return self.force * np.cos(w * since) + self.psi / w * np.sin(w * since)

    def psi_at(self, time: ArrayLike) -> Array:
        """psi at instants within the phase."""
        if self.side:
            fall = self.normal.velocity(time) - self.normal.velocity(self.start)
            return self.psi + 2.0 * self.chi * self.side * fall
        w, since = sqrt(2.0 * self.chi), np.asarray(time, dtype=float) - self.start
        return self.psi * np.cos(w * since) - w * self.force * np.sin(w * since)


def phases(psi_1: float, chi: float, restitution: float = 1.0) -> list[Phase]:
    """The phases of an impact, in their order.

    Args:
        psi_1: Incidence, finite.
        chi: (kappa/2) m_N/m_T > 0.
        restitution: e in (0, 1], by stiffer unloading of the normal spring.

    Raises:
        ValueError: An argument is outside its range.
        RuntimeError: Rounding makes stick and slip alternate without end.
    """
    check_finite("psi_1", psi_1)
    check_positive("chi", chi)
    check_restitution(restitution)
    normal = NormalSpring(float(restitution))
    slides = abs(psi_1) > 1.0 or (abs(psi_1) == 1.0 and chi < 0.5)
    time, force, psi, side = 0.0, 0.0, float(psi_1), int(copysign(1, psi_1)) if slides else 0
    found: list[Phase] = []
    while time < normal.duration:
        open_end = Phase(time, normal.duration, side, force, psi, float(chi), normal)
        end = _end_of_slip(open_end) if side else _end_of_stick(open_end)
        found.append(Phase(time, end, side, force, psi, float(chi), normal))
        force, psi, time = float(open_end.force_at(end)), float(open_end.psi_at(end)), end
        side = 0 if side else int(copysign(1, force))
        if len(found) > MOST_PHASES * (1.0 + chi):
            raise RuntimeError(f"psi_1 = {psi_1!r}, chi = {chi!r}: stick and slip alternate without end near {time!r}")
    return found


def rebound(psi_1: ArrayLike, chi: ArrayLike, restitution: float = 1.0) -> float | Array:
    """Rebound psi_2; psi_1 and chi broadcast. Arguments and errors as for `phases`."""

    def one(psi: float, ratio: float) -> float:
        last = phases(psi, ratio, restitution)[-1]
        return float(last.psi_at(last.end))

    result = np.vectorize(one, otypes=[float])(psi_1, chi)
    return float(result) if result.ndim == 0 else result


def history(found: list[Phase], time: ArrayLike) -> tuple[Array, Array]:
    """F/mu and psi of an impact at instants from touch to release, each shaped as the instants."""
    instants = np.asarray(time, dtype=float)
    number = np.searchsorted([phase.end for phase in found[:-1]], instants)
    force, psi = np.empty_like(instants), np.empty_like(instants)
    for index, phase in enumerate(found):
        own = number == index
        force[own], psi[own] = phase.force_at(instants[own]), phase.psi_at(instants[own])
    return force, psi


def _pieces(phase: Phase) -> list[tuple[float, float]]:
    """The stretches of a phase on which its functions are smooth."""
    turn = 0.5 * pi
    if phase.start < turn:
        return [(phase.start, turn), (turn, phase.end)]
    return [(phase.start, phase.end)]


def _end_of_slip(phase: Phase) -> float:
    """When the slip of a phase ends; its speed s psi - P' is linear in v, so each piece holds one root at most."""

    def slip(time: float) -> float:
        return float(phase.side * phase.psi_at(time) - phase.normal.force_rate(time))

    for low, high in _pieces(phase):
        if slip(high) < -ROUNDING:
            return low if slip(low) <= 0.0 else _root(slip, low, high)
    return phase.end


def _end_of_stick(phase: Phase) -> float:
    """When |f| first reaches P; stationary points of P - |f| are sampled too, so that no short excess is missed."""
    for low, high in _pieces(phase):
        count = int(SAMPLES * (1.0 + sqrt(2.0 * phase.chi)) * (high - low) / phase.normal.restitution) + 16
        time = np.linspace(low, high, count)
        for side in (1.0, -1.0):

            def slope(instant: ArrayLike, side: float = side) -> Array:
                return phase.normal.force_rate(instant) - side * phase.psi_at(instant)

            values = slope(time)
            turns = np.flatnonzero(values[:-1] * values[1:] < 0.0)
            time = np.union1d(time, [_root(slope, time[i], time[i + 1]) for i in turns])
        over = np.flatnonzero(phase.normal.force(time) - np.abs(phase.force_at(time)) < -ROUNDING)
        if over.size:
            first = int(over[0])
            side = copysign(1.0, float(phase.force_at(time[first])))

            def room(instant: float, side: float = side) -> float:
                return float(phase.normal.force(instant) - side * phase.force_at(instant))

            before = time[max(first - 1, 0)]
            if before == phase.start:  # there the room may be zero: a phase of stick can begin on the cap
                before = phase.start + 1e-9 * (time[first] - phase.start)
            return float(before) if room(before) <= 0.0 else _root(room, before, time[first])
    return phase.end


def _root(function: Callable[[float], Any], low: float, high: float) -> float:
    root: Any = brentq(lambda time: float(function(time)), low, high, xtol=1e-15)
    return float(root)
