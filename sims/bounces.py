"""Bounces of a ball on level surfaces, found in a recording: what it did just before each and just after.

A ball in free flight changes its velocity by gravity alone; where a recording shows anything else, something touched
it. The flights before and after are carried on to the instant at which ball and surface would just touch, so that it
does not matter how finely the recording was made.
"""

from dataclasses import dataclass

import numpy as np

from sims.recording import Array, Recording, Track

FREE = 1e-7  # change of velocity [m/s] beyond gravity's, up to which a ball flies freely


@dataclass(frozen=True)
class Bounce:
    """One bounce.

    Attributes:
        time: Of the touch [s].
        place: Of the ball's centre at the touch [m], shape (3,).
        normal: From the surface to the ball, shape (3,).
        velocity_before, velocity_after: Of the centre at the touch, and where the flight away begins there [m/s].
        spin_before, spin_after: [rad/s], world frame.
        duration: From the touch to where the flight away passes the surface [s]; a little more than the contact's.
    """

    time: float
    place: Array
    normal: Array
    velocity_before: Array
    velocity_after: Array
    spin_before: Array
    spin_after: Array
    duration: float

    def sliding(self, radius: float, axis: int = 0) -> tuple[float, float]:
        """Velocity of the contact point along a world axis, before and after [m/s]."""
        arm = -radius * self.normal
        before = self.velocity_before + np.cross(self.spin_before, arm)
        after = self.velocity_after + np.cross(self.spin_after, arm)
        return float(before[axis]), float(after[axis])

    @property
    def approach(self) -> float:
        """Normal speed at the touch [m/s]."""
        return -float(self.velocity_before @ self.normal)

    @property
    def departure(self) -> float:
        """Normal speed after [m/s]."""
        return float(self.velocity_after @ self.normal)


def bounces_of(recording: Recording, name: str, floor: float = 0.0, ceiling: float = np.inf) -> list[Bounce]:
    """The bounces of a ball between a floor and a ceiling, in order.

    Args:
        recording: With `gravity` [m/s^2] among its facts.
        name: Of the ball.
        floor, ceiling: Heights of the surfaces [m].

    Returns:
        Those that begin and end within the recording; a touch that has not ended is left out.
    """
    track = recording.track(name)
    gravity = np.array(recording.facts["gravity"])
    steps = np.diff(recording.times)
    pushed = np.abs(np.diff(track.velocities, axis=0) - steps[:, None] * gravity).max(axis=1) > FREE
    edges = np.flatnonzero(np.diff(np.concatenate([[False], pushed, [False]]).astype(int)))
    out = []
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        if last >= recording.times.size - 1:  # still touches, or perhaps does
            break
        out.append(_bounce(recording.times, track, gravity, int(first), int(last), floor, ceiling))
    return out


def _bounce(
    times: Array, track: Track, gravity: Array, first: int, last: int, floor: float, ceiling: float
) -> Bounce:  # fmt: skip
    """The bounce between two entries of free flight."""
    rising = float((track.velocities[last] - track.velocities[first])[2]) > 0.0
    normal = np.array([0.0, 0.0, 1.0 if rising else -1.0])
    surface = floor if rising else -ceiling
    pull = float(gravity @ normal)
    ends = []
    for entry, side in ((first, -1.0), (last, 1.0)):
        height = float(track.positions[entry] @ normal) - surface - track.size[0]
        now = float(track.velocities[entry] @ normal)
        there = side * float(np.sqrt(max(now**2 - 2.0 * pull * height, 0.0)))
        # Of both times at which the flight passes the surface the one that is near; no difference of large numbers.
        ends.append(-2.0 * height / (there + now) if there + now else 0.0)
    (velocity_before, velocity_after), places = (
        [track.velocities[entry] + wait * gravity for entry, wait in zip((first, last), ends, strict=True)],
        [track.positions[entry] + wait * (track.velocities[entry] + 0.5 * wait * gravity)
         for entry, wait in zip((first, last), ends, strict=True)],
    )  # fmt: skip
    begin, end = times[first] + ends[0], times[last] + ends[1]
    return Bounce(
        float(begin), places[0], normal, velocity_before, velocity_after, track.spins[first].copy(),
        track.spins[last].copy(), float(end - begin),
    )  # fmt: skip
