"""Normal motion of an impact on a Hertz contact with a dashpot that makes restitution independent of speed.

Units: E* = R = m_N = 1 and approach speed 1, so that k = 4/3 and, with d the overlap,

    d'' = -P        P = max(k d^(3/2) + alpha sqrt(k) d^(1/4) d', 0)        d(0) = 0, d'(0) = 1

The impact ends when the force reaches zero on the way out. Taken against y = d^(5/4) the speed v obeys
v dv/dy = -(4/5)(k y + alpha sqrt(k) v): a linear damped oscillator in the pseudo-time d^(1/4) dt, with damping ratio
alpha/sqrt(5). Its speed where the force vanishes is known in closed form, and with it the restitution.

Sources: Hertz law: Johnson, Contact Mechanics (1985), section 11.4; dashpot: Tsuji, Tanaka & Ishida, Powder Technology
71 (1992) 239-250, here cut off at zero force.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

STIFFNESS = 4.0 / 3.0  # k, with E* = R = 1
TOLERANCE = 1e-12  # relative, of the integrated motion

Array = NDArray[np.float64]


def restitution_of(damping_ratio: float) -> float:
    """Restitution e for a damping ratio alpha/sqrt(5) >= 0; it falls from one towards zero."""
    if damping_ratio < 1.0:
        angle = math.asin(damping_ratio)
        return math.exp(-math.tan(angle) * (math.pi - 2.0 * angle))
    if damping_ratio == 1.0:
        return math.exp(-2.0)
    rate = math.acosh(damping_ratio)
    return math.exp(-2.0 * rate / math.tanh(rate))


@lru_cache(maxsize=256)
def damping(restitution: float) -> float:
    """Damping coefficient alpha that gives the restitution, 0 < restitution <= 1."""
    if restitution == 1.0:
        return 0.0
    upper = 1.0
    while restitution_of(upper) > restitution:
        upper *= 2.0
    ratio: float = brentq(lambda trial: restitution_of(trial) - restitution, 0.0, upper, xtol=1e-15, rtol=1e-14)  # type: ignore[assignment]
    return math.sqrt(5.0) * ratio


class NormalMotion(NamedTuple):
    """Normal motion in the units above: rising instants, overlap d, at most zero out of contact, normal force P, and
    its impulse over the step that ends at each instant, shape (n,) each."""

    time: Array
    overlap: Array
    force: Array
    impulse: Array


@dataclass(frozen=True)
class _Trajectory:
    """The motion as a continuous function, with its landmarks."""

    solution: Callable[[Array], Array]
    alpha: float
    peak_time: float
    peak_overlap: float
    duration: float

    def at(self, time: Array) -> tuple[Array, Array]:
        if time.size == 0:  # scipy's interpolant refuses this
            return time, time
        overlap, speed = self.solution(time)
        return np.maximum(overlap, 0.0), speed

    def times_of(self, overlap: Array, *, outward: bool) -> Array:
        """Instants at which the overlap passes the given values, by bisection, on the way in or out."""
        low = np.full(overlap.size, self.peak_time if outward else 0.0)
        high = np.full(overlap.size, self.duration if outward else self.peak_time)
        for _ in range(60):
            middle = 0.5 * (low + high)
            early = (self.at(middle)[0] < overlap) != outward
            low, high = np.where(early, middle, low), np.where(early, high, middle)
        return high


def hertz_force(overlap: Array) -> Array:
    """Elastic normal force k d^(3/2) for overlap d; none for d < 0."""
    return STIFFNESS * np.maximum(overlap, 0.0) ** 1.5


def contact_force(overlap: Array, speed: Array, alpha: float) -> Array:
    """Normal force P for overlap d >= 0 and its rate."""
    return np.maximum(STIFFNESS * overlap**1.5 + alpha * math.sqrt(STIFFNESS) * overlap**0.25 * speed, 0.0)


@lru_cache(maxsize=64)
def _trajectory(restitution: float) -> _Trajectory:
    alpha = damping(restitution)

    def rate(_: float, state: Array) -> list[float]:
        overlap = max(state[0], 0.0)
        return [state[1], -(STIFFNESS * overlap**1.5 + alpha * math.sqrt(STIFFNESS) * overlap**0.25 * state[1])]

    def peak(_: float, state: Array) -> float:
        return state[1]

    def release(_: float, state: Array) -> float:
        # Force over d^(1/4), on the way out only: it must not see the start, where both vanish.
        if state[1] > 0.0:
            return 1.0
        overlap = max(state[0], 0.0)
        return STIFFNESS * overlap**1.25 + alpha * math.sqrt(STIFFNESS) * state[1] if alpha else state[0]

    release.terminal = True  # type: ignore[attr-defined]
    path = solve_ivp(rate, (0.0, 100.0 / restitution), [0.0, 1.0], "DOP853", events=(peak, release), dense_output=True,
                     rtol=TOLERANCE, atol=1e-14, max_step=0.1)  # fmt: skip
    peak_time, duration = (float(times[0]) for times in path.t_events)
    return _Trajectory(path.sol, alpha, peak_time, float(path.sol(peak_time)[0]), duration)


@lru_cache(maxsize=256)
def impact_motion(restitution: float, annuli: int, steps: int) -> NormalMotion:
    """Normal motion of a whole impact, from touch to release.

    Instants fall where the contact edge passes the middle of an annulus (so that every annulus comes into contact at an
    instant), and between them evenly, no further apart than the duration over `steps`. annuli: equal ones within the
    largest contact radius.
    """
    path = _trajectory(restitution)
    watched = path.peak_overlap * ((np.arange(1, annuli) + 0.5) / annuli) ** 2
    overlap_left = path.at(np.array([path.duration]))[0][0]
    inward = path.times_of(watched, outward=False)
    outward = path.times_of(watched[watched > overlap_left], outward=True)
    landmarks = np.unique(np.concatenate([[0.0, path.peak_time, path.duration], inward, outward]))
    pieces = np.ceil(np.diff(landmarks) * steps / path.duration).astype(int)
    parts = [np.linspace(*ends, n, endpoint=False) for ends, n in zip(pairwise(landmarks), pieces, strict=True)]
    time = np.concatenate([*parts, landmarks[-1:]])
    overlap, speed = path.at(time)
    force = contact_force(overlap, speed, path.alpha)
    force[0] = force[-1] = 0.0
    if restitution == 1.0:
        overlap[-1] = 0.0
    motion = NormalMotion(time, overlap, force, np.concatenate([[0.0], -np.diff(speed)]))
    for array in motion:
        array.setflags(write=False)
    return motion
